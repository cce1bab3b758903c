//! What runs on an adapter: one module per comparison with the processor.

mod conformance;
mod diffusion;
mod tracing;

use crate::experiment::{Experiment, ExperimentError};
use crate::report::Outcome;
use terrain_gpu::adapter::required;
use terrain_gpu::context::Context;

/// The adapter at hand; the outcome of an experiment that has none.
///
/// # Errors
/// When there is none and the environment says that there must be.
pub fn adapter() -> Result<Result<Context, Outcome>, ExperimentError> {
    match Context::new(None) {
        Ok(context) => Ok(Ok(context)),
        Err(error) if required() => Err(ExperimentError::failed(error)),
        Err(error) => Ok(Err(Outcome::skipped(error.to_string()))),
    }
}

/// The experiments of the adapter, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[&conformance::EXPERIMENT, &tracing::EXPERIMENT, &diffusion::EXPERIMENT];
