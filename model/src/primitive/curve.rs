//! Curve primitive on segments and polylines (Génevaux 2015 §4.1, Fig. 6): elevation along the skeleton plus a
//! cross-section of the signed distance.
//!
//! The paper takes the elevation of the nearest point, which jumps on the medial axis (claims G22). Here the segments
//! whose squared distance exceeds the smallest by less than s² (s the *joint*, metres) are averaged with Wyvill
//! weights of that excess: their sum is at least 1, so elevation is Lipschitz, and on a straight reach the skeleton's
//! own descent is kept.

use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, times_up};
use crate::certify::cover::largest_over;
use crate::dual::Dual;
use crate::falloff::{WYVILL_SLOPE, wyvill};
use crate::interval::Interval;
use crate::profile::{self, Knot};
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Point3, Positive, Scope, one};
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// A polyline with a cross-section. Lengths in metres.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Vertices with elevations, at least two, no two neighbours equal in the plane.
    pub points: Vec<DVec3>,
    /// Radius of the support.
    pub radius: f64,
    /// Weight on the skeleton.
    pub weight: f64,
    /// How far a joint is smoothed.
    pub joint: f64,
    /// Cross-section, sorted by distance.
    pub profile: Vec<Knot>,
}

/// A curve in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    points: Vec<Point3>,
    radius: Positive,
    #[serde(default = "one")]
    weight: Positive,
    #[serde(default)]
    joint: Option<Positive>,
    #[serde(default)]
    profile: Vec<Knot>,
}

impl File {
    pub(crate) fn build(&self, _: &mut Scope<'_>) -> Result<Curve, String> {
        let radius = f64::from(self.radius);
        Ok(Curve {
            points: self.points.iter().map(|p| DVec3::new(p.0.into(), p.1.into(), p.2.into())).collect(),
            radius,
            weight: self.weight.into(),
            joint: self.joint.map_or(0.25 * radius, f64::from),
            profile: self.profile.clone(),
        })
    }
}

/// Parameters before those of the segments: 1/r², weight, 1/s², slope bound over the whole support.
const WIDTH: usize = 4;
/// Parameters of a segment: start x, y, z, unit direction x, y, length, grade (metres per metre).
const SEGMENT_WIDTH: usize = 7;

/// The most segments of one curve; the compiler refuses longer ones, which are written as a blend of several.
pub const MAX_SEGMENTS: usize = 64;

/// A compiled curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    segments: u16,
    pieces: u16,
}

impl Authored for Curve {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let Curve { points, radius, weight, joint, profile: knots } = self;
        if points.len() < 2 || points.len() > MAX_SEGMENTS + 1 || !points.iter().all(|p| p.is_finite()) {
            return Err("a curve needs 2 to 65 finite points; blend several curves for more".to_owned());
        }
        if ![radius, weight, joint].into_iter().all(|v| *v > 0.0 && v.is_finite()) {
            return Err("a curve needs a positive radius, weight and joint".to_owned());
        }
        if !knots.windows(2).all(|k| k[0].distance < k[1].distance)
            || !knots.iter().all(|k| k.distance.is_finite() && k.height.is_finite() && k.slope.is_finite())
        {
            return Err("the knots of a profile need increasing, finite distances".to_owned());
        }
        if points.windows(2).any(|p| p[0].truncate() == p[1].truncate()) {
            return Err("two consecutive points of a curve stand at the same place".to_owned());
        }
        let mut parameters = vec![1.0 / (radius * radius), *weight, 1.0 / (joint * joint), f64::INFINITY];
        for pair in points.windows(2) {
            let d = pair[1].truncate() - pair[0].truncate();
            let length = d.length();
            let grade = (pair[1].z - pair[0].z) / length;
            parameters.extend([pair[0].x, pair[0].y, pair[0].z, d.x / length, d.y / length, length, grade]);
        }
        let pieces = profile::compile(knots);
        parameters.extend(&pieces);
        let count = pieces.len() / profile::PIECE_WIDTH;
        parameters[3] = support_slope(&parameters, points.len() - 1, count);
        Ok(Code { at: out.store(parameters), segments: (points.len() - 1) as u16, pieces: count as u16 })
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, _: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let (elevation, weight) = sample(p, usize::from(self.segments), usize::from(self.pieces), x);
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        let nearest = nearest_squared(p, usize::from(self.segments), region);
        let range = Interval::point(p.0[1]) * wyvill(nearest * Interval::point(p.0[0]));
        if range.hi() <= 0.0 { Interval::ZERO } else { Interval::new(range.lo().max(0.0), range.hi()) }
    }
    fn bounds(&self, p: Parameters<f64>, _: Tables<'_>, region: &Region) -> Bounds {
        bounds(p, usize::from(self.segments), usize::from(self.pieces), region)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        let ends = (0..usize::from(self.segments)).flat_map(|segment| {
            let k = &p.0[WIDTH + segment * SEGMENT_WIDTH..];
            let start = DVec2::new(k[0], k[1]);
            [start, start + DVec2::new(k[3], k[4]) * k[5]]
        });
        around(ends, 1.0 / p.0[0].sqrt())
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let profile = WIDTH + usize::from(self.segments) * SEGMENT_WIDTH;
        let mut moved = p.0[..profile + usize::from(self.pieces) * profile::PIECE_WIDTH].to_vec();
        for start in moved[WIDTH..profile].chunks_exact_mut(SEGMENT_WIDTH) {
            start[0] -= origin.x;
            start[1] -= origin.y;
        }
        Code { at: tile.store(moved), ..*self }
    }
}

/// Where a point stands relative to one segment.
struct Foot<R> {
    distance_squared: R,
    side: R,
    elevation: R,
}

#[inline(always)]
fn foot<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, segment: usize, x: [R; 2]) -> Foot<R> {
    let k = WIDTH + segment * SEGMENT_WIDTH;
    let start = p.pair::<R>(k);
    let direction = p.pair::<R>(k + 3);
    let d = [x[0] - start[0], x[1] - start[1]];
    let along = d[0] * direction[0] + d[1] * direction[1];
    let side = direction[0] * d[1] - direction[1] * d[0];
    let at = along.max(R::zero()).min(p.get(k + 5));
    // Beyond an end the distance grows by what is left of the abscissa.
    let past = along - at;
    Foot { distance_squared: side.square() + past.square(), side, elevation: p.get::<R>(k + 2) + at * p.get(k + 6) }
}

/// (elevation, weight) of a curve with `segments` segments and a profile of `pieces` pieces.
#[inline(always)]
fn sample<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, segments: usize, pieces: usize, x: [R; 2]) -> (R, R) {
    let section = Parameters(&p.0[WIDTH + segments * SEGMENT_WIDTH..]);
    if segments == 1 {
        let foot = foot(p, 0, x);
        let elevation = foot.elevation + profile::evaluate(section, pieces, foot.side);
        return (elevation, p.get::<R>(1) * wyvill(foot.distance_squared * p.get::<R>(0)));
    }
    let mut nearest = foot(p, 0, x).distance_squared;
    for segment in 1..segments {
        nearest = nearest.min(foot(p, segment, x).distance_squared);
    }
    let weight = p.get::<R>(1) * wyvill(nearest * p.get::<R>(0));
    if !R::zero().less(weight).may_hold() {
        return (R::zero(), weight);
    }
    // Room for 64 segments of lanes is 8 KiB to clear; most curves have few.
    let elevation = if segments <= FEW {
        joined::<R, P, FEW>(p, segments, pieces, x, nearest)
    } else {
        joined::<R, P, MAX_SEGMENTS>(p, segments, pieces, x, nearest)
    };
    (elevation, weight)
}

/// Segments of a short curve.
const FEW: usize = 8;

/// The mean elevation of the segments, of which there are at most `N`, that lie about as near as the nearest.
#[inline(always)]
fn joined<R: Number, P: Copy + Into<f64>, const N: usize>(
    p: Parameters<P>,
    segments: usize,
    pieces: usize,
    x: [R; 2],
    nearest: R,
) -> R {
    let section = Parameters(&p.0[WIDTH + segments * SEGMENT_WIDTH..]);
    let mut parts = [Operand::absent(); N];
    let mut count = 0;
    for segment in 0..segments.min(N) {
        let foot = foot(p, segment, x);
        let excess = (foot.distance_squared - nearest).max(R::zero()) * p.get::<R>(2);
        if excess.less(R::one()).may_hold() {
            let elevation = foot.elevation + profile::evaluate(section, pieces, foot.side);
            parts[count] = Operand::new(elevation, wyvill(excess));
            count += 1;
        }
    }
    // The nearest segment has weight 1.
    R::weighted_mean(&parts[..count], 1.0).elevation
}

/// Range and slopes over a region: the formula itself on duals of intervals over the region's extent, met with the
/// bound over the whole support (which the compiler certified) and with λ_α ≤ w·L/r.
fn bounds(p: Parameters<f64>, segments: usize, pieces: usize, region: &Region) -> Bounds {
    let nearest = nearest_squared(p, segments, region);
    let u = nearest * Interval::point(p.0[0]);
    if u.lo() >= 1.0 {
        return Bounds::ABSENT;
    }
    let (elevation, weight, slope) = enclose(p, segments, pieces, region.extent);
    let range = weight.value.meet(Interval::point(p.0[1]) * wyvill(u));
    let global = times_up(p.0[1], (Real::sqrt(Interval::point(p.0[0])) * Interval::point(WYVILL_SLOPE)).hi());
    let local = Interval::length(weight.slope[0], weight.slope[1]).hi();
    let range = Interval::new(range.lo().max(0.0), range.hi());
    Bounds::primitive(elevation, range, slope.min(p.0[3]), local.min(global))
}

/// Elevation, weight with its gradient, and slope over a box.
fn enclose(
    p: Parameters<f64>,
    segments: usize,
    pieces: usize,
    extent: [Interval; 2],
) -> (Interval, Dual<Interval, 2>, f64) {
    let x = [Dual::<Interval, 2>::variable(extent[0], 0), Dual::variable(extent[1], 1)];
    let (elevation, weight) = sample(p, segments, pieces, x);
    (elevation.value, weight, Interval::length(elevation.slope[0], elevation.slope[1]).hi())
}

/// Boxes that the compiler looks at to bound the slope of one curve.
const COMPILE_BUDGET: usize = 20_000;

/// A slope bound over the whole support of a compiled curve.
fn support_slope(p: &[f64], segments: usize, pieces: usize) -> f64 {
    let p = Parameters(p);
    let radius = Real::sqrt(Interval::point(1.0) / Interval::point(p.0[0])).hi();
    let smallest = 0.25 / p.0[2].sqrt();
    let reach = Interval::symmetric(radius);
    let mut whole: Option<[Interval; 2]> = None;
    for segment in 0..segments {
        let k = WIDTH + segment * SEGMENT_WIDTH;
        for along in [0.0, p.0[k + 5]] {
            let at = |axis: usize| {
                Interval::point(p.0[k + axis]) + Interval::point(p.0[k + 3 + axis]) * Interval::point(along) + reach
            };
            let near = [at(0), at(1)];
            whole = Some(whole.map_or(near, |w| [w[0].hull(near[0]), w[1].hull(near[1])]));
        }
    }
    let Some(whole) = whole else { return 0.0 };
    largest_over(whole, smallest, COMPILE_BUDGET, |extent| {
        let u = nearest_squared(p, segments, &Region { extent, ends: None }) * Interval::point(p.0[0]);
        (u.lo() < 1.0).then(|| enclose(p, segments, pieces, extent).2)
    })
}

/// Encloses the squared distance to the skeleton over a region.
fn nearest_squared(p: Parameters<f64>, segments: usize, region: &Region) -> Interval {
    let mut nearest = Interval::new(f64::INFINITY, f64::INFINITY);
    for segment in 0..segments {
        nearest = Real::min(nearest, foot(p, segment, region.extent).distance_squared);
    }
    nearest
}
