//! The GPU side: adapters, and kernels that compute what `terrain-model` computes, on wgpu.

pub mod context;
pub mod lattice_hash;
pub mod program;
pub mod tessellate;
pub mod trace;
