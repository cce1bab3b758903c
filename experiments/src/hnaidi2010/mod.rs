//! Hnaidi et al. 2010: one module per table, figure or claim.

mod basins;
mod convergence;
mod cost;
mod curves;
mod editing;
mod figures;
pub(crate) mod models;
mod poisson;
mod rasters;
mod resolution;
mod slope;
mod table1;
mod table2;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[
    &table1::EXPERIMENT,
    &table2::EXPERIMENT,
    &cost::EXPERIMENT,
    &resolution::EXPERIMENT,
    &editing::EXPERIMENT,
    &convergence::EXPERIMENT,
    &basins::EXPERIMENT,
    &slope::EXPERIMENT,
    &poisson::EXPERIMENT,
    &figures::EXPERIMENT,
];
