//! Experiments on the executors of the feature tree themselves, over all papers.

mod floor;
pub mod throughput;

use crate::experiment::Experiment;

/// These experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&throughput::EXPERIMENT];
