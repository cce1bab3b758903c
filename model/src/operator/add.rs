//! Addition (Génevaux 2015 §5.3): f = f_A + α_B·f_B, with α_B clamped to [0, 1].

use super::{
    BlendRule, Combine, Fate, Part, Pruned, WeightRule, blend, both_needed, carried, clean, hull, on_support,
    squared_weight,
};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::real::{Operand, Real};

/// A compiled addition.
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
        add(self.rule, parts[0], parts[1])
    }
    fn bounds(&self, _: Parameters<f64>, _: BlendRule, _: &Region, parts: &[Bounds]) -> Bounds {
        add_bounds(self.rule, parts[0], parts[1])
    }
    fn prune(&self, _: Parameters<f64>, _: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Code> {
        let (a, b) = (parts[0], parts[1]);
        if self.rule != WeightRule::Keep {
            both_needed(parts, fates);
            let weight = a.weight + b.weight.clamp01().square();
            return Pruned { code: Some(*self), result: Part { absent: false, weight } };
        }
        if a.absent || b.absent {
            fates[1] = Fate::Drop;
            return Pruned { code: None, result: a };
        }
        Pruned { code: Some(*self), result: a }
    }
    fn error(&self, _: Parameters<f64>, parts: &[Bounds], errors: &[f64]) -> f64 {
        plus_up(errors[0], times_up(parts[1].weight.hi().clamp(0.0, 1.0), errors[1]))
    }
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
        if self.rule == WeightRule::Keep { parts[0] } else { hull(parts[0], parts[1]) }
    }
}

/// Addition of `b` to `a`: f_A + α_B·f_B with α_B clamped to [0, 1].
#[inline(always)]
pub(crate) fn add<R: Real>(rule: WeightRule, a: Operand<R>, b: Operand<R>) -> Operand<R> {
    let t = b.weight.clamp01();
    let detail = carried(t, &b);
    let raise = |base: Operand<R>| Operand {
        elevation: base.elevation + detail,
        weight: base.weight,
        product: if R::ENCLOSES { base.product + base.weight * detail } else { R::zero() },
    };
    match rule {
        WeightRule::Keep => raise(a),
        WeightRule::Combine => raise(R::weighted_mean(&[a, Operand::new(R::zero(), t.square())], 0.0)),
        WeightRule::CombinePaper => Operand::new(on_support(a) + detail, a.weight + t.square()),
    }
}

/// Bounds of an addition: λ ≤ λ_A + μ_B + λ_αB·sup|f_B|; the second rule scales f_A by α_A/(α_A + α_B²), a blend with 0.
pub(crate) fn add_bounds(rule: WeightRule, a: Bounds, b: Bounds) -> Bounds {
    if b.is_absent() || (a.is_absent() && rule == WeightRule::Keep) {
        return a;
    }
    let t = Interval::new(b.weight.lo().clamp(0.0, 1.0), b.weight.hi().min(1.0));
    let detail = plus_up(b.weighted_slope, times_up(b.weight_slope, b.elevation.magnitude()));
    let base = match rule {
        WeightRule::Keep => a,
        _ => {
            let flat = Bounds {
                elevation: Interval::ZERO,
                slope: 0.0,
                support_slope: 0.0,
                weighted_slope: 0.0,
                ..squared_weight(b, t)
            };
            let blended = blend::blend_bounds(BlendRule::Corrected, &[a, clean(flat)]);
            if rule == WeightRule::CombinePaper {
                Bounds {
                    elevation: a.elevation.hull(Interval::ZERO),
                    slope: f64::INFINITY,
                    support_slope: f64::INFINITY,
                    weighted_slope: f64::INFINITY,
                    ..blended
                }
            } else {
                blended
            }
        }
    };
    Bounds {
        elevation: base.elevation + t * b.elevation,
        slope: plus_up(base.slope, detail),
        support_slope: plus_up(base.support_slope, detail),
        weighted_slope: plus_up(base.weighted_slope, times_up(base.weight.hi(), detail)),
        ..base
    }
}
