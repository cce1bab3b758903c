//! A heightfield on 2ᵖ × 2ᵖ cells with its normals, and a pyramid that encloses what Phong tessellation
//! makes of each block of cells. A raster of another size has its south-west part of them: vertices beyond its north and east
//! borders are drawn back to these, so that triangles beyond have no area and those across end there.

use super::triangle::{SIDE, Triangle, Vertex};
use super::view::unit;
use terrain_model::grid::Grid;
use terrain_model::real::Real;
use thiserror::Error;

/// A raster that cannot be tessellated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GroundError {
    /// Fewer than two samples along a side, or more than 16385.
    #[error("{width} × {height} samples; tessellation takes 2 to 16385 along each side")]
    Size {
        /// Samples from west to east.
        width: usize,
        /// Samples from south to north.
        height: usize,
    },
    /// Degrees are no lengths.
    #[error("the raster is in degrees; make it metric first: `terrain convert --local-metres`")]
    Geographic,
    /// An elevation is not finite.
    #[error("the elevation at column {i}, row {j} from the south is not finite; fill holes first")]
    Hole {
        /// Column.
        i: usize,
        /// Row.
        j: usize,
    },
    /// Phong's α lies outside [0, 1].
    #[error("α = {0}; Phong tessellation takes 0 (flat) to 1")]
    Alpha(f64),
}

/// What a block of cells can become before noise: elevations, and how far a point can move from its undisplaced place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Lowest and highest elevation, metres.
    pub elevation: [f64; 2],
    /// The farthest move, metres.
    pub moved: f64,
}

impl Block {
    fn union(self, other: Block) -> Block {
        let ([a, b], [c, d]) = (self.elevation, other.elevation);
        Block { elevation: [a.min(c), b.max(d)], moved: self.moved.max(other.moved) }
    }
}

/// A heightfield ready for tessellation. Coordinates are metres from its south-west corner.
pub struct Ground {
    cells: usize,
    /// Cells of the raster, at most `cells`.
    inside: [usize; 2],
    spacing: [f64; 2],
    alpha: f64,
    heights: Vec<f64>,
    normals: Vec<[f64; 3]>,
    curvatures: Vec<f64>,
    /// Level k has (cells >> k)² blocks.
    pyramid: Vec<Vec<Block>>,
}

impl Ground {
    /// Prepares `grid` for Phong tessellation with weight `alpha`.
    ///
    /// # Errors
    /// [`GroundError`].
    pub fn new(grid: &Grid<f64>, alpha: f64) -> Result<Ground, GroundError> {
        let (width, height, spacing) = (grid.width(), grid.height(), grid.spacing());
        if !(2..=16_385).contains(&width) || !(2..=16_385).contains(&height) {
            return Err(GroundError::Size { width, height });
        }
        if grid.crs().is_some_and(terrain_model::grid::Crs::is_geographic) {
            return Err(GroundError::Geographic);
        }
        if !(0.0..=1.0).contains(&alpha) {
            return Err(GroundError::Alpha(alpha));
        }
        if let Some(at) = grid.values().iter().position(|z| !z.is_finite()) {
            return Err(GroundError::Hole { i: at % width, j: at / width });
        }
        let cells = (width.max(height) - 1).next_power_of_two();
        let n = cells + 1;
        let inside = [width - 1, height - 1];
        let nearest = |at: usize| [(at % n).min(inside[0]), (at / n).min(inside[1])];
        let z = |i: usize, j: usize| grid.values()[j * width + i];
        let heights = (0..n * n).map(nearest).map(|[i, j]| z(i, j)).collect();
        let [sx, sy] = spacing.to_array();
        let normals = (0..n * n)
            .map(nearest)
            .map(|[i, j]| {
                let (w, e) = (i.saturating_sub(1), (i + 1).min(inside[0]));
                let (so, no) = (j.saturating_sub(1), (j + 1).min(inside[1]));
                let dx = (z(e, j) - z(w, j)) / ((e - w) as f64 * sx);
                let dy = (z(i, no) - z(i, so)) / ((no - so) as f64 * sy);
                unit([-dx, -dy, 1.0])
            })
            .collect();
        let bend = |before: f64, here: f64, after: f64, s: f64| (before - 2.0 * here + after) / (s * s);
        let curvatures = (0..n * n)
            .map(nearest)
            .map(|at| {
                // At the border the nearest inner sample's.
                let [i, j] = [0, 1].map(|k| at[k].clamp(1, inside[k].max(2) - 1));
                let ([w, e], [so, no]) = ([i - 1, (i + 1).min(inside[0])], [j - 1, (j + 1).min(inside[1])]);
                bend(z(w, j), z(i, j), z(e, j), sx) + bend(z(i, so), z(i, j), z(i, no), sy)
            })
            .collect();
        let mut ground =
            Ground { cells, inside, spacing: [sx, sy], alpha, heights, normals, curvatures, pyramid: Vec::new() };
        ground.pyramid = ground.build();
        Ok(ground)
    }

    /// Phong tessellation moves p by −α Σ wᵢ ((p − pᵢ)·nᵢ) nᵢ, so by at most α maxᵢ |(p − pᵢ)·nᵢ|, and each of these
    /// by at most sx|nx| + sy|ny| + (highest − lowest)·nz within a cell of sides sx and sy. 1e-9 covers rounding.
    fn build(&self) -> Vec<Vec<Block>> {
        let [sx, sy] = self.spacing;
        let cell = |at: usize| {
            let corners = self.corners(at % self.cells, at / self.cells);
            let z = corners.map(|c| self.heights[c]);
            let (low, high) = z.iter().fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(*z), h.max(*z)));
            let off = corners.iter().fold(0.0f64, |most, c| {
                let [x, y, z] = self.normals[*c];
                most.max(sx * x.abs() + sy * y.abs() + (high - low) * z)
            });
            let rounding = 1e-9 * (low.abs().max(high.abs()) + sx + sy);
            let moved = self.alpha * off + rounding;
            Block { elevation: [low - moved, high + moved], moved }
        };
        let mut pyramid = vec![(0..self.cells * self.cells).map(cell).collect::<Vec<Block>>()];
        let mut side = self.cells;
        while side > 1 {
            let below = &pyramid[pyramid.len() - 1];
            let half = side / 2;
            let block = |at: usize| {
                let at = 2 * (at / half) * side + 2 * (at % half);
                below[at].union(below[at + 1]).union(below[at + side]).union(below[at + side + 1])
            };
            let next = (0..half * half).map(block).collect();
            pyramid.push(next);
            side = half;
        }
        pyramid
    }

    fn corners(&self, i: usize, j: usize) -> [usize; 4] {
        let at = j * (self.cells + 1) + i;
        [at, at + 1, at + self.cells + 1, at + self.cells + 2]
    }
    /// Cells along a side: a power of two.
    pub fn cells(&self) -> usize {
        self.cells
    }
    /// Cells of the raster, from west to east and from south to north.
    pub fn inside(&self) -> [usize; 2] {
        self.inside
    }
    /// The weight of Phong tessellation.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }
    /// Elevation and normal of every sample, row by row from the south-west.
    pub fn samples(&self) -> impl Iterator<Item = (f64, [f64; 3])> {
        self.heights.iter().copied().zip(self.normals.iter().copied())
    }
    /// Laplacian of the elevation at every sample, 1/m, in the same order.
    pub fn curvatures(&self) -> &[f64] {
        &self.curvatures
    }
    /// Enclosures from single cells to the whole, each level row by row from the south-west.
    pub fn pyramid(&self) -> &[Vec<Block>] {
        &self.pyramid
    }
    /// The vertex itself, or the nearest on the raster's border.
    pub fn within(&self, vertex: Vertex) -> Vertex {
        let unit = SIDE / self.cells as u32;
        [0, 1].map(|k| vertex[k].min(self.inside[k] as u32 * unit))
    }
    /// The raster's north-east corner.
    pub fn end(&self) -> Vertex {
        self.within([SIDE; 2])
    }
    /// Is nothing of the triangle, and so of its descendants, over the raster?
    pub fn beyond(&self, triangle: &Triangle) -> bool {
        beyond(self.end(), triangle)
    }
    /// Is a part of the triangle over the raster? Those beyond its borders are none: vertices drawn back to a border lie on one line
    /// there, but displacement would bend it and give them an area.
    pub fn holds(&self, triangle: &Triangle) -> bool {
        let [a, b, c] = triangle.corners().map(|corner| self.within(corner).map(i64::from));
        (b[0] - a[0]) * (c[1] - a[1]) != (b[1] - a[1]) * (c[0] - a[0])
    }
    /// Sides of the raster from west to east and from south to north, metres.
    pub fn extent(&self) -> [f64; 2] {
        [0, 1].map(|k| self.inside[k] as f64 * self.spacing[k])
    }
    /// Sides of the square of triangles from west to east and from south to north, metres; at least the raster's.
    pub fn sides(&self) -> [f64; 2] {
        self.spacing.map(|spacing| self.cells as f64 * spacing)
    }
    /// Metres of a grid unit, from west to east and from south to north.
    pub fn unit(&self) -> [f64; 2] {
        self.sides().map(|side| side / f64::from(SIDE))
    }
    /// Metres of a grid coordinate.
    pub fn metres(&self, vertex: Vertex) -> [f64; 2] {
        let sides = self.sides();
        [0, 1].map(|k| f64::from(vertex[k]) * (sides[k] / f64::from(SIDE)))
    }
    /// Encloses the square of half side `reach` about `centre`, grid units.
    ///
    /// A square within another, with at most its reach, gets an enclosure within the other's: it reads no coarser
    /// blocks, and each block that it touches lies in one that the other touches.
    pub fn enclosure(&self, centre: Vertex, reach: i64) -> Block {
        let unit = i64::from(SIDE) / self.cells as i64;
        let mut level = 0;
        while level + 1 < self.pyramid.len() && (unit << level) * 2 < reach {
            level += 1;
        }
        let side = self.cells >> level;
        let index = |x: i64| (x.max(0) / (unit << level)).min(side as i64 - 1) as usize;
        let [x, y] = centre.map(i64::from);
        let blocks = &self.pyramid[level];
        let mut whole = blocks[index(y) * side + index(x)];
        for j in index(y - reach - 1)..=index(y + reach) {
            for i in index(x - reach - 1)..=index(x + reach) {
                whole = whole.union(blocks[j * side + i]);
            }
        }
        whole
    }
    /// Position after Phong tessellation and unit normal at a vertex of the grid: four corners, bilinear weights.
    pub fn smooth(&self, vertex: Vertex) -> ([f64; 3], [f64; 3]) {
        let (cell, share) = self.cell(vertex);
        let Smooth { position, normal, .. } = self.smooth_at(&self.place(cell, share));
        (position, normal)
    }
    /// The raster's cell of a vertex, and where in it, in [0, 1].
    pub(super) fn cell(&self, vertex: Vertex) -> ([usize; 2], [f64; 2]) {
        let (unit, vertex) = (SIDE / self.cells as u32, self.within(vertex));
        let cell: [usize; 2] = [0, 1].map(|k| ((vertex[k] / unit) as usize).min(self.inside[k] - 1));
        (cell, [0, 1].map(|k| f64::from(vertex[k] - cell[k] as u32 * unit) / f64::from(unit)))
    }
    /// The place at `share` in a cell, from the south-west corner.
    pub(super) fn place<R: Real>(&self, cell: [usize; 2], share: [R; 2]) -> Place<R> {
        let plan = [0, 1].map(|k| (R::constant(cell[k] as f64) + share[k]) * R::constant(self.spacing[k]));
        Place { cell, share, plan, datum: 0.0 }
    }
    /// [`Ground::smooth`] at a place, over any number: on duals it carries the tangents.
    pub(super) fn smooth_at<R: Real>(&self, place: &Place<R>) -> Smooth<R> {
        let one = R::one();
        let Place { cell, share: [u, v], plan, datum } = *place;
        let weights = [(one - u) * (one - v), u * (one - v), (one - u) * v, u * v];
        let corners = self.corners(cell[0], cell[1]);
        let mean = |values: [R; 4]| (0..4).map(|k| weights[k] * values[k]).fold(R::zero(), |sum, part| sum + part);
        let heights = corners.map(|c| R::constant(self.heights[c]) - R::constant(datum));
        let z = mean(heights);
        let [sx, sy] = self.spacing.map(R::constant);
        let (mut shift, mut normal) = ([R::zero(); 3], [R::zero(); 3]);
        for k in 0..4 {
            let n = self.normals[corners[k]].map(R::constant);
            let side = |axis: usize| R::constant([(k % 2) as f64, (k / 2) as f64][axis]);
            let from = [(u - side(0)) * sx, (v - side(1)) * sy, z - heights[k]];
            let off = dot3(from, n);
            for axis in 0..3 {
                shift[axis] = shift[axis] - weights[k] * off * n[axis];
                normal[axis] = normal[axis] + weights[k] * n[axis];
            }
        }
        let flat = [plan[0], plan[1], z];
        // Every normal points up, so that no mean of them vanishes.
        let length = dot3(normal, normal).sqrt();
        Smooth {
            position: std::array::from_fn(|k| flat[k] + R::constant(self.alpha) * shift[k]),
            normal: normal.map(|x| x / length),
            curvature: mean(corners.map(|c| R::constant(self.curvatures[c]))),
        }
    }
    /// Elevation of the raster itself, bilinear, metres; nearest beyond the borders.
    pub fn elevation(&self, at: [f64; 2]) -> f64 {
        let place = [0, 1].map(|k| (at[k] / self.spacing[k]).clamp(0.0, self.inside[k] as f64));
        let cell: [usize; 2] = [0, 1].map(|k| (place[k] as usize).min(self.inside[k] - 1));
        let [u, v] = [0, 1].map(|k| place[k] - cell[k] as f64);
        let [a, b, c, d] = self.corners(cell[0], cell[1]).map(|c| self.heights[c]);
        (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
    }
    /// Lowest and highest elevation, without displacement.
    pub fn range(&self) -> [f64; 2] {
        self.heights.iter().fold([f64::MAX, f64::MIN], |[low, high], z| [low.min(*z), high.max(*z)])
    }
    /// West to east and south to north, metres between samples.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }
}

/// Do all corners lie on the north or east border of a raster that ends at `end`, or beyond?
pub(super) fn beyond(end: Vertex, triangle: &Triangle) -> bool {
    let corners = triangle.corners();
    (0..2).any(|k| corners.iter().all(|corner| corner[k] >= end[k]))
}

/// A place in a cell of the raster, with the coordinates it is given.
pub(super) struct Place<R> {
    /// Column and row of the cell.
    pub cell: [usize; 2],
    /// Where in it, in [0, 1].
    pub share: [R; 2],
    /// x and y, metres.
    pub plan: [R; 2],
    /// The elevation that is called 0, metres.
    pub datum: f64,
}

/// The surface before noise.
pub(super) struct Smooth<R> {
    /// Metres.
    pub position: [R; 3],
    /// Unit.
    pub normal: [R; 3],
    /// Laplacian of the raster's elevation, 1/m: positive in valleys.
    pub curvature: R,
}

pub(super) fn dot3<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
