//! The inner nodes of the tree: how they combine elevations and weights, and the bounds that follow. Each rule is
//! written for difference quotients, so it needs no derivative (claims G4) and holds on any segment of the region.

use crate::bounds::{Bounds, Region, THRESHOLD, over_up, plus_up, times_up};
use crate::interval::Interval;
use crate::primitive::{Number, Parameters};
use crate::real::{Operand, Real};
use serde::{Deserialize, Serialize};

/// What a replacement or an addition does to the weight (Génevaux 2015 §5.2, §5.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WeightRule {
    /// α = α_A.
    #[default]
    Keep,
    /// Replacement: α = (1−α_B)·α_A + α_B²; addition: α = α_A + α_B². The elevation is the blend with these two
    /// weights, so it stays Lipschitz where α_A fades out (claims, *Nesting*).
    Combine,
    /// The same weight with the elevation as printed: its slope has no bound where α_A fades out.
    CombinePaper,
}

/// t·f with t the weight clamped to [0, 1] (claims G24). An enclosure also has it as α·f / max(α, 1), which stays
/// smooth where the weight fades out and f itself has no slope bound.
#[inline(always)]
fn carried<R: Real>(t: R, b: &Operand<R>) -> R {
    let plain = t * b.elevation;
    if R::ENCLOSES { (b.product / b.weight.max(R::one())).tighten(plain) } else { plain }
}

/// Replacement of `a` by `b`: (1−α_B)·f_A + α_B·f_B with α_B clamped to [0, 1].
#[inline(always)]
pub fn replace<R: Real>(rule: WeightRule, a: Operand<R>, b: Operand<R>) -> Operand<R> {
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
        WeightRule::CombinePaper => Operand::new(elevation, keep * a.weight + t.square()),
    }
}

/// Addition of `b` to `a`: f_A + α_B·f_B with α_B clamped to [0, 1].
#[inline(always)]
pub fn add<R: Real>(rule: WeightRule, a: Operand<R>, b: Operand<R>) -> Operand<R> {
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
        WeightRule::CombinePaper => Operand::new(a.elevation + detail, a.weight + t.square()),
    }
}

/// Parameters of a similarity: the inverse map's matrix (xx, xy, yx, yy) and translation, elevation scale and offset.
pub const AFFINE_WIDTH: usize = 8;

/// The point carried into the operand's frame.
#[inline(always)]
pub fn enter<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> [R; 2] {
    let row = |k: usize, shift: usize| p.get::<R>(k) * x[0] + p.get::<R>(k + 1) * x[1] + p.get::<R>(shift);
    [row(0, 4), row(2, 5)]
}

/// The operand's elevation carried back.
#[inline(always)]
pub fn leave<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, a: Operand<R>) -> Operand<R> {
    let (scale, offset) = (p.get::<R>(6), p.get::<R>(7));
    let product = if R::ENCLOSES { a.product * scale + a.weight * offset } else { R::zero() };
    Operand { elevation: a.elevation * scale + offset, weight: a.weight, product }
}

/// A region carried into the operand's frame.
pub fn enter_region(p: Parameters<f64>, region: &Region) -> Region {
    let map = |x: [Interval; 2]| enter::<Interval, f64>(p, x);
    match region.ends {
        None => Region { extent: map(region.extent), ends: None },
        Some(ends) => {
            let [a, b] = ends.map(map);
            Region { extent: [a[0].hull(b[0]), a[1].hull(b[1])], ends: Some([a, b]) }
        }
    }
}

/// Bounds of the operand carried back: slopes grow by the norm of the inverse map, elevations by the vertical scale.
pub fn leave_bounds(p: Parameters<f64>, b: Bounds) -> Bounds {
    if b.is_absent() {
        return Bounds::ABSENT;
    }
    let square = |k: usize| Interval::point(p.0[k]).square();
    // The Frobenius norm over √2 is the norm of a similarity; of any other matrix it is below, so take the larger column.
    let column = |k: usize| Real::sqrt(square(k) + square(k + 2)).hi();
    let norm = if p.0[0] == p.0[3] && p.0[1] == -p.0[2] {
        column(0)
    } else {
        Real::sqrt(square(0) + square(1) + square(2) + square(3)).hi()
    };
    let vertical = times_up(norm, p.0[6].abs());
    Bounds {
        elevation: b.elevation * Interval::point(p.0[6]) + Interval::point(p.0[7]),
        weight: b.weight,
        slope: times_up(b.slope, vertical),
        support_slope: times_up(b.support_slope, vertical),
        weight_slope: times_up(b.weight_slope, norm),
        weighted_slope: times_up(b.weighted_slope, vertical),
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
pub fn blend_bounds(rule: BlendRule, parts: &[Bounds]) -> Bounds {
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

/// Bounds of a replacement. First rule: f − f_A = α_B·(f_B − f_A), hence λ ≤ (1−b₋)·λ_A + μ_B + λ_αB·M, or
/// max(λ_A, λ_B) + λ_αB·M if f_B is Lipschitz on its support. Second rule: a blend with weights (1−α_B)·α_A and α_B².
pub fn replace_bounds(rule: WeightRule, a: Bounds, b: Bounds) -> Bounds {
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
        let blended = blend_bounds(BlendRule::Corrected, &[clean(old), clean(new)]);
        return match rule {
            WeightRule::CombinePaper if !a.is_absent() => Bounds {
                elevation: blended.elevation.hull(a.elevation),
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

/// Bounds of an addition: λ ≤ λ_A + μ_B + λ_αB·sup|f_B|; the second rule scales f_A by α_A/(α_A + α_B²), a blend with 0.
pub fn add_bounds(rule: WeightRule, a: Bounds, b: Bounds) -> Bounds {
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
            let blended = blend_bounds(BlendRule::Corrected, &[a, clean(flat)]);
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

/// `b` carrying the weight α_B² instead of α_B, α_B in `t`: λ ≤ 2·sup α_B·λ_αB, μ ≤ sup α_B·μ_B.
fn squared_weight(b: Bounds, t: Interval) -> Bounds {
    Bounds {
        weight: t.square(),
        weight_slope: times_up(2.0 * t.hi(), b.weight_slope),
        weighted_slope: times_up(b.weighted_slope, t.hi()),
        ..b
    }
}

/// A weight enclosure without the negative dust of outward rounding.
fn clean(b: Bounds) -> Bounds {
    if b.is_absent() {
        return Bounds::ABSENT;
    }
    Bounds { weight: Interval::new(b.weight.lo().max(0.0), b.weight.hi()), ..b }
}
