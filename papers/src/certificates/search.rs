//! Proofs by branch and bound: the objective that any formula over duals of intervals makes, and what a search has found.

use terrain_model::certify::{Objective, Upper, Verdict, prove_below};
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::interval::Interval;
use terrain_model::noise::NoiseJet;
use terrain_model::real::Real;

/// A number that formulas of certificates are written over: `f64` for a climb, intervals for a proof.
pub trait Number: Differentiable + NoiseJet {}
impl Number for f64 {}
impl Number for Interval {}

/// Whether a certificate runs on the formula it is about, or on its control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As stated.
    Stated,
    /// Perturbed: it must not be shown.
    Perturbed,
}

impl Form {
    /// One of two values.
    pub fn pick<T>(self, stated: T, perturbed: T) -> T {
        match self {
            Form::Stated => stated,
            Form::Perturbed => perturbed,
        }
    }
}

/// What a proof found.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// It holds.
    Proved {
        /// What was to be shown an upper bound.
        bound: f64,
        /// A value that is attained: the bound cannot be below it.
        attained: f64,
        /// Boxes looked at.
        boxes: u64,
    },
    /// It fails.
    Refuted {
        /// What was to be shown an upper bound.
        bound: f64,
        /// A value above it.
        value: f64,
        /// Where, in words.
        at: String,
    },
    /// The budget ended.
    Undecided {
        /// What was to be shown an upper bound.
        bound: f64,
        /// What is known instead.
        known: f64,
        /// Boxes looked at.
        boxes: u64,
    },
}

impl Finding {
    /// Does it hold?
    pub fn proved(&self) -> bool {
        matches!(self, Finding::Proved { .. })
    }
    /// In one line.
    pub fn line(&self) -> String {
        match self {
            Finding::Proved { bound, attained, boxes } => {
                format!("proved: at most {bound:.7}, {attained:.7} is attained; {boxes} boxes")
            }
            Finding::Refuted { bound, value, at } => format!("refuted: {value:.7} exceeds {bound:.7} at {at}"),
            Finding::Undecided { bound, known, boxes } => {
                format!("undecided: at most {known:.7} is known, {bound:.7} was asked for; {boxes} boxes")
            }
        }
    }
    /// Several as one: all must hold. Reported is the one with least room.
    pub fn all(findings: impl IntoIterator<Item = Finding>) -> Finding {
        let mut total = 0;
        let mut least: Option<(f64, f64, f64)> = None;
        for finding in findings {
            match finding {
                Finding::Proved { bound, attained, boxes } => {
                    total += boxes;
                    let room = (bound - attained) / bound.abs().max(f64::MIN_POSITIVE);
                    if least.is_none_or(|(room_before, ..)| room < room_before) {
                        least = Some((room, bound, attained));
                    }
                }
                other => return other,
            }
        }
        match least {
            Some((_, bound, attained)) => Finding::Proved { bound, attained, boxes: total },
            None => Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 },
        }
    }
}

/// Parts that one of the 256 pieces of a root may cost.
const BUDGET: u64 = 40_000;
/// Climbs that look for what is attained.
const STARTS: u32 = 24;

/// A function to be bounded, with the set it is asked about: {domain ≥ 0}.
pub trait Formula<const N: usize>: Sync {
    /// The value, and a number that is negative where the formula is not asked about.
    fn value<R: Number>(&self, x: [R; N]) -> (R, R);
}

/// A formula seen by the search: by its natural enclosure alone, since a slope inside already costs a dual.
struct Natural<'a, F>(&'a F);

impl<const N: usize, F: Formula<N>> Objective<N> for Natural<'_, F> {
    fn upper(&self, part: &[Interval; N], _: f64) -> Upper {
        let (value, domain) = self.0.value(*part);
        let bound = if domain.hi() < 0.0 { f64::NEG_INFINITY } else { value.hi() };
        // The axis whose halves are best, by the value at them; with many axes the widest.
        let axis = (0..N).fold(0, |best, k| if part[k].width() > part[best].width() { k } else { best });
        Upper { bound, axis }
    }
    fn at(&self, x: [f64; N]) -> f64 {
        let (value, domain) = self.0.value(x);
        if domain >= 0.0 { value } else { f64::NEG_INFINITY }
    }
}

/// A formula without slopes inside, which the mean-value form sharpens.
pub trait Smooth<const N: usize>: Sync {
    /// The value.
    fn value<R: Real>(&self, x: [R; N]) -> R;
}

struct MeanValue<'a, F>(&'a F);

impl<const N: usize, F: Smooth<N>> Objective<N> for MeanValue<'_, F> {
    fn upper(&self, part: &[Interval; N], _: f64) -> Upper {
        let mut x = [Dual::<Interval, N>::fixed(Interval::ZERO); N];
        for k in 0..N {
            x[k] = Dual::variable(part[k], k);
        }
        let natural = self.0.value(x);
        let mut form = self.0.value(part.map(|side| Interval::point(side.middle())));
        let mut axis = (0, f64::NEG_INFINITY);
        for k in 0..N {
            form = form + natural.slope[k] * (part[k] - Interval::point(part[k].middle()));
            let effect = natural.slope[k].magnitude() * part[k].width();
            if effect > axis.1 {
                axis = (k, effect);
            }
        }
        Upper { bound: natural.value.hi().min(form.hi()), axis: axis.0 }
    }
    fn at(&self, x: [f64; N]) -> f64 {
        self.0.value(x)
    }
}

fn decide<const N: usize>(objective: &impl Objective<N>, root: [(f64, f64); N], target: f64) -> Finding {
    let root = root.map(|(lo, hi)| Interval::new(lo, hi));
    let attained = || terrain_model::certify::climb(objective, root, 7, STARTS).1;
    match prove_below(objective, root, target, BUDGET) {
        Verdict::Proved { boxes, .. } => Finding::Proved { bound: target, attained: attained(), boxes },
        Verdict::Refuted { witness, value } => Finding::Refuted { bound: target, value, at: format!("{witness:.6?}") },
        Verdict::Undecided { bound, boxes, .. } => Finding::Undecided { bound: target, known: bound, boxes },
    }
}

/// Is the formula at most `target` on `root`, wherever it is asked about?
pub fn below<const N: usize>(formula: &impl Formula<N>, root: [(f64, f64); N], target: f64) -> Finding {
    decide(&Natural(formula), root, target)
}

/// The same for a smooth formula.
pub fn smooth_below<const N: usize>(formula: &impl Smooth<N>, root: [(f64, f64); N], target: f64) -> Finding {
    decide(&MeanValue(formula), root, target)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x(1 − x), asked about where x ≤ `until`.
    struct Hill {
        until: f64,
    }
    impl Formula<1> for Hill {
        fn value<R: Number>(&self, [x]: [R; 1]) -> (R, R) {
            (x * (R::one() - x), R::constant(self.until) - x)
        }
    }
    impl Smooth<1> for Hill {
        fn value<R: Real>(&self, [x]: [R; 1]) -> R {
            x * (R::one() - x)
        }
    }

    #[test]
    fn a_search_answers_in_three_ways_and_heeds_its_domain() {
        let whole = Hill { until: 2.0 };
        assert!(below(&whole, [(0.0, 1.0)], 0.2501).proved());
        assert!(smooth_below(&whole, [(0.0, 1.0)], 0.2501).proved());
        assert!(matches!(below(&whole, [(0.0, 1.0)], 0.2), Finding::Refuted { .. }));
        assert!(matches!(below(&whole, [(0.0, 1.0)], 0.25), Finding::Undecided { .. }));
        assert!(below(&Hill { until: 0.2 }, [(0.0, 1.0)], 0.2).proved());
    }
}
