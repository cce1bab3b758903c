//! The certified tracer, the ground truth for the others. It never calls `bounds`: it runs the program on duals of
//! intervals of t, so each step proves h > 0 (or no terrain) on a piece of the ray, and the end proves h < 0 at a point.
//!
//! Every `select` in a formula joins branches that agree where they meet; the only jumps are weighted means whose
//! weights all vanish, and those report an unbounded slope. So a bounded slope enclosure is a Lipschitz bound, and the
//! mean value form holds.

use super::Ray;
use super::height_ray::{along, clip, corners};
use crate::bounds::THRESHOLD;
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Cells, Evaluator, Program};
use glam::DVec2;

/// What is proved about a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Certified {
    /// h > 0 or no terrain on [start, t0), all of [t0, t1] in the domain, h < 0 at t1, t1 − t0 ≤ τ.
    Hit {
        /// Metres along the ray.
        t0: f64,
        /// Metres along the ray.
        t1: f64,
    },
    /// The same, but the solid is entered through the border of the domain, or the ray starts inside.
    Wall {
        /// Metres along the ray.
        t0: f64,
        /// Metres along the ray.
        t1: f64,
    },
    /// No terrain is met.
    Miss,
    /// Proved clear up to t0; [t0, t1] withstood.
    Undecided {
        /// Metres along the ray.
        t0: f64,
        /// Metres along the ray.
        t1: f64,
    },
}

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// τ: the longest bracket of a hit, metres along the ray.
    pub bracket: f64,
    /// Evaluations before giving an undecided answer.
    pub budget: u32,
}

impl Default for Effort {
    fn default() -> Effort {
        Effort { bracket: 1e-3, budget: 20_000 }
    }
}

/// The field over an interval of t, with derivatives along the ray.
#[derive(Clone, Copy, Debug)]
struct Enclosure {
    height: Interval,
    slope: Interval,
    weight: Interval,
}

impl Enclosure {
    fn clear(&self) -> bool {
        self.weight.hi() < THRESHOLD || self.height.lo() > 0.0
    }
    fn solid(&self) -> bool {
        self.weight.lo() >= THRESHOLD && self.height.hi() < 0.0
    }
}

/// Traces rays of one program.
#[derive(Debug)]
pub struct CertifiedTracer<'a> {
    program: &'a Program,
    cells: Option<&'a Cells>,
    support: Option<(DVec2, DVec2)>,
    evaluator: Evaluator<Dual<Interval, 1>>,
    evaluations: u64,
}

impl<'a> CertifiedTracer<'a> {
    /// A tracer for `program`.
    pub fn new(program: &'a Program) -> CertifiedTracer<'a> {
        let (support, evaluator) = (program.support(), Evaluator::new(program));
        CertifiedTracer { program, cells: None, support, evaluator, evaluations: 0 }
    }
    /// A tracer that runs the programs of squares, which many tracers share. To stay independent of `bounds` the squares
    /// are to be pruned by [`Evidence::Enclosures`](crate::program::Evidence::Enclosures).
    pub fn over(cells: &'a Cells) -> CertifiedTracer<'a> {
        CertifiedTracer { cells: Some(cells), ..CertifiedTracer::new(cells.program()) }
    }
    /// Evaluations of the program since the tracer was made.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn enclose(&mut self, ray: &Ray, t: Interval) -> Enclosure {
        self.evaluations += 1;
        let [x, y, z] = along(ray, t);
        let [lo, hi] = corners(x, y);
        let program = self.cells.map_or(self.program, |cells| cells.over(lo, hi));
        let (f, a) = self.evaluator.run(program, [x, y]);
        let h = z - f;
        Enclosure { height: h.value, slope: h.slope[0], weight: a.value }
    }

    /// Traces one ray from its origin.
    pub fn trace(&mut self, ray: &Ray, effort: &Effort) -> Certified {
        let Some((start, end)) = self.support.and_then(|(lo, hi)| clip(ray, lo, hi)) else { return Certified::Miss };
        self.prove_clear(ray, start, end, effort).unwrap_or(Certified::Miss)
    }

    /// Is h > 0 (or no terrain) proved on [start, `t`)? The cheap check of another tracer's answer; `Some(false)` means
    /// that the solid was met before.
    pub fn clear_until(&mut self, ray: &Ray, t: f64, effort: &Effort) -> Option<bool> {
        let Some((start, end)) = self.support.and_then(|(lo, hi)| clip(ray, lo, hi)) else { return Some(true) };
        if t <= start {
            return Some(true);
        }
        match self.prove_clear(ray, start, end.min(t), effort) {
            None => Some(true),
            Some(Certified::Undecided { .. }) => None,
            Some(_) => Some(false),
        }
    }

    /// Is h ≥ `epsilon` or no terrain proved at the point `t`?
    pub fn above_at(&mut self, ray: &Ray, t: f64, epsilon: f64) -> bool {
        let here = self.enclose(ray, Interval::point(t));
        here.height.lo() >= epsilon || here.weight.hi() < THRESHOLD
    }

    /// `None` when all of [start, end] is proved clear.
    fn prove_clear(&mut self, ray: &Ray, start: f64, end: f64, effort: &Effort) -> Option<Certified> {
        let mut t = start;
        let mut known = self.enclose(ray, Interval::point(t));
        if known.solid() {
            return Some(Certified::Wall { t0: t, t1: t });
        }
        // Where the ray stands: h ≥ floor is proved if there is terrain, and `known` is the field there if it was asked for.
        let (mut floor, mut asked) = (known.height.lo(), true);
        let smallest = effort.bracket / 1024.0;
        let mut width = known.height.magnitude().max(effort.bracket).min(end - start);
        let first = self.evaluations;
        while t < end {
            if self.evaluations - first > u64::from(effort.budget) {
                return Some(Certified::Undecided { t0: t, t1: t + width });
            }
            let to = (t + width).min(end);
            let piece = self.enclose(ray, Interval::new(t, to));
            // Off its support an elevation means nothing, so slopes lead from t on only where there is weight all along.
            let steady = piece.slope != Interval::ENTIRE && piece.weight.lo() > 0.0;
            let run = Interval::new(0.0, (to - t).next_up());
            let least = |floor: f64| {
                let from_t = if steady { (Interval::point(floor) + piece.slope * run).lo() } else { f64::NEG_INFINITY };
                piece.height.lo().max(from_t)
            };
            if !piece.clear() && least(floor) <= 0.0 && !asked {
                known = self.enclose(ray, Interval::point(t));
                (floor, asked) = (known.height.lo(), true);
            }
            let left = least(floor);
            if piece.clear() || left > 0.0 {
                (floor, asked) = (left, false);
                (t, width) = (to, 2.0 * (to - t));
                continue;
            }
            // h(t + s) ≥ h(t) + s·min h′ stays positive up to here.
            let falls = steady && floor > 0.0 && piece.slope.lo() < 0.0;
            let advance = if falls { (floor / -piece.slope.lo()).next_down().min(to - t) } else { 0.0 };
            let next = (t + advance).next_down();
            // Where h only falls it has reached 0 here at the latest.
            let root = if falls && piece.slope.hi() < 0.0 && piece.weight.lo() >= THRESHOLD {
                (t + (known.height.hi() / -piece.slope.hi()).next_up()).next_up()
            } else {
                f64::INFINITY
            };
            if root <= to && next > t && root - next <= effort.bracket {
                let t1 = root.next_up().min(to);
                if self.enclose(ray, Interval::point(t1)).solid() && t1 - next <= effort.bracket {
                    return Some(Certified::Hit { t0: next, t1 });
                }
            }
            if next > t && (advance > 0.25 * (to - t) || advance > smallest) {
                // A little past the root, or twice as far as it went.
                width = if root <= to { 1.01 * (root - next).max(smallest) } else { 2.0 * (next - t) };
                (t, floor, asked) = (next, 0.0, false);
            } else if width > smallest {
                width = (0.5 * width).min(0.5 * (to - t));
            } else {
                return Some(self.end_at(ray, t, &known, effort));
            }
        }
        None
    }

    /// The frontier t withstands: look for a point below the surface within τ.
    fn end_at(&mut self, ray: &Ray, t: f64, here: &Enclosure, effort: &Effort) -> Certified {
        for k in [64.0, 16.0, 4.0, 2.0, 1.0] {
            let t1 = t + effort.bracket / k;
            if self.enclose(ray, Interval::point(t1)).solid() {
                let inside =
                    here.weight.lo() >= THRESHOLD && self.enclose(ray, Interval::new(t, t1)).weight.lo() >= THRESHOLD;
                return if inside { Certified::Hit { t0: t, t1 } } else { Certified::Wall { t0: t, t1 } };
            }
        }
        Certified::Undecided { t0: t, t1: t + effort.bracket }
    }
}
