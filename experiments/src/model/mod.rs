//! Experiments on the executors of the feature tree themselves, over all papers.

mod lattice_hash;
pub mod operations;
pub mod throughput;

use crate::experiment::Experiment;

/// These experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&throughput::EXPERIMENT, &lattice_hash::EXPERIMENT];
