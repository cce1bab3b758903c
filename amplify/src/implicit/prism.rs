//! The prism that bounds a heightfield's volume (Paris 2019 §5.1): f_P = 2T·g(d/R), d the distance to
//! (Ω ⊖ B(R)) × [floor, ∞).

use crate::field::{Box3, DensityBounds, THRESHOLD};
use terrain_model::bounds::times_up;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill, wyvill_steepness};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// 2T inside (claims P8: T, as printed, would make the whole solid part of the level set), 0 on the border of Ω. Walls and
/// floor of the solid stand 0.4542 R outside. There is no ceiling: the surface is one.
#[derive(Clone, Debug, PartialEq)]
pub struct Prism {
    /// Ω ⊖ B(R) and the floor; its height is infinite.
    solid: Box3,
    radius: f64,
}

impl Prism {
    /// The prism over the rectangle from `low` to `high` with a floor elevation, all metres; `None` when Ω ⊖ B(R) is
    /// empty or a number is not finite.
    pub fn new(low: glam::DVec2, high: glam::DVec2, floor: f64, radius: f64) -> Option<Prism> {
        let solid = Box3 { low: (low + radius).extend(floor), high: (high - radius).extend(f64::INFINITY) };
        let finite = solid.low.is_finite() && solid.high.truncate().is_finite();
        (finite && radius > 0.0 && radius.is_finite() && !solid.is_empty()).then_some(Prism { solid, radius })
    }
    /// Ω ⊖ B(R) × [floor, ∞).
    pub fn solid(&self) -> &Box3 {
        &self.solid
    }

    /// d², metres².
    #[inline(always)]
    fn distance_squared<R: Real>(&self, p: [R; 3]) -> R {
        let (low, high) = (self.solid.low, self.solid.high);
        let side = |k: usize| {
            let below = R::constant(low[k]) - p[k];
            if k < 2 { below.max(p[k] - R::constant(high[k])) } else { below }.max(R::zero()).square()
        };
        side(0) + side(1) + side(2)
    }
    /// f_P.
    #[inline(always)]
    pub fn density<R: Real>(&self, p: [R; 3]) -> R {
        let u = self.distance_squared(p) / R::constant(self.radius * self.radius);
        R::constant(2.0 * THRESHOLD) * wyvill(u)
    }
    /// Encloses f_P and its slope over a box.
    pub fn bounds(&self, region: &Box3) -> DensityBounds {
        if self.solid.low.cmple(region.low).all() && region.high.cmple(self.solid.high).all() {
            return DensityBounds { range: Interval::point(2.0 * THRESHOLD), slope: 0.0 };
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
        let mut all = self.solid;
        for k in 0..3 {
            all.low[k] = side(all.low[k]).lo();
            if k < 2 {
                all.high[k] = side(all.high[k]).hi();
            }
        }
        all
    }
}
