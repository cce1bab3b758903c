//! Level-of-detail operator (Génevaux 2015 §6): operand A where κ ≤ k_A, operand B where κ ≥ k_B, and a passage between.
//!
//! The printed passage (1−t)·f_A + t·f_B uses f_A where A has no weight and f_A means nothing, and its t is only
//! Lipschitz (claims G9). Here the passage is the blend with the weights (1−t)·α_A and t·α_B, which is the same where
//! α_A = α_B, with t C¹.

use super::{BlendRule, Combine, Fate, Part, Pruned, blend, both_needed, clean, hull};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::detail::{self, FocusSlot};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::program::{Layout, TileLayout};
use crate::real::Operand;
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// How the operator passes from A to B.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Passage {
    /// A blend with weights (1−t)·α_A and t·α_B, t = 3s² − 2s³.
    #[default]
    Blend,
    /// As printed: (1−t)·f_A + t·f_B with t = s; without a slope bound where a weight may vanish.
    Paper,
}

/// Thresholds of the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lod {
    /// k_A: up to it the first operand alone.
    pub from: f64,
    /// k_B: from it on the second alone.
    pub to: f64,
    /// What happens between.
    pub passage: Passage,
}

impl Lod {
    pub(crate) fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        if !(0.0 <= self.from && self.from < self.to && self.to <= 1.0) {
            return Err("a level-of-detail operator needs 0 ≤ from < to ≤ 1".to_owned());
        }
        let span = self.to - self.from;
        // (k_B − k_A) times its inverse must not stop short of 1, or B would never be alone at k_B.
        let inverse = 1.0 / span;
        let inverse = if span * inverse < 1.0 { inverse.next_up() } else { inverse };
        let at = out.store([self.from, inverse].into_iter().chain(detail::parameters(None)));
        Ok(Code { at, passage: self.passage })
    }
}

/// Parameters before those of the focus: k_A, 1/(k_B − k_A).
const FOCUS: usize = 2;

/// A compiled operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    at: u32,
    passage: Passage,
}

impl Combine for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, self.passage as u32]);
    }
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    #[inline(always)]
    fn operands(&self) -> usize {
        2
    }
    #[inline(always)]
    fn combine<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2], parts: &[Operand<R>]) -> Operand<R> {
        let (a, b) = (parts[0], parts[1]);
        let s = ((detail::kappa::<R, P>(p.from(FOCUS), x) - p.get(0)) * p.get(1)).clamp01();
        let t = if self.passage == Passage::Blend { detail::smooth(s) } else { s };
        let keep = R::one() - t;
        let scaled = |part: Operand<R>, by: R| Operand {
            elevation: part.elevation,
            weight: by * part.weight,
            product: if R::ENCLOSES { by * part.product } else { R::zero() },
        };
        let mean = R::weighted_mean(&[scaled(a, keep), scaled(b, t)], 0.0);
        let between = match self.passage {
            Passage::Blend => mean.elevation,
            Passage::Paper => keep * a.elevation + t * b.elevation,
        };
        // An operand that is alone passes through bit for bit: pruning drops the other.
        let elevation = R::select(R::zero().less(t), R::select(t.less(R::one()), between, b.elevation), a.elevation);
        Operand { elevation, ..mean }
    }
    fn bounds(&self, p: Parameters<f64>, _: BlendRule, region: &Region, parts: &[Bounds]) -> Bounds {
        let (kappa, kappa_slope) = detail::kappa_bounds(p.from(FOCUS), region);
        lod_bounds(self.passage, share(p, kappa), times_up(kappa_slope, p.0[1]), parts[0], parts[1])
    }
    fn prune(&self, p: Parameters<f64>, region: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Code> {
        let s = share(p, detail::kappa_bounds(p.from(FOCUS), region).0);
        if s.hi() <= 0.0 || (parts[0].absent && parts[1].absent) {
            fates[1] = Fate::Drop;
            return Pruned { code: None, result: parts[0] };
        }
        if s.lo() >= 1.0 {
            fates[0] = Fate::Drop;
            return Pruned { code: None, result: parts[1] };
        }
        both_needed(parts, fates);
        let t = Interval::new(0.0, 1.0);
        let weight = t * parts[0].weight + t * parts[1].weight;
        Pruned { code: Some(*self), result: Part { absent: false, weight } }
    }
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
        hull(parts[0], parts[1])
    }
    fn focus(&self) -> Option<FocusSlot> {
        Some(FocusSlot { offset: FOCUS, count: FOCUS + detail::WIDTH })
    }
    fn stored_at(self, at: u32) -> Code {
        Code { at, ..self }
    }
    fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let focus = detail::rebased(&p.0[FOCUS..], origin);
        Code { at: tile.store(p.0[..FOCUS].iter().copied().chain(focus)), ..*self }
    }
}

/// Range of s = (κ − k_A)/(k_B − k_A), clamped: the two operations of `f64`, which keep order.
fn share(p: Parameters<f64>, kappa: Interval) -> Interval {
    let at = |kappa: f64| ((kappa - p.0[0]) * p.0[1]).clamp(0.0, 1.0);
    Interval::new(at(kappa.lo()), at(kappa.hi()))
}

/// Bounds over a region on which s has range `s` and slope `s_slope`.
///
/// Passage by blend: operands with the weights (1−t)·α_A and t·α_B, whose slopes are at most (1−t)·λ_α + λ_t·α; the rest
/// is the rule of blends. As printed: f − f_A = t·(f_B − f_A), hence λ ≤ max(λ_A, λ_B) + M·λ_s (claims G8, where the
/// term of λ_κ was forgotten), if both have weight everywhere.
fn lod_bounds(passage: Passage, s: Interval, s_slope: f64, a: Bounds, b: Bounds) -> Bounds {
    if s.hi() <= 0.0 || (a.is_absent() && b.is_absent()) {
        return a;
    }
    if s.lo() >= 1.0 {
        return b;
    }
    let (t, t_slope) = match passage {
        Passage::Blend => (detail::smooth_range(s), times_up(s_slope, detail::smooth_slope(s))),
        Passage::Paper => (s, s_slope),
    };
    let keep = Interval::new((1.0 - t.hi()).next_down().max(0.0), (1.0 - t.lo()).next_up().min(1.0));
    let scaled = |part: Bounds, by: Interval| {
        clean(Bounds {
            weight: by * part.weight,
            weight_slope: plus_up(times_up(part.weight_slope, by.hi()), times_up(t_slope, part.weight.hi())),
            weighted_slope: times_up(part.weighted_slope, by.hi()),
            ..part
        })
    };
    let blended = blend::blend_bounds(BlendRule::Corrected, &[scaled(a, keep), scaled(b, t)]);
    if passage == Passage::Blend {
        return blended;
    }
    let defined = a.weight.lo() > 0.0 && b.weight.lo() > 0.0;
    let crossing = times_up(t_slope, Bounds::spread(a.elevation, b.elevation));
    let slope = if defined { plus_up(a.support_slope.max(b.support_slope), crossing) } else { f64::INFINITY };
    let elevation = a.elevation.hull(b.elevation).hull(if defined { a.elevation } else { Interval::ZERO });
    let weighted_slope = times_up(blended.weight.hi(), slope);
    Bounds { elevation, slope, support_slope: slope, weighted_slope, ..blended }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detail::Focus;
    use crate::noise::{Combination, Octaves};
    use crate::primitive::disc::{Disc, DiscNoise};
    use crate::program::Program;
    use crate::tree::{Node, Tree};
    use glam::DVec3;

    fn disc(octaves: u32) -> Disc {
        let octaves = Octaves { octaves, frequency: 0.004, lacunarity: 2.0, gain: 0.5, amplitude: 40.0 };
        let noise = DiscNoise { combination: Combination::Sum, octaves, seed: 5 };
        Disc { centre: DVec3::ZERO, radius: 4000.0, weight: 1.0, noise: Some(noise) }
    }
    fn program(passage: Passage) -> Program {
        let mut tree = Tree::new();
        let (a, b) = (tree.push(disc(1)), tree.push(disc(6)));
        let lod = Lod { from: 0.3, to: 0.6, passage };
        let root = tree.push(Node::Lod { a, b, lod });
        let focus = Focus { position: DVec2::new(-500.0, 100.0), near: 100.0, far: 1500.0 };
        Program::compile(&tree, root).expect("it compiles").with_focus(Some(&focus))
    }

    #[test]
    fn near_the_focus_the_second_operand_stands_and_far_the_first_and_pruning_keeps_one() {
        let program = program(Passage::Blend);
        let mut tree = Tree::new();
        let (a, b) = (tree.push(disc(1)), tree.push(disc(6)));
        let [coarse, fine] = [a, b].map(|id| Program::compile(&tree, id).expect("it compiles"));
        for (at, alone, octaves) in [(DVec2::new(1500.0, 0.0), &coarse, 1), (DVec2::new(-480.0, 80.0), &fine, 6)] {
            let region = Region::rectangle(at, at + DVec2::splat(50.0));
            let pruned = program.prune(region);
            assert_eq!((pruned.code().len(), pruned.octaves()), (1, octaves));
            assert_eq!(program.height(at), alone.height(at));
            assert_eq!(pruned.height(at), alone.height(at));
            assert_eq!(program.bounds(region), alone.bounds(region));
        }
        // Fewer octaves, smaller slope bound.
        let far = Region::rectangle(DVec2::new(1500.0, 0.0), DVec2::new(1700.0, 200.0));
        assert!(program.bounds(far).slope < 0.5 * fine.bounds(far).slope);
        // Without a focus the finest stands everywhere.
        assert_eq!(program.with_focus(None).height(DVec2::new(1500.0, 0.0)), fine.height(DVec2::new(1500.0, 0.0)));
    }

    #[test]
    fn the_printed_passage_stays_within_the_corrected_bound_and_exceeds_the_one_without_kappa() {
        // Constant operands 0 and 100 m: the printed max(λ_A, λ_B) is 0, the passage is not (claims G8).
        let mut tree = Tree::new();
        let flat = |z: f64| Disc { centre: DVec3::new(0.0, 0.0, z), radius: 1e5, weight: 1.0, noise: None };
        let (a, b) = (tree.push(flat(0.0)), tree.push(flat(100.0)));
        let lod = Lod { from: 0.2, to: 0.7, passage: Passage::Paper };
        let root = tree.push(Node::Lod { a, b, lod });
        let focus = Focus { position: DVec2::ZERO, near: 0.0, far: 1000.0 };
        let program = Program::compile(&tree, root).expect("it compiles").with_focus(Some(&focus));
        let bounds = program.bounds(Region::rectangle(DVec2::new(100.0, -10.0), DVec2::new(900.0, 10.0)));
        let steepest = (0..1000).map(|k| program.sample(DVec2::new(f64::from(k), 0.0)).gradient.length());
        let steepest = steepest.fold(0.0, f64::max);
        // M·λ_κ/(k_B − k_A) = 100 · 1.5/1000 / 0.5 = 0.3, and κ is steepest inside the passage.
        assert!(steepest <= bounds.slope && bounds.slope < 0.3 * 1.001 && steepest > 0.299, "{steepest} {bounds:?}");
    }
}
