//! The supremum of a terrain's slope, and of every other quantity that `bounds` answers for, enclosed: best-first branch and
//! bound over duals of intervals. It never calls `bounds`, so it can judge them.

use crate::bounds::THRESHOLD;
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Evaluator, Program};
use crate::real::Real;
use glam::DVec2;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// An enclosure of a supremum inside a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeSupremum {
    /// The best point found.
    pub witness: DVec2,
    /// The quantity there: the supremum is at least this, up to the rounding of one evaluation.
    pub at_least: f64,
    /// Certified: the supremum is at most this.
    pub at_most: f64,
    /// Boxes looked at.
    pub boxes: u64,
}

/// What is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// ‖∇f‖ on the terrain {α ≥ T}: λ_f.
    Slope,
    /// ‖∇α‖: λ_α.
    WeightSlope,
    /// α·‖∇f‖ on the support: μ.
    WeightedSlope,
    /// f on the support.
    Elevation,
    /// −f on the support.
    Depth,
    /// α.
    Weight,
}

impl Quantity {
    /// The least upper bound over what the box holds; `None` where it holds nothing of it.
    fn over(self, f: Dual<Interval, 2>, a: Dual<Interval, 2>) -> Option<f64> {
        let length = |d: Dual<Interval, 2>| Interval::length(d.slope[0], d.slope[1]);
        let least = if self == Quantity::Slope { THRESHOLD } else { f64::MIN_POSITIVE };
        (a.value.hi() >= least).then(|| match self {
            Quantity::Slope => length(f).hi(),
            Quantity::WeightSlope => length(a).hi(),
            Quantity::WeightedSlope => (Interval::new(a.value.lo().max(0.0), a.value.hi()) * length(f)).hi(),
            Quantity::Elevation => f.value.hi(),
            Quantity::Depth => -f.value.lo(),
            Quantity::Weight => a.value.hi(),
        })
    }
    fn at(self, f: Dual<f64, 2>, a: Dual<f64, 2>) -> Option<f64> {
        let length = |d: Dual<f64, 2>| DVec2::from_array(d.slope).length();
        let least = if self == Quantity::Slope { THRESHOLD } else { f64::MIN_POSITIVE };
        (a.value >= least).then(|| match self {
            Quantity::Slope => length(f),
            Quantity::WeightSlope => length(a),
            Quantity::WeightedSlope => a.value * length(f),
            Quantity::Elevation => f.value,
            Quantity::Depth => -f.value,
            Quantity::Weight => a.value,
        })
    }
}

struct Part {
    x: [Interval; 2],
    bound: f64,
}

impl PartialEq for Part {
    fn eq(&self, o: &Part) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}
impl Eq for Part {}
impl PartialOrd for Part {
    fn partial_cmp(&self, o: &Part) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Part {
    fn cmp(&self, o: &Part) -> Ordering {
        self.bound
            .total_cmp(&o.bound)
            .then(o.x[0].lo().total_cmp(&self.x[0].lo()))
            .then(o.x[1].lo().total_cmp(&self.x[1].lo()))
    }
}

/// [`supremum`] of the slope; `gap` is a share of it.
pub fn slope_supremum(program: &Program, lo: DVec2, hi: DVec2, gap: f64, budget: u64) -> SlopeSupremum {
    let found = supremum(program, Quantity::Slope, lo, hi, gap, budget);
    // A box without terrain has no slope.
    SlopeSupremum { at_least: found.at_least.max(0.0), at_most: found.at_most.max(0.0), ..found }
}

/// Encloses the supremum of a quantity over the box with corners `lo` and `hi`, looking at most at `budget` boxes, or until
/// the two ends differ by less than `gap` of their size. −∞ where the box holds nothing of it. Deterministic.
pub fn supremum(program: &Program, of: Quantity, lo: DVec2, hi: DVec2, gap: f64, budget: u64) -> SlopeSupremum {
    let mut over = Evaluator::<Dual<Interval, 2>>::new(program);
    let mut at = Evaluator::<Dual<f64, 2>>::new(program);
    let nothing = f64::NEG_INFINITY;
    let mut bound = |x: [Interval; 2]| {
        let (f, a) = over.run(program, [Dual::variable(x[0], 0), Dual::variable(x[1], 1)]);
        of.over(f, a).unwrap_or(nothing)
    };
    let mut look = |p: DVec2| {
        let (f, a) = at.run(program, [Dual::variable(p.x, 0), Dual::variable(p.y, 1)]);
        of.at(f, a).unwrap_or(nothing)
    };
    let root = [Interval::new(lo.x, hi.x), Interval::new(lo.y, hi.y)];
    let (witness, at_least) = scout(lo, hi, &mut look);
    let mut best = SlopeSupremum { witness, at_least, at_most: at_least, boxes: 1 };
    let mut queue = BinaryHeap::from([Part { x: root, bound: bound(root) }]);
    while let Some(part) = queue.pop() {
        best.at_most = part.bound.max(best.at_least);
        // Nothing has been found yet where at_least is −∞.
        let close = best.at_least.is_finite() && best.at_most - best.at_least <= gap * best.at_least.abs();
        if close || best.boxes >= budget {
            return best;
        }
        let axis = usize::from(part.x[1].width() > part.x[0].width());
        let middle = part.x[axis].middle();
        for half in [Interval::new(part.x[axis].lo(), middle), Interval::new(middle, part.x[axis].hi())] {
            let mut x = part.x;
            x[axis] = half;
            best.boxes += 1;
            let centre = DVec2::new(x[0].middle(), x[1].middle());
            let value = look(centre);
            if value > best.at_least {
                (best.witness, best.at_least) = (centre, value);
            }
            let upper = bound(x).min(part.bound);
            if upper > best.at_least {
                queue.push(Part { x, bound: upper });
            }
        }
    }
    best.at_most = best.at_least;
    best
}

/// Points a side of the grid that is looked at before anything is proved.
const SCOUTS: u32 = 48;

/// A good point to begin with: the best of a grid, improved by shrinking steps. Where no certificate is found, branch and
/// bound looks at the places that it cannot bound, not at the best ones.
fn scout(lo: DVec2, hi: DVec2, look: &mut impl FnMut(DVec2) -> f64) -> (DVec2, f64) {
    let mut best = (lo, f64::NEG_INFINITY);
    let mut try_at = |best: &mut (DVec2, f64), p: DVec2| {
        let value = look(p);
        let better = value > best.1;
        if better {
            *best = (p, value);
        }
        better
    };
    let cell = (hi - lo) / f64::from(SCOUTS);
    for k in 0..SCOUTS * SCOUTS {
        let index = DVec2::new(f64::from(k % SCOUTS), f64::from(k / SCOUTS));
        try_at(&mut best, lo + cell * (index + 0.5));
    }
    let mut step = 0.5 * cell;
    for _ in 0..60 {
        let from = best.0;
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];
        let improved = around.into_iter().fold(false, |improved, (i, j)| {
            let p = (from + step * DVec2::new(f64::from(i), f64::from(j))).clamp(lo, hi);
            try_at(&mut best, p) || improved
        });
        if !improved {
            step *= 0.5;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::disc::Disc;
    use crate::tree::{Node, Tree};
    use glam::DVec3;

    /// The two discs of claims G1: the slope of their blend is 2.89689 where the printed bound says 1.71730.
    #[test]
    fn the_supremum_of_two_blended_discs_is_the_known_one() {
        let mut tree = Tree::new();
        let mut disc =
            |x: f64, z: f64| tree.push(Disc { centre: DVec3::new(x, 0.0, z), radius: 1.0, weight: 1.0, noise: None });
        let operands = vec![disc(-0.608_309, 0.0), disc(0.608_309, 1.0)];
        let root = tree.push(Node::Blend(operands));
        let program = Program::compile(&tree, root).unwrap();
        let supremum = slope_supremum(&program, DVec2::splat(-2.0), DVec2::splat(2.0), 0.01, 200_000);
        assert!((supremum.at_least - 2.896_89).abs() < 0.02, "{supremum:?}");
        assert!(supremum.at_most < 2.95, "{supremum:?}");
    }

    /// A disc of weight 1 and radius r: sup α = 1, sup ‖∇α‖ = WYVILL_SLOPE/r; f is constant.
    #[test]
    fn every_quantity_of_a_disc_is_the_known_one() {
        let mut tree = Tree::new();
        let root = tree.push(Disc { centre: DVec3::new(0.0, 0.0, 7.0), radius: 2.0, weight: 1.0, noise: None });
        let program = Program::compile(&tree, root).unwrap();
        let (lo, hi) = (DVec2::splat(-2.1), DVec2::splat(2.0));
        let expected = [
            (Quantity::Slope, 0.0),
            (Quantity::WeightSlope, crate::falloff::WYVILL_SLOPE / 2.0),
            (Quantity::WeightedSlope, 0.0),
            (Quantity::Elevation, 7.0),
            (Quantity::Depth, -7.0),
            (Quantity::Weight, 1.0),
        ];
        for (quantity, known) in expected {
            let found = supremum(&program, quantity, lo, hi, 1e-2, 100_000);
            let slack = 1.1e-2 * known.abs() + 1e-12;
            assert!(found.at_least <= known + 1e-12 && found.at_least >= known - slack, "{quantity:?} {found:?}");
            assert!(found.at_most >= known - 1e-12 && found.at_most <= known + slack, "{quantity:?} {found:?}");
        }
        // Off the support there is nothing.
        let off = supremum(&program, Quantity::Elevation, DVec2::splat(5.0), DVec2::splat(6.0), 1e-3, 100);
        assert_eq!(off.at_most, f64::NEG_INFINITY);
    }
}
