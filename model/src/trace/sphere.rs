//! Sphere tracing with one slope bound for the whole terrain (Génevaux 2015 §7.1).
//!
//! The paper steps by |h|/λ with λ of f; safe is λ_h = √(1 + λ_f²) (claims G10). The step holds while the ray stays in
//! the domain: where the border is nearer than the surface, bounds over a candidate segment decide, so that holes and
//! disconnected domains are met one by one (claims G16) and a ray along the border does not creep.

use super::march::{Settings, Step, TOUCH, march, over_down};
use super::{Answer, RayFunction, RayPoint};
use crate::bounds::THRESHOLD;
use crate::interval::Interval;
use crate::real::Real;

/// δ ← GROWTH·s.
const GROWTH: f64 = 2.0;

/// The candidate segment δ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate(f64);

impl Candidate {
    /// `delta` metres.
    pub fn of(delta: f64) -> Candidate {
        Candidate(delta)
    }
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
        let descent = descent.unwrap_or(bounds.slope.lo());
        let step = if bounds.weight.hi() < THRESHOLD || bounds.height.lo() > 0.0 {
            Step::Free(delta)
        } else {
            let to_surface = if descent >= 0.0 { delta } else { over_down(point.height - TOUCH, -descent).min(delta) };
            let to_border = over_down((point.weight - THRESHOLD).abs(), bounds.weight_slope.max(f64::MIN_POSITIVE));
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

/// Bounds over the whole terrain.
#[derive(Clone, Copy, Debug)]
pub struct Global {
    /// λ_f on the terrain.
    pub slope: f64,
    /// λ_α.
    pub weight_slope: f64,
}

impl Global {
    /// λ_h = √(1 + λ_f²): no h changes faster along a ray.
    pub fn steepest(&self) -> f64 {
        Interval::length(Interval::point(1.0), Interval::point(self.slope)).hi()
    }
}

/// Traces one ray along which h changes by at most `steepest` a metre while it is in the domain, and α by `weight_slope`.
pub fn trace<F: RayFunction>(function: &mut F, steepest: f64, weight_slope: f64, settings: &Settings) -> Answer {
    let mut candidate = Candidate::whole();
    march(function, settings, |function, t, end, point| {
        let to_border = over_down(point.weight - THRESHOLD, weight_slope.max(f64::MIN_POSITIVE));
        let to_surface = over_down(point.height - TOUCH, steepest);
        if point.in_domain() && to_surface <= to_border {
            candidate.follow(to_surface, settings);
            return Step::Free(to_surface);
        }
        candidate.step(function, (t, end), point, Some(-steepest), settings)
    })
}
