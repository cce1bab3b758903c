//! How the course of a curve is given: by the control points of its Bézier pieces, or by way-points that a smooth curve goes through.
//!
//! Between way-points runs a centripetal Catmull–Rom spline, the one of these splines without cusps and loops; its pieces are cubic
//! Béziers, and its tangent is continuous.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// See the module; metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Path {
    /// Control points, four to a piece, ends shared.
    Bezier(Vec<DVec2>),
    /// Way-points. The ends are continued straight, so that two way-points make a straight line.
    Smooth(Vec<DVec2>),
    /// Way-points of a closed curve, which goes on from the last to the first.
    Ring(Vec<DVec2>),
}

/// Why way-points make no curve.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// Too few.
    #[error("{found} way-points: expected at least {expected}")]
    Few {
        /// How many there are.
        found: usize,
        /// How many it takes.
        expected: usize,
    },
    /// One equals the next.
    #[error("way-point {index} lies where the next one does: expected way-points that differ")]
    Equal {
        /// Number of the way-point, from 0.
        index: usize,
    },
}

impl Path {
    /// The points that define it.
    pub fn points(&self) -> &[DVec2] {
        match self {
            Path::Bezier(points) | Path::Smooth(points) | Path::Ring(points) => points,
        }
    }
    /// Control points of its Bézier pieces, four to a piece, ends shared; a ring's last equals its first.
    ///
    /// # Errors
    /// [`PathError`] for way-points that make no curve.
    pub fn control(&self) -> Result<Vec<DVec2>, PathError> {
        let (points, closed) = match self {
            Path::Bezier(points) => return Ok(points.clone()),
            Path::Smooth(points) => (points, false),
            Path::Ring(points) => (points, true),
        };
        let (n, expected) = (points.len(), if closed { 3 } else { 2 });
        if n < expected {
            return Err(PathError::Few { found: n, expected });
        }
        let pieces = if closed { n } else { n - 1 };
        if let Some(index) = (0..pieces).find(|&k| points[k] == points[(k + 1) % n]) {
            return Err(PathError::Equal { index });
        }
        let mut control = vec![points[0]];
        for k in 0..pieces {
            let (b, c) = (points[k], points[(k + 1) % n]);
            let a = if k > 0 || closed { points[(k + n - 1) % n] } else { 2.0 * b - c };
            let d = if k + 2 < n || closed { points[(k + 2) % n] } else { 2.0 * c - b };
            let [before, here, after] = [(a, b), (b, c), (c, d)].map(|(p, q)| p.distance(q).sqrt());
            let tangent = |p: DVec2, q: DVec2, r: DVec2, s: f64, t: f64| (q - p) / s - (r - p) / (s + t) + (r - q) / t;
            let (leaving, arriving) = (tangent(a, b, c, before, here), tangent(b, c, d, here, after));
            control.extend([b + leaving * (here / 3.0), c - arriving * (here / 3.0), c]);
        }
        Ok(control)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn pieces_pass_through_way_points_with_one_tangent() {
        let points = vec![v(0.0, 0.0), v(100.0, 30.0), v(110.0, 80.0), v(400.0, 90.0)];
        for path in [Path::Smooth(points.clone()), Path::Ring(points.clone())] {
            let control = path.control().unwrap();
            let closed = matches!(path, Path::Ring(_));
            assert_eq!(control.len(), if closed { 13 } else { 10 });
            for (k, point) in points.iter().enumerate() {
                assert_eq!(control[3 * k], *point);
            }
            for joint in (1..control.len() / 3).map(|k| 3 * k) {
                let [before, after] =
                    [control[joint] - control[joint - 1], control[joint + 1] - control[joint]].map(DVec2::normalize);
                assert!(before.distance(after) < 1e-12, "a corner at {joint}");
            }
            if closed {
                assert_eq!(control[0], control[12]);
                assert!(
                    (control[12] - control[11]).normalize().distance((control[1] - control[0]).normalize()) < 1e-12
                );
            }
        }
    }

    #[test]
    fn two_way_points_are_a_straight_line_at_even_speed() {
        let control = Path::Smooth(vec![v(0.0, 0.0), v(30.0, 60.0)]).control().unwrap();
        let expected = [v(0.0, 0.0), v(10.0, 20.0), v(20.0, 40.0), v(30.0, 60.0)];
        assert!(control.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-12), "{control:?}");
    }

    #[test]
    fn way_points_that_make_no_curve_are_refused() {
        let refused = |path: Path| path.control().unwrap_err().to_string();
        assert!(refused(Path::Smooth(vec![v(1.0, 1.0)])).contains("at least 2"));
        assert!(refused(Path::Ring(vec![v(1.0, 1.0), v(2.0, 1.0)])).contains("at least 3"));
        assert!(refused(Path::Smooth(vec![v(1.0, 1.0), v(2.0, 1.0), v(2.0, 1.0)])).contains("way-point 1"));
        assert!(refused(Path::Ring(vec![v(1.0, 1.0), v(2.0, 1.0), v(2.0, 3.0), v(1.0, 1.0)])).contains("way-point 3"));
    }
}
