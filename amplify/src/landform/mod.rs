//! Landforms that geology and relief bring forth (Paris 2019 §6): sea cliffs, canyons, karsts, hoodoos and goblins, floating
//! islands, arches.

pub mod arch;
pub mod canyon;
pub mod energy;
pub mod ground;
pub mod hoodoo;
pub mod island;
pub mod karst;
mod parameter;
pub mod percolation;
mod random;
pub mod raster;
pub mod sea;
pub mod shallow;

pub(crate) use parameter::Check;
pub use parameter::ParameterError;
