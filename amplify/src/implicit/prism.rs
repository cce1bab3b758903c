//! The prism that bounds a heightfield's volume (Paris 2019 §5.1): f_P = 2T·g(d/R), d the distance to
//! (Ω ⊖ B(R)) × [floor, ∞), Ω a rectangle or any polygons.

use super::outline::{Outline, OutlineError};
use super::volume::VolumeNumber;
use crate::field::{Box3, DensityBounds, THRESHOLD};
use glam::DVec2;
use std::sync::Arc;
use terrain_model::bounds::times_up;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill, wyvill_steepness};
use terrain_model::interval::Interval;

/// 2T inside (claims P8: T, as printed, would make the whole solid part of the level set), 0 on the border of Ω. Walls and
/// floor of the solid stand 0.4542 R outside. There is no ceiling: the surface is one.
#[derive(Clone, Debug)]
pub struct Prism {
    domain: Domain,
    /// The box of Ω ⊖ B(R), and the floor; its height is infinite.
    extent: Box3,
    radius: f64,
}

/// What Ω ⊖ B(R) is.
#[derive(Clone, Debug)]
enum Domain {
    /// The prism's box.
    Rectangle,
    Polygon(Arc<Outline>),
}

impl Prism {
    /// The prism over the rectangle from `low` to `high` with a floor elevation, all metres; `None` when Ω ⊖ B(R) is
    /// empty or a number is not finite.
    pub fn new(low: DVec2, high: DVec2, floor: f64, radius: f64) -> Option<Prism> {
        let extent = Box3 { low: (low + radius).extend(floor), high: (high - radius).extend(f64::INFINITY) };
        let finite = extent.low.is_finite() && extent.high.truncate().is_finite();
        let sound = finite && radius > 0.0 && radius.is_finite() && !extent.is_empty();
        sound.then_some(Prism { domain: Domain::Rectangle, extent, radius })
    }
    /// The prism over the domain that closed `rings` bound, as [`Outline::eroded`] reads them, with a floor elevation, all
    /// metres.
    ///
    /// # Errors
    /// [`OutlineError`] says what is wrong with rings, radius or floor.
    pub fn over(rings: &[Vec<DVec2>], floor: f64, radius: f64) -> Result<Prism, OutlineError> {
        if !floor.is_finite() {
            return Err(OutlineError::Floor { floor });
        }
        let outline = Outline::eroded(rings, radius)?;
        let [low, high] = outline.extent();
        let extent = Box3 { low: low.extend(floor), high: high.extend(f64::INFINITY) };
        Ok(Prism { domain: Domain::Polygon(Arc::new(outline)), extent, radius })
    }
    /// The smallest box around Ω ⊖ B(R) × [floor, ∞).
    pub fn extent(&self) -> &Box3 {
        &self.extent
    }
    /// Ω ⊖ B(R), unless Ω is a rectangle.
    pub fn outline(&self) -> Option<&Outline> {
        match &self.domain {
            Domain::Rectangle => None,
            Domain::Polygon(outline) => Some(outline),
        }
    }

    /// d², metres², where f_P is not 0.
    #[inline(always)]
    fn distance_squared<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        let (low, high) = (self.extent.low, self.extent.high);
        let below = |k: usize| R::constant(low[k]) - p[k];
        let squared = |x: R| x.max(R::zero()).square();
        let side = |k: usize| squared(below(k).max(p[k] - R::constant(high[k])));
        match &self.domain {
            Domain::Rectangle => side(0) + side(1) + squared(below(2)),
            Domain::Polygon(outline) => R::outline_distance(outline, [p[0], p[1]]).square() + squared(below(2)),
        }
    }
    /// What the plane distance is over a box, if it is the same all over: 0, or R where it is that or more.
    fn constant(&self, region: &Box3) -> Option<f64> {
        let [x, y, _] = region.intervals();
        match &self.domain {
            Domain::Polygon(outline) => outline.constant([x, y]),
            Domain::Rectangle => {
                let (own, other) = (&self.extent, region);
                let inside = |k: usize| own.low[k] <= other.low[k] && other.high[k] <= own.high[k];
                (inside(0) && inside(1)).then_some(0.0)
            }
        }
    }
    /// f_P.
    #[inline(always)]
    pub fn density<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        let u = self.distance_squared(p) / R::constant(self.radius * self.radius);
        R::constant(2.0 * THRESHOLD) * wyvill(u)
    }
    /// Encloses f_P and its slope over a box.
    pub fn bounds(&self, region: &Box3) -> DensityBounds {
        match self.constant(region) {
            Some(0.0) if self.extent.low.z <= region.low.z => {
                return DensityBounds { range: Interval::point(2.0 * THRESHOLD), slope: 0.0 };
            }
            Some(distance) if distance > 0.0 => return DensityBounds::ZERO,
            _ => {}
        }
        let radius = Interval::point(self.radius);
        let u = self.distance_squared(region.intervals()) / Interval::point(self.radius * self.radius);
        let u = Interval::new(u.lo().max(0.0), u.hi());
        let range = Interval::point(2.0 * THRESHOLD) * wyvill(u);
        let steep = if u.lo() >= 1.0 { 0.0 } else { wyvill_steepness(u).min(WYVILL_SLOPE) };
        // R² is rounded once.
        let slope = times_up(2.0 * THRESHOLD, (Interval::point(steep) / radius).hi());
        DensityBounds { range, slope: times_up(slope, 1.0 + 4.0 * f64::EPSILON) }
    }
    /// f_P is 0 off this box.
    pub fn support(&self) -> Box3 {
        let reach = Interval::symmetric(self.radius * (1.0 + 4.0 * f64::EPSILON));
        let side = |x: f64| Interval::point(x) + reach;
        let mut all = self.extent;
        for k in 0..3 {
            all.low[k] = side(all.low[k]).lo();
            if k < 2 {
                all.high[k] = side(all.high[k]).hi();
            }
        }
        all
    }
}
