//! Polygonisation: marching cubes over a lattice, whole (the baseline of Paris 2019 §7) or only where enclosures of the
//! field leave room for the surface. Both give the same mesh to the bit.

pub mod check;
pub mod columns;
mod cubes;
mod lattice;
mod pieces;
mod report;
mod root;
mod table;

pub use lattice::Lattice;
pub use pieces::Pieces;
pub use report::Report;

use crate::field::{Box3, Density, THRESHOLD};
use glam::DVec3;
use pieces::{BLOCK, Builder, Piece};
use rayon::prelude::*;
use terrain_model::mesh::Mesh;

/// Cubes a side of the boxes that enclosures are first asked for.
const TOP: usize = 64;
/// Enclosures are asked for down to groups of this many cubes a side, whose corners are then filled together.
const GROUP: usize = 4;

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PolygonizeError {
    /// A lattice without cubes or with too many.
    #[error("a lattice of {cells:?} cubes of {spacing} m: expected 1 to 1048576 along each axis and a positive side")]
    Lattice {
        /// Side of a cube, metres.
        spacing: f64,
        /// Cubes along x, y and z.
        cells: [usize; 3],
    },
    /// A tolerance that no bracket meets.
    #[error("tolerance {tolerance} m: expected {least} m or more, a billionth of the cubes' side")]
    Tolerance {
        /// What was asked, metres.
        tolerance: f64,
        /// The least, metres.
        least: f64,
    },
    /// Two blocks that do not fit: the field answers differently in parts of space than as a whole.
    #[error("blocks do not fit: the field's narrowed values differ from its values")]
    Seam,
    /// More vertices than indices can name.
    #[error("{vertices} vertices: expected fewer than 4294967296; use a wider lattice")]
    TooMany {
        /// How many there would be.
        vertices: usize,
    },
}

/// Makes meshes of one field.
#[derive(Debug)]
pub struct Polygonizer<'a, F> {
    field: &'a F,
    lattice: Lattice,
    tolerance: f64,
}

impl<'a, F: Density> Polygonizer<'a, F> {
    /// Meshes of `field` on `lattice`: every vertex lies on an edge of the lattice within `tolerance` metres of a change of
    /// sign of f − T along it. Corners on the lattice's border count as air: where rock reaches it the mesh is closed by a
    /// wall within `tolerance` of the border.
    ///
    /// # Errors
    /// [`PolygonizeError::Tolerance`] below a billionth of the cubes' side.
    pub fn new(field: &'a F, lattice: Lattice, tolerance: f64) -> Result<Polygonizer<'a, F>, PolygonizeError> {
        let least = lattice.spacing() * 1e-9;
        if tolerance >= least && tolerance.is_finite() {
            Ok(Polygonizer { field, lattice, tolerance })
        } else {
            Err(PolygonizeError::Tolerance { tolerance, least })
        }
    }

    /// Every corner of the lattice is evaluated once: the paper's t₀ and #C₀.
    ///
    /// # Errors
    /// [`PolygonizeError::TooMany`] above 2³² − 1 vertices.
    pub fn standard(&self) -> Result<(Mesh, Report), PolygonizeError> {
        let [nx, ny, nz] = self.lattice.cells();
        let layer = |z: usize| -> Vec<f64> {
            (0..(nx + 1) * (ny + 1)).into_par_iter().map(|k| self.corner([k % (nx + 1), k / (nx + 1), z])).collect()
        };
        let mut total = Pieces { lattice: self.lattice, pieces: Default::default(), report: Report::default() };
        let mut layers = vec![layer(0)];
        for low in (0..nz).step_by(BLOCK) {
            layers.extend((low + 1..=(low + BLOCK).min(nz)).map(layer));
            let blocks = nx.div_ceil(BLOCK) * ny.div_ceil(BLOCK);
            let made: Vec<_> = (0..blocks)
                .into_par_iter()
                .map_init(Block::default, |block, k| {
                    let across = nx.div_ceil(BLOCK);
                    let at = [k % across * BLOCK, k / across * BLOCK, low];
                    block.builder.begin(at);
                    self.each_group(at, |group| {
                        let value = |[x, y, z]: [usize; 3]| layers[z - low][y * (nx + 1) + x];
                        self.group(self.field, group, value, block);
                    });
                    let piece = block.builder.finish();
                    (std::mem::take(&mut block.report), piece.into_iter().collect())
                })
                .collect();
            total.take(made);
            layers.drain(..layers.len() - 1);
        }
        total.report.corner_evaluations = ((nx - 1) * (ny - 1) * (nz - 1)) as u64;
        Ok((total.mesh()?, total.report))
    }

    /// Only groups of cubes over which an enclosure of f holds T are evaluated, and there only what of f is left.
    ///
    /// # Errors
    /// [`PolygonizeError::TooMany`] above 2³² − 1 vertices.
    pub fn sparse(&self) -> Result<(Mesh, Report), PolygonizeError> {
        let pieces = self.pieces();
        Ok((pieces.mesh()?, pieces.report))
    }

    /// The surface in pieces, for [`Polygonizer::mend`].
    pub fn pieces(&self) -> Pieces {
        let mut total = Pieces { lattice: self.lattice, pieces: Default::default(), report: Report::default() };
        total.take(self.blocks_in([0; 3], self.lattice.cells()));
        total
    }

    /// Makes the blocks again that meet `changed`, after the field has changed within that box and nowhere else. The pieces
    /// are then those that [`Polygonizer::pieces`] makes of the changed field.
    ///
    /// Pieces of another lattice are all made again.
    pub fn mend(&self, pieces: &mut Pieces, changed: &Box3) {
        if pieces.lattice != self.lattice {
            *pieces = self.pieces();
            return;
        }
        let Some([low, high]) = self.lattice.cubes_meeting(changed) else { return };
        let low = low.map(|k| k / BLOCK * BLOCK);
        let inside = |k: u64| {
            let at = [k >> 2, k >> 22, k >> 42].map(|x| x as usize & 0xf_ffff);
            (0..3).all(|axis| (low[axis]..high[axis]).contains(&at[axis]))
        };
        pieces.pieces.retain(|&block, _| !inside(block));
        pieces.take(self.blocks_in(low, high));
    }

    /// The blocks that begin from `low` up to, not including, `high`.
    fn blocks_in(&self, low: [usize; 3], high: [usize; 3]) -> Vec<Made> {
        let from = low.map(|k| k / TOP);
        let counts: [usize; 3] = std::array::from_fn(|axis| high[axis].div_ceil(TOP) - from[axis]);
        (0..counts.iter().product())
            .into_par_iter()
            .map_init(Block::default, |block, k: usize| {
                let at = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
                let at = std::array::from_fn(|axis| (from[axis] + at[axis]) * TOP);
                let mut pieces = Vec::new();
                self.descend(self.field, at, TOP, [low, high], block, &mut pieces);
                (std::mem::take(&mut block.report), pieces)
            })
            .collect()
    }

    fn corner(&self, at: [usize; 3]) -> f64 {
        if self.lattice.on_border(at) { 0.0 } else { self.field.value(self.lattice.corner(at)) }
    }

    fn clipped(&self, low: [usize; 3], side: usize) -> [usize; 3] {
        let cells = self.lattice.cells();
        std::array::from_fn(|axis| (low[axis] + side).min(cells[axis]))
    }

    /// What of `field` is left over a box of cubes, and whether that is all rock: unless there is no surface in it.
    fn undecided(&self, field: &F, low: [usize; 3], side: usize, report: &mut Report) -> Option<(F, bool)> {
        let high = self.clipped(low, side);
        let (bounds, rest) = field.narrow(&self.lattice.region(low, high));
        report.enclosures += 1;
        let range = bounds.range;
        let rock = range.lo() > THRESHOLD;
        // Rock at the border still has a wall there.
        (range.hi() > THRESHOLD && (!rock || self.at_border(low, high))).then_some((rest, rock))
    }

    /// Does a box of cubes reach the lattice's border?
    fn at_border(&self, low: [usize; 3], high: [usize; 3]) -> bool {
        (0..3).any(|axis| low[axis] == 0 || high[axis] == self.lattice.cells()[axis])
    }

    /// The eighths of a box of cubes that are in the lattice.
    fn eighths(&self, low: [usize; 3], side: usize) -> impl Iterator<Item = [usize; 3]> {
        let cells = self.lattice.cells();
        let half = side / 2;
        (0..8)
            .map(move |c| std::array::from_fn(|axis| low[axis] + (c >> axis & 1) * half))
            .filter(move |at: &[usize; 3]| (0..3).all(|axis| at[axis] < cells[axis]))
    }

    fn descend(
        &self,
        field: &F,
        low: [usize; 3],
        side: usize,
        within: [[usize; 3]; 2],
        block: &mut Block,
        pieces: &mut Vec<(u64, Piece)>,
    ) {
        let [from, to] = within;
        if (0..3).any(|axis| low[axis] + side <= from[axis] || low[axis] >= to[axis]) {
            return;
        }
        let Some((field, _)) = self.undecided(field, low, side, &mut block.report) else { return };
        if side > BLOCK {
            for at in self.eighths(low, side) {
                self.descend(&field, at, side / 2, within, block, pieces);
            }
            return;
        }
        block.builder.begin(low);
        self.groups(&field, low, side, block);
        pieces.extend(block.builder.finish());
    }

    /// The groups of cubes within a box that may hold the surface.
    fn groups(&self, field: &F, low: [usize; 3], side: usize, block: &mut Block) {
        for at in self.eighths(low, side) {
            let Some((field, rock)) = self.undecided(field, at, side / 2, &mut block.report) else { continue };
            if side / 2 == GROUP {
                self.filled(&field, rock, at, block);
            } else {
                self.groups(&field, at, side / 2, block);
            }
        }
    }

    /// Calls `f` with the groups of a block, in the order of [`Polygonizer::groups`].
    fn each_group(&self, low: [usize; 3], mut f: impl FnMut([usize; 3])) {
        for at in self.eighths(low, BLOCK) {
            self.eighths(at, BLOCK / 2).for_each(&mut f);
        }
    }

    /// How many vertices have no change of sign of f − T within the tolerance along an edge of the lattice: 0, unless the
    /// mesh is not this field's. Border walls are looked up as they are made, air on the border.
    pub fn unproved_vertices(&self, mesh: &Mesh) -> u64 {
        let [low, high] = [[0; 3], self.lattice.cells()].map(|at| self.lattice.corner(at));
        let rock = |p: DVec3| p.cmpgt(low).all() && p.cmplt(high).all() && self.field.value(p) > THRESHOLD;
        let changes = |p: &[f64; 3]| {
            DVec3::AXES.iter().any(|axis| {
                let [a, b] = [-1.0, 1.0].map(|sign| rock(DVec3::from(*p) + *axis * (sign * self.tolerance)));
                a != b
            })
        };
        mesh.positions.par_iter().filter(|p| !changes(p)).count() as u64
    }
}

/// A block in the making, and what making it and those before it has cost.
#[derive(Default)]
struct Block {
    builder: Builder,
    report: Report,
}

/// Pieces by their keys, and what making them has cost.
type Made = (Report, Vec<(u64, Piece)>);

impl Pieces {
    fn take(&mut self, made: Vec<Made>) {
        for (report, pieces) in made {
            self.report = self.report.plus(report);
            self.pieces.extend(pieces);
        }
    }
}

#[cfg(test)]
mod tests;
