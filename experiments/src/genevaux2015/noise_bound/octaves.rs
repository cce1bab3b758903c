//! Slopes of octaves found by climbing, beside the printed sum, the sum over frequencies and the bound derived for each
//! combination.

use rayon::prelude::*;
use terrain_model::certify::climb;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::noise::{Combination, GRADIENT2_SLOPE, Octaves, Prey, Witness, fbm, hunt, mix};

use super::super::blend_bound::Hill;

/// Octaves with gain 1/2 and lacunarity 2 that start at one cycle per metre and amplitude 1 m: a_i = 2⁻ⁱ, s_i = 2ⁱ.
pub const fn halving(octaves: u32) -> Octaves {
    Octaves { octaves, frequency: 1.0, lacunarity: 2.0, gain: 0.5, amplitude: 1.0 }
}

/// a_i and the scale s_i of §4.1, which multiplies the coordinates.
fn terms(octaves: &Octaves) -> impl Iterator<Item = (f64, f64)> {
    let next = |&(amplitude, scale): &(f64, f64)| Some((amplitude * octaves.gain, scale * octaves.lacunarity));
    std::iter::successors(Some((octaves.amplitude, octaves.frequency)), next).take(octaves.octaves as usize)
}

/// The bound as printed: Σ a_i·λ_η / s_i.
pub fn printed(octaves: &Octaves) -> f64 {
    terms(octaves).map(|(amplitude, scale)| amplitude / scale).sum::<f64>() * GRADIENT2_SLOPE
}
/// The sum rule with the chain rule kept: Σ a_i·s_i·λ_η.
pub fn summed(octaves: &Octaves) -> f64 {
    terms(octaves).map(|(amplitude, scale)| amplitude * scale).sum::<f64>() * GRADIENT2_SLOPE
}

/// The combinations of Fig. 5 with the library's usual constants.
pub const COMBINATIONS: [(&str, Combination); 4] = [
    ("sum", Combination::Sum),
    ("turbulence", Combination::Turbulence),
    ("ridged", Combination::Ridged { offset: 1.0, sharpness: 2.0 }),
    ("multifractal", Combination::Multifractal { offset: 1.0 }),
];

/// The steepest point found of a combination of octaves.
pub struct Found {
    /// Name of the combination.
    pub name: &'static str,
    /// How many octaves.
    pub octaves: u32,
    /// The hunt.
    pub witness: Witness,
    /// The sum rule for the same octaves.
    pub summed: f64,
}

impl Found {
    /// Found over claimed: above 1 the bound is wrong.
    pub fn share(&self) -> f64 {
        1.0 / self.witness.slope_ratio()
    }
}

/// Hunts in every combination for 1 to `most` octaves.
pub fn survey(most: u32, seed: u32, evaluations: u32) -> Vec<Found> {
    let cases: Vec<_> = COMBINATIONS.iter().flat_map(|case| (1..=most).map(move |n| (*case, n))).collect();
    cases
        .into_par_iter()
        .map(|((name, combination), n)| {
            let octaves = halving(n);
            let witness = hunt(Prey::Plane(combination, octaves), mix(seed, n), evaluations);
            Found { name, octaves: n, witness, summed: summed(&octaves) }
        })
        .collect()
}

/// A sum of octaves at its steepest point found.
pub struct Steepest {
    octaves: Octaves,
    seed: u32,
    /// Where, metres.
    pub at: [f64; 2],
    /// ‖∇‖ there.
    pub slope: f64,
}

impl Steepest {
    /// Climbs the sum on the lattices of `seed`.
    pub fn of(octaves: Octaves, seed: u32, starts: u32) -> Steepest {
        let root = [Interval::symmetric(32.0 / octaves.frequency); 2];
        let (at, slope) = climb(&Hill(|x| slope_at(&octaves, seed, x)), root, seed, starts);
        Steepest { octaves, seed, at, slope }
    }
    /// ‖∇‖ along the x axis through the point, at `count` points up to `reach` to either side.
    pub fn along(&self, reach: f64, count: u32) -> Vec<(f64, f64)> {
        (0..=count)
            .map(|k| reach * (2.0 * f64::from(k) / f64::from(count) - 1.0))
            .map(|x| (x, slope_at(&self.octaves, self.seed, [self.at[0] + x, self.at[1]])))
            .collect()
    }
}

/// ‖∇‖ of the sum of octaves, by duals.
fn slope_at(octaves: &Octaves, seed: u32, [x, y]: [f64; 2]) -> f64 {
    let [dx, dy] = fbm(&octaves.place(seed, [0.0; 2]), [Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1)]).slope;
    (dx * dx + dy * dy).sqrt()
}

/// Fig. 5's ridged multifractal over η = sin along a line, for which λ_η = 1: the steepest point found and the sum rule.
pub fn ridged_sine(octaves: &Octaves, seed: u32, starts: u32) -> (f64, f64, f64) {
    let placed = octaves.place::<2>(seed, [0.0; 2]);
    let ridged = Combination::Ridged { offset: 1.0, sharpness: 2.0 };
    let slope = |[x]: [f64; 1]| {
        let field: Dual<f64, 1> = ridged.combine(&placed, |octave| {
            let angle = x * octave.frequency;
            Dual { value: libm::sin(angle), slope: [octave.frequency * libm::cos(angle)] }
        });
        field.slope[0].abs()
    };
    let turn = std::f64::consts::TAU / octaves.frequency;
    let ([x], found) = climb(&Hill(slope), [Interval::new(0.0, turn)], seed, starts);
    (x, found, summed(octaves) / GRADIENT2_SLOPE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_and_summed_bounds_are_those_of_the_ledger() {
        // Claims G5: one octave a = 1, s = 4: λ/4 against 4λ; eight octaves: 1.333λ against 8λ.
        let one = Octaves { frequency: 4.0, ..halving(1) };
        assert_eq!((printed(&one), summed(&one)), (GRADIENT2_SLOPE / 4.0, 4.0 * GRADIENT2_SLOPE));
        let eight = halving(8);
        assert!((printed(&eight) / GRADIENT2_SLOPE - 4.0 / 3.0).abs() < 1e-4);
        assert!((summed(&eight) / GRADIENT2_SLOPE - 8.0).abs() < 1e-12);
        let library = Combination::Sum.plane_bounds(&eight).slope;
        assert!(summed(&eight) <= library * (1.0 + 1e-15) && library < summed(&eight) * (1.0 + 1e-12));
    }

    #[test]
    fn sums_pass_the_printed_bound_and_ridges_the_sum_rule_but_neither_its_own() {
        for found in survey(4, 3, 20_000) {
            let Found { name, octaves, witness, summed } = &found;
            assert!(witness.respected(), "{name}, {octaves} octaves: {witness:?}");
            assert!(*octaves < 2 || witness.slope > printed(&halving(*octaves)), "{name}: {witness:?}");
            assert!(*name != "ridged" || witness.slope > *summed, "{octaves} octaves: {} {summed}", witness.slope);
            assert!(!matches!(*name, "sum" | "turbulence") || witness.slope <= *summed, "{name}: {witness:?}");
        }
    }

    #[test]
    fn a_ridged_sine_is_steeper_than_the_sum_rule_says() {
        let (_, found, rule) = ridged_sine(&halving(4), 1, 40);
        assert!(rule == 4.0 && found > 1.2 * rule, "{found}");
    }

    #[test]
    fn a_line_passes_through_the_steepest_point() {
        let steepest = Steepest::of(halving(3), 5, 10);
        let line = steepest.along(0.5, 100);
        assert!((line[50].1 - steepest.slope).abs() < 1e-12);
        assert!(line.iter().all(|point| point.1 <= summed(&halving(3))));
    }
}
