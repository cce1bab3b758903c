//! Sums and products of octaves of gradient noise in the plane: fractional Brownian motion, turbulence, ridged
//! multifractal and Musgrave's multifractal, with the range and slope that follow from those of one octave.

use super::{GRADIENT2_RANGE, GRADIENT2_SLOPE, Lattice, NoiseValue, hash};
use crate::interval::Interval;
use crate::real::Real;
use serde::{Deserialize, Serialize};

/// How octaves combine. ηₖ is octave k, aₖ = amplitude·gainᵏ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseKind {
    /// Σ aₖ·ηₖ (Génevaux 2015 §4.1).
    Fbm,
    /// Σ aₖ·|ηₖ|: rounded hills with creased valleys.
    Turbulence,
    /// Musgrave's ridged multifractal: Σ aₖ·wₖ·sₖ with sₖ = (1 − |ηₖ|/sup|η|)², w₀ = 1, wₖ = min(1, 2·sₖ₋₁·wₖ₋₁).
    Ridged,
    /// Musgrave's multifractal: amplitude·(Π (1 + gainᵏ·ηₖ/sup|η|) − 1).
    Multifractal,
}

/// The numbers behind the octaves, in the number type of the evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Shape<R> {
    /// Cycles per metre of the first octave.
    pub frequency: R,
    /// Frequency ratio of successive octaves.
    pub lacunarity: R,
    /// Metres of the first octave.
    pub amplitude: R,
    /// Amplitude ratio of successive octaves.
    pub gain: R,
    /// Number of octaves.
    pub octaves: u8,
    /// Selects the lattices.
    pub seed: u32,
}

/// Where a tile's origin stands in the lattice of one octave: whole cells, and the rest in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OctaveFrame<P> {
    /// Frequency of the octave, cycles per metre, as the tile rounds it.
    pub frequency: P,
    /// Whole cells.
    pub base: [i32; 2],
    /// The rest, in cells.
    pub offset: [P; 2],
}

/// The lattice seed of octave `k`.
#[inline(always)]
pub fn octave_seed(seed: u32, k: u8) -> u32 {
    hash::mix(seed, u32::from(k))
}

/// The noise at `x`, metres from its anchor (from the tile's origin when `frames` are given), in metres.
#[inline(always)]
pub fn evaluate<R: NoiseValue, P: Copy + Into<f64>>(kind: NoiseKind, shape: &Shape<R>, frames: &[OctaveFrame<P>], x: [R; 2]) -> R {
    let inverse_range = R::constant(1.0 / GRADIENT2_RANGE);
    let mut frequency = shape.frequency;
    let mut amplitude = if kind == NoiseKind::Multifractal { R::one() } else { shape.amplitude };
    let mut sum = if kind == NoiseKind::Multifractal { R::one() } else { R::zero() };
    let mut ridge = R::one();
    for k in 0..shape.octaves {
        let seed = octave_seed(shape.seed, k);
        let noise = match frames.get(usize::from(k)) {
            None => R::gradient2(Lattice { seed, base: [0, 0] }, [x[0] * frequency, x[1] * frequency]),
            Some(frame) => {
                let f = R::constant(frame.frequency.into());
                let at = |axis: usize| x[axis] * f + R::constant(frame.offset[axis].into());
                R::gradient2(Lattice { seed, base: frame.base }, [at(0), at(1)])
            }
        };
        match kind {
            NoiseKind::Fbm => sum = sum + amplitude * noise,
            NoiseKind::Turbulence => sum = sum + amplitude * noise.abs(),
            NoiseKind::Ridged => {
                let signal = (R::one() - noise.abs() * inverse_range).square() * ridge;
                sum = sum + amplitude * signal;
                ridge = (signal + signal).min(R::one());
            }
            NoiseKind::Multifractal => sum = sum * (R::one() + amplitude * (noise * inverse_range)),
        }
        frequency = frequency * shape.lacunarity;
        amplitude = amplitude * shape.gain;
    }
    if kind == NoiseKind::Multifractal { (sum - R::one()) * shape.amplitude } else { sum }
}

/// Range (metres) and slope bound of the noise everywhere, rounded outward.
///
/// Sums: Σ aₖ·sup|η| and Σ aₖ·fₖ·λ_η — frequencies multiply (claims G5). Where octaves multiply, the product rule runs
/// octave by octave (claims G6), with the partial products' own ranges and slopes.
pub fn bounds(kind: NoiseKind, shape: &Shape<f64>) -> (Interval, f64) {
    let point = Interval::point;
    let magnitude = point(GRADIENT2_RANGE);
    let mut frequency = point(shape.frequency);
    let mut amplitude = if kind == NoiseKind::Multifractal { point(1.0) } else { point(shape.amplitude) };
    let mut range = Interval::ZERO;
    let mut slope = Interval::ZERO;
    // Ridged: range and slope of the weight. Multifractal: of the partial product.
    let mut weight = point(1.0);
    let mut weight_slope = Interval::ZERO;
    for _ in 0..shape.octaves {
        let octave_slope = frequency * point(GRADIENT2_SLOPE);
        let size = Real::abs(amplitude);
        match kind {
            NoiseKind::Fbm => {
                range = range + amplitude * Interval::symmetric(GRADIENT2_RANGE);
                slope = slope + size * octave_slope;
            }
            NoiseKind::Turbulence => {
                range = range + amplitude * Interval::new(0.0, GRADIENT2_RANGE);
                slope = slope + size * octave_slope;
            }
            NoiseKind::Ridged => {
                // s = (1 − |η|/m)² lies in [0, 1] with slope 2·λ/m; the signal is s·w.
                let signal = Interval::UNIT * weight;
                let signal_slope = point(2.0) * octave_slope / magnitude * point(weight.hi()) + weight_slope;
                range = range + amplitude * signal;
                slope = slope + size * signal_slope;
                weight = Real::min(signal + signal, point(1.0));
                weight = Interval::new(weight.lo().max(0.0), weight.hi());
                weight_slope = point(2.0) * signal_slope;
            }
            NoiseKind::Multifractal => {
                let factor = point(1.0) + amplitude * Interval::symmetric(1.0);
                let factor_slope = size * octave_slope / magnitude;
                weight_slope = point(weight.magnitude()) * factor_slope + weight_slope * point(factor.magnitude());
                weight = weight * factor;
            }
        }
        frequency = frequency * point(shape.lacunarity);
        amplitude = amplitude * point(shape.gain);
    }
    if kind == NoiseKind::Multifractal {
        range = (weight - point(1.0)) * point(shape.amplitude);
        slope = weight_slope * Real::abs(point(shape.amplitude));
    }
    (range, slope.hi())
}
