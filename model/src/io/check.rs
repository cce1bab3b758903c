//! What every reader and writer asks of a raster, whatever its format.

use std::fs;
use std::path::Path;

use super::error::{ReadError, ReadErrorKind, WriteError, name_of};
use crate::grid::Grid;

/// The bytes of a file, with its name for messages.
pub(super) fn load(path: &Path) -> Result<(String, Vec<u8>), ReadError> {
    let name = name_of(path);
    let bytes = fs::read(path).map_err(|error| ReadError::io(&name, &error))?;
    Ok((name, bytes))
}

/// Rows in the opposite order: north to south becomes south to north, and back.
pub(super) fn flip_rows<T: Copy>(values: &[T], width: usize) -> Vec<T> {
    values.chunks(width.max(1)).rev().flatten().copied().collect()
}

/// width × height as a `usize`, once it is known that `capacity`, the number of samples the file has room for, is not
/// exceeded: nothing is allocated from a header before this.
pub(super) fn sample_count(
    file: &str,
    place: &str,
    (width, height): (u64, u64),
    capacity: u64,
    bytes: u64,
) -> Result<usize, ReadError> {
    let error = |kind, expected: String, mend| {
        Err(ReadError::new(file, kind, place, format!("{width} × {height} samples"), expected, mend))
    };
    if width == 0 || height == 0 {
        return error(ReadErrorKind::Header, "at least one sample each way".into(), "correct the size in the header");
    }
    match width.checked_mul(height).filter(|&count| count <= capacity).and_then(|count| usize::try_from(count).ok()) {
        Some(count) => Ok(count),
        None => {
            let room = format!("at most the {capacity} samples that {bytes} bytes can hold");
            error(ReadErrorKind::Truncated, room, "correct the size in the header, or copy the whole file again")
        }
    }
}

/// The grid, if each of its values is finite or no-data and at least one is known.
pub(super) fn sound(file: &str, grid: Grid<f32>) -> Result<Grid<f32>, ReadError> {
    match flaw(&grid) {
        None => Ok(grid),
        Some(Flaw::NothingKnown) => Err(ReadError::new(
            file,
            ReadErrorKind::Value,
            "all samples",
            "no-data everywhere",
            "at least one elevation",
            "check the no-data value, or take another tile",
        )),
        Some(Flaw::NotFinite { i, j, value }) => Err(ReadError::new(
            file,
            ReadErrorKind::Value,
            format!("column {}, row {} from the north", i + 1, grid.height() - j),
            value,
            "a finite elevation or the no-data value",
            "declare this value as no-data, or fill the hole",
        )),
    }
}

/// Refuses a raster that [`sound`] would refuse when it is read back.
pub(super) fn writable(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    match flaw(grid) {
        None => Ok(()),
        Some(Flaw::NothingKnown) => {
            Err(WriteError::cannot(path, "every sample is no-data", "write a raster with an elevation"))
        }
        Some(Flaw::NotFinite { i, j, value }) => Err(WriteError::cannot(
            path,
            format!("the value at column {i}, row {j} from the south is {value}"),
            "mark it as no-data, or fill the hole",
        )),
    }
}

enum Flaw {
    NothingKnown,
    NotFinite { i: usize, j: usize, value: f32 },
}

fn flaw(grid: &Grid<f32>) -> Option<Flaw> {
    let mut known = false;
    for (k, &value) in grid.values().iter().enumerate() {
        if grid.is_no_data(value) {
            continue;
        }
        if !value.is_finite() {
            return Some(Flaw::NotFinite { i: k % grid.width(), j: k / grid.width(), value });
        }
        known = true;
    }
    if known { None } else { Some(Flaw::NothingKnown) }
}
