//! Cubes: values at the corners of a group, the triangles of a crossed cube, and the vertex on a crossed edge.

use super::pieces::local;
use super::root::{Root, bracket};
use super::table::{EDGES, TRIANGLES};
use super::{Block, GROUP, Polygonizer, Report};
use crate::field::{Density, THRESHOLD};
use glam::DVec3;

/// From the edge along x at a cube's lowest corner to each of its edges, as the builder numbers them.
const STEPS: [u16; 12] = {
    let mut steps = [0; 12];
    let mut e = 0;
    while e < 12 {
        let low = EDGES[e][0];
        steps[e] = local([low & 1, low >> 1 & 1, low >> 2], e / 4);
        e += 1;
    }
    steps
};

impl<F: Density> Polygonizer<'_, F> {
    /// The cubes of one group. Where all of it is `rock` only the lattice's border is left to be made a wall.
    pub(super) fn filled(&self, field: &F, rock: bool, low: [usize; 3], block: &mut Block) {
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
        if self.at_border(low, high) {
            self.border(low, counts, values);
        }
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
                    let at = [low[0] + x, low[1] + y, low[2] + z];
                    self.cell(field, rock, at, std::array::from_fn(corner), block);
                }
            }
        }
    }

    /// Air at the corners of a filled group that are on the lattice's border.
    fn border(&self, low: [usize; 3], counts: [usize; 3], values: &mut [f64]) {
        for (k, value) in values.iter_mut().enumerate() {
            let at = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
            if self.lattice.on_border(std::array::from_fn(|axis| low[axis] + at[axis])) {
                *value = 0.0;
            }
        }
    }

    /// The cubes of one group, with `value` at their corners.
    pub(super) fn group(&self, field: &F, low: [usize; 3], value: impl Fn([usize; 3]) -> f64, block: &mut Block) {
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
        let first = block.builder.edge(at, 0);
        for axis in 0..3 {
            let other = 1 << axis;
            if (rock ^ (rock >> other)) & 1 == 1 {
                let ends = [corners[0], corners[other]];
                let [position, normal] = self.vertex(field, solid, at, axis, ends, &mut block.report);
                block.builder.vertex(first + axis as u16, position, normal);
            }
        }
        let edge = |e: u8| first + STEPS[usize::from(e)];
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
        let mut ends = ends;
        let mut values = 0;
        // An end on the border counts as air; only there can it be rock for the field.
        if let Some(end) = self.border_end(at, axis) {
            // Rock up to the border: the wall is there.
            let wall = [self.lattice.on_edge(at, axis, end as f64), out];
            if solid {
                return wall;
            }
            ends[end] = field.value(self.lattice.on_edge(at, axis, end as f64));
            values = 1;
            if ends[end] > THRESHOLD {
                *(if field.is_bare() { &mut report.lookups } else { &mut report.root_evaluations }) += values;
                return wall;
            }
        }
        let width = self.tolerance / self.lattice.spacing();
        let root = if axis == 2 {
            let [x, y] = [0, 1].map(|axis| self.lattice.coordinate(axis, at[axis], 0.0));
            let mut root = Root { share: 0.0, values: 0 };
            field.along_z([x, y], &mut |value| {
                root = bracket(ends, width, |share| value(self.lattice.coordinate(2, at[2], share)));
            });
            root
        } else {
            bracket(ends, width, |share| field.value(self.lattice.on_edge(at, axis, share)))
        };
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
}
