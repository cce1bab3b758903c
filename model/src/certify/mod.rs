//! Branch and bound over intervals: turns an enclosure into a proof that a function stays below a number on a box.
//! Deterministic, budgeted, the same on any number of threads.

pub mod cover;
pub mod noise;
pub mod slope;
pub mod tree;

use crate::dual::Dual;
use crate::interval::Interval;
use crate::real::Real;
use rayon::prelude::*;

/// What a search found out about "the function is at most the target on the whole box".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict<const N: usize> {
    /// It holds: the largest enclosure of any part of the box ends at `bound`.
    Proved {
        /// At most the target.
        bound: f64,
        /// Parts looked at.
        boxes: u64,
    },
    /// It fails at a point.
    Refuted {
        /// The point.
        witness: [f64; N],
        /// The function there, above the target.
        value: f64,
    },
    /// The budget ended, or a part became too small to split.
    Undecided {
        /// A part that was left.
        open: [Interval; N],
        /// A bound on it, above the target; where a direction patch has several vertices, of the first that failed.
        bound: f64,
        /// Parts looked at.
        boxes: u64,
    },
}

/// The answer about one part of the box.
#[derive(Clone, Copy, Debug)]
pub struct Upper {
    /// No value on the part exceeds this, if it is at most the target.
    pub bound: f64,
    /// The axis to split when the bound is not good enough.
    pub axis: usize,
}

/// A function to be bounded from above on boxes of `N` dimensions.
pub trait Objective<const N: usize>: Sync {
    /// An upper bound on a part; effort may stop as soon as it is at most `target`.
    fn upper(&self, part: &[Interval; N], target: f64) -> Upper;
    /// A value that the function certainly reaches near `x`, or −∞ where `x` is not asked about.
    fn at(&self, x: [f64; N]) -> f64;
    /// True for a part that lies outside the question altogether, by symmetry for instance.
    fn outside(&self, _part: &[Interval; N]) -> bool {
        false
    }
}

/// Narrowest side that is still split.
const NARROWEST: f64 = 1e-9;
/// Parts that a root is cut into beforehand, so that threads share them; fixed, so that counts do not depend on threads.
const PIECES: usize = 256;
/// Climbs that try to refute before a proof is attempted.
const SCOUTS: u32 = 16;

/// Is the function at most `target` on `root`? `budget` is the most parts looked at in one of 256 pieces of the root.
pub fn prove_below<const N: usize>(
    objective: &impl Objective<N>,
    root: [Interval; N],
    target: f64,
    budget: u64,
) -> Verdict<N> {
    // A false target is best refuted at a summit: a depth-first search meets the level set first and gets stuck there.
    let (witness, value) = climb(objective, root, 1, SCOUTS);
    if value > target {
        return Verdict::Refuted { witness, value };
    }
    let verdicts: Vec<Verdict<N>> = pieces(root)
        .par_iter()
        .map(|piece| {
            let mut search = Search { objective, target, budget, boxes: 0, worst: f64::NEG_INFINITY };
            search.run(*piece, &mut |_| {})
        })
        .collect();
    join(verdicts)
}

fn join<const N: usize>(verdicts: Vec<Verdict<N>>) -> Verdict<N> {
    let (mut worst, mut total) = (f64::NEG_INFINITY, 0);
    let mut left = None;
    for verdict in verdicts {
        match verdict {
            Verdict::Proved { bound, boxes } => {
                worst = worst.max(bound);
                total += boxes;
            }
            Verdict::Refuted { .. } => return verdict,
            Verdict::Undecided { open, bound, boxes } => {
                total += boxes;
                left = left.or(Some((open, bound)));
            }
        }
    }
    match left {
        Some((open, bound)) => Verdict::Undecided { open, bound, boxes: total },
        None => Verdict::Proved { bound: worst, boxes: total },
    }
}

/// The root cut into equal pieces, always across the widest side.
pub(crate) fn pieces<const N: usize>(root: [Interval; N]) -> Vec<[Interval; N]> {
    let mut parts = vec![root];
    while parts.len() < PIECES {
        parts = parts
            .into_iter()
            .flat_map(|part| {
                let widest = (0..N).fold(0, |a, k| if part[k].width() > part[a].width() { k } else { a });
                halves(part, widest)
            })
            .collect();
    }
    parts
}

/// The two halves of a part across an axis.
pub(crate) fn halves<const N: usize>(part: [Interval; N], axis: usize) -> [[Interval; N]; 2] {
    let (side, middle) = (part[axis], part[axis].middle());
    let (mut low, mut high) = (part, part);
    low[axis] = Interval::new(side.lo(), middle);
    high[axis] = Interval::new(middle, side.hi());
    [low, high]
}

/// The best point found from `starts` random starts, each improved by a shrinking pattern of steps along the axes and
/// diagonals: a lower bound to set beside a certificate.
pub fn climb<const N: usize>(
    objective: &impl Objective<N>,
    root: [Interval; N],
    seed: u32,
    starts: u32,
) -> ([f64; N], f64) {
    let (mut best, mut top) = (root.map(Interval::middle), f64::NEG_INFINITY);
    let mut state = seed;
    let mut random = || {
        state = crate::noise::mix(state, 0x51ed);
        f64::from(state) / f64::from(u32::MAX)
    };
    for _ in 0..starts {
        let mut x = root.map(|side| side.lo() + random() * (side.hi() - side.lo()));
        let mut value = objective.at(x);
        let mut step = 0.1;
        while step > 1e-9 {
            let mut improved = false;
            for _ in 0..4 * N {
                let mut y = x;
                let one = (random() * N as f64) as usize;
                for k in 0..N {
                    if random() < 0.5 || k == one {
                        let moved = y[k] + (2.0 * random() - 1.0) * step * (root[k].hi() - root[k].lo());
                        y[k] = moved.clamp(root[k].lo(), root[k].hi());
                    }
                }
                let next = objective.at(y);
                if next > value {
                    (x, value, improved) = (y, next, true);
                }
            }
            if !improved {
                step *= 0.6;
            }
        }
        if value > top {
            (best, top) = (x, value);
        }
    }
    (best, top)
}

pub(crate) struct Search<'a, O> {
    pub objective: &'a O,
    pub target: f64,
    pub budget: u64,
    pub boxes: u64,
    pub worst: f64,
}

impl<O> Search<'_, O> {
    /// Depth first; `record` hears of every part in order: `None` for one that is done, `Some(axis)` for a split.
    pub fn run<const N: usize>(&mut self, root: [Interval; N], record: &mut impl FnMut(Option<usize>)) -> Verdict<N>
    where
        O: Objective<N>,
    {
        let mut stack = vec![root];
        while let Some(part) = stack.pop() {
            if self.objective.outside(&part) {
                record(None);
                continue;
            }
            self.boxes += 1;
            let Upper { bound, axis } = self.objective.upper(&part, self.target);
            if bound <= self.target {
                self.worst = self.worst.max(bound);
                record(None);
                continue;
            }
            let witness = part.map(Interval::middle);
            let value = self.objective.at(witness);
            if value > self.target {
                return Verdict::Refuted { witness, value };
            }
            if self.boxes >= self.budget || part[axis].width() < NARROWEST {
                return Verdict::Undecided { open: part, bound, boxes: self.boxes };
            }
            record(Some(axis));
            let [low, high] = halves(part, axis);
            stack.push(high);
            stack.push(low);
        }
        Verdict::Proved { bound: self.worst, boxes: self.boxes }
    }
}

/// The largest upper bound over `variants` of a function on a box, or the first one above the target, and how much
/// each axis matters.
///
/// `prepare` does what the variants share; `evaluate` encloses the value and the slopes on the box prepared. Three
/// forms are tried in turn until one is at most the target: the natural one; the mean-value form about the middle; and
/// both on the face where the function is largest along each axis whose slope has one sign.
pub(crate) fn sharpen<const D: usize, S>(
    x: [Interval; D],
    variants: usize,
    target: f64,
    prepare: &impl Fn([Interval; D]) -> S,
    evaluate: &impl Fn(&S, usize) -> Dual<Interval, D>,
) -> (f64, [f64; D]) {
    let whole = prepare(x);
    let mut middle = None;
    let mut worst = f64::NEG_INFINITY;
    let mut effect = [0.0f64; D];
    for variant in 0..variants {
        let natural = evaluate(&whole, variant);
        let mut bound = natural.value.hi();
        if bound > target {
            let middle = middle.get_or_insert_with(|| prepare(x.map(|x| Interval::point(x.middle()))));
            bound = bound.min(about_middle(evaluate(middle, variant).value, x, natural.slope));
            for k in 0..D {
                effect[k] = effect[k].max(natural.slope[k].magnitude() * x[k].width());
            }
        }
        if bound > target {
            let mut face = x;
            for k in 0..D {
                if natural.slope[k].lo() >= 0.0 {
                    face[k] = Interval::point(x[k].hi());
                } else if natural.slope[k].hi() <= 0.0 {
                    face[k] = Interval::point(x[k].lo());
                }
            }
            if face != x {
                let narrow = evaluate(&prepare(face), variant);
                bound = bound.min(narrow.value.hi());
                if bound > target {
                    let middle = prepare(face.map(|x| Interval::point(x.middle())));
                    bound = bound.min(about_middle(evaluate(&middle, variant).value, face, narrow.slope));
                }
            }
        }
        worst = worst.max(bound);
        if bound > target {
            // The part will be split whatever the other variants say.
            break;
        }
    }
    (worst, effect)
}

fn about_middle<const D: usize>(value: Interval, x: [Interval; D], slope: [Interval; D]) -> f64 {
    let mut sum = value;
    for k in 0..D {
        if x[k].lo() < x[k].hi() {
            sum = sum + slope[k] * (x[k] - Interval::constant(x[k].middle()));
        }
    }
    sum.hi()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x(1 − x) + y(1 − y), at most 1/2 on the unit square.
    struct Hill;
    impl Objective<2> for Hill {
        fn upper(&self, part: &[Interval; 2], target: f64) -> Upper {
            let hill = |x: &[Interval; 2], _: usize| {
                let (x, y) = (Dual::<Interval, 2>::variable(x[0], 0), Dual::variable(x[1], 1));
                x * (Dual::one() - x) + y * (Dual::one() - y)
            };
            let (bound, effect) = sharpen(*part, 1, target, &|x| x, &hill);
            Upper { bound, axis: if effect[0] >= effect[1] { 0 } else { 1 } }
        }
        fn at(&self, [x, y]: [f64; 2]) -> f64 {
            x * (1.0 - x) + y * (1.0 - y)
        }
    }

    #[test]
    fn a_true_bound_is_proved_and_a_false_one_refuted() {
        let root = [Interval::UNIT; 2];
        let Verdict::Proved { bound, boxes } = prove_below(&Hill, root, 0.5001, 10_000) else { panic!("not proved") };
        assert!((0.5..=0.5001).contains(&bound) && boxes < 10_000);
        let Verdict::Refuted { witness, value } = prove_below(&Hill, root, 0.4999, 10_000) else {
            panic!("not refuted")
        };
        assert!(value > 0.4999 && Hill.at(witness) == value);
    }

    #[test]
    fn a_budget_too_small_leaves_it_undecided() {
        let root = [Interval::new(0.0, 1.0), Interval::new(0.0, 1.0)];
        assert!(matches!(prove_below(&Hill, root, 0.500_000_001, 1), Verdict::Undecided { .. }));
    }
}
