//! Range and slope of a spine over a box. On the skeleton's own terms: the distance, and the thickness that the
//! directions of the box can meet.

use super::{Relief, Spine, size, squared, tree};
use crate::field::{Box3, DensityBounds};
use terrain_model::bounds::{over_up, plus_up, times_up};
use terrain_model::falloff::{wyvill, wyvill_steepness};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// Times the largest coordinate, this covers what `f64` adds to a nearest point or a distance: a dozen operations, each off
/// by 2⁻⁵³ of differences of coordinates, which together stay below 8 times the largest. Rounding the direction of v adds
/// the like of it, R/d times: 12 · 8 · 2, in units of 2⁻⁵³, is below 128 · 2⁻⁵².
pub(super) const ROUNDING: f64 = 128.0 * f64::EPSILON;

/// A box as the bounds see it.
struct Ball {
    /// Its middle.
    centre: [Interval; 3],
    /// No point of the box is farther from the middle, metres, rounding of the field included.
    radius: f64,
}

impl Spine {
    /// Encloses f over `region`, with its slope there.
    ///
    /// *Range.* The distance d to a segment is that at the middle ± half the diagonal.
    ///
    /// *Slope.* Let q be the nearest point of a segment, u = (p − q)/d the direction, a the axis. Where q is an end, Dq = 0
    /// and Du = (I − uuᵀ)/d; between the ends Dq = aaᵀ, u ⊥ a and Du = (I − uuᵀ − aaᵀ)/d. So D(q + R·u) = Dv maps u to 0,
    /// and its norm is at most max(1, R/d). With T = R + t(v), ∇d = u and d̃ = d/T,
    ///
    /// ∇d̃ = u/T − (d/T²)·Dvᵀ∇t, two orthogonal parts, so ‖∇d̃‖ ≤ hypot(1/T, Lip(t)·max(d, R)/T²).
    ///
    /// Where f ≠ 0 also d < T, thus d/T² ≤ 1/T. d̃ is continuous, also across the planes through the ends and at the
    /// skeleton, so this bounds difference quotients. Of the smallest d̃ only segments that can be it count, and
    /// |∇f| = |s|·|g′(d̃)|·‖∇d̃‖. By the same bound of Dv, v moves less than ρ·max(1, R/d) over a box of half diagonal ρ:
    /// t and its slope are enclosed on the cube of that half width.
    pub(super) fn enclose(&self, region: &Box3) -> DensityBounds {
        let ball = self.ball(region);
        let sides = region.intervals();
        let far = |best: f64, node: &tree::Node| self.beyond(best, node.distance_squared(sides).lo());
        // No point of the region has a smallest d̃² above this.
        let thinnest = Interval::point(self.thickness.lo());
        let most = |best: f64, k: usize| (self.distance(k, &ball) / thinnest).square().hi().min(best);
        let cap = tree::fold(&self.nodes, 1.0, |best, node| far(*best, node), most);
        let each = |(smallest, slope): (Interval, f64), k: usize| {
            let distance = self.distance(k, &ball);
            if self.beyond(cap, distance.square().lo()) {
                return (smallest, slope);
            }
            let (thickness, lipschitz) = self.thickness_near(k, &ball, distance);
            let u = (distance / thickness).square();
            if u.lo() >= 1.0 || u.lo() > cap {
                return (smallest, slope);
            }
            let steep = wyvill_steepness(Interval::new(u.lo(), u.hi().min(cap)));
            let steep = times_up(steep, stretch(distance, thickness, self.radius, lipschitz));
            (Real::min(smallest, u), slope.max(steep))
        };
        let start = (Interval::point(1.0), 0.0);
        let (smallest, slope) = tree::fold(&self.nodes, start, |_, node| far(cap, node), each);
        if smallest.lo() >= 1.0 {
            return DensityBounds::ZERO;
        }
        let range = Interval::point(self.energy) * wyvill(Interval::new(smallest.lo(), smallest.hi().min(cap)));
        DensityBounds { range, slope: times_up(self.energy.abs(), slope) }
    }

    fn ball(&self, region: &Box3) -> Ball {
        let centre = (region.low + region.high) * 0.5;
        let half = Real::sqrt(Interval::point(region.distance_squared(centre).hi())).hi();
        let largest = size(region) + size(&tree::extent(&self.nodes)) + self.thickness.hi();
        Ball { centre: centre.to_array().map(Interval::point), radius: plus_up(half, times_up(ROUNDING, largest)) }
    }

    /// Encloses the distances from segment `k`, metres.
    fn distance(&self, k: usize, ball: &Ball) -> Interval {
        let (_, rest) = self.nearest(k, ball.centre);
        Real::max(Real::sqrt(squared(rest)) + Interval::symmetric(ball.radius), Interval::ZERO)
    }

    /// Encloses R + t(v) where `distance` to segment `k` has been enclosed, with the Lipschitz constant of t there.
    fn thickness_near(&self, k: usize, ball: &Ball, distance: Interval) -> (Interval, f64) {
        let Some(Relief { noise, turbulence }) = &self.relief else { return (self.thickness, 0.0) };
        let scale = noise.amplitude.abs() * if noise.signed { 1.0 } else { 0.5 };
        let spread = if distance.lo() > 0.0 {
            times_up(ball.radius, over_up(self.radius, distance.lo()).max(1.0))
        } else {
            f64::INFINITY
        };
        if spread >= 0.5 * noise.wavelength {
            return (self.thickness, times_up(scale, turbulence.slope * (1.0 + 1e-12)));
        }
        let (q, rest) = self.nearest(k, ball.centre);
        let length = Real::sqrt(squared(rest));
        let v = std::array::from_fn(|i| {
            q[i] + Interval::point(self.radius) * (rest[i] / length) + Interval::symmetric(spread)
        });
        let (signed, slope) = turbulence.enclose(v);
        let c = Interval::point;
        let t = if noise.signed { signed } else { (c(0.5) + c(0.5) * signed).clamp01() };
        let thickness = (c(self.radius) + c(noise.amplitude) * t).meet(self.thickness);
        (thickness, times_up(scale, slope))
    }
}

/// The bound of ‖∇d̃‖ where d̃ < 1.
fn stretch(distance: Interval, thickness: Interval, radius: f64, lipschitz: f64) -> f64 {
    let radial = over_up(1.0, thickness.lo());
    let about = over_up(distance.hi().min(thickness.lo()).max(radius), thickness.lo());
    let about = times_up(times_up(lipschitz, about), radial);
    Interval::length(Interval::point(radial), Interval::point(about)).hi()
}
