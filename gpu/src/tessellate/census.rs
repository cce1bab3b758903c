//! Whether triangles fit: a census of the edges of all leaves' lattices. Areas alone would prove nothing, because a crack has none.

use super::triangle::{LATTICE, SIDE, Triangle, Vertex};

/// Edges of triangles in the plane, and whether they fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Edges within the raster that do not have exactly two triangles.
    pub cracks: usize,
    /// Of these, those whose middle is a vertex of another triangle.
    pub t_junctions: usize,
}

impl Census {
    /// Counts over the lattices of `leaves`, which must cover a raster that ends at `end`.
    pub fn of(leaves: &[Triangle], end: Vertex) -> Census {
        let lattices = leaves.iter().flat_map(|leaf| leaf.lattice(LATTICE));
        Census::of_triangles(lattices.map(|triangle| triangle.corners()), end)
    }
    /// Counts over any triangles that cover a raster that ends at `end`. On its north and east border and beyond nothing is to fit.
    pub fn of_triangles(triangles: impl IntoIterator<Item = [Vertex; 3]>, end: Vertex) -> Census {
        let border = |[p, q]: [Vertex; 2]| (0..2).any(|k| p[k] == q[k] && (p[k] == 0 || p[k] == SIDE));
        let mut odd = odd_edges(triangles, border);
        odd.retain(|[p, q]| !(0..2).any(|k| end[k] < SIDE && p[k] >= end[k] && q[k] >= end[k]));
        let mut ends: Vec<Vertex> = odd.iter().flatten().copied().collect();
        ends.sort_unstable();
        let split = |[p, q]: &[Vertex; 2]| {
            let middle = [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
            ends.binary_search(&middle).is_ok()
        };
        Census { cracks: odd.len(), t_junctions: odd.iter().filter(|edge| split(edge)).count() }
    }
}

/// Edges that do not have exactly two triangles, or one on a border; corners are any names.
pub fn odd_edges<K: Copy + Ord>(
    triangles: impl IntoIterator<Item = [K; 3]>,
    border: impl Fn([K; 2]) -> bool,
) -> Vec<[K; 2]> {
    let mut edges: Vec<[K; 2]> = Vec::new();
    for [a, b, c] in triangles {
        edges.extend([[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]));
    }
    edges.sort_unstable();
    let odd = |same: &&[[K; 2]]| same.len() != if border(same[0]) { 1 } else { 2 };
    edges.chunk_by(|a, b| a == b).filter(odd).map(|same| same[0]).collect()
}
