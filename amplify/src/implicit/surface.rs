//! The heightfield surface (Paris 2019 §5.1): σ of the distance below the bilinear surface h of a grid, T on it, 2T from R
//! below, 0 from R above. The distance is vertical, as in the paper, or divided by the steepness around.

use super::sigmoid::Sigmoid;
use super::volume::VolumeNumber;
use crate::field::{Box3, DensityBounds, THRESHOLD};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use terrain_model::bounds::{plus_up, times_up};
use terrain_model::grid::Grid;
use terrain_model::interval::Interval;
use terrain_model::primitive::image::Image;
use terrain_model::real::Real;

/// How far below the surface a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distance {
    /// v = h − z, as printed: on a slope of 80° the field changes six times as fast as on the flat.
    Vertical,
    /// v/√(1 + s²), s the least field with s ≥ ‖∇h‖ whose slope is at most 1/R: near the surface the field changes by no
    /// more than σ′ a metre, whatever the slope, and R metres away by half as much again.
    #[default]
    Normalised,
}

/// f_T of one grid.
#[derive(Debug)]
pub struct Surface {
    heights: Image,
    /// s, one sample for each of `heights`.
    steepness: Option<Image>,
    origin: DVec2,
    spacing: DVec2,
    sigmoid: Sigmoid,
    radius: f64,
}

/// Covers the rounding of the few dozen operations behind a slope.
const ROUNDING: f64 = 1.0 + 1e-12;

impl Surface {
    /// The surface of a grid without unknown samples, in metres, with falloff `radius` in metres; `None` where it is not one.
    pub fn new(grid: &Grid<f32>, sigmoid: Sigmoid, distance: Distance, radius: f64) -> Option<Surface> {
        let (width, height) = (grid.width(), grid.height());
        let heights = Image::new(width, height, grid.values().to_vec())?;
        let steepness = match distance {
            Distance::Vertical => None,
            Distance::Normalised => Some(Image::new(width, height, steepness(grid, 1.0 / radius))?),
        };
        let (origin, spacing) = (grid.origin(), grid.spacing());
        Some(Surface { heights, steepness, origin, spacing, sigmoid, radius })
    }
    /// R, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }
    /// Metres between samples along x and y.
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }
    /// Which distance.
    pub fn distance(&self) -> Distance {
        if self.steepness.is_some() { Distance::Normalised } else { Distance::Vertical }
    }
    /// The elevations' range, metres.
    pub fn elevations(&self) -> Interval {
        self.heights.range()
    }
    /// Bytes of samples and of the pyramids that bound them.
    pub fn bytes(&self) -> [usize; 2] {
        let images = std::iter::once(&self.heights).chain(&self.steepness);
        images.fold([0; 2], |[a, b], image| [a + image.bytes(), b + image.acceleration_bytes()])
    }

    /// Encloses the elevations over the ground of a box, metres.
    pub fn elevations_over(&self, region: &Box3) -> Interval {
        let [x, y, _] = region.intervals();
        let [u, v] = self.samples([x, y]);
        self.heights.enclose(u, v)[0]
    }

    #[inline(always)]
    fn samples<R: Real>(&self, [x, y]: [R; 2]) -> [R; 2] {
        let c = R::constant;
        [(x - c(self.origin.x)) / c(self.spacing.x), (y - c(self.origin.y)) / c(self.spacing.y)]
    }

    /// h(x, y) in metres, the border's elevation off the grid, and 1/√(1 + s²), without unit.
    #[inline(always)]
    pub fn column<R: VolumeNumber>(&self, p: [R; 2]) -> [R; 2] {
        let at = self.samples(p);
        let height = R::lookup(&self.heights, [0, 0], at);
        let Some(steepness) = &self.steepness else { return [height, R::one()] };
        let s = R::lookup(steepness, [0, 0], at);
        [height, R::one() / (R::one() + s.square()).sqrt()]
    }
    /// f_T at elevation `z` of a column.
    #[inline(always)]
    pub fn on_column<R: Real>(&self, [height, shrink]: [R; 2], z: R) -> R {
        let below = height - z;
        // Without steepness the factor is 1, and a product with 1 is exact.
        self.sigmoid.value(below * shrink, R::constant(self.radius))
    }
    /// f_T.
    #[inline(always)]
    pub fn density<R: VolumeNumber>(&self, [x, y, z]: [R; 3]) -> R {
        self.on_column(self.column([x, y]), z)
    }

    /// Encloses f_T and its slope over a box.
    ///
    /// With x = v·q, q = 1/√(1 + s²): ∂x = q·∂v − v·s·q³·∇s. The first part has norm q·√(1 + ‖∇h‖²), at most 1 as
    /// s ≥ ‖∇h‖; the second |x|·s/(1 + s²)·‖∇s‖ with |x| ≤ R where σ is not constant, and s/(1 + s²) ≤ ½. The slope is
    /// the smaller of that and of what the enclosed parts give, times σ′ over what occurs.
    pub fn bounds(&self, region: &Box3) -> DensityBounds {
        let [x, y, z] = region.intervals();
        let [u, v] = self.samples([x, y]);
        let spacing = self.spacing.to_array().map(Interval::point);
        let [h, du, dv] = self.heights.enclose(u, v);
        let [dx, dy] = [du / spacing[0], dv / spacing[1]];
        let below = h - z;
        let one = Interval::point(1.0);
        let radius = Interval::point(self.radius);
        let Some(steepness) = &self.steepness else {
            if let Some(constant) = constant(below, self.radius) {
                return constant;
            }
            let range = self.sigmoid.enclose(below, self.radius);
            let steep = Real::sqrt(one + dx.square() + dy.square()).hi();
            return DensityBounds {
                range,
                slope: times_up(self.sigmoid.steepness(below / radius, self.radius), steep),
            };
        };
        let [s, du, dv] = steepness.enclose_cells(u, v);
        let [sx, sy] = [du / spacing[0], dv / spacing[1]];
        let shrink = one / Real::sqrt(one + s.square());
        let depth = below * shrink;
        if let Some(constant) = constant(depth, self.radius) {
            return constant;
        }
        let range = self.sigmoid.enclose(depth, self.radius);
        let steep = self.sigmoid.steepness(depth / radius, self.radius);
        let reach = depth.magnitude().min(self.radius);
        let share = (s / (one + s.square())).magnitude().min(0.5);
        let turn = times_up(times_up(reach, share), Real::sqrt(sx.square() + sy.square()).hi());
        let direct = times_up(shrink.hi(), Real::sqrt(one + dx.square() + dy.square()).hi());
        DensityBounds { range, slope: times_up(steep, plus_up(direct.min(ROUNDING), turn)) }
    }

    /// f_T is 0 above this elevation, metres: R above the highest sample, farther where the distance is shortened.
    pub fn top(&self) -> f64 {
        let stretch = self.steepness.as_ref().map_or(1.0, |s| {
            let s = Interval::point(s.range().hi());
            Real::sqrt(Interval::point(1.0) + s.square()).hi()
        });
        (self.elevations() + Interval::symmetric(times_up(self.radius, stretch))).hi()
    }
    /// The ground that has samples, low and high corner.
    pub fn ground(&self) -> [DVec2; 2] {
        let cells = DVec2::new(self.heights.width() as f64 - 1.0, self.heights.height() as f64 - 1.0);
        [self.origin, self.origin + cells * self.spacing]
    }
    /// f_T is 0 off this box: as wide as space, since the border's elevation goes on.
    pub fn support(&self) -> Box3 {
        let mut all = Box3 { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
        all.high.z = self.top();
        all
    }
}

/// f_T where it is the same all over: without rounding, so that it is known to be left out.
fn constant(depth: Interval, radius: f64) -> Option<DensityBounds> {
    if depth.hi() <= -radius {
        Some(DensityBounds::ZERO)
    } else if depth.lo() >= radius {
        Some(DensityBounds { range: Interval::point(2.0 * THRESHOLD), slope: 0.0 })
    } else {
        None
    }
}

/// At each sample the largest ‖∇h‖ over the cells around it, so that the bilinear field of these is at least ‖∇h‖
/// everywhere; raised to the least field above it that changes along each axis by at most slope/√2 a metre, so by `slope`
/// in every direction. The distance in which it falls is the sum of those along the axes: one pass each way along each.
fn steepness(grid: &Grid<f32>, slope: f64) -> Vec<f32> {
    let (width, height) = (grid.width(), grid.height());
    let spacing = grid.spacing();
    let h = |i: usize, j: usize| f64::from(grid.values()[j * width + i]);
    let mut field = vec![0.0f64; width * height];
    for j in 0..height - 1 {
        for i in 0..width - 1 {
            let along = (h(i + 1, j) - h(i, j)).abs().max((h(i + 1, j + 1) - h(i, j + 1)).abs()) / spacing.x;
            let across = (h(i, j + 1) - h(i, j)).abs().max((h(i + 1, j + 1) - h(i + 1, j)).abs()) / spacing.y;
            let steep = (along * along + across * across).sqrt();
            for corner in [j * width + i, j * width + i + 1, (j + 1) * width + i, (j + 1) * width + i + 1] {
                field[corner] = field[corner].max(steep);
            }
        }
    }
    let drop = spacing * (slope * std::f64::consts::FRAC_1_SQRT_2);
    for row in field.chunks_exact_mut(width) {
        (1..width).for_each(|i| row[i] = row[i].max(row[i - 1] - drop.x));
        (1..width).rev().for_each(|i| row[i - 1] = row[i - 1].max(row[i] - drop.x));
    }
    (width..field.len()).for_each(|k| field[k] = field[k].max(field[k - width] - drop.y));
    (width..field.len()).rev().for_each(|k| field[k - width] = field[k - width].max(field[k] - drop.y));
    // Upward: the inequality survives the rounding.
    field.into_iter().map(|s| (s as f32).next_up()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::heightfield::tests::waves;
    use super::*;
    use proptest::prelude::*;
    use terrain_model::dual::Dual;

    fn surfaces() -> [Surface; 3] {
        let of = |sigmoid, distance, radius| Surface::new(&waves(), sigmoid, distance, radius).unwrap();
        [
            of(Sigmoid::UnitFree, Distance::Vertical, 4.0),
            of(Sigmoid::UnitFree, Distance::Normalised, 5.0),
            of(Sigmoid::Paper, Distance::Normalised, 1.5),
        ]
    }

    fn at(t: [f64; 3]) -> DVec3 {
        DVec3::new(100.0, -20.0, -18.0) + DVec3::from_array(t) * DVec3::new(64.0, 72.0, 36.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn a_surface_is_within_its_bounds_over_every_box(
            a in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..1.0, which in 0usize..3,
            u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0),
        ) {
            let f = &surfaces()[which];
            let low = at(a);
            let region = Box3::new(low, low + 20.0 * size * size * size);
            let bounds = f.bounds(&region);
            let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
                .clamp(region.low, region.high);
            let (p, q) = (inside(u), inside(v));
            let (value, other) = (f.density(p.to_array()), f.density(q.to_array()));
            prop_assert!(bounds.range.contains(value), "{value} in {bounds:?}");
            prop_assert!((value - other).abs() <= bounds.slope * p.distance(q) + 1e-13, "{bounds:?}");
            prop_assert!(f.density(region.intervals()).contains(value));
            prop_assert!(p.z < f.top() || value == 0.0);
        }
    }

    #[test]
    fn the_steepness_field_is_above_the_slope_everywhere_and_gentle() {
        let f = &surfaces()[1];
        let s = f.steepness.as_ref().unwrap();
        for k in 0..4000u32 {
            let t = [k % 61, k / 61].map(|k| f64::from(k) / 66.0);
            let p = at([t[0], t[1], 0.0]);
            let at: [Dual<f64, 2>; 2] = [Dual::variable(p.x, 0), Dual::variable(p.y, 1)];
            let [height, shrink] = f.column(at);
            let slope = DVec2::from_array(height.slope).length();
            assert!(shrink.value <= 1.0 / (1.0 + slope * slope).sqrt() * (1.0 + 1e-12));
            let u = f.samples([p.x, p.y].map(Interval::point));
            let [_, du, dv] = s.enclose(u[0], u[1]);
            let steep = DVec2::new(du.magnitude() / 2.0, dv.magnitude() / 3.0).length();
            assert!(steep <= (1.0 + 1e-5) / 5.0, "{steep}");
        }
    }

    /// Near the surface σ′ is all: an eighth of a cube around any of its points, and however steep it is.
    #[test]
    fn the_normalised_field_is_as_steep_on_a_cliff_as_on_the_flat() {
        let [vertical, normalised, _] = surfaces();
        let steepest = |f: &Surface| {
            waves().positions().fold(0.0f64, |most, (_, _, p, z)| {
                most.max(f.bounds(&Box3::around(p.extend(f64::from(z)), 1e-3)).slope)
            })
        };
        let flat = |f: &Surface| f.sigmoid.slope(f.radius);
        assert!(steepest(&vertical) > 1.8 * flat(&vertical));
        assert!(steepest(&normalised) < 1.001 * flat(&normalised));
    }
}
