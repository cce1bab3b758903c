//! A primitive around a point or a curve whose thickness varies with a noise of the direction (Paris 2019 §5.2, Fig. 9):
//! along every ray from the skeleton the field only falls, so nothing floats.

mod bounds;
mod curve;
#[cfg(test)]
mod tests;
mod tree;

pub use curve::catmull_rom;

use crate::field::{Box3, Density, DensityBounds};
use crate::turbulence::Turbulence;
use curve::LEAST_STEP;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::dual::Dual;
use terrain_model::falloff::wyvill;
use terrain_model::interval::Interval;
use terrain_model::noise::NoiseValue;
use terrain_model::real::{Mask, Real};

/// The most segments of one skeleton.
pub const MAX_SEGMENTS: usize = 1 << 16;

/// The largest coordinate, radius or amplitude, metres.
const LARGEST: f64 = 1e9;

/// Noise coordinates are computed to 2⁻²¹ of a cell up to so many cells.
const CELLS: f64 = (1u32 << 31) as f64;

/// By how much the thickness varies: t = `amplitude` · a normalised sum of octaves of simplex noise, each with half the
/// wavelength and amplitude of the one before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Largest |t|, metres; a negative one takes thickness away.
    pub amplitude: f64,
    /// Of the first octave, metres.
    pub wavelength: f64,
    /// How many, 1 to 16.
    pub octaves: u32,
    /// Tells this noise from others.
    pub seed: u32,
    /// t in [−amplitude, amplitude]; else, as the paper has it, in [0, amplitude].
    pub signed: bool,
}

impl Noise {
    /// Encloses t, metres.
    pub fn range(&self) -> Interval {
        Interval::new(if self.signed { -self.amplitude } else { 0.0 }, self.amplitude)
    }
}

/// Why a spine was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpineError {
    /// No points.
    #[error("a spine without points: expected one or more")]
    Empty,
    /// A point that is no place.
    #[error("point {index} of a spine: expected components within ±1e9 m, found {point}")]
    Point {
        /// From 0.
        index: usize,
        /// What was given.
        point: DVec3,
    },
    /// Two neighbours at one place.
    #[error("points {index} and {} of a spine are {distance} m apart: expected at least {LEAST_STEP} m, leave one out", index + 1)]
    Close {
        /// Of the first, from 0.
        index: usize,
        /// Their distance, metres.
        distance: f64,
    },
    /// Too many segments.
    #[error("a spine of {count} segments: expected at most {MAX_SEGMENTS}; use a larger tolerance, or several spines")]
    Long {
        /// How many.
        count: f64,
    },
    /// A tolerance no polyline can keep.
    #[error("tolerance of a curve: expected {least} m or more, found {tolerance} m")]
    Tolerance {
        /// What was given, metres.
        tolerance: f64,
        /// The smallest, metres.
        least: f64,
    },
    /// A number out of its range.
    #[error("{name} of a spine: expected {low} to {high}, found {value}")]
    Number {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The smallest.
        low: f64,
        /// The largest.
        high: f64,
    },
    /// A noise that takes away all the thickness (claims P13).
    #[error(
        "the noise of a spine falls to {lowest} m, its radius is {radius} m: expected above {} m, so a smaller amplitude or a larger radius",
        -radius
    )]
    Thin {
        /// inf t, metres.
        lowest: f64,
        /// R, metres.
        radius: f64,
    },
}

/// A noise ready to evaluate.
#[derive(Clone, Debug)]
struct Relief {
    noise: Noise,
    turbulence: Turbulence,
}

impl Relief {
    /// t at `v`, metres.
    #[inline(always)]
    fn at<N: NoiseValue>(&self, v: [N; 3]) -> N {
        let t = if self.noise.signed { self.turbulence.signed(v) } else { self.turbulence.unit(v) };
        N::constant(self.noise.amplitude) * t
    }
}

/// f = s·g(d̃²) around a polyline, d̃ the smallest over its segments, g Wyvill's falloff of unit radius.
///
/// To one segment, with q its point nearest to p: d̃ = |p − q|/(R + t(v)), v = q + R·(p − q)/|p − q|, and d̃ = 0 on it.
/// v stays as p goes away from q, so d̃ grows linearly along rays and {f ≥ c} is star-shaped about the segment. Three
/// things differ from the paper: g has radius 1 on d̃, which has no unit, and d̃ = 0 where the direction is undefined
/// (claims P11); the noise is that of each segment's own nearest point, as that of the whole curve's jumps where two
/// branches are equally near (claims P12); and inf t > −R is required (claims P13).
///
/// The polyline itself is the skeleton, without any error; a smooth curve is first flattened.
#[derive(Clone, Debug)]
pub struct Spine {
    points: Vec<DVec3>,
    nodes: Vec<tree::Node>,
    radius: f64,
    energy: f64,
    relief: Option<Relief>,
    /// R + t lies here, rounded outward; above 0.
    thickness: Interval,
    /// What is farther than √(factor · smallest d̃² + slack) cannot have a smaller d̃, whatever the rounding.
    factor: f64,
    slack: f64,
}

impl Spine {
    /// Around the polyline through `points` (one is a point, neighbours are distinct), with `radius` R in metres and
    /// `energy` s, f on the skeleton; negative carves.
    ///
    /// # Errors
    /// [`SpineError`] says which value is out of its range.
    pub fn new(points: Vec<DVec3>, radius: f64, energy: f64, noise: Option<Noise>) -> Result<Spine, SpineError> {
        check_points(&points)?;
        within("radius", radius, 1e-6, LARGEST)?;
        within("energy", energy, -LARGEST, LARGEST)?;
        let nodes = tree::grow(&points);
        let extent = tree::extent(&nodes);
        let mut thickness = Interval::point(radius);
        let mut relief = None;
        if let Some(noise) = noise {
            within("amplitude", noise.amplitude, -LARGEST, LARGEST)?;
            within("octaves", f64::from(noise.octaves), 1.0, 16.0)?;
            thickness = thickness + noise.range();
            if thickness.lo() <= 0.0 {
                return Err(SpineError::Thin { lowest: noise.range().lo(), radius });
            }
            let finest = f64::from(1u32 << (noise.octaves - 1));
            let farthest = size(&extent) + radius;
            within("wavelength", noise.wavelength, (finest * farthest / CELLS).max(1e-6), LARGEST)?;
            let turbulence = Turbulence::new(noise.wavelength, noise.octaves, noise.seed);
            relief = Some(Relief { noise, turbulence });
        }
        // Distances err by δ, which grows with the coordinates; (x + δ)² ≤ x²(1 + η) + δ²(1 + 1/η). Twice the extent:
        // farther out δ is below the share η/2 of the distance itself.
        const SHARE: f64 = 1e-6;
        let reach = thickness.hi();
        let error = bounds::ROUNDING * 2.0 * (size(&extent) + reach);
        let (factor, slack) = (reach * reach * (1.0 + 2.0 * SHARE), error * error * (2.0 / SHARE));
        Ok(Spine { points, nodes, radius, energy, relief, thickness, factor, slack })
    }

    /// Around the centripetal Catmull–Rom spline through `control`, flattened by [`catmull_rom`] to `tolerance` metres:
    /// that is how far the surface may be from the curve's own.
    ///
    /// # Errors
    /// [`SpineError`] says which value is out of its range.
    pub fn curve(
        control: &[DVec3],
        tolerance: f64,
        radius: f64,
        energy: f64,
        noise: Option<Noise>,
    ) -> Result<Spine, SpineError> {
        Spine::new(catmull_rom(control, tolerance)?, radius, energy, noise)
    }

    /// The vertices of the skeleton, metres.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }
    /// R, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }
    /// s.
    pub fn energy(&self) -> f64 {
        self.energy
    }
    /// t, if there is one.
    pub fn noise(&self) -> Option<Noise> {
        self.relief.as_ref().map(|relief| relief.noise)
    }
    /// Bytes of the spine with all it holds.
    pub fn bytes(&self) -> usize {
        let octaves = self.relief.as_ref().map_or(0, |relief| relief.turbulence.bytes());
        size_of::<Spine>() + size_of_val(&self.points[..]) + size_of_val(&self.nodes[..]) + octaves
    }

    /// f, one formula for every number. Groups of segments that are too far to matter are left out.
    #[inline(always)]
    pub fn density<N: NoiseValue>(&self, p: [N; 3]) -> N {
        let far = |best: &N, node: &tree::Node| self.beyond(*best, node.distance_squared(p));
        let near = |best: N, k: usize| self.nearer(best, k, p);
        // From d̃ = 1 on there is nothing.
        N::constant(self.energy) * wyvill(tree::fold(&self.nodes, N::one(), far, near))
    }

    /// Is everything at squared distance `distance_squared` certain to have a d̃² of `best` or more?
    #[inline(always)]
    fn beyond<N: Real>(&self, best: N, distance_squared: N) -> bool {
        (best * N::constant(self.factor) + N::constant(self.slack)).less(distance_squared).must_hold()
    }

    /// The smaller of `best` and the d̃² to segment `k`.
    #[inline(always)]
    fn nearer<N: NoiseValue>(&self, best: N, k: usize, p: [N; 3]) -> N {
        let (q, rest) = self.nearest(k, p);
        let squared = squared(rest);
        let Some(relief) = &self.relief else {
            return best.min(squared / N::constant(self.radius).square());
        };
        if self.beyond(best, squared) {
            return best;
        }
        let distance = N::length(N::length(rest[0], rest[1]), rest[2]);
        best.min((distance / self.thickness_at(relief, q, rest, distance)).square())
    }

    /// The point q of segment `k` nearest to `p`, and p − q.
    #[inline(always)]
    fn nearest<N: Real>(&self, k: usize, p: [N; 3]) -> ([N; 3], [N; 3]) {
        let start = constant(self.points[k]);
        let from: [N; 3] = std::array::from_fn(|i| p[i] - start[i]);
        let Some(end) = self.points.get(k + 1) else { return (start, from) };
        // In N, as their difference need not be an f64.
        let end: [N; 3] = constant(*end);
        let axis: [N; 3] = std::array::from_fn(|i| end[i] - start[i]);
        let along = from[0] * axis[0] + from[1] * axis[1] + from[2] * axis[2];
        let s = (along / squared(axis)).clamp01();
        (std::array::from_fn(|i| start[i] + s * axis[i]), std::array::from_fn(|i| from[i] - s * axis[i]))
    }

    /// R + t(v) for the nearest point `q`, `rest` = p − q and its length.
    #[inline(always)]
    fn thickness_at<N: NoiseValue>(&self, relief: &Relief, q: [N; 3], rest: [N; 3], distance: N) -> N {
        let c = N::constant;
        let off = c(0.0).less(distance);
        let length = N::select(off, distance, c(1.0));
        // A quotient of intervals that hold the skeleton is the whole line: then all directions are possible.
        let direction = rest.map(|x| (x / length).max(c(-1.0)).min(c(1.0)));
        let v = std::array::from_fn(|i| q[i] + c(self.radius) * direction[i]);
        let whole = c(self.radius) + relief.at(v);
        whole.max(c(self.thickness.lo())).min(c(self.thickness.hi()))
    }
}

impl Density for Spine {
    fn value(&self, p: DVec3) -> f64 {
        self.density(p.to_array())
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        let p: [Dual<f64, 3>; 3] = std::array::from_fn(|k| Dual::variable(p[k], k));
        let f = self.density(p);
        (f.value, DVec3::from_array(f.slope))
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        self.enclose(region)
    }
    /// R + sup t around the polyline.
    fn support(&self) -> Box3 {
        let extent = tree::extent(&self.nodes);
        let error = bounds::ROUNDING * (size(&extent) + self.thickness.hi());
        let reach = Interval::symmetric(self.thickness.hi()) + Interval::symmetric(error);
        let sides = extent.intervals().map(|side| side + reach);
        Box3 { low: DVec3::from_array(sides.map(Interval::lo)), high: DVec3::from_array(sides.map(Interval::hi)) }
    }
}

/// The largest coordinate, in size.
fn size(b: &Box3) -> f64 {
    b.low.abs().max(b.high.abs()).max_element()
}
#[inline(always)]
fn constant<N: Real>(p: DVec3) -> [N; 3] {
    p.to_array().map(N::constant)
}
#[inline(always)]
fn squared<N: Real>([x, y, z]: [N; 3]) -> N {
    x.square() + y.square() + z.square()
}

fn within(name: &'static str, value: f64, low: f64, high: f64) -> Result<(), SpineError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(SpineError::Number { name, value, low, high }) }
}

fn check_points(points: &[DVec3]) -> Result<(), SpineError> {
    if points.is_empty() {
        return Err(SpineError::Empty);
    }
    if points.len() - 1 > MAX_SEGMENTS {
        return Err(SpineError::Long { count: (points.len() - 1) as f64 });
    }
    if let Some(index) = points.iter().position(|p| !(p.is_finite() && p.abs().max_element() <= LARGEST)) {
        return Err(SpineError::Point { index, point: points[index] });
    }
    for (index, ends) in points.windows(2).enumerate() {
        let distance = ends[0].distance(ends[1]);
        if distance < LEAST_STEP {
            return Err(SpineError::Close { index, distance });
        }
    }
    Ok(())
}
