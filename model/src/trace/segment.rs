//! Segment tracing (Galin 2020): the bound on h′ is taken along the candidate segment itself, not in every direction.

use super::march::Settings;
use super::stride::stride;
use super::{Answer, RayFunction};

/// Traces one ray.
pub fn trace<F: RayFunction>(function: &mut F, settings: &Settings) -> Answer {
    stride(function, settings, F::enclose)
}
