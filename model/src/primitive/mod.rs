//! The leaves of the tree: each file holds one primitive, its formula over any [`Number`] and its bounds.

pub mod curve;
pub mod disc;
pub mod image;

use crate::noise::NoiseValue;
use image::ImageNumber;

/// What a tree can be evaluated on.
pub trait Number: NoiseValue + ImageNumber {}
impl<R: NoiseValue + ImageNumber> Number for R {}

/// Reads consecutive parameters as numbers.
#[derive(Clone, Copy)]
pub struct Parameters<'a, P>(pub &'a [P]);

impl<P: Copy + Into<f64>> Parameters<'_, P> {
    /// The `k`-th one.
    #[inline(always)]
    pub fn get<R: Number>(&self, k: usize) -> R {
        R::constant(self.0[k].into())
    }
    /// The `k`-th and the next one.
    #[inline(always)]
    pub fn pair<R: Number>(&self, k: usize) -> [R; 2] {
        [self.get(k), self.get(k + 1)]
    }
}
