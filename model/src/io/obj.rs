//! Wavefront OBJ meshes: text, positions in full precision.

use std::io::Write;
use std::path::Path;

use super::atomic::atomic_write;
use super::error::{Failure, WriteError, name_file};
use crate::mesh::Mesh;

/// Writes a mesh. z is up, as everywhere here; many viewers of OBJ take y for up.
///
/// # Errors
/// [`WriteError`]: a mesh that is not sound (see [`Mesh::check`]), or the file system.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), WriteError> {
    mesh.check().map_err(|error| WriteError::cannot(path, error, "repair the mesh"))?;
    atomic_write(path, |file| to_writer(file, mesh)).map_err(name_file(path))
}

fn to_writer(file: &mut impl Write, mesh: &Mesh) -> Result<(), Failure> {
    writeln!(file, "# metres, x east, y north, z up")?;
    for [x, y, z] in &mesh.positions {
        writeln!(file, "v {x} {y} {z}")?;
    }
    for [x, y, z] in mesh.normals.iter().flatten() {
        writeln!(file, "vn {x} {y} {z}")?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| u64::from(index) + 1);
        match mesh.normals {
            Some(_) => writeln!(file, "f {a}//{a} {b}//{b} {c}//{c}")?,
            None => writeln!(file, "f {a} {b} {c}")?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_start_at_one_and_normals_share_them() {
        let mesh = Mesh {
            positions: vec![[0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [0.0, 1.0, 0.1]],
            triangles: vec![[0, 1, 2]],
            normals: None,
            attributes: Vec::new(),
        };
        let mut text = Vec::new();
        to_writer(&mut text, &mesh).unwrap();
        assert!(text.ends_with(b"v 0 0 0.1\nv 1 0 0.1\nv 0 1 0.1\nf 1 2 3\n"));
        let mut text = Vec::new();
        to_writer(&mut text, &mesh.with_normals()).unwrap();
        assert!(text.ends_with(b"vn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//3\n"));
    }
}
