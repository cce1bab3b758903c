//! A curve by its path and its constraint points: what every preset could be written as.

use super::{Drawn, Slope};
use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise};
use crate::landscape::Path;
use serde::{Deserialize, Serialize};

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plain {
    /// Its course.
    pub path: Path,
    /// At least two, the first at 0 and the last at 1.
    pub points: Vec<Point>,
}

/// A constraint point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// 0 at the start of the curve, 1 at its end, by length.
    pub u: f64,
    /// Elevation, and how far it holds to both sides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elevation: Option<(f64, f64)>,
    /// To the left and to the right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slopes: Option<(Slope, Slope)>,
    /// (A, R).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<(f64, f64)>,
}

impl Plain {
    pub(super) fn draw(&self) -> Drawn {
        let point = |point: &Point| ConstraintPoint {
            place: point.u,
            elevation: point.elevation.map(|(height, radius)| Elevation { height, radius }),
            gradient: point.slopes.map(|(left, right)| Gradient { left: left.side(), right: right.side() }),
            noise: point.noise.map(|(amplitude, roughness)| Noise { amplitude, roughness }),
        };
        Drawn { path: self.path.clone(), points: self.points.iter().map(point).collect() }
    }
    /// The curve that `path` and `points` are.
    pub fn of(path: &Path, points: &[ConstraintPoint]) -> Plain {
        let point = |point: &ConstraintPoint| Point {
            u: point.place,
            elevation: point.elevation.map(|e| (e.height, e.radius)),
            slopes: point.gradient.map(|g| (Slope::of(g.left), Slope::of(g.right))),
            noise: point.noise.map(|n| (n.amplitude, n.roughness)),
        };
        Plain { path: path.clone(), points: points.iter().map(point).collect() }
    }
}
