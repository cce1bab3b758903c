//! Landscapes: feature curves over a rectangle, as people write them (text) and as they are kept (compact bytes).
//!
//! A landscape has no resolution: [`Landscape::domain`] gives the raster for one.

mod compact;
mod path;
mod text;

pub use compact::Precision;
pub use path::{Path, PathError};
pub use text::FORMAT;

use crate::curve::{ConstraintPoint, Curve};
use crate::detail::Detail;
use crate::raster::Domain;
use glam::DVec2;

/// A curve as it was authored.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// For people; may be empty.
    pub name: String,
    /// Its course.
    pub path: Path,
    /// What it wants.
    pub points: Vec<ConstraintPoint>,
}

/// Why there is no landscape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LandscapeError {
    /// The text is not RON, or not of the form expected.
    #[error("{line}:{column}: {problem}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was expected.
        problem: String,
    },
    /// The form is right and a value is not.
    #[error("{path}: {problem}")]
    Value {
        /// Where, as `curves[3] "east rim"`.
        path: String,
        /// What was expected.
        problem: String,
    },
    /// The bytes are no compact landscape.
    #[error("byte {offset}: {problem}")]
    Bytes {
        /// Where, from 0.
        offset: usize,
        /// What was expected.
        problem: String,
    },
}

impl LandscapeError {
    fn value(path: impl Into<String>, problem: impl ToString) -> LandscapeError {
        LandscapeError::Value { path: path.into(), problem: problem.to_string() }
    }
}

/// What a landscape is apart from its curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// A title for people.
    pub title: String,
    /// South-west corner, metres.
    pub origin: DVec2,
    /// Width and height, metres.
    pub extent: DVec2,
    /// Level of the lakes and the sea, metres. It changes no elevation; who draws the landscape floods what lies below.
    pub water: Option<f64>,
    /// The detail map.
    pub detail: Detail,
}

/// Checked curves over a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Landscape {
    frame: Frame,
    features: Vec<Feature>,
    curves: Vec<Curve>,
}

impl Landscape {
    /// Checks every curve. Heights that conflict where curves cross are no error: the raster averages them (Hnaidi 2010 §4.1).
    ///
    /// # Errors
    /// [`LandscapeError::Value`] with the place, also for a curve none of which lies in the rectangle, reach included.
    pub fn new(frame: Frame, features: Vec<Feature>) -> Result<Landscape, LandscapeError> {
        if !frame.origin.is_finite() || !(frame.origin + frame.extent).is_finite() || frame.extent.min_element() <= 0.0
        {
            let problem = format!(
                "{} × {} m from ({}, {}): expected a finite rectangle with a width and a height above 0",
                frame.extent.x, frame.extent.y, frame.origin.x, frame.origin.y
            );
            return Err(LandscapeError::value("extent", problem));
        }
        if !frame.water.is_none_or(f64::is_finite) {
            return Err(LandscapeError::value("water", "expected a finite number of metres"));
        }
        if let Some(problem) = frame.detail.problem() {
            return Err(LandscapeError::value("detail", problem));
        }
        if features.is_empty() {
            return Err(LandscapeError::value("curves", "there are none: expected at least one"));
        }
        let mut curves = Vec::with_capacity(features.len());
        for (index, feature) in features.iter().enumerate() {
            let curve = curve(feature, &frame);
            curves.push(curve.map_err(|problem| LandscapeError::value(place(index, &feature.name), problem))?);
        }
        Ok(Landscape { frame, features, curves })
    }
    /// What it is apart from its curves.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }
    /// The curves as they were authored.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }
    /// The curves as they are diffused: with noise that follows from slopes where the detail's settings ask for it.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }
    /// The landscape with its first `count` curves.
    ///
    /// # Errors
    /// [`LandscapeError::Value`] for none.
    pub fn first(&self, count: usize) -> Result<Landscape, LandscapeError> {
        Landscape::new(self.frame.clone(), self.features.iter().take(count).cloned().collect())
    }
    /// The raster with `nodes` (at least 2) along the longer side. Along the other it has the number that comes nearest to its length,
    /// since cells are square.
    pub fn domain(&self, nodes: usize) -> Domain {
        let extent = self.frame.extent;
        let spacing = extent.max_element() / (nodes.max(2) - 1) as f64;
        let count = |metres: f64| ((metres / spacing).round() as usize + 1).max(2);
        Domain { origin: self.frame.origin, spacing, width: count(extent.x), height: count(extent.y) }
    }
}

/// Where a curve stands in a file.
fn place(index: usize, name: &str) -> String {
    if name.is_empty() { format!("curves[{index}]") } else { format!("curves[{index}] {name:?}") }
}

fn curve(feature: &Feature, frame: &Frame) -> Result<Curve, String> {
    let control = feature.path.control().map_err(|error| error.to_string())?;
    let points = match frame.detail.from_slope {
        Some(from) => from.complete(&feature.points),
        None => feature.points.clone(),
    };
    let curve = Curve::new(control, points).map_err(|error| error.to_string())?;
    // A Bézier piece lies in the hull of its control points.
    let fold = |start, pick: fn(DVec2, DVec2) -> DVec2| curve.control().iter().copied().fold(start, pick);
    let (low, high) = (fold(DVec2::INFINITY, DVec2::min), fold(DVec2::NEG_INFINITY, DVec2::max));
    let reach = DVec2::splat(curve.reach());
    let (south_west, north_east) = (frame.origin - reach, frame.origin + frame.extent + reach);
    if high.cmplt(south_west).any() || low.cmpgt(north_east).any() {
        return Err(format!(
            "it lies wholly outside of the landscape, from ({}, {}) to ({}, {}): move it, or leave it out",
            low.x, low.y, high.x, high.y
        ));
    }
    Ok(curve)
}

#[cfg(test)]
mod tests;
