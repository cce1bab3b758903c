//! Authored curves as chains of circular arcs (Génevaux 2015 §4.1, Fig. 6). Distance to an arc takes no more than a root,
//! and arcs that meet with one tangent are the "piecewise C¹ approximation of clothoids" that the paper lays roads on.
//!
//! The plane and the elevation are treated apart: arcs follow the course within a tolerance, elevation is C¹ along them.

mod arc;
mod bezier;
mod biarc;
mod elevation;
mod road;
#[cfg(test)]
mod tests;

pub use arc::Arc;
pub use road::WayPoint;

use crate::skeleton::arc::Stretch;
use bezier::Bezier;
use elevation::Elevations;
use glam::{DVec2, DVec3};

/// A curve as it is authored. Metres; z is the elevation.
#[derive(Clone, Debug, PartialEq)]
pub enum Path {
    /// Segments through points.
    Polyline(Vec<DVec3>),
    /// Quadratic Bézier pieces: end, control, end, control, …, end.
    Quadratic(Vec<DVec3>),
    /// Cubic Bézier pieces: end, control, control, end, …, end.
    Cubic(Vec<DVec3>),
    /// A centripetal Catmull-Rom spline through points; elevation rises or falls between two points as they do.
    Smooth(Vec<DVec3>),
    /// Straights and curves of a road: a clothoid, an arc and a clothoid at each way-point.
    Road(Vec<WayPoint>),
}

/// The most arcs of one skeleton.
pub const MAX_ARCS: usize = 20_000;

impl Path {
    /// The stretches of the skeleton, which keep within `tolerance` metres of the curve. A stretch goes on past its ends for
    /// `reach` metres, as its neighbours do.
    ///
    /// # Errors
    /// Too few points, points that are not finite or coincide, or a curve that does not fit between its way-points.
    pub fn stretches(&self, tolerance: f64, reach: f64) -> Result<Vec<Stretch>, String> {
        let (arcs, elevations) = self.chain(tolerance)?;
        if arcs.len() > MAX_ARCS {
            return Err(format!(
                "a curve of {} arcs; expected at most {MAX_ARCS}; use a larger tolerance, or several curves",
                arcs.len()
            ));
        }
        Ok(elevation::stretches(&arcs, &elevations, reach))
    }
    /// The points that place it, in order.
    pub fn points(&self) -> Vec<DVec3> {
        match self {
            Path::Polyline(points) | Path::Quadratic(points) | Path::Cubic(points) | Path::Smooth(points) => {
                points.clone()
            }
            Path::Road(points) => points.iter().map(|point| point.position).collect(),
        }
    }
    fn chain(&self, tolerance: f64) -> Result<(Vec<Arc>, Elevations), String> {
        let points = self.points();
        if let Some(k) = points.iter().position(|p| !p.is_finite()) {
            return Err(format!("point {} of a curve is not finite", k + 1));
        }
        if points.len() < 2 {
            return Err(format!("a curve of {} points; expected at least 2", points.len()));
        }
        if let Some(k) = points.windows(2).position(|p| p[0].truncate() == p[1].truncate()) {
            return Err(format!("points {} and {} of a curve stand at the same place; remove one", k + 1, k + 2));
        }
        match self {
            Path::Polyline(points) => Ok(polyline(points)),
            Path::Quadratic(points) => pieces(points, 2, tolerance),
            Path::Cubic(points) => pieces(points, 3, tolerance),
            Path::Smooth(points) => smooth(points, tolerance),
            Path::Road(points) => road::chain(points, tolerance),
        }
    }
}

fn polyline(points: &[DVec3]) -> (Vec<Arc>, Elevations) {
    let arcs: Vec<Arc> = points.windows(2).filter_map(|p| Arc::segment(p[0].truncate(), p[1].truncate())).collect();
    (arcs, Elevations::Broken(points.iter().map(|p| p.z).collect()))
}

/// Bézier pieces of one degree that share their ends.
fn pieces(points: &[DVec3], degree: usize, tolerance: f64) -> Result<(Vec<Arc>, Elevations), String> {
    if !(points.len() - 1).is_multiple_of(degree) {
        return Err(format!(
            "a chain of Bézier pieces of degree {degree} has {} points; expected {degree} for each piece and one more",
            points.len()
        ));
    }
    let (mut arcs, mut knots) = (Vec::new(), Vec::new());
    let mut abscissa = 0.0;
    for piece in points.windows(degree + 1).step_by(degree) {
        let curve = Bezier::new(piece);
        // Where pieces meet with different grades, the next one's stands.
        knots.pop();
        knots.push(curve.knot(0.0, abscissa));
        for fitted in biarc::fit(&curve, tolerance)? {
            abscissa += fitted.arcs.iter().map(|arc| arc.length).sum::<f64>();
            knots.push(curve.knot(fitted.to, abscissa));
            arcs.extend(fitted.arcs);
        }
    }
    Ok((arcs, Elevations::Smooth(elevation::limited(knots))))
}

fn smooth(points: &[DVec3], tolerance: f64) -> Result<(Vec<Arc>, Elevations), String> {
    let mut arcs = Vec::new();
    let mut known = vec![DVec2::new(0.0, points[0].z)];
    let mut abscissa = 0.0;
    for k in 1..points.len() {
        for piece in biarc::fit(&Bezier::catmull_rom(points, k), tolerance)? {
            abscissa += piece.arcs.iter().map(|arc| arc.length).sum::<f64>();
            arcs.extend(piece.arcs);
        }
        known.push(DVec2::new(abscissa, points[k].z));
    }
    Ok((arcs, Elevations::Smooth(elevation::monotone(&known))))
}
