//! Polygonisation: marching cubes over a lattice, whole (the baseline of Paris 2019 §7) or only where enclosures of the
//! field leave room for the surface. Both give the same mesh to the bit.

pub mod check;
mod lattice;
mod table;

pub use lattice::Lattice;

use crate::field::{Density, THRESHOLD};
use glam::DVec3;
use rayon::prelude::*;
use table::{EDGES, TRIANGLES};
use terrain_model::mesh::Mesh;

/// Cubes a side of a block.
const BLOCK: usize = 8;
/// Enclosures are asked for down to groups of this many cubes a side: over one cube an enclosure costs more than its corners.
const SMALLEST: usize = 2;

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
    /// More vertices than indices can name.
    #[error("{vertices} vertices: expected fewer than 4294967296; use a wider lattice")]
    TooMany {
        /// How many there would be.
        vertices: usize,
    },
}

/// What a polygonisation cost and holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Values of f at corners.
    pub corner_evaluations: u64,
    /// Values of f along edges.
    pub root_evaluations: u64,
    /// Enclosures of f over boxes.
    pub enclosures: u64,
    /// Gradients for normals.
    pub gradients: u64,
    /// Cubes whose corners were looked at.
    pub cells: u64,
}

impl Report {
    /// Values of f: the paper's #C.
    pub fn evaluations(&self) -> u64 {
        self.corner_evaluations + self.root_evaluations
    }
    fn plus(self, other: Report) -> Report {
        Report {
            corner_evaluations: self.corner_evaluations + other.corner_evaluations,
            root_evaluations: self.root_evaluations + other.root_evaluations,
            enclosures: self.enclosures + other.enclosures,
            gradients: self.gradients + other.gradients,
            cells: self.cells + other.cells,
        }
    }
}

/// What part of a surface is made of. Vertices and corners of triangles are named by their edge, triangles by their cube.
#[derive(Default)]
struct Piece {
    vertices: Vec<(u64, DVec3, DVec3)>,
    triangles: Vec<(u64, [u64; 3])>,
    report: Report,
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
        let inside = (nx - 1) * (ny - 1);
        let mut pieces = Vec::new();
        let mut low = layer(0);
        for z in 0..nz {
            let high = layer(z + 1);
            let rows = (0..ny).into_par_iter().map(|y| {
                let mut piece = Piece::default();
                for x in 0..nx {
                    let value = |c: usize| {
                        let corners = if c >> 2 == 0 { &low } else { &high };
                        corners[(y + (c >> 1 & 1)) * (nx + 1) + x + (c & 1)]
                    };
                    self.cell([x, y, z], std::array::from_fn(value), &mut piece);
                }
                piece
            });
            pieces.par_extend(rows);
            low = high;
        }
        let mut total = Piece::default();
        total.report.corner_evaluations = (inside * (nz - 1)) as u64;
        self.assemble(pieces, total)
    }

    /// Only groups of cubes over which an enclosure of f holds T are evaluated.
    ///
    /// # Errors
    /// [`PolygonizeError::TooMany`] above 2³² − 1 vertices.
    pub fn sparse(&self) -> Result<(Mesh, Report), PolygonizeError> {
        let blocks = self.lattice.cells().map(|n| n.div_ceil(BLOCK));
        let pieces: Vec<Piece> = (0..blocks.iter().product())
            .into_par_iter()
            .map(|k: usize| {
                let at = [k % blocks[0], k / blocks[0] % blocks[1], k / (blocks[0] * blocks[1])];
                self.block(at.map(|b| b * BLOCK))
            })
            .collect();
        self.assemble(pieces, Piece::default())
    }

    fn corner(&self, at: [usize; 3]) -> f64 {
        if self.lattice.on_border(at) { 0.0 } else { self.field.value(self.lattice.corner(at)) }
    }

    fn block(&self, low: [usize; 3]) -> Piece {
        const SIDE: usize = BLOCK + 1;
        let mut piece = Piece::default();
        let mut groups = Vec::new();
        self.groups(low, BLOCK, None, &mut groups, &mut piece.report);
        if groups.is_empty() {
            return piece;
        }
        let mut known = [f64::NAN; SIDE * SIDE * SIDE];
        for group in groups {
            let high = self.clipped(group, SMALLEST);
            for z in group[2]..high[2] {
                for y in group[1]..high[1] {
                    for x in group[0]..high[0] {
                        let mut corners = [0.0; 8];
                        for (c, value) in corners.iter_mut().enumerate() {
                            let at = [x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)];
                            let [i, j, k]: [usize; 3] = std::array::from_fn(|axis| at[axis] - low[axis]);
                            let slot = &mut known[(k * SIDE + j) * SIDE + i];
                            if slot.is_nan() {
                                *slot = self.corner(at);
                                piece.report.corner_evaluations += u64::from(!self.lattice.on_border(at));
                            }
                            *value = *slot;
                        }
                        self.cell([x, y, z], corners, &mut piece);
                    }
                }
            }
        }
        piece
    }

    fn clipped(&self, low: [usize; 3], side: usize) -> [usize; 3] {
        let cells = self.lattice.cells();
        std::array::from_fn(|axis| (low[axis] + side).min(cells[axis]))
    }

    /// The groups of [`SMALLEST`] cubes a side from `low` on that may hold the surface.
    fn groups(
        &self,
        low: [usize; 3],
        side: usize,
        among: Option<&[u32]>,
        found: &mut Vec<[usize; 3]>,
        report: &mut Report,
    ) {
        let cells = self.lattice.cells();
        if (0..3).any(|axis| low[axis] >= cells[axis]) {
            return;
        }
        let high = self.clipped(low, side);
        let at_border = (0..3).any(|axis| low[axis] == 0 || high[axis] == cells[axis]);
        let (bounds, parts) = self.field.narrow(&self.lattice.region(low, high), among);
        let range = bounds.range;
        report.enclosures += 1;
        // Rock at the border still has a wall there.
        if range.hi() <= THRESHOLD || (range.lo() > THRESHOLD && !at_border) {
            return;
        }
        if side == SMALLEST {
            found.push(low);
            return;
        }
        let half = side / 2;
        for c in 0..8 {
            let at = std::array::from_fn(|axis| low[axis] + (c >> axis & 1) * half);
            self.groups(at, half, Some(&parts), found, report);
        }
    }

    /// The triangles of one cube, and the vertices on the three edges at its lowest corner: every crossed edge is that of
    /// the one cube whose lowest corner begins it.
    fn cell(&self, at: [usize; 3], corners: [f64; 8], piece: &mut Piece) {
        piece.report.cells += 1;
        let rock = corners.iter().enumerate().fold(0, |all, (c, f)| all | usize::from(*f > THRESHOLD) << c);
        if rock == 0 || rock == 255 {
            return;
        }
        for axis in 0..3 {
            let other = 1 << axis;
            if (rock ^ (rock >> other)) & 1 == 1 {
                let (p, normal) = self.vertex(at, axis, [corners[0], corners[other]], &mut piece.report);
                piece.vertices.push((self.edge(at, axis), p, normal));
            }
        }
        let edge = |e: u8| {
            let (e, low) = (usize::from(e), EDGES[usize::from(e)][0]);
            self.edge([at[0] + (low & 1), at[1] + (low >> 1 & 1), at[2] + (low >> 2)], e / 4)
        };
        let name = self.edge(at, 0);
        piece.triangles.extend(TRIANGLES[rock].iter().map(|t| (name, t.map(edge))));
    }

    fn edge(&self, at: [usize; 3], axis: usize) -> u64 {
        let [nx, ny, _] = self.lattice.cells().map(|n| n as u64 + 1);
        let [x, y, z] = at.map(|k| k as u64);
        ((z * ny + y) * nx + x) * 3 + axis as u64
    }

    /// A point of the edge from corner `at` along `axis`, where f has the values `ends`, one on each side of T, and the unit
    /// normal there. The bracket is kept: f − T changes sign within it, and it is no longer than the tolerance.
    fn vertex(&self, at: [usize; 3], axis: usize, ends: [f64; 2], report: &mut Report) -> (DVec3, DVec3) {
        let (mut a, mut b) = (0.0, 1.0);
        let [mut fa, mut fb] = ends.map(|f| f - THRESHOLD);
        let rising = fb > 0.0;
        let width = self.tolerance / self.lattice.spacing();
        let mut halve = 0;
        while b - a > width {
            let secant = a + (b - a) * (fa / (fa - fb));
            // Aim just behind the root, on the side of the farther end, so that the bracket closes from both sides; halve it
            // where that has not worked.
            let aim = if secant - a < b - secant { secant + 0.25 * width } else { secant - 0.25 * width };
            let t = if halve >= 3 { 0.5 * (a + b) } else { aim.clamp(a + 0.125 * width, b - 0.125 * width) };
            halve = if halve >= 3 { 0 } else { halve + 1 };
            let f = self.field.value(self.lattice.on_edge(at, axis, t)) - THRESHOLD;
            report.root_evaluations += 1;
            if (f > 0.0) == rising {
                (b, fb) = (t, f);
            } else {
                (a, fa) = (t, f);
            }
        }
        let share = a + (b - a) * (fa / (fa - fb)).clamp(0.0, 1.0);
        let p = self.lattice.on_edge(at, axis, share);
        let out = if rising { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
        report.gradients += 1;
        let normal = -self.field.sample(p).1;
        // At a wall on the border f need not fall at all.
        (p, if normal.dot(out) > 0.0 { normal.normalize_or(out) } else { out })
    }

    /// One mesh of all pieces: vertices in the order of their edges, triangles in that of their cubes.
    fn assemble(&self, pieces: Vec<Piece>, mut total: Piece) -> Result<(Mesh, Report), PolygonizeError> {
        for piece in pieces {
            total.vertices.extend(piece.vertices);
            total.triangles.extend(piece.triangles);
            total.report = total.report.plus(piece.report);
        }
        let vertices = total.vertices.len();
        if u32::try_from(vertices).is_err() {
            return Err(PolygonizeError::TooMany { vertices });
        }
        total.vertices.par_sort_unstable_by_key(|vertex| vertex.0);
        total.triangles.par_sort_by_key(|triangle| triangle.0);
        let index = |edge: u64| total.vertices.partition_point(|vertex| vertex.0 < edge) as u32;
        let triangles = total.triangles.par_iter().map(|(_, edges)| edges.map(index)).collect();
        let positions = total.vertices.iter().map(|vertex| vertex.1.to_array()).collect();
        let normals = Some(total.vertices.iter().map(|vertex| vertex.2.to_array()).collect());
        Ok((Mesh { positions, triangles, normals }, total.report))
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

#[cfg(test)]
mod tests;
