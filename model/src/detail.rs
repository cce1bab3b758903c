//! Level of detail κ: R² → [0, 1] (Génevaux 2015 §6): 1 near a focus, 0 far from it, C¹ between. A program without a
//! focus has κ = 1 everywhere.
//!
//! Below a map of the plane, κ is measured in the operand's own coordinates from where the map carries the focus: under
//! similarities, which scale `near` and `far` too, that is κ of the world.

use crate::bounds::{Region, times_up};
use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::primitive::{Number, Parameters};
use crate::real::Real;
use glam::DVec2;

/// Where detail is wanted, usually below the camera. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// The place of full detail.
    pub position: DVec2,
    /// κ = 1 up to this distance.
    pub near: f64,
    /// κ = 0 from this distance on.
    pub far: f64,
}

impl Focus {
    /// Finite, 0 ≤ near < far.
    pub fn is_sound(&self) -> bool {
        self.position.is_finite() && self.near >= 0.0 && self.near < self.far && self.far.is_finite()
    }
}

/// Where the parameters of the focus stand among those of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FocusSlot {
    /// Index of the first of the focus.
    pub offset: usize,
    /// How many the instruction has in all.
    pub count: usize,
}

/// How many parameters a focus is.
pub const WIDTH: usize = 4;

/// Position x and y, near, 1/(far − near); the last is 0 without a focus.
pub(crate) fn parameters(focus: Option<&Focus>) -> [f64; WIDTH] {
    focus.map_or([0.0; WIDTH], |f| [f.position.x, f.position.y, f.near, 1.0 / (f.far - f.near)])
}

/// 3t² − 2t³ for t in [0, 1]: C¹ where t is clamped, of slope at most 3/2.
#[inline(always)]
pub fn smooth<R: Real>(t: R) -> R {
    t.square() * (R::constant(3.0) - (t + t))
}

/// Range of [`smooth`] over a range within [0, 1]: it rises, so its ends are those of the range. Exactly 0 or 1 where it
/// is; elsewhere wide enough for the rounding of `f64`, which need not rise.
pub fn smooth_range(t: Interval) -> Interval {
    const ROUNDING: f64 = 2e-15;
    let at = |t: f64| {
        if t <= 0.0 {
            0.0
        } else if t >= 1.0 {
            1.0
        } else {
            smooth(t)
        }
    };
    let (lo, hi) = (at(t.lo()), at(t.hi()));
    let lo = if lo >= 1.0 { 1.0 } else { (lo - ROUNDING).max(0.0) };
    let hi = if hi <= 0.0 { 0.0 } else { (hi + ROUNDING).min(1.0) };
    Interval::new(lo, hi)
}

/// Largest slope 6t(1 − t) of [`smooth`] over a range within [0, 1], rounded up.
pub fn smooth_slope(t: Interval) -> f64 {
    if t.hi() <= 0.0 || t.lo() >= 1.0 {
        return 0.0;
    }
    let nearest = 0.5f64.clamp(t.lo(), t.hi());
    (6.0 * nearest * (1.0 - nearest) * (1.0 + 1e-15)).min(1.5)
}

/// How far from near to far, 0 to 1.
#[inline(always)]
fn farness<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> R {
    let focus = p.pair::<R>(0);
    let distance = R::length(x[0] - focus[0], x[1] - focus[1]);
    ((distance - p.get(2)) * p.get(3)).clamp01()
}

/// κ at `x`; `p` starts at the parameters of the focus.
#[inline(always)]
pub(crate) fn kappa<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> R {
    R::one() - smooth(farness(p, x))
}

/// Range and slope of κ over a region. The distance is 1-Lipschitz, so λ_κ ≤ max 6t(1−t) / (far − near).
pub(crate) fn kappa_bounds(p: Parameters<f64>, region: &Region) -> (Interval, f64) {
    if p.0[3] == 0.0 {
        return (Interval::point(1.0), 0.0);
    }
    // The box alone, by the operations of the formula: what `f64` computes lies inside, rounded as it is.
    let t = farness::<Interval, f64>(p, region.extent);
    let s = smooth_range(t);
    let rest = |s: f64, rounded: f64| if s <= 0.0 || s >= 1.0 { 1.0 - s } else { rounded.clamp(0.0, 1.0) };
    let range = Interval::new(rest(s.hi(), (1.0 - s.hi()).next_down()), rest(s.lo(), (1.0 - s.lo()).next_up()));
    (range, times_up(smooth_slope(t), p.0[3]))
}

/// The parameters relative to a tile's origin.
pub(crate) fn rebased(p: &[f64], origin: DVec2) -> [f64; WIDTH] {
    [p[0] - origin.x, p[1] - origin.y, p[2], p[3]]
}

/// Filter of an octave: b = 1 − (1 − t²)³ with t from 0 at κ = `from` to 1 after another 1/`inverse`: C¹ and rising, with
/// slope at most L·inverse. The printed (1 − t²)³ jumps at both ends (claims G7). Exactly 0 up to `from`.
#[inline(always)]
pub(crate) fn filter<R: Real>(kappa: R, from: R, inverse: R) -> R {
    let t = ((kappa - from) * inverse).clamp01();
    R::one() - wyvill(t.square())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;
    use crate::falloff::WYVILL_SLOPE;
    use proptest::prelude::*;

    const FOCUS: Focus = Focus { position: DVec2::new(30.0, -20.0), near: 100.0, far: 700.0 };

    proptest! {
        #[test]
        fn kappa_lies_within_its_range_and_slope(x in -900.0f64..900.0, y in -900.0f64..900.0, w in 0.0f64..500.0, s in 0.0f64..=1.0, t in 0.0f64..=1.0) {
            let p = parameters(Some(&FOCUS));
            let region = Region::rectangle(DVec2::new(x, y), DVec2::new(x + w, y + w));
            let (range, slope) = kappa_bounds(Parameters(&p), &region);
            let at = [Dual::<f64, 2>::variable((x + s * w).min(x + w), 0), Dual::variable((y + t * w).min(y + w), 1)];
            let k = kappa(Parameters(&p), at);
            prop_assert!(range.contains(k.value) && (0.0..=1.0).contains(&k.value));
            prop_assert!(f64::length(k.slope[0], k.slope[1]) <= slope * (1.0 + 1e-12));
        }
    }

    #[test]
    fn kappa_is_one_near_zero_far_and_c1_between() {
        let p = parameters(Some(&FOCUS));
        let at = |d: f64| kappa(Parameters(&p), [Dual::<f64, 1>::variable(30.0 + d, 0), Dual::fixed(-20.0)]);
        assert_eq!((at(0.0).value, at(100.0).value, at(700.0).value, at(5000.0).value), (1.0, 1.0, 0.0, 0.0));
        let mut steepest = 0.0f64;
        for k in 0..8000 {
            let (a, b) = (at(f64::from(k) * 0.1), at(f64::from(k) * 0.1 + 1e-6));
            assert!((a.slope[0] - b.slope[0]).abs() < 1e-9, "a kink at {k}");
            steepest = steepest.max(a.slope[0].abs());
        }
        assert!((steepest - 1.5 / 600.0).abs() < 1e-9);
        // Without a focus, 1 everywhere.
        assert_eq!(kappa(Parameters(&parameters(None)), [1e9, 3.0]), 1.0);
    }

    #[test]
    fn a_filter_rises_without_a_jump_where_the_printed_one_has_two() {
        let at = |kappa: f64| filter(Dual::<f64, 1>::variable(kappa, 0), Dual::constant(0.25), Dual::constant(4.0));
        assert_eq!((at(0.0).value, at(0.25).value, at(0.5).value, at(1.0).value), (0.0, 0.0, 1.0, 1.0));
        let mut steepest = 0.0f64;
        for k in 0..10_000 {
            let (a, b) = (at(f64::from(k) * 1e-4), at(f64::from(k) * 1e-4 + 1e-9));
            assert!(b.value >= a.value && b.value - a.value < 1e-8);
            assert!((a.slope[0] - b.slope[0]).abs() < 1e-5);
            steepest = steepest.max(a.slope[0]);
        }
        assert!(steepest <= 4.0 * WYVILL_SLOPE && steepest > 3.99 * WYVILL_SLOPE);
        // The printed b (claims G7): 1 just above k⁻ and 0 at k⁺.
        let printed = |kappa: f64| wyvill(((kappa - 0.25) * 4.0) * ((kappa - 0.25) * 4.0));
        assert!(printed(0.25 + 1e-9) > 0.999 && printed(0.5) == 0.0);
    }
}
