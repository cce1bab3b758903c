//! Where a mesh over the plane does not close: sides that more than two triangles share, or two the wrong way round,
//! vertices inside another triangle's side (T-junctions), and vertices that stand above one another.

use super::Mesh;
use std::collections::HashMap;

/// A vertex lies on a side that it is within this share of the side's length of.
const ON: f64 = 1e-9;

/// How a mesh fails to close; all 0 for one without cracks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Cracks {
    /// Vertices that lie, seen from above, inside a side that only one triangle has, counted for each such side.
    pub t_junctions: usize,
    /// Sides with more than two triangles, or with two that run along it the same way.
    pub mismatched_sides: usize,
    /// Vertices with the same x and y as another, but another z.
    pub gaps: usize,
    /// Triangles with two equal vertices, or without area seen from above, or that face down.
    pub degenerate: usize,
}

impl Cracks {
    /// All of them.
    pub fn total(&self) -> usize {
        self.t_junctions + self.mismatched_sides + self.gaps + self.degenerate
    }
}

/// Counts the cracks of a sound mesh that is a function of x and y. Vertices at the same position count as one. A side
/// that one triangle has is taken for the border of the mesh unless a vertex lies on it: a triangle that is missing
/// altogether is not noticed.
pub fn cracks(mesh: &Mesh) -> Cracks {
    let mut found = Cracks::default();
    // −0 and 0 are one place.
    let bits = |x: f64| (x + 0.0).to_bits();
    let mut columns: HashMap<[u64; 2], (u32, u64)> = HashMap::new();
    let mut places: Vec<[f64; 2]> = Vec::new();
    let ids: Vec<u32> = mesh
        .positions
        .iter()
        .map(|&[x, y, z]| {
            let (id, elevation) = *columns.entry([bits(x), bits(y)]).or_insert_with(|| {
                places.push([x, y]);
                (places.len() as u32 - 1, bits(z))
            });
            found.gaps += usize::from(elevation != bits(z));
            id
        })
        .collect();

    // How often each side is run along from its lower to its higher vertex, and back.
    let mut sides: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|index| ids[index as usize]);
        let [a, b, c] = corners.map(|id| places[id as usize]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        found.degenerate += usize::from(area.is_nan() || area <= 0.0);
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            sides.entry([from.min(to), from.max(to)]).or_default()[usize::from(from > to)] += 1;
        }
    }
    found.mismatched_sides = sides.values().filter(|runs| runs[0] > 1 || runs[1] > 1).count();

    let used: Vec<u32> = {
        let mut used = ids.clone();
        used.sort_unstable();
        used.dedup();
        used
    };
    // Vertices by x and by y: a side looks through whichever strip has fewer.
    let strips = [0, 1].map(|axis| {
        let mut sorted: Vec<(f64, u32)> = used.iter().map(|&id| (places[id as usize][axis], id)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        sorted
    });
    for ends in sides.iter().filter(|(_, runs)| runs[0] + runs[1] == 1).map(|(ends, _)| ends) {
        let [a, b] = ends.map(|id| places[id as usize]);
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let squared = dx * dx + dy * dy;
        let slack = ON * squared.sqrt();
        let strip = |axis: usize| {
            let (low, high) = (a[axis].min(b[axis]) - slack, a[axis].max(b[axis]) + slack);
            let sorted = &strips[axis];
            &sorted[sorted.partition_point(|v| v.0 < low)..sorted.partition_point(|v| v.0 <= high)]
        };
        let (along_x, along_y) = (strip(0), strip(1));
        let near = if along_x.len() <= along_y.len() { along_x } else { along_y };
        found.t_junctions += near
            .iter()
            .filter(|(_, id)| {
                let [px, py] = places[*id as usize];
                let (ex, ey) = (px - a[0], py - a[1]);
                let along = (ex * dx + ey * dy) / squared;
                let aside = (dx * ey - dy * ex).abs() / squared;
                !ends.contains(id) && along > 0.0 && along < 1.0 && aside <= ON
            })
            .count();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        Mesh {
            positions: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [1.0, 1.0, 3.0], [0.0, 1.0, 4.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            normals: None,
            attributes: Vec::new(),
        }
    }

    #[test]
    fn a_closed_mesh_has_none_and_each_flaw_is_counted() {
        assert_eq!(cracks(&square()), Cracks::default());

        let mut junction = square();
        junction.positions.push([0.5, 0.5, 2.0]);
        junction.triangles[1] = [0, 4, 3];
        junction.triangles.push([4, 2, 3]);
        assert_eq!(cracks(&junction), Cracks { t_junctions: 1, ..Cracks::default() });

        let mut twice = square();
        twice.triangles.push([0, 1, 2]);
        assert_eq!(cracks(&twice).mismatched_sides, 3);

        // The second triangle gets corners of its own, one of them higher.
        let mut gap = square();
        gap.positions.extend([[0.0, 0.0, 1.0], [1.0, 1.0, 3.5]]);
        gap.triangles[1] = [4, 5, 3];
        assert_eq!(cracks(&gap), Cracks { gaps: 1, ..Cracks::default() });

        let mut flipped = square();
        flipped.triangles[1] = [0, 3, 2];
        assert_eq!(cracks(&flipped), Cracks { degenerate: 1, mismatched_sides: 1, ..Cracks::default() });
    }
}
