//! Combination of A and B where A's own elevation and slope allow it (Génevaux 2015 §5.3, Fig. 13: dunes only at low
//! altitude and on gentle slopes).
//!
//! Elevations are only Lipschitz, so a weight made from ∇f_A could jump (claims G25). The slope is therefore measured by
//! central differences over a fixed distance ρ: six operands, A at p, A at p ± ρ along x and y (instances of A under
//! translations), and B.

use super::add::{add, add_bounds};
use super::replace::{replace, replace_bounds};
use super::{BlendRule, Combine, Fate, Part, Pruned, WeightRule, carried};
use crate::bounds::{Bounds, Region, THRESHOLD, over_up, plus_up, times_up};
use crate::detail::{smooth, smooth_range, smooth_slope};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, Real};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A C¹ ramp: 1 at `full` and beyond it, 0 at `none` and beyond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ramp {
    /// Where it is 1.
    pub full: f64,
    /// Where it is 0; below or above `full`.
    pub none: f64,
}

/// How B joins A.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Joining {
    /// f_A + m·α_B·f_B.
    #[default]
    Add,
    /// (1 − m·α_B)·f_A + m·α_B·f_B.
    Replace,
}

/// Where B is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mask {
    /// ρ, metres.
    pub probe: f64,
    /// By the elevation of A, metres; `None`: everywhere.
    pub elevation: Option<Ramp>,
    /// By the slope of A over 2ρ, metres per metre; `None`: everywhere.
    pub slope: Option<Ramp>,
    /// What happens there.
    pub joining: Joining,
}

impl Mask {
    pub(crate) fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let sound = |ramp: &Ramp| ramp.full.is_finite() && ramp.none.is_finite() && ramp.full != ramp.none;
        let ramps = self.elevation.iter().chain(&self.slope);
        if !(self.probe > 0.0 && self.probe.is_finite() && ramps.clone().all(sound)) {
            return Err("a masked node needs a positive probe, and ramps whose `full` and `none` differ".to_owned());
        }
        // t = (x − none) / (full − none), or 1 without a ramp.
        let line = |ramp: Option<Ramp>| {
            ramp.map_or([0.0, 1.0], |ramp| {
                let grade = 1.0 / (ramp.full - ramp.none);
                [grade, -ramp.none * grade]
            })
        };
        let (e, s) = (line(self.elevation), line(self.slope));
        let at = out.store([0.5 / self.probe, e[0], e[1], s[0], s[1]]);
        Ok(Code { at, joining: self.joining })
    }
    /// The translations of A beside A itself, in the order of the operands.
    pub(crate) fn probes(&self) -> [DVec2; 4] {
        [-DVec2::X, DVec2::X, -DVec2::Y, DVec2::Y].map(|d| d * self.probe)
    }
}

/// Parameters: 1/(2ρ), and grade and offset of the ramps of elevation and of slope.
const WIDTH: usize = 5;
/// Below this weight A counts as absent: what lies above has a bounded slope, μ over it.
const PRESENT: f64 = 0.5 * THRESHOLD;

/// A compiled masked combination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    at: u32,
    joining: Joining,
}

/// 0 up to [`PRESENT`], 1 from the threshold of terrain on.
#[inline(always)]
fn presence<R: Real>(weight: R) -> R {
    let grade = 1.0 / (THRESHOLD - PRESENT);
    smooth((weight * R::constant(grade) - R::constant(PRESENT * grade)).clamp01())
}

/// m: how far B is allowed, from A at the five places.
#[inline(always)]
fn mask<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, a: &[Operand<R>]) -> R {
    let half = |k: usize| (a[k].elevation - a[k + 1].elevation) * p.get(0);
    let slope = R::length(half(1), half(3));
    let ramp = |x: R, k: usize| smooth((x * p.get(k) + p.get(k + 1)).clamp01());
    let mut m = ramp(a[0].elevation, 1) * ramp(slope, 3);
    for part in &a[..5] {
        m = m * presence(part.weight);
    }
    m
}

impl Combine for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, self.joining as u32]);
    }
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    #[inline(always)]
    fn operands(&self) -> usize {
        6
    }
    #[inline(always)]
    fn combine<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, _: [R; 2], parts: &[Operand<R>]) -> Operand<R> {
        let (a, b) = (parts[0], parts[5]);
        let m = mask(p, parts);
        let t = b.weight.clamp01();
        let product = if R::ENCLOSES { carried(t, &b) * m } else { R::zero() };
        let allowed = Operand { elevation: b.elevation, weight: t * m, product };
        match self.joining {
            Joining::Add => add(WeightRule::Keep, a, allowed),
            Joining::Replace => replace(WeightRule::Keep, a, allowed),
        }
    }
    fn bounds(&self, p: Parameters<f64>, _: BlendRule, _: &Region, parts: &[Bounds]) -> Bounds {
        let (a, b) = (parts[0], parts[5]);
        let (m, m_slope) = mask_bounds(p, &parts[..5]);
        if b.is_absent() || m.hi() <= 0.0 {
            return a;
        }
        let t = Interval::new(b.weight.lo().clamp(0.0, 1.0), b.weight.hi().min(1.0));
        let weight = t * m;
        let allowed = Bounds {
            weight: Interval::new(weight.lo().max(0.0), weight.hi()),
            weight_slope: plus_up(times_up(b.weight_slope, m.hi()), times_up(t.hi(), m_slope)),
            weighted_slope: times_up(b.weighted_slope, m.hi()),
            ..b
        };
        match self.joining {
            Joining::Add => add_bounds(WeightRule::Keep, a, allowed),
            Joining::Replace => replace_bounds(WeightRule::Keep, a, allowed),
        }
    }
    fn prune(&self, _: Parameters<f64>, _: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Code> {
        // Where A counts as absent at one of its places, the mask is exactly 0.
        let nothing = parts[..5].iter().any(|part| part.absent || part.weight.hi() <= PRESENT);
        if nothing || parts[5].absent {
            fates[1..].fill(Fate::Drop);
            return Pruned { code: None, result: parts[0] };
        }
        Pruned { code: Some(*self), result: parts[0] }
    }
    /// The errors of both, and what the mask's own change moves: Δm ≤ 3/2·grade·e₀ + 3/2·grade·‖(e₁ + e₂, e₃ + e₄)‖/2ρ,
    /// times sup |f_B| or M.
    fn error(&self, p: Parameters<f64>, parts: &[Bounds], errors: &[f64]) -> f64 {
        if errors.iter().all(|e| *e == 0.0) {
            return 0.0;
        }
        let half = |k: usize| Interval::point(times_up(plus_up(errors[k], errors[k + 1]), p.0[0]));
        let turned = Interval::length(half(1), half(3)).hi();
        let change = plus_up(times_up(p.0[1].abs(), errors[0]), times_up(p.0[3].abs(), turned));
        let moved = times_up(parts[5].weight.hi().clamp(0.0, 1.0), times_up(1.5, change).min(1.0));
        let (own, size) = match self.joining {
            Joining::Add => (plus_up(errors[0], errors[5]), parts[5].elevation.magnitude()),
            Joining::Replace => (errors[0].max(errors[5]), Bounds::spread(parts[0].elevation, parts[5].elevation)),
        };
        plus_up(own, times_up(moved, size))
    }
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
        parts[0]
    }
    fn rebase(&self, p: Parameters<f64>, _: DVec2, tile: &mut TileLayout) -> Code {
        Code { at: tile.store(p.0[..WIDTH].iter().copied()), ..*self }
    }
}

/// Range and slope of the mask from the bounds of A at the five places.
///
/// The mask is a product of seven factors in [0, 1], and 0 where A's weight is at most PRESENT at one place. Elsewhere
/// f_A at that place has slope at most Λ = min(λ on the support, μ/PRESENT). Each factor adds its slope times the
/// largest of the others: a presence 3/2 · λ_α/(T − PRESENT); the elevation's ramp 3/2 · grade · Λ₀. The measured slope
/// is the length of D = ((f₁ − f₂), (f₃ − f₄))/2ρ, whose two components have slopes (Λ₁ + Λ₂)/2ρ and (Λ₃ + Λ₄)/2ρ, hence
/// the root of the sum of their squares bounds its own.
fn mask_bounds(p: Parameters<f64>, a: &[Bounds]) -> (Interval, f64) {
    if a.iter().any(Bounds::is_absent) {
        return (Interval::ZERO, 0.0);
    }
    let steep = |k: usize| a[k].support_slope.min(over_up(a[k].weighted_slope, PRESENT));
    let line = |x: Interval, k: usize| {
        let t = x * Interval::point(p.0[k]) + Interval::point(p.0[k + 1]);
        Interval::new(t.lo().clamp(0.0, 1.0), t.hi().clamp(0.0, 1.0))
    };
    let half = |k: usize| (a[k].elevation - a[k + 1].elevation) * Interval::point(p.0[0]);
    let (d_x, d_y) = (half(1), half(3));
    let turning = |k: usize| Interval::point(times_up(plus_up(steep(k), steep(k + 1)), p.0[0]));
    let slope_of_slope = Interval::length(turning(1), turning(3)).hi();
    let mut factors = [(Interval::ZERO, 0.0); 7];
    for (factor, (x, steepness, k)) in
        factors.iter_mut().zip([(a[0].elevation, steep(0), 1), (Interval::length(d_x, d_y), slope_of_slope, 3)])
    {
        let t = line(x, k);
        *factor = (smooth_range(t), times_up(times_up(smooth_slope(t), p.0[k].abs()), steepness));
    }
    let grade = 1.0 / (THRESHOLD - PRESENT);
    for (factor, part) in factors[2..].iter_mut().zip(a) {
        let at = |alpha: f64| ((alpha - PRESENT) * grade).clamp(0.0, 1.0);
        let t = Interval::new(at(part.weight.lo()), at(part.weight.hi()));
        *factor = (smooth_range(t), times_up(times_up(smooth_slope(t), grade), part.weight_slope));
    }
    let mut range = Interval::point(1.0);
    let mut slope = 0.0;
    for (k, factor) in factors.iter().enumerate() {
        range = range * factor.0;
        let others = factors.iter().enumerate().filter(|(l, _)| *l != k).map(|(_, other)| other.0.hi());
        slope = plus_up(slope, times_up(factor.1, others.fold(1.0, times_up)));
    }
    (Interval::new(range.lo().max(0.0), range.hi().max(0.0)), slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::disc::Disc;
    use crate::program::Program;
    use crate::tree::{Node, Tree};
    use glam::DVec3;

    /// A hill of two discs, 200 m high in the middle and flat around, with 10 m of sand where the mask allows.
    fn program(mask: Mask) -> [Program; 2] {
        let mut tree = Tree::new();
        let disc =
            |z: f64, radius: f64, weight: f64| Disc { centre: DVec3::new(0.0, 0.0, z), radius, weight, noise: None };
        let (plain, hill) = (tree.push(disc(0.0, 5000.0, 1.0)), tree.push(disc(200.0, 600.0, 1.0)));
        let a = tree.push(Node::Replace { a: plain, b: hill, rule: WeightRule::Keep });
        let b = tree.push(disc(10.0, 4000.0, 1.0));
        let root = tree.push(Node::Masked { a, b, mask });
        [a, root].map(|id| Program::compile(&tree, id).expect("it compiles"))
    }

    #[test]
    fn sand_lies_low_and_on_gentle_slopes_only() {
        let mask = Mask {
            probe: 5.0,
            elevation: Some(Ramp { full: 120.0, none: 180.0 }),
            slope: Some(Ramp { full: 0.15, none: 0.3 }),
            joining: Joining::Add,
        };
        let [bare, sand] = program(mask);
        let (mut on, mut high, mut steep) = (0, 0, 0);
        for k in 0..900 {
            let at = DVec2::new(f64::from(k), 3.0);
            let (s, b) = (sand.height(at).0, bare.sample(at));
            let depth = s - b.elevation;
            let slope = b.gradient.length();
            if b.elevation > 180.0 {
                assert!(depth == 0.0);
                high += 1;
            } else if slope > 0.31 {
                assert!(depth == 0.0, "{at} {slope} {depth}");
                steep += 1;
            } else if b.elevation < 120.0 && slope < 0.14 {
                assert!(depth > 8.5, "{at} {slope} {depth}");
                on += 1;
            }
        }
        assert!(on > 100 && high > 50 && steep > 50, "{on} {high} {steep}");
    }

    #[test]
    fn over_a_kink_of_the_ground_the_mask_does_not_jump_as_one_by_the_gradient_would() {
        // A cone-like image has a kink; the weight by ∇f_A would jump from full to none across it.
        let samples = (0..21 * 21).map(|k| if k % 21 < 10 { 0.0 } else { (k % 21 - 10) as f32 * 4.0 }).collect();
        let image = std::sync::Arc::new(crate::primitive::image::Image::new(21, 21, samples).expect("a valid image"));
        let patch = crate::primitive::image::ImagePatch {
            image,
            origin: DVec2::ZERO,
            spacing: DVec2::splat(10.0),
            margin: 10.0,
            weight: 2.0,
            weights: None,
            elevation_scale: 1.0,
            elevation_offset: 0.0,
        };
        let mut tree = Tree::new();
        let a = tree.push(patch);
        let b = tree.push(Disc { centre: DVec3::new(100.0, 100.0, 10.0), radius: 5000.0, weight: 1.0, noise: None });
        let mask =
            Mask { probe: 2.0, elevation: None, slope: Some(Ramp { full: 0.1, none: 0.3 }), joining: Joining::Add };
        let root = tree.push(Node::Masked { a, b, mask });
        let program = Program::compile(&tree, root).expect("it compiles");
        let ground = Program::compile(&tree, a).expect("it compiles");
        let region = Region::rectangle(DVec2::new(80.0, 90.0), DVec2::new(120.0, 110.0));
        let bounds = program.bounds(region);
        let (mut steepest, mut jump) = (0.0f64, 0.0f64);
        for k in 0..40_000 {
            let at = |k: i32| DVec2::new(80.0 + 0.001 * f64::from(k), 101.0);
            let rise = program.height(at(k + 1)).0 - program.height(at(k)).0;
            steepest = steepest.max(rise.abs() / 0.001);
            jump = jump.max((ground.sample(at(k + 1)).gradient.x - ground.sample(at(k)).gradient.x).abs());
        }
        assert!(steepest <= bounds.slope * (1.0 + 1e-9) && steepest > 2.0, "{steepest} {bounds:?}");
        // Control: the gradient itself jumps past the whole ramp.
        assert!(jump > 0.3, "{jump}");
    }
}
