//! A circular arc by start, tangent, curvature and length, straight where the curvature is 0.

use glam::DVec2;

/// A circular arc or a segment. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Where it starts.
    pub start: DVec2,
    /// Unit tangent there.
    pub tangent: DVec2,
    /// Curvature, per metre, positive to the left.
    pub curvature: f64,
    /// Length, positive.
    pub length: f64,
}

impl Arc {
    /// The segment from `a` to `b`; `None` when they are the same.
    pub fn segment(a: DVec2, b: DVec2) -> Option<Arc> {
        let length = a.distance(b);
        (length > 0.0).then(|| Arc { start: a, tangent: (b - a) / length, curvature: 0.0, length })
    }
    /// The arc from `a` with unit tangent `tangent` to `b`; `None` when they are the same. An arc that turns by less than
    /// 1e-9 is a segment.
    pub fn through(a: DVec2, tangent: DVec2, b: DVec2) -> Option<Arc> {
        let chord = b - a;
        let half = libm::atan2(tangent.perp_dot(chord), tangent.dot(chord));
        if half.abs() < 0.5e-9 {
            return Arc::segment(a, b);
        }
        let length = chord.length() * half / libm::sin(half);
        (length > 0.0 && length.is_finite()).then(|| Arc { start: a, tangent, curvature: 2.0 * half / length, length })
    }
    /// Position and unit tangent `s` metres from the start.
    pub fn at(&self, s: f64) -> (DVec2, DVec2) {
        let half = 0.5 * s * self.curvature;
        let direction = DVec2::new(libm::cos(half), libm::sin(half));
        let chord = if half == 0.0 { s } else { s * direction.y / half };
        (self.start + chord * direction.rotate(self.tangent), direction.rotate(direction.rotate(self.tangent)))
    }
    /// Where it ends.
    pub fn end(&self) -> DVec2 {
        self.at(self.length).0
    }
    /// By how much it turns, radians.
    pub fn turn(&self) -> f64 {
        self.length * self.curvature
    }
    /// `parts` pieces of equal length.
    pub fn split(&self, parts: usize) -> impl Iterator<Item = Arc> + use<> {
        let (arc, length) = (*self, self.length / parts as f64);
        (0..parts).map(move |k| {
            let (start, tangent) = arc.at(k as f64 * length);
            Arc { start, tangent, length, ..arc }
        })
    }
    /// South-west and north-east corners of a box around it.
    pub fn extent(&self) -> (DVec2, DVec2) {
        let end = self.end();
        // No point of an arc is farther from its chord than from the middle of its chord's arc.
        let bulge = self.at(0.5 * self.length).0.distance(0.5 * (self.start + end));
        let grow = DVec2::splat(bulge + 1e-12 * (self.start.length() + self.length));
        (self.start.min(end) - grow, self.start.max(end) + grow)
    }
    /// Distance from `x`, for an arc of less than half a turn.
    pub fn distance(&self, x: DVec2) -> f64 {
        let (end, leaving) = self.at(self.length);
        if self.tangent.dot(x - self.start) < 0.0 || leaving.dot(x - end) > 0.0 {
            return x.distance(self.start).min(x.distance(end));
        }
        let v = x - self.start;
        let (a, b) = (self.tangent.dot(v), self.tangent.perp_dot(v));
        let to_centre = (DVec2::new(1.0 - self.curvature * b, self.curvature * a)).length();
        ((2.0 * b - self.curvature * v.length_squared()) / (1.0 + to_centre)).abs()
    }
}
