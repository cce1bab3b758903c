//! What runs on an adapter: one module per comparison with the processor.

mod conformance;
mod tracing;

use crate::experiment::Experiment;

/// The experiments of the adapter, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&conformance::EXPERIMENT, &tracing::EXPERIMENT];
