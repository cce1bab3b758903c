//! A number that carries a bound of its own `f32` rounding error, by running error analysis (Higham, Accuracy and
//! Stability of Numerical Algorithms, §3.3). Running a formula on it derives the tolerance within which an `f32` path
//! with the same order of operations must agree with exact arithmetic on the same inputs.

use crate::interval::{Interval, Tri};
use crate::real::{Operand, Real, plain_mean};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Half an ulp of 1 in `f32`: |fl(x) − x| ≤ UNIT·|x| for a normal result.
pub const UNIT: f64 = 1.0 / 16_777_216.0;
/// Half the smallest subnormal `f32`: what underflow can add.
const UNDERFLOW: f64 = 7.006_492_321_624_085e-46;

/// An enclosure of a real result together with a bound on how far `f32` arithmetic can land from it.
#[derive(Clone, Copy, Debug)]
pub struct Rounded {
    /// Encloses the exact result.
    pub exact: Interval,
    /// Largest distance between the `f32` result and the exact one.
    pub error: f64,
}

impl Rounded {
    /// An exact value off by at most `error` in `f32`.
    pub fn new(exact: Interval, error: f64) -> Rounded {
        Rounded { exact, error: if error.is_nan() { f64::INFINITY } else { error } }
    }
    /// What `f32` may hold.
    pub fn reach(self) -> Interval {
        self.exact + Interval::symmetric(self.error)
    }
    /// The result of one `f32` operation whose exact operands give `exact` and whose `f32` operands shift it by
    /// `propagated` at most.
    fn round(exact: Interval, propagated: f64) -> Rounded {
        let reach = exact.magnitude() + propagated;
        Rounded::new(exact, (propagated + UNIT * reach + UNDERFLOW) * (1.0 + 8.0 * f64::EPSILON))
    }
    fn combine(exact: Interval, error: f64) -> Rounded {
        Rounded::new(exact, error)
    }
}

impl Add for Rounded {
    type Output = Rounded;
    fn add(self, o: Rounded) -> Rounded {
        Rounded::round(self.exact + o.exact, self.error + o.error)
    }
}
impl Sub for Rounded {
    type Output = Rounded;
    fn sub(self, o: Rounded) -> Rounded {
        Rounded::round(self.exact - o.exact, self.error + o.error)
    }
}
impl Neg for Rounded {
    type Output = Rounded;
    fn neg(self) -> Rounded {
        Rounded::combine(-self.exact, self.error)
    }
}
impl Mul for Rounded {
    type Output = Rounded;
    fn mul(self, o: Rounded) -> Rounded {
        let (a, b) = (self.exact.magnitude(), o.exact.magnitude());
        let cross = |error: f64, factor: f64| if error == 0.0 { 0.0 } else { error * factor };
        let propagated = cross(self.error, b) + cross(o.error, a) + cross(self.error, o.error);
        Rounded::round(self.exact * o.exact, propagated * (1.0 + 4.0 * f64::EPSILON))
    }
}
impl Div for Rounded {
    type Output = Rounded;
    fn div(self, o: Rounded) -> Rounded {
        // |â/b̂ − a/b| ≤ (|a|·eb + |b|·ea) / (|b|·(|b| − eb)), both at the least |b|.
        let exact = self.exact / o.exact;
        let b = o.exact.mignitude();
        if b <= o.error {
            return Rounded::new(exact, f64::INFINITY);
        }
        let propagated = (self.error + exact.magnitude() * o.error) / (b - o.error);
        Rounded::round(exact, propagated * (1.0 + 8.0 * f64::EPSILON))
    }
}

impl Real for Rounded {
    type Mask = Tri;
    fn constant(value: f64) -> Rounded {
        // The error of writing a constant in f32 is part of the path's error, and is exact here.
        Rounded::new(Interval::point(value), (f64::from(value as f32) - value).abs())
    }
    fn sqrt(self) -> Rounded {
        // |√x̂ − √x| ≤ min(e / √x, √e): the first by division, the second by subadditivity of √.
        let exact = Real::sqrt(self.exact);
        let by_division = if exact.lo() > 0.0 { self.error / exact.lo() } else { f64::INFINITY };
        Rounded::round(exact, by_division.min(self.error.sqrt()) * (1.0 + 4.0 * f64::EPSILON))
    }
    fn abs(self) -> Rounded {
        Rounded::combine(Real::abs(self.exact), self.error)
    }
    fn square(self) -> Rounded {
        let propagated = 2.0 * self.exact.magnitude() * self.error + self.error * self.error;
        Rounded::round(self.exact.square(), propagated * (1.0 + 4.0 * f64::EPSILON))
    }
    fn min(self, o: Rounded) -> Rounded {
        Rounded::combine(Real::min(self.exact, o.exact), self.error.max(o.error))
    }
    fn max(self, o: Rounded) -> Rounded {
        Rounded::combine(Real::max(self.exact, o.exact), self.error.max(o.error))
    }
    fn less(self, o: Rounded) -> Tri {
        // Decided only where the exact and the f32 comparison agree.
        let (exact, single) = (self.exact.less(o.exact), self.reach().less(o.reach()));
        if exact == single { exact } else { Tri::Maybe }
    }
    fn select(mask: Tri, a: Rounded, b: Rounded) -> Rounded {
        match mask {
            Tri::Yes => a,
            Tri::No => b,
            // The exact path may take one branch and f32 the other.
            Tri::Maybe => {
                let exact = a.exact.hull(b.exact);
                let reach = a.reach().hull(b.reach());
                let error = (reach.hi() - exact.lo()).max(exact.hi() - reach.lo());
                Rounded::new(exact, error * (1.0 + 4.0 * f64::EPSILON))
            }
        }
    }
    /// The plain analysis divides by the weight and has nothing to say where it vanishes; but a mean of weights ≥ 0, in
    /// `f32` too, stays within what it averages.
    fn weighted_mean(parts: &[Operand<Rounded>], _least: f64) -> Operand<Rounded> {
        let mut mean = plain_mean(parts);
        let mut hull: Option<(Interval, Interval)> = None;
        for part in parts.iter().filter(|part| part.weight.reach().hi() > 0.0) {
            let own = (part.elevation.exact, part.elevation.reach());
            hull = Some(hull.map_or(own, |h| (h.0.hull(own.0), h.1.hull(own.1))));
        }
        let Some((mut exact, mut reach)) = hull else { return mean };
        let least = mean.weight.reach().lo().min(mean.weight.exact.lo());
        // n products and sums and one quotient round by at most 2n + 4 units of the largest operand together.
        let widest = reach.magnitude();
        let mut slack = (2.0 * parts.len() as f64 + 4.0) * UNIT * widest;
        if least < 1e-30 {
            // Products may underflow: then the quotient is anywhere between 0 and twice its size, or is 0 by definition.
            (exact, reach) = (exact.hull(Interval::ZERO), reach.hull(Interval::ZERO));
            slack += widest + 1.0;
        }
        let reach = reach + Interval::symmetric(slack);
        let exact = mean.elevation.exact.meet(exact);
        let error = (reach.hi() - exact.lo()).max(exact.hi() - reach.lo()).max(0.0) * (1.0 + 8.0 * f64::EPSILON);
        mean.elevation = Rounded::new(exact, error.min(mean.elevation.error));
        mean
    }
    fn length(x: Rounded, y: Rounded) -> Rounded {
        // The distance is 1-Lipschitz: the operands' errors enter with factor 1, whatever the length.
        let propagated = (x.error * x.error + y.error * y.error).sqrt();
        let exact = Interval::length(x.exact, y.exact);
        // Two squarings, an addition and a root round by 2.5 units together; 4 covers the second order.
        let reach = exact.magnitude() + propagated;
        Rounded::new(exact, (propagated + 4.0 * UNIT * reach + 1e-22) * (1.0 + 8.0 * f64::EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn formula<R: Real>(x: R, y: R) -> R {
        let c = R::constant;
        let a = (x * y + c(2.1)).abs() / (x.square() + c(1.3));
        let b = (y.square() + c(0.5)).sqrt() - R::length(x, y + c(3.7));
        let s = R::select(x.less(y), a.min(b), a.max(b));
        s * c(1.7) - a / (b.square() + c(0.9))
    }

    proptest! {
        #[test]
        fn f32_stays_within_the_derived_error(x in -20.0f32..20.0, y in -20.0f32..20.0) {
            let point = |v: f32| Rounded::new(Interval::point(f64::from(v)), 0.0);
            let derived = formula(point(x), point(y));
            let single = f64::from(formula(x, y));
            prop_assert!(derived.reach().contains(single), "{derived:?} {single}");
        }
    }

    #[test]
    fn the_derived_error_is_not_vacuous() {
        let point = |v: f64| Rounded::new(Interval::point(v), 0.0);
        let derived = formula(point(1.5), point(-2.25));
        assert!(derived.error < 1e-5, "{derived:?}");
        // Control: an f32 result perturbed by a hundredth falls outside.
        assert!(!derived.reach().contains(f64::from(formula(1.5f32, -2.25)) + 1e-2));
    }
}
