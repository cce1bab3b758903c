//! Rasters and meshes in files, chosen by extension.
//!
//! | extension | in | out | holds |
//! |---|---|---|---|
//! | `.tif`, `.tiff` | [`geotiff`] | 32-bit floats | all of a grid |
//! | `.asc` | [`esri_ascii`] | text | all but most reference systems |
//! | `.hgt` | [`hgt`] | 16-bit metres | one degree, 1″ or 3″ |
//! | `.png` | [`png`] with its sidecar | 16 bits, scaled | all, elevations to half a step |
//! | `.raw`, `.r32`; `.r16` | [`raw`] with its sidecar | 32-bit floats; 16 bits, scaled | all |
//! | `.exr` | [`exr`] with its sidecar | 32-bit floats | all |
//! | `.ply`, `.obj`, `.glb` | – | [`ply`] (binary), [`obj`], [`glb`] | the surface, as triangles |
//!
//! Every reader checks a header against the length of the file before it allocates, and returns one line that names the
//! file, the place, what was expected and how to mend it. Every writer goes through [`atomic::atomic_write`].

pub mod atomic;
mod check;
mod error;
pub mod esri_ascii;
pub mod exr;
pub mod geotiff;
pub mod glb;
pub mod hgt;
mod local_metres;
pub mod obj;
pub mod ply;
pub mod png;
pub mod raw;
mod raw_window;
pub mod sidecar;
mod wkt;

#[cfg(test)]
mod hostile_tests;

use std::path::Path;

pub use error::{ReadError, ReadErrorKind, WriteError};
pub use local_metres::{LocalMetresError, LocalMetresReport, local_metres};
pub use png::write_png_rgb8;
pub use raw_window::RawWindows;

use crate::grid::Grid;
use crate::mesh::Mesh;

/// Reads a raster of any format of the module's table.
///
/// Every value of the result is finite or no-data, and at least one is known.
///
/// # Errors
/// [`ReadError`]: the extension, or what the format's reader says.
pub fn read_grid(path: &Path) -> Result<Grid<f32>, ReadError> {
    match extension(path).as_str() {
        "tif" | "tiff" => geotiff::read(path),
        "asc" => esri_ascii::read(path),
        "hgt" => hgt::read(path),
        "png" => png::read(path),
        "raw" | "r32" | "r16" => raw::read(path),
        "exr" => exr::read(path),
        other => {
            let expected = "one of .tif, .tiff, .asc, .hgt, .png, .raw, .r32, .r16, .exr";
            let found = if other.is_empty() { "no extension".to_string() } else { format!(".{other}") };
            let mend = "rename the file after its format, or convert it with gdal_translate";
            let name = error::name_of(path);
            Err(ReadError::new(&name, ReadErrorKind::Name, "name of the file", found, expected, mend))
        }
    }
}

/// Writes a raster in the format of its extension: see the module's table.
///
/// # Errors
/// [`WriteError`]: the extension, or what the format's writer says.
pub fn write_grid(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    let mesh = || {
        let mesh = Mesh::from_grid(grid).map_err(|error| WriteError::cannot(path, error, "write a smaller raster"))?;
        Ok::<Mesh, WriteError>(mesh.with_normals())
    };
    match extension(path).as_str() {
        "tif" | "tiff" => geotiff::write_f32(path, grid, geotiff::RasterType::default()),
        "asc" => esri_ascii::write(path, grid),
        "hgt" => hgt::write(path, grid),
        "png" => png::write(path, grid),
        "raw" | "r32" => raw::write_f32(path, grid),
        "r16" => raw::write_u16(path, grid),
        "exr" => exr::write(path, grid),
        "ply" | "obj" | "glb" => write_mesh(path, &mesh()?),
        other => Err(WriteError::Extension {
            file: error::name_of(path),
            extension: other.into(),
            known: ".tif, .tiff, .asc, .hgt, .png, .raw, .r32, .r16, .exr, .ply, .obj, .glb".into(),
        }),
    }
}

/// Writes a mesh in the format of its extension: see the module's table. PLY is binary.
///
/// # Errors
/// [`WriteError`]: the extension, or what the format's writer says.
pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<(), WriteError> {
    match extension(path).as_str() {
        "ply" => ply::write(path, mesh, ply::Encoding::Binary),
        "obj" => obj::write(path, mesh),
        "glb" => glb::write(path, mesh),
        other => Err(WriteError::Extension {
            file: error::name_of(path),
            extension: other.into(),
            known: ".ply, .obj, .glb".into(),
        }),
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lossless_formats_give_back_the_grid_through_the_front_door() {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["TIF", "raw", "r32", "exr"] {
            let path = folder.path().join("a").with_extension(extension);
            write_grid(&path, &sidecar::example()).unwrap();
            let back = read_grid(&path).unwrap();
            assert_eq!(back.values(), sidecar::example().values(), "{extension}");
            assert_eq!(back.origin(), sidecar::example().origin(), "{extension}");
            assert_eq!(back.crs().map(|crs| crs.kind), sidecar::example().crs().map(|crs| crs.kind), "{extension}");
        }
    }

    #[test]
    fn meshes_of_a_grid_are_written_by_extension() {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["ply", "obj", "glb"] {
            let path = folder.path().join("a").with_extension(extension);
            write_grid(&path, &sidecar::example()).unwrap();
            assert!(std::fs::metadata(&path).unwrap().len() > 100);
        }
    }

    #[test]
    fn unknown_extension_names_the_known_ones() {
        let error = read_grid(Path::new("dem.xyz")).unwrap_err();
        assert!(error.to_string().starts_with("dem.xyz: name of the file: .xyz; expected one of .tif"), "{error}");
        assert!(read_grid(Path::new("dem")).is_err());
        let error = write_grid(Path::new("dem.xyz"), &sidecar::example()).unwrap_err();
        assert!(error.to_string().contains(".asc"), "{error}");
    }

    #[test]
    fn missing_file_is_one_line_for_every_format() {
        for extension in ["tif", "asc", "hgt", "png", "raw", "r16", "exr"] {
            let error = read_grid(&Path::new("no/such/N36W085").with_extension(extension)).unwrap_err();
            assert_eq!(error.kind, ReadErrorKind::Io);
            assert!(error.to_string().contains("no/such/N36W085") && !error.to_string().contains('\n'), "{error}");
        }
    }
}
