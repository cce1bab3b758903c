//! Distance, side and elevation of one stretch of a skeleton: a circular arc of at most a quarter turn, or a segment. Only
//! + − × ÷ √, in a frame at the arc's middle, where straight is the plain case of curvature 0.
//!
//! With a, b the coordinates along and across the middle, k the curvature, c = 1 − kb and R = √(c² + (ka)²), so that ρR is
//! the distance to the centre:
//! - signed distance to the circle: (2b − k(a² + b²)) / (1 + R), which tends to b as k → 0;
//! - place along the arc: u = a / (h·c), h = tan(φ/2)/k, runs over [−1, 1] between the ends: it is tan θ over tan φ/2, the
//!   half angle of a rational parameter;
//! - past an end: p = ±a·cos(φ/2) + b·sin(φ/2) − e, both negative exactly where the foot lies on the arc;
//! - side: the signed distance to the circle where it does, and twice the one to the tangent past an end.
//!
//! The place of the foot has no slope bound at the centre of the circle (claims G22), where all of the arc is equally near.
//! Denominators that measure the distance to the centre are held at a quarter of the radius: nearer than three quarters of
//! the radius nothing changes, and in the middle elevation fades to that of the arc's middle.

use crate::primitive::{Number, Parameters};
use crate::real::{Mask, Real};
use crate::spline::Arc;

/// Parameters of a stretch: middle (2), direction (2), curvature, 1/h, cos φ/2, sin φ/2, end along, end across, four
/// coefficients of elevation in u, grades before and after, abscissa at the middle and its two coefficients.
pub const WIDTH: usize = 19;

/// The share of the radius at which the distance to the centre of an arc is held.
pub(super) const CORE: f64 = 0.25;

/// A stretch of a skeleton with its elevations. Lengths in metres, grades in metres per metre along the arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Its course in the plane.
    pub arc: Arc,
    /// Distance of its start along the whole skeleton.
    pub abscissa: f64,
    /// Elevation at both ends.
    pub elevation: [f64; 2],
    /// Grade at both ends; a cubic between them.
    pub grade: [f64; 2],
    /// Grade with which elevation goes on before the start and past the end, where a joint is averaged.
    pub beyond: [f64; 2],
}

impl Stretch {
    pub(crate) fn parameters(&self) -> [f64; WIDTH] {
        let Stretch { arc, abscissa, elevation, grade, beyond } = self;
        let half = 0.5 * arc.length;
        let (middle, direction) = arc.at(half);
        let angle = half * arc.curvature;
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        let along = if angle == 0.0 { half } else { half * (sin / angle) };
        let across = along * libm::tan(0.5 * angle);
        // ds/du at an end.
        let speed = along * cos;
        let (rise, slope) = (0.5 * (elevation[1] - elevation[0]), [grade[0] * speed, grade[1] * speed]);
        let z2 = 0.25 * (slope[1] - slope[0]);
        let z3 = 0.5 * (0.5 * (slope[0] + slope[1]) - rise);
        let (z0, z1) = (0.5 * (elevation[0] + elevation[1]) - z2, rise - z3);
        let s3 = 0.5 * (speed - half);
        let s1 = half - s3;
        [
            middle.x,
            middle.y,
            direction.x,
            direction.y,
            arc.curvature,
            cos / along,
            cos,
            sin,
            along,
            across,
            z0,
            z1,
            z2,
            z3,
            beyond[0],
            beyond[1],
            abscissa + half,
            s1,
            s3,
        ]
    }
}

/// Where a point stands relative to one stretch.
#[derive(Clone, Copy, Debug)]
pub struct Place<R: Real> {
    /// Along and across the middle of the arc.
    pub at: [R; 2],
    /// Distance to the centre of the circle over its radius, and its part along the middle normal: R and c.
    pub ratio: [R; 2],
    /// Past the start and past the end, metres; both negative where the foot lies on the arc.
    pub past: [R; 2],
    /// Does the foot lie on the arc?
    pub inside: R::Mask,
    /// Positive on the left, negative on the right; at most as large as the distance only near the arc's continuation past an
    /// end.
    pub side: R,
    /// Distance to the arc.
    pub distance: R,
}

/// The place of `x` beside the stretch whose parameters start at `p`.
#[inline(always)]
pub fn place<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> Place<R> {
    let middle = p.pair::<R>(0);
    let direction = p.pair::<R>(2);
    let v = [x[0] - middle[0], x[1] - middle[1]];
    let a = v[0] * direction[0] + v[1] * direction[1];
    let b = direction[0] * v[1] - direction[1] * v[0];
    let k = p.get::<R>(4);
    let c = R::one() - k * b;
    let ratio = R::length(c, k * a);
    let to_circle = (b + b - k * (a.square() + b.square())) / (R::one() + ratio);
    let (along, level) = (a * p.get(6), b * p.get(7) - p.get(8));
    let past = [level - along, level + along];
    let inside = past[0].max(past[1]).less(R::zero());
    let from_end = [a.abs() - p.get(8), b - p.get(9)];
    let to_tangent = from_end[1] * p.get(6) - from_end[0] * p.get(7);
    let side = R::select(inside, to_circle, to_tangent + to_tangent);
    let distance = R::select(inside, to_circle.abs(), R::length(from_end[0], from_end[1]));
    Place { at: [a, b], ratio: [ratio, c], past, inside, side, distance }
}

/// Elevation of the skeleton, and metres along it, for a place within `reach` metres of the stretch's ends.
#[inline(always)]
pub fn elevation<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, place: &Place<R>, reach: R) -> (R, R) {
    let u = position(p, place);
    let z = p.get::<R>(10) + u * (p.get::<R>(11) + u * (p.get::<R>(12) + u * p.get::<R>(13)));
    let s = p.get::<R>(16) + u * (p.get::<R>(17) + u.square() * p.get::<R>(18));
    // Past an end elevation goes on as its neighbour does. Beyond the centre a point is past both, equally so where both are
    // equally near.
    let core = place.ratio[0].max(R::constant(CORE));
    let on = place.past.map(|past| (past / core).max(R::zero()).min(reach));
    (z + on[1] * p.get(15) - on[0] * p.get(14), s + on[1] - on[0])
}

/// u: place along the stretch, from −1 to 1.
#[inline(always)]
pub(super) fn position<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, place: &Place<R>) -> R {
    let across = place.ratio[1].abs().max(R::constant(CORE));
    (place.at[0] * p.get(5) / across).max(-R::one()).min(R::one())
}

/// Does a comparison certainly hold, for every lane and every real?
#[inline(always)]
pub(super) fn surely_less<R: Number>(a: R, b: R) -> bool {
    a.less(b).must_hold()
}
