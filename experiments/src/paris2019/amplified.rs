//! The scenes of the paper's Table 1: grounds of its sizes, recipes of its landforms, lattices of its cells. The cave of Fig. 25
//! is drawn by hand.

use super::{benagil, landscapes};
use crate::experiment::ExperimentError;
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;
use terrain_amplify::geology::{Archetype, Geology};
use terrain_amplify::implicit::index::Index;
use terrain_amplify::implicit::volume::Volume;
use terrain_amplify::polygonize::Lattice;
use terrain_amplify::recipe::{Amplified, Pantry, Recipe, amplify};
use terrain_model::grid::Grid;
use terrain_model::scene::CameraPlacement;

/// A scene as it is described.
pub struct Description {
    /// Its name in metrics.
    pub name: &'static str,
    /// Its figure, and what is seen.
    pub caption: &'static str,
    /// Metres between the samples of its ground.
    spacing: f64,
    ground: fn(f64, u32) -> Result<Grid<f32>, ExperimentError>,
    recipe: &'static str,
    /// Cubes along x, y and z, as in the paper.
    cells: [usize; 3],
    /// From and to, and the angle of the picture in radians.
    camera: ([f64; 3], [f64; 3], f64),
}

/// Those that a recipe makes.
pub const DESCRIPTIONS: [Description; 4] = [
    Description {
        name: "sea",
        caption: "Fig. 11: cliffs of a coast of 6 km, undercut by three steps of the sea",
        spacing: 3.0,
        ground: landscapes::coast,
        recipe: include_str!("recipes/sea.ron"),
        cells: [2000, 2000, 33],
        camera: ([2_480.0, 2_000.0, 120.0], [2_900.0, 2_800.0, 0.0], 0.45),
    },
    Description {
        name: "karst",
        caption: "Fig. 17: a limestone plateau of 5.2 km, its caves open in the cliffs",
        spacing: 4.0,
        ground: landscapes::plateau,
        recipe: include_str!("recipes/karst.ron"),
        cells: [1520, 1520, 447],
        camera: ([2_350.0, 1_350.0, 1_000.0], [2_650.0, 2_500.0, 620.0], 0.5),
    },
    Description {
        name: "canyon",
        caption: "Fig. 15: a winding slot of 1.1 km, overhangs where the walls are soft",
        spacing: 1.0,
        ground: landscapes::canyon,
        recipe: include_str!("recipes/canyon.ron"),
        cells: [1000, 1000, 546],
        camera: ([520.0, -150.0, 640.0], [560.0, 420.0, 160.0], 0.7),
    },
    Description {
        name: "hoodoo",
        caption: "Fig. 19: hoodoos below a rim of 350 m",
        spacing: 0.5,
        ground: landscapes::badlands,
        recipe: include_str!("recipes/hoodoo.ron"),
        cells: [650, 650, 245],
        camera: ([150.0, 60.0, 75.0], [180.0, 220.0, 40.0], 0.6),
    },
];

/// A scene ready to be meshed.
pub struct Scene {
    /// Its name in metrics.
    pub name: &'static str,
    /// Its figure, and what is seen.
    pub caption: &'static str,
    /// The field.
    pub volume: Volume,
    /// Its primitives.
    pub index: Arc<Index>,
    /// The rock.
    pub geology: Geology,
    /// The paper's cubes.
    pub lattice: Lattice,
    /// Where the picture is drawn from.
    pub camera: CameraPlacement,
    /// What the landforms took, without the ground; `None` of what is drawn by hand.
    pub generation_seconds: Option<f64>,
    /// a, the share of the lattice's columns that a primitive covers.
    pub coverage: f64,
}

/// The geologies beside the recipes.
struct Shelf;

impl Pantry for Shelf {
    fn raster(&mut self, name: &str) -> Result<Grid<f32>, String> {
        Err(format!("no raster {name}"))
    }
    fn text(&mut self, name: &str) -> Result<String, String> {
        let known = [
            ("coast", include_str!("recipes/coast.ron")),
            ("limestone", include_str!("recipes/limestone.ron")),
            ("sandstone_walls", include_str!("recipes/sandstone_walls.ron")),
            ("badlands", include_str!("recipes/badlands.ron")),
        ];
        let found = known.iter().find(|(key, _)| *key == name);
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| format!("no geology {name}"))
    }
}

impl Description {
    /// Its ground, coarser by `coarser`.
    pub fn ground(&self, coarser: f64, seed: u32) -> Result<Grid<f32>, ExperimentError> {
        (self.ground)(self.spacing * coarser, seed)
    }
    /// The landforms on `grid`.
    pub fn amplify(&self, grid: &Grid<f32>, seed: u32) -> Result<Amplified, ExperimentError> {
        let recipe = Recipe::parse(self.recipe).map_err(ExperimentError::failed)?;
        amplify(grid, &recipe, &mut Shelf, seed, |_, _| ()).map_err(ExperimentError::failed)
    }
    /// The scene at the paper's size.
    pub fn scene(&self, seed: u32) -> Result<Scene, ExperimentError> {
        let grid = self.ground(1.0, seed)?;
        let start = Instant::now();
        let amplified = self.amplify(&grid, seed)?;
        let seconds = start.elapsed().as_secs_f64();
        let (low, high) = grid.bounds();
        let cell = (high.x - low.x) / self.cells[0] as f64;
        let lowest = grid.values().iter().copied().fold(f32::INFINITY, f32::min);
        // Two cubes of rock below the lowest sample; what is above the highest must fit.
        let origin = low.extend(f64::from(lowest) - 3.0 * cell);
        let top = amplified.support().high.z;
        if origin.z + cell * (self.cells[2] as f64 - 1.0) < top {
            let room = cell * self.cells[2] as f64;
            return Err(ExperimentError::failed(format!("{}: {top} m is above the lattice of {room} m", self.name)));
        }
        let lattice = Lattice::new(origin, cell, self.cells).map_err(ExperimentError::failed)?;
        let (eye, target, field_of_view) = self.camera;
        Ok(Scene {
            name: self.name,
            caption: self.caption,
            coverage: amplified.coverage(&grid, cell),
            volume: amplified.volume,
            index: amplified.index,
            geology: amplified.geology,
            lattice,
            camera: CameraPlacement { eye: DVec3::from_array(eye), target: DVec3::from_array(target), field_of_view },
            generation_seconds: Some(seconds),
        })
    }
}

/// The cave of Fig. 25.
pub fn cave() -> Result<Scene, ExperimentError> {
    let volume = benagil::volume()?;
    let lattice = benagil::lattice()?;
    let Volume::Blend(parts) = &volume else { return Err(ExperimentError::failed("the cave is a blend")) };
    let Some(Volume::Primitives(index)) = parts.last() else { return Err(ExperimentError::failed("of an index")) };
    let index = index.clone();
    let coverage = terrain_amplify::recipe::coverage(
        &index,
        [lattice.corner([0; 3]), lattice.corner(lattice.cells())].map(DVec3::truncate),
        lattice.spacing(),
    );
    Ok(Scene {
        name: "benagil",
        caption: "Fig. 25: a sea cave with a hole in its roof, drawn by hand",
        index,
        coverage,
        lattice,
        geology: Archetype::HorizontalStrata.geology(),
        camera: CameraPlacement {
            eye: DVec3::new(150.0, 40.0, 62.0),
            target: DVec3::new(205.0, 222.0, 2.0),
            field_of_view: 0.8,
        },
        generation_seconds: None,
        volume,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recipe is read, makes the same on one thread and on two, and something else from another seed.
    fn same_by_threads_and_other_by_seed(name: &str) {
        let description = DESCRIPTIONS.iter().find(|description| description.name == name).unwrap();
        let grid = description.ground(8.0, 7).unwrap();
        let made = |threads: usize, seed: u32| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| description.amplify(&grid, seed).unwrap().index.primitives().to_vec())
        };
        let one = made(1, 3);
        assert!(one.len() > 100, "{name}: {}", one.len());
        assert!(one == made(2, 3), "{name} differs by threads");
        assert!(one != made(2, 4), "{name} is the same from another seed");
    }

    #[test]
    fn the_sea_is_the_same_on_any_number_of_threads() {
        same_by_threads_and_other_by_seed("sea");
    }

    #[test]
    fn the_karst_is_the_same_on_any_number_of_threads() {
        same_by_threads_and_other_by_seed("karst");
    }

    #[test]
    fn the_canyon_is_the_same_on_any_number_of_threads() {
        same_by_threads_and_other_by_seed("canyon");
    }

    #[test]
    fn hoodoos_are_the_same_on_any_number_of_threads() {
        same_by_threads_and_other_by_seed("hoodoo");
    }
}
