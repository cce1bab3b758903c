//! What the tessellation paper does, to compare with: each cell of the raster is a patch, and the tessellator of the graphics pipeline
//! cuts it by one factor an edge, the edge's length on the screen over the wanted one, at most 64 (§6). A factor depends on the edge
//! alone, so patches meet; between the edges and the inside a strip of triangles stitches.

use super::census::odd_edges;
use super::refine::Refinement;
use super::triangle::SIDE;

/// Above 1: what a patch with one edge in pieces has inside at least, as on hardware.
const INSIDE: f64 = 1.0 + 1.0 / 65536.0;

/// How a factor becomes pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partition {
    /// As many equal ones as the next integer.
    Integer,
    /// The next odd number, all but two of the length that the factor says; the two, at the ends here, share what is left. Pieces
    /// grow from nothing.
    Fractional,
}

impl Partition {
    /// The largest factor that hardware takes.
    pub fn most(self) -> f64 {
        match self {
            Partition::Integer => 64.0,
            Partition::Fractional => 63.0,
        }
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Corner {
    /// A sample of the raster.
    Sample([u32; 2]),
    /// On the edge from a sample towards the east (0) or the north (1), after so many pieces.
    Edge([u32; 2], u32, u32),
    /// In a cell, after so many pieces east and north.
    Inner([u32; 2], [u32; 2]),
}

/// The patches of one camera.
pub struct Patches<'a> {
    refinement: &'a Refinement<'a>,
    partition: Partition,
    /// Off in a control: all edges of a patch have its largest factor.
    by_edge: bool,
}

/// A triangle by its corners.
pub type Piece = [Corner; 3];

impl<'a> Patches<'a> {
    /// For the camera and edges of `refinement`.
    pub fn new(refinement: &'a Refinement<'a>, partition: Partition) -> Patches<'a> {
        Patches { refinement, partition, by_edge: true }
    }
    /// A control: factors of patches, not of edges.
    pub fn by_patch(self) -> Patches<'a> {
        Patches { by_edge: false, ..self }
    }
    /// Factor of the edge from a sample east (0) or north (1): its length on the raster over its middle's distance from the eye. With
    /// it, whether the pipeline's limit cut it.
    pub fn factor(&self, from: [u32; 2], axis: u32) -> (f64, bool) {
        let (ground, view) = (self.refinement.ground(), self.refinement.view());
        let mut to = from;
        to[axis as usize] += 1;
        let [p, q] = [from, to].map(|sample| {
            let [x, y] = [0, 1].map(|k| f64::from(sample[k]) * ground.spacing()[k]);
            [x, y, ground.elevation([x, y])]
        });
        let (mut length, mut distance) = (0.0, 0.0);
        for k in 0..3 {
            length += (p[k] - q[k]) * (p[k] - q[k]);
            let off = (p[k] + q[k]) / 2.0 - view.eye[k];
            distance += off * off;
        }
        let wanted = (length / distance).sqrt() * view.focal / self.refinement.target();
        (wanted.clamp(1.0, self.partition.most()), wanted > self.partition.most())
    }
    /// Ends of the pieces that a factor makes, from 0 to 1.
    fn places(&self, factor: f64) -> Vec<f64> {
        match self.partition {
            Partition::Integer => {
                let n = factor.ceil() as u32;
                (0..=n).map(|k| f64::from(k) / f64::from(n)).collect()
            }
            Partition::Fractional => {
                let half = ((factor - 1.0) / 2.0).ceil() as u32;
                let n = 2 * half + 1;
                let rest = (1.0 - f64::from(n.max(3) - 2) / factor) / 2.0;
                let place = |k: u32| match k {
                    0 => 0.0,
                    k if k == n => 1.0,
                    k => rest + f64::from(k - 1) / factor,
                };
                (0..=n).map(place).collect()
            }
        }
    }
    /// Factors of a cell: south, north, west, east, then inside along x and along y.
    fn factors(&self, cell: [u32; 2]) -> [f64; 6] {
        let [i, j] = cell;
        let mut edges =
            [([i, j], 0), ([i, j + 1], 0), ([i, j], 1), ([i + 1, j], 1)].map(|(at, k)| self.factor(at, k).0);
        if !self.by_edge {
            edges = [edges.into_iter().fold(1.0, f64::max); 4];
        }
        let [south, north, west, east] = edges;
        let any = edges.iter().any(|factor| *factor > 1.0);
        let inside = |a: f64, b: f64| a.max(b).max(if any { INSIDE } else { 1.0 });
        [south, north, west, east, inside(south, north), inside(west, east)]
    }
    /// The triangles, without patches that cannot be in the image if `cull`.
    pub fn triangles(&self, cull: bool) -> Vec<Piece> {
        let [columns, rows] = self.refinement.ground().inside().map(|n| n as u32);
        let mut pieces = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                if !(cull && self.hidden([i, j])) {
                    self.patch([i, j], &mut pieces);
                }
            }
        }
        pieces
    }
    fn hidden(&self, cell: [u32; 2]) -> bool {
        let ground = self.refinement.ground();
        let half = SIDE / ground.cells() as u32 / 2;
        let block = ground.enclosure(cell.map(|k| (2 * k + 1) * half), i64::from(half) - 1);
        let block = self.refinement.detail().widen(block);
        let at = |k: usize, step: u32| f64::from(cell[k] + step) * ground.spacing()[k];
        let low = [at(0, 0) - block.moved, at(1, 0) - block.moved, block.elevation[0]];
        let high = [at(0, 1) + block.moved, at(1, 1) + block.moved, block.elevation[1]];
        self.refinement.view().misses(low, high)
    }
    fn patch(&self, cell: [u32; 2], pieces: &mut Vec<Piece>) {
        let [i, j] = cell;
        let [south, north, west, east, x, y] = self.factors(cell).map(|factor| self.places(factor));
        let samples = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]].map(Corner::Sample);
        if x.len() == 2 && y.len() == 2 {
            let [sw, se, nw, ne] = samples;
            pieces.extend([[sw, se, ne], [sw, ne, nw]]);
            return;
        }
        let last = [x.len() as u32 - 2, y.len() as u32 - 2];
        let inner = |a: u32, b: u32| Corner::Inner(cell, [a, b]);
        for b in 1..last[1] {
            for a in 1..last[0] {
                let [sw, se, nw, ne] = [inner(a, b), inner(a + 1, b), inner(a, b + 1), inner(a + 1, b + 1)];
                pieces.extend([[sw, se, ne], [sw, ne, nw]]);
            }
        }
        let [sw, se, nw, ne] = samples;
        let edge = |places: &[f64], from: [u32; 2], axis: u32, ends: [Corner; 2]| -> Vec<(f64, Corner)> {
            let all = places.iter().enumerate().map(|(k, place)| {
                let corner = match k {
                    0 => ends[0],
                    k if k + 1 == places.len() => ends[1],
                    k => Corner::Edge(from, axis, k as u32),
                };
                (*place, corner)
            });
            all.collect()
        };
        let row = |b: u32| -> Vec<(f64, Corner)> { (1..=last[0]).map(|a| (x[a as usize], inner(a, b))).collect() };
        let column = |a: u32| -> Vec<(f64, Corner)> { (1..=last[1]).map(|b| (y[b as usize], inner(a, b))).collect() };
        stitch(&edge(&south, [i, j], 0, [sw, se]), &row(1), pieces);
        stitch(&edge(&north, [i, j + 1], 0, [nw, ne]), &row(last[1]), pieces);
        stitch(&edge(&west, [i, j], 1, [sw, nw]), &column(1), pieces);
        stitch(&edge(&east, [i + 1, j], 1, [se, ne]), &column(last[0]), pieces);
    }
    /// Where in `cell` a corner is that it holds, in [0, 1].
    fn share(&self, cell: [u32; 2], corner: Corner) -> [f64; 2] {
        match corner {
            Corner::Sample(at) => [0, 1].map(|k| f64::from(at[k] - cell[k])),
            Corner::Edge(from, axis, step) => {
                // A control gives each patch its own pieces.
                let factor = if self.by_edge { self.factor(from, axis).0 } else { self.factors(cell)[0] };
                let mut share = [0, 1].map(|k| f64::from(from[k] - cell[k]));
                share[axis as usize] = self.places(factor)[step as usize];
                share
            }
            Corner::Inner(cell, steps) => {
                let [.., x, y] = self.factors(cell);
                [self.places(x)[steps[0] as usize], self.places(y)[steps[1] as usize]]
            }
        }
    }
    /// Displaced position of a corner, seen from `cell`, which holds it.
    pub fn position_in(&self, cell: [u32; 2], corner: Corner) -> [f64; 3] {
        let share = self.share(cell, corner);
        let (ground, view) = (self.refinement.ground(), self.refinement.view());
        let on = ground.smooth_at(&ground.place(cell.map(|k| k as usize), share));
        let [x, y, z] = on.position;
        let distance = view.distance_squared([x, y], [z; 2]).sqrt();
        self.refinement.detail().moved(&on, self.refinement.target() * distance / view.focal)
    }
    /// Displaced position of a corner; that of an edge does not depend on the cell that asks.
    pub fn position(&self, corner: Corner) -> [f64; 3] {
        let inside = self.refinement.ground().inside().map(|n| n as u32 - 1);
        let (Corner::Sample(at) | Corner::Edge(at, ..) | Corner::Inner(at, _)) = corner;
        self.position_in([0, 1].map(|k| at[k].min(inside[k])), corner)
    }
    /// Edges of the whole raster's triangles that do not have two of them, or one at the border.
    pub fn cracks(&self) -> usize {
        let far = self.refinement.ground().inside().map(|n| n as u32);
        // Which borders a corner is on: west, south, east, north.
        let on = |corner: Corner| match corner {
            Corner::Sample([i, j]) => [i == 0, j == 0, i == far[0], j == far[1]],
            Corner::Edge([i, j], axis, _) => {
                [axis == 1 && i == 0, axis == 0 && j == 0, axis == 1 && i == far[0], axis == 0 && j == far[1]]
            }
            Corner::Inner(..) => [false; 4],
        };
        let border = |[p, q]: [Corner; 2]| (0..4).any(|k| on(p)[k] && on(q)[k]);
        odd_edges(self.triangles(false), border).len()
    }
}

/// A strip between two lines of corners by where they are, triangle after triangle to the nearer next corner.
fn stitch(outer: &[(f64, Corner)], inner: &[(f64, Corner)], pieces: &mut Vec<Piece>) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < outer.len() || j + 1 < inner.len() {
        let middle = |line: &[(f64, Corner)], k: usize| {
            if k + 1 < line.len() { (line[k].0 + line[k + 1].0) / 2.0 } else { f64::INFINITY }
        };
        if middle(outer, i) <= middle(inner, j) {
            pieces.push([outer[i].1, outer[i + 1].1, inner[j].1]);
            i += 1;
        } else {
            pieces.push([inner[j].1, inner[j + 1].1, outer[i].1]);
            j += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::tests::{camera, detail, partial};
    use std::collections::HashMap;

    #[test]
    fn patches_with_factors_by_edge_meet_and_those_with_one_factor_each_do_not() {
        let (ground, detail) = (partial(), detail());
        for partition in [Partition::Integer, Partition::Fractional] {
            let mut control = 0;
            for k in 0..4 {
                let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
                let patches = Patches::new(&refinement, partition);
                assert_eq!(patches.cracks(), 0, "{partition:?}, camera {k}");
                control += patches.by_patch().cracks();
            }
            assert!(control > 1000, "{partition:?}: {control}");
        }
    }

    #[test]
    fn pieces_of_a_patch_fill_it_once_and_its_neighbours_have_its_edges_to_the_bit() {
        let (ground, detail) = (partial(), detail());
        let refinement = Refinement::new(&ground, &detail, camera(&ground, 2), 24.0, 22);
        let mut most = 0;
        for partition in [Partition::Integer, Partition::Fractional] {
            let patches = Patches::new(&refinement, partition);
            let mut known: HashMap<Corner, [f64; 3]> = HashMap::new();
            let mut shared = 0;
            for cell in (0..90 * 89).map(|k| [k % 90, k / 90]) {
                let mut pieces = Vec::new();
                patches.patch(cell, &mut pieces);
                most = most.max(pieces.len());
                let area = |piece: &Piece| {
                    let [a, b, c] = piece.map(|corner| patches.share(cell, corner));
                    ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs() / 2.0
                };
                let whole: f64 = pieces.iter().map(area).sum();
                assert!((whole - 1.0).abs() < 1e-9, "{partition:?} {cell:?}: {whole}");
                if cell[0] > 12 || cell[1] > 12 {
                    continue;
                }
                let outer = pieces.as_flattened().iter().filter(|corner| !matches!(corner, Corner::Inner(..)));
                for corner in outer {
                    let p = patches.position_in(cell, *corner);
                    shared += usize::from(known.insert(*corner, p).is_some_and(|other| {
                        assert_eq!(other, p, "{corner:?}");
                        true
                    }));
                }
            }
            assert!(shared > 100);
        }
        assert!(most > 1000, "{most}");
    }

    #[test]
    fn pieces_grow_from_nothing_where_factors_are_fractional_and_appear_at_once_where_they_are_not() {
        let (ground, detail) = (partial(), detail());
        let refinement = Refinement::new(&ground, &detail, camera(&ground, 2), 24.0, 22);
        // The farthest that a piece's end is from all ends of a factor that is a little smaller.
        let jump = |partition: Partition| {
            let patches = Patches::new(&refinement, partition);
            let step = |k: u32| {
                let [old, new] = [0.0, 0.001].map(|more| patches.places(1.0 + f64::from(k) * 0.25 + more));
                let off = |at: &f64| old.iter().map(|other| (at - other).abs()).fold(f64::INFINITY, f64::min);
                new.iter().map(off).fold(0.0, f64::max)
            };
            (0..200).map(step).fold(0.0, f64::max)
        };
        assert!(jump(Partition::Fractional) < 0.001 && jump(Partition::Integer) > 0.1);
    }
}
