//! Adaptive tessellation: which triangles a camera needs, and where their vertices lie once displaced. All but `device` is
//! the processor's and imports nothing of wgpu; kernels agree with it, leaf for leaf.

pub mod census;
pub mod coverage;
pub mod decision;
pub mod device;
pub mod displace;
pub mod ground;
mod page;
pub mod pages;
pub mod patches;
pub mod popping;
pub mod quadtree;
pub mod refine;
pub mod surface;
pub mod triangle;
pub mod view;

#[cfg(test)]
mod tests;
