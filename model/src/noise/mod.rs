//! Lattice noises with proven ranges and slopes. Each is an in-cell formula written once over the number type, and a
//! walker per number that finds the cell and its corner gradients.

pub mod corner;
mod enclose;
pub mod fractal;
pub mod gradient2;
pub mod gradient3;
pub mod hash;
mod hunt;
mod rounded;
pub mod simplex3;
mod taylor;
mod walk;

use crate::dual::{Differentiable, Dual};
use crate::real::Real;
pub use fractal::{Bounds, Combination, Octave, Octaves, fbm, multifractal, ridged, turbulence};
pub use hash::mix;
pub use hunt::{Prey, Witness, hunt};

/// Upper bound of |n| for [`NoiseValue::gradient2`]. A witness reaches 0.6608164; certified with 1 624 boxes, 0.04 s
/// ([`crate::certify::noise::gradient2_range`]).
pub const GRADIENT2_RANGE: f64 = 0.6609;
/// Upper bound of ‖∇n‖ for [`NoiseValue::gradient2`]. A witness at the centre of the cell reaches
/// cos(π/8)·15/8 + sin(π/8)·7/8 = 2.0671221; certified with 3 778 boxes, 0.1 s
/// ([`crate::certify::noise::gradient2_slope`]).
pub const GRADIENT2_SLOPE: f64 = 2.0674;
/// Upper bounds of |∂²n/∂x²| and of |∂²n/∂x∂y| for [`NoiseValue::gradient2`]
/// ([`crate::certify::noise::gradient2_curvature`]). Witnesses at (0.25, 0.5) and (0.76, 0.5) reach 7.7299 and 5.2849.
pub const GRADIENT2_CURVATURE: [f64; 2] = [7.75, 5.3];
/// Upper bounds of |∂³n/∂x³| and of |∂³n/∂x²∂y| inside a cell for [`NoiseValue::gradient2`]
/// ([`crate::certify::noise::gradient2_curvature`]). Witnesses at (0, 0.5) and (0.525, 0.5) reach 94.63 and 26.22.
pub const GRADIENT2_THIRD: [f64; 2] = [95.0, 26.4];
/// Upper bound of |n| for [`NoiseValue::gradient3`]. A witness at (0.5, 0.48149, 0.35526) reaches 1.0363538; certified
/// with 18 796 boxes, 0.4 s ([`crate::certify::noise::gradient3_range`]).
pub const GRADIENT3_RANGE: f64 = 1.0365;
/// Upper bound of ‖∇n‖ for [`NoiseValue::gradient3`]. A witness at the centre of the cell reaches 15/4; certified with
/// 209 thousand boxes, 6 s ([`crate::certify::noise::gradient3_slope`]).
pub const GRADIENT3_SLOPE: f64 = 3.7538;
/// Upper bound of |n| for [`NoiseValue::simplex3`]. A witness reaches 0.2943183; certified with 6 883 boxes, 0.1 s
/// ([`crate::certify::noise::simplex3_range`]).
pub const SIMPLEX3_RANGE: f64 = 0.2944;
/// Upper bound of ‖∇n‖ for [`NoiseValue::simplex3`]. A witness reaches 2.0504985; certified with 4.8 million boxes in three
/// minutes; the 2 344 465 leaves are stored in `certificates/simplex3-slope.*`
/// ([`crate::certify::noise::simplex3_slope`]).
pub const SIMPLEX3_SLOPE: f64 = 2.071;

/// An integer lattice of random gradients in `D` dimensions.
///
/// `base` is added to the cell index: a tile evaluates small local coordinates over the same lattice that world
/// coordinates would meet (index = base + ⌊x⌋), which is how `f32` stays exact far from the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice<const D: usize> {
    /// Selects one of 2³² independent lattices.
    pub seed: u32,
    /// Cell index of the coordinate origin.
    pub base: [i32; D],
}

/// A number on which the noises can be evaluated.
pub trait NoiseValue: Real {
    /// Gradient noise in the plane, unit gradients in 8 directions, quintic fade.
    fn gradient2(lattice: Lattice<2>, x: [Self; 2]) -> Self;
    /// Gradient noise in space, the 12 edge gradients of length √2, quintic fade.
    fn gradient3(lattice: Lattice<3>, x: [Self; 3]) -> Self;
    /// Simplex noise in space, kernel (1/2 − d²)⁴.
    fn simplex3(lattice: Lattice<3>, x: [Self; 3]) -> Self;
}

/// A number on which the noises give value and gradient in one call: `[n, ∂n/∂x, ∂n/∂y, …]`.
pub trait NoiseJet: NoiseValue {
    /// [`NoiseValue::gradient2`] with its gradient.
    fn gradient2_jet(lattice: Lattice<2>, x: [Self; 2]) -> [Self; 3];
    /// [`NoiseValue::gradient3`] with its gradient.
    fn gradient3_jet(lattice: Lattice<3>, x: [Self; 3]) -> [Self; 4];
    /// [`NoiseValue::simplex3`] with its gradient.
    fn simplex3_jet(lattice: Lattice<3>, x: [Self; 3]) -> [Self; 4];
}

impl<R: NoiseJet + Differentiable, const K: usize> NoiseValue for Dual<R, K> {
    #[inline(always)]
    fn gradient2(lattice: Lattice<2>, x: [Self; 2]) -> Self {
        let [value, dx, dy] = R::gradient2_jet(lattice, x.map(|x| x.value));
        Dual::chain(value, [dx, dy], x)
    }
    #[inline(always)]
    fn gradient3(lattice: Lattice<3>, x: [Self; 3]) -> Self {
        let [value, dx, dy, dz] = R::gradient3_jet(lattice, x.map(|x| x.value));
        Dual::chain(value, [dx, dy, dz], x)
    }
    #[inline(always)]
    fn simplex3(lattice: Lattice<3>, x: [Self; 3]) -> Self {
        let [value, dx, dy, dz] = R::simplex3_jet(lattice, x.map(|x| x.value));
        Dual::chain(value, [dx, dy, dz], x)
    }
}
