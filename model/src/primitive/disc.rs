//! Disc primitive (Génevaux 2015 §4.1, Fig. 5): a centre, a radius, and an elevation that is constant or a noise.

use super::{Number, Parameters};
use crate::bounds::Region;
use crate::falloff::{WYVILL_SLOPE, wyvill};
use crate::interval::Interval;
use crate::real::Real;

/// Parameters before those of the noise: centre x, centre y, 1/r², weight at the centre, elevation.
pub const WIDTH: usize = 5;

/// α = w·g(d²/r²) with Wyvill's falloff; 0 from the radius on.
#[inline(always)]
pub fn weight<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> R {
    let c = p.pair::<R>(0);
    let d2 = (x[0] - c[0]).square() + (x[1] - c[1]).square();
    p.get::<R>(3) * wyvill(d2 * p.get::<R>(2))
}

/// The elevation at the centre, before noise.
#[inline(always)]
pub fn elevation<R: Number, P: Copy + Into<f64>>(p: Parameters<P>) -> R {
    p.get(4)
}

/// Range and slope of the weight over a region: α from the formula on the distance's enclosure, λ_α = w·max |g′| over
/// the distances met, at most w·L/r.
pub fn weight_bounds(p: Parameters<f64>, region: &Region) -> (Interval, f64) {
    let d2 = region.distance_squared([p.0[0], p.0[1]]);
    let u = d2 * Interval::point(p.0[2]);
    if u.lo() >= 1.0 {
        return (Interval::ZERO, 0.0);
    }
    let scale = Interval::point(p.0[3]);
    let inverse_radius = Real::sqrt(Interval::point(p.0[2]));
    // |g′| = 6·√u·(1−u)²/r rises up to u = 1/5 and falls after it.
    let steepness = |u: Interval| {
        let v = Real::max(Interval::point(1.0) - u, Interval::ZERO);
        Interval::point(6.0) * Real::sqrt(u) * v.square()
    };
    let steepest = if u.hi() < 0.2 {
        steepness(Interval::point(u.hi())).hi()
    } else if u.lo() > 0.2 {
        steepness(Interval::point(u.lo())).hi()
    } else {
        WYVILL_SLOPE
    };
    let range = scale * wyvill(u);
    let slope = scale * inverse_radius * Interval::point(steepest);
    (Interval::new(range.lo().max(0.0), range.hi()), slope.hi())
}

/// Range of the weight alone: all that pruning asks.
pub fn weight_range(p: Parameters<f64>, region: &Region) -> Interval {
    let u = region.distance_squared([p.0[0], p.0[1]]) * Interval::point(p.0[2]);
    if u.lo() >= 1.0 {
        return Interval::ZERO;
    }
    let range = Interval::point(p.0[3]) * wyvill(u);
    Interval::new(range.lo().max(0.0), range.hi())
}
