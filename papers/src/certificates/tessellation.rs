//! Formulas of the tessellation paper: noise over steep ground, normalised octaves.

use super::search::{Finding, Form, Number};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use terrain_model::falloff::fade;
use terrain_model::noise::{Combination, GRADIENT3_RANGE, GRADIENT3_SLOPE, Octaves, gradient3};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "steep-height",
        shows: "On a steep slope the height changes faster along the surface than the ground coordinates do.",
        control: "the ground coordinates change slowest",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["slope"], root: [(0.1, 10.0)], measure: SteepHeight }),
    },
    Certificate {
        id: "steep-noise",
        shows: "Noise in space over a slope is steeper over the ground than the noise itself.",
        control: "the factor √(1 + λ_h²)",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["slope"], root: [(0.1, 10.0)], measure: SteepNoise }),
    },
    Certificate {
        id: "perlin-leaves-unit",
        shows: "Improved gradient noise in space exceeds 1.",
        control: "the published range 1.0365",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["x", "y", "z"],
            root: [(0.0, 1.0), (0.0, 1.0), (0.0, 1.0)],
            measure: PerlinRange,
        }),
    },
    Certificate {
        id: "octaves-normaliser",
        shows: "With gain −1 and two octaves the normaliser vanishes.",
        control: "gains that are not negative",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["gain"], root: [(-1.5, 1.0)], measure: Normaliser }),
    },
    Certificate {
        id: "octaves-slope",
        shows: "For three settings of six octaves, Σ(gl)ᵏ/Σgᵏ·λ is the library's slope bound in space.",
        control: "the frequencies left out",
        certifies: &["noise/fractal.rs::space_bounds", "noise/fractal.rs::bounds", "noise/fractal.rs::combined_bounds"],
        kind: Kind::Proof(octaves_slope),
    },
];

struct SteepHeight;
impl Measure<1> for SteepHeight {
    fn sides<R: Number>(&self, [slope]: [R; 1]) -> Sides<R> {
        // Per metre along the line of fall.
        let along = (R::one() + slope.square()).sqrt();
        Sides::limits(slope / along, R::one() / along, R::one())
    }
}

struct SteepNoise;
impl Measure<1> for SteepNoise {
    fn sides<R: Number>(&self, [slope]: [R; 1]) -> Sides<R> {
        // A noise of slope 1 along the line of fall, per metre of ground.
        let factor = (R::one() + slope.square()).sqrt();
        Sides::limits(factor, R::one(), factor * R::constant(1.0 + 1e-12))
    }
}

struct PerlinRange;
impl Measure<3> for PerlinRange {
    fn sides<R: Number>(&self, x: [R; 3]) -> Sides<R> {
        // Every corner with the best of the twelve edges, for which max g·v is the sum of the two largest components.
        let corners = gradient3::corners(x, x.map(fade));
        let mut sum = R::zero();
        for corner in &corners {
            let [a, b, c] = corner.offset.map(R::abs);
            sum = sum + corner.weight * (a + b).max(a + c).max(b + c);
        }
        Sides::limits(sum, R::one(), R::constant(GRADIENT3_RANGE))
    }
}

struct Normaliser;
impl Measure<1> for Normaliser {
    fn sides<R: Number>(&self, [gain]: [R; 1]) -> Sides<R> {
        // The normaliser must not vanish: how far it is below a thousandth.
        let short = |gain: R| R::constant(1e-3) - (R::one() + gain).abs();
        Sides::forms(short(gain), short(gain.max(R::zero())), R::constant(1e-9))
    }
}

fn octaves_slope(form: Form) -> Finding {
    Finding::all([(0.5, 2.0), (0.6, 2.0), (0.5, 3.0)].map(|(gain, lacunarity)| {
        let octaves = Octaves { octaves: 6, frequency: 1.0, lacunarity, gain, amplitude: 1.0 };
        let (mut steep, mut range, mut a, mut f) = (0.0, 0.0, 1.0, 1.0);
        for _ in 0..6 {
            steep += a * form.pick(f, 1.0);
            range += a;
            a *= gain;
            f *= lacunarity;
        }
        let ours = Combination::Sum.space_bounds(&octaves);
        let (bound, attained) = (GRADIENT3_SLOPE * steep / range * (1.0 + 1e-9), ours.slope / range);
        let heights = ours.range.hi() <= GRADIENT3_RANGE * range * (1.0 + 1e-9);
        if heights && attained <= bound {
            Finding::Proved { bound, attained, boxes: 1 }
        } else {
            Finding::Refuted { bound, value: attained, at: format!("gain {gain}, lacunarity {lacunarity}") }
        }
    }))
}
