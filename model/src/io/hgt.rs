//! SRTM `.hgt` tiles: big-endian 16-bit metres, one degree square, placed by the file's name.
//!
//! `N36W085.hgt` has its south-west sample at 36° N, 85° W; 1201² samples (3″) or 3601² (1″), rows from north to south,
//! −32768 for a void. The outer rows and columns are shared with the neighbouring tiles, so samples sit on the whole
//! degrees and nothing is shifted (SRTM documentation, NASA/USGS, 2015, §2.1.3).

use std::io::Write;
use std::path::Path;

use glam::DVec2;

use super::atomic::atomic_write;
use super::check::{flip_rows, load, sound, writable};
use super::error::{ReadError, ReadErrorKind, WriteError, name_file, quoted};
use crate::grid::{Crs, Grid};

const SIDES: [usize; 2] = [1201, 3601];

/// Reads a tile; the grid is in degrees (EPSG:4326) with no-data −32768.
///
/// # Errors
/// [`ReadError`]: a name that gives no place, a length other than 2·1201² or 2·3601² bytes, or voids only.
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    read_from(&bytes, &stem, &name)
}

pub(super) fn read_from(bytes: &[u8], stem: &str, name: &str) -> Result<Grid<f32>, ReadError> {
    let Some(origin) = place(stem) else {
        let (found, expected) = (quoted(stem.as_bytes()), "a name such as N36W085.hgt");
        let mend = "name the file after its south-west corner";
        return Err(ReadError::new(name, ReadErrorKind::Name, "name of the file", found, expected, mend));
    };
    let Some(side) = SIDES.into_iter().find(|side| 2 * side * side == bytes.len()) else {
        let (found, expected) = (format!("{} bytes", bytes.len()), "2884802 bytes (1201²) or 25934402 (3601²)");
        let mend = "copy the whole tile again, or unpack it if it is compressed";
        return Err(ReadError::new(name, ReadErrorKind::Truncated, "length of the file", found, expected, mend));
    };
    let samples: Vec<f32> = bytes.as_chunks().0.iter().map(|b| f32::from(i16::from_be_bytes(*b))).collect();
    let spacing = DVec2::splat(1.0 / (side - 1) as f64);
    let grid = Grid::new(origin, spacing, side, side, flip_rows(&samples, side))
        .map_err(|error| ReadError::grid(name, "name of the file", &error))?;
    sound(name, grid.with_no_data(Some(f32::from(i16::MIN))).with_crs(Some(Crs::geographic(Some(4326)))))
}

/// Writes a tile; elevations are rounded to whole metres, no-data becomes −32768.
///
/// # Errors
/// [`WriteError`]: a grid that is not geographic, or not 1201² or 3601² samples over the degree the file is named
/// after (to 10⁻⁹ degrees); an elevation outside of ±32767 m; the file system.
pub fn write(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let Some(origin) = place(&stem) else {
        let problem = format!("{} is no place", quoted(stem.as_bytes()));
        return Err(WriteError::cannot(path, problem, "name the file after its south-west corner, as N36W085.hgt"));
    };
    let side = grid.width();
    let fits = SIDES.contains(&side)
        && grid.height() == side
        && grid.crs().is_some_and(Crs::is_geographic)
        && (grid.origin() - origin).abs().max_element() < 1e-9
        && (grid.bounds().1 - origin - DVec2::ONE).abs().max_element() < 1e-9;
    if !fits {
        let problem =
            format!("a tile named {stem} holds 1201² or 3601² samples over that degree; this grid is another");
        return Err(WriteError::cannot(path, problem, "write a GeoTIFF, or resample with gdalwarp"));
    }
    let metres = grid.to_i16().map_err(|error| WriteError::cannot(path, error, "write a float GeoTIFF"))?;
    let samples = flip_rows(metres.values(), side);
    atomic_write(path, |file| {
        for sample in samples {
            file.write_all(&sample.to_be_bytes())?;
        }
        Ok(())
    })
    .map_err(name_file(path))
}

/// (longitude, latitude) of the south-west corner, from a name such as `N36W085` (anything may follow it).
fn place(stem: &str) -> Option<DVec2> {
    let degrees = |sign: Option<&str>, positive, negative, digits: Option<&str>, limit: f64| {
        let sign = sign?;
        let direction = if sign.eq_ignore_ascii_case(positive) {
            1.0
        } else if sign.eq_ignore_ascii_case(negative) {
            -1.0
        } else {
            return None;
        };
        let digits = digits?;
        if !digits.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        Some(direction * digits.parse::<f64>().ok()?).filter(|value| (-limit..limit).contains(value))
    };
    let latitude = degrees(stem.get(0..1), "n", "s", stem.get(1..3), 90.0)?;
    let longitude = degrees(stem.get(3..4), "e", "w", stem.get(4..7), 180.0)?;
    Some(DVec2::new(longitude, latitude))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn tile() -> Vec<u8> {
        let mut bytes = vec![0; 2 * 1201 * 1201];
        bytes[..2].copy_from_slice(&437_i16.to_be_bytes());
        bytes[2..4].copy_from_slice(&i16::MIN.to_be_bytes());
        bytes
    }

    #[test]
    fn first_sample_is_the_north_west_corner_of_the_degree() {
        let grid = read_from(&tile(), "N36W085", "N36W085.hgt").unwrap();
        assert_eq!(grid.bounds(), (DVec2::new(-85.0, 36.0), DVec2::new(-84.0, 37.0)));
        assert_eq!((grid.known(0, 1200), grid.known(1, 1200)), (Some(437.0), None));
        assert!(!grid.is_metric());
    }

    #[test]
    fn all_four_quarters_of_the_globe_have_names() {
        assert_eq!(place("S01E179"), Some(DVec2::new(179.0, -1.0)));
        assert_eq!(place("n00w001.SRTMGL1"), Some(DVec2::new(-1.0, 0.0)));
        for bad in ["", "N36", "X36W085", "N3aW085", "N90W085", "N36W181", "N+6W085", "Né6W085"] {
            assert_eq!(place(bad), None, "{bad}");
        }
    }

    #[test]
    fn written_tile_is_the_one_that_was_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("N36W085.hgt");
        write(&path, &read_from(&tile(), "N36W085", "a").unwrap()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), tile());
        let elsewhere = folder.path().join("N37W085.hgt");
        assert!(write(&elsewhere, &read(&path).unwrap()).is_err());
    }

    #[test]
    fn truncated_and_misnamed_tiles_and_tiles_of_voids_are_refused() {
        let error = read_from(&tile()[..1000], "N36W085", "N36W085.hgt").unwrap_err();
        assert_eq!((error.kind, &*error.found), (ReadErrorKind::Truncated, "1000 bytes"));
        assert_eq!(read_from(&tile(), "dem", "dem.hgt").unwrap_err().kind, ReadErrorKind::Name);
        let voids: Vec<u8> = (0..1201 * 1201).flat_map(|_| i16::MIN.to_be_bytes()).collect();
        let error = read_from(&voids, "N36W085", "N36W085.hgt").unwrap_err();
        assert_eq!((error.kind, &*error.place), (ReadErrorKind::Value, "all samples"));
    }
}
