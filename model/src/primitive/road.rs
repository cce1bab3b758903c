//! Roads (Génevaux 2015 §4.1): the curve of a course with clothoids, whose cross-section follows from the width of the
//! carriageway. Shoulders and embankments belong to it, so that it meets whatever ground it is laid on.

use super::curve::Curve;
use crate::falloff::wyvill;
use crate::profile::Knot;
use crate::scene::{Finite, Point3, Positive, Scope};
use crate::spline::{Path, WayPoint};
use glam::DVec3;
use serde::Deserialize;

/// A road. Lengths in metres, falls in metres per metre.
#[derive(Clone, Debug)]
pub struct Road {
    /// Where its straights would meet, with the radii between them.
    pub way_points: Vec<WayPoint>,
    /// Width of the carriageway.
    pub carriageway: f64,
    /// How steeply it falls to both sides from its middle.
    pub cross_fall: f64,
    /// Width of each shoulder.
    pub shoulder: f64,
    /// How steeply the shoulder falls outward where it ends.
    pub shoulder_fall: f64,
    /// Width of each embankment.
    pub embankment: f64,
    /// How far the embankment falls.
    pub embankment_drop: f64,
    /// The largest grade along the road.
    pub grade_limit: f64,
}

impl Road {
    /// A country road of this width through these way-points.
    pub fn new(way_points: Vec<WayPoint>, carriageway: f64) -> Road {
        Road {
            way_points,
            carriageway,
            cross_fall: 0.025,
            shoulder: 0.25 * carriageway,
            shoulder_fall: 0.06,
            embankment: carriageway,
            embankment_drop: 0.15 * carriageway,
            grade_limit: 0.12,
        }
    }
}

/// A road in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    way_points: Vec<WayPointFile>,
    carriageway: Positive,
    #[serde(default)]
    cross_fall: Option<Finite>,
    #[serde(default)]
    shoulder: Option<Positive>,
    #[serde(default)]
    shoulder_fall: Option<Finite>,
    #[serde(default)]
    embankment: Option<Positive>,
    #[serde(default)]
    embankment_drop: Option<Finite>,
    #[serde(default)]
    grade_limit: Option<Positive>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WayPointFile {
    at: Point3,
    #[serde(default = "ten")]
    radius: Positive,
    #[serde(default)]
    transition: Finite,
}

fn ten() -> Positive {
    Positive::of(10.0)
}

impl File {
    pub(crate) fn build(&self, _: &mut Scope<'_>) -> Result<Curve, String> {
        let way_point = |p: &WayPointFile| WayPoint {
            position: DVec3::new(p.at.0.into(), p.at.1.into(), p.at.2.into()),
            radius: p.radius.into(),
            transition: p.transition.into(),
        };
        let usual = Road::new(self.way_points.iter().map(way_point).collect(), self.carriageway.into());
        Road {
            cross_fall: self.cross_fall.map_or(usual.cross_fall, f64::from),
            shoulder: self.shoulder.map_or(usual.shoulder, f64::from),
            shoulder_fall: self.shoulder_fall.map_or(usual.shoulder_fall, f64::from),
            embankment: self.embankment.map_or(usual.embankment, f64::from),
            embankment_drop: self.embankment_drop.map_or(usual.embankment_drop, f64::from),
            grade_limit: self.grade_limit.map_or(usual.grade_limit, f64::from),
            ..usual
        }
        .curve()
    }
}

impl Road {
    /// The curve that it is.
    ///
    /// # Errors
    /// Bends that do not fit between way-points, or a grade above the limit, with the place.
    pub fn curve(&self) -> Result<Curve, String> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let falls = [self.cross_fall, self.shoulder_fall, self.embankment_drop];
        if ![self.carriageway, self.shoulder, self.embankment, self.grade_limit].into_iter().all(positive)
            || !falls.into_iter().all(|v| v >= 0.0 && v.is_finite())
        {
            return Err("a road needs positive widths and a positive grade limit, and falls of at least 0".to_owned());
        }
        let edge = 0.5 * self.carriageway + self.shoulder;
        let radius = 1.1 * (edge + self.embankment);
        let path = Path::Road(self.way_points.clone());
        let curve = Curve::new(path, radius, self.profile());
        self.check_grade(&curve)?;
        // A replacement takes the road alone up to the end of its shoulders.
        let weight = 1.02 / wyvill((edge / radius) * (edge / radius));
        Ok(Curve { weight, ..curve })
    }
    fn check_grade(&self, curve: &Curve) -> Result<(), String> {
        for stretch in curve.path.stretches(curve.tolerance, curve.joint)? {
            // The grade of a cubic is a parabola: its ends and its extremum, within the ends, are what matters.
            let mean = (stretch.elevation[1] - stretch.elevation[0]) / stretch.arc.length;
            let [a, b] = stretch.grade;
            let (linear, square) = (6.0 * mean - 4.0 * a - 2.0 * b, 3.0 * (a + b - 2.0 * mean));
            let t = if square == 0.0 { 0.0 } else { (-0.5 * linear / square).clamp(0.0, 1.0) };
            let steepest = a.abs().max(b.abs()).max((a + t * (linear + t * square)).abs());
            if steepest > self.grade_limit {
                let at = stretch.arc.at(t * stretch.arc.length).0;
                let off = |p: &WayPoint| p.position.truncate().distance_squared(at);
                let near = (0..self.way_points.len())
                    .min_by(|a, b| off(&self.way_points[*a]).total_cmp(&off(&self.way_points[*b])));
                return Err(format!(
                    "the road climbs {:.1} % near way-point {} at ({:.0}, {:.0}); expected at most {:.1} %: change elevations, or \
                     the grade limit",
                    100.0 * steepest,
                    near.map_or(0, |k| k + 1),
                    at.x,
                    at.y,
                    100.0 * self.grade_limit
                ));
            }
        }
        Ok(())
    }
    /// The cross-section, level across the middle for as little as a crown needs.
    fn profile(&self) -> Vec<Knot> {
        let half = 0.5 * self.carriageway;
        let crown = 0.1 * half;
        let fall = self.cross_fall;
        let edge = -fall * (half - 0.5 * crown);
        let shoulder = edge - 0.5 * (fall + self.shoulder_fall) * self.shoulder;
        let right = [
            (crown, -0.5 * fall * crown, -fall),
            (half, edge, -fall),
            (half + self.shoulder, shoulder, -self.shoulder_fall),
            (half + self.shoulder + self.embankment, shoulder - self.embankment_drop, 0.0),
        ];
        let knot = |(distance, height, slope)| Knot { distance, height, slope };
        let left = right.iter().rev().map(|&(distance, height, slope)| (-distance, height, -slope));
        left.chain([(0.0, 0.0, 0.0)]).chain(right).map(knot).collect()
    }
}
