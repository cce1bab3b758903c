//! Resistance of rock, ρ: R³ → [0, 1] with 0 the least resistant, as a tree of strata, rock planes, local changes, folds,
//! tapers and faults (Paris 2019 §4).
//!
//! ```
//! use terrain_amplify::geology::Geology;
//! let text = r#"(
//!     format: "terrain-geology/1",
//!     seed: 7,
//!     geology: fold(amplitude: 8, wavelength: 150, octaves: 1, seed: 2,
//!         child: strata(wavelength: 12, octaves: 3, seed: 1)),
//! )"#;
//! let geology = Geology::parse(text)?;
//! let rho = geology.value(glam::DVec3::new(10.0, 20.0, 30.0));
//! assert!((0.0..=1.0).contains(&rho));
//! # Ok::<(), terrain_amplify::geology::GeologyError>(())
//! ```

mod archetype;
mod compile;
mod node;
pub(crate) mod noise;
mod rock;
#[cfg(test)]
mod tests;

pub use archetype::{Archetype, archetype};
pub use node::{FORMAT, GeologyError, Local, Node};

use crate::field::{Box3, DensityBounds};
use glam::DVec3;
use rock::Rock;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::noise::NoiseValue;
use terrain_model::real::Real;

/// A checked tree ready to evaluate. Coordinates are metres, z up.
#[derive(Clone, Debug)]
pub struct Geology {
    seed: u32,
    node: Node,
    rock: Rock,
}

/// Covers the rounding of the few dozen operations behind a slope.
const ROUNDING: f64 = 1.0 + 1e-12;

impl Geology {
    /// Checks `node` and places its noises; a node's noise depends on `seed` and the node's own seed alone.
    ///
    /// # Errors
    /// [`GeologyError::Value`] with the place in the tree.
    pub fn new(seed: u32, node: Node) -> Result<Geology, GeologyError> {
        let rock = compile::compile(&node, seed, "geology")?;
        Ok(Geology { seed, node, rock })
    }
    /// The scene seed.
    pub fn seed(&self) -> u32 {
        self.seed
    }
    /// The tree.
    pub fn node(&self) -> &Node {
        &self.node
    }
    /// ρ at `p`: the one formula that values, gradients and enclosures share.
    pub fn resistance<R: NoiseValue>(&self, p: [R; 3]) -> R {
        self.rock.resistance(p, &mut false).clamp01()
    }
    /// ρ at `p`.
    pub fn value(&self, p: DVec3) -> f64 {
        self.resistance(p.to_array())
    }
    /// ρ and ∇ρ at `p`; on a crease or a fault, the gradient of one side.
    pub fn sample(&self, p: DVec3) -> (f64, DVec3) {
        let p = p.to_array();
        let rho = self.resistance(std::array::from_fn(|k| Dual::<f64, 3>::variable(p[k], k)));
        (rho.value, DVec3::from_array(rho.slope))
    }
    /// Encloses ρ and its slope over `region`.
    ///
    /// The slope is the smaller of the norm of the enclosed gradient and [`Geology::slope`]. On a box that meets both a
    /// fault's boundary and its open side it is infinite, and the range is the hull of both sides.
    pub fn bounds(&self, region: &Box3) -> DensityBounds {
        let sides = region.intervals();
        let mut torn = false;
        let rho = self.rock.resistance(std::array::from_fn(|k| Dual::<Interval, 3>::variable(sides[k], k)), &mut torn);
        let rho = rho.clamp01();
        let steepest = rho.slope.map(|s| s.magnitude());
        let local = DVec3::from_array(steepest).length() * ROUNDING;
        let local = if torn || local.is_nan() { f64::INFINITY } else { local };
        DensityBounds { range: rho.value.meet(Interval::UNIT), slope: local.min(self.slope()) }
    }
    /// A Lipschitz constant of ρ on all of space, 1/metre; infinite with a fault.
    pub fn slope(&self) -> f64 {
        self.rock.slope() * ROUNDING
    }
}
