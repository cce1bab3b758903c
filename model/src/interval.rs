//! Closed intervals of reals with outward rounding: each operation rounds to nearest and then goes one or two ulps
//! outward, so the exact result of + − × ÷ √ over the operands always lies inside. Portable, no rounding modes.

use crate::real::{Mask, Operand, Real};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval [lo, hi]; ±∞ ends are allowed, NaN ends are not: an operation that would give one gives the whole
/// line.
#[derive(Clone, Copy, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

impl std::fmt::Debug for Interval {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "[{}, {}]", self.lo, self.hi)
    }
}

impl Interval {
    /// The whole line.
    pub const ENTIRE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
    /// The point 0.
    pub const ZERO: Interval = Interval { lo: 0.0, hi: 0.0 };
    /// [0, 1].
    pub const UNIT: Interval = Interval { lo: 0.0, hi: 1.0 };
    /// [0, ∞).
    pub const FROM_ZERO: Interval = Interval { lo: 0.0, hi: f64::INFINITY };

    /// [lo, hi]; the whole line when an end is NaN. The ends may come in any order.
    #[inline]
    pub fn new(lo: f64, hi: f64) -> Interval {
        if lo <= hi {
            Interval { lo, hi }
        } else if hi <= lo {
            Interval { lo: hi, hi: lo }
        } else {
            Interval::ENTIRE
        }
    }
    /// The interval that holds `x` alone.
    #[inline]
    pub fn point(x: f64) -> Interval {
        Interval::new(x, x)
    }
    /// [−r, r].
    #[inline]
    pub fn symmetric(r: f64) -> Interval {
        Interval::new(-r, r)
    }
    /// The lower end.
    #[inline(always)]
    pub fn lo(self) -> f64 {
        self.lo
    }
    /// The upper end.
    #[inline(always)]
    pub fn hi(self) -> f64 {
        self.hi
    }
    /// Largest absolute value.
    #[inline]
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }
    /// Smallest absolute value.
    #[inline]
    pub fn mignitude(self) -> f64 {
        if self.contains(0.0) { 0.0 } else { self.lo.abs().min(self.hi.abs()) }
    }
    /// hi − lo, rounded up.
    #[inline]
    pub fn width(self) -> f64 {
        if self.lo == self.hi { 0.0 } else { (self.hi - self.lo).next_up() }
    }
    /// A point inside, near the middle; finite when an end is.
    #[inline]
    pub fn middle(self) -> f64 {
        if self.lo == f64::NEG_INFINITY || self.hi == f64::INFINITY {
            return if self.lo > f64::NEG_INFINITY {
                self.lo
            } else if self.hi < f64::INFINITY {
                self.hi
            } else {
                0.0
            };
        }
        (self.lo + 0.5 * (self.hi - self.lo)).clamp(self.lo, self.hi)
    }
    /// Does `x` lie inside?
    #[inline]
    pub fn contains(self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }
    /// Does `other` lie inside?
    #[inline]
    pub fn encloses(self, other: Interval) -> bool {
        self.lo <= other.lo && other.hi <= self.hi
    }
    /// The smallest interval that holds both.
    #[inline]
    pub fn hull(self, other: Interval) -> Interval {
        Interval { lo: lesser(self.lo, other.lo), hi: greater(self.hi, other.hi) }
    }
    /// The intersection. Two enclosures of one value always meet; where rounding of the caller made them miss, `self`.
    #[inline]
    pub fn meet(self, other: Interval) -> Interval {
        let (lo, hi) = (greater(self.lo, other.lo), lesser(self.hi, other.hi));
        if lo <= hi { Interval { lo, hi } } else { self }
    }
    /// An enclosure of `1 / self`; the whole line when 0 lies inside.
    #[inline]
    pub fn recip(self) -> Interval {
        if self.lo > 0.0 || self.hi < 0.0 { Interval::outward(1.0 / self.hi, 1.0 / self.lo) } else { Interval::ENTIRE }
    }
    #[inline(always)]
    fn outward(lo: f64, hi: f64) -> Interval {
        let (lo, hi) = (down(lo), up(hi));
        // A NaN, or an end that overflowed to the wrong side.
        if lo <= hi { Interval { lo, hi } } else { Interval::ENTIRE }
    }
}

/// At least the number after `x`, and at least what rounds to `x`: |x|·2⁻⁵² is at least one ulp of x where it does not
/// underflow, and [`TINY`] where it does. Three operations on any lane, where `next_up` is a chain of branches.
#[inline(always)]
fn up(x: f64) -> f64 {
    x + (x.abs() * f64::EPSILON + TINY)
}
#[inline(always)]
fn down(x: f64) -> f64 {
    x - (x.abs() * f64::EPSILON + TINY)
}

/// What is added where an ulp underflows. Its square is still a normal number: products of dust stay fast.
const TINY: f64 = 1e-140;

/// The smaller one; unlike `f64::min` it need not look for NaN.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a < b { b } else { a }
}

impl Add for Interval {
    type Output = Interval;
    #[inline(always)]
    fn add(self, o: Interval) -> Interval {
        // x + 0 is exact. Slopes that are 0 stay 0: widened to ±5e-324 they would be slow and spread.
        if o == Interval::ZERO {
            return self;
        } else if self == Interval::ZERO {
            return o;
        }
        Interval::outward(self.lo + o.lo, self.hi + o.hi)
    }
}
impl Sub for Interval {
    type Output = Interval;
    #[inline(always)]
    fn sub(self, o: Interval) -> Interval {
        if o == Interval::ZERO {
            return self;
        } else if self == Interval::ZERO {
            return -o;
        }
        Interval::outward(self.lo - o.hi, self.hi - o.lo)
    }
}
impl Neg for Interval {
    type Output = Interval;
    #[inline(always)]
    fn neg(self) -> Interval {
        Interval { lo: -self.hi, hi: -self.lo }
    }
}
impl Mul for Interval {
    type Output = Interval;
    #[inline(always)]
    fn mul(self, o: Interval) -> Interval {
        // Zero times anything is zero, also times an infinite end.
        if (self.lo == 0.0 && self.hi == 0.0) || (o.lo == 0.0 && o.hi == 0.0) {
            return Interval::ZERO;
        }
        let (a, b, c, d) = (self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi);
        // A NaN here is 0·∞; `f64::min` would drop it, so it is looked for.
        if (a + b + c + d).is_nan() && (a.is_nan() || b.is_nan() || c.is_nan() || d.is_nan()) {
            return Interval::ENTIRE;
        }
        Interval::outward(lesser(lesser(a, b), lesser(c, d)), greater(greater(a, b), greater(c, d)))
    }
}
impl Div for Interval {
    type Output = Interval;
    #[inline(always)]
    fn div(self, o: Interval) -> Interval {
        if o.lo > 0.0 || o.hi < 0.0 {
            let (a, b, c, d) = (self.lo / o.lo, self.lo / o.hi, self.hi / o.lo, self.hi / o.hi);
            if a.is_nan() || b.is_nan() || c.is_nan() || d.is_nan() {
                return Interval::ENTIRE;
            }
            Interval::outward(lesser(lesser(a, b), lesser(c, d)), greater(greater(a, b), greater(c, d)))
        } else {
            Interval::ENTIRE
        }
    }
}

/// The answer of a comparison of intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tri {
    /// Holds for no pair of reals.
    No,
    /// Holds for some and fails for some, as far as the ends tell.
    Maybe,
    /// Holds for all pairs.
    Yes,
}

impl Mask for Tri {
    fn and(self, other: Tri) -> Tri {
        match (self, other) {
            (Tri::No, _) | (_, Tri::No) => Tri::No,
            (Tri::Yes, Tri::Yes) => Tri::Yes,
            _ => Tri::Maybe,
        }
    }
    fn or(self, other: Tri) -> Tri {
        self.not().and(other.not()).not()
    }
    fn not(self) -> Tri {
        match self {
            Tri::No => Tri::Yes,
            Tri::Maybe => Tri::Maybe,
            Tri::Yes => Tri::No,
        }
    }
    fn may_hold(self) -> bool {
        self != Tri::No
    }
    fn must_hold(self) -> bool {
        self == Tri::Yes
    }
}

impl Real for Interval {
    type Mask = Tri;
    #[inline(always)]
    fn constant(value: f64) -> Interval {
        Interval { lo: value, hi: value }
    }
    #[inline(always)]
    fn sqrt(self) -> Interval {
        let (lo, hi) = (self.lo.max(0.0), self.hi.max(0.0));
        Interval { lo: down(lo.sqrt()).max(0.0), hi: up(hi.sqrt()) }
    }
    #[inline(always)]
    fn abs(self) -> Interval {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Interval { lo: 0.0, hi: self.hi.max(-self.lo) }
        }
    }
    #[inline(always)]
    fn square(self) -> Interval {
        let a = self.abs();
        Interval { lo: down(a.lo * a.lo).max(0.0), hi: up(a.hi * a.hi) }
    }
    #[inline(always)]
    fn min(self, o: Interval) -> Interval {
        Interval { lo: lesser(self.lo, o.lo), hi: lesser(self.hi, o.hi) }
    }
    #[inline(always)]
    fn max(self, o: Interval) -> Interval {
        Interval { lo: greater(self.lo, o.lo), hi: greater(self.hi, o.hi) }
    }
    #[inline(always)]
    fn less(self, o: Interval) -> Tri {
        if self.hi < o.lo {
            Tri::Yes
        } else if self.lo >= o.hi {
            Tri::No
        } else {
            Tri::Maybe
        }
    }
    #[inline(always)]
    fn select(mask: Tri, a: Interval, b: Interval) -> Interval {
        match mask {
            Tri::Yes => a,
            Tri::No => b,
            Tri::Maybe => a.hull(b),
        }
    }
    #[inline(always)]
    fn length(x: Interval, y: Interval) -> Interval {
        Real::sqrt(x.square() + y.square())
    }
    const ENCLOSES: bool = true;
    #[inline(always)]
    fn tighten(self, other: Interval) -> Interval {
        self.meet(other)
    }
    /// The quotient where the weight is bounded away from 0, met with the hull of the elevations that can carry weight;
    /// that hull (with 0 where all weights may vanish) elsewhere.
    fn weighted_mean(parts: &[Operand<Interval>], least: f64) -> Operand<Interval> {
        let mut sum = Interval::ZERO;
        let mut product = Interval::ZERO;
        let mut weight = Interval::ZERO;
        let mut hull: Option<Interval> = None;
        // Deviations from a reference shrink the dependency between numerator and denominator: Σ α (f − c) / Σ α + c.
        let mut carried = parts.iter().filter(|part| part.weight.hi > 0.0).map(|part| part.elevation.middle());
        let c = Interval::point(carried.find(|c| c.is_finite()).unwrap_or(0.0));
        for part in parts {
            if part.weight.hi > 0.0 {
                let part_weight = Interval { lo: part.weight.lo.max(0.0), hi: part.weight.hi };
                let (lo, hi) = (down(weight.lo + part_weight.lo).max(0.0), up(weight.hi + part_weight.hi));
                weight = Interval { lo, hi };
                sum = sum + part_weight * (part.elevation - c);
                product = product + part.product;
                hull = Some(hull.map_or(part.elevation, |h| h.hull(part.elevation)));
            }
        }
        let Some(hull) = hull else { return Operand::absent() };
        weight.lo = weight.lo.max(least.min(weight.hi));
        let elevation = if weight.lo > 0.0 { (sum / weight + c).meet(hull) } else { hull.hull(Interval::ZERO) };
        Operand { elevation, weight, product }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn inside(x: Interval, t: f64) -> f64 {
        (x.lo + t * (x.hi - x.lo)).clamp(x.lo, x.hi)
    }

    proptest! {
        #[test]
        fn operations_enclose_the_results_of_members(
            a in -1e6f64..1e6, w in 0.0f64..1e3, b in -1e6f64..1e6, v in 0.0f64..1e3, s in 0.0f64..=1.0, t in 0.0f64..=1.0,
        ) {
            let (x, y) = (Interval::new(a, a + w), Interval::new(b, b + v));
            let (p, q) = (inside(x, s), inside(y, t));
            prop_assert!((x + y).contains(p + q));
            prop_assert!((x - y).contains(p - q));
            prop_assert!((x * y).contains(p * q));
            prop_assert!((x / y).contains(p / q));
            prop_assert!(x.square().contains(p * p));
            prop_assert!(Real::abs(x).contains(p.abs()));
            prop_assert!(Real::sqrt(Real::abs(x)).contains(p.abs().sqrt()));
            prop_assert!(Real::min(x, y).contains(p.min(q)));
            prop_assert!(Interval::length(x, y).contains((p * p + q * q).sqrt()));
            let smaller = if p < q { p } else { q };
            prop_assert!(Interval::select(x.less(y), x, y).contains(smaller));
        }
    }

    #[test]
    fn outward_is_at_least_an_ulp_at_every_magnitude() {
        let magnitudes =
            [0.0, f64::from_bits(1), 1e-310, f64::MIN_POSITIVE, 1e-290, 1e-140, 0.1, 1.0, 3.0, 1e300, f64::MAX];
        for x in magnitudes.into_iter().flat_map(|x| [x, -x]) {
            for x in [x.next_down(), x, x.next_up()].into_iter().filter(|x| x.is_finite()) {
                assert!(up(x) >= x.next_up() && down(x) <= x.next_down(), "{x:e}");
                // Control: half of what is added would not do for numbers just above a power of 2.
                let half = x + 0.25 * x.abs() * f64::EPSILON;
                assert!(x.abs() != 1.0 || half < x.next_up() || x < 0.0, "{x:e}");
            }
        }
        assert_eq!(Interval::new(f64::MAX, f64::MAX) + Interval::new(f64::MAX, f64::MAX), Interval::ENTIRE);
    }

    #[test]
    fn a_nan_end_makes_the_whole_line() {
        assert_eq!(Interval::new(f64::NAN, 1.0), Interval::ENTIRE);
        let infinite = Interval::new(1.0, f64::INFINITY);
        assert_eq!(infinite - infinite, Interval::ENTIRE);
        assert_eq!(Interval::new(-1.0, 1.0) / Interval::new(-1.0, 1.0), Interval::ENTIRE);
        assert_eq!(Interval::new(0.0, 1.0) * Interval::ENTIRE, Interval::ENTIRE);
        assert_eq!(Interval::ZERO * Interval::ENTIRE, Interval::ZERO);
    }

    #[test]
    fn a_weighted_mean_stays_between_its_operands() {
        let operand = |f: (f64, f64), a: (f64, f64)| Operand::new(Interval::new(f.0, f.1), Interval::new(a.0, a.1));
        let parts = [operand((1.0, 2.0), (0.2, 0.9)), operand((3.0, 4.0), (0.0, 0.5))];
        let Operand { elevation: mean, weight, .. } = Interval::weighted_mean(&parts, 0.0);
        assert!(mean.lo() >= 1.0 && mean.hi() <= 4.0, "{mean:?}");
        assert!(weight.contains(0.2) && weight.contains(1.4));
        for i in 0..=10 {
            for j in 0..=10 {
                let (a, b) = (0.2 + 0.07 * f64::from(i), 0.05 * f64::from(j));
                assert!(mean.contains((a * 1.5 + b * 3.5) / (a + b)));
            }
        }
    }
}
