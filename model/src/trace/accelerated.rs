//! Accelerated sphere tracing (Génevaux 2015 §7.2): a slope bound over the candidate segment instead of one for the
//! whole terrain, with s = δ where the ray cannot approach the terrain and min(δ, h/−c) elsewhere, in both cases
//! limited to the segment the bound was computed for (claims G13, G14). δ follows the step taken instead of doubling
//! for ever (claims G15).

use super::march::{Settings, Step, march};
use super::{Answer, RayFunction, RayPoint};
use crate::bounds::THRESHOLD;

/// δ ← GROWTH·s.
const GROWTH: f64 = 2.0;

/// The candidate segment δ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate(f64);

impl Candidate {
    /// All of the ray.
    pub fn whole() -> Candidate {
        Candidate(f64::INFINITY)
    }
    /// The next one, after a step of `taken`.
    pub fn follow(&mut self, taken: f64, settings: &Settings) {
        self.0 = GROWTH * taken.max(settings.edge);
    }
    /// The step that bounds over the candidate allow at `t`. `descent` replaces the bound on h′ over the candidate, when
    /// given.
    pub fn step<F: RayFunction>(
        &mut self,
        function: &mut F,
        (t, end): (f64, f64),
        point: RayPoint,
        descent: Option<f64>,
        settings: &Settings,
    ) -> Step {
        let delta = self.0.min(end - t).max(settings.edge);
        let bounds = function.bounds(t, t + delta);
        let descent = descent.unwrap_or(bounds.descent);
        let step = if bounds.weight.hi() < THRESHOLD || bounds.height.lo() > 0.0 {
            Step::Free(delta)
        } else {
            let to_surface = if descent >= 0.0 { delta } else { (point.height / -descent).min(delta) };
            let to_border = (point.weight - THRESHOLD).abs() / bounds.weight_slope.max(f64::MIN_POSITIVE);
            if bounds.weight.lo() >= THRESHOLD {
                Step::Free(to_surface)
            } else if !point.in_domain() {
                Step::Border(to_border.min(delta))
            } else if to_surface <= to_border {
                Step::Free(to_surface)
            } else {
                Step::Border(to_border)
            }
        };
        let (Step::Free(taken) | Step::Border(taken)) = step;
        self.follow(taken, settings);
        step
    }
}

/// Traces one ray.
pub fn trace<F: RayFunction>(function: &mut F, settings: &Settings) -> Answer {
    let mut candidate = Candidate::whole();
    march(function, settings, |function, t, end, point| candidate.step(function, (t, end), point, None, settings))
}
