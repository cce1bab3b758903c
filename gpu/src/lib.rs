//! The GPU side: adapters, and kernels that compute what `terrain-model` and `terrain-diffusion` compute, on wgpu.

pub mod adapter;
pub mod ceiling;
pub mod context;
pub mod diffusion;
pub mod lattice_hash;
pub mod meter;
pub mod program;
pub mod tessellate;
pub mod trace;
