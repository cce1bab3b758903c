//! A pinhole camera as tessellation sees it: an eye, four planes through it, and pixels per radian.

/// A camera. Axes are orthonormal; lengths in metres, image in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position.
    pub eye: [f64; 3],
    /// Right, up and forward.
    pub axes: [[f64; 3]; 3],
    /// Focal length, pixels.
    pub focal: f64,
    /// Half of the image's width and height, pixels.
    pub half: [f64; 2],
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl View {
    /// A camera at `eye` that looks along `forward`, upright; `None` where that is vertical or not a direction.
    pub fn new(eye: [f64; 3], forward: [f64; 3], focal: f64, half: [f64; 2]) -> Option<View> {
        let right = cross(forward, [0.0, 0.0, 1.0]);
        if dot(right, right) <= 1e-12 * dot(forward, forward) || !dot(right, right).is_finite() {
            return None;
        }
        let (right, forward) = (unit(right), unit(forward));
        Some(View { eye, axes: [right, cross(right, forward), forward], focal, half })
    }
    /// Inward normals of the frustum's five planes, all through the eye: left, right, bottom, top, and ahead.
    pub fn planes(&self) -> [[f64; 3]; 5] {
        let [right, up, forward] = self.axes;
        let side =
            |axis: [f64; 3], half: f64, sign: f64| [0, 1, 2].map(|k| sign * self.focal * axis[k] + half * forward[k]);
        let [w, h] = self.half;
        [side(right, w, 1.0), side(right, w, -1.0), side(up, h, 1.0), side(up, h, -1.0), forward]
    }
    /// Whether `point` falls in the image.
    pub fn sees(&self, point: [f64; 3]) -> bool {
        let d = [0, 1, 2].map(|k| point[k] - self.eye[k]);
        self.planes().iter().all(|plane| dot(*plane, d) > 0.0)
    }
    /// Whether one plane has the whole box behind it.
    pub fn misses(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        self.planes().iter().any(|plane| {
            let far = [0, 1, 2].map(|k| if plane[k] > 0.0 { high[k] } else { low[k] } - self.eye[k]);
            dot(*plane, far) < 0.0
        })
    }
    /// Squared distance from the eye to the vertical segment over (x, y) from `low` to `high`.
    pub fn distance_squared(&self, [x, y]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let (dx, dy) = (x - self.eye[0], y - self.eye[1]);
        let dz = (low - self.eye[2]).max(self.eye[2] - high).max(0.0);
        dx * dx + dy * dy + dz * dz
    }
}
