//! A terrain along a ray: h(t) = z(t) − f(x(t), y(t)).

use super::sphere::Global;
use super::{Ray, RayBounds, RayFunction, RayPoint};
use crate::bounds::{Region, THRESHOLD, times_up};
use crate::certify::cover::largest_over;
use crate::dual::Dual;
use crate::interval::Interval;
use crate::operator::BlendRule;
use crate::program::{BoundsEvaluator, Cells, Evaluator, Evidence, Program, Sample};
use crate::real::Real;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// Splits spent on the slope bound of a whole terrain, and the finest part, as a share of the support's side.
const BUDGET: usize = 4_000;
const FINEST: f64 = 1.0 / 4096.0;

/// A program prepared for tracing: its support and its bounds over all of it.
#[derive(Clone, Debug)]
pub struct Surface<'a> {
    program: &'a Program,
    cells: Arc<Cells>,
    support: Option<(DVec2, DVec2)>,
    global: Global,
    highest: f64,
    rule: BlendRule,
    slope_cap: f64,
}

impl<'a> Surface<'a> {
    /// A terrain with the corrected bounds.
    pub fn new(program: &'a Program) -> Surface<'a> {
        Surface::with_rule(program, BlendRule::Corrected)
    }
    /// A terrain whose blends are bounded by `rule`.
    pub fn with_rule(program: &'a Program, rule: BlendRule) -> Surface<'a> {
        let support = program.support();
        let cells = Arc::new(Cells::new(program, Evidence::Ranges));
        let mut evaluator = BoundsEvaluator::with_rule(program, rule);
        let mut global = Global { slope: 0.0, weight_slope: 0.0 };
        let mut highest = f64::NEG_INFINITY;
        if let Some((lo, hi)) = support {
            let whole = Region::rectangle(lo, hi);
            let bounds = evaluator.bounds(whole);
            let smallest = (hi - lo).max_element() * FINEST;
            let slope = largest_over(whole.extent, smallest, BUDGET, |extent| {
                let [x, y] = extent;
                let part = cells.over(DVec2::new(x.lo(), y.lo()), DVec2::new(x.hi(), y.hi()));
                let bounds = evaluator.bounds_of(part, Region { extent, ends: None });
                (bounds.weight.hi() >= THRESHOLD).then_some(bounds.slope)
            });
            global = Global { slope, weight_slope: bounds.weight_slope };
            highest = bounds.elevation.hi();
        }
        Surface { program, cells, support, global, highest, rule, slope_cap: f64::INFINITY }
    }
    /// A deliberately wrong terrain: no slope bound exceeds `slope`. A control for comparisons, never for pictures.
    #[must_use]
    pub fn with_slope_cap(mut self, slope: f64) -> Surface<'a> {
        self.slope_cap = slope;
        self.global.slope = self.global.slope.min(slope);
        self
    }
    /// The same terrain without squares: every evaluation runs the whole program. An ablation.
    #[must_use]
    pub fn without_cells(self) -> Surface<'a> {
        Surface { cells: Arc::new(Cells::undivided(self.program)), ..self }
    }
    /// Bounds over the whole terrain.
    pub fn global(&self) -> Global {
        self.global
    }
    /// The program.
    pub fn program(&self) -> &'a Program {
        self.program
    }
    /// The program pruned to squares, which all rays share.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }
    /// The support box, (south-west, north-east) corners.
    pub fn support(&self) -> Option<(DVec2, DVec2)> {
        self.support
    }
}

/// Follows rays over a [`Surface`], one after the other, reusing its stacks.
#[derive(Debug)]
pub struct HeightRay<'a> {
    surface: &'a Surface<'a>,
    ray: Ray,
    values: Evaluator<f64>,
    duals: Evaluator<Dual<f64, 2>>,
    bounds: BoundsEvaluator<'a>,
    enclosures: Evaluator<Dual<Interval, 1>>,
    evaluations: u64,
    visits: u64,
}

impl<'a> HeightRay<'a> {
    /// A ray that looks straight down from the origin, until [`HeightRay::aim`].
    pub fn new(surface: &'a Surface<'a>) -> HeightRay<'a> {
        HeightRay {
            surface,
            ray: Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z },
            values: Evaluator::new(surface.program),
            duals: Evaluator::new(surface.program),
            bounds: BoundsEvaluator::with_rule(surface.program, surface.rule),
            enclosures: Evaluator::new(surface.program),
            evaluations: 0,
            visits: 0,
        }
    }
    /// Takes another ray and counts from 0.
    pub fn aim(&mut self, ray: Ray) {
        self.ray = ray;
        (self.evaluations, self.visits) = (0, 0);
    }
    /// Instructions of the pruned programs that the evaluations so far ran: nodes of the tree that were visited.
    pub fn visits(&self) -> u64 {
        self.visits
    }
    /// The program for an evaluation on the box between `p` and `q`. Counts both.
    fn program_over(&mut self, p: DVec2, q: DVec2) -> &'a Program {
        let program = self.surface.cells.over(p, q);
        self.evaluations += 1;
        self.visits += program.code().len() as u64;
        program
    }
    /// Elevation, weight and gradients below the point at `t`. Counted.
    pub fn sample(&mut self, t: f64) -> Sample {
        let p = self.ray.at(t).truncate();
        let program = self.program_over(p, p);
        self.duals.sample(program, p)
    }
}

impl RayFunction for HeightRay<'_> {
    fn span(&self) -> Option<(f64, f64)> {
        let (lo, hi) = self.surface.support?;
        let (near, far) = clip(&self.ray, lo, hi)?;
        // Above the highest ground there is nothing to meet.
        let (z, u) = (self.ray.origin.z, self.ray.direction.z);
        let at_top = (self.surface.highest - z) / u;
        let (near, far) = match () {
            () if u < 0.0 => (near.max(at_top * (1.0 - 1e-12)), far),
            () if u > 0.0 => (near, far.min(at_top * (1.0 + 1e-12))),
            () if z > self.surface.highest => return None,
            () => (near, far),
        };
        (near <= far).then_some((near, far))
    }
    fn value(&mut self, t: f64) -> RayPoint {
        let p = self.ray.at(t);
        let program = self.program_over(p.truncate(), p.truncate());
        let (elevation, weight) = self.values.run(program, [p.x, p.y]);
        RayPoint { height: p.z - elevation, weight }
    }
    fn slope(&mut self, t: f64) -> f64 {
        let u = self.ray.direction;
        u.z - self.sample(t).gradient.dot(u.truncate())
    }
    fn bounds(&mut self, t0: f64, t1: f64) -> RayBounds {
        let (p, q) = (self.ray.at(t0), self.ray.at(t1));
        let program = self.program_over(p.truncate(), q.truncate());
        let b = self.bounds.bounds_of(program, Region::segment(p.truncate(), q.truncate()));
        let u = self.ray.direction;
        // A vertical ray stays at one place, however steep the ground.
        let vertical = u.x == 0.0 && u.y == 0.0;
        let across = if vertical { 0.0 } else { Interval::length(Interval::point(u.x), Interval::point(u.y)).hi() };
        let climb = times_up(across, b.slope.min(self.surface.slope_cap));
        RayBounds {
            height: Interval::new(p.z, q.z) - b.elevation,
            slope: Interval::point(u.z) - Interval::symmetric(climb),
            weight: b.weight,
            weight_slope: times_up(across, b.weight_slope),
        }
    }
    fn enclose(&mut self, t0: f64, t1: f64) -> RayBounds {
        let [x, y, z] = along(&self.ray, Interval::new(t0, t1));
        let [lo, hi] = corners(x, y);
        let program = self.program_over(lo, hi);
        let (f, a) = self.enclosures.run(program, [x, y]);
        let h = z - f;
        RayBounds { height: h.value, slope: h.slope[0], weight: a.value, weight_slope: a.slope[0].magnitude() }
    }
    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// The coordinates of a ray over an interval of t, with their derivatives by t.
pub(super) fn along(ray: &Ray, t: Interval) -> [Dual<Interval, 1>; 3] {
    let t = Dual::<Interval, 1>::variable(t, 0);
    let fixed = |x: f64| Dual::fixed(Interval::point(x));
    [0, 1, 2].map(|k| fixed(ray.origin[k]) + fixed(ray.direction[k]) * t)
}

/// South-west and north-east corners of the box of two coordinates.
pub(super) fn corners(x: Dual<Interval, 1>, y: Dual<Interval, 1>) -> [DVec2; 2] {
    [DVec2::new(x.value.lo(), y.value.lo()), DVec2::new(x.value.hi(), y.value.hi())]
}

/// The piece of the ray, from its origin on, above the box with corners `lo` and `hi`.
pub(super) fn clip(ray: &Ray, lo: DVec2, hi: DVec2) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..2 {
        let (o, u) = (ray.origin[axis], ray.direction[axis]);
        if u == 0.0 {
            if o < lo[axis] || o > hi[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((lo[axis] - o) / u, (hi[axis] - o) / u);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    // A vertical ray ends where any terrain does: elevations beyond 10⁹ m are refused by no one, and met by no one.
    (near <= far).then_some((near, far.min(near + 1e9)))
}
