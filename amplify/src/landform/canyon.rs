//! River canyons and gorges (Paris 2019 §6.1, Fig. 15): the stress of a river is its stream power, spread to the banks that
//! floods reach.

use super::parameter::{Check, ParameterError};
use super::raster::bilinear;
use super::shallow::Shallow;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::grid::Grid;

/// How rivers erode the walls of their valleys.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Canyon {
    /// √A·s of a stress of 1, metres, from a drainage area A in m² and a slope s: a river of 10⁵ m² on a slope of 0.1 has
    /// 32 m; 10⁻³ to 10⁶.
    pub full_power: f64,
    /// Stress below which there is no river; 0 to 1.
    pub river: f64,
    /// How far floods reach beyond the bed, metres; 0 to 10⁴.
    pub banks: f64,
    /// The spheres.
    pub erosion: Shallow,
}

impl Default for Canyon {
    fn default() -> Canyon {
        Canyon { full_power: 30.0, river: 0.3, banks: 20.0, erosion: Shallow::default() }
    }
}
