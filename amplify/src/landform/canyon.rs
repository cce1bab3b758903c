//! River canyons and gorges (Paris 2019 §6.1, Fig. 15): the stress of a river is its stream power, spread to the banks that
//! floods reach.

use super::parameter::{Check, ParameterError};
use super::raster::{bilinear, shaped};
use super::shallow::Shallow;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::grid::Grid;

/// How rivers erode the walls of their valleys.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Canyon {
    /// √A·s of a stress of 1, metres, from a drainage area A in m² and the sine s of a slope: a river of 10⁵ m² on a slope of 0.1 has
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

impl Canyon {
    /// # Errors
    /// The first parameter out of its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("canyon");
        check.within("full_power", self.full_power, [1e-3, 1e6], "m")?;
        check.within("river", self.river, [0.0, 1.0], "(no unit)")?;
        check.within("banks", self.banks, [0.0, 1e4], "m")?;
        self.erosion.check("canyon")
    }
    /// σ of the bed: stream power over the full one, at most 1, and 0 where there is no river.
    pub fn bed(&self, stream_power: &Grid<f32>) -> Grid<f32> {
        let stress = |power: f32| {
            let sigma = (f64::from(power) / self.full_power).min(1.0);
            if sigma >= self.river { sigma as f32 } else { 0.0 }
        };
        shaped(stream_power, stream_power.values().iter().map(|&power| stress(power)).collect())
    }
    /// σ at `p`, with the map of the bed and its banks.
    pub fn stress(map: &Grid<f32>, p: DVec3) -> f64 {
        bilinear(map, p.truncate()).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn the_bed_is_where_the_river_is_strong_and_its_stress_ends_at_1() {
        let canyon = Canyon { full_power: 20.0, river: 0.25, ..Canyon::default() };
        let power = Grid::new(DVec2::ZERO, DVec2::ONE, 4, 1, vec![0.0f32, 4.9, 5.0, 300.0]).unwrap();
        assert_eq!(canyon.bed(&power).values(), [0.0, 0.0, 0.25, 1.0]);
        assert_eq!(Canyon::stress(&canyon.bed(&power), DVec3::new(2.5, 0.0, 99.0)), 0.625);
        assert_eq!(canyon.check(), Ok(()));
        let wrong = Canyon { river: 1.5, ..canyon }.check().unwrap_err();
        assert_eq!(wrong.to_string(), "canyon: river is 1.5, expected 0 to 1 (no unit)");
    }
}
