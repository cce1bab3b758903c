//! Replacement (Génevaux 2015 §5.2): f = (1−α_B)·f_A + α_B·f_B, with α_B clamped to [0, 1].

use super::{
    BlendRule, Combine, Fate, Part, Pruned, WeightRule, blend, both_needed, carried, clean, hull, on_support,
    squared_weight,
};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::real::{Operand, Real};

/// A compiled replacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// What happens to the weight.
    pub rule: WeightRule,
}

impl Combine for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at(), self.rule as u32]);
    }
    #[inline(always)]
    fn operands(&self) -> usize {
        2
    }
    #[inline(always)]
    fn combine<R: Number, P: Copy + Into<f64>>(&self, _: Parameters<P>, _: [R; 2], parts: &[Operand<R>]) -> Operand<R> {
        replace(self.rule, parts[0], parts[1])
    }
    fn bounds(&self, _: Parameters<f64>, _: BlendRule, _: &Region, parts: &[Bounds]) -> Bounds {
        replace_bounds(self.rule, parts[0], parts[1])
    }
    fn prune(&self, _: Parameters<f64>, _: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Code> {
        let (a, b) = (parts[0], parts[1]);
        if self.rule != WeightRule::Keep {
            both_needed(parts, fates);
            let t = b.weight.clamp01();
            let weight = (Interval::point(1.0) - t) * a.weight + t.square();
            return Pruned { code: Some(*self), result: Part { absent: false, weight } };
        }
        if a.absent || b.absent {
            fates[1] = Fate::Drop;
            return Pruned { code: None, result: a };
        }
        if b.weight.lo() >= 1.0 {
            fates[0] = Fate::WeightOnly;
        }
        Pruned { code: Some(*self), result: a }
    }
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
        if self.rule == WeightRule::Keep { parts[0] } else { hull(parts[0], parts[1]) }
    }
}

/// Replacement of `a` by `b`: (1−α_B)·f_A + α_B·f_B with α_B clamped to [0, 1].
#[inline(always)]
pub(crate) fn replace<R: Real>(rule: WeightRule, a: Operand<R>, b: Operand<R>) -> Operand<R> {
    let t = b.weight.clamp01();
    let keep = R::one() - t;
    let new = carried(t, &b);
    let elevation = keep * a.elevation + new;
    match rule {
        WeightRule::Keep => {
            let product = if R::ENCLOSES { keep * a.product + a.weight * new } else { R::zero() };
            Operand { elevation, weight: a.weight, product }
        }
        WeightRule::Combine => {
            let old = Operand { elevation: a.elevation, weight: keep * a.weight, product: keep * a.product };
            let new = Operand { elevation: b.elevation, weight: t.square(), product: t * new };
            R::weighted_mean(&[old, new], 0.0)
        }
        WeightRule::CombinePaper => Operand::new(keep * on_support(a) + new, keep * a.weight + t.square()),
    }
}

/// Bounds of a replacement. First rule: f − f_A = α_B·(f_B − f_A), hence λ ≤ (1−b₋)·λ_A + μ_B + λ_αB·M, or
/// max(λ_A, λ_B) + λ_αB·M if f_B is Lipschitz on its support. Second rule: a blend with weights (1−α_B)·α_A and α_B².
pub(crate) fn replace_bounds(rule: WeightRule, a: Bounds, b: Bounds) -> Bounds {
    if b.is_absent() || (a.is_absent() && rule == WeightRule::Keep) {
        return a;
    }
    let t = Interval::new(b.weight.lo().clamp(0.0, 1.0), b.weight.hi().min(1.0));
    let keep = Interval::point(1.0) - t;
    let keep = Interval::new(keep.lo().max(0.0), keep.hi().min(1.0));
    if rule != WeightRule::Keep {
        let old = Bounds {
            weight: keep * a.weight,
            weight_slope: plus_up(times_up(a.weight_slope, keep.hi()), times_up(a.weight.hi(), b.weight_slope)),
            weighted_slope: times_up(a.weighted_slope, keep.hi()),
            ..a
        };
        let new = squared_weight(b, t);
        let blended = blend::blend_bounds(BlendRule::Corrected, &[clean(old), clean(new)]);
        return match rule {
            WeightRule::CombinePaper if !a.is_absent() => Bounds {
                elevation: blended.elevation.hull(a.elevation).hull(Interval::ZERO),
                slope: f64::INFINITY,
                support_slope: f64::INFINITY,
                weighted_slope: f64::INFINITY,
                ..blended
            },
            // As printed, f off A's support is α_B·f_B.
            WeightRule::CombinePaper => Bounds {
                elevation: b.elevation.hull(Interval::ZERO),
                slope: f64::INFINITY,
                support_slope: f64::INFINITY,
                weighted_slope: f64::INFINITY,
                ..blended
            },
            _ => blended,
        };
    }
    let spread = Bounds::spread(a.elevation, b.elevation);
    let crossing = times_up(b.weight_slope, spread);
    let mixed = |of_a: f64| {
        let summed = plus_up(times_up(of_a, keep.hi()), b.weighted_slope);
        plus_up(summed.min(of_a.max(b.support_slope)), crossing)
    };
    Bounds {
        elevation: (keep * a.elevation + t * b.elevation).meet(a.elevation.hull(b.elevation)),
        weight: a.weight,
        slope: mixed(a.slope),
        support_slope: mixed(a.support_slope),
        weight_slope: a.weight_slope,
        weighted_slope: plus_up(
            times_up(a.weighted_slope, keep.hi()),
            times_up(a.weight.hi(), plus_up(b.weighted_slope, crossing)),
        ),
    }
}
