//! Noises made of octaves: sums, turbulence, ridged and product multifractals (Musgrave in Ebert et al., Texturing and
//! Modeling, ch. 16). How octaves combine is written once; run on noise values it is the elevation, run on the
//! certified range and slope of one octave it is the range and slope of the whole.

use super::{GRADIENT2_RANGE, GRADIENT2_SLOPE, GRADIENT3_RANGE, GRADIENT3_SLOPE, Lattice, NoiseValue, mix};
use crate::dual::Dual;
use crate::interval::Interval;
use crate::real::Real;
use serde::{Deserialize, Serialize};

/// A geometric sequence of octaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Octaves {
    /// How many.
    pub octaves: u32,
    /// Cycles per metre of the first.
    pub frequency: f64,
    /// Frequency of an octave over that of the one before.
    pub lacunarity: f64,
    /// Amplitude of an octave over that of the one before.
    pub gain: f64,
    /// Amplitude of the first, metres.
    pub amplitude: f64,
}

/// How octaves combine into one elevation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Combination {
    /// Σ aₖ ηₖ: fractional Brownian motion.
    Sum,
    /// Σ aₖ |ηₖ|: turbulence (Perlin 1985).
    Turbulence,
    /// Σ aₖ sₖ with s₀ = (offset − |η₀|)² and sₖ = (offset − |ηₖ|)² · clamp(sharpness · sₖ₋₁, 0, 1): ridges, each
    /// octave rough where the one before is high.
    Ridged {
        /// Height of a ridge line before squaring; 1 puts the ridges at the zeros of the noise.
        offset: f64,
        /// How strongly an octave gates the next; Musgrave's gain, usually 2.
        sharpness: f64,
    },
    /// a₀ Π (offset + aₖ/a₀ · ηₖ): the multiplicative multifractal.
    Multifractal {
        /// Added to each octave; at 0 the product is 0 nearly everywhere, from 1 on it nears a sum.
        offset: f64,
    },
    /// Σ aₖ (offset + ηₖ) · wₖ, w₀ = 1, wₖ₊₁ = min(wₖ, 1) · gₖ (offset + ηₖ) with gₖ = aₖ/a₀: rough where it is
    /// high already (hybrid multifractal).
    Hybrid {
        /// Added to each octave.
        offset: f64,
    },
}

/// One octave placed in the world or in a tile: η at `x · frequency + offset` on `lattice`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octave<const D: usize> {
    /// The lattice, with the base that the tile's origin meets.
    pub lattice: Lattice<D>,
    /// Noise coordinates of the origin within its cell, each in [0, 1].
    pub offset: [f64; D],
    /// Cycles per metre.
    pub frequency: f64,
    /// Metres.
    pub amplitude: f64,
}

impl Octaves {
    /// 1 to 16 octaves, positive finite frequency and lacunarity, finite amplitude, a gain of at least 0.
    pub fn is_sound(&self) -> bool {
        let positive = [self.frequency, self.lacunarity].iter().all(|v| *v > 0.0 && v.is_finite());
        positive
            && (1..=16).contains(&self.octaves)
            && self.amplitude.is_finite()
            && self.gain >= 0.0
            && self.gain.is_finite()
    }
    /// The octaves of lattice `seed`, for coordinates relative to `origin` in metres.
    ///
    /// Octave k uses the lattice `mix(seed, k)`, shifted by a fraction of a cell that depends on its seed: gradient
    /// noise vanishes on its lattice, and unshifted octaves of an integral lacunarity would all vanish together.
    pub fn place<const D: usize>(&self, seed: u32, origin: [f64; D]) -> Vec<Octave<D>> {
        let (mut frequency, mut amplitude) = (self.frequency, self.amplitude);
        let mut out = Vec::with_capacity(self.octaves as usize);
        for k in 0..self.octaves {
            let seed = mix(seed, k);
            let mut octave = Octave { lattice: Lattice { seed, base: [0; D] }, offset: [0.0; D], frequency, amplitude };
            for axis in 0..D {
                let shift = f64::from(mix(seed, axis as u32) >> 16) / 65_536.0;
                let coordinate = origin[axis] * frequency + shift;
                let cell = coordinate.floor();
                octave.lattice.base[axis] = cell as i64 as i32;
                octave.offset[axis] = coordinate - cell;
            }
            out.push(octave);
            frequency *= self.lacunarity;
            amplitude *= self.gain;
        }
        out
    }
}

impl<const D: usize> Octave<D> {
    /// The same octave for coordinates relative to `origin`, metres from the present origin. The cell wraps modulo 2³²,
    /// as the hash sees it.
    pub fn moved_to(&self, origin: [f64; D]) -> Octave<D> {
        const SPAN: f64 = 4_294_967_296.0;
        let mut moved = *self;
        for axis in 0..D {
            let coordinate = origin[axis] * self.frequency + self.offset[axis];
            let cell = coordinate.floor();
            let wrapped = (cell - (cell / SPAN).floor() * SPAN) as u32 as i32;
            moved.lattice.base[axis] = self.lattice.base[axis].wrapping_add(wrapped);
            moved.offset[axis] = coordinate - cell;
        }
        moved
    }
    /// Offset, frequency and amplitude rounded to `f32`: what single precision evaluates exactly.
    pub fn rounded(&self) -> Octave<D> {
        let single = |x: f64| f64::from(x as f32);
        Octave {
            lattice: self.lattice,
            offset: self.offset.map(single),
            frequency: single(self.frequency),
            amplitude: single(self.amplitude),
        }
    }
    /// Noise coordinates of `x`, metres from the origin that the octave was placed for.
    #[inline(always)]
    pub fn coordinates<R: Real>(&self, x: [R; D]) -> [R; D] {
        let frequency = R::constant(self.frequency);
        let mut out = x;
        for k in 0..D {
            out[k] = x[k] * frequency + R::constant(self.offset[k]);
        }
        out
    }
}

impl Combination {
    /// The constants of the combination, in the order of its fields.
    pub fn constants(&self) -> Vec<f64> {
        match *self {
            Combination::Sum | Combination::Turbulence => vec![],
            Combination::Ridged { offset, sharpness } => vec![offset, sharpness],
            Combination::Multifractal { offset } | Combination::Hybrid { offset } => vec![offset],
        }
    }

    /// Combines the octaves, `noise` giving the η of each.
    #[inline(always)]
    pub fn combine<R: Real, const D: usize>(&self, octaves: &[Octave<D>], noise: impl Fn(&Octave<D>) -> R) -> R {
        let c = R::constant;
        let Some(first) = octaves.first() else { return R::zero() };
        let mut sum = R::zero();
        if first.amplitude == 0.0 {
            return sum;
        }
        match *self {
            Combination::Sum => {
                for octave in octaves {
                    sum = sum + c(octave.amplitude) * noise(octave);
                }
            }
            Combination::Turbulence => {
                for octave in octaves {
                    sum = sum + c(octave.amplitude) * noise(octave).abs();
                }
            }
            Combination::Ridged { offset, sharpness } => {
                let mut weight = R::one();
                for octave in octaves {
                    let signal = (c(offset) - noise(octave).abs()).square() * weight;
                    sum = sum + c(octave.amplitude) * signal;
                    weight = (c(sharpness) * signal).clamp01();
                }
            }
            Combination::Multifractal { offset } => {
                sum = c(first.amplitude);
                for octave in octaves {
                    sum = sum * (c(offset) + c(octave.amplitude / first.amplitude) * noise(octave));
                }
            }
            Combination::Hybrid { offset } => {
                let mut weight = R::one();
                for octave in octaves {
                    let signal = c(octave.amplitude / first.amplitude) * (noise(octave) + c(offset));
                    sum = sum + c(first.amplitude) * (weight * signal);
                    weight = weight.min(R::one()) * signal;
                }
            }
        }
        sum
    }

    /// Elevation at `x`, metres from the origin the octaves were placed for: gradient noise in the plane.
    #[inline(always)]
    pub fn plane<R: NoiseValue>(&self, octaves: &[Octave<2>], x: [R; 2]) -> R {
        self.combine(
            octaves,
            #[inline(always)]
            |octave| R::gradient2(octave.lattice, octave.coordinates(x)),
        )
    }
    /// Value at `x`, metres from the origin the octaves were placed for: gradient noise in space.
    #[inline(always)]
    pub fn space<R: NoiseValue>(&self, octaves: &[Octave<3>], x: [R; 3]) -> R {
        self.combine(
            octaves,
            #[inline(always)]
            |octave| R::gradient3(octave.lattice, octave.coordinates(x)),
        )
    }

    /// Range and slope bound of [`Combination::plane`]: every value and every slope in every direction lies within.
    ///
    /// Each octave contributes |η| ≤ sup|n| and a slope of frequency · λη (the chain rule; the printed λη/s is wrong,
    /// claims G5); the rules of sum, product and clamp follow from the combination itself, computed on a dual of
    /// intervals along one arbitrary direction (claims G6). The constants exceed the true suprema by more than
    /// evaluation in `f64` can round.
    pub fn plane_bounds(&self, octaves: &Octaves) -> Bounds {
        self.bounds(octaves, GRADIENT2_RANGE, GRADIENT2_SLOPE)
    }
    /// Range and slope bound of [`Combination::space`].
    pub fn space_bounds(&self, octaves: &Octaves) -> Bounds {
        self.bounds(octaves, GRADIENT3_RANGE, GRADIENT3_SLOPE)
    }
    /// Range and slope bound of [`Combination::plane`] on these octaves, wherever they are placed.
    pub fn placed_bounds(&self, octaves: &[Octave<2>]) -> Bounds {
        self.combined_bounds(octaves, GRADIENT2_RANGE, GRADIENT2_SLOPE)
    }
    /// Range and slope bound for octaves of any noise with |η| ≤ `range`, ‖∇η‖ ≤ `slope`.
    pub fn bounds(&self, octaves: &Octaves, range: f64, slope: f64) -> Bounds {
        self.combined_bounds(&octaves.place(0, [0.0; 2]), range, slope)
    }
    fn combined_bounds(&self, octaves: &[Octave<2>], range: f64, slope: f64) -> Bounds {
        let whole = self.combine(octaves, |octave| Dual::<Interval, 1> {
            value: Interval::symmetric(range),
            slope: [Interval::point(octave.frequency) * Interval::symmetric(slope)],
        });
        Bounds { range: whole.value, slope: whole.slope[0].magnitude() }
    }
}

/// What values and slopes a noise can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Encloses every value, metres.
    pub range: Interval,
    /// At least every slope, metres per metre.
    pub slope: f64,
}

/// Fractional Brownian motion Σ aₖ ηₖ of gradient noise in the plane.
#[inline(always)]
pub fn fbm<R: NoiseValue>(octaves: &[Octave<2>], x: [R; 2]) -> R {
    Combination::Sum.plane(octaves, x)
}
/// Turbulence Σ aₖ |ηₖ| of gradient noise in the plane.
#[inline(always)]
pub fn turbulence<R: NoiseValue>(octaves: &[Octave<2>], x: [R; 2]) -> R {
    Combination::Turbulence.plane(octaves, x)
}
/// Ridged multifractal of gradient noise in the plane: [`Combination::Ridged`].
#[inline(always)]
pub fn ridged<R: NoiseValue>(octaves: &[Octave<2>], offset: f64, sharpness: f64, x: [R; 2]) -> R {
    Combination::Ridged { offset, sharpness }.plane(octaves, x)
}
/// Multiplicative multifractal of gradient noise in the plane: [`Combination::Multifractal`].
#[inline(always)]
pub fn multifractal<R: NoiseValue>(octaves: &[Octave<2>], offset: f64, x: [R; 2]) -> R {
    Combination::Multifractal { offset }.plane(octaves, x)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OCTAVES: Octaves = Octaves { octaves: 6, frequency: 0.01, lacunarity: 2.0, gain: 0.5, amplitude: 80.0 };

    #[test]
    fn a_sum_is_as_steep_as_its_frequencies_times_amplitudes() {
        // Σ aₖ fₖ = 6 · 0.8 for gain 1/2 and lacunarity 2; the printed Σ aₖ/fₖ would differ by far (claims G5).
        let bounds = Combination::Sum.plane_bounds(&OCTAVES);
        let expected = 4.8 * GRADIENT2_SLOPE;
        assert!(bounds.slope >= expected && bounds.slope < expected * (1.0 + 1e-12), "{bounds:?}");
        let turbulence = Combination::Turbulence.plane_bounds(&OCTAVES);
        assert!(turbulence.slope <= bounds.slope * (1.0 + 1e-12) && turbulence.range.lo() > -1e-9);
    }

    #[test]
    fn products_of_octaves_exceed_the_sum_rule() {
        let ridged = Combination::Ridged { offset: 1.0, sharpness: 2.0 }.plane_bounds(&OCTAVES);
        assert!(ridged.slope > 2.0 * Combination::Sum.plane_bounds(&OCTAVES).slope);
        assert!(ridged.slope.is_finite() && ridged.range.lo() > -1e-9);
    }

    #[test]
    fn a_tile_meets_the_same_noise_as_the_world() {
        let world = OCTAVES.place(5, [0.0, 0.0]);
        let origin = [-123_456.75, 98_765.5];
        let tile = OCTAVES.place(5, origin);
        for i in 0..200 {
            let x = [f64::from(i) * 1.37, f64::from(i * i % 97)];
            let far = fbm(&world, [origin[0] + x[0], origin[1] + x[1]]);
            // Coordinates of 4e4 cells carry 7e-12 of rounding, times a slope of 10 · 80 m at most.
            assert!((fbm(&tile, x) - far).abs() < 1e-7);
            let single = f64::from(fbm(&tile, x.map(|v| v as f32)));
            assert!((single - far).abs() < 0.05, "{single} {far}");
        }
        assert!((fbm(&tile, [10.0, 10.0]) - fbm(&OCTAVES.place(6, origin), [10.0, 10.0])).abs() > 1e-3);
    }

    #[test]
    fn no_octaves_are_flat() {
        let none = Octaves { octaves: 0, ..OCTAVES };
        assert_eq!(fbm(&none.place(1, [0.0; 2]), [3.0, 4.0]), 0.0);
        assert_eq!(Combination::Sum.plane_bounds(&none).range, Interval::ZERO);
    }
}
