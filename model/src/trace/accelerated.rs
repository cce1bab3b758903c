//! Accelerated sphere tracing (Génevaux 2015 §7.2): a slope bound over the candidate segment instead of one for the
//! whole terrain.
//!
//! [`trace`] takes λ(t, δ) as bounds of h′ in both directions and lets `stride` choose δ. [`trace_paper`]
//! doubles δ after every step, as printed, so λ(t, δ) soon is the slope bound of the whole terrain (claims G15). Both
//! limit a step to the segment that the bound was computed for, with s = δ where the ray cannot approach the terrain
//! (claims G13, G14).

use super::march::{Settings, march};
use super::sphere::Candidate;
use super::stride::stride;
use super::{Answer, RayFunction};

/// Traces one ray.
pub fn trace<F: RayFunction>(function: &mut F, settings: &Settings) -> Answer {
    stride(function, settings, F::bounds)
}

/// Traces one ray with δ as printed; it starts with the height above the ground.
pub fn trace_paper<F: RayFunction>(function: &mut F, settings: &Settings) -> Answer {
    let mut delta = 0.0;
    march(function, settings, |function, t, end, point| {
        delta = if delta == 0.0 { point.height.abs().max(settings.bracket) } else { 2.0 * delta };
        Candidate::of(delta).step(function, (t, end), point, None, settings)
    })
}
