//! Hnaidi et al. 2010: one module per table, figure or claim.

mod curves;
mod slope;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&slope::EXPERIMENT];
