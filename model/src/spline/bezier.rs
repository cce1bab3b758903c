//! Bézier pieces of degree 2 or 3, and the ones that a Catmull-Rom spline consists of.

use super::biarc::Planar;
use super::elevation::Knot;
use glam::{DVec2, DVec3};

/// A cubic by its control points; a quadratic is raised to one.
pub(super) struct Bezier([DVec3; 4]);

impl Bezier {
    /// From 3 or 4 control points.
    pub fn new(points: &[DVec3]) -> Bezier {
        match *points {
            [a, b, c] => Bezier([a, a + (b - a) * (2.0 / 3.0), c + (b - c) * (2.0 / 3.0), c]),
            [a, b, c, d] => Bezier([a, b, c, d]),
            _ => Bezier([DVec3::ZERO; 4]),
        }
    }
    /// The `k`-th piece (from 1) of the centripetal Catmull-Rom spline through `points`, which is the one of these splines
    /// without cusps and loops. The ends are continued straight.
    pub fn catmull_rom(points: &[DVec3], k: usize) -> Bezier {
        let (b, c) = (points[k - 1], points[k]);
        let a = if k >= 2 { points[k - 2] } else { 2.0 * b - c };
        let d = points.get(k + 1).copied().unwrap_or(2.0 * c - b);
        let step = |p: DVec3, q: DVec3| p.truncate().distance(q.truncate()).sqrt();
        let (before, here, after) = (step(a, b), step(b, c), step(c, d));
        let tangent = |p: DVec3, q: DVec3, r: DVec3, s: f64, t: f64| (q - p) / s - (r - p) / (s + t) + (r - q) / t;
        let (leaving, arriving) = (tangent(a, b, c, before, here), tangent(b, c, d, here, after));
        Bezier([b, b + leaving * (here / 3.0), c - arriving * (here / 3.0), c])
    }
    fn with_derivative(&self, t: f64) -> (DVec3, DVec3) {
        let Bezier([a, b, c, d]) = *self;
        let s = 1.0 - t;
        let (ab, bc, cd) = (a * s + b * t, b * s + c * t, c * s + d * t);
        let (abc, bcd) = (ab * s + bc * t, bc * s + cd * t);
        (abc * s + bcd * t, (bcd - abc) * 3.0)
    }
    /// Elevation and grade at `t`, which stands `abscissa` metres from the start.
    pub fn knot(&self, t: f64, abscissa: f64) -> Knot {
        let (position, derivative) = self.with_derivative(t);
        let speed = derivative.truncate().length();
        Knot { abscissa, elevation: position.z, grade: if speed > 0.0 { derivative.z / speed } else { 0.0 } }
    }
}

impl Planar for Bezier {
    fn at(&self, t: f64) -> (DVec2, DVec2) {
        let (position, derivative) = self.with_derivative(t);
        (position.truncate(), derivative.truncate())
    }
}
