//! Lattice noises with proven ranges and slopes. Each is an in-cell formula written once over the number type, and a
//! walker per number that finds the cell and its corner gradients.

use crate::real::Real;

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
