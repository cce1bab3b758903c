//! What `bounds` answers: over a region of the plane, enclosures of elevation and weight and bounds of their slopes.

use crate::interval::Interval;
use crate::real::Real;
use glam::DVec2;

/// T: terrain exists where the weight is at least this (Génevaux 2015 §3).
pub const THRESHOLD: f64 = 0.5;

/// A box, or a segment within its bounding box. Coordinates are intervals because a region that was carried through an
/// affine map is known only up to rounding.
#[derive(Clone, Copy, Debug)]
pub struct Region {
    /// The bounding box, metres.
    pub extent: [Interval; 2],
    /// The ends of the segment, when the region is one.
    pub ends: Option<[[Interval; 2]; 2]>,
}

impl Region {
    /// The box with opposite corners `a` and `b`, metres.
    pub fn rectangle(a: DVec2, b: DVec2) -> Region {
        Region { extent: [Interval::new(a.x, b.x), Interval::new(a.y, b.y)], ends: None }
    }
    /// The segment from `a` to `b`, metres.
    pub fn segment(a: DVec2, b: DVec2) -> Region {
        let ends = [[Interval::point(a.x), Interval::point(a.y)], [Interval::point(b.x), Interval::point(b.y)]];
        Region { extent: [Interval::new(a.x, b.x), Interval::new(a.y, b.y)], ends: Some(ends) }
    }
    /// Encloses the squared distance from `centre` to the points of the region, metres².
    pub fn distance_squared(&self, centre: [f64; 2]) -> Interval {
        let c = centre.map(Interval::point);
        let from = |p: [Interval; 2]| (p[0] - c[0]).square() + (p[1] - c[1]).square();
        let Some([a, b]) = self.ends else { return from(self.extent) };
        let (from_a, from_b) = (from(a), from(b));
        // The distance is convex along the segment: greatest at an end.
        let hi = from_a.hi().max(from_b.hi());
        let d = [b[0] - a[0], b[1] - a[1]];
        let length_squared = d[0].square() + d[1].square();
        let along = (c[0] - a[0]) * d[0] + (c[1] - a[1]) * d[1];
        let lo = if along.hi() < 0.0 {
            from_a.lo()
        } else if along.lo() > length_squared.hi() {
            from_b.lo()
        } else if length_squared.lo() > 0.0 {
            // No point of the segment is nearer than the line.
            (((c[0] - a[0]) * d[1] - (c[1] - a[1]) * d[0]).square() / length_squared).lo().max(from(self.extent).lo())
        } else {
            from(self.extent).lo()
        };
        Interval::new(lo.max(0.0).min(hi), hi)
    }
}

/// What a node is over a region. A node whose `weight` is exactly 0 there is absent, and its other entries are void.
///
/// Slopes are bounds on difference quotients along straight lines inside the region, so they also hold where a
/// gradient does not exist (claims G4). `f64::INFINITY` means that there is no bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Encloses the elevation wherever the weight is positive, metres.
    pub elevation: Interval,
    /// Encloses the weight.
    pub weight: Interval,
    /// λ_f on the terrain, {α ≥ T}.
    pub slope: f64,
    /// λ_f on the whole support, {α > 0}: infinite for blends whose weight fades out (claims G2).
    pub support_slope: f64,
    /// λ_α, per metre.
    pub weight_slope: f64,
    /// μ ≥ α·‖∇f‖ on the whole support: what a nested operator multiplies by the operand's own weight.
    pub weighted_slope: f64,
}

impl Bounds {
    /// A node that is absent from the region.
    pub const ABSENT: Bounds = Bounds {
        elevation: Interval::ZERO,
        weight: Interval::ZERO,
        slope: 0.0,
        support_slope: 0.0,
        weight_slope: 0.0,
        weighted_slope: 0.0,
    };
    /// A primitive: its elevation has slope `slope` wherever it has weight.
    pub fn primitive(elevation: Interval, weight: Interval, slope: f64, weight_slope: f64) -> Bounds {
        if weight.hi() <= 0.0 {
            return Bounds::ABSENT;
        }
        let weighted_slope = times_up(weight.hi(), slope);
        Bounds { elevation, weight, slope, support_slope: slope, weight_slope, weighted_slope }
    }
    /// Is the weight exactly 0 on the whole region?
    pub fn is_absent(&self) -> bool {
        self.weight.hi() <= 0.0
    }
    /// M: the largest difference between a value of one and a value of the other, metres. A spread between *values*,
    /// not the width of a difference (claims, *Nesting*).
    pub fn spread(a: Interval, b: Interval) -> f64 {
        (a.hi() - b.lo()).max(b.hi() - a.lo()).max(0.0).next_up()
    }
}

/// a + b rounded up.
pub fn plus_up(a: f64, b: f64) -> f64 {
    if a == 0.0 {
        b
    } else if b == 0.0 {
        a
    } else {
        (a + b).next_up()
    }
}
/// a · b rounded up, for operands ≥ 0; 0 times anything is 0.
pub fn times_up(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { (a * b).next_up() }
}
/// a / b rounded up, for a ≥ 0 and b > 0.
pub fn over_up(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { (a / b).next_up() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distance_to_a_segment_is_enclosed(
            ax in -9.0f64..9.0, ay in -9.0f64..9.0, bx in -9.0f64..9.0, by in -9.0f64..9.0,
            cx in -9.0f64..9.0, cy in -9.0f64..9.0, t in 0.0f64..=1.0,
        ) {
            let (a, b, c) = (DVec2::new(ax, ay), DVec2::new(bx, by), DVec2::new(cx, cy));
            let d = Region::segment(a, b).distance_squared([cx, cy]);
            let distance = (a + (b - a) * t).distance_squared(c);
            prop_assert!(d.lo() <= distance * (1.0 + 1e-12) + 1e-12 && distance <= d.hi() * (1.0 + 1e-12), "{d:?} {distance}");
            let r = Region::rectangle(a, b).distance_squared([cx, cy]);
            prop_assert!(r.contains(distance) || (distance - r.hi()).abs() < 1e-9);
        }
    }
}
