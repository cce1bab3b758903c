//! The tessellation paper: one module per table, figure or claim.

mod cameras;
mod cracks;
mod edges;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&cracks::EXPERIMENT, &edges::EXPERIMENT];
