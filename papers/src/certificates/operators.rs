//! Replacement, addition, masks, warp, similarity, level of detail, and pruning (Génevaux 2015 §5, §6, appendix).

use super::authored::{blend, flat, noisy, tilted};
use super::blends::blends;
use super::family::{Member, Shrunk, holds};
use super::search::{Finding, Form, Number};
use super::terrain::{Said, Terrain};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use glam::DVec2;
use terrain_model::bounds::Region;
use terrain_model::detail::{Focus, smooth};
use terrain_model::dual::Dual;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill};
use terrain_model::noise::Combination;
use terrain_model::operator::affine::Similarity;
use terrain_model::operator::lod::{Lod, Passage};
use terrain_model::operator::masked::{Joining, Mask, Ramp};
use terrain_model::operator::warp::{Control, Warp};
use terrain_model::operator::{BlendRule, WeightRule};
use terrain_model::program::Program;
use terrain_model::real::Real;
use terrain_model::tree::{Node, Tree};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "replace-family",
        shows: "Replacements of both weight rules keep their bounds, also by a blend whose weight fades out.",
        control: "seven tenths of the slope bound",
        certifies: &[
            "operator/replace.rs::bounds",
            "operator/replace.rs::replace_bounds",
            "operator/mod.rs::squared_weight",
        ],
        kind: Kind::Proof(replacements),
    },
    Certificate {
        id: "replace-combine-printed",
        shows: "The second weight rule with the printed elevation is steep on the terrain where A's weight fades out.",
        control: "no bound is claimed for the printed form",
        certifies: &[],
        kind: Kind::Witness(&COMBINE_PRINTED),
    },
    Certificate {
        id: "replace-beyond-operands",
        shows: "A weight above 1 takes the replacement beyond both operands.",
        control: "the weight clamped to [0, 1]",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["weight_b", "f_a", "f_b"],
            root: [(0.0, 3.0), (-100.0, 100.0), (-100.0, 100.0)],
            measure: Beyond,
        }),
    },
    Certificate {
        id: "replace-negative-weight",
        shows: "The second weight rule makes a negative weight of weights above 1.",
        control: "the weight clamped to [0, 1]",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["weight_a", "weight_b"],
            root: [(0.0, 10.0), (0.0, 3.0)],
            measure: NegativeWeight,
        }),
    },
    Certificate {
        id: "add-family",
        shows: "Additions of both weight rules keep their bounds, also of a blend whose weight fades out.",
        control: "seven tenths of the slope bound",
        certifies: &["operator/add.rs::bounds", "operator/add.rs::add_bounds"],
        kind: Kind::Proof(additions),
    },
    Certificate {
        id: "add-gradient-weight",
        shows: "A weight made from the gradient of a Lipschitz elevation jumps.",
        control: "the slope measured by differences over a fixed distance",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["step"], root: [(1e-6, 0.4)], measure: GradientWeight }),
    },
    Certificate {
        id: "masked-family",
        shows: "Operands admitted by the elevation and slope of the base keep their bounds.",
        control: "half of the slope bound",
        certifies: &["operator/masked.rs::bounds"],
        kind: Kind::Proof(masks),
    },
    Certificate {
        id: "warp-family",
        shows: "Warped terrains keep their bounds.",
        control: "three tenths of the slope bound",
        certifies: &["operator/warp.rs::leave_bounds"],
        kind: Kind::Proof(warps),
    },
    Certificate {
        id: "warp-cube",
        shows: "The bijection (x³, y) makes a steep terrain of a gentle one.",
        control: "the bound λ_A·sup ‖J‖",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["q", "constant"], root: [(1e-4, 1.0), (1.0, 8.0)], measure: Cube }),
    },
    Certificate {
        id: "warp-gradient",
        shows: "J·g is not the gradient of a sheared plane.",
        control: "Jᵀ·g",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["shear", "gx", "gy"],
            root: [(-3.0, 3.0), (-3.0, 3.0), (-3.0, 3.0)],
            measure: Shear,
        }),
    },
    Certificate {
        id: "affine-family",
        shows: "Turned, scaled and moved terrains keep their bounds.",
        control: "nine tenths of the slope bound",
        certifies: &["operator/affine.rs::leave_bounds"],
        kind: Kind::Proof(affines),
    },
    Certificate {
        id: "lod-family",
        shows: "Passages between levels of detail keep their bounds.",
        control: "six tenths of the slope bound",
        certifies: &["operator/lod.rs::bounds", "operator/lod.rs::lod_bounds"],
        kind: Kind::Proof(passages),
    },
    Certificate {
        id: "lod-forgotten-term",
        shows: "Where κ varies, a passage is steeper than both of its operands.",
        control: "the term M·λ_κ/(k_B − k_A)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["slope", "rise", "kappa_slope"],
            root: [(0.1, 1.0), (0.0, 10.0), (0.001, 0.1)],
            measure: PassageSlope,
        }),
    },
    Certificate {
        id: "lod-filtered-octave",
        shows: "An octave behind a filter is steeper, where κ varies, than the octave alone.",
        control: "the term a·sup|η|·L·λ_κ/(k⁺ − k⁻)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["amplitude", "frequency", "width", "kappa_slope"],
            root: [(1.0, 20.0), (0.005, 0.05), (0.05, 0.5), (0.001, 0.02)],
            measure: FilteredOctave,
        }),
    },
    Certificate {
        id: "lod-weight-kink",
        shows: "The weight of a passage that is linear in κ has a kink where it begins.",
        control: "the passage 3s² − 2s³",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["weight_a", "weight_b", "width"],
            root: [(0.0, 1.0), (0.0, 1.0), (0.05, 1.0)],
            measure: WeightKink,
        }),
    },
    Certificate {
        id: "bounds-local",
        shows: "The slope bound over a part is at most that over the whole, for every part of the family, and is half of it somewhere.",
        control: "the whole as part of a part",
        certifies: &[],
        kind: Kind::Proof(local),
    },
    Certificate {
        id: "prune-exact",
        shows: "On every tile of a cover the pruned program answers the bits of the whole one, at 400 points a tile.",
        control: "pruned to the tile beside",
        certifies: &[],
        kind: Kind::Proof(pruning),
    },
];

static COMBINE_PRINTED: Terrain = Terrain::new(combine_printed, [(-0.1, 0.1), (0.7, 0.87)]);

/// A is the blend of unit discs at ±1/2, 0 and 1 high, which fades out at the corner of their lens; B is a plateau of weight 0.8. The
/// bound that the paper's rule for the other weight gives, λ_A + λ_αB·M with λ_A on the terrain of A.
fn combine_printed() -> Option<Said> {
    let extent = (DVec2::new(-1e-4, 0.86), DVec2::new(1e-4, 0.8661));
    let printed = 2.0 * WYVILL_SLOPE + WYVILL_SLOPE * 0.8 / 50.0;
    Said::of(printed, extent, |tree| {
        let a = blend(tree, [flat(-0.5, 0.0, 1.0, 1.0, 0.0), flat(0.5, 0.0, 1.0, 1.0, 1.0)]);
        let b = tree.push(flat(0.0, 0.0, 50.0, 0.8, 0.0));
        tree.push(Node::Replace { a, b, rule: WeightRule::CombinePaper })
    })
}

fn replacements(form: Form) -> Finding {
    let of = |rule: WeightRule, weight: f64| {
        Member::of(move |tree| {
            let a = tree.push(flat(0.0, 0.0, 10.0, 1.0, 0.0));
            let b = tree.push(flat(1.0, 0.5, 3.0, weight, 4.0));
            tree.push(Node::Replace { a, b, rule })
        })
    };
    let by_fading = Member::of(|tree| {
        let a = tree.push(flat(0.0, 0.0, 10.0, 1.0, 0.0));
        let b = blend(tree, [flat(-0.5, 0.0, 1.0, 1.0, 0.0), flat(0.5, 0.0, 1.0, 1.0, 1.0)]);
        tree.push(Node::Replace { a, b, rule: WeightRule::Keep })
    })
    .map(|m| m.over(DVec2::splat(-1.6), DVec2::splat(1.6)));
    let members = [
        of(WeightRule::Keep, 1.0),
        of(WeightRule::Keep, 0.6),
        of(WeightRule::Keep, 1.7),
        of(WeightRule::Combine, 1.0),
        of(WeightRule::Combine, 0.8),
        by_fading,
    ];
    holds(members, BlendRule::Corrected, form, Shrunk(0.7))
}

fn additions(form: Form) -> Finding {
    let of = |rule: WeightRule, weight: f64| {
        Member::of(move |tree| {
            let a = tree.push(tilted(8.0, 0.3, 10.0, 1.0));
            let b = tree.push(flat(1.0, 0.5, 3.0, weight, 4.0));
            tree.push(Node::Add { a, b, rule })
        })
    };
    let of_fading = Member::of(|tree| {
        let a = tree.push(flat(0.0, 0.0, 10.0, 1.0, 0.0));
        let b = blend(tree, [flat(-0.5, 0.0, 1.0, 1.0, 2.0), flat(0.5, 0.0, 1.0, 1.0, 1.0)]);
        tree.push(Node::Add { a, b, rule: WeightRule::Keep })
    })
    .map(|m| m.over(DVec2::splat(-1.6), DVec2::splat(1.6)));
    let members = [of(WeightRule::Keep, 1.0), of(WeightRule::Keep, 0.5), of(WeightRule::Combine, 1.0), of_fading];
    holds(members, BlendRule::Corrected, form, Shrunk(0.7))
}

fn masks(form: Form) -> Finding {
    let of = |joining: Joining, elevation: Option<Ramp>, slope: Option<Ramp>| {
        Member::of(move |tree| {
            let a = tree.push(tilted(60.0, 0.3, 60.0, 1.0));
            let b = tree.push(flat(5.0, 5.0, 40.0, 1.0, 6.0));
            let mask = Mask { probe: 5.0, elevation, slope, joining };
            tree.push(Node::Masked { a, b, mask })
        })
        // Between the seams of the ramp, which lie at x = −6.7 and 26.7: at a clamp duals know no more than the hull.
        .map(|m| m.over(DVec2::new(-4.0, -15.0), DVec2::new(22.0, 15.0)))
    };
    let low = Some(Ramp { full: -2.0, none: 8.0 });
    let gentle = Some(Ramp { full: 0.2, none: 0.6 });
    holds(
        [of(Joining::Add, low, None), of(Joining::Replace, low, None), of(Joining::Add, None, gentle)],
        BlendRule::Corrected,
        form,
        Shrunk(0.5),
    )
}

fn warps(form: Form) -> Finding {
    let of = |shift: f64| {
        Member::of(move |tree| {
            let node = blend(tree, [flat(-50.0, 0.0, 110.0, 1.0, 0.0), flat(50.0, 0.0, 110.0, 1.0, 60.0)]);
            let control = Control { centre: DVec2::new(5.0, 10.0), radius: 90.0, shift: DVec2::new(shift, 5.0) };
            match Warp::new(&[control]) {
                Ok(warp) => tree.push(Node::Warp { node, warp }),
                // Not a warp: the certificate then fails on the empty tree.
                Err(_) => tree.push(Node::Blend(vec![])),
            }
        })
    };
    holds([of(10.0), of(-22.0)], BlendRule::Corrected, form, Shrunk(0.3))
}

fn affines(form: Form) -> Finding {
    let of = |scale: f64, rotation: f64, elevation_scale: f64| {
        Member::of(move |tree| {
            let node =
                blend(tree, [flat(-0.447_213_6, 0.0, 1.0, 0.4883, 0.0), flat(0.447_213_6, 0.0, 1.0, 0.4883, 1.0)]);
            let map = Similarity {
                scale,
                rotation,
                translation: DVec2::new(40.0, -3.0),
                elevation_scale,
                elevation_offset: -7.0,
            };
            tree.push(Node::Affine { node, map })
        })
    };
    holds([of(3.0, 0.4, 1.0), of(0.25, -2.0, 2.0), of(1.0, 1.5, -1.5)], BlendRule::Corrected, form, Shrunk(0.9))
}

fn passages(form: Form) -> Finding {
    let of = |passage: Passage, from: f64, to: f64| {
        let mut tree = Tree::new();
        let (a, b) = (tree.push(flat(0.0, 0.0, 400.0, 1.0, 0.0)), tree.push(flat(30.0, 0.0, 400.0, 1.0, 40.0)));
        let root = tree.push(Node::Lod { a, b, lod: Lod { from, to, passage } });
        let focus = Focus { position: DVec2::new(-20.0, 10.0), near: 20.0, far: 200.0 };
        let program = Program::compile(&tree, root).ok()?.with_focus(Some(&focus));
        // Between the seams: where a passage begins and ends, duals of intervals know of its clamp no more than the hull of both sides.
        Some(Member { program, extent: (DVec2::new(70.0, 60.0), DVec2::new(85.0, 80.0)), cover: 2, kinked: false })
    };
    holds(
        [
            of(Passage::Blend, 0.2, 0.7),
            of(Passage::Paper, 0.2, 0.7),
            of(Passage::Blend, 0.3, 0.9),
            of(Passage::Blend, 0.0, 1.0),
        ],
        BlendRule::Corrected,
        form,
        Shrunk(0.6),
    )
}

struct Beyond;
impl Measure<3> for Beyond {
    fn sides<R: Number>(&self, [weight, a, b]: [R; 3]) -> Sides<R> {
        // How far the result lies below the lower operand.
        let below = |t: R| a.min(b) - ((R::one() - t) * a + t * b);
        Sides::forms(below(weight), below(weight.clamp01()), R::constant(1e-9))
    }
}

struct NegativeWeight;
impl Measure<2> for NegativeWeight {
    fn sides<R: Number>(&self, [a, b]: [R; 2]) -> Sides<R> {
        let weight = |t: R| (R::one() - t) * a + t.square();
        Sides::forms(-weight(b), -weight(b.clamp01()), R::constant(1e-9))
    }
}

struct GradientWeight;
impl Measure<1> for GradientWeight {
    fn sides<R: Number>(&self, [step]: [R; 1]) -> Sides<R> {
        // f_A = max(x, 0), as bilinear as any image; the weight is its slope. Change of the weight per metre across x = 0.
        let exact = |x: R| Dual::<R, 1>::variable(x, 0).max(Dual::zero()).slope[0];
        // Measured by differences over 2ρ, ρ = 1/2, it changes by at most 1/ρ per metre.
        let half = R::constant(0.5);
        let measured = |x: R| (x + half).max(R::zero()) - (x - half).max(R::zero());
        let change = |weight: &dyn Fn(R) -> R| (weight(step) - weight(-step)) / (step + step);
        Sides::forms(change(&exact), change(&measured), R::constant(2.0))
    }
}

struct Cube;
impl Measure<2> for Cube {
    fn sides<R: Number>(&self, [q, constant]: [R; 2]) -> Sides<R> {
        // f_A(q) = q, p = q³: between p = 0 and p the elevation q rises by 1/q² per metre.
        let quotient = R::one() / q.square();
        Sides::limits(quotient, constant, quotient * R::constant(3.0))
    }
}

struct Shear;
impl Measure<3> for Shear {
    fn sides<R: Number>(&self, [shear, gx, gy]: [R; 3]) -> Sides<R> {
        // ω⁻¹(x, y) = (x + shear·y, y) and f_A = gx·x + gy·y.
        let (x, y) = (Dual::<R, 2>::variable(R::zero(), 0), Dual::variable(R::zero(), 1));
        let f = Dual::fixed(gx) * (x + Dual::fixed(shear) * y) + Dual::fixed(gy) * y;
        let off = |g: [R; 2]| R::length(g[0] - f.slope[0], g[1] - f.slope[1]);
        Sides::forms(off([gx + shear * gy, gy]), off([gx, shear * gx + gy]), R::constant(1e-9))
    }
}

struct PassageSlope;
impl Measure<3> for PassageSlope {
    fn sides<R: Number>(&self, [slope, rise, kappa_slope]: [R; 3]) -> Sides<R> {
        // f_A = slope·x, f_B = f_A + rise, κ = 1/2 + kappa_slope·x, k_A = 0.2, k_B = 0.8, at κ = 1/2.
        let x = Dual::<R, 1>::variable(R::zero(), 0);
        let t = (Dual::constant(0.3) + Dual::fixed(kappa_slope) * x) / Dual::constant(0.6);
        let a = Dual::fixed(slope) * x;
        let f = (Dual::one() - t) * a + t * (a + Dual::fixed(rise));
        let corrected = slope + rise * kappa_slope / R::constant(0.6);
        Sides::limits(f.slope[0].abs(), slope, corrected * R::constant(1.0 + 1e-12))
    }
}

struct FilteredOctave;
impl Measure<4> for FilteredOctave {
    fn sides<R: Number>(&self, [amplitude, frequency, width, kappa_slope]: [R; 4]) -> Sides<R> {
        // Gradient noise at its steepest and at its highest are not the same point; a bound adds both. Here the height alone: the
        // octave at its summit, 0.66, whose own slope is 0, behind a filter at its steepest, 1/√5 of the way.
        let summit = R::constant(0.66);
        let t = R::one() / R::constant(5.0).sqrt();
        let b = wyvill(Dual::<R, 1>::variable(t, 0).square());
        let slope = amplitude * summit * b.slope[0].abs() * kappa_slope / width;
        let own = amplitude * frequency * R::constant(terrain_model::noise::GRADIENT2_SLOPE);
        let extra = amplitude * R::constant(terrain_model::noise::GRADIENT2_RANGE * WYVILL_SLOPE) * kappa_slope / width;
        Sides::limits(slope, own, own + extra)
    }
}

struct WeightKink;
impl Measure<3> for WeightKink {
    fn sides<R: Number>(&self, [a, b, width]: [R; 3]) -> Sides<R> {
        // Before the passage the weight is level; its slope just after, per unit of κ.
        let s = Dual::<R, 1>::variable(R::zero(), 0);
        let weight = |t: Dual<R, 1>| (Dual::one() - t) * Dual::fixed(a) + t * Dual::fixed(b);
        let slope = |t: Dual<R, 1>| weight(t).slope[0].abs() / width;
        Sides::forms(slope(s), slope(smooth(s)), R::constant(1e-9))
    }
}

fn local(form: Form) -> Finding {
    let (mut parts, mut worst, mut best) = (0, 0.0f64, f64::INFINITY);
    for member in blends().into_iter().flatten() {
        let (lo, hi) = member.extent;
        let whole = member.program.bounds(Region::rectangle(lo, hi)).slope;
        for k in 0..64u32 {
            let a = lo + (hi - lo) * DVec2::new(f64::from(k % 8), f64::from(k / 8)) / 8.0;
            let part = member.program.bounds(Region::rectangle(a, a + (hi - lo) / 8.0)).slope;
            let (smaller, larger) = form.pick((part, whole), (whole, part));
            parts += 1;
            worst = worst.max(smaller / larger.max(f64::MIN_POSITIVE));
            best = best.min(smaller / larger.max(f64::MIN_POSITIVE));
        }
    }
    if worst <= 1.0 + 1e-9 && best <= 0.5 {
        Finding::Proved { bound: 1.0, attained: worst, boxes: parts }
    } else {
        Finding::Refuted { bound: 1.0, value: worst, at: "a part of the family".to_owned() }
    }
}

/// Octaves, blends, replacements and maps, pruned to tiles.
fn pruning(form: Form) -> Finding {
    let Some(member) = Member::of(|tree| {
        let hills = tree.push(noisy(0.0, 0.0, 600.0, 40.0, Combination::Sum, 3));
        let ridge =
            tree.push(noisy(250.0, -100.0, 300.0, 80.0, Combination::Ridged { offset: 1.0, sharpness: 2.0 }, 4));
        let ground = tree.push(Node::Blend(vec![hills, ridge]));
        let lake = tree.push(flat(-100.0, 120.0, 150.0, 1.2, -4.0));
        let lake = tree.push(Node::Replace { a: ground, b: lake, rule: WeightRule::Keep });
        let map = Similarity { scale: 1.3, rotation: 0.3, ..Similarity::default() };
        let moved = tree.push(Node::Affine { node: ridge, map });
        tree.push(Node::Add { a: lake, b: moved, rule: WeightRule::Keep })
    }) else {
        return Finding::Undecided { bound: 0.0, known: f64::NAN, boxes: 0 };
    };
    let (lo, hi) = member.extent;
    let size = (hi - lo) / 8.0;
    let mut points = 0;
    for k in 0..64u32 {
        let corner = lo + size * DVec2::new(f64::from(k % 8), f64::from(k / 8));
        let aside = form.pick(DVec2::ZERO, size);
        let pruned = member.program.prune(Region::rectangle(corner + aside, corner + aside + size));
        for j in 0..400u32 {
            let p = corner + size * DVec2::new(f64::from(j % 20), f64::from(j / 20)) / 19.0;
            let (whole, part) = (member.program.height(p), pruned.height(p));
            points += 1;
            if whole.1.to_bits() != part.1.to_bits() || (whole.1 > 0.0 && whole.0.to_bits() != part.0.to_bits()) {
                return Finding::Refuted { bound: 0.0, value: (whole.0 - part.0).abs(), at: format!("{p}") };
            }
        }
    }
    Finding::Proved { bound: 0.0, attained: 0.0, boxes: points }
}
