//! Landforms of water: riverbeds, lake shores, sea shores.

use super::relief::level_ring;
use super::{Drawn, Hand, Slope, gradient, noise, through, uniform};
use crate::curve::{ConstraintPoint, Elevation};
use crate::landscape::Path;
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// Riverbed (Fig. 6 left): the plateau is the bed, slopes to both sides are its banks.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct River {
    /// Way-points with elevations, from the source to the mouth.
    pub points: Vec<DVec3>,
    /// Width of the bed at the source.
    pub width: f64,
    /// Width at the mouth; that at the source if absent.
    #[serde(default)]
    pub mouth: Option<f64>,
    /// The banks.
    pub bank: Slope,
    /// (A, R).
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl River {
    pub(super) fn draw(&self) -> Result<Drawn, String> {
        if let Some(k) = self.points.windows(2).position(|pair| pair[1].z > pair[0].z) {
            return Err(format!(
                "the river rises from {} m at way-point {k} to {} m at the next: expected elevations that fall from its source",
                self.points[k].z,
                self.points[k + 1].z
            ));
        }
        let radii = [self.width, self.mouth.unwrap_or(self.width)].map(|width| 0.5 * width);
        through(&self.points, radii, [(self.bank, self.bank); 2], noise(self.noise))
    }
}

/// Lake shore: closed, at one level, the bed falling inside and a bank outside.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lake {
    /// Way-points of the shore, in either direction.
    pub shore: Vec<DVec2>,
    /// Elevation of the water.
    pub level: f64,
    /// Half-width of the shore.
    #[serde(default)]
    pub radius: f64,
    /// How far from the shore the bed falls, and by how much.
    pub bed: (f64, f64),
    /// The ground outside.
    pub bank: Slope,
    /// (A, R), on the shore.
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Lake {
    pub(super) fn draw(&self) -> Drawn {
        let bed = Slope::rising(self.bed.0, -self.bed.1);
        let elevation = Elevation { height: self.level, radius: self.radius };
        let slopes = inside(&self.shore).slopes(bed, self.bank);
        level_ring(self.shore.clone(), elevation, slopes, self.noise)
    }
}

/// The side on which the inside of a ring lies: left if it runs counter-clockwise (shoelace formula).
fn inside(ring: &[DVec2]) -> Hand {
    let next = ring.iter().cycle().skip(1);
    let twice_area: f64 = ring.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    if twice_area > 0.0 { Hand::Left } else { Hand::Right }
}

/// Sea shore: open, at one level, the sea bed falling on one side and a beach rising on the other.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sea {
    /// Way-points of the shore.
    pub shore: Vec<DVec2>,
    /// Elevation of the water.
    #[serde(default)]
    pub level: f64,
    /// The side of the water.
    pub water: Hand,
    /// How far from the shore the bed falls, and by how much.
    pub bed: (f64, f64),
    /// The ground on the other side.
    pub beach: Slope,
    /// (A, R), on the shore.
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Sea {
    pub(super) fn draw(&self) -> Drawn {
        let point = ConstraintPoint {
            elevation: Some(Elevation { height: self.level, radius: 0.0 }),
            gradient: gradient(self.water.slopes(Slope::rising(self.bed.0, -self.bed.1), self.beach)),
            noise: noise(self.noise),
            ..ConstraintPoint::default()
        };
        uniform(Path::Smooth(self.shore.clone()), point)
    }
}
