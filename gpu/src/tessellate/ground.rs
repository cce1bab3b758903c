//! A heightfield on 2ᵖ × 2ᵖ cells with its normals, and a pyramid that encloses what Phong tessellation
//! makes of each block of cells. A raster of another size is continued flat beyond its north and east borders.

use super::triangle::{SIDE, Vertex};
use super::view::unit;
use terrain_model::grid::Grid;
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
    spacing: [f64; 2],
    alpha: f64,
    heights: Vec<f64>,
    normals: Vec<[f64; 3]>,
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
        if !(0.0..=1.0).contains(&alpha) {
            return Err(GroundError::Alpha(alpha));
        }
        if let Some(at) = grid.values().iter().position(|z| !z.is_finite()) {
            return Err(GroundError::Hole { i: at % width, j: at / width });
        }
        let cells = (width.max(height) - 1).next_power_of_two();
        let n = cells + 1;
        let sample = |i: usize, j: usize| grid.values()[j.min(height - 1) * width + i.min(width - 1)];
        let heights: Vec<f64> = (0..n * n).map(|at| sample(at % n, at / n)).collect();
        let [sx, sy] = spacing.to_array();
        let normals = (0..n * n)
            .map(|at| {
                let (i, j) = (at % n, at / n);
                let (w, e) = (i.saturating_sub(1), (i + 1).min(cells));
                let (so, no) = (j.saturating_sub(1), (j + 1).min(cells));
                let dx = (heights[j * n + e] - heights[j * n + w]) / ((e - w) as f64 * sx);
                let dy = (heights[no * n + i] - heights[so * n + i]) / ((no - so) as f64 * sy);
                unit([-dx, -dy, 1.0])
            })
            .collect();
        let mut ground = Ground { cells, spacing: [sx, sy], alpha, heights, normals, pyramid: Vec::new() };
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
    /// Metres of a cell, from west to east and from south to north.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }
    /// The weight of Phong tessellation.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }
    /// Elevation and normal at the corners of a cell: south-west, south-east, north-west, north-east.
    pub fn samples_about(&self, cell: [u32; 2]) -> [(f64, [f64; 3]); 4] {
        self.corners(cell[0] as usize, cell[1] as usize).map(|c| (self.heights[c], self.normals[c]))
    }
    /// Elevation and normal of every sample, row by row from the south-west.
    pub fn samples(&self) -> impl Iterator<Item = (f64, [f64; 3])> {
        self.heights.iter().copied().zip(self.normals.iter().copied())
    }
    /// Enclosures from single cells to the whole, each level row by row from the south-west.
    pub fn pyramid(&self) -> &[Vec<Block>] {
        &self.pyramid
    }
    /// Sides of the domain from west to east and from south to north, metres.
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
        let unit_of = SIDE / self.cells as u32;
        let cell = vertex.map(|x| ((x / unit_of) as usize).min(self.cells - 1));
        let [u, v] = [0, 1].map(|k| f64::from(vertex[k] - cell[k] as u32 * unit_of) / f64::from(unit_of));
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let corners = self.corners(cell[0], cell[1]);
        let [x, y] = self.metres(vertex);
        let z: f64 = (0..4).map(|k| weights[k] * self.heights[corners[k]]).sum();
        let (mut shift, mut normal) = ([0.0; 3], [0.0; 3]);
        for k in 0..4 {
            let n = self.normals[corners[k]];
            let at = |axis: usize, side: usize| (cell[axis] + side) as f64 * self.spacing[axis];
            let from = [x - at(0, k % 2), y - at(1, k / 2), z - self.heights[corners[k]]];
            let off = super::view::dot(from, n);
            for axis in 0..3 {
                shift[axis] -= weights[k] * off * n[axis];
                normal[axis] += weights[k] * n[axis];
            }
        }
        // Every normal points up, so that no mean of them vanishes.
        (std::array::from_fn(|k| [x, y, z][k] + self.alpha * shift[k]), unit(normal))
    }
}
