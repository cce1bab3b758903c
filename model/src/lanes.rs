//! `N` numbers of `f32` computed side by side. Plain arrays and element-wise loops, all inlined: under
//! [`pulp::Arch::dispatch`] the compiler turns them into the widest vector instructions the processor has, without a
//! build-time target and without `unsafe`.

use crate::real::{Mask, Real};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `N` lanes of `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f32; N]);

/// `N` lanes of yes or no, stored as all ones or all zeros so that a selection is two bit operations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct LaneMask<const N: usize>(pub [u32; N]);

impl<const N: usize> Lanes<N> {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: f32) -> Self {
        Lanes([x; N])
    }
    /// `f` of every lane.
    #[inline(always)]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = f(self.0[i]);
        }
        Lanes(out)
    }
    /// `f` of every pair of lanes.
    #[inline(always)]
    pub fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = f(self.0[i], other.0[i]);
        }
        Lanes(out)
    }
    /// The largest integer not above each lane, as integer and as number. Exact for magnitudes below 2²²; lanes see
    /// tile-relative coordinates only, which are smaller.
    #[inline(always)]
    pub fn floor(self) -> ([i32; N], Self) {
        // Adding 1.5·2²³ leaves the nearest integer in the low bits of the significand.
        const MAGIC: f32 = 12_582_912.0;
        let mut integers = [0; N];
        let mut numbers = [0.0; N];
        for i in 0..N {
            let shifted = self.0[i] + MAGIC;
            let nearest = shifted - MAGIC;
            // All ones where the nearest integer lies above: the difference is exact, and never −0, so as an integer
            // it is positive there and nowhere else. A comparison would be packed to bytes and unpacked again.
            let above = ((nearest - self.0[i]).to_bits() as i32).wrapping_neg() >> 31;
            integers[i] = (shifted.to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32).wrapping_add(above);
            numbers[i] = nearest - f32::from_bits(above as u32 & 1.0f32.to_bits());
        }
        (integers, Lanes(numbers))
    }
}

macro_rules! lane_operator {
    ($operator:ident, $method:ident) => {
        impl<const N: usize> $operator for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| a.$method(b))
            }
        }
    };
}
lane_operator!(Add, add);
lane_operator!(Sub, sub);
lane_operator!(Mul, mul);
lane_operator!(Div, div);
impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> LaneMask<N> {
    /// Lane `i` holds where `f(i)` does.
    #[inline(always)]
    pub fn from_fn(f: impl Fn(usize) -> bool) -> Self {
        let mut out = [0; N];
        for (i, lane) in out.iter_mut().enumerate() {
            *lane = if f(i) { u32::MAX } else { 0 };
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        let mut out = [0; N];
        for i in 0..N {
            out[i] = f(self.0[i], o.0[i]);
        }
        LaneMask(out)
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        self.zip(o, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        self.zip(o, |a, b| a | b)
    }
    #[inline(always)]
    fn not(self) -> Self {
        self.zip(self, |a, _| !a)
    }
    #[inline(always)]
    fn may_hold(self) -> bool {
        self.0.iter().fold(0, |a, b| a | b) != 0
    }
    #[inline(always)]
    fn must_hold(self) -> bool {
        self.0.iter().fold(u32::MAX, |a, b| a & b) != 0
    }
}

impl<const N: usize> Real for Lanes<N> {
    type Mask = LaneMask<N>;
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Lanes::splat(value as f32)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(|a| if a > 0.0 { a } else { 0.0 }.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }
    #[inline(always)]
    fn square(self) -> Self {
        self.map(|a| a * a)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        self.zip(o, |a, b| if b < a { b } else { a })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.zip(o, |a, b| if a < b { b } else { a })
    }
    #[inline(always)]
    fn less(self, o: Self) -> LaneMask<N> {
        LaneMask::from_fn(|i| self.0[i] < o.0[i])
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, a: Self, b: Self) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = f32::from_bits((a.0[i].to_bits() & mask.0[i]) | (b.0[i].to_bits() & !mask.0[i]));
        }
        Lanes(out)
    }
    #[inline(always)]
    fn length(x: Self, y: Self) -> Self {
        (x * x + y * y).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn floor_is_exact_below_two_to_the_twenty_second(x in -4_194_303.0f32..4_194_303.0) {
            let (integers, numbers) = Lanes([x; 4]).floor();
            prop_assert_eq!(numbers.0[0], x.floor());
            prop_assert_eq!(integers[0], x.floor() as i32);
        }

        #[test]
        fn lanes_compute_what_f32_computes(a in proptest::array::uniform8(-1e3f32..1e3), b in proptest::array::uniform8(-1e3f32..1e3)) {
            fn formula<R: Real>(x: R, y: R) -> R {
                let s = R::select(x.less(y), x * y, (x.abs() + R::one()) / y.square().max(R::constant(0.5)));
                R::length(s, -x).sqrt().min(y)
            }
            let wide = formula(Lanes(a), Lanes(b));
            for i in 0..8 {
                prop_assert_eq!(wide.0[i], formula(a[i], b[i]));
            }
        }
    }
}
