//! A heightfield as a volume (Paris 2019 §5.1): three parts, each with its own formula. The prism bounds the terrain, the
//! surface field is T on the heightfield, and their intersection is the smaller of the two.

use super::sigmoid::Sigmoid;
use crate::field::{Box3, Density, DensityBounds, THRESHOLD};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_model::bounds::times_up;
use terrain_model::dual::Dual;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill, wyvill_steepness};
use terrain_model::grid::Grid;
use terrain_model::interval::Interval;
use terrain_model::primitive::image::{Image, ImageNumber};
use terrain_model::real::Real;

/// Why a heightfield cannot become a volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeightfieldError {
    /// Samples without elevation.
    #[error("{count} samples have no elevation: fill or crop them first")]
    Holes {
        /// How many.
        count: usize,
    },
    /// Degrees where metres are needed.
    #[error("the grid is geographic: convert it to metres first (terrain convert --local-metres)")]
    Geographic,
    /// Fewer than 2 × 2 samples.
    #[error("a grid of {width} × {height} samples: expected at least 2 × 2")]
    Small {
        /// Samples along x.
        width: usize,
        /// Samples along y.
        height: usize,
    },
    /// A radius that the sigmoid or the domain does not allow.
    #[error("falloff radius {radius} m: expected a positive number below {limit} m")]
    Radius {
        /// What was asked, metres.
        radius: f64,
        /// What the domain's width and the sigmoid allow, metres.
        limit: f64,
    },
    /// A floor above the lowest elevation.
    #[error("floor at {floor} m: expected {limit} m or less, R below the lowest elevation")]
    Floor {
        /// What was asked, metres.
        floor: f64,
        /// The lowest elevation less R, metres.
        limit: f64,
    },
}

/// f = min(f_T, f_P) over the bilinear surface h of a grid.
///
/// - f_T = σ(h(x, y) − z): T on the surface, 2T from R below it, 0 from R above it.
/// - f_P = 2T·g(d/R), d the distance to (Ω ⊖ B(R)) × [floor, ∞): 2T inside (claims P8: T, as printed, would make the
///   whole solid part of the level set), 0 on the border of Ω. Walls and floor of the solid stand 0.4542 R outside.
#[derive(Clone, Debug)]
pub struct Heightfield {
    image: Arc<Image>,
    origin: DVec2,
    spacing: DVec2,
    sigmoid: Sigmoid,
    radius: f64,
    /// Ω ⊖ B(R) and the floor; without a ceiling, since the surface is one.
    prism: Box3,
}

impl Heightfield {
    /// The volume under `grid`, elevations in metres, with the falloff `radius` in metres (R; at least two cells of the
    /// mesh that will be made) and a `floor` elevation.
    ///
    /// # Errors
    /// A [`HeightfieldError`] says what is wrong with grid, radius or floor.
    pub fn new(grid: &Grid<f32>, sigmoid: Sigmoid, radius: f64, floor: f64) -> Result<Heightfield, HeightfieldError> {
        if !grid.is_metric() {
            return Err(HeightfieldError::Geographic);
        }
        let count = grid.no_data_count();
        if count > 0 {
            return Err(HeightfieldError::Holes { count });
        }
        let (width, height) = (grid.width(), grid.height());
        let small = HeightfieldError::Small { width, height };
        let image = Image::new(width, height, grid.values().to_vec()).ok_or(small)?;
        let (low, high) = grid.bounds();
        let limit = (high - low).min_element() * 0.5;
        if !(sigmoid.fits(radius) && radius < limit) {
            let limit = if sigmoid == Sigmoid::Paper { limit.min(3.0 * THRESHOLD) } else { limit };
            return Err(HeightfieldError::Radius { radius, limit });
        }
        let lowest = image.range().lo() - radius;
        if !(floor.is_finite() && floor <= lowest) {
            return Err(HeightfieldError::Floor { floor, limit: lowest });
        }
        let prism = Box3 { low: (low + radius).extend(floor), high: (high - radius).extend(f64::INFINITY) };
        Ok(Heightfield {
            image: Arc::new(image),
            origin: grid.origin(),
            spacing: grid.spacing(),
            sigmoid,
            radius,
            prism,
        })
    }

    /// R, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The elevations' range, metres.
    pub fn elevations(&self) -> Interval {
        self.image.range()
    }

    /// Bytes of samples and of the pyramid that bounds them.
    pub fn bytes(&self) -> [usize; 2] {
        [self.image.bytes(), self.image.acceleration_bytes()]
    }

    #[inline(always)]
    fn samples<R: Real>(&self, [x, y]: [R; 2]) -> [R; 2] {
        let c = R::constant;
        [(x - c(self.origin.x)) / c(self.spacing.x), (y - c(self.origin.y)) / c(self.spacing.y)]
    }

    /// h(x, y), metres; the border's elevation off the grid.
    #[inline(always)]
    pub fn elevation<R: ImageNumber>(&self, p: [R; 2]) -> R {
        R::lookup(&self.image, [0, 0], self.samples(p))
    }

    /// f_T.
    #[inline(always)]
    pub fn surface<R: ImageNumber>(&self, [x, y, z]: [R; 3]) -> R {
        self.sigmoid.value(self.elevation([x, y]) - z, R::constant(self.radius))
    }

    /// The squared distance to (Ω ⊖ B(R)) × [floor, ∞), metres².
    #[inline(always)]
    fn prism_distance_squared<R: Real>(&self, p: [R; 3]) -> R {
        let (low, high) = (self.prism.low, self.prism.high);
        let side = |k: usize| {
            let below = R::constant(low[k]) - p[k];
            if high[k].is_finite() { below.max(p[k] - R::constant(high[k])) } else { below }.max(R::zero()).square()
        };
        side(0) + side(1) + side(2)
    }

    /// f_P.
    #[inline(always)]
    pub fn prism<R: Real>(&self, p: [R; 3]) -> R {
        let u = self.prism_distance_squared(p) / R::constant(self.radius).square();
        R::constant(2.0 * THRESHOLD) * wyvill(u)
    }

    /// f, one formula for every number.
    #[inline(always)]
    pub fn density<R: ImageNumber>(&self, p: [R; 3]) -> R {
        self.surface(p).min(self.prism(p))
    }

    /// f_T over a box: its slope is |σ′|·√(1 + ‖∇h‖²), each over what occurs there.
    pub fn surface_bounds(&self, region: &Box3) -> DensityBounds {
        let [x, y, z] = region.intervals();
        let [u, v] = self.samples([x, y]);
        let [h, du, dv] = self.image.enclose(u, v);
        let below = h - z;
        let range = self.sigmoid.value(below, Interval::point(self.radius));
        if below.lo() >= self.radius || below.hi() <= -self.radius {
            return DensityBounds { range, slope: 0.0 };
        }
        let [dx, dy] = [du / Interval::point(self.spacing.x), dv / Interval::point(self.spacing.y)];
        let steep = Real::sqrt(Interval::point(1.0) + dx.square() + dy.square()).hi();
        DensityBounds { range, slope: times_up(self.sigmoid.slope(self.radius), steep) }
    }

    /// f_P over a box.
    pub fn prism_bounds(&self, region: &Box3) -> DensityBounds {
        let radius = Interval::point(self.radius);
        let u = self.prism_distance_squared(region.intervals()) / radius.square();
        let u = Interval::new(u.lo().max(0.0), u.hi());
        let range = Interval::point(2.0 * THRESHOLD) * wyvill(u);
        let steep = if u.hi() == 0.0 || u.lo() >= 1.0 { 0.0 } else { wyvill_steepness(u).min(WYVILL_SLOPE) };
        DensityBounds { range, slope: times_up(2.0 * THRESHOLD, (Interval::point(steep) / radius).hi()) }
    }
}

impl Density for Heightfield {
    fn value(&self, p: DVec3) -> f64 {
        self.density(p.to_array())
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        let p: [Dual<f64, 3>; 3] = std::array::from_fn(|k| Dual::variable(p[k], k));
        let f = self.density(p);
        (f.value, DVec3::from_array(f.slope))
    }
    /// The minimum of two fields lies in the minimum of their ranges; it is steeper than neither, and follows one alone
    /// where that is everywhere below the other.
    fn bounds(&self, region: &Box3) -> DensityBounds {
        let (surface, prism) = (self.surface_bounds(region), self.prism_bounds(region));
        if surface.range.hi() <= prism.range.lo() {
            surface
        } else if prism.range.hi() <= surface.range.lo() {
            prism
        } else {
            DensityBounds { range: Real::min(surface.range, prism.range), slope: surface.slope.max(prism.slope) }
        }
    }
    fn support(&self) -> Box3 {
        let reach = Interval::symmetric(self.radius);
        let low = self.prism.low.to_array().map(|x| (Interval::point(x) + reach).lo());
        let high = [0, 1].map(|k| (Interval::point(self.prism.high[k]) + reach).hi());
        let top = (self.elevations() + reach).hi();
        Box3 { low: DVec3::from_array(low), high: DVec3::new(high[0], high[1], top) }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A wavy plane of 33 × 25 samples, 2 by 3 metres apart.
    pub(crate) fn waves() -> Grid<f32> {
        let value = |i: usize, j: usize| {
            let (x, y) = (i as f64 * 0.4, j as f64 * 0.3);
            (6.0 * libm::sin(x) + 4.0 * libm::cos(y + 0.5 * x)) as f32
        };
        let values = (0..33 * 25).map(|k| value(k % 33, k / 33)).collect();
        Grid::new(DVec2::new(100.0, -20.0), DVec2::new(2.0, 3.0), 33, 25, values).unwrap()
    }

    fn field(sigmoid: Sigmoid, radius: f64) -> Heightfield {
        Heightfield::new(&waves(), sigmoid, radius, -30.0).unwrap()
    }

    fn at(field: &Heightfield, t: [f64; 3]) -> DVec3 {
        let support = field.support();
        support.low + (support.high - support.low) * DVec3::from_array(t.map(|t| 1.1 * t - 0.05))
    }

    #[test]
    fn the_surface_is_where_the_heightfield_is() {
        let f = field(Sigmoid::UnitFree, 4.0);
        for (_, _, p, z) in waves().positions() {
            let p = p.extend(f64::from(z));
            let inside = f.prism.low.x < p.x && p.x < f.prism.high.x && f.prism.low.y < p.y && p.y < f.prism.high.y;
            if inside {
                assert_eq!(f.value(p), THRESHOLD);
                assert!(f.value(p - DVec3::Z * 0.01) > THRESHOLD && f.value(p + DVec3::Z * 0.01) < THRESHOLD);
            }
        }
    }

    /// Claims P8: with f_P = T inside, as printed, f would be T on the whole solid.
    #[test]
    fn the_solid_is_above_t_inside_and_its_walls_stand_0_4542_r_outside_the_prism() {
        let f = field(Sigmoid::UnitFree, 4.0);
        let deep = DVec3::new(130.0, 10.0, -25.0);
        assert_eq!(f.value(deep), 2.0 * THRESHOLD);
        let wall = DVec3::new(f.prism.high.x + 0.4542 * 4.0, 10.0, -25.0);
        assert!((f.value(wall) - THRESHOLD).abs() < 1e-4);
        let floor = DVec3::new(130.0, 10.0, -30.0 - 0.4542 * 4.0);
        assert!((f.value(floor) - THRESHOLD).abs() < 1e-4);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn a_heightfield_is_within_its_bounds_over_every_box(
            a in prop::array::uniform3(0.0f64..1.0), b in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..0.5,
            u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0), paper in any::<bool>(),
        ) {
            let f = if paper { field(Sigmoid::Paper, 1.5) } else { field(Sigmoid::UnitFree, 5.0) };
            let corner = at(&f, a);
            let region = Box3::new(corner, corner.lerp(at(&f, b), size * size));
            let bounds = f.bounds(&region);
            let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
                .clamp(region.low, region.high);
            let (p, q) = (inside(u), inside(v));
            let (value, other) = (f.value(p), f.value(q));
            prop_assert!(bounds.range.contains(value), "{value} in {bounds:?}");
            prop_assert!((value - other).abs() <= bounds.slope * p.distance(q) + 1e-13, "{bounds:?}");
            prop_assert!(f.density(region.intervals()).contains(value));
            prop_assert!(f.support().contains(p) || value.abs() < 1e-15, "{value} at {p}");
            let (sampled, gradient) = f.sample(p);
            prop_assert_eq!(sampled, value);
            prop_assert!(gradient.length() <= bounds.slope * (1.0 + 1e-12) + 1e-13);
        }
    }

    #[test]
    fn what_cannot_become_a_volume_is_refused() {
        let refuse = |sigmoid, radius, floor| Heightfield::new(&waves(), sigmoid, radius, floor).unwrap_err();
        assert!(matches!(refuse(Sigmoid::Paper, 2.0, -30.0), HeightfieldError::Radius { limit, .. } if limit == 1.5));
        assert!(matches!(refuse(Sigmoid::UnitFree, 32.0, -90.0), HeightfieldError::Radius { .. }));
        assert!(matches!(refuse(Sigmoid::UnitFree, 4.0, 0.0), HeightfieldError::Floor { .. }));
        let holes = waves().with_no_data(Some(waves().values()[7]));
        assert!(matches!(
            Heightfield::new(&holes, Sigmoid::UnitFree, 4.0, -30.0),
            Err(HeightfieldError::Holes { count: 1 })
        ));
    }
}
