//! Polygonisation: marching cubes over a lattice, whole (the baseline of Paris 2019 §7) or only where enclosures of the
//! field leave room for the surface. Both give the same mesh to the bit.

pub mod check;
pub mod columns;
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
use pieces::{BLOCK, Builder, Piece, key};
use rayon::prelude::*;
use root::bracket;
use table::{EDGES, TRIANGLES};
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
                .map(|k| {
                    let across = nx.div_ceil(BLOCK);
                    let at = [k % across * BLOCK, k / across * BLOCK, low];
                    let mut block = Block { builder: Builder::new(at), report: Report::default() };
                    self.each_group(at, |group| {
                        let value = |[x, y, z]: [usize; 3]| layers[z - low][y * (nx + 1) + x];
                        self.group(self.field, group, value, &mut block);
                    });
                    block.finish()
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
            .flat_map_iter(|k: usize| {
                let at = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
                let at = std::array::from_fn(|axis| (from[axis] + at[axis]) * TOP);
                let mut made = Vec::new();
                let mut report = Report::default();
                self.descend(self.field, at, TOP, [low, high], &mut made, &mut report);
                // What was proved empty has no piece.
                made.push((report, None));
                made
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
        let cells = self.lattice.cells();
        let high = self.clipped(low, side);
        let at_border = (0..3).any(|axis| low[axis] == 0 || high[axis] == cells[axis]);
        let (bounds, rest) = field.narrow(&self.lattice.region(low, high));
        report.enclosures += 1;
        let range = bounds.range;
        let rock = range.lo() > THRESHOLD;
        // Rock at the border still has a wall there.
        (range.hi() > THRESHOLD && (!rock || at_border)).then_some((rest, rock))
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
        made: &mut Vec<Made>,
        report: &mut Report,
    ) {
        let [from, to] = within;
        if (0..3).any(|axis| low[axis] + side <= from[axis] || low[axis] >= to[axis]) {
            return;
        }
        let Some((field, _)) = self.undecided(field, low, side, report) else { return };
        if side > BLOCK {
            for at in self.eighths(low, side) {
                self.descend(&field, at, side / 2, within, made, report);
            }
            return;
        }
        let mut block = Block { builder: Builder::new(low), report: Report::default() };
        self.groups(&field, low, side, &mut block);
        made.push(block.finish());
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

    /// The cubes of one group. Where all of it is `rock` only the lattice's border is left to be made a wall.
    fn filled(&self, field: &F, rock: bool, low: [usize; 3], block: &mut Block) {
        const SIDE: usize = GROUP + 1;
        let high = self.clipped(low, GROUP);
        let mut axes = [[0.0; SIDE]; 3];
        let counts: [usize; 3] = std::array::from_fn(|axis| high[axis] - low[axis] + 1);
        for axis in 0..3 {
            (0..counts[axis]).for_each(|k| axes[axis][k] = self.lattice.coordinate(axis, low[axis] + k, 0.0));
        }
        let mut values = [0.0; SIDE * SIDE * SIDE];
        let values = &mut values[..counts.iter().product()];
        let [xs, ys, zs]: [&[f64]; 3] = std::array::from_fn(|axis| &axes[axis][..counts[axis]]);
        if rock {
            values.fill(2.0 * THRESHOLD);
        } else {
            field.fill([xs, ys, zs], values);
            if field.is_bare() {
                block.report.lookups += (counts[0] * counts[1]) as u64;
            } else {
                block.report.corner_evaluations += values.len() as u64;
            }
        }
        self.border(low, counts, values);
        let [nx, ny, nz] = counts;
        let near = [0, 1, nx, nx + 1].map(|c| [c, c + nx * ny]);
        // Which corners of a row are rock, a bit each.
        let mut rows = [0u32; SIDE * SIDE];
        for (row, values) in rows.iter_mut().zip(values.chunks_exact(nx)) {
            *row = values.iter().rev().fold(0, |bits, f| bits << 1 | u32::from(*f > THRESHOLD));
        }
        block.report.cells += ((nx - 1) * (ny - 1) * (nz - 1)) as u64;
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                let four = [z * ny + y, z * ny + y + 1, (z + 1) * ny + y, (z + 1) * ny + y + 1].map(|k| rows[k]);
                let (any, all) = (four[0] | four[1] | four[2] | four[3], four[0] & four[1] & four[2] & four[3]);
                let mut crossed = (any | any >> 1) & !(all & all >> 1) & ((1 << (nx - 1)) - 1);
                while crossed != 0 {
                    let x = crossed.trailing_zeros() as usize;
                    crossed &= crossed - 1;
                    let first = (z * ny + y) * nx + x;
                    let corner = |c: usize| values[first + near[c & 3][c >> 2]];
                    self.cell(field, rock, [low[0] + x, low[1] + y, low[2] + z], std::array::from_fn(corner), block);
                }
            }
        }
    }

    /// Air at the corners of a filled group that are on the lattice's border.
    fn border(&self, low: [usize; 3], counts: [usize; 3], values: &mut [f64]) {
        let cells = self.lattice.cells();
        let at_border = |axis: usize| low[axis] == 0 || low[axis] + counts[axis] > cells[axis];
        if !(0..3).any(at_border) {
            return;
        }
        for (k, value) in values.iter_mut().enumerate() {
            let at = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
            if self.lattice.on_border(std::array::from_fn(|axis| low[axis] + at[axis])) {
                *value = 0.0;
            }
        }
    }

    /// The cubes of one group, with `value` at their corners.
    fn group(&self, field: &F, low: [usize; 3], value: impl Fn([usize; 3]) -> f64, block: &mut Block) {
        let high = self.clipped(low, GROUP);
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                for x in low[0]..high[0] {
                    block.report.cells += 1;
                    let corner = |c: usize| value([x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)]);
                    self.cell(field, false, [x, y, z], std::array::from_fn(corner), block);
                }
            }
        }
    }

    /// The triangles of one cube, and the vertices on the three edges at its lowest corner: every crossed edge is that of
    /// the one cube whose lowest corner begins it.
    fn cell(&self, field: &F, solid: bool, at: [usize; 3], corners: [f64; 8], block: &mut Block) {
        let mut rock = 0;
        for (c, f) in corners.iter().enumerate() {
            rock |= usize::from(*f > THRESHOLD) << c;
        }
        if rock == 0 || rock == 255 {
            return;
        }
        for axis in 0..3 {
            let other = 1 << axis;
            if (rock ^ (rock >> other)) & 1 == 1 {
                let ends = [corners[0], corners[other]];
                let [position, normal] = self.vertex(field, solid, at, axis, ends, &mut block.report);
                block.builder.vertex(at, axis, position, normal);
            }
        }
        let edge = |e: u8| {
            let (e, low) = (usize::from(e), EDGES[usize::from(e)][0]);
            key([at[0] + (low & 1), at[1] + (low >> 1 & 1), at[2] + (low >> 2)], e / 4)
        };
        TRIANGLES[rock].iter().for_each(|t| block.builder.triangle(t.map(edge)));
    }

    /// Position and normal of the vertex on a crossed edge.
    fn vertex(
        &self,
        field: &F,
        solid: bool,
        at: [usize; 3],
        axis: usize,
        ends: [f64; 2],
        report: &mut Report,
    ) -> [DVec3; 2] {
        let out = if ends[1] > THRESHOLD { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
        let value = |share: f64| field.value(self.lattice.on_edge(at, axis, share));
        let mut ends = ends;
        let mut values = 0;
        // An end on the border counts as air; only there can it be rock for the field.
        if let Some(end) = self.border_end(at, axis) {
            // Rock up to the border: the wall is there.
            let wall = [self.lattice.on_edge(at, axis, end as f64), out];
            if solid {
                return wall;
            }
            ends[end] = value(end as f64);
            values = 1;
            if ends[end] > THRESHOLD {
                *(if field.is_bare() { &mut report.lookups } else { &mut report.root_evaluations }) += values;
                return wall;
            }
        }
        let root = bracket(ends, self.tolerance / self.lattice.spacing(), value);
        values += root.values;
        *(if field.is_bare() { &mut report.lookups } else { &mut report.root_evaluations }) += values;
        let p = self.lattice.on_edge(at, axis, root.share);
        report.gradients += 1;
        let normal = -field.sample(p).1;
        // At a crease ∇f is that of one side.
        [p, if normal.dot(out) > 0.0 { normal.normalize_or(out) } else { out }]
    }

    /// Which end of an edge is on the lattice's border; `None` when neither is.
    fn border_end(&self, at: [usize; 3], axis: usize) -> Option<usize> {
        let mut other = at;
        other[axis] += 1;
        [at, other].iter().position(|end| self.lattice.on_border(*end))
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

/// A block in the making.
struct Block {
    builder: Builder,
    report: Report,
}

/// What making a block has cost, and the piece that came of it.
type Made = (Report, Option<(u64, Piece)>);

impl Block {
    fn finish(self) -> Made {
        (self.report, self.builder.finish())
    }
}

impl Pieces {
    fn take(&mut self, made: Vec<Made>) {
        for (report, piece) in made {
            self.report = self.report.plus(report);
            self.pieces.extend(piece);
        }
    }
}

#[cfg(test)]
mod tests;
