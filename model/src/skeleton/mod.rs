//! Skeletons of curve primitives (Génevaux 2015 §4.1): a chain of arcs, the nearest of which decides. Arcs stand in runs
//! with boxes, so that the cost at a point does not grow with the length of the chain.

pub mod arc;
mod enclose;

use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::primitive::{Number, Parameters};
use crate::real::{Mask, Operand};
use arc::{Place, Stretch, surely_less};
use glam::DVec2;

/// Arcs of a run.
const RUN: usize = 8;
/// Parameters of a run: middle of its box, half its width and height, and a slope bound of what lies around it.
const RUN_WIDTH: usize = 5;
/// Parameters before the runs: 1/s², s, s², and a squared distance beyond the support; s is the joint.
const HEADER: usize = 4;

/// The compiled form of a chain of `arcs`: parameters that start at `p`.
#[derive(Clone, Copy)]
pub(crate) struct Chain<'a, P> {
    p: Parameters<'a, P>,
    arcs: usize,
}

/// Number of parameters of a chain.
pub(crate) fn width(arcs: usize) -> usize {
    HEADER + arcs.div_ceil(RUN) * RUN_WIDTH + arcs * arc::WIDTH
}

/// The parameters of a chain whose support has radius `radius` and whose joints are averaged over `joint` metres.
pub(crate) fn parameters(stretches: &[Stretch], radius: f64, joint: f64) -> Vec<f64> {
    let mut out = vec![1.0 / (joint * joint), joint, joint * joint, 1.02 * radius * radius];
    for run in stretches.chunks(RUN) {
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for stretch in run {
            let (from, to) = stretch.arc.extent();
            (lo, hi) = (lo.min(from), hi.max(to));
        }
        // Wider than what rounding to f32 can move an arc by: a run that is passed over is never the nearest.
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo) + DVec2::splat(0.01 * radius));
        out.extend([middle.x, middle.y, half.x, half.y, f64::INFINITY]);
    }
    for stretch in stretches {
        out.extend(stretch.parameters());
    }
    out
}

/// Moves the origin of a chain's parameters.
pub(crate) fn rebase(parameters: &mut [f64], arcs: usize, origin: DVec2) {
    let runs = arcs.div_ceil(RUN) * RUN_WIDTH;
    let (runs, arcs) = parameters[HEADER..width(arcs)].split_at_mut(runs);
    for placed in runs.chunks_exact_mut(RUN_WIDTH).chain(arcs.chunks_exact_mut(arc::WIDTH)) {
        placed[0] -= origin.x;
        placed[1] -= origin.y;
    }
}

/// Where the slope bound of a run stands in the parameters of its chain.
pub(crate) fn slope_of_run(run: usize) -> usize {
    HEADER + run * RUN_WIDTH + 4
}

/// Candidates that are averaged together; more are averaged in turns.
const TOGETHER: usize = 16;

impl<'a, P: Copy + Into<f64>> Chain<'a, P> {
    pub fn new(p: Parameters<'a, P>, arcs: usize) -> Chain<'a, P> {
        Chain { p, arcs }
    }
    fn runs(&self) -> usize {
        self.arcs.div_ceil(RUN)
    }
    #[inline(always)]
    fn of_run(&self, run: usize) -> std::ops::Range<usize> {
        run * RUN..((run + 1) * RUN).min(self.arcs)
    }
    #[inline(always)]
    fn arc(&self, k: usize) -> Parameters<'a, P> {
        self.p.from(HEADER + self.runs() * RUN_WIDTH + k * arc::WIDTH)
    }
    /// Middles and half sizes of the boxes of the runs.
    pub fn boxes(self) -> impl Iterator<Item = [f64; 4]> + use<'a, P> {
        (0..self.runs()).map(move |run| [0, 1, 2, 3].map(|k| self.p.0[HEADER + run * RUN_WIDTH + k].into()))
    }
    /// No arc of the run is nearer than the root of this.
    #[inline(always)]
    fn least_squared<R: Number>(&self, run: usize, x: [R; 2]) -> R {
        let p = self.p.from(HEADER + run * RUN_WIDTH);
        let over = |k: usize| ((x[k] - p.get::<R>(k)).abs() - p.get::<R>(k + 2)).max(R::zero());
        over(0).square() + over(1).square()
    }
    /// Parameters of a chain of the arcs that decide anywhere on a box, and their number: the others are farther than the
    /// nearest by more than the joint, or beyond the support.
    pub fn near(&self, x: [Interval; 2]) -> (Vec<f64>, usize) {
        let nearest = self.nearest_squared(x);
        let far = nearest + self.p.get(2);
        let mut arcs: Vec<f64> = Vec::new();
        for run in (0..self.runs()).filter(|run| !surely_less(far, self.least_squared(*run, x))) {
            for k in self.of_run(run) {
                if !surely_less(far, arc::place(self.arc(k), x).distance_squared) {
                    arcs.extend(self.arc(k).0[..arc::WIDTH].iter().map(|v| (*v).into()));
                }
            }
        }
        let count = arcs.len() / arc::WIDTH;
        let mut out: Vec<f64> = (0..HEADER).map(|k| self.p.0[k].into()).collect();
        // Boxes that hold everything: what is left is not passed over again.
        out.extend([0.0, 0.0, f64::INFINITY, f64::INFINITY, f64::INFINITY].repeat(count.div_ceil(RUN)));
        out.extend(arcs);
        (out, count)
    }
    /// Squared distance to the skeleton, metres²; something beyond the support where that is far.
    #[inline(always)]
    pub fn nearest_squared<R: Number>(&self, x: [R; 2]) -> R {
        let mut nearest = self.p.get::<R>(3);
        for run in 0..self.runs() {
            if surely_less(nearest, self.least_squared(run, x)) {
                continue;
            }
            for k in self.of_run(run) {
                nearest = nearest.min(arc::place(self.arc(k), x).distance_squared);
            }
        }
        nearest
    }
    /// Elevation where the squared distance is `nearest`: the mean over the arcs that are about as near. `section` is what
    /// stands on the skeleton at (side, abscissa).
    ///
    /// An arc whose squared distance exceeds the smallest by e has weight g(e/s²), the nearest weight 1.
    #[inline(always)]
    pub fn elevation<R: Number>(&self, x: [R; 2], nearest: R, section: impl Fn(R, R) -> R) -> R {
        let reach = self.p.get::<R>(1);
        let at = |k: usize, place: &Place<R>| {
            let (z, s) = arc::elevation(self.arc(k), place, reach);
            z + section(place.side, s)
        };
        if self.arcs == 1 {
            return at(0, &arc::place(self.arc(0), x));
        }
        let far = nearest + self.p.get(2);
        let mut parts = [Operand::absent(); TOGETHER];
        let mut count = 0;
        for run in 0..self.runs() {
            if surely_less(far, self.least_squared(run, x)) {
                continue;
            }
            for k in self.of_run(run) {
                let place = arc::place(self.arc(k), x);
                let excess = (place.distance_squared - nearest).max(R::zero()) * self.p.get::<R>(0);
                if !excess.less(R::one()).may_hold() {
                    continue;
                }
                if count == TOGETHER {
                    parts[0] = R::weighted_mean(&parts, 0.0);
                    count = 1;
                }
                parts[count] = Operand::new(at(k, &place), wyvill(excess));
                count += 1;
            }
        }
        R::weighted_mean(&parts[..count], 1.0).elevation
    }
}
