//! Which noises a node of a scene has.

pub(crate) use crate::turbulence::Turbulence;
use terrain_model::noise::hash::mix;

/// The noise seed of a node in a scene.
pub(crate) fn seed(scene: u32, node: u32) -> u32 {
    mix(scene, node)
}

/// Three independent channels of one node.
pub(crate) fn channels(wavelength: f64, octaves: u32, seed: u32) -> [Turbulence; 3] {
    std::array::from_fn(|k| Turbulence::new(wavelength, octaves, mix(seed, 0x666f_6c64 + k as u32)))
}

/// Lip(δ) of three channels of this amplitude: the Frobenius norm of the Jacobian bounds its operator norm.
pub(crate) fn fold_slope(amplitude: f64, noise: &[Turbulence; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|k| amplitude * noise[k].slope);
    (x * x + y * y + z * z).sqrt()
}
