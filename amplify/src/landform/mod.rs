//! Landforms that geology and relief bring forth (Paris 2019 §6): karsts, hoodoos and goblins, floating
//! islands, arches.

pub mod arch;
pub mod energy;
mod exclusion;
pub mod hoodoo;
pub mod island;
pub mod karst;
mod parameter;
pub mod percolation;
mod random;

pub use parameter::ParameterError;
