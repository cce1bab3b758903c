//! Looking for the blends that are steepest for what the printed bound allows: the geometry is climbed together with the
//! point, on exact gradients. No step uses a bound, so what is found can judge them.

use super::super::rays::Random;
use crate::experiment::ExperimentError;
use glam::{DVec2, DVec3};
use terrain_model::bounds::THRESHOLD;
use terrain_model::certify::{Objective, Upper, climb};
use terrain_model::dual::Dual;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill};
use terrain_model::interval::Interval;
use terrain_model::primitive::disc;
use terrain_model::program::{Evaluator, Program, Sample};
use terrain_model::tree::{Node, Tree};

/// A disc of constant elevation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre, metres.
    pub centre: DVec2,
    /// Metres.
    pub radius: f64,
    /// Weight at the centre.
    pub weight: f64,
    /// Metres.
    pub elevation: f64,
}

impl Disc {
    /// A disc on the x axis.
    pub fn at(x: f64, radius: f64, weight: f64, elevation: f64) -> Disc {
        Disc { centre: DVec2::new(x, 0.0), radius, weight, elevation }
    }
    /// λ_α = w·L/r.
    pub fn weight_slope(&self) -> f64 {
        self.weight * WYVILL_SLOPE / self.radius
    }
}

/// The node of a disc.
pub fn node(disc: &Disc) -> Node {
    let centre: DVec3 = disc.centre.extend(disc.elevation);
    disc::Disc { centre, radius: disc.radius, weight: disc.weight, noise: None }.into()
}

/// The blend of discs.
///
/// # Errors
/// When a disc has no radius: a bug.
pub fn blend(discs: &[Disc]) -> Result<Program, ExperimentError> {
    let mut tree = Tree::new();
    let operands = discs.iter().map(|disc| tree.push(node(disc))).collect();
    let root = tree.push(Node::Blend(operands));
    Program::compile(&tree, root).map_err(ExperimentError::failed)
}

/// The bound as printed for constant discs: max λ_α · sup |f_A − f_B|, no factor for the weights.
pub fn printed_bound(discs: &[Disc]) -> f64 {
    let steepest = discs.iter().map(Disc::weight_slope).fold(0.0, f64::max);
    let elevations = discs.iter().map(|disc| disc.elevation);
    let (low, high) = elevations.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(e), h.max(e)));
    steepest * (high - low)
}

/// Elevation, weight and gradients by duals.
pub fn sample(program: &Program, p: DVec2) -> Sample {
    Evaluator::<Dual<f64, 2>>::new(program).sample(program, p)
}

/// Nothing is known from above: what follows is climbed, not certified.
const UNKNOWN: Upper = Upper { bound: f64::INFINITY, axis: 0 };

/// A function to climb, −∞ where it is not asked about.
pub struct Hill<F>(pub F);

impl<const N: usize, F: Fn([f64; N]) -> f64 + Sync> Objective<N> for Hill<F> {
    fn upper(&self, _: &[Interval; N], _: f64) -> Upper {
        UNKNOWN
    }
    fn at(&self, x: [f64; N]) -> f64 {
        (self.0)(x)
    }
}

/// A blend that exceeds what is printed, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Steepest {
    /// The discs.
    pub discs: [Disc; 2],
    /// The point.
    pub at: DVec2,
    /// ‖∇f‖ there.
    pub slope: f64,
    /// What the paper prints for these discs.
    pub printed: f64,
}

impl Steepest {
    /// Slope over printed bound: above 1 the bound is refuted.
    pub fn ratio(&self) -> f64 {
        self.slope / self.printed
    }
    /// α at the point.
    pub fn weight(&self) -> f64 {
        blend(&self.discs).map_or(f64::NAN, |program| sample(&program, self.at).weight)
    }
    fn of(discs: [Disc; 2], at: DVec2) -> Steepest {
        let found = blend(&discs).map(|program| sample(&program, at)).ok().filter(|found| found.weight >= THRESHOLD);
        let slope = found.map_or(f64::NEG_INFINITY, |found| found.gradient.length());
        Steepest { discs, at, slope, printed: printed_bound(&discs) }
    }
}

/// Unit discs of weight 1 with elevations 0 and 1, `half` to either side of the origin.
pub fn equal_pair(half: f64) -> [Disc; 2] {
    [Disc::at(-half, 1.0, 1.0, 0.0), Disc::at(half, 1.0, 1.0, 1.0)]
}

/// The largest separation in [0, `most`] at which the discs that `place` gives still make terrain at `p`: the steepest points lie
/// on the border of the terrain, and a climb along a border is best done on it. 0 when there is none.
fn terrain_until(most: f64, p: DVec2, place: impl Fn(f64) -> [Disc; 2]) -> f64 {
    let weight = |apart: f64| {
        let of = |disc: &Disc| disc.weight * wyvill(p.distance_squared(disc.centre) / (disc.radius * disc.radius));
        place(apart).iter().map(of).sum::<f64>()
    };
    let (mut near, mut far) = (0.0, most);
    if weight(far) >= THRESHOLD {
        return far;
    }
    for _ in 0..50 {
        let middle = 0.5 * (near + far);
        // A hair inside, so that the program's own sum, rounded otherwise, agrees.
        if weight(middle) >= THRESHOLD * (1.0 + 1e-12) { near = middle } else { far = middle }
    }
    near
}

/// The separation and point of the steepest pair of equal discs on the terrain.
pub fn steepest_equal_pair(seed: u32, starts: u32) -> Steepest {
    let side = Interval::new(-1.0, 1.0);
    let pair = |[x, y]: [f64; 2]| {
        let at = DVec2::new(x, y);
        Steepest::of(equal_pair(terrain_until(1.0, at, equal_pair)), at)
    };
    let (best, _) = climb(&Hill(|x| pair(x).ratio()), [side, side], seed, starts);
    pair(best)
}

/// The least weight that the search over pairs may give a disc: the ratio has no maximum, it nears 1/T as a weight fades.
pub const LEAST_WEIGHT: f64 = 0.02;

/// The steepest pair of any two discs, for what is printed: radii 1 and up to 30, weights from [`LEAST_WEIGHT`] to 1.
pub fn steepest_pair(seed: u32, starts: u32) -> Steepest {
    let side = Interval::new(-1.0, 1.0);
    let weight = Interval::new(LEAST_WEIGHT, 1.0);
    let root = [Interval::new(1.0, 30.0), weight, weight, side, side];
    let pair = |[radius, first, second, x, y]: [f64; 5]| {
        let at = DVec2::new(x, y);
        let discs = |apart: f64| [Disc::at(-apart, radius, first, 0.0), Disc::at(0.0, 1.0, second, 1.0)];
        Steepest::of(discs(terrain_until(30.0, at, discs)), at)
    };
    let (best, _) = climb(&Hill(|x| pair(x).ratio()), root, seed, starts);
    pair(best)
}

/// Points of each round of [`steepest_point`], rounds, and how much of the box is kept about the best point.
const POINTS: u32 = 150;
const ROUNDS: u32 = 9;
const KEPT: f64 = 0.4;

/// The steepest point found on the terrain of a program in a box, if it meets the terrain: random points in ever smaller boxes
/// about the best one. Unlike a climb it costs the same however the border of the terrain runs.
pub fn steepest_point(program: &Program, lo: DVec2, hi: DVec2, random: &mut Random) -> Option<(DVec2, f64)> {
    let mut evaluator = Evaluator::<Dual<f64, 2>>::new(program);
    let mut best: Option<(DVec2, f64)> = None;
    let (mut centre, mut half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    for _ in 0..ROUNDS {
        for _ in 0..POINTS {
            let t = DVec2::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0));
            let p = (centre + half * t).clamp(lo, hi);
            let found = evaluator.sample(program, p);
            let slope = found.gradient.length();
            if found.weight >= THRESHOLD && best.is_none_or(|(_, steepest)| slope > steepest) {
                best = Some((p, slope));
            }
        }
        centre = best?.0;
        half *= KEPT;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_finds_the_known_worst_pair_of_equal_discs() {
        let found = steepest_equal_pair(1, 6);
        // 12·2^(−4/3)·√(1 − 2^(−2/3)), claims G1.
        let known = 12.0 * libm::pow(2.0, -4.0 / 3.0) * (1.0 - libm::pow(2.0, -2.0 / 3.0)).sqrt();
        assert!((found.slope / known - 1.0).abs() < 1e-6, "{found:?} {known}");
        assert!((found.discs[1].centre.x - 0.608_309).abs() < 1e-4 && found.weight() >= THRESHOLD);
        assert!(found.ratio() > 1.66);
    }

    #[test]
    fn no_pair_exceeds_the_printed_bound_by_more_than_one_over_the_threshold() {
        let found = steepest_pair(2, 12);
        assert!(found.ratio() > 1.75 && found.ratio() < 1.0 / THRESHOLD, "{found:?} {}", found.ratio());
    }

    #[test]
    fn points_off_the_terrain_are_not_asked_about() {
        let program = blend(&equal_pair(0.5)).unwrap();
        let steepest = |from: DVec2, to: DVec2| steepest_point(&program, from, to, &mut Random(1));
        // Near the corner of the lens the slope is 87, but the weight is next to nothing.
        let corner = DVec2::new(0.0, 0.75f64.sqrt() - 0.01);
        assert!(sample(&program, corner).gradient.length() > 80.0);
        assert_eq!(steepest(corner - 1e-3, corner + 1e-3), None);
        // Where ±0.5 is terrain it is steepest on the border, off the middle: 2.38 by branch and bound.
        let (at, slope) = steepest(DVec2::splat(-1.0), DVec2::splat(1.0)).unwrap();
        assert!(slope > 2.37 && slope < 2.41 && sample(&program, at).weight >= THRESHOLD, "{at} {slope}");
    }
}
