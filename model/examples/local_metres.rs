//! Turns a raster in degrees into one in metres: `cargo run -p terrain-model --example local_metres IN OUT`.
//!
//! OUT in `.tif` is of 16-bit integers where every elevation is a whole number of metres that fits; any other format, or
//! other elevations, as `write_grid` has them. What the conversion did, and how wrong it is, goes to standard output.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use terrain_model::grid::Grid;
use terrain_model::io::geotiff::{RasterType, write_i16};
use terrain_model::io::{local_metres, read_grid, write_grid};

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [input, output] = arguments.as_slice() else {
        eprintln!("usage: local_metres IN OUT");
        return ExitCode::from(2);
    };
    match convert(input, output) {
        Ok(report) => {
            println!("{report}");
            ExitCode::SUCCESS
        }
        Err(line) => {
            eprintln!("{line}");
            ExitCode::FAILURE
        }
    }
}

fn convert(input: &Path, output: &Path) -> Result<String, String> {
    let degrees = read_grid(input).map_err(|error| error.to_string())?;
    let (metres, report) = local_metres(&degrees).map_err(|error| format!("{}: {error}", input.display()))?;
    let tiff = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tif"));
    match whole_metres(&metres).filter(|_| tiff) {
        Some(integers) => write_i16(output, &integers, RasterType::Point),
        None => write_grid(output, &metres),
    }
    .map_err(|error| error.to_string())?;
    Ok(report.to_string())
}

/// The grid in 16-bit integers, if that loses nothing.
fn whole_metres(grid: &Grid<f32>) -> Option<Grid<i16>> {
    let whole = grid.values().iter().all(|&v| grid.is_no_data(v) || v.fract() == 0.0);
    grid.to_i16().ok().filter(|_| whole)
}
