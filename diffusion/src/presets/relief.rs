//! Landforms of rock: ridges, peaks, cliffs, hills, cracks, and noise alone.

use super::{Drawn, Hand, Slope, gradient, noise, one, through, uniform};
use crate::curve::{ConstraintPoint, Elevation, Noise};
use crate::landscape::Path;
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// Ridge line (Fig. 5 left): elevations along the crest, slopes to both sides.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ridge {
    /// Way-points with elevations.
    pub points: Vec<DVec3>,
    /// Half-width of the crest.
    #[serde(default)]
    pub radius: f64,
    /// To the left.
    pub left: Slope,
    /// To the right.
    pub right: Slope,
    /// Reach of the slopes at the last way-point over that at the first.
    #[serde(default = "one")]
    pub taper: f64,
    /// (A, R).
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Ridge {
    pub(super) fn draw(&self) -> Result<Drawn, String> {
        let ends = [1.0, self.taper].map(|factor| (self.left.scaled(factor), self.right.scaled(factor)));
        through(&self.points, [self.radius; 2], ends, noise(self.noise))
    }
}

/// Ridge lines with a common peak (Fig. 5 right): one curve for each arm, all from the same summit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Peak {
    /// Position and elevation.
    pub summit: DVec3,
    /// Half-width of the crests.
    #[serde(default)]
    pub radius: f64,
    /// The ridges.
    pub arms: Vec<Arm>,
    /// (A, R).
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

/// One ridge of a [`Peak`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// Way-points after the summit.
    pub points: Vec<DVec3>,
    /// To the left when going down.
    pub left: Slope,
    /// To the right.
    pub right: Slope,
    /// As of a [`Ridge`].
    #[serde(default = "one")]
    pub taper: f64,
}

impl Peak {
    pub(super) fn draw(&self) -> Result<Vec<Drawn>, String> {
        if self.arms.len() < 2 {
            return Err(format!("a peak with {} arms: expected at least 2, or a ridge", self.arms.len()));
        }
        let ridge = |arm: &Arm| Ridge {
            points: [self.summit].into_iter().chain(arm.points.iter().copied()).collect(),
            radius: self.radius,
            left: arm.left,
            right: arm.right,
            taper: arm.taper,
            noise: self.noise,
        };
        self.arms.iter().map(|arm| ridge(arm).draw()).collect()
    }
}

/// Cliff (Fig. 6 right): the upper edge of a wall that drops on one side.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cliff {
    /// Way-points of the edge with elevations.
    pub points: Vec<DVec3>,
    /// Half-width of the edge.
    #[serde(default)]
    pub radius: f64,
    /// The side of the wall.
    pub wall: Hand,
    /// How far the wall drops.
    pub drop: f64,
    /// How steep it is at its upper end, degrees; it ends 2·drop / tan(steepness) away.
    pub steepness: f64,
    /// The ground behind the edge.
    pub back: Slope,
    /// (A, R).
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Cliff {
    pub(super) fn draw(&self) -> Result<Drawn, String> {
        if !(self.drop > 0.0 && self.steepness > 0.0) {
            return Err("a cliff needs a drop and a steepness above 0".to_owned());
        }
        let wall = Slope(2.0 * self.drop / libm::tan(self.steepness.to_radians()), -self.steepness);
        let slopes = self.wall.slopes(wall, self.back);
        through(&self.points, [self.radius; 2], [slopes; 2], noise(self.noise))
    }
}

/// Hill (Fig. 7 left): slopes of 0 hold the surroundings of the curve at its elevation.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hill {
    /// Way-points with elevations.
    pub points: Vec<DVec3>,
    /// Half-width of what is strictly level.
    #[serde(default)]
    pub radius: f64,
    /// How far the slope of 0 reaches to both sides.
    pub reach: f64,
    /// (A, R).
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Hill {
    pub(super) fn draw(&self) -> Result<Drawn, String> {
        let level = Slope(self.reach, 0.0);
        through(&self.points, [self.radius; 2], [(level, level); 2], noise(self.noise))
    }
}

/// Crack (Fig. 7 right): two rising slopes and no elevation, so that it follows the ground it cuts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crack {
    /// Way-points.
    pub points: Vec<DVec2>,
    /// From rim to rim.
    pub width: f64,
    /// Of the bottom below the rims.
    pub depth: f64,
    /// (A, R), on the curve.
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Crack {
    pub(super) fn draw(&self) -> Drawn {
        let side = Slope::rising(0.5 * self.width, self.depth);
        let point = ConstraintPoint {
            gradient: gradient((side, side)),
            noise: noise(self.noise),
            ..ConstraintPoint::default()
        };
        uniform(Path::Smooth(self.points.clone()), point)
    }
}

/// Noise alone (Fig. 8).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseOnly {
    /// Way-points.
    pub points: Vec<DVec2>,
    /// A.
    pub amplitude: f64,
    /// R.
    pub roughness: f64,
}

impl NoiseOnly {
    pub(super) fn draw(&self) -> Drawn {
        let noise = Some(Noise { amplitude: self.amplitude, roughness: self.roughness });
        uniform(Path::Smooth(self.points.clone()), ConstraintPoint { noise, ..ConstraintPoint::default() })
    }
}

/// A closed curve at one elevation.
pub(super) fn level_ring(
    points: Vec<DVec2>,
    elevation: Elevation,
    slopes: (Slope, Slope),
    given: Option<(f64, f64)>,
) -> Drawn {
    let point = ConstraintPoint {
        elevation: Some(elevation),
        gradient: gradient(slopes),
        noise: noise(given),
        ..ConstraintPoint::default()
    };
    uniform(Path::Ring(points), point)
}
