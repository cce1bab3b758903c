//! Paris et al. 2019: one module per table, figure or claim.

mod queries;
mod scenes;
mod tracing;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&queries::EXPERIMENT, &tracing::EXPERIMENT];
