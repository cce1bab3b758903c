//! A sea cave with a hole in its roof, in the manner of Paris 2019 Fig 25: a cliffed coast, and 551 strokes of 13,264
//! primitives recorded as data.

use crate::experiment::ExperimentError;
use glam::{DVec2, DVec3};
use terrain_amplify::brush::{self, Sculpture, Stroke};
use terrain_amplify::implicit::heightfield::Implicitisation;
use terrain_amplify::implicit::sigmoid::Sigmoid;
use terrain_amplify::implicit::surface::Distance;
use terrain_amplify::implicit::volume::Volume;
use terrain_amplify::polygonize::Lattice;
use terrain_model::grid::Grid;

const STROKES: &str = include_str!("data/benagil.ron");
/// Side of the ground, metres.
pub const SIDE: f64 = 400.0;
/// The paper's grid.
const CELLS: [usize; 3] = [550, 550, 87];
const SPACING: f64 = 2.0;

/// Elevation of the coast, metres: sea floor, a cliff 10 m wide, a plateau.
pub fn coast([x, y]: [f64; 2]) -> f64 {
    let line = 190.0 + 38.0 * libm::sin(x / 60.0) + 14.0 * libm::sin(x / 23.0 + 1.0);
    let t = ((y - line + 5.0) / 10.0).clamp(0.0, 1.0);
    let rise = t * t * (3.0 - 2.0 * t);
    let land = 24.0 + 3.0 * libm::sin(x / 37.0 + y / 51.0) + 1.5 * libm::cos(y / 19.0);
    let sea = -9.0 + 1.2 * libm::sin(x / 17.0) * libm::cos(y / 29.0);
    sea + (land - sea) * rise
}

/// The ground alone.
pub fn ground() -> Result<Volume, ExperimentError> {
    let samples = (SIDE / SPACING) as usize + 1;
    let position = |k: usize| SPACING * DVec2::new((k % samples) as f64, (k / samples) as f64);
    let values = (0..samples * samples).map(|k| coast(position(k).to_array()) as f32).collect();
    let grid =
        Grid::new(DVec2::ZERO, DVec2::splat(SPACING), samples, samples, values).map_err(ExperimentError::failed)?;
    let settings =
        Implicitisation { sigmoid: Sigmoid::UnitFree, distance: Distance::Normalised, radius: 3.0, floor: -22.0 };
    settings.volume(&grid).map_err(ExperimentError::failed)
}

/// The strokes, in the order in which they are drawn.
pub fn strokes() -> Result<Vec<Stroke>, ExperimentError> {
    brush::parse(STROKES).map_err(ExperimentError::failed)
}

/// The ground with all strokes drawn.
pub fn sculpture() -> Result<Sculpture, ExperimentError> {
    let mut sculpture = Sculpture::new(ground()?);
    for stroke in strokes()? {
        sculpture.draw(stroke).map_err(ExperimentError::failed)?;
    }
    Ok(sculpture)
}

/// The scene as it is opened: the primitives of all strokes in one index.
pub fn volume() -> Result<Volume, ExperimentError> {
    let mut all = Vec::new();
    for stroke in strokes()? {
        all.extend(stroke.primitives().map_err(ExperimentError::failed)?);
    }
    Volume::terrain(ground()?, all).map_err(|k| ExperimentError::failed(format!("primitive {k} is not sound")))
}

/// 550 × 550 × 87 cubes over it.
pub fn lattice() -> Result<Lattice, ExperimentError> {
    Lattice::new(DVec3::new(0.0, 0.0, -26.0), SIDE / 550.0, CELLS).map_err(ExperimentError::failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_record_has_the_papers_numbers() {
        let sculpture = sculpture().unwrap();
        assert_eq!((sculpture.strokes().len(), sculpture.primitives()), (551, 13_264));
    }
}
