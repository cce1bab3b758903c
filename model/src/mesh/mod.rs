//! Triangle meshes, as they are written to files and handed to renderers.

pub mod adaptive;
pub mod cracks;
pub mod deviation;
pub mod quadtree;
pub mod regular;
pub mod tin;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::grid::Grid;

/// A mesh that cannot be written or drawn.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A position or normal is not finite.
    #[error("vertex {vertex} has a position or normal that is not finite")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// As many normals as positions are needed.
    #[error("there are {normals} normals for {vertices} vertices")]
    Normals {
        /// Normals given.
        normals: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// An attribute that cannot be written.
    #[error(
        "attribute {name:?} has {values} values for {vertices} vertices: expected as many, finite, under a lower-case name"
    )]
    Attribute {
        /// What it is called.
        name: String,
        /// Values given.
        values: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// More vertices than 32-bit indices can name.
    #[error("{vertices} vertices are more than 32-bit indices can name")]
    TooMany {
        /// The number of vertices.
        vertices: usize,
    },
    /// Something asked of a mesher that it cannot do.
    #[error("{problem}: expected {expected}")]
    Settings {
        /// What was asked.
        problem: &'static str,
        /// What can be.
        expected: &'static str,
    },
}

impl MeshError {
    /// Refuses what no mesher can do.
    fn refuse(low: DVec2, high: DVec2, tolerance: f64) -> Result<(), MeshError> {
        let expected = "finite corners, the first south-west of the second";
        if !(low.is_finite() && high.is_finite() && low.x < high.x && low.y < high.y) {
            return Err(MeshError::Settings { problem: "rectangle to mesh", expected });
        }
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(MeshError::Settings {
                problem: "tolerance of a mesh",
                expected: "a positive number of metres",
            });
        }
        Ok(())
    }
}

/// Triangles over shared vertices; counter-clockwise seen from outside (from above, for terrain).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Vertices in metres: x east, y north, z up.
    pub positions: Vec<[f64; 3]>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals, one a vertex.
    pub normals: Option<Vec<[f64; 3]>>,
    /// Further numbers of vertices, such as what the ground is made of. PLY and glTF keep them; OBJ has no place for them.
    pub attributes: Vec<Attribute>,
}

/// A number for each vertex of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// In lower case, digits and `_`, such as `resistance`; glTF writes it `_RESISTANCE`.
    pub name: String,
    /// One a vertex.
    pub values: Vec<f32>,
}

impl Mesh {
    /// The surface through the samples of `grid`: two triangles for each cell with four known corners, split from
    /// south-west to north-east. Samples that no such cell uses are left out. No normals.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] above 2³² − 1 vertices.
    pub fn from_grid(grid: &Grid<f32>) -> Result<Mesh, MeshError> {
        const UNUSED: u32 = u32::MAX;
        let (width, height) = (grid.width(), grid.height());
        if u32::try_from(width * height).is_err() {
            return Err(MeshError::TooMany { vertices: width * height });
        }
        let mut mesh = Mesh::default();
        let mut vertices = vec![UNUSED; width * height];
        for j in 0..height.saturating_sub(1) {
            for i in 0..width.saturating_sub(1) {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let elevations = corners.map(|(i, j)| grid.known(i, j).map(f64::from));
                let [Some(a), Some(b), Some(c), Some(d)] = elevations else { continue };
                let mut indices = [0; 4];
                for (index, ((i, j), z)) in indices.iter_mut().zip(corners.into_iter().zip([a, b, c, d])) {
                    let vertex = &mut vertices[j * width + i];
                    if *vertex == UNUSED {
                        *vertex = mesh.positions.len() as u32;
                        let position = grid.position(i, j);
                        mesh.positions.push([position.x, position.y, z]);
                    }
                    *index = *vertex;
                }
                let [sw, se, ne, nw] = indices;
                mesh.triangles.push([sw, se, ne]);
                mesh.triangles.push([sw, ne, nw]);
            }
        }
        Ok(mesh)
    }

    /// The same mesh with normals: at each vertex the mean of its triangles' normals, weighted by their areas; up where
    /// they cancel. Indices out of range are passed over.
    #[must_use]
    pub fn with_normals(mut self) -> Mesh {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let corners = triangle.map(|index| self.positions.get(index as usize).map(|&p| DVec3::from(p)));
            let [Some(a), Some(b), Some(c)] = corners else { continue };
            for &index in triangle {
                sums[index as usize] += (b - a).cross(c - a);
            }
        }
        self.normals = Some(sums.into_iter().map(|sum| sum.normalize_or(DVec3::Z).to_array()).collect());
        self
    }

    /// Whether every triangle names existing vertices and every number is finite.
    ///
    /// # Errors
    /// The first [`MeshError`] found.
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        if u32::try_from(vertices).is_err() {
            return Err(MeshError::TooMany { vertices });
        }
        if let Some(normals) = self.normals.as_ref().map(Vec::len).filter(|&normals| normals != vertices) {
            return Err(MeshError::Normals { normals, vertices });
        }
        let infinite = |points: &[[f64; 3]]| points.iter().position(|p| !p.iter().all(|n| n.is_finite()));
        let found = infinite(&self.positions).or_else(|| self.normals.as_deref().and_then(infinite));
        if let Some(vertex) = found {
            return Err(MeshError::NotFinite { vertex });
        }
        for Attribute { name, values } in &self.attributes {
            let named = name.starts_with(|c: char| c.is_ascii_lowercase())
                && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
                && !["x", "y", "z", "nx", "ny", "nz"].contains(&name.as_str());
            if !named || values.len() != vertices || !values.iter().all(|value| value.is_finite()) {
                return Err(MeshError::Attribute { name: name.clone(), values: values.len(), vertices });
            }
        }
        for (triangle, indices) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = indices.iter().find(|&&index| index as usize >= vertices) {
                return Err(MeshError::Index { triangle, vertex, vertices });
            }
        }
        Ok(())
    }

    /// The smallest x, y and z; zero for an empty mesh.
    pub fn lowest_corner(&self) -> [f64; 3] {
        let low = self.positions.iter().map(|&p| DVec3::from(p)).reduce(DVec3::min);
        low.unwrap_or(DVec3::ZERO).to_array()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::noise::{Combination, Octaves};
    use crate::operator::WeightRule;
    use crate::primitive::curve::Curve;
    use crate::primitive::disc::{Disc, DiscNoise};
    use crate::profile::{Knot, Section};
    use crate::program::Program;
    use crate::spline::Path;
    use crate::tree::{Node, Tree};

    pub(crate) fn disc(at: (f64, f64), radius: f64, elevation: f64, noise: Option<DiscNoise>) -> Node {
        Disc { centre: DVec3::new(at.0, at.1, elevation), radius, weight: 1.6, noise }.into()
    }

    /// A plain with a smooth and a ridged hill and a river, terrain on all of [0, 64]² metres.
    pub(crate) fn hills() -> Program {
        let mut tree = Tree::new();
        let noise = |combination, wavelength: f64, amplitude| {
            let octaves = Octaves { octaves: 3, frequency: 1.0 / wavelength, lacunarity: 2.0, gain: 0.5, amplitude };
            Some(DiscNoise { combination, octaves, seed: 7 })
        };
        let ridged = Combination::Ridged { offset: 0.6, sharpness: 2.0 };
        let parts = [
            disc((32.0, 32.0), 200.0, 10.0, None),
            disc((20.0, 24.0), 24.0, 16.0, noise(Combination::Sum, 20.0, 6.0)),
            disc((44.0, 44.0), 22.0, 14.0, noise(ridged, 18.0, 7.0)),
        ]
        .map(|node| tree.push(node));
        let a = tree.push(Node::Blend(parts.to_vec()));
        let knot = |distance, height| Knot { distance, height, slope: 0.0 };
        let b = tree.push(Curve {
            path: Path::Polyline(vec![
                DVec3::new(-10.0, 50.0, 9.0),
                DVec3::new(30.0, 30.0, 8.0),
                DVec3::new(70.0, 20.0, 6.0),
            ]),
            tolerance: 0.1,
            radius: 12.0,
            weight: 1.0,
            joint: 4.0,
            sections: vec![Section { at: 0.0, profile: vec![knot(-8.0, 4.0), knot(0.0, 0.0), knot(8.0, 4.0)] }],
        });
        let root = tree.push(Node::Replace { a, b, rule: WeightRule::Keep });
        Program::compile(&tree, root).unwrap()
    }

    fn grid(width: usize, height: usize, values: Vec<f32>) -> Grid<f32> {
        Grid::new(DVec2::new(10.0, 20.0), DVec2::new(2.0, 3.0), width, height, values).unwrap()
    }

    #[test]
    fn cell_gives_two_triangles_that_face_up() {
        let mesh = Mesh::from_grid(&grid(2, 2, vec![1.0, 2.0, 3.0, 4.0])).unwrap().with_normals();
        assert_eq!(mesh.positions, [[10.0, 20.0, 1.0], [12.0, 20.0, 2.0], [12.0, 23.0, 4.0], [10.0, 23.0, 3.0]]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(mesh.normals.as_ref().unwrap().iter().all(|n| n[2] > 0.0));
        mesh.check().unwrap();
    }

    #[test]
    fn cells_that_touch_no_data_are_left_out_with_their_lonely_vertices() {
        let holed = grid(4, 2, vec![0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0]).with_no_data(Some(-1.0));
        let mesh = Mesh::from_grid(&holed).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (6, 4));
        let single = Mesh::from_grid(&grid(1, 3, vec![0.0; 3])).unwrap();
        assert_eq!(single, Mesh::default());
    }

    #[test]
    fn check_finds_each_flaw() {
        let good = Mesh::from_grid(&grid(2, 2, vec![0.0; 4])).unwrap().with_normals();
        let mut bad = good.clone();
        bad.triangles[1][2] = 4;
        assert!(matches!(bad.check(), Err(MeshError::Index { triangle: 1, vertex: 4, vertices: 4 })));
        let mut bad = good.clone();
        bad.positions[3][1] = f64::NAN;
        assert!(matches!(bad.check(), Err(MeshError::NotFinite { vertex: 3 })));
        let mut bad = good;
        bad.normals = Some(vec![]);
        assert!(matches!(bad.check(), Err(MeshError::Normals { normals: 0, vertices: 4 })));
    }
}
