//! Sphere tracing with one slope bound for the whole terrain (Génevaux 2015 §7.1).
//!
//! The paper steps by |h|/λ with λ of f; safe is λ_h = √(1 + λ_f²) (claims G10). The step holds while the ray stays in
//! the domain: where the border is nearer than the surface, bounds over a candidate segment decide, so that holes and
//! disconnected domains are met one by one (claims G16) and a ray along the border does not creep.

use super::accelerated::Candidate;
use super::march::{Settings, Step, march};
use super::{Answer, RayFunction};
use crate::bounds::THRESHOLD;

/// Bounds over the whole terrain.
#[derive(Clone, Copy, Debug)]
pub struct Global {
    /// λ_f on the terrain.
    pub slope: f64,
    /// λ_α.
    pub weight_slope: f64,
}

/// Traces one ray.
pub fn trace<F: RayFunction>(function: &mut F, global: Global, settings: &Settings) -> Answer {
    let steepest = (1.0 + global.slope * global.slope).sqrt();
    let mut candidate = Candidate::whole();
    march(function, settings, |function, t, end, point| {
        let to_border = (point.weight - THRESHOLD) / global.weight_slope.max(f64::MIN_POSITIVE);
        let to_surface = point.height / steepest;
        if point.in_domain() && to_surface <= to_border {
            candidate.follow(to_surface, settings);
            return Step::Free(to_surface);
        }
        candidate.step(function, (t, end), point, Some(-steepest), settings)
    })
}
