//! Landforms that geology and relief bring forth (Paris 2019 §6): karsts, hoodoos and goblins, floating islands.

pub mod energy;
mod exclusion;
pub mod hoodoo;
pub mod karst;
mod parameter;
pub mod percolation;
mod random;

pub use parameter::ParameterError;
