//! The paper's turbulence, signed and normalised: Σₖ 2⁻ᵏ n(2ᵏ p/λ) over its largest value, in [−1, 1] (Paris 2019
//! §3.3; claims P1).

use terrain_model::noise::fractal::{Combination, Octave, Octaves};
use terrain_model::noise::hash::mix;
use terrain_model::noise::{NoiseValue, SIMPLEX3_RANGE, SIMPLEX3_SLOPE};

/// Octaves of simplex noise whose amplitudes sum to 1 over the noise's range.
#[derive(Clone, Debug)]
pub(crate) struct Turbulence {
    octaves: Vec<Octave<3>>,
    /// Lipschitz constant of [`Turbulence::signed`]: each of N octaves adds a·f·sup‖∇n‖ and a·f is the same for all, so
    /// N · sup‖∇n‖ / (λ · sup|n| · (2 − 2¹⁻ᴺ)).
    pub(crate) slope: f64,
}

impl Turbulence {
    pub(crate) fn new(wavelength: f64, octaves: u32, seed: u32) -> Turbulence {
        let mut total = 0.0;
        let mut gain = 1.0;
        for _ in 0..octaves {
            total += gain;
            gain *= 0.5;
        }
        let amplitude = 1.0 / (SIMPLEX3_RANGE * total);
        let sequence = Octaves { octaves, frequency: 1.0 / wavelength, lacunarity: 2.0, gain: 0.5, amplitude };
        let slope = f64::from(octaves) * amplitude * SIMPLEX3_SLOPE / wavelength;
        Turbulence { octaves: sequence.place(seed, [0.0; 3]), slope }
    }
    /// In [−1, 1].
    pub(crate) fn signed<R: NoiseValue>(&self, p: [R; 3]) -> R {
        Combination::Sum.combine(&self.octaves, |octave| R::simplex3(octave.lattice, octave.coordinates(p)))
    }
    /// (1 + signed)/2, the paper's t over 2 − 2⁻ᵒ; half the slope.
    pub(crate) fn unit<R: NoiseValue>(&self, p: [R; 3]) -> R {
        (R::constant(0.5) + R::constant(0.5) * self.signed(p)).clamp01()
    }
}

/// The noise seed of a node in a scene.
pub(crate) fn seed(scene: u32, node: u32) -> u32 {
    mix(scene, node)
}

/// Three independent channels of one node.
pub(crate) fn channels(wavelength: f64, octaves: u32, seed: u32) -> [Turbulence; 3] {
    std::array::from_fn(|k| Turbulence::new(wavelength, octaves, mix(seed, 0x666f_6c64 + k as u32)))
}

/// Lip(δ) of three channels of this amplitude: the Frobenius norm of the Jacobian bounds its operator norm.
pub(crate) fn fold_slope(amplitude: f64, noise: &[Turbulence; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|k| amplitude * noise[k].slope);
    (x * x + y * y + z * z).sqrt()
}
