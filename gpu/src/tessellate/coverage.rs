//! Which pixels displaced triangles cover, in homogeneous coordinates: a pixel is covered when the ray through its middle lies in the
//! cone of a triangle (Olano and Greer 1997), so that nothing is clipped. Edges are inclusive and their side of a ray is computed from
//! the same numbers for both triangles at an edge: no ray passes between two that share their vertices.

use super::view::View;

/// An image of a [`View`], with fewer pixels than the view was made for or more.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    /// The camera.
    pub view: &'a View,
    /// Columns and rows.
    pub size: [usize; 2],
}

/// A triangle by its corners, metres.
pub type Corners = [[f64; 3]; 3];

/// Where a pixel's ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Fragment {
    /// Shares of the corners, which sum to 1.
    pub shares: [f64; 3],
    /// Metres ahead of the eye over the focal length: it orders what a pixel sees.
    pub depth: f64,
}

impl Image<'_> {
    /// Pixels that none of `triangles` covers.
    pub fn background<'t>(&self, triangles: impl IntoIterator<Item = &'t Corners>) -> usize {
        let mut covered = vec![false; self.size[0] * self.size[1]];
        for corners in triangles {
            self.each(corners, |pixel, _| covered[pixel] = true);
        }
        covered.iter().filter(|covered| !**covered).count()
    }
    /// Whether a pixel shows some of the triangle, if nothing hides it.
    pub fn shows(&self, corners: &Corners) -> bool {
        let mut any = false;
        self.each(corners, |_, _| any = true);
        any
    }
    /// Calls `visit` with each pixel that the triangle covers, and where in it.
    pub fn each(&self, corners: &Corners, mut visit: impl FnMut(usize, Fragment)) {
        let behind = |plane: [f64; 3]| corners.iter().all(|p| super::view::dot(plane, minus(*p, self.view.eye)) < 0.0);
        if self.view.planes().into_iter().any(behind) {
            return;
        }
        let seen = corners.map(|p| self.view.axes.map(|axis| super::view::dot(axis, minus(p, self.view.eye))));
        let edges = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| edge(seen[i], seen[j]));
        let facing = super::view::dot(edges[2], seen[2]);
        if facing == 0.0 {
            return;
        }
        let [columns, rows] = [0, 1].map(|axis| self.span(&seen, axis));
        for row in rows {
            for column in columns.clone() {
                let [x, y] = [(0, column), (1, row)].map(|(axis, at)| self.place(axis, at));
                let ray = [x, y, self.view.focal];
                let parts = edges.map(|edge| super::view::dot(edge, ray));
                if parts.iter().all(|part| part * facing >= 0.0) {
                    let sum = parts[0] + parts[1] + parts[2];
                    let fragment = Fragment { shares: parts.map(|part| part / sum), depth: facing / sum };
                    visit(row * self.size[0] + column, fragment);
                }
            }
        }
    }
    /// The middle of a pixel, in the view's own pixels from the middle of the image; row 0 is at the bottom.
    fn place(&self, axis: usize, at: usize) -> f64 {
        self.view.half[axis] * (2.0 * (at as f64 + 0.5) / self.size[axis] as f64 - 1.0)
    }
    /// Columns or rows that a triangle can cover: all, when part of it is beside the eye or behind.
    fn span(&self, seen: &Corners, axis: usize) -> std::ops::Range<usize> {
        let count = self.size[axis] as f64;
        if seen.iter().any(|p| p[2] <= 0.0) {
            return 0..self.size[axis];
        }
        let at = seen.map(|p| (p[axis] * self.view.focal / (p[2] * self.view.half[axis]) + 1.0) / 2.0 * count);
        let (low, high) = at.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
        // A pixel more on both sides, for rounding.
        let clamp = |x: f64| x.clamp(0.0, count) as usize;
        clamp(low.floor() - 1.0)..clamp(high.ceil() + 1.0)
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Normal of the plane through the eye and an edge; of the edge's other direction exactly its negative.
fn edge(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    if a < b { cross(a, b) } else { cross(b, a).map(|x| -x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View::new([0.0; 3], [0.0, 1.0, 0.0], 100.0, [100.0, 50.0]).unwrap()
    }

    #[test]
    fn a_plane_below_and_behind_the_eye_covers_what_its_rays_meet() {
        let view = view();
        let image = Image { view: &view, size: [64, 32] };
        let [a, b, c, d] = [[-4e3, -400.0], [4e3, -400.0], [4e3, 3000.0], [-4e3, 3000.0]].map(|[x, y]| [x, y, -50.0]);
        let mut covered = vec![false; 64 * 32];
        [[a, b, c], [a, c, d]].iter().for_each(|part| image.each(part, |pixel, _| covered[pixel] = true));
        for (pixel, covered) in covered.iter().enumerate() {
            // The ray (x, 1, z) meets the plane where y = −50 ÷ z.
            let z = image.place(1, pixel / 64) / 100.0;
            assert_eq!(*covered, z < 0.0 && -50.0 / z <= 3000.0, "{pixel}");
        }
    }

    #[test]
    fn a_wall_leaves_no_background_and_one_with_a_gap_or_behind_the_eye_does() {
        let view = view();
        let image = Image { view: &view, size: [64, 32] };
        let wall = |y: f64, gap: f64| {
            let [a, b, c, d] = [[-900.0, y, -900.0], [900.0, y, -900.0], [900.0, y, 900.0], [-900.0, y, 900.0]];
            let up = |p: [f64; 3]| [p[0], p[1], p[2] + gap];
            [[a, b, c], [a, c, d].map(up)]
        };
        assert_eq!(image.background(&wall(200.0, 0.0)), 0);
        assert!(image.background(&wall(200.0, 8.0)) > 10);
        assert_eq!(image.background(&wall(-200.0, 0.0)), 64 * 32);
        assert!(image.shows(&wall(200.0, 0.0)[0]) && !image.shows(&wall(-200.0, 0.0)[0]));
    }
}
