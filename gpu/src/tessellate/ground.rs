//! A heightfield on 2ᵖ × 2ᵖ cells with its normals, and a pyramid that encloses what Phong tessellation
//! makes of each block of cells. A raster of another size has its south-west part of them: vertices beyond its north and east
//! borders are drawn back to these, so that triangles beyond have no area and those across end there.

pub use super::page::{Block, Sample};
use super::page::{Frame, Page, Window};
use super::pages::{Elevations, LEVELS, PAGE, Pages, Residence, Summary};
use super::triangle::{SIDE, Triangle, Vertex};
use std::ops::Deref;
use std::sync::Arc;
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
    /// Elevations could not be read.
    #[error("{0}")]
    Source(String),
}

/// A heightfield ready for tessellation. Coordinates are metres from its south-west corner.
pub struct Ground {
    cells: usize,
    /// Cells of the raster, at most `cells`.
    inside: [usize; 2],
    spacing: [f64; 2],
    alpha: f64,
    store: Store,
    /// Levels of enclosures below the first of `top`.
    base: usize,
    /// Level k has (cells >> (base + k))² blocks.
    top: Vec<Vec<Block>>,
    range: [f64; 2],
}

enum Store {
    Whole(Page),
    Paged(Pages),
}

/// A page, where it is.
enum Held<'a> {
    Whole(&'a Page),
    Paged(Arc<Page>),
}

impl Deref for Held<'_> {
    type Target = Page;
    fn deref(&self) -> &Page {
        match self {
            Held::Whole(page) => page,
            Held::Paged(page) => page,
        }
    }
}

impl Ground {
    /// Prepares `grid` for Phong tessellation with weight `alpha`.
    ///
    /// # Errors
    /// [`GroundError`].
    pub fn new(grid: &Grid<f64>, alpha: f64) -> Result<Ground, GroundError> {
        let (width, height, spacing) = (grid.width(), grid.height(), grid.spacing());
        check([width, height], alpha)?;
        if grid.crs().is_some_and(terrain_model::grid::Crs::is_geographic) {
            return Err(GroundError::Geographic);
        }
        if let Some(at) = grid.values().iter().position(|z| !z.is_finite()) {
            return Err(GroundError::Hole { i: at % width, j: at / width });
        }
        let cells = (width.max(height) - 1).next_power_of_two();
        let (inside, spacing) = ([width - 1, height - 1], spacing.to_array());
        let window = Window { first: [0; 2], width, values: grid.values().to_vec() };
        let mut page = Frame { inside, spacing, alpha }.page([0; 2], cells, &window);
        let (top, range) = (page.take_pyramid(), page.range());
        Ok(Ground { cells, inside, spacing, alpha, store: Store::Whole(page), base: 0, top, range })
    }

    /// The same of a source that is read page by page, [`PAGE`] cells wide, with at most `most` pages in memory (at least 4). All of it is
    /// read once now, for the enclosures that stay.
    ///
    /// # Errors
    /// [`GroundError`]; sources are expected to refuse degrees themselves.
    pub fn paged(source: Box<dyn Elevations>, alpha: f64, most: usize) -> Result<Ground, GroundError> {
        let ([width, height], spacing) = (source.size(), source.spacing());
        check([width, height], alpha)?;
        let cells = (width.max(height) - 1).next_power_of_two().max(PAGE);
        let inside = [width - 1, height - 1];
        let (pages, Summary { top, range }) = Pages::new(source, Frame { inside, spacing, alpha }, cells, most)?;
        Ok(Ground { cells, inside, spacing, alpha, store: Store::Paged(pages), base: LEVELS, top, range })
    }
    /// What a source on disk said when it failed after it was opened; where it did the ground is level.
    pub fn failure(&self) -> Option<String> {
        match &self.store {
            Store::Whole(_) => None,
            Store::Paged(pages) => pages.failure(),
        }
    }
    /// How many pages there are and were needed; none of a raster in memory.
    pub fn residence(&self) -> Option<Residence> {
        match &self.store {
            Store::Whole(_) => None,
            Store::Paged(pages) => Some(pages.residence()),
        }
    }
    fn page(&self, cell: [usize; 2]) -> Held<'_> {
        match &self.store {
            Store::Whole(page) => Held::Whole(page),
            Store::Paged(pages) => Held::Paged(pages.with(cell)),
        }
    }
    fn corners(&self, cell: [usize; 2]) -> [Sample; 4] {
        self.page(cell).corners(cell)
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
    /// Every sample, row by row from the south-west; `None` of a raster in pages.
    pub fn samples(&self) -> Option<&[Sample]> {
        match &self.store {
            Store::Whole(page) => Some(page.samples()),
            Store::Paged(_) => None,
        }
    }
    /// Enclosures that are in memory, from the finest to the whole, each level row by row from the south-west.
    pub fn pyramid(&self) -> &[Vec<Block>] {
        &self.top
    }
    /// Blocks along a side of the finest of [`Ground::pyramid`].
    pub fn blocks(&self) -> usize {
        self.cells >> self.base
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
        while level + 1 < self.base + self.top.len() && (unit << level) * 2 < reach {
            level += 1;
        }
        let side = self.cells >> level;
        let index = |x: i64| (x.max(0) / (unit << level)).min(side as i64 - 1) as usize;
        let block = |i: usize, j: usize| match level.checked_sub(self.base) {
            Some(above) => self.top[above][j * side + i],
            None => {
                let across = PAGE >> level;
                let page = self.page([i << level, j << level]);
                page.pyramid()[level][(j % across) * across + i % across]
            }
        };
        let [x, y] = centre.map(i64::from);
        let mut whole = block(index(x), index(y));
        for j in index(y - reach - 1)..=index(y + reach) {
            for i in index(x - reach - 1)..=index(x + reach) {
                whole = whole.union(block(i, j));
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
        let corners = self.corners(cell);
        let mean = |values: [R; 4]| (0..4).map(|k| weights[k] * values[k]).fold(R::zero(), |sum, part| sum + part);
        let heights = corners.map(|c| R::constant(c.height) - R::constant(datum));
        let z = mean(heights);
        let [sx, sy] = self.spacing.map(R::constant);
        let (mut shift, mut normal) = ([R::zero(); 3], [R::zero(); 3]);
        for k in 0..4 {
            let n = corners[k].normal.map(R::constant);
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
            curvature: mean(corners.map(|c| R::constant(c.curvature))),
        }
    }
    /// Elevation of the raster itself, bilinear, metres; nearest beyond the borders.
    pub fn elevation(&self, at: [f64; 2]) -> f64 {
        let place = [0, 1].map(|k| (at[k] / self.spacing[k]).clamp(0.0, self.inside[k] as f64));
        let cell: [usize; 2] = [0, 1].map(|k| (place[k] as usize).min(self.inside[k] - 1));
        let [u, v] = [0, 1].map(|k| place[k] - cell[k] as f64);
        let [a, b, c, d] = self.corners(cell).map(|c| c.height);
        (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
    }
    /// Lowest and highest elevation, without displacement.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }
    /// West to east and south to north, metres between samples.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }
}

fn check([width, height]: [usize; 2], alpha: f64) -> Result<(), GroundError> {
    if !(2..=16_385).contains(&width) || !(2..=16_385).contains(&height) {
        return Err(GroundError::Size { width, height });
    }
    if (0.0..=1.0).contains(&alpha) { Ok(()) } else { Err(GroundError::Alpha(alpha)) }
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
