//! A square of cells with everything that is derived of its elevations: normals, curvatures and the finest enclosures. A whole raster in
//! memory is one such square; one on disk is many, each made when it is first asked for, to the same bits.

use super::view::unit;

/// What a block of cells can become before noise: elevations, and how far a point can move from its undisplaced place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Lowest and highest elevation, metres.
    pub elevation: [f64; 2],
    /// The farthest move, metres.
    pub moved: f64,
}

impl Block {
    pub(super) fn union(self, other: Block) -> Block {
        let ([a, b], [c, d]) = (self.elevation, other.elevation);
        Block { elevation: [a.min(c), b.max(d)], moved: self.moved.max(other.moved) }
    }
}

/// A sample and what is derived there.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Elevation, metres.
    pub height: f64,
    /// Unit normal.
    pub normal: [f64; 3],
    /// Laplacian of the elevation, 1/m.
    pub curvature: f64,
}

/// What all pages of a raster share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Cells of the raster.
    pub inside: [usize; 2],
    /// Metres of a cell.
    pub spacing: [f64; 2],
    /// Weight of Phong tessellation.
    pub alpha: f64,
}

/// Elevations of some columns and rows.
pub(super) struct Window {
    /// The first column and row.
    pub first: [usize; 2],
    /// Columns.
    pub width: usize,
    /// Row by row from the south.
    pub values: Vec<f64>,
}

impl Window {
    fn at(&self, i: usize, j: usize) -> f64 {
        self.values[(j - self.first[1]) * self.width + i - self.first[0]]
    }
}

/// A square of cells.
pub(super) struct Page {
    first: [usize; 2],
    side: usize,
    samples: Vec<Sample>,
    /// Level k has (side >> k)² blocks.
    pyramid: Vec<Vec<Block>>,
}

impl Frame {
    /// Columns and rows that a page of `side` cells from `first` on is made of: its own samples, and what slopes and curvatures of the
    /// outer ones need. Samples beyond the raster are those of its border.
    pub fn reads(&self, first: [usize; 2], side: usize) -> [[usize; 2]; 2] {
        let low = [0, 1].map(|k| first[k].min(self.inside[k]).saturating_sub(2));
        let high = [0, 1].map(|k| ((first[k] + side).min(self.inside[k]) + 1).max(2).min(self.inside[k]));
        [low, high]
    }
    /// The page, of a window that holds what it reads.
    pub fn page(&self, first: [usize; 2], side: usize, window: &Window) -> Page {
        let (n, inside, [sx, sy]) = (side + 1, self.inside, self.spacing);
        let z = |i: usize, j: usize| window.at(i, j);
        let bend = |before: f64, here: f64, after: f64, s: f64| (before - 2.0 * here + after) / (s * s);
        let sample = |at: usize| {
            let [i, j] = [(first[0] + at % n).min(inside[0]), (first[1] + at / n).min(inside[1])];
            let (w, e) = (i.saturating_sub(1), (i + 1).min(inside[0]));
            let (so, no) = (j.saturating_sub(1), (j + 1).min(inside[1]));
            let dx = (z(e, j) - z(w, j)) / ((e - w) as f64 * sx);
            let dy = (z(i, no) - z(i, so)) / ((no - so) as f64 * sy);
            // At the border the nearest inner sample's.
            let [a, b] = [i.clamp(1, inside[0].max(2) - 1), j.clamp(1, inside[1].max(2) - 1)];
            let ([w, e], [so, no]) = ([a - 1, (a + 1).min(inside[0])], [b - 1, (b + 1).min(inside[1])]);
            let curvature = bend(z(w, b), z(a, b), z(e, b), sx) + bend(z(a, so), z(a, b), z(a, no), sy);
            Sample { height: z(i, j), normal: unit([-dx, -dy, 1.0]), curvature }
        };
        let mut page = Page { first, side, samples: (0..n * n).map(sample).collect(), pyramid: Vec::new() };
        page.pyramid = page.build(self);
        page
    }
}

impl Page {
    /// Phong tessellation moves p by −α Σ wᵢ ((p − pᵢ)·nᵢ) nᵢ, so by at most α maxᵢ |(p − pᵢ)·nᵢ|, and each of these
    /// by at most sx|nx| + sy|ny| + (highest − lowest)·nz within a cell of sides sx and sy. 1e-9 covers rounding.
    fn build(&self, frame: &Frame) -> Vec<Vec<Block>> {
        let [sx, sy] = frame.spacing;
        let cell = |at: usize| {
            let corners = self.local(at % self.side, at / self.side);
            let z = corners.map(|c| c.height);
            let (low, high) = z.iter().fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(*z), h.max(*z)));
            let off = corners.iter().fold(0.0f64, |most, c| {
                let [x, y, z] = c.normal;
                most.max(sx * x.abs() + sy * y.abs() + (high - low) * z)
            });
            let rounding = 1e-9 * (low.abs().max(high.abs()) + sx + sy);
            let moved = frame.alpha * off + rounding;
            Block { elevation: [low - moved, high + moved], moved }
        };
        halved((0..self.side * self.side).map(cell).collect(), self.side)
    }
    fn local(&self, i: usize, j: usize) -> [Sample; 4] {
        let at = j * (self.side + 1) + i;
        [at, at + 1, at + self.side + 1, at + self.side + 2].map(|at| self.samples[at])
    }
    /// Corners of a cell of the raster.
    pub fn corners(&self, cell: [usize; 2]) -> [Sample; 4] {
        self.local(cell[0] - self.first[0], cell[1] - self.first[1])
    }
    /// All samples, row by row from the south-west.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }
    /// Enclosures from single cells to the whole page.
    pub fn pyramid(&self) -> &[Vec<Block>] {
        &self.pyramid
    }
    /// Lowest and highest elevation.
    pub fn range(&self) -> [f64; 2] {
        self.samples.iter().fold([f64::MAX, f64::MIN], |[low, high], s| [low.min(s.height), high.max(s.height)])
    }
    /// Gives its enclosures away.
    pub fn take_pyramid(&mut self) -> Vec<Vec<Block>> {
        std::mem::take(&mut self.pyramid)
    }
    /// Leaves the levels from `count` on to whoever keeps them for all pages.
    pub fn keep_levels(&mut self, count: usize) {
        self.pyramid.truncate(count);
    }
}

/// Level after level above `side`² blocks, up to one.
pub(super) fn halved(blocks: Vec<Block>, mut side: usize) -> Vec<Vec<Block>> {
    let mut pyramid = vec![blocks];
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
