//! Adaptive tessellation on the processor: which triangles a camera needs, and where their vertices lie once displaced.
//! It imports nothing of wgpu; kernels of the same names must agree with it, leaf for leaf.

pub mod census;
pub mod coverage;
pub mod displace;
pub mod ground;
pub mod refine;
pub mod triangle;
pub mod view;

#[cfg(test)]
mod tests;
