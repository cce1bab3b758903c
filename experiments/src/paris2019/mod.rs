//! Paris et al. 2019: one module per table, figure or claim.

pub mod amplified;
pub mod benagil;
mod bvh;
mod drainage;
mod draw;
mod figures;
mod geology;
mod hydrology;
mod instancing;
mod landforms;
pub(crate) mod landscapes;
mod meshing;
mod queries;
mod scaling;
pub mod scenes;
mod stacks;
mod table1;
pub mod tracing;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[
    &geology::EXPERIMENT,
    &figures::EXPERIMENT,
    &queries::EXPERIMENT,
    &scaling::EXPERIMENT,
    &instancing::EXPERIMENT,
    &meshing::EXPERIMENT,
    &stacks::EXPERIMENT,
    &landforms::EXPERIMENT,
    &table1::EXPERIMENT,
    &tracing::EXPERIMENT,
    &hydrology::EXPERIMENT,
];
