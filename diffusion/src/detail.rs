//! The detail map N that is added to the diffused elevation (Hnaidi 2010 §4.3): octaves of a lattice noise S whose amplitude A and
//! roughness R are fields, N = A·Σₖ S(rᵏ·p / wavelength) / r^(k(1−R)), k = 0 … 3 and r = 2 in the paper.
//!
//! As printed |N| may reach A·Σₖ r^(−k(1−R)), 4·A at R = 1 (claims H7): A is not the amplitude. Here the sum is divided by that of the
//! weights, so that |N| ≤ A; [`Scaling::Printed`] keeps the formula. N is a function of position in metres: a finer raster sees
//! more of the same ground.

use crate::curve::{ConstraintPoint, Gradient, Noise};
use crate::raster::Domain;
use glam::DVec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use terrain_model::noise::hash::Keys;
use terrain_model::noise::{GRADIENT2_RANGE, Lattice, NoiseValue, mix};

/// The lattice noise S; |S| ≤ 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Bilinear interpolation of a hash of the cell's corners, as in §5.3. It has creases along lattice lines.
    #[default]
    Bilinear,
    /// Gradient noise, smooth, divided by its certified range.
    Gradient,
}

/// Whether octaves are divided by the sum of their weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scaling {
    /// |N| ≤ A.
    #[default]
    Normalised,
    /// |N| ≤ A·Σₖ r^(−k(1−R)).
    Printed,
}

/// Noise that follows from slopes where a curve gives slopes and no noise: the improvement that §6 of the paper names.
///
/// With s = |sin θ| of the steeper side, both values are flat + (steep − flat)·s: level ground gets the first value, a wall the second.
/// The sine rather than the tangent, since it stays within 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FromSlope {
    /// A of level ground and of a wall, metres.
    pub amplitude: [f64; 2],
    /// R of level ground and of a wall.
    pub roughness: [f64; 2],
}

impl FromSlope {
    /// The noise of ground with these slopes. A side that reaches nowhere does not count.
    pub fn noise(&self, gradient: &Gradient) -> Noise {
        let sides = [gradient.left, gradient.right].into_iter().filter(|side| side.extent > 0.0);
        let steepness = sides.map(|side| libm::sin(side.angle).abs()).fold(0.0, f64::max);
        let between = |[flat, steep]: [f64; 2]| flat + (steep - flat) * steepness;
        Noise { amplitude: between(self.amplitude), roughness: between(self.roughness) }
    }
    /// The constraint points of a curve with noise where they have slopes, or as they are if any of them has a noise.
    pub fn complete(&self, points: &[ConstraintPoint]) -> Vec<ConstraintPoint> {
        let authored = points.iter().any(|point| point.noise.is_some());
        let noise = |point: &ConstraintPoint| point.gradient.as_ref().map(|gradient| self.noise(gradient));
        points
            .iter()
            .map(|point| ConstraintPoint { noise: if authored { point.noise } else { noise(point) }, ..*point })
            .collect()
    }
    fn is_sound(&self) -> bool {
        let fits = |value: &f64, most: f64| (0.0..=most).contains(value);
        self.amplitude.iter().all(|a| fits(a, f64::MAX)) && self.roughness.iter().all(|r| fits(r, 1.0))
    }
}

/// Settings of the detail map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Detail {
    /// Selects one of 2³² noises.
    pub seed: u32,
    /// Distance of lattice points in the first octave, metres.
    pub wavelength: f64,
    /// n + 1 of the paper.
    pub octaves: u32,
    /// r: wavelength of an octave over that of the next.
    pub lacunarity: f64,
    /// S.
    pub basis: Basis,
    /// What A means.
    pub scaling: Scaling,
    /// Noise for curves that give slopes only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_slope: Option<FromSlope>,
}

impl Default for Detail {
    /// Four octaves from 100 m on, r = 2.
    fn default() -> Detail {
        Detail {
            seed: 0,
            wavelength: 100.0,
            octaves: 4,
            lacunarity: 2.0,
            basis: Basis::Bilinear,
            scaling: Scaling::Normalised,
            from_slope: None,
        }
    }
}

impl Detail {
    /// Says in one line what is wrong with the settings, if anything is.
    pub fn problem(&self) -> Option<&'static str> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.wavelength) {
            Some("the wavelength must be above 0 metres and finite")
        } else if !(1..=16).contains(&self.octaves) {
            Some("expected 1 to 16 octaves")
        } else if !(self.lacunarity >= 1.0 && self.lacunarity <= 16.0) {
            Some("the lacunarity must be from 1 to 16")
        } else if !self.from_slope.is_none_or(|from| from.is_sound()) {
            Some("noise from slopes must have amplitudes of 0 or more metres and roughnesses from 0 to 1")
        } else {
            None
        }
    }
    /// N at a position in metres, for A in metres and R.
    pub fn at(&self, position: DVec2, amplitude: f64, roughness: f64) -> f64 {
        let ratio = self.ratio(roughness);
        let (mut frequency, mut weight) = (1.0 / self.wavelength, 1.0);
        let (mut sum, mut weights) = (0.0, 0.0);
        for octave in 0..self.octaves {
            sum += weight * self.basis.at(mix(self.seed, octave), position * frequency);
            weights += weight;
            weight *= ratio;
            frequency *= self.lacunarity;
        }
        amplitude * if self.scaling == Scaling::Normalised { sum / weights } else { sum }
    }
    /// The least upper bound of |N| that holds for every S with |S| ≤ 1, for A = 1.
    pub fn range(&self, roughness: f64) -> f64 {
        let ratio = self.ratio(roughness);
        match self.scaling {
            Scaling::Normalised => 1.0,
            Scaling::Printed => (0..self.octaves).fold(0.0, |sum, _| 1.0 + ratio * sum),
        }
    }
    /// Weight of an octave over that of the one before: r^(R−1).
    fn ratio(&self, roughness: f64) -> f64 {
        libm::exp2((roughness - 1.0) * libm::log2(self.lacunarity))
    }
}

impl Basis {
    /// S of lattice `seed` at lattice coordinates. Every lattice is shifted by a fraction of a cell that its seed implies, lest the
    /// lattice points of all octaves coincide.
    fn at(self, seed: u32, p: DVec2) -> f64 {
        let shift = |axis: u32| f64::from(mix(seed, axis)) / 4_294_967_296.0;
        let p = p + DVec2::new(shift(0), shift(1));
        let (cell, t) = (p.floor(), p - p.floor());
        let cell = [cell.x as i64 as u32, cell.y as i64 as u32];
        let value = match self {
            Basis::Bilinear => {
                let corner = Keys::new(seed).cell2(cell).map(|hash| f64::from(hash) / 2_147_483_647.5 - 1.0);
                let south = corner[0] + (corner[1] - corner[0]) * t.x;
                let north = corner[2] + (corner[3] - corner[2]) * t.x;
                south + (north - south) * t.y
            }
            Basis::Gradient => {
                let lattice = Lattice { seed, base: cell.map(|index| index as i32) };
                f64::gradient2(lattice, [t.x, t.y]) / GRADIENT2_RANGE
            }
        };
        // Interpolation may round past its ends. With |S| ≤ 1 to the last bit |N| ≤ A is too: sums and quotients round monotonically.
        value.clamp(-1.0, 1.0)
    }
}

/// A noise at every node, row by row from the south: `noise(position, A, R)`, metres, of any kind, for instance [`Detail::at`].
///
/// # Panics
/// When `amplitude` or `roughness` is shorter than the domain has nodes.
pub fn detail(
    domain: &Domain,
    amplitude: &[f64],
    roughness: &[f64],
    noise: impl Fn(DVec2, f64, f64) -> f64 + Sync,
) -> Vec<f64> {
    let nodes = domain.width * domain.height;
    assert!(amplitude.len() >= nodes && roughness.len() >= nodes, "one amplitude and one roughness for every node");
    let node = |k: usize| {
        // Where there is no noise none is computed.
        let a = amplitude[k];
        if a == 0.0 { 0.0 } else { noise(domain.at(k % domain.width, k / domain.width), a, roughness[k]) }
    };
    (0..nodes).into_par_iter().map(node).collect()
}

#[cfg(test)]
#[path = "detail_tests.rs"]
mod tests;
