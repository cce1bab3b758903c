//! Is a mesh the border of a solid? Each edge is to have two triangles that run along it in opposite directions, each vertex
//! one fan.

use crate::buckets::Buckets;
use terrain_model::mesh::Mesh;

/// What is wrong with a mesh; all zero for the border of a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Edges with one triangle: holes.
    pub holes: u64,
    /// Edges with more than two.
    pub non_manifold_edges: u64,
    /// Edges that two triangles run along in the same direction.
    pub misoriented_edges: u64,
    /// Vertices whose triangles form more than one fan.
    pub non_manifold_vertices: u64,
    /// Triangles that name a vertex twice.
    pub collapsed_triangles: u64,
}

impl Census {
    /// Counts.
    pub fn of(mesh: &Mesh) -> Census {
        let mut census = Census::default();
        for &[a, b, c] in &mesh.triangles {
            census.collapsed_triangles += u64::from(a == b || b == c || c == a);
        }
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)]);
        let vertices = mesh.positions.len();
        // Of each edge at its smaller end: the other end, and whether it is run from the smaller.
        let mut edges = Buckets::new(vertices, || sides().map(|(a, b, _)| (a.min(b), (a.max(b), a < b))));
        edges.sort();
        for edge in edges.filled().flat_map(|(_, edges)| edges.chunk_by(|a, b| a.0 == b.0)) {
            match edge {
                [_] => census.holes += 1,
                [one, other] => census.misoriented_edges += u64::from(one.1 == other.1),
                _ => census.non_manifold_edges += 1,
            }
        }
        drop(edges);
        // At each vertex, the opposite sides.
        let mut fans = Buckets::new(vertices, || sides().map(|(a, b, c)| (a, (b, c))));
        fans.sort();
        for (_, fan) in fans.filled() {
            // From one side on through the triangles: the walk has to meet them all.
            let mut at = fan[0].1;
            let mut met = 1;
            while at != fan[0].0 && met <= fan.len() {
                match fan.binary_search_by(|side| side.0.cmp(&at)) {
                    Ok(next) => at = fan[next].1,
                    Err(_) => break,
                }
                met += 1;
            }
            census.non_manifold_vertices += u64::from(met != fan.len());
        }
        census
    }
    /// Is it the border of a solid?
    pub fn is_closed(&self) -> bool {
        *self == Census::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        Mesh { positions, triangles, normals: None, attributes: Vec::new() }
    }

    #[test]
    fn a_tetrahedron_is_closed() {
        assert!(Census::of(&tetrahedron()).is_closed());
    }

    #[test]
    fn a_hole_a_turned_a_doubled_and_a_touching_triangle_are_found() {
        let mut hole = tetrahedron();
        hole.triangles.pop();
        assert_eq!(Census::of(&hole).holes, 3);
        let mut turned = tetrahedron();
        turned.triangles[0].swap(0, 1);
        assert_eq!(Census::of(&turned).misoriented_edges, 3);
        let mut doubled = tetrahedron();
        doubled.triangles.push([0, 2, 1]);
        assert_eq!(Census::of(&doubled).non_manifold_edges, 3);
        let mut touching = tetrahedron();
        // A second tetrahedron on the same first vertex.
        touching.positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        touching.triangles.extend(tetrahedron().triangles.iter().map(|t| t.map(|k| if k == 0 { 0 } else { k + 3 })));
        let census = Census::of(&touching);
        assert_eq!((census.non_manifold_vertices, census.holes), (1, 0));
        let mut collapsed = tetrahedron();
        collapsed.triangles[0] = [0, 0, 1];
        assert_eq!(Census::of(&collapsed).collapsed_triangles, 1);
    }
}
