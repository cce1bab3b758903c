//! The layers of a scene, compiled: the ground, and what lies on it.

use terrain_model::program::Program;
use terrain_model::scene::{Scene, SceneError};
use terrain_model::trace::Surface;
use terrain_model::trace::shade::Landscape;

/// The programs of a scene's layers. Water, sand and vegetation are layers of these names.
#[derive(Clone, Debug)]
pub struct Layers {
    /// The terrain.
    pub ground: Program,
    /// Surface of water.
    pub water: Option<Program>,
    /// Density of sand.
    pub sand: Option<Program>,
    /// Density of plants.
    pub vegetation: Option<Program>,
}

impl Layers {
    /// Compiles a scene, with `ground` as its ground.
    ///
    /// # Errors
    /// A node that cannot be compiled, with its path.
    pub fn of(scene: &Scene, ground: Program) -> Result<Layers, SceneError> {
        let layer = |name: &str| {
            let there = scene.layers.contains_key(name) && scene.ground() != name;
            there.then(|| scene.program(name)).transpose()
        };
        Ok(Layers { ground, water: layer("water")?, sand: layer("sand")?, vegetation: layer("vegetation")? })
    }
    /// The landscape to be drawn.
    pub fn landscape(&self) -> Landscape<'_> {
        Landscape {
            ground: Surface::new(&self.ground),
            water: self.water.as_ref().map(Surface::new),
            sand: self.sand.as_ref(),
            vegetation: self.vegetation.as_ref(),
        }
    }
}
