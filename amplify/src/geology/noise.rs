//! Which noises a node of a scene has.

pub(super) use crate::turbulence::Turbulence;
use terrain_model::noise::hash::mix;

/// The noise seed of a node in a scene.
pub(super) fn seed(scene: u32, node: u32) -> u32 {
    mix(scene, node)
}

/// Three independent channels of one node.
pub(super) fn channels(wavelength: f64, octaves: u32, seed: u32) -> [Turbulence; 3] {
    std::array::from_fn(|k| Turbulence::new(wavelength, octaves, mix(seed, 0x666f_6c64 + k as u32)))
}
