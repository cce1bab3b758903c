//! Skeletons of curve primitives (Génevaux 2015 §4.1): a chain of arcs, the nearest of which decides. Arcs stand in runs
//! with boxes, so that the cost at a point does not grow with the length of the chain.

pub mod arc;
mod slope;

use crate::falloff::wyvill;
use crate::primitive::{Number, Parameters};
use crate::real::{Mask, Operand};
use arc::{Place, Stretch, surely_less};
use glam::DVec2;

/// Arcs of a run.
const RUN: usize = 8;
/// Parameters of a run: middle of its box, half its width and height, and a slope bound of what lies around it.
const RUN_WIDTH: usize = 5;
/// Parameters before the runs: 1/E, q, how far elevations go on past an end, and a distance beyond the support.
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

/// q over the joint, and E: √(s² + q²) = q + E, so that on the skeleton an arc takes part within s.
const ROUNDING: f64 = 0.25;
const WIDTH: f64 = 0.780_776_406_404_415_1;
/// How far past its ends, in joints, a stretch goes on as its neighbour does.
const BEYOND: f64 = 3.0;

/// The parameters of a chain whose support has radius `radius` and whose joints are averaged over `joint` metres.
pub(crate) fn parameters(stretches: &[Stretch], radius: f64, joint: f64) -> Vec<f64> {
    let mut out = vec![1.0 / (WIDTH * joint), ROUNDING * joint, BEYOND * joint, 1.01 * radius];
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
    /// Distance to the skeleton, metres; something beyond the support where that is far.
    #[inline(always)]
    pub fn nearest<R: Number>(&self, x: [R; 2]) -> R {
        let mut nearest = self.p.get::<R>(3);
        for run in 0..self.runs() {
            if surely_less(nearest.square(), self.least_squared(run, x)) {
                continue;
            }
            for k in self.of_run(run) {
                nearest = nearest.min(arc::place(self.arc(k), x).distance);
            }
        }
        nearest
    }
    /// D = √(d² + q²): a distance that is smooth on the skeleton.
    #[inline(always)]
    fn rounded<R: Number>(&self, distance: R) -> R {
        R::length(distance, self.p.get(1))
    }
    /// Calls `with` with every arc that may take part, its place and its weight.
    #[inline(always)]
    fn for_each<R: Number>(&self, x: [R; 2], nearest: R, mut with: impl FnMut(Parameters<'a, P>, &Place<R>, R)) {
        let smallest = self.rounded(nearest);
        let width = R::constant(1.0) / self.p.get::<R>(0);
        let far = (smallest + width).square() - self.p.get::<R>(1).square();
        for run in 0..self.runs() {
            if surely_less(far, self.least_squared(run, x)) {
                continue;
            }
            for k in self.of_run(run) {
                let place = arc::place(self.arc(k), x);
                let excess = ((self.rounded(place.distance) - smallest) * self.p.get(0)).max(R::zero());
                if excess.less(R::one()).may_hold() {
                    with(self.arc(k), &place, excess);
                }
            }
        }
    }
    /// Elevation where the distance is `nearest`: the mean over the arcs that are about as near. `section` is what stands on
    /// the skeleton at a place and an abscissa.
    ///
    /// An arc whose D exceeds the smallest by e has weight g = (1 − e/E)³, the nearest weight 1.
    #[inline(always)]
    pub fn elevation<R: Number>(&self, x: [R; 2], nearest: R, section: impl Fn(&Place<R>, R) -> R) -> R {
        let reach = self.p.get::<R>(2);
        let at = |p: Parameters<P>, place: &Place<R>| {
            let (z, s) = arc::elevation(p, place, reach);
            z + section(place, s)
        };
        if self.arcs == 1 {
            return at(self.arc(0), &arc::place(self.arc(0), x));
        }
        let mut parts = [Operand::absent(); TOGETHER];
        let mut count = 0;
        let mut hull: Option<[R; 2]> = None;
        self.for_each(x, nearest, |p, place, excess| {
            if count == TOGETHER {
                parts[0] = R::weighted_mean(&parts, 0.0);
                count = 1;
            }
            let here = at(p, place);
            parts[count] = Operand::new(here, wyvill(excess));
            count += 1;
            hull = Some(hull.map_or([here; 2], |[lo, hi]| [lo.min(here), hi.max(here)]));
        });
        let mean = R::weighted_mean(&parts[..count], 1.0).elevation;
        // Rounding leaves what is averaged: where all are equally high, their mean is as high to the last bit.
        match hull {
            Some([lo, hi]) if !R::ENCLOSES => mean.max(lo).min(hi),
            _ => mean,
        }
    }
}
