//! How far a triangle lies from the field it stands for, straight up or down, with proof: branch and bound over the
//! triangle of f minus the plane of its corners, by duals of intervals in the natural and the mean-value form.
//!
//! A point of the triangle is v₀ + s·(v₁ − v₀) + t·(v₂ − v₀); the search cuts the triangle of (s, t). Halves of halves
//! of 1 are exact, so the pieces cover the triangle without a gap, and the plane is z₀ + s·(z₁ − z₀) + t·(z₂ − z₀)
//! without a division: slivers are no special case. The field is that of the reals; corners carry what f64 made of it,
//! and that rounding is part of the distance.

use super::Mesh;
use crate::bounds::{Region, THRESHOLD};
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Evaluator, Program, Pruner};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BinaryHeap;

/// What is known of the vertical distance between a triangle and the terrain above or below it, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Nowhere on the terrain is the distance larger. `f64::INFINITY` where nothing could be proved.
    pub at_most: f64,
    /// The distance is at least this at `witness`; 0 where no point was tried.
    pub at_least: f64,
    /// A point of the triangle.
    pub witness: DVec2,
    /// The middle of the piece that `at_most` comes from: a corner put there brings it down.
    pub loosest: DVec2,
    /// Is every point of the triangle proved to lie on the terrain?
    pub inside: bool,
    /// Is every point of the triangle proved to lie off the terrain?
    pub outside: bool,
    /// Pieces looked at.
    pub pieces: u32,
}

impl Deviation {
    /// Is the distance proved to be at most `tolerance`?
    pub fn within(&self, tolerance: f64) -> bool {
        self.at_most <= tolerance
    }
}

/// A piece of a triangle: corners (s, t) and what bounds the distance there.
#[derive(Clone, Copy, Debug)]
struct Piece {
    corners: [[f64; 2]; 3],
    bound: f64,
    /// Is all of it proved to lie on the terrain?
    on: bool,
    /// Times it was halved: its corners are multiples of 2^−depth.
    depth: u32,
}

/// Up to here the corners of pieces are exact in f64.
const DEEPEST: u32 = 50;

impl PartialEq for Piece {
    fn eq(&self, other: &Piece) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Piece {}
impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Piece) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Piece {
    /// By bound, then by place, so that the order of the search is fixed.
    fn cmp(&self, other: &Piece) -> std::cmp::Ordering {
        let by_place = self.corners.as_flattened().iter().zip(other.corners.as_flattened());
        by_place.fold(self.bound.total_cmp(&other.bound), |order, (a, b)| order.then(a.total_cmp(b)))
    }
}

/// What one look at a piece tells.
struct Look {
    bound: f64,
    weight: Interval,
    /// A lower bound of the distance at the middle, when that is on the terrain.
    reached: f64,
    middle: [f64; 2],
}

/// A triangle by its parameters (s, t).
struct Chart {
    corner: [Interval; 2],
    edges: [[Interval; 2]; 2],
    elevation: Interval,
    rise: [Interval; 2],
}

impl Chart {
    fn new(corners: &[[f64; 3]; 3]) -> Chart {
        let [a, b, c] = corners.map(|corner| corner.map(Interval::point));
        let along = |axis: usize| [b[axis] - a[axis], c[axis] - a[axis]];
        let (x, y) = (along(0), along(1));
        Chart { corner: [a[0], a[1]], edges: [[x[0], y[0]], [x[1], y[1]]], elevation: a[2], rise: along(2) }
    }
    fn at(&self, [s, t]: [f64; 2]) -> [Interval; 2] {
        let (s, t) = (Interval::point(s), Interval::point(t));
        [0, 1].map(|axis| self.corner[axis] + s * self.edges[0][axis] + t * self.edges[1][axis])
    }
    fn plane(&self, [s, t]: [f64; 2]) -> Interval {
        self.elevation + Interval::point(s) * self.rise[0] + Interval::point(t) * self.rise[1]
    }
    fn variables(&self, x: [Interval; 2]) -> [Dual<Interval, 2>; 2] {
        [0, 1].map(|axis| Dual { value: x[axis], slope: [self.edges[0][axis], self.edges[1][axis]] })
    }
    fn place(&self, p: [f64; 2]) -> DVec2 {
        let [x, y] = self.at(p);
        DVec2::new(x.middle(), y.middle())
    }
}

/// Measures triangles against one program, reusing its stacks. It keeps the program pruned to the last box entered.
#[derive(Debug)]
pub struct Gauge<'a> {
    pruner: Pruner<'a>,
    here: Program,
    values: Evaluator<f64>,
    points: Evaluator<Interval>,
    enclosures: Evaluator<Dual<Interval, 2>>,
    /// The paper's second weight rules jump where an operand's support ends (claims, *Nesting*): nothing is proved.
    jumps: bool,
}

impl<'a> Gauge<'a> {
    /// A gauge of `program`.
    pub fn new(program: &'a Program) -> Gauge<'a> {
        Gauge {
            pruner: Pruner::new(program),
            here: program.clone(),
            values: Evaluator::new(program),
            points: Evaluator::new(program),
            enclosures: Evaluator::new(program),
            jumps: program.jumps(),
        }
    }
    /// Prunes to the box with corners `low` and `high`, metres: until the next call all points lie in it.
    pub fn enter(&mut self, low: DVec2, high: DVec2) {
        // Coordinates computed from the corners may step over the edge by some ulps: the box is a hair larger.
        let slack = DVec2::splat(1e-12) * (low.abs().max(high.abs()) + (high - low));
        self.here = self.pruner.prune(Region::rectangle(low - slack, high + slack));
    }
    /// Elevation (0 off the support) and weight at a point of the box.
    pub fn height(&mut self, p: DVec2) -> (f64, f64) {
        self.values.height(&self.here, p)
    }
    /// The vertex at a point of the box, and whether it lies on the terrain.
    pub fn vertex(&mut self, p: DVec2) -> ([f64; 3], bool) {
        let (elevation, weight) = self.height(p);
        ([p.x, p.y, elevation], weight >= THRESHOLD)
    }
    /// Encloses the weight over a box inside the one entered.
    pub fn weight(&mut self, low: DVec2, high: DVec2) -> Interval {
        self.points.run(&self.here, Region::rectangle(low, high).extent).1
    }
    /// Does one of a few points of the triangle lie further than `tolerance` from the field? Cheap, and not a proof of
    /// the contrary.
    pub fn exceeds(&mut self, corners: &[[f64; 3]; 3], tolerance: f64) -> bool {
        const POINTS: [[f64; 2]; 7] =
            [[0.34, 0.33], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5], [0.17, 0.17], [0.66, 0.17], [0.17, 0.66]];
        POINTS.iter().any(|&at| {
            let [x, y, z] = between(corners, at);
            let (elevation, weight) = self.height(DVec2::new(x, y));
            weight >= THRESHOLD && (elevation - z).abs() > tolerance
        })
    }

    /// Measures a triangle, cutting it until the distance is proved to be at most `tolerance`, a point exceeds it, or
    /// `budget` pieces were looked at. The triangle lies in the box entered; the way around does not matter.
    pub fn triangle(&mut self, corners: &[[f64; 3]; 3], tolerance: f64, budget: u32) -> Deviation {
        let chart = Chart::new(corners);
        let whole = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let mut found = Deviation {
            at_most: 0.0,
            at_least: 0.0,
            witness: chart.place([0.25, 0.25]),
            loosest: chart.place([0.25, 0.25]),
            inside: false,
            outside: false,
            pieces: 0,
        };
        if self.jumps {
            return Deviation { at_most: f64::INFINITY, ..found };
        }
        let mut open = BinaryHeap::new();
        let mut pending = vec![(whole, f64::INFINITY, 0)];
        let mut looks = 0;
        let mut some_off = false;
        loop {
            for (corners, above, depth) in pending.drain(..) {
                looks += 1;
                let look = self.look(&chart, corners);
                if look.weight.hi() < THRESHOLD {
                    some_off = true;
                    continue;
                }
                if look.reached > found.at_least {
                    found.at_least = look.reached;
                    found.witness = chart.place(look.middle);
                }
                // A piece is bounded by its whole as well.
                open.push(Piece { corners, bound: look.bound.min(above), on: look.weight.lo() >= THRESHOLD, depth });
            }
            let Some(worst) = open.peek() else { break };
            // Bounds shrink with the square of a piece at best, that is with its area: fewer pieces cannot do.
            let need = (worst.bound - found.at_least) / (tolerance - found.at_least);
            let spent = f64::from(looks) + need > f64::from(budget) || looks + 2 > budget || worst.depth >= DEEPEST;
            if worst.bound <= tolerance || found.at_least > tolerance || spent {
                found.at_most = worst.bound;
                found.loosest = chart.place(middle(worst.corners));
                break;
            }
            let Piece { corners, bound, depth, .. } = *worst;
            open.pop();
            let apex = opposite_longest(&corners.map(|corner| chart.place(corner)));
            pending.extend(halves(corners, apex).map(|half| (half, bound, depth + 1)));
        }
        found.outside = open.is_empty();
        found.inside = !some_off && open.iter().all(|piece| piece.on);
        found.pieces = looks;
        found
    }

    fn look(&mut self, chart: &Chart, corners: [[f64; 2]; 3]) -> Look {
        let middle = middle(corners);
        let at_middle = chart.at(middle);
        let x = corners.iter().fold(at_middle, |hull, &corner| {
            let p = chart.at(corner);
            [hull[0].hull(p[0]), hull[1].hull(p[1])]
        });
        let (f, a) = self.enclosures.run(&self.here, chart.variables(x));
        if a.value.hi() < THRESHOLD {
            return Look { bound: 0.0, weight: a.value, reached: 0.0, middle };
        }
        let (f0, a0) = self.points.run(&self.here, at_middle);
        let about = |value: Interval, slope: [Interval; 2]| {
            let ends = corners.map(|corner| {
                let along = |k: usize| slope[k] * (Interval::point(corner[k]) - Interval::point(middle[k]));
                value + (along(0) + along(1))
            });
            ends[0].hull(ends[1]).hull(ends[2])
        };
        let bounded = |slope: [Interval; 2]| slope.iter().all(|s| s.magnitude() < f64::INFINITY);
        let planes = corners.map(|corner| chart.plane(corner));
        let mut distance = f.value - planes[0].hull(planes[1]).hull(planes[2]);
        let mut weight = a.value;
        let e0 = f0 - chart.plane(middle);
        // Without weight at the middle there is no elevation to start from. A bounded slope enclosure is a Lipschitz
        // bound: see `trace::certified`.
        if a0.lo() > 0.0 && bounded(f.slope) {
            distance = distance.meet(about(e0, [0, 1].map(|k| f.slope[k] - chart.rise[k])));
        }
        if bounded(a.slope) {
            weight = weight.meet(about(a0, a.slope));
        }
        let reached = if a0.lo() >= THRESHOLD { e0.mignitude() } else { 0.0 };
        Look { bound: distance.magnitude(), weight, reached, middle }
    }
}

/// The point (s, t) of a triangle, rounded.
pub(super) fn between([a, b, c]: &[[f64; 3]; 3], [s, t]: [f64; 2]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] + s * (b[axis] - a[axis]) + t * (c[axis] - a[axis]))
}

/// A point of the triangle near its centroid.
fn middle(corners: [[f64; 2]; 3]) -> [f64; 2] {
    [0, 1].map(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0)
}

/// The number of the corner opposite the longest side.
fn opposite_longest(places: &[DVec2; 3]) -> usize {
    let side = |k: usize| places[(k + 1) % 3].distance_squared(places[(k + 2) % 3]);
    (1..3).fold(0, |best, k| if side(k) > side(best) { k } else { best })
}

/// The triangle cut from corner `k` to the middle of the opposite side, exactly.
fn halves(corners: [[f64; 2]; 3], k: usize) -> [[[f64; 2]; 3]; 2] {
    let (apex, a, b) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
    let between = [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]));
    [[apex, a, between], [apex, between, b]]
}

/// What is known of a whole mesh against the terrain it stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// On the terrain no triangle is further away than this, metres: over every triangle, proved or not.
    pub at_most: f64,
    /// The largest distance that some triangle reaches, metres.
    pub at_least: f64,
    /// Triangles that were not proved to be within the tolerance, in order.
    pub open: Vec<usize>,
}

impl Certificate {
    /// Is every triangle proved to be within the tolerance?
    pub fn holds(&self) -> bool {
        self.open.is_empty()
    }
}

/// Measures every triangle of a sound mesh against `program`, with `budget` pieces each. The result does not depend on
/// the number of threads.
pub fn certify(program: &Program, mesh: &Mesh, tolerance: f64, budget: u32) -> Certificate {
    let found: Vec<Deviation> = mesh
        .triangles
        .par_iter()
        .map_init(
            || Gauge::new(program),
            |gauge, triangle| {
                let corners = triangle.map(|index| mesh.positions[index as usize]);
                measure(gauge, &corners, tolerance, budget)
            },
        )
        .collect();
    let open = found.iter().enumerate().filter(|(_, one)| !one.within(tolerance)).map(|(k, _)| k).collect();
    let largest = |of: fn(&Deviation) -> f64| found.iter().map(of).fold(0.0, f64::max);
    Certificate { at_most: largest(|one| one.at_most), at_least: largest(|one| one.at_least), open }
}

/// [`Gauge::triangle`] after entering the triangle's own box.
pub(super) fn measure(gauge: &mut Gauge<'_>, corners: &[[f64; 3]; 3], tolerance: f64, budget: u32) -> Deviation {
    let [a, b, c] = corners.map(|corner| DVec2::new(corner[0], corner[1]));
    gauge.enter(a.min(b).min(c), a.max(b).max(c));
    gauge.triangle(corners, tolerance, budget)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::{disc, hills};
    use crate::operator::WeightRule;
    use crate::primitive::disc::Disc;
    use crate::tree::{Node, Tree};
    use glam::DVec3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_point_of_a_triangle_lies_further_than_what_is_proved(
            xy in prop::array::uniform6(0.0f64..60.0), z in prop::array::uniform3(0.0f64..30.0), budget in 1u32..60,
            points in prop::collection::vec((0.0f64..1.0, 0.0f64..1.0), 64),
        ) {
            let program = hills();
            let corners = [[xy[0], xy[1], z[0]], [xy[2], xy[3], z[1]], [xy[4], xy[5], z[2]]];
            let mut gauge = Gauge::new(&program);
            let found = measure(&mut gauge, &corners, 0.5, budget);
            prop_assert!(found.at_least <= found.at_most);
            let plane = |s: f64, t: f64| between(&corners, [s, t]);
            for (s, t) in points {
                let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                let [x, y, z] = plane(s, t);
                let (elevation, weight) = program.height(DVec2::new(x, y));
                let distance = (elevation - z).abs();
                prop_assert!(weight < THRESHOLD || distance <= found.at_most + 1e-9, "{distance} {found:?}");
                let here = weight >= THRESHOLD;
                let contradicted = if here { found.outside } else { found.inside };
                prop_assert!(!contradicted);
            }
        }
    }

    #[test]
    fn the_search_closes_in_on_the_largest_distance() {
        let program = hills();
        let mut gauge = Gauge::new(&program);
        gauge.enter(DVec2::ZERO, DVec2::splat(64.0));
        let corners = [[20.0, 20.0], [24.0, 20.0], [20.0, 24.0]].map(|p| gauge.vertex(DVec2::from_array(p)).0);
        let mut largest = 0.0f64;
        for (i, j) in (0..200).flat_map(|i| (0..200 - i).map(move |j| (i, j))) {
            let [x, y, z] = between(&corners, [f64::from(i) / 199.0, f64::from(j) / 199.0]);
            largest = largest.max((gauge.height(DVec2::new(x, y)).0 - z).abs());
        }
        let found = gauge.triangle(&corners, 1.05 * largest, 100_000);
        assert!(found.within(1.05 * largest) && found.inside, "{largest} {found:?}");
        let refuted = gauge.triangle(&corners, 0.9 * largest, 100_000);
        assert!(refuted.at_least > 0.9 * largest && refuted.at_least <= 1.001 * largest, "{largest} {refuted:?}");
    }

    #[test]
    fn off_the_terrain_nothing_is_measured() {
        let mut tree = Tree::new();
        let root = tree.push(disc((0.0, 0.0), 10.0, 5.0, None));
        let program = Program::compile(&tree, root).unwrap();
        let mut gauge = Gauge::new(&program);
        let far = measure(&mut gauge, &[[20.0, 0.0, 99.0], [21.0, 0.0, 99.0], [20.0, 1.0, 99.0]], 1.0, 10);
        assert!(far.outside && !far.inside && far.at_most == 0.0);
        let near = measure(&mut gauge, &[[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]], 1e-9, 10);
        assert!(near.inside && !near.outside && near.within(1e-9), "{near:?}");
    }

    #[test]
    fn nothing_is_claimed_of_the_printed_weight_rule() {
        let mut tree = Tree::new();
        let a = tree.push(disc((0.0, 0.0), 10.0, 5.0, None));
        let b = tree.push(Disc { centre: DVec3::ZERO, radius: 20.0, weight: 1.0, noise: None });
        let root = tree.push(Node::Replace { a, b, rule: WeightRule::CombinePaper });
        let program = Program::compile(&tree, root).unwrap();
        let corners = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]];
        assert_eq!(measure(&mut Gauge::new(&program), &corners, 1.0, 100).at_most, f64::INFINITY);
    }
}
