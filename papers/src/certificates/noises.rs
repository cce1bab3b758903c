//! Noises and sums of octaves (Génevaux 2015 §4.1, Fig. 5, §7.3.1): the published constants, certified again, and the printed bounds
//! of octaves against what exact gradients give.

use super::family::{Member, Shrunk, holds};
use super::search::{Finding, Form};
use super::terrain::{Said, Terrain};
use super::{Certificate, Kind};
use glam::{DVec2, DVec3};
use terrain_model::certify::Verdict;
use terrain_model::certify::noise::{
    gradient2_range, gradient2_slope, gradient3_range, gradient3_slope, simplex3_range, simplex3_slope,
};
use terrain_model::noise::{
    Combination, GRADIENT2_RANGE, GRADIENT2_SLOPE, GRADIENT3_RANGE, GRADIENT3_SLOPE, Octaves, SIMPLEX3_RANGE,
    SIMPLEX3_SLOPE,
};
use terrain_model::operator::BlendRule;
use terrain_model::primitive::detail_disc::DetailDisc;
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::program::Program;
use terrain_model::tree::Tree;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "noise-plane-range",
        shows: "|n| ≤ 0.6609 for gradient noise in the plane, whatever its gradients.",
        control: "0.6600",
        certifies: &[],
        kind: Kind::Proof(|form| constant(gradient2_range, form.pick(GRADIENT2_RANGE, 0.66), 0.660_816_4)),
    },
    Certificate {
        id: "noise-plane-slope",
        shows: "‖∇n‖ ≤ 2.0674 for gradient noise in the plane.",
        control: "2.0660",
        certifies: &[],
        kind: Kind::Proof(|form| constant(gradient2_slope, form.pick(GRADIENT2_SLOPE, 2.066), 2.067_122_1)),
    },
    Certificate {
        id: "noise-space-range",
        shows: "|n| ≤ 1.0365 for gradient noise in space.",
        control: "1.0360",
        certifies: &[],
        kind: Kind::Proof(|form| constant(gradient3_range, form.pick(GRADIENT3_RANGE, 1.036), 1.036_353_8)),
    },
    Certificate {
        id: "noise-space-slope",
        shows: "‖∇n‖ ≤ 3.7538 for gradient noise in space.",
        control: "3.7490",
        certifies: &[],
        kind: Kind::Proof(|form| constant(gradient3_slope, form.pick(GRADIENT3_SLOPE, 3.749), 3.75)),
    },
    Certificate {
        id: "noise-simplex-range",
        shows: "|n| ≤ 0.2944 for simplex noise in space, kernel (1/2 − d²)⁴.",
        control: "0.2940",
        certifies: &[],
        kind: Kind::Proof(|form| constant(simplex3_range, form.pick(SIMPLEX3_RANGE, 0.294), 0.294_318_3)),
    },
    Certificate {
        id: "noise-simplex-slope-coarse",
        shows: "‖∇n‖ ≤ 2.071 × 1.25 for simplex noise in space; the published constant itself has a stored proof.",
        control: "2.0400",
        certifies: &[],
        kind: Kind::Proof(|form| {
            let target = form.pick(1.25 * SIMPLEX3_SLOPE, 2.04);
            Finding::all(simplex3_slope(target, BUDGET).map(|verdict| found(verdict, target, 2.050_498_5)))
        }),
    },
    Certificate {
        id: "octaves-printed",
        shows: "Eight octaves a = 2⁻ⁱ of frequencies s = 2ⁱ are steeper than Σ a·λ_η/s.",
        control: "Σ a·s·λ_η",
        certifies: &[],
        kind: Kind::Witness(&PRINTED),
    },
    Certificate {
        id: "octaves-ridged",
        shows: "Ridged octaves are steeper than the sum rule.",
        control: "the combination run on intervals of range and slope",
        certifies: &[],
        kind: Kind::Witness(&RIDGED),
    },
    Certificate {
        id: "octaves-family",
        shows: "Discs of each combination of octaves keep their bounds over a few cells of the noise.",
        control: "a tenth of the slope bound",
        certifies: &[
            "primitive/disc.rs::bounds",
            "noise/fractal.rs::plane_bounds",
            "noise/fractal.rs::placed_bounds",
            "noise/fractal.rs::combined_bounds",
        ],
        kind: Kind::Proof(octaves),
    },
    Certificate {
        id: "detail-family",
        shows: "Discs with filtered octaves keep their bounds where the level of detail varies.",
        control: "a tenth of the slope bound",
        certifies: &["primitive/detail_disc.rs::bounds"],
        kind: Kind::Proof(filtered),
    },
];

/// Parts that one of the 256 pieces may cost.
const BUDGET: u64 = 100_000;

fn constant<const N: usize>(search: fn(f64, u64) -> Verdict<N>, target: f64, attained: f64) -> Finding {
    found(search(target, BUDGET), target, attained)
}

/// `attained` is what a witness that is published with the constant reaches.
fn found<const N: usize>(verdict: Verdict<N>, target: f64, attained: f64) -> Finding {
    match verdict {
        Verdict::Proved { boxes, .. } => Finding::Proved { bound: target, attained, boxes },
        Verdict::Refuted { witness, value } => Finding::Refuted { bound: target, value, at: format!("{witness:.5?}") },
        Verdict::Undecided { bound, boxes, .. } => Finding::Undecided { bound: target, known: bound, boxes },
    }
}

const fn halving(octaves: u32) -> Octaves {
    Octaves { octaves, frequency: 1.0, lacunarity: 2.0, gain: 0.5, amplitude: 1.0 }
}

fn disc(radius: f64, combination: Combination, octaves: Octaves) -> Disc {
    Disc { centre: DVec3::ZERO, radius, weight: 1.0, noise: Some(DiscNoise { combination, octaves, seed: 2015 }) }
}

const RIDGES: Combination = Combination::Ridged { offset: 1.0, sharpness: 2.0 };
const HUNTED: [(f64, f64); 2] = [(0.0, 12.0), (0.0, 12.0)];
const WHERE: (DVec2, DVec2) = (DVec2::ZERO, DVec2::splat(12.0));

static PRINTED: Terrain = Terrain::new(
    || {
        // Σ aᵢ/sᵢ = Σ 4⁻ⁱ.
        let sum: f64 = (0..8u32).map(|i| 1.0 / f64::from(1u32 << (2 * i))).sum();
        Said::of(sum * GRADIENT2_SLOPE, WHERE, |tree| tree.push(disc(1e4, Combination::Sum, halving(8))))
    },
    HUNTED,
);

static RIDGED: Terrain =
    Terrain::new(|| Said::of(4.0 * GRADIENT2_SLOPE, WHERE, |tree| tree.push(disc(1e4, RIDGES, halving(4)))), HUNTED);

fn octaves(form: Form) -> Finding {
    let of = |combination: Combination| {
        Member::of(move |tree| tree.push(disc(1e3, combination, halving(2))))
            .map(|member| Member { cover: 1, ..member.over(DVec2::new(0.1, 0.2), DVec2::new(1.3, 1.4)) })
    };
    let combinations = [
        Combination::Sum,
        Combination::Turbulence,
        RIDGES,
        Combination::Multifractal { offset: 1.0 },
        Combination::Hybrid { offset: 0.7 },
    ];
    holds(combinations.map(of), BlendRule::Corrected, form, Shrunk(0.1))
}

fn filtered(form: Form) -> Finding {
    let of = |combination: Combination| {
        let mut tree = Tree::new();
        let octaves = Octaves { octaves: 3, frequency: 0.02, lacunarity: 2.0, gain: 0.5, amplitude: 20.0 };
        let disc = DetailDisc { disc: disc(1e4, combination, octaves), filters: DetailDisc::even_filters(3) };
        let root = tree.push(disc);
        let focus = terrain_model::detail::Focus { position: DVec2::ZERO, near: 10.0, far: 200.0 };
        let program = Program::compile(&tree, root).ok()?.with_focus(Some(&focus));
        Some(Member { program, extent: (DVec2::new(60.0, -20.0), DVec2::new(100.0, 20.0)), cover: 1, kinked: false })
    };
    holds([of(Combination::Sum), of(Combination::Turbulence)], BlendRule::Corrected, form, Shrunk(0.1))
}
