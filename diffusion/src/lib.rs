//! Terrain from feature curves by multigrid diffusion (Hnaidi 2010).

pub mod plane;
pub mod solver;
pub mod stencil;
