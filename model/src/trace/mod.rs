//! Ray tracing of fields: written once against [`RayFunction`], which is positive outside the solid.

pub mod accelerated;
pub mod camera;
pub mod certified;
mod delta;
mod height_ray;
mod march;
pub mod segment;
pub mod shade;
pub mod sphere;
mod stride;

pub use height_ray::{HeightRay, Surface};
pub use march::Settings;

use crate::bounds::THRESHOLD;
use crate::interval::Interval;
use glam::DVec3;

/// A ray with a unit direction; t is in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
}

impl Ray {
    /// The point at `t` metres.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// A field at one point of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayPoint {
    /// h: height above the surface, metres; means nothing off the support.
    pub height: f64,
    /// α.
    pub weight: f64,
}

impl RayPoint {
    /// Does the solid's domain hold this point?
    pub fn in_domain(&self) -> bool {
        self.weight >= THRESHOLD
    }
    /// Is it inside the solid?
    pub fn solid(&self) -> bool {
        self.in_domain() && self.height <= 0.0
    }
}

/// A field over a piece of a ray.
#[derive(Clone, Copy, Debug)]
pub struct RayBounds {
    /// Encloses h wherever the weight is positive.
    pub height: Interval,
    /// Encloses the difference quotients of h along the ray, where the whole piece lies in the domain.
    pub slope: Interval,
    /// Encloses α.
    pub weight: Interval,
    /// The largest change of α per metre of the ray.
    pub weight_slope: f64,
}

/// What a tracer needs of a field along one ray.
pub trait RayFunction {
    /// The piece of the ray that can meet the field's support.
    fn span(&self) -> Option<(f64, f64)>;
    /// The field at `t`. Counted.
    fn value(&mut self, t: f64) -> RayPoint;
    /// dh/dt at `t`. Counted.
    fn slope(&mut self, t: f64) -> f64;
    /// Bounds over [t0, t1]. Counted.
    fn bounds(&mut self, t0: f64, t1: f64) -> RayBounds;
    /// The same from one run on duals of intervals of t: h′ instead of a slope in any direction. Counted.
    fn enclose(&mut self, t0: f64, t1: f64) -> RayBounds;
    /// Evaluations so far: each `value`, `slope`, `bounds` and `enclose` is one.
    fn evaluations(&self) -> u64;
}

/// What a tracer found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The surface is met just behind `t`, with 0 ≤ h(t) < ε.
    Hit {
        /// Metres along the ray.
        t: f64,
    },
    /// The domain is entered below the surface at `t`, or the ray starts inside.
    Wall {
        /// Metres along the ray.
        t: f64,
    },
    /// The ray leaves without meeting anything.
    Miss,
    /// The step budget ran out at `t`.
    GaveUp {
        /// Metres along the ray.
        t: f64,
    },
}

impl Answer {
    /// Where the solid is met.
    pub fn distance(&self) -> Option<f64> {
        match *self {
            Answer::Hit { t } | Answer::Wall { t } => Some(t),
            Answer::Miss | Answer::GaveUp { .. } => None,
        }
    }
}

/// The tracers that answer for a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tracer {
    /// Global slope bound (Génevaux 2015 §7.1, with claims G10).
    Sphere,
    /// Slope bound over a candidate segment (§7.2, with claims G13–G15).
    Accelerated,
    /// The same with the candidate as printed: doubled after every step (claims G15).
    AcceleratedPaper,
    /// Bounds of h′ along the candidate segment (Galin 2020).
    Segment,
}

impl Tracer {
    /// Those that are held against the certified tracer.
    pub const ALL: [Tracer; 3] = [Tracer::Sphere, Tracer::Accelerated, Tracer::Segment];
    /// With the paper's own choice of δ.
    pub const WITH_PAPER: [Tracer; 4] =
        [Tracer::Sphere, Tracer::Accelerated, Tracer::AcceleratedPaper, Tracer::Segment];
    /// The name on command lines and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Tracer::Sphere => "sphere",
            Tracer::Accelerated => "accelerated",
            Tracer::AcceleratedPaper => "accelerated_paper",
            Tracer::Segment => "segment",
        }
    }
    /// Traces one ray of a surface.
    pub fn trace(self, surface: &Surface<'_>, ray: &mut HeightRay<'_>, settings: &Settings) -> Answer {
        match self {
            Tracer::Sphere => {
                let global = surface.global();
                sphere::trace(ray, global.steepest(), global.weight_slope, settings)
            }
            Tracer::Accelerated => accelerated::trace(ray, settings),
            Tracer::AcceleratedPaper => accelerated::trace_paper(ray, settings),
            Tracer::Segment => segment::trace(ray, settings),
        }
    }
}
