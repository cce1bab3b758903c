//! What the experiments look at: a real elevation model and a rough synthetic one, with detail, from random cameras near the ground.

use crate::experiment::ExperimentError;
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::triangle::{SIDE, Vertex};
use terrain_gpu::tessellate::view::View;
use terrain_model::grid::Grid;
use terrain_model::io::geotiff;
use terrain_model::noise::{Octaves, mix};

/// The shipped elevation model.
pub const JACKSBORO: &[u8] = include_bytes!("../../data/jacksboro/jacksboro.tif");

/// A ground, its detail, and a name for tables.
pub struct Place {
    pub name: &'static str,
    pub ground: Ground,
    pub detail: Detail,
}

/// Jacksboro, and random steps of up to 60 m every 30 m.
pub fn places() -> Result<[Place; 2], ExperimentError> {
    let real = geotiff::read_from(JACKSBORO, "jacksboro.tif").map_err(ExperimentError::failed)?;
    let values = real.values().iter().map(|z| f64::from(*z)).collect();
    let real = real.with_values(values, None).map_err(ExperimentError::failed)?;
    let steps = (0..130 * 100).map(|at| f64::from(mix(7, at) >> 24) * 60.0 / 255.0).collect();
    let steps = Grid::new([0.0; 2].into(), [30.0; 2].into(), 130, 100, steps).map_err(ExperimentError::failed)?;
    Ok([place("Jacksboro", &real)?, place("random steps", &steps)?])
}

fn place(name: &'static str, grid: &Grid<f64>) -> Result<Place, ExperimentError> {
    let ground = Ground::new(grid, 0.6).map_err(ExperimentError::failed)?;
    let frequency = 0.5 / grid.spacing().x;
    let octaves = Octaves { octaves: 6, frequency, lacunarity: 2.0, gain: 0.5, amplitude: 0.1 * grid.spacing().x };
    let mut detail =
        Detail::new(&octaves, 3, Space::Volume).ok_or_else(|| ExperimentError::failed("octaves are not sound"))?;
    detail.floor = [0.3, 1.0];
    Ok(Place { name, ground, detail })
}

/// Camera `k` of `seed`: anywhere, 2 to 400 m above the ground, in any direction, looking slightly down.
pub fn camera(place: &Place, seed: u64, k: u32) -> Result<View, ExperimentError> {
    let random = |use_of| f64::from(mix(mix(seed as u32, k), use_of)) / 4_294_967_296.0;
    let (p, _) = place.ground.smooth(vertex(place, [0, 1].map(random)));
    let eye = [p[0], p[1], p[2] + 2.0 + 398.0 * random(2) * random(3)];
    View::new(eye, [random(4) - 0.5, random(5) - 0.5, 0.6 * (random(6) - 0.8)], 935.0, [960.0, 540.0])
        .ok_or_else(|| ExperimentError::failed(format!("camera {k} looks straight down")))
}

/// Of the raster, by shares of its sides.
fn vertex(place: &Place, shares: [f64; 2]) -> Vertex {
    let far = place.ground.within([SIDE; 2]);
    [0, 1].map(|axis| (shares[axis] * f64::from(far[axis])) as u32)
}

/// Camera `k` of `seed` above the middle of the raster, looking down, so that ground fills its frame: it is at most a twentieth of the
/// raster's shorter side high and sees to four times its height at most.
pub fn above(place: &Place, seed: u64, k: u32) -> Result<View, ExperimentError> {
    let random = |use_of| f64::from(mix(mix(seed as u32, k), use_of)) / 4_294_967_296.0;
    let (p, _) = place.ground.smooth(vertex(place, [0, 1].map(|axis| 0.35 + 0.3 * random(axis))));
    let [width, height] = place.ground.extent();
    let eye = [p[0], p[1], p[2] + 20.0 + 0.05 * width.min(height) * random(2) * random(3)];
    View::new(eye, [0.5 * random(4) - 0.2, 0.5 * random(5) - 0.3, -1.0], 935.0, [960.0, 540.0])
        .ok_or_else(|| ExperimentError::failed(format!("camera {k} from above looks straight down")))
}
