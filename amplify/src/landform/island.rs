//! Floating islands (Paris 2019 §5.1, Fig. 21): what lies below one terrain and above another, the second being a terrain
//! turned upside down.

#[cfg(test)]
mod tests;

use super::parameter::{Check, ParameterError};
use crate::field::{Box3, Density};
use crate::geology::Geology;
use crate::implicit::heightfield::{HeightfieldError, Implicitisation};
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::surface::Distance;
use crate::implicit::volume::{Erosion, Volume};
use crate::turbulence::Turbulence;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use terrain_model::grid::Grid;
use terrain_model::noise::hash;

/// An island as it is written; what is left out has its default. Heights are over the plane of its rim.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Island {
    /// Its mean width, metres; 20 to 5000, by default 450. The paper's are 300 m to 600 m wide.
    pub width: f64,
    /// By how much chance moves the rim, as a share of the half width; 0 to 0.5, by default 0.25.
    pub rim: f64,
    /// Height of the middle, metres; 0 to 2000, by default 35.
    pub height: f64,
    /// Height of hills on top, metres; 0 to 1000, by default 20.
    pub hills: f64,
    /// Depth of the middle, metres; 1 to 5000, by default 200.
    pub depth: f64,
    /// By how much chance changes the depth, as a share of it; 0 to 0.9, by default 0.4.
    pub crags: f64,
    /// Of the largest hills and crags, metres; 1 to 5000, by default 120.
    pub wavelength: f64,
    /// Octaves of hills and crags; 1 to 12, by default 4.
    pub octaves: u32,
    /// Metres from sample to sample of the two rasters; 0.1 to 100 and at least 1/1000 of the width, by default 6.
    pub cell: f64,
    /// R of the two terrains, metres; 0.2 to 1000 and at most a quarter of the width, by default 10.
    pub radius: f64,
    /// Which distance to the two terrains; the vertical one, which takes half the memory, by default.
    pub distance: Distance,
    /// How much of the field the weakest rock loses, 2T being solid rock; 0 to 0.45, so that the inside stays rock, by
    /// default 0.3.
    pub strata: f64,
    /// By default 0.
    pub seed: u32,
}

impl Default for Island {
    fn default() -> Island {
        Island {
            width: 450.0,
            rim: 0.25,
            height: 35.0,
            hills: 20.0,
            depth: 200.0,
            crags: 0.4,
            wavelength: 120.0,
            octaves: 4,
            cell: 6.0,
            radius: 10.0,
            distance: Distance::Vertical,
            strata: 0.3,
            seed: 0,
        }
    }
}

/// Two terrains that bound nothing, or an island that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IslandError {
    /// A parameter out of its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The upper terrain.
    #[error("the upper terrain: {0}")]
    Top(HeightfieldError),
    /// The lower terrain.
    #[error("the lower terrain: {0}")]
    Bottom(HeightfieldError),
    /// Terrains of different rectangles.
    #[error("the upper terrain covers {top:?}, the lower {bottom:?}: expected the same rectangle, crop one")]
    Frames {
        /// Corners of the upper, metres.
        top: [DVec2; 2],
        /// Corners of the lower, metres.
        bottom: [DVec2; 2],
    },
}

/// What lies below `top` and above `bottom`, two rasters over one rectangle, with falloffs of `radius` metres of a
/// `distance`: the intersection min(f, f̄) of a terrain and an inverted one. σ is odd about T, so the inverted field f̄ is 2T
/// less the field of `bottom`, and the intersection is the node that carves the rock below `bottom` away. Its prism ends 2R
/// below all of both.
///
/// # Errors
/// An [`IslandError`] names the terrain and what is wrong with it.
pub fn between(top: &Grid<f32>, bottom: &Grid<f32>, distance: Distance, radius: f64) -> Result<Volume, IslandError> {
    let frame = |grid: &Grid<f32>| <[DVec2; 2]>::from(grid.bounds());
    if frame(top) != frame(bottom) {
        return Err(IslandError::Frames { top: frame(top), bottom: frame(bottom) });
    }
    let under = Implicitisation { distance, ..Implicitisation::of(bottom, radius) };
    let Volume::Ground(inverted, _) = under.volume(bottom).map_err(IslandError::Bottom)? else {
        unreachable!("a heightfield is a ground")
    };
    let over = Implicitisation::of(top, radius);
    let over = Implicitisation { floor: over.floor.min(under.floor), distance, ..over };
    Ok(over.volume(top).map_err(IslandError::Top)?.carve(Volume::Surface(inverted)))
}

/// The noises of one island.
struct Noises {
    rim: Turbulence,
    hills: Turbulence,
    crags: Turbulence,
}

impl Island {
    /// Are the parameters in their ranges?
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("island");
        check.within("width", self.width, [20.0, 5000.0], "m")?;
        check.within("rim", self.rim, [0.0, 0.5], "half widths")?;
        check.within("height", self.height, [0.0, 2000.0], "m")?;
        check.within("hills", self.hills, [0.0, 1000.0], "m")?;
        check.within("depth", self.depth, [1.0, 5000.0], "m")?;
        check.within("crags", self.crags, [0.0, 0.9], "of the depth")?;
        check.within("wavelength", self.wavelength, [1.0, 5000.0], "m")?;
        check.within("octaves", f64::from(self.octaves), [1.0, 12.0], "octaves")?;
        check.within("cell", self.cell, [(1e-3 * self.width).max(0.1), 100.0], "m")?;
        check.within("radius", self.radius, [0.2, (0.25 * self.width).min(1000.0)], "m")?;
        check.within("strata", self.strata, [0.0, 0.45], "of the field")
    }

    fn noises(&self) -> Noises {
        let noise = |wavelength, k| Turbulence::new(wavelength, self.octaves, hash::mix(self.seed, k));
        Noises { rim: noise(0.5 * self.width, 1), hills: noise(self.wavelength, 2), crags: noise(self.wavelength, 3) }
    }

    /// How far rock may reach from the middle, metres: r ≥ w/(2(1 − rim)) is off the rim whatever the noise.
    fn reach(&self) -> f64 {
        0.5 * self.width / (1.0 - self.rim)
    }

    /// Elevations of bottom and top at `p` from the middle, metres over the rim. With u the distance from the middle in
    /// distances of the rim, the top is (height + hills)(1 − u²) and the bottom −depth(1 − u); off the rim, where u > 1, the
    /// bottom is above the top.
    fn elevations(&self, noises: &Noises, p: DVec2) -> [f64; 2] {
        let at = [p.x, p.y, 0.0];
        let u = p.length() / (0.5 * self.width) * (1.0 + self.rim * noises.rim.signed(at));
        if u >= 1.0 {
            // Both end 2R from the plane of the rim: far enough for the fields of both to fade.
            let off = ((u - 1.0) * 0.5 * self.width).min(2.0 * self.radius);
            return [off, -off];
        }
        let hills = 0.5 * self.hills * (1.0 + noises.hills.signed(at));
        let depth = self.depth * (1.0 + self.crags * noises.crags.signed(at));
        [-depth * (1.0 - u), (self.height + hills) * (1.0 - u * u)]
    }

    /// The rasters of bottom and top, the middle of the rim being at `at`, metres, within ±10⁷.
    ///
    /// # Errors
    /// An [`IslandError`] names what is out of range.
    pub fn rasters(&self, at: DVec3) -> Result<[Grid<f32>; 2], IslandError> {
        self.check()?;
        Check("island").place("at", at)?;
        // The prism keeps R from the edge of the rasters, and its own falloff is as wide.
        let steps = ((self.reach() + 2.0 * self.radius) / self.cell).ceil();
        let side = 2 * steps as usize + 1;
        let noises = self.noises();
        let (mut bottom, mut top) = (Vec::with_capacity(side * side), Vec::with_capacity(side * side));
        for j in 0..side {
            for i in 0..side {
                let p = (DVec2::new(i as f64, j as f64) - steps) * self.cell;
                let [low, high] = self.elevations(&noises, p);
                bottom.push((at.z + low) as f32);
                top.push((at.z + high) as f32);
            }
        }
        let origin = at.truncate() - steps * self.cell;
        let grid = |values| {
            Grid::new(origin, DVec2::splat(self.cell), side, side, values).expect("a square of positive cells")
        };
        Ok([grid(bottom), grid(top)])
    }

    /// The box that holds all rock of the island at `at`.
    pub fn extent(&self, at: DVec3) -> Box3 {
        // Noise is within [−1, 1]; a sample rounds to `f32`, whose last place is below 1 m up to 10⁷ m.
        let low = DVec3::new(-self.reach(), -self.reach(), -self.depth * (1.0 + self.crags));
        let high = DVec3::new(self.reach(), self.reach(), self.height + self.hills);
        let slack = 2.0 * self.cell * DVec3::new(1.0, 1.0, 0.0) + DVec3::Z;
        Box3 { low: at + low - slack, high: at + high + slack }
    }

    /// The island with the middle of its rim at `at`, metres; where there is a geology, its weak strata are worn back
    /// (§6, the erosion node). Blend it with what grows or is carved there; islands that do not meet are blended with one
    /// another.
    ///
    /// # Errors
    /// An [`IslandError`] names what is out of range.
    pub fn volume(&self, at: DVec3, geology: Option<Arc<Geology>>) -> Result<Volume, IslandError> {
        let [bottom, top] = self.rasters(at)?;
        let bare = between(&top, &bottom, self.distance, self.radius)?;
        let Some(geology) = geology.filter(|_| self.strata > 0.0) else { return Ok(bare) };
        let all = bare.support().meet(&self.extent(at));
        let (centre, half) = ((all.low + all.high) * 0.5, (all.high - all.low) * 0.5);
        let [centre, half] = [centre, half].map(|v| v.as_vec3().to_array());
        let (radius, energy) = (self.radius as f32, self.strata as f32);
        let region = Volume::Few([Primitive { skeleton: Skeleton::Cuboid { centre, half }, radius, energy }].into());
        Ok(Volume::Erosion(Arc::new(Erosion { child: bare, region, geology })))
    }
}
