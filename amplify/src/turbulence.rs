//! The paper's turbulence, signed and normalised: Σₖ 2⁻ᵏ n(2ᵏ p/λ) over its largest value, in [−1, 1] (Paris 2019
//! §3.3; claims P1).

use terrain_model::bounds::times_up;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::noise::fractal::{Combination, Octave, Octaves};
use terrain_model::noise::{NoiseValue, SIMPLEX3_RANGE, SIMPLEX3_SLOPE};
use terrain_model::real::Real;

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
    /// Encloses [`Turbulence::signed`] over the box `p`, with a Lipschitz constant on it. An octave whose cells are
    /// smaller than the box gives the range and slope it has everywhere.
    pub(crate) fn enclose(&self, p: [Interval; 3]) -> (Interval, f64) {
        let width = p.iter().fold(0.0, |width, side| side.width().max(width));
        let p: [Dual<Interval, 3>; 3] = std::array::from_fn(|k| Dual::variable(p[k], k));
        let t = Combination::Sum.combine(&self.octaves, |octave| {
            if width * octave.frequency < 1.0 {
                return Dual::simplex3(octave.lattice, octave.coordinates(p));
            }
            let slope = Interval::symmetric(times_up(SIMPLEX3_SLOPE, octave.frequency));
            Dual { value: Interval::symmetric(SIMPLEX3_RANGE), slope: [slope; 3] }
        });
        let [x, y, z] = t.slope.map(|s| Interval::point(s.magnitude()).square());
        (t.value, Real::sqrt(x + y + z).hi().min(self.slope * (1.0 + 1e-12)))
    }
    /// Bytes of its octaves.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.octaves[..])
    }
}
