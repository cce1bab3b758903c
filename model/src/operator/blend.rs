//! Blend of any number of operands (Génevaux 2015 §5.1): f = Σ αf / Σ α, α = Σ α.

use super::{Combine, Fate, Part, Pruned, hull};
use crate::bounds::{Bounds, Region, THRESHOLD, over_up, plus_up, times_up};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::real::Operand;

/// A compiled blend. Of no operand it is 0 with weight 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// How many operands.
    pub operands: u32,
}

impl Combine for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at(), self.operands]);
    }
    #[inline(always)]
    fn operands(&self) -> usize {
        self.operands as usize
    }
    #[inline(always)]
    fn combine<R: Number, P: Copy + Into<f64>>(&self, _: Parameters<P>, _: [R; 2], parts: &[Operand<R>]) -> Operand<R> {
        R::weighted_mean(parts, 0.0)
    }
    fn bounds(&self, _: Parameters<f64>, rule: BlendRule, _: &Region, parts: &[Bounds]) -> Bounds {
        blend_bounds(rule, parts)
    }
    fn prune(&self, _: Parameters<f64>, _: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Code> {
        let mut kept = 0;
        let mut weight = Interval::ZERO;
        for (part, fate) in parts.iter().zip(fates) {
            *fate = if part.absent { Fate::Drop } else { Fate::Keep };
            kept += u32::from(!part.absent);
            weight = weight + part.weight;
        }
        Pruned { code: (kept > 0).then_some(Code { operands: kept }), result: Part { absent: kept == 0, weight } }
    }
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
        parts.iter().copied().fold(None, hull)
    }
}

/// Which slope bound a blend uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlendRule {
    /// max λ + Σ λ_α·M/t or μ/t, whichever is smaller, with t the least weight met on the terrain.
    Corrected,
    /// As printed: max λ + max λ_α · M, which the factor 1/(α_A + α_B) dropped in the appendix makes false (claims G1).
    Paper,
}

/// Blend of any number of operands: f = Σ αf / Σ α, α = Σ α.
///
/// With A = Σα: A·∇f = Σ αᵢ∇fᵢ + Σ (fᵢ − f)∇αᵢ. Hence μ ≤ Σ μᵢ + Σ λ_αᵢ·Mᵢ with Mᵢ ≥ |fᵢ − f|, and where A ≥ t,
/// λ ≤ μ/t and, if every operand is Lipschitz on its whole support, λ ≤ max λᵢ + Σ λ_αᵢ·Mᵢ / t. For two operands the
/// sum is a maximum (`Blend.v: blend_lip`).
pub(crate) fn blend_bounds(rule: BlendRule, parts: &[Bounds]) -> Bounds {
    let present = || parts.iter().filter(|part| !part.is_absent());
    let mut count = 0;
    let mut only = Bounds::ABSENT;
    let mut elevation: Option<Interval> = None;
    let mut weight = Interval::ZERO;
    for part in present() {
        count += 1;
        only = *part;
        elevation = Some(elevation.map_or(part.elevation, |e| e.hull(part.elevation)));
        weight = Interval::new(
            (weight.lo() + part.weight.lo()).next_down().max(0.0),
            (weight.hi() + part.weight.hi()).next_up(),
        );
    }
    let Some(elevation) = elevation else { return Bounds::ABSENT };
    if count == 1 {
        return only;
    }
    let mut steepest = 0.0f64;
    let mut support_steepest = 0.0f64;
    let mut weight_slope = 0.0;
    let mut steepest_weight = 0.0f64;
    let mut weighted = 0.0;
    let mut crossing = 0.0;
    let mut largest_crossing = 0.0f64;
    for part in present() {
        steepest = steepest.max(part.slope);
        support_steepest = support_steepest.max(part.support_slope);
        weight_slope = plus_up(weight_slope, part.weight_slope);
        steepest_weight = steepest_weight.max(part.weight_slope);
        weighted = plus_up(weighted, part.weighted_slope);
        let spread = Bounds::spread(part.elevation, elevation);
        let term = times_up(part.weight_slope, spread);
        crossing = plus_up(crossing, term);
        largest_crossing = largest_crossing.max(term);
    }
    if rule == BlendRule::Paper {
        let spread = Bounds::spread(elevation, elevation);
        let slope = plus_up(steepest, times_up(steepest_weight, spread));
        let weighted_slope = times_up(weight.hi(), slope);
        return Bounds { elevation, weight, slope, support_slope: slope, weight_slope, weighted_slope };
    }
    let weighted_slope = plus_up(weighted, crossing);
    let crossing = if count == 2 { largest_crossing } else { crossing };
    let over = |t: f64| {
        if t <= 0.0 {
            f64::INFINITY
        } else {
            over_up(weighted_slope, t).min(plus_up(support_steepest, over_up(crossing, t)))
        }
    };
    Bounds {
        elevation,
        weight,
        slope: over(weight.lo().max(THRESHOLD)),
        support_slope: over(weight.lo()),
        weight_slope,
        weighted_slope,
    }
}
