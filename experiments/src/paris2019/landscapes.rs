//! Grounds of the size of the paper's scenes, made from a seed: the paper's own elevations are not public. Elevations in metres.

use crate::experiment::ExperimentError;
use glam::DVec2;
use rayon::prelude::*;
use terrain_model::grid::Grid;
use terrain_model::noise::fractal::{Octave, Octaves, fbm, ridged};

/// Octaves of amplitude 1, the first of `wavelength` metres, each half as long and `gain` as high as the one before.
struct Noise(Vec<Octave<2>>);

impl Noise {
    fn new(wavelength: f64, octaves: u32, gain: f64, seed: u32) -> Noise {
        let sequence = Octaves { octaves, frequency: 1.0 / wavelength, lacunarity: 2.0, gain, amplitude: 1.0 };
        Noise(sequence.place(seed, [0.0; 2]))
    }
    fn at(&self, p: [f64; 2]) -> f64 {
        fbm(&self.0, p)
    }
    /// In [0, 1], 1 on lines.
    fn ridge(&self, p: [f64; 2]) -> f64 {
        ridged(&self.0, 1.0, 2.0, p).clamp(0.0, 1.0)
    }
}

/// 0 below `a`, 1 above `b`, smooth between.
fn rise(a: f64, b: f64, x: f64) -> f64 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The elevations of `height` over a square of `side` metres, samples `spacing` apart.
fn raster(side: f64, spacing: f64, height: impl Fn([f64; 2]) -> f64 + Sync) -> Result<Grid<f32>, ExperimentError> {
    let samples = (side / spacing).round() as usize + 1;
    let at = |k: usize| [(k % samples) as f64 * spacing, (k / samples) as f64 * spacing];
    let values = (0..samples * samples).into_par_iter().map(|k| height(at(k)) as f32).collect();
    Grid::new(DVec2::ZERO, DVec2::splat(spacing), samples, samples, values).map_err(ExperimentError::failed)
}

/// A rugged coast of 6 km: headlands, bays and islets, cliffs about 60 m high, sea level 0 (Fig. 11).
pub fn coast(spacing: f64, seed: u32) -> Result<Grid<f32>, ExperimentError> {
    let line = Noise::new(2_400.0, 6, 0.55, seed);
    let land = Noise::new(900.0, 6, 0.45, seed ^ 1);
    let islets = Noise::new(420.0, 4, 0.5, seed ^ 2);
    let floor = Noise::new(300.0, 4, 0.5, seed ^ 3);
    raster(6_000.0, spacing, |p| {
        // About metres from the coast, positive inland.
        let inland = p[1] - 2_700.0 - 900.0 * line.at(p);
        let shore = (inland / 420.0).clamp(-4.0, 4.0);
        // Off the coast a few islets stand where their noise is high.
        let islet = 260.0 * (islets.at(p) - 0.42 - 0.10 * (shore + 1.0).abs());
        let inside = inland.max(islet);
        let cliff = rise(-8.0, 8.0, inside);
        let plateau = 44.0 + 16.0 * land.at(p) + 5.0 * rise(0.0, 900.0, inland);
        let sea = -16.0 + 3.0 * floor.at(p) + 4.0 * rise(-260.0, 0.0, inside);
        sea + (plateau - sea) * cliff
    })
}

/// A limestone plateau of 5.2 km that ends in cliffs above a valley (Fig. 17).
pub fn plateau(spacing: f64, seed: u32) -> Result<Grid<f32>, ExperimentError> {
    let edge = Noise::new(2_600.0, 6, 0.5, seed);
    let hills = Noise::new(700.0, 6, 0.45, seed ^ 1);
    let valley = Noise::new(1_500.0, 6, 0.5, seed ^ 2);
    let sinks = Noise::new(190.0, 2, 0.5, seed ^ 3);
    raster(5_200.0, spacing, |p| {
        let inland = p[1] - 2_300.0 - 1_000.0 * edge.at(p);
        // Two walls with a ledge between them.
        let wall = 0.6 * rise(-60.0, 60.0, inland) + 0.4 * rise(220.0, 310.0, inland);
        let low = 210.0 + 120.0 * valley.at(p) + 0.05 * p[1];
        let near = rise(322.0, 360.0, inland) * (1.0 - rise(520.0, 760.0, inland));
        let dip = rise(0.3, 0.6, sinks.at(p)) * near;
        let high = 1_060.0 + 90.0 * hills.at(p) - 38.0 * dip;
        low + (high - low) * wall
    })
}

/// A winding slot of 1.1 km in sandstone, walls up to 400 m high (Fig. 15).
pub fn canyon(spacing: f64, seed: u32) -> Result<Grid<f32>, ExperimentError> {
    let bend = Noise::new(520.0, 5, 0.5, seed);
    let side = Noise::new(360.0, 5, 0.5, seed ^ 1);
    let rock = Noise::new(160.0, 6, 0.5, seed ^ 2);
    raster(1_100.0, spacing, |p| {
        let along = p[1];
        let middle = 550.0 + 150.0 * libm::sin(along / 170.0) + 90.0 * bend.at([0.0, along]);
        let off = (p[0] - middle).abs() + 26.0 * rock.at(p);
        // Side valleys come down where the noise's ridges reach the river.
        let gully = 60.0 * side.ridge(p) * rise(500.0, 60.0, off);
        let out = off - gully;
        let walls = 0.36 * rise(10.0, 26.0, out) + 0.34 * rise(52.0, 74.0, out) + 0.30 * rise(120.0, 165.0, out);
        let bed = 60.0 + 0.12 * along + 1.5 * rock.at(p);
        bed + walls * 340.0 + 14.0 * rock.at(p) * rise(20.0, 200.0, out) + 0.04 * out.max(0.0)
    })
}

/// Broken land of 350 m below a rim (Fig. 19).
pub fn badlands(spacing: f64, seed: u32) -> Result<Grid<f32>, ExperimentError> {
    let edge = Noise::new(190.0, 5, 0.5, seed);
    let gullies = Noise::new(70.0, 5, 0.5, seed ^ 1);
    raster(350.0, spacing, |p| {
        let inland = p[1] - 235.0 - 60.0 * edge.at(p);
        let basin = 12.0 + 0.05 * p[1] + 9.0 * gullies.ridge(p);
        let rim = 78.0 + 4.0 * edge.at(p);
        basin + (rim - basin) * rise(-45.0, 40.0, inland)
    })
}

/// A bluff of 180 m with depressions on top (Fig. 24).
pub fn bluff() -> Result<Grid<f32>, ExperimentError> {
    let edge = Noise::new(80.0, 4, 0.5, 5);
    let dips = Noise::new(34.0, 2, 0.5, 6);
    raster(180.0, 1.0, |p| {
        let inland = p[1] - 70.0 - 24.0 * edge.at(p);
        let dip = 7.0 * rise(0.3, 0.6, dips.at(p)) * rise(12.0, 24.0, inland);
        2.0 * edge.at(p) + (34.0 + 3.0 * edge.at([p[1], p[0]]) - dip) * rise(-5.0, 5.0, inland)
    })
}

/// A cove of 180 m, sea level 0 (Fig. 1).
pub fn cove() -> Result<Grid<f32>, ExperimentError> {
    let edge = Noise::new(110.0, 5, 0.5, 9);
    raster(180.0, 1.0, |p| {
        let bay = 40.0 * libm::exp(-((p[0] - 110.0) / 34.0) * ((p[0] - 110.0) / 34.0));
        let inland = p[1] - 70.0 - bay - 26.0 * edge.at(p);
        let sea = -11.0 + 1.5 * edge.at([p[1], p[0]]);
        let land = 20.0 + 5.0 * edge.at([p[1], p[0]]) + 0.06 * inland.max(0.0);
        sea + (land - sea) * rise(-5.0, 5.0, inland)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_is_a_landscape_and_another_seed_another() {
        for make in [coast, plateau, canyon, badlands] {
            let of = |seed| make(25.0, seed).unwrap();
            assert_eq!(of(7), of(7));
            assert_ne!(of(7), of(8));
            assert!(of(7).values().iter().all(|h| h.is_finite() && h.abs() < 1_600.0));
        }
    }
}
