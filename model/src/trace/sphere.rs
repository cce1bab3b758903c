//! Sphere tracing with one slope bound for the whole terrain (Génevaux 2015 §7.1).
//!
//! The paper steps by |h|/λ with λ of f; safe is λ_h = √(1 + λ_f²) (claims G10). Off the terrain the weight is marched
//! the same way, with λ_α, so that holes and disconnected domains are met one by one (claims G16).

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
    march(function, settings, |_, _, end, point| {
        let to_border = (point.weight - THRESHOLD).abs() / global.weight_slope.max(f64::MIN_POSITIVE);
        if !point.in_domain() {
            return Step::Border(to_border.min(end));
        }
        let to_surface = point.height / steepest;
        if to_surface <= to_border { Step::Free(to_surface) } else { Step::Border(to_border) }
    })
}
