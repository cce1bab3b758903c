//! Sea cliffs (Paris 2019 §6.1, Fig. 13): the stress of waves falls off with the elevation above or below the level of the
//! sea and is the larger the more open the coast.

use super::parameter::{Check, ParameterError};
use super::raster::bilinear;
use super::shallow::Shallow;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::falloff::wyvill;
use terrain_model::grid::Grid;

/// How the sea erodes a coast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sea {
    /// Elevation of the sea, metres; −10⁵ to 10⁵.
    pub level: f64,
    /// Waves act so far above and below the level, metres; 0.01 to 10⁴. The paper's is 8 m.
    pub reach: f64,
    /// The largest ball that tells open from sheltered, metres; 0.01 to 10⁵: where it fits, the coast is fully open.
    pub openness: f64,
    /// The spheres.
    pub erosion: Shallow,
}

impl Default for Sea {
    fn default() -> Sea {
        Sea { level: 0.0, reach: 8.0, openness: 40.0, erosion: Shallow { steps: 3, ..Shallow::default() } }
    }
}

impl Sea {
    /// # Errors
    /// The first parameter out of its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("sea");
        check.within("level", self.level, [-1e5, 1e5], "m")?;
        check.within("reach", self.reach, [0.01, 1e4], "m")?;
        check.within("openness", self.openness, [0.01, 1e5], "m")?;
        self.erosion.check("sea")
    }
    /// w, 1 at the level of the sea and 0 from `reach` on, smoothly.
    pub fn falloff(&self, elevation: f64) -> f64 {
        let t = (elevation - self.level) / self.reach;
        wyvill(t * t)
    }
    /// σ = w·α at `p`, with α in [0, 1] from a raster of accessibility.
    pub fn stress(&self, accessibility: &Grid<f32>, p: DVec3) -> f64 {
        let w = self.falloff(p.z);
        if w == 0.0 { 0.0 } else { w * bilinear(accessibility, p.truncate()).clamp(0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn stress_is_greatest_at_the_level_of_an_open_coast_and_ends_at_its_reach() {
        let open = Grid::new(DVec2::ZERO, DVec2::ONE, 2, 2, vec![0.0f32, 1.0, 0.0, 1.0]).unwrap();
        let sea = Sea { level: 3.0, ..Sea::default() };
        let at = |x: f64, z: f64| sea.stress(&open, DVec3::new(x, 0.5, z));
        assert_eq!((at(1.0, 3.0), at(0.5, 3.0), at(0.0, 3.0)), (1.0, 0.5, 0.0));
        assert_eq!((at(1.0, 11.0), at(1.0, -5.0)), (0.0, 0.0));
        assert!(at(1.0, 7.0) > 0.1 && at(1.0, 7.0) == at(1.0, -1.0));
    }

    #[test]
    fn parameters_have_ranges() {
        assert_eq!(Sea::default().check(), Ok(()));
        let wrong = Sea { erosion: Shallow { steps: 0, ..Shallow::default() }, ..Sea::default() };
        assert_eq!(wrong.check().unwrap_err().to_string(), "sea: steps is 0, expected 1 to 100 (no unit)");
    }
}
