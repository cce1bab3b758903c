//! The certified tracer, the ground truth for the others. It never calls `bounds`: it runs the program on duals of
//! intervals of t, so each step proves h > 0 (or no terrain) on a piece of the ray, and the end proves h < 0 at a point.
//!
//! Every `select` in a formula joins branches that agree where they meet; the only jumps are weighted means whose
//! weights all vanish, and those report an unbounded slope. So a bounded slope enclosure is a Lipschitz bound, and the
//! mean value form holds.

use super::{Ray, height_ray::clip};
use crate::bounds::THRESHOLD;
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Evaluator, Program};
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
    support: Option<(DVec2, DVec2)>,
    evaluator: Evaluator<Dual<Interval, 1>>,
    evaluations: u64,
}

impl<'a> CertifiedTracer<'a> {
    /// A tracer for `program`.
    pub fn new(program: &'a Program) -> CertifiedTracer<'a> {
        CertifiedTracer { program, support: program.support(), evaluator: Evaluator::new(program), evaluations: 0 }
    }
    /// Evaluations of the program since the tracer was made.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn enclose(&mut self, ray: &Ray, t: Interval) -> Enclosure {
        self.evaluations += 1;
        let t = Dual::<Interval, 1>::variable(t, 0);
        let along = |k: usize| {
            let fixed = |x: f64| Dual::fixed(Interval::point(x));
            fixed(ray.origin[k]) + fixed(ray.direction[k]) * t
        };
        let (f, a) = self.evaluator.run(self.program, [along(0), along(1)]);
        let h = along(2) - f;
        Enclosure { height: h.value, slope: h.slope[0], weight: a.value }
    }

    /// h over [a, b] by the mean value form about a, met with the natural form.
    fn over(&mut self, ray: &Ray, at_a: &Enclosure, a: f64, b: f64) -> Enclosure {
        let piece = Interval::new(a, b);
        let mut whole = self.enclose(ray, piece);
        let run = Interval::new(0.0, (b - a).next_up());
        if whole.slope != Interval::ENTIRE {
            whole.height = whole.height.meet(at_a.height + whole.slope * run);
        }
        whole
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
        let mut here = self.enclose(ray, Interval::point(t));
        if here.solid() {
            return Some(Certified::Wall { t0: t, t1: t });
        }
        let mut width = end - start;
        let smallest = effort.bracket / 1024.0;
        let first = self.evaluations;
        while t < end {
            if self.evaluations - first > u64::from(effort.budget) {
                return Some(Certified::Undecided { t0: t, t1: t + width });
            }
            let to = (t + width).min(end);
            let piece = self.over(ray, &here, t, to);
            let advance = if piece.clear() {
                to - t
            } else if here.height.lo() > 0.0 && piece.slope.lo() < 0.0 {
                // h(t + s) ≥ h(t) + s·min h′ stays positive up to here.
                (here.height.lo() / -piece.slope.lo() * (1.0 - 1e-12)).min(to - t)
            } else {
                0.0
            };
            if advance > 0.25 * (to - t) || (advance > 0.0 && advance > smallest) {
                let next = (t + advance).max(t.next_up()).min(to);
                // Rounding of `next` may pass the proved distance by an ulp: prove the last ulps by themselves.
                if piece.clear() || next - t < advance.next_down() || self.over(ray, &here, t, next).clear() {
                    width = 2.0 * (next - t);
                    t = next;
                    here = self.enclose(ray, Interval::point(t));
                    continue;
                }
            }
            if width > smallest {
                width = (0.5 * width).min(0.5 * (to - t));
                continue;
            }
            return Some(self.end_at(ray, t, &here, effort));
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
