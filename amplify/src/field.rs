//! What every field of the volume answers: its value, its gradient, an enclosure over a box, and where it can be
//! non-zero. Tracers and meshers know fields by this alone.

use glam::DVec3;
use terrain_model::interval::Interval;

/// T: the surface is {f = T}, rock where f > T (Paris 2019 §5).
pub const THRESHOLD: f64 = 0.5;

/// An axis-parallel box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Box3 {
    /// Smallest x, y and z.
    pub low: DVec3,
    /// Largest x, y and z; a component below that of `low` makes the box empty.
    pub high: DVec3,
}

impl Box3 {
    /// Holds no point.
    pub const EMPTY: Box3 = Box3 { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The box between two opposite corners.
    pub fn new(a: DVec3, b: DVec3) -> Box3 {
        Box3 { low: a.min(b), high: a.max(b) }
    }
    /// The cube of half width `radius` about `centre`, rounded outward.
    pub fn around(centre: DVec3, radius: f64) -> Box3 {
        let side = |c: f64| Interval::point(c) + Interval::symmetric(radius);
        let [x, y, z] = centre.to_array().map(side);
        Box3 { low: DVec3::new(x.lo(), y.lo(), z.lo()), high: DVec3::new(x.hi(), y.hi(), z.hi()) }
    }
    /// Does it hold no point?
    pub fn is_empty(&self) -> bool {
        !self.low.cmple(self.high).all()
    }
    /// Do the two share a point?
    pub fn meets(&self, other: &Box3) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
    /// Is `p` in it?
    pub fn contains(&self, p: DVec3) -> bool {
        self.low.cmple(p).all() && p.cmple(self.high).all()
    }
    /// The smallest box around both.
    #[must_use]
    pub fn hull(&self, other: &Box3) -> Box3 {
        Box3 { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
    /// What both hold.
    #[must_use]
    pub fn meet(&self, other: &Box3) -> Box3 {
        Box3 { low: self.low.max(other.low), high: self.high.min(other.high) }
    }
    /// Its coordinates as intervals.
    pub fn intervals(&self) -> [Interval; 3] {
        std::array::from_fn(|k| Interval::new(self.low[k], self.high[k]))
    }
    /// Encloses the squared distances from `centre` to its points, metres².
    ///
    /// A difference errs by half an ulp of itself, its square by three, a sum of three squares by five in all: far less than
    /// the share that the ends are moved by. Squares too small for a normal number are covered by the smallest of these.
    pub fn distance_squared(&self, centre: DVec3) -> Interval {
        const SLACK: f64 = 16.0 * f64::EPSILON;
        let (below, above) = (self.low - centre, centre - self.high);
        let near = below.max(above).max(DVec3::ZERO).length_squared();
        let far = below.abs().max(above.abs()).length_squared();
        Interval::new(near * (1.0 - SLACK), far * (1.0 + SLACK) + f64::MIN_POSITIVE)
    }
}

/// A field over a box: an enclosure of f and the largest |Δf|/|Δp| between two points of the box, 1/metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityBounds {
    /// Encloses f.
    pub range: Interval,
    /// Lipschitz constant on the box; `f64::INFINITY` where there is none.
    pub slope: f64,
}

impl DensityBounds {
    /// The field 0.
    pub const ZERO: DensityBounds = DensityBounds { range: Interval::ZERO, slope: 0.0 };
}

/// What is done with z ↦ f(x, y, z).
pub type WithVertical<'a> = dyn FnMut(&dyn Fn(f64) -> f64) + 'a;

/// A field f: R³ → R, rock where f exceeds [`THRESHOLD`] (Paris 2019 §5).
pub trait Density: Clone + Send + Sync {
    /// f at `p`.
    fn value(&self, p: DVec3) -> f64;
    /// f at each of `points`, the same numbers as [`Density::value`] gives, faster where a field can order the work.
    fn values(&self, points: &[DVec3]) -> Vec<f64> {
        points.iter().map(|&p| self.value(p)).collect()
    }
    /// f and ∇f at `p`, one traversal. Where f has a crease, ∇f is the gradient of one side.
    fn sample(&self, p: DVec3) -> (f64, DVec3);
    /// Encloses f and its slope over `region`.
    fn bounds(&self, region: &Box3) -> DensityBounds;
    /// Off this box there is air: f ≤ 0.
    fn support(&self) -> Box3;
    /// [`Density::bounds`], and a field that has the same values in `region`, to the bit, and is no slower.
    fn narrow(&self, region: &Box3) -> (DensityBounds, Self) {
        (self.bounds(region), self.clone())
    }
    /// Is it bare ground, so that a value is a look-up of an elevation or the distance to a wall?
    fn is_bare(&self) -> bool {
        false
    }
    /// Calls `f` once with z ↦ f(x, y, z), the numbers that [`Density::value`] gives: what depends on x and y alone is then
    /// computed once.
    fn along_z(&self, [x, y]: [f64; 2], f: &mut WithVertical<'_>) {
        f(&|z| self.value(DVec3::new(x, y, z)));
    }
    /// f at the corners of a block: `out[(k·ny + j)·nx + i]` is `f(x[i], y[j], z[k])`, the numbers that [`Density::value`]
    /// gives.
    fn fill(&self, axes: [&[f64]; 3], out: &mut [f64]) {
        let [xs, ys, zs] = axes;
        let mut slots = out.iter_mut();
        for &z in zs {
            for &y in ys {
                for (&x, slot) in xs.iter().zip(&mut slots) {
                    *slot = self.value(DVec3::new(x, y, z));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain_model::real::Real;

    #[test]
    fn a_cube_around_a_point_holds_its_corners_whatever_the_rounding() {
        let cube = Box3::around(DVec3::splat(0.1), 0.2);
        assert!(cube.contains(DVec3::splat(0.1 + 0.2)) && cube.contains(DVec3::splat(0.1 - 0.2)));
        assert!(!cube.contains(DVec3::splat(0.31)));
    }

    #[test]
    fn squared_distances_of_a_box_are_enclosed() {
        let b = Box3::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 4.0));
        let d = b.distance_squared(DVec3::ZERO);
        assert!((d.lo() - 4.0).abs() < 1e-12 && (d.hi() - 26.0).abs() < 1e-12, "{d:?}");
        // Against the same in intervals, over corners of every magnitude.
        for k in 0..4000u32 {
            let random = |j: u32| {
                let bits = terrain_model::noise::hash::mix(9, 12 * k + j);
                let size = [1e-170, 1e-9, 1.0, 1e9][(bits & 3) as usize];
                size * (f64::from(bits) / 4_294_967_296.0 - 0.5)
            };
            let at = |j: u32| DVec3::new(random(j), random(j + 1), random(j + 2));
            let (b, c) = (Box3::new(at(0), at(3)), at(6));
            let [x, y, z] = b.intervals();
            let squared = |x: Interval, c: f64| Real::square(x - Interval::point(c));
            let exact = squared(x, c.x) + squared(y, c.y) + squared(z, c.z);
            let fast = b.distance_squared(c);
            // The interval's own ends err outward by as much again.
            let slack = 1e-14 * exact.hi() + f64::MIN_POSITIVE;
            assert!(fast.hi() >= exact.hi() - slack && fast.lo() <= exact.lo() + slack, "{fast:?} {exact:?}");
            let p = b.low.lerp(b.high, random(9).abs().min(1.0)).clamp(b.low, b.high);
            assert!(fast.contains(p.distance_squared(c)), "{fast:?}");
        }
    }

    #[test]
    fn the_empty_box_meets_nothing_and_adds_nothing() {
        let b = Box3::new(DVec3::ZERO, DVec3::ONE);
        assert!(Box3::EMPTY.is_empty() && !Box3::EMPTY.meets(&b));
        assert_eq!(b.hull(&Box3::EMPTY), b);
        assert!(b.meet(&Box3::new(DVec3::splat(2.0), DVec3::splat(3.0))).is_empty());
    }
}
