//! Génevaux et al. 2015: one module per table, figure or claim.

pub mod ablations;
mod adaptive;
mod blend_bound;
mod falloff;
mod fig17;
mod figures;
mod meshes;
mod noise_bound;
pub mod rays;
pub mod record;
mod scaling;
pub mod scenes;
pub(crate) mod signed_error;
mod table1;
mod tightness;
mod tin;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[
    &table1::EXPERIMENT,
    &falloff::EXPERIMENT,
    &blend_bound::EXPERIMENT,
    &noise_bound::EXPERIMENT,
    &adaptive::EXPERIMENT,
    &tin::EXPERIMENT,
    &figures::EXPERIMENT,
    &fig17::EXPERIMENT,
    &scaling::EXPERIMENT,
    &ablations::EXPERIMENT,
    &tightness::EXPERIMENT,
];
