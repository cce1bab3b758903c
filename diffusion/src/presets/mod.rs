//! Landforms by few numbers (Hnaidi 2010 §3.2, Figs 4–8 and 12): each preset is data that becomes one or more feature curves.
//!
//! Angles are degrees, positive upwards away from the curve; everything else is metres.

mod island;
mod plain;
mod relief;
mod water;

pub use island::Island;
pub use plain::{Plain, Point};
pub use relief::{Arm, Cliff, Crack, Hill, NoiseOnly, Peak, Ridge};
pub use water::{Lake, River, Sea};

use crate::curve::{ConstraintPoint, Curve, Elevation, Gradient, Noise, Side};
use crate::landscape::Path;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A slope to one side: how far it reaches beyond the plateau, metres, and its angle at the inner end, degrees. It ramps to 0 at the
/// outer end, so that the ground rises by half of reach · tan(angle).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Slope(pub f64, pub f64);

impl Slope {
    /// The slope that rises by `rise` metres over `reach` metres.
    pub fn rising(reach: f64, rise: f64) -> Slope {
        Slope(reach, libm::atan(2.0 * rise / reach).to_degrees())
    }
    /// In the units of a curve.
    pub fn side(self) -> Side {
        Side { extent: self.0, angle: self.1.to_radians() }
    }
    /// From the units of a curve, to a billionth of a degree, so that a whole number of degrees is one again.
    pub fn of(side: Side) -> Slope {
        Slope(side.extent, (side.angle.to_degrees() * 1e9).round() / 1e9)
    }
    fn scaled(self, factor: f64) -> Slope {
        Slope(self.0 * factor, self.1)
    }
}

/// A side of a curve when looking along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    /// Left.
    Left,
    /// Right.
    Right,
}

impl Hand {
    /// Slopes to the left and to the right: `here` on this side, `there` on the other.
    fn slopes(self, here: Slope, there: Slope) -> (Slope, Slope) {
        match self {
            Hand::Left => (here, there),
            Hand::Right => (there, here),
        }
    }
}

/// A curve before it has a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Its course.
    pub path: Path,
    /// What it wants.
    pub points: Vec<ConstraintPoint>,
}

/// A landform, or a curve.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// A curve by its path and its constraint points.
    Curve(Plain),
    /// A crest that falls away to both sides.
    Ridge(Ridge),
    /// Ridges that share a peak.
    Peak(Peak),
    /// A bed that falls along its course between rising banks.
    River(River),
    /// An edge with a wall on one side.
    Cliff(Cliff),
    /// A level top.
    Hill(Hill),
    /// A trough with no elevation of its own.
    Crack(Crack),
    /// Noise alone.
    Noise(NoiseOnly),
    /// A closed shore at one level.
    Lake(Lake),
    /// An open shore.
    Sea(Sea),
    /// A volcano in the sea.
    Island(Island),
}

impl Preset {
    /// Its curves.
    ///
    /// # Errors
    /// One line that says what was expected.
    pub fn draw(&self) -> Result<Vec<Drawn>, String> {
        match self {
            Preset::Curve(plain) => Ok(vec![plain.draw()]),
            Preset::Ridge(ridge) => Ok(vec![ridge.draw()?]),
            Preset::Peak(peak) => peak.draw(),
            Preset::River(river) => Ok(vec![river.draw()?]),
            Preset::Cliff(cliff) => Ok(vec![cliff.draw()?]),
            Preset::Hill(hill) => Ok(vec![hill.draw()?]),
            Preset::Crack(crack) => Ok(vec![crack.draw()]),
            Preset::Noise(noise) => Ok(vec![noise.draw()]),
            Preset::Lake(lake) => Ok(vec![lake.draw()]),
            Preset::Sea(sea) => Ok(vec![sea.draw()]),
            Preset::Island(island) => island.draw(),
        }
    }
}

/// (left, right) as a curve has them.
fn gradient((left, right): (Slope, Slope)) -> Option<Gradient> {
    Some(Gradient { left: left.side(), right: right.side() })
}

/// (A, R) as a curve has them.
fn noise(given: Option<(f64, f64)>) -> Option<Noise> {
    given.map(|(amplitude, roughness)| Noise { amplitude, roughness })
}

/// The same everywhere along a curve.
fn uniform(path: Path, point: ConstraintPoint) -> Drawn {
    Drawn { path, points: [0.0, 1.0].map(|place| ConstraintPoint { place, ..point }).to_vec() }
}

/// A smooth curve through way-points with elevations; plateaus, slopes and noise go linearly from the first to the last.
fn through(
    points: &[DVec3],
    radii: [f64; 2],
    slopes: [(Slope, Slope); 2],
    noise: Option<Noise>,
) -> Result<Drawn, String> {
    let path = Path::Smooth(points.iter().map(|point| point.truncate()).collect());
    let places = places(&path)?;
    let last = places.len() - 1;
    let constraint = |(k, (place, point)): (usize, (f64, &DVec3))| {
        let end = usize::from(k == last);
        let ends = k == 0 || k == last;
        ConstraintPoint {
            place,
            elevation: Some(Elevation { height: point.z, radius: radii[0] + (radii[1] - radii[0]) * place }),
            gradient: if ends { gradient(slopes[end]) } else { None },
            noise: noise.filter(|_| ends),
        }
    };
    let points = places.into_iter().zip(points).enumerate().map(constraint).collect();
    Ok(Drawn { path, points })
}

/// The place u of every way-point.
fn places(path: &Path) -> Result<Vec<f64>, String> {
    let control = path.control().map_err(|error| error.to_string())?;
    // What it wants does not matter for its lengths.
    let any = ConstraintPoint { noise: Some(Noise { amplitude: 0.0, roughness: 0.0 }), ..ConstraintPoint::default() };
    let ends = [0.0, 1.0].map(|place| ConstraintPoint { place, ..any }).to_vec();
    let curve = Curve::new(control, ends).map_err(|error| error.to_string())?;
    Ok((0..curve.pieces()).map(|piece| curve.place(piece, 0.0)).chain([1.0]).collect())
}

fn one() -> f64 {
    1.0
}

#[cfg(test)]
mod tests;
