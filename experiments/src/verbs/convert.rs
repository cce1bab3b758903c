//! `terrain convert`: a raster from one format to another, and from degrees to metres.

use super::{VerbError, print};
use clap::Args;
use std::path::{Path, PathBuf};
use terrain_model::grid::Grid;
use terrain_model::io::geotiff::{RasterType, write_i16};
use terrain_model::io::{local_metres, read_grid, write_grid};

/// Converts a raster: .tif, .asc, .hgt, .png, .raw, .r32, .r16 or .exr in, any of these or .ply, .obj out.
///
/// A .tif holds 16-bit integers where every elevation is a whole number of metres that fits, else 32-bit floats.
#[derive(Args, Debug)]
pub struct Convert {
    /// The raster to read
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write; its extension is the format
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Turns degrees into metres, the south-west sample at (0, 0); prints the method's error
    #[arg(long)]
    local_metres: bool,
}

impl Convert {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: a file that cannot be read, written or flattened.
    pub fn run(&self) -> Result<(), VerbError> {
        let grid = read_grid(&self.input)?;
        if !self.local_metres {
            return write(&self.output, &grid);
        }
        let (metres, report) =
            local_metres(&grid).map_err(|error| VerbError::Other(format!("{}: {error}", self.input.display())))?;
        write(&self.output, &metres)?;
        print(&report.to_string())
    }
}

fn write(path: &Path, grid: &Grid<f32>) -> Result<(), VerbError> {
    let tiff = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tif") || e.eq_ignore_ascii_case("tiff"));
    match whole_metres(grid).filter(|_| tiff) {
        Some(integers) => write_i16(path, &integers, RasterType::Point)?,
        None => write_grid(path, grid)?,
    }
    Ok(())
}

/// The grid in 16-bit integers, if that loses nothing.
fn whole_metres(grid: &Grid<f32>) -> Option<Grid<i16>> {
    let whole = grid.values().iter().all(|&v| grid.is_no_data(v) || v.fract() == 0.0);
    grid.to_i16().ok().filter(|_| whole)
}
