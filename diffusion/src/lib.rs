//! Terrain from feature curves by multigrid diffusion (Hnaidi 2010).

pub mod curve;
pub mod detail;
pub mod edit;
pub mod fields;
pub mod landscape;
pub mod landscapes;
pub mod plane;
pub mod presets;
pub mod raster;
pub mod solver;
