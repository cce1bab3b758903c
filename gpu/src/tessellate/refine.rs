//! Which triangles a camera needs: stateless nested longest-edge bisection. Each triangle decides from its own integers,
//! and neighbours decide alike, so that no list of neighbours is kept and no edge opens.
//!
//! A triangle of level l splits if the eye is nearer than R(l) to the vertical segment over the middle of its long edge
//! that spans the enclosure of [`Triangle::reach`]. Both triangles at an edge share middle, level and enclosure, so they
//! decide alike. What is left is that a triangle which splits has a parent that splits *on both sides*: let m′ be the
//! middle of a child of a triangle with middle m. Segments nest in height, and |m − m′| ≤ e(l)/(2√2), where e(l) is the
//! longest of the level's long edges: they differ where cells are not square. So distance(m) ≤ distance(m′) + e(l)/(2√2)
//! < R(l+1) + e(l)/(2√2) ≤ R(l).

use super::coverage::Corners;
use super::displace::Detail;
use super::ground::Ground;
use super::triangle::{FINEST, LATTICE, Triangle, Vertex};
use super::view::View;

/// Everything that decides.
pub struct Refinement<'a> {
    ground: &'a Ground,
    detail: &'a Detail,
    view: View,
    target: f64,
    radii: Vec<f64>,
}

impl<'a> Refinement<'a> {
    /// Edges of about `target` pixels, leaves of level `finest` at most ([`FINEST`] is the most there is).
    pub fn new(ground: &'a Ground, detail: &'a Detail, view: View, target: f64, finest: u32) -> Refinement<'a> {
        let finest = finest.min(FINEST) as usize;
        let mut radii = vec![0.0; finest + 1];
        let [x, y] = ground.sides();
        let mut edge = x.max(y) * std::f64::consts::SQRT_2;
        // Cells need not be square. Nesting wants the longest of the edges, lengths on the screen want the mean.
        let mean = (x * y).sqrt() / x.max(y);
        let edges: Vec<f64> = (0..finest)
            .map(|_| {
                let this = edge;
                edge /= std::f64::consts::SQRT_2;
                this
            })
            .collect();
        let pieces = f64::from(1u32 << (LATTICE / 2));
        for l in (0..finest).rev() {
            // A leaf's long edges are between 1 and 1/√2 of what makes a triangle split, its short ones √2 below: a
            // half to one. A radius √2 smaller centres that on the target, and slopes have room on both sides.
            let wanted = mean * edges[l] * view.focal / (pieces * target * std::f64::consts::SQRT_2);
            // The excess covers rounding of distances, 1e-15 of them each.
            radii[l] = wanted.max(radii[l + 1] + edges[l] / 8.0f64.sqrt()) * (1.0 + 1e-5);
        }
        Refinement { ground, detail, view, target, radii }
    }
    /// The level at which leaves stop.
    pub fn finest(&self) -> u32 {
        self.radii.len() as u32 - 1
    }
    /// Achieved lengths of the lattice edges of `leaf` that have an end in the image, over the target: displaced
    /// edge · focal ÷ distance of its middle. An edge counts once for each of its triangles; those that the raster's border cuts
    /// or that lie beyond it do not count.
    pub fn edge_ratios(&self, leaf: &Triangle) -> Vec<f64> {
        let mut ratios = Vec::new();
        let whole = |triangle: &Triangle| triangle.corners().iter().all(|c| self.ground.within(*c) == *c);
        for corners in self.displaced(leaf, whole) {
            let seen = corners.map(|p| self.view.sees(p));
            for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(i, j)| seen[*i] || seen[*j]) {
                let (mut length, mut distance) = (0.0, 0.0);
                for k in 0..3 {
                    let (along, middle) = (corners[i][k] - corners[j][k], (corners[i][k] + corners[j][k]) / 2.0);
                    length += along * along;
                    distance += (middle - self.view.eye[k]) * (middle - self.view.eye[k]);
                }
                ratios.push((length / distance).sqrt() * self.view.focal / self.target);
            }
        }
        ratios
    }
    /// The displaced triangles of `leaf` over the raster, each vertex computed once.
    pub fn patch(&self, leaf: &Triangle) -> Vec<Corners> {
        self.displaced(leaf, |triangle| self.ground.holds(triangle))
    }
    fn displaced(&self, leaf: &Triangle, wanted: impl Fn(&Triangle) -> bool) -> Vec<Corners> {
        let mut known: Vec<(Vertex, [f64; 3])> = Vec::with_capacity(15);
        let mut place = |vertex: Vertex| match known.iter().find(|(other, _)| *other == vertex) {
            Some((_, p)) => *p,
            None => {
                let p = self.position(vertex);
                known.push((vertex, p));
                p
            }
        };
        let triangles = leaf.lattice(LATTICE).into_iter().filter(wanted);
        triangles.map(|triangle| triangle.corners().map(&mut place)).collect()
    }
    /// What is refined.
    pub fn ground(&self) -> &'a Ground {
        self.ground
    }
    /// What displaces it.
    pub fn detail(&self) -> &'a Detail {
        self.detail
    }
    /// The camera.
    pub fn view(&self) -> &View {
        &self.view
    }
    /// Wanted length of edges, pixels.
    pub fn target(&self) -> f64 {
        self.target
    }
    /// R(l) in metres; the last is 0.
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }
    /// R(l) in metres; the last is 0. For controls: a change breaks the nesting.
    pub fn radii_mut(&mut self) -> &mut [f64] {
        &mut self.radii
    }
    /// Whether `triangle` is bisected.
    pub fn splits(&self, triangle: &Triangle) -> bool {
        let middle = triangle.middle();
        let block = self.detail.widen(self.ground.enclosure(middle, triangle.reach()));
        let radius = self.radii[triangle.level as usize];
        self.view.distance_squared(self.ground.metres(middle), block.elevation) < radius * radius
    }
    /// Whether no displaced point of `triangle` can be in the image.
    pub fn hidden(&self, triangle: &Triangle) -> bool {
        let block = self.detail.widen(self.ground.enclosure(triangle.middle(), triangle.reach()));
        let corners = triangle.corners().map(|c| self.ground.metres(c));
        let (mut low, mut high) = ([0.0, 0.0, block.elevation[0]], [0.0, 0.0, block.elevation[1]]);
        for axis in 0..2 {
            let [a, b, c] = corners.map(|c| c[axis]);
            (low[axis], high[axis]) = (a.min(b).min(c) - block.moved, a.max(b).max(c) + block.moved);
        }
        self.view.misses(low, high)
    }
    /// The leaves, without those that cannot be in the image if `cull`. Beyond the raster there are none.
    pub fn leaves(&self, cull: bool) -> Vec<Triangle> {
        let mut leaves = Vec::new();
        let mut list = Triangle::ROOTS.to_vec();
        while let Some(triangle) = list.pop() {
            if self.ground.beyond(&triangle) || cull && self.hidden(&triangle) {
                continue;
            }
            if self.splits(&triangle) {
                list.extend(triangle.children());
            } else {
                leaves.push(triangle);
            }
        }
        leaves
    }
    /// Distance of vertices that the camera asks for at `vertex`, metres: what bands are limited by. It depends on the
    /// vertex and the camera alone, so that leaves of two levels agree on a vertex they share.
    pub fn size(&self, vertex: Vertex) -> f64 {
        let (p, _) = self.ground.smooth(vertex);
        self.target * self.view.distance_squared([p[0], p[1]], [p[2]; 2]).sqrt() / self.view.focal
    }
    /// Displaced position of `vertex`.
    pub fn position(&self, vertex: Vertex) -> [f64; 3] {
        self.detail.position(self.ground, vertex, self.size(vertex))
    }
    /// Unit normal of the displaced surface at `vertex`.
    pub fn normal(&self, vertex: Vertex) -> [f64; 3] {
        self.detail.normal(self.ground, vertex, self.size(vertex))
    }
}
