//! The supremum of a terrain's slope, enclosed: best-first branch and bound on the gradient over duals of intervals.
//! It never calls `bounds`, so it can judge them.

use crate::bounds::THRESHOLD;
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Evaluator, Program};
use crate::real::Real;
use glam::DVec2;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// An enclosure of sup ‖∇f‖ over the terrain {α ≥ T} inside a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeSupremum {
    /// The steepest point found.
    pub witness: DVec2,
    /// The slope there: the supremum is at least this, up to the rounding of one evaluation.
    pub at_least: f64,
    /// Certified: the supremum is at most this.
    pub at_most: f64,
    /// Boxes looked at.
    pub boxes: u64,
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

/// Encloses the supremum over the box with corners `lo` and `hi`, looking at most at `budget` boxes, or until the two
/// ends differ by less than the share `gap`. Deterministic.
pub fn slope_supremum(program: &Program, lo: DVec2, hi: DVec2, gap: f64, budget: u64) -> SlopeSupremum {
    let mut over = Evaluator::<Dual<Interval, 2>>::new(program);
    let mut at = Evaluator::<Dual<f64, 2>>::new(program);
    let mut bound = |x: [Interval; 2]| {
        let (f, a) = over.run(program, [Dual::variable(x[0], 0), Dual::variable(x[1], 1)]);
        if a.value.hi() < THRESHOLD { 0.0 } else { Interval::length(f.slope[0], f.slope[1]).hi() }
    };
    let root = [Interval::new(lo.x, hi.x), Interval::new(lo.y, hi.y)];
    let mut best = SlopeSupremum { witness: lo, at_least: 0.0, at_most: 0.0, boxes: 1 };
    let mut queue = BinaryHeap::from([Part { x: root, bound: bound(root) }]);
    while let Some(part) = queue.pop() {
        best.at_most = part.bound.max(best.at_least);
        if best.at_most <= best.at_least * (1.0 + gap) || best.boxes >= budget {
            return best;
        }
        let axis = usize::from(part.x[1].width() > part.x[0].width());
        let middle = part.x[axis].middle();
        for half in [Interval::new(part.x[axis].lo(), middle), Interval::new(middle, part.x[axis].hi())] {
            let mut x = part.x;
            x[axis] = half;
            best.boxes += 1;
            let centre = DVec2::new(x[0].middle(), x[1].middle());
            let sample = at.sample(program, centre);
            if sample.weight >= THRESHOLD && sample.gradient.length() > best.at_least {
                (best.witness, best.at_least) = (centre, sample.gradient.length());
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
}
