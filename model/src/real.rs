//! The number a formula is computed in. Every falloff, noise, profile and blend is written once over [`Real`] and runs
//! on `f64` (the reference), `f32`, SIMD lanes, dual numbers, outward-rounded intervals, duals of intervals, and on
//! numbers that carry a bound of their own `f32` rounding error.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The answer of a comparison: yes or no per lane, or undecided for an interval.
pub trait Mask: Copy + Debug {
    /// Holds where both hold.
    fn and(self, other: Self) -> Self;
    /// Holds where one of both holds.
    fn or(self, other: Self) -> Self;
    /// Holds where this one does not.
    fn not(self) -> Self;
    /// False only when the comparison fails for certain, in every lane and for every real in the interval.
    fn may_hold(self) -> bool;
    /// True only when the comparison holds for certain, in every lane and for every real in the interval.
    fn must_hold(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn and(self, other: bool) -> bool {
        self & other
    }
    #[inline(always)]
    fn or(self, other: bool) -> bool {
        self | other
    }
    #[inline(always)]
    fn not(self) -> bool {
        !self
    }
    #[inline(always)]
    fn may_hold(self) -> bool {
        self
    }
    #[inline(always)]
    fn must_hold(self) -> bool {
        self
    }
}

/// A number with + − × ÷ √, comparison into a mask and selection by it.
///
/// There is no ordering: a branch is `R::select(mask, a, b)`, and where the mask of an interval is undecided the
/// selection is the hull of both sides.
pub trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// What comparisons answer.
    type Mask: Mask;

    /// The constant `value`, rounded to nearest in a narrower format.
    fn constant(value: f64) -> Self;
    /// Square root; 0 for negative arguments, which only rounding can produce in this crate.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `self · self`, never negative.
    fn square(self) -> Self;
    /// The smaller of two.
    fn min(self, other: Self) -> Self;
    /// The larger of two.
    fn max(self, other: Self) -> Self;
    /// `self < other`.
    fn less(self, other: Self) -> Self::Mask;
    /// `a` where the mask holds, `b` where it does not, the hull of both where it is undecided.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// √(x² + y²). Its derivative is a unit vector, so an enclosure of it stays bounded at the origin.
    fn length(x: Self, y: Self) -> Self;
    /// Any mask is made of comparisons; these two are the constant ones.
    fn always() -> Self::Mask {
        Self::constant(0.0).less(Self::constant(1.0))
    }
    /// 0.
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// 1.
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }
    /// `self` clamped to [0, 1].
    #[inline(always)]
    fn clamp01(self) -> Self {
        self.max(Self::zero()).min(Self::one())
    }

    /// Whether this number encloses a set of values. Such a number carries [`Operand::product`] along; the others do not
    /// compute it.
    const ENCLOSES: bool = false;

    /// Of two enclosures of one value, what both allow; a plain number is its own.
    #[inline(always)]
    fn tighten(self, _other: Self) -> Self {
        self
    }

    /// The convex combination Σ αᵢ fᵢ / Σ αᵢ of operands with the sum of their weights; elevation 0 where all weights
    /// are 0. `least` is what the caller knows the sum of weights to be at least: floats ignore it, an enclosure that has
    /// lost it to dependency uses it.
    ///
    /// An enclosing number type overrides this with a tighter form: the quotient of two intervals forgets that the
    /// result lies between the smallest and the largest fᵢ.
    #[inline(always)]
    fn weighted_mean(parts: &[Operand<Self>], least: f64) -> Operand<Self> {
        let _ = least;
        plain_mean(parts)
    }
}

/// [`Real::weighted_mean`] by its own arithmetic: one sum of products, one of weights, a quotient.
#[inline(always)]
pub(crate) fn plain_mean<R: Real>(parts: &[Operand<R>]) -> Operand<R> {
    let mut sum = R::zero();
    let mut weight = R::zero();
    for part in parts {
        sum = sum + part.weight * part.elevation;
        weight = weight + part.weight;
    }
    let positive = R::zero().less(weight);
    let mean = sum / R::select(positive, weight, R::one());
    Operand { elevation: R::select(positive, mean, R::zero()), weight, product: sum }
}

/// What a node passes to the operator above it.
#[derive(Clone, Copy, Debug)]
pub struct Operand<R> {
    /// f; means nothing where the weight is 0.
    pub elevation: R,
    /// α.
    pub weight: R,
    /// α·f, which is smooth where f is not: a blend whose weights fade out has no slope bound, its product has. Only
    /// kept by enclosures ([`Real::ENCLOSES`]).
    pub product: R,
}

/// `f` as it is, and of numbers that enclose in a function of its own: formulas on them are long, and inlined into one loop with all
/// others they cost the compiler a fifth of its time. Lanes must be inlined to be compiled for the instruction set of the loop.
#[inline(always)]
pub(crate) fn apart<R: Real, T>(f: impl FnOnce() -> T) -> T {
    #[inline(never)]
    fn call<T>(f: impl FnOnce() -> T) -> T {
        f()
    }
    if R::ENCLOSES { call(f) } else { f() }
}

impl<R: Real> Operand<R> {
    /// An operand with elevation and weight.
    #[inline(always)]
    pub fn new(elevation: R, weight: R) -> Self {
        Operand { elevation, weight, product: if R::ENCLOSES { elevation * weight } else { R::zero() } }
    }
    /// `f` of each part.
    #[inline(always)]
    pub fn map<S>(self, f: impl Fn(R) -> S) -> Operand<S> {
        Operand { elevation: f(self.elevation), weight: f(self.weight), product: f(self.product) }
    }
    /// No elevation, no weight.
    #[inline(always)]
    pub fn absent() -> Self {
        Operand { elevation: R::zero(), weight: R::zero(), product: R::zero() }
    }
}

macro_rules! real_float {
    ($float:ty) => {
        impl Real for $float {
            type Mask = bool;
            #[inline(always)]
            fn constant(value: f64) -> Self {
                value as $float
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$float>::sqrt(if self > 0.0 { self } else { 0.0 })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$float>::abs(self)
            }
            #[inline(always)]
            fn square(self) -> Self {
                self * self
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if other < self { other } else { self }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self < other { other } else { self }
            }
            #[inline(always)]
            fn less(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn select(mask: bool, a: Self, b: Self) -> Self {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn length(x: Self, y: Self) -> Self {
                <$float>::sqrt(x * x + y * y)
            }
        }
    };
}
real_float!(f64);
real_float!(f32);
