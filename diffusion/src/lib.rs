//! Terrain from feature curves by multigrid diffusion (Hnaidi 2010).

pub mod curve;
pub mod fields;
pub mod plane;
pub mod raster;
pub mod solver;
