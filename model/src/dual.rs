//! Dual numbers: a value with its derivatives along `K` directions, by forward differentiation. Over `f64` they give
//! exact gradients; over intervals they give certified slopes.

use crate::interval::Interval;
use crate::real::{Mask, Operand, Real};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivatives along `K` directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<R, const K: usize> {
    /// The value.
    pub value: R,
    /// The derivatives.
    pub slope: [R; K],
}

impl<R: Real, const K: usize> Dual<R, K> {
    /// A value that does not vary.
    #[inline(always)]
    pub fn fixed(value: R) -> Self {
        Dual { value, slope: [R::zero(); K] }
    }
    /// The `k`-th variable.
    #[inline(always)]
    pub fn variable(value: R, k: usize) -> Self {
        let mut slope = [R::zero(); K];
        slope[k] = R::one();
        Dual { value, slope }
    }
    /// `value`, with derivatives by the chain rule: Σ partialⱼ · innerⱼ.
    #[inline(always)]
    pub fn chain<const J: usize>(value: R, partials: [R; J], inner: [Self; J]) -> Self {
        let mut slope = [R::zero(); K];
        for (k, s) in slope.iter_mut().enumerate() {
            let mut sum = partials[0] * inner[0].slope[k];
            for j in 1..J {
                sum = sum + partials[j] * inner[j].slope[k];
            }
            *s = sum;
        }
        Dual { value, slope }
    }
    #[inline(always)]
    fn zip(self, other: Self, value: R, f: impl Fn(R, R) -> R) -> Self {
        let mut slope = self.slope;
        for (a, b) in slope.iter_mut().zip(other.slope) {
            *a = f(*a, b);
        }
        Dual { value, slope }
    }
    #[inline(always)]
    fn map(self, value: R, f: impl Fn(R) -> R) -> Self {
        let mut slope = self.slope;
        for a in &mut slope {
            *a = f(*a);
        }
        Dual { value, slope }
    }
}

impl<R: Real, const K: usize> Add for Dual<R, K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, self.value + o.value, |a, b| a + b)
    }
}
impl<R: Real, const K: usize> Sub for Dual<R, K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, self.value - o.value, |a, b| a - b)
    }
}
impl<R: Real, const K: usize> Mul for Dual<R, K> {
    type Output = Self;
    #[inline(always)]
    // The product rule adds.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, o: Self) -> Self {
        self.zip(o, self.value * o.value, |a, b| a * o.value + self.value * b)
    }
}
impl<R: Real, const K: usize> Div for Dual<R, K> {
    type Output = Self;
    #[inline(always)]
    // The quotient rule multiplies and subtracts.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        self.zip(o, value, |a, b| (a - value * b) / o.value)
    }
}
impl<R: Real, const K: usize> Neg for Dual<R, K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(-self.value, |a| -a)
    }
}

/// What a dual needs of the number below it where differentiation is not arithmetic alone: slopes at √0, at the centre
/// of a distance, and of weighted means.
pub trait Differentiable: Real {
    /// The derivative of √(x² + y²) along a direction with components `dx`, `dy`, `length` being the root.
    #[inline(always)]
    fn length_slope(x: Self, y: Self, length: Self, dx: Self, dy: Self) -> Self {
        let off = Self::zero().less(length);
        let slope = (x * dx + y * dy) / Self::select(off, length, Self::one());
        Self::select(off, slope, Self::zero())
    }
    /// The derivative of a weighted mean `mean` = Σ αf / Σ α along one direction, from the operands' values and their
    /// derivatives: Σ (α f′ + α′ (f − mean)) / Σ α.
    #[inline(always)]
    fn mean_slope(parts: impl Iterator<Item = [Operand<Self>; 2]>, mean: Self, weight: Self) -> Self {
        let mut sum = Self::zero();
        for [part, slope] in parts {
            sum = sum + part.weight * slope.elevation + slope.weight * (part.elevation - mean);
        }
        let positive = Self::zero().less(weight);
        let slope = sum / Self::select(positive, weight, Self::one());
        Self::select(positive, slope, Self::zero())
    }
}

impl Differentiable for f64 {}
impl Differentiable for f32 {}
impl Differentiable for crate::rounding::Rounded {}
impl<const N: usize> Differentiable for crate::lanes::Lanes<N> {}

impl Differentiable for Interval {
    fn length_slope(x: Interval, y: Interval, length: Interval, dx: Interval, dy: Interval) -> Interval {
        // |d‖v‖| ≤ ‖dv‖ holds everywhere, at the origin too.
        let bound = Interval::symmetric(Interval::length(dx, dy).hi());
        if length.lo() > 0.0 { ((x * dx + y * dy) / length).meet(bound) } else { bound }
    }
    fn mean_slope(parts: impl Iterator<Item = [Operand<Interval>; 2]>, mean: Interval, weight: Interval) -> Interval {
        if weight.hi() <= 0.0 {
            return Interval::ZERO;
        }
        if weight.lo() <= 0.0 {
            // No slope bound where all weights may vanish (claims G2).
            return Interval::ENTIRE;
        }
        let mut sum = Interval::ZERO;
        for [part, slope] in parts {
            if part.weight.hi() > 0.0 {
                // α f′ = (αf)′ − α′ f: the second form stays bounded where f′ does not.
                let plain = part.weight * slope.elevation;
                let unbounded = plain.lo() == f64::NEG_INFINITY || plain.hi() == f64::INFINITY;
                let carried = if unbounded { slope.product - slope.weight * part.elevation } else { plain };
                sum = sum + carried + slope.weight * (part.elevation - mean);
            }
        }
        sum / weight
    }
}

impl<R: Differentiable, const K: usize> Real for Dual<R, K> {
    type Mask = R::Mask;
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Dual::fixed(R::constant(value))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        let positive = R::zero().less(root);
        let twice = R::select(positive, root + root, R::one());
        self.map(root, |a| R::select(positive, a / twice, R::zero()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let negative = self.value.less(R::zero());
        self.map(self.value.abs(), |a| R::select(negative, -a, a))
    }
    #[inline(always)]
    fn square(self) -> Self {
        let twice = self.value + self.value;
        self.map(self.value.square(), |a| a * twice)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        let mask = o.value.less(self.value);
        self.zip(o, self.value.min(o.value), |a, b| R::select(mask, b, a))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        let mask = self.value.less(o.value);
        self.zip(o, self.value.max(o.value), |a, b| R::select(mask, b, a))
    }
    #[inline(always)]
    fn less(self, o: Self) -> R::Mask {
        self.value.less(o.value)
    }
    #[inline(always)]
    fn select(mask: R::Mask, a: Self, b: Self) -> Self {
        a.zip(b, R::select(mask, a.value, b.value), |x, y| R::select(mask, x, y))
    }
    #[inline(always)]
    fn length(x: Self, y: Self) -> Self {
        let length = R::length(x.value, y.value);
        x.zip(y, length, |dx, dy| R::length_slope(x.value, y.value, length, dx, dy))
    }
    const ENCLOSES: bool = R::ENCLOSES;
    #[inline(always)]
    fn tighten(self, o: Self) -> Self {
        self.zip(o, self.value.tighten(o.value), |a, b| a.tighten(b))
    }
    #[inline]
    fn weighted_mean(parts: &[Operand<Self>], least: f64) -> Operand<Self> {
        // The values as the number below computes them, bit for bit; the slopes about the mean.
        let value_of = |part: &Operand<Self>| part.map(|x| x.value);
        let mut values = [Operand::absent(); 16];
        let mean = if parts.len() <= 16 {
            for (value, part) in values.iter_mut().zip(parts) {
                *value = value_of(part);
            }
            R::weighted_mean(&values[..parts.len()], least)
        } else {
            R::weighted_mean(&parts.iter().map(value_of).collect::<Vec<_>>(), least)
        };
        let mut out = mean.map(Dual::fixed);
        for k in 0..K {
            let slopes = parts.iter().map(|part| [value_of(part), part.map(|x| x.slope[k])]);
            out.elevation.slope[k] = R::mean_slope(slopes, mean.elevation, mean.weight);
            let sum =
                |of: fn(&Operand<Self>) -> Self| parts.iter().fold(R::zero(), |sum, part| sum + of(part).slope[k]);
            out.weight.slope[k] = sum(|part| part.weight);
            if R::ENCLOSES {
                out.product.slope[k] = sum(|part| part.product);
            }
        }
        // An operand that is alone on the whole region is not averaged at all.
        let mut present = parts.iter().filter(|part| R::zero().less(part.weight.value).may_hold());
        if let (Some(alone), None) = (present.next(), present.next())
            && R::zero().less(alone.weight.value).must_hold()
        {
            out.elevation.slope = alone.elevation.slope;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A formula that uses every operation.
    fn formula<R: Real>(x: R, y: R) -> R {
        let c = R::constant;
        let a = (x * y + c(2.0)).abs() / (x.square() + c(1.0));
        let b = (y.square() + c(0.5)).sqrt() - R::length(x, y + c(3.0));
        let s = R::select(x.less(y), a.min(b), a.max(b));
        let part = Operand::new;
        R::weighted_mean(&[part(s, x.square() + c(0.1)), part(a - b, y.square()), part(-b, c(0.3))], 0.0).elevation
    }

    proptest! {
        #[test]
        fn slopes_agree_with_central_differences(x in -2.0f64..2.0, y in -2.0f64..2.0) {
            let value = formula(Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1));
            prop_assert_eq!(value.value, formula(x, y));
            let e = 1e-5;
            let fd = [(formula(x + e, y) - formula(x - e, y)) / (2.0 * e), (formula(x, y + e) - formula(x, y - e)) / (2.0 * e)];
            // The third derivative of `formula` stays under 1e4 off its creases; a crease inside the stencil is skipped.
            let smooth = (x - y).abs() > 1e-3;
            for k in 0..2 {
                let kink = (fd[k] - value.slope[k]).abs();
                prop_assert!(!smooth || kink < 1e-4 || near_crease(x, y), "{k}: {kink}");
            }
        }

        #[test]
        fn interval_duals_enclose_members_and_their_slopes(x in -2.0f64..2.0, y in -2.0f64..2.0, w in 0.0f64..0.3, s in 0.0f64..=1.0) {
            let (a, b) = (Interval::new(x, x + w), Interval::new(y, y + w));
            let e = formula(Dual::<Interval, 2>::variable(a, 0), Dual::variable(b, 1));
            let (p, q) = ((x + s * w).min(a.hi()), (y + (1.0 - s) * w).min(b.hi()));
            let v = formula(Dual::<f64, 2>::variable(p, 0), Dual::variable(q, 1));
            prop_assert!(widen(e.value).contains(v.value));
            for k in 0..2 {
                prop_assert!(widen(e.slope[k]).contains(v.slope[k]), "{:?} {}", e.slope[k], v.slope[k]);
            }
        }
    }

    fn near_crease(x: f64, y: f64) -> bool {
        let a = (x * y + 2.0).abs() / (x * x + 1.0);
        let b = (y * y + 0.5).sqrt() - (x * x + (y + 3.0) * (y + 3.0)).sqrt();
        (a - b).abs() < 1e-3 || (x * y + 2.0).abs() < 1e-3
    }

    /// The f64 side is itself rounded: allow it 64 ulp of the larger end.
    fn widen(x: Interval) -> Interval {
        x + Interval::symmetric(64.0 * f64::EPSILON * x.magnitude().max(1.0))
    }
}
