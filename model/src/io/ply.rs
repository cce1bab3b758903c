//! PLY meshes, in text or little-endian binary.
//!
//! Positions are `float` relative to an origin that a comment states, `comment origin X Y Z` (metres): the lowest
//! corner of the mesh's box. A vertex is origin + (x, y, z), good to half an ulp of `f32` at the size of the mesh, not
//! at the size of a map coordinate.

use std::io::Write;
use std::path::Path;

use super::atomic::atomic_write;
use super::error::{Failure, WriteError, name_file};
use crate::mesh::Mesh;

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Encoding {
    /// As text.
    Ascii,
    /// As little-endian binary.
    #[default]
    Binary,
}

/// Writes a mesh: vertices with normals and attributes if it has them, and triangles.
///
/// # Errors
/// [`WriteError`]: a mesh that is not sound (see [`Mesh::check`]), or the file system.
pub fn write(path: &Path, mesh: &Mesh, encoding: Encoding) -> Result<(), WriteError> {
    mesh.check().map_err(|error| WriteError::cannot(path, error, "repair the mesh"))?;
    atomic_write(path, |file| to_writer(file, mesh, encoding)).map_err(name_file(path))
}

fn to_writer(file: &mut impl Write, mesh: &Mesh, encoding: Encoding) -> Result<(), Failure> {
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Binary => "binary_little_endian",
    };
    let origin = mesh.lowest_corner();
    writeln!(file, "ply\nformat {format} 1.0\ncomment origin {} {} {}", origin[0], origin[1], origin[2])?;
    writeln!(file, "element vertex {}", mesh.positions.len())?;
    writeln!(file, "property float x\nproperty float y\nproperty float z")?;
    if mesh.normals.is_some() {
        writeln!(file, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    for attribute in &mesh.attributes {
        writeln!(file, "property float {}", attribute.name)?;
    }
    writeln!(file, "element face {}\nproperty list uchar uint vertex_indices\nend_header", mesh.triangles.len())?;
    for (k, position) in mesh.positions.iter().enumerate() {
        let local = [0, 1, 2].map(|axis| (position[axis] - origin[axis]) as f32);
        let normal = mesh.normals.as_ref().and_then(|normals| normals.get(k));
        let more = mesh.attributes.iter().filter_map(|attribute| attribute.values.get(k).copied());
        let numbers = local.iter().copied().chain(normal.into_iter().flatten().map(|&n| n as f32)).chain(more);
        for (column, number) in numbers.enumerate() {
            match encoding {
                Encoding::Ascii => write!(file, "{}{number}", if column == 0 { "" } else { " " })?,
                Encoding::Binary => file.write_all(&number.to_le_bytes())?,
            }
        }
        if encoding == Encoding::Ascii {
            writeln!(file)?;
        }
    }
    for [a, b, c] in &mesh.triangles {
        match encoding {
            Encoding::Ascii => writeln!(file, "3 {a} {b} {c}")?,
            Encoding::Binary => {
                file.write_all(&[3])?;
                for index in [a, b, c] {
                    file.write_all(&index.to_le_bytes())?;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Attribute;

    fn mesh() -> Mesh {
        Mesh {
            positions: vec![[5e5, 4e6, 10.0], [5e5 + 30.0, 4e6, 20.5], [5e5, 4e6 + 30.0, 5.0]],
            triangles: vec![[0, 1, 2]],
            normals: None,
            attributes: Vec::new(),
        }
    }

    fn written(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
        let mut bytes = Vec::new();
        to_writer(&mut bytes, mesh, encoding).unwrap();
        bytes
    }

    #[test]
    fn attributes_are_properties_behind_the_others() {
        let attribute = Attribute { name: "resistance".to_owned(), values: vec![0.25, 0.5, 1.0] };
        let made = Mesh { attributes: vec![attribute], ..mesh() };
        let text = String::from_utf8(written(&made, Encoding::Ascii)).unwrap();
        assert!(text.contains("property float z\nproperty float resistance\nelement face"));
        assert!(text.contains("end_header\n0 0 5 0.25\n30 0 15.5 0.5\n0 30 0 1\n3 0 1 2\n"), "{text}");
        let short = Attribute { name: "stress".to_owned(), values: vec![0.0] };
        let named = Attribute { name: "Stress".to_owned(), values: vec![0.0; 3] };
        for bad in [short, named] {
            assert!(Mesh { attributes: vec![bad], ..mesh() }.check().is_err());
        }
    }

    #[test]
    fn ascii_states_its_origin_and_positions_relative_to_it() {
        let expected = "ply\nformat ascii 1.0\ncomment origin 500000 4000000 5\nelement vertex 3\nproperty float x\n\
                        property float y\nproperty float z\nelement face 1\nproperty list uchar uint vertex_indices\n\
                        end_header\n0 0 5\n30 0 15.5\n0 30 0\n3 0 1 2\n";
        assert_eq!(String::from_utf8(written(&mesh(), Encoding::Ascii)).unwrap(), expected);
    }

    #[test]
    fn binary_body_is_twelve_bytes_a_vertex_and_thirteen_a_triangle() {
        let bytes = written(&mesh(), Encoding::Binary);
        let body = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let numbers: Vec<f32> = bytes[body..body + 36].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        assert_eq!(numbers, [0.0, 0.0, 5.0, 30.0, 0.0, 15.5, 0.0, 30.0, 0.0]);
        assert_eq!(bytes[body + 36..], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }

    #[test]
    fn normals_add_twelve_bytes_a_vertex() {
        let with = mesh().with_normals();
        assert!(written(&with, Encoding::Binary).len() > written(&mesh(), Encoding::Binary).len() + 36);
    }

    #[test]
    fn index_beyond_the_vertices_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let broken = Mesh { triangles: vec![[0, 1, 3]], ..mesh() };
        let error = write(&folder.path().join("a.ply"), &broken, Encoding::Binary).unwrap_err();
        assert!(error.to_string().contains("triangle 0"), "{error}");
    }
}
