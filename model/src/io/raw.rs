//! RAW: bare samples, rows from north to south, everything else in the JSON sidecar (see [`super::sidecar`]).

use std::io::Write;
use std::path::Path;

use super::atomic::atomic_write;
use super::check::{flip_rows, load, writable};
use super::error::{ReadError, ReadErrorKind, WriteError, name_file};
use super::sidecar::{ByteOrder, SampleType, Sidecar, scaled_u16};
use crate::grid::Grid;

/// Reads `path` (32-bit float or scaled 16-bit samples, either byte order) by its sidecar `path.json`.
///
/// # Errors
/// [`ReadError`]: no sidecar, a sidecar that is not sound, a file whose length is not width × height × sample size, a
/// value that is neither finite nor no-data, or no value at all.
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    read_from(&bytes, &Sidecar::load(path)?, &name)
}

pub(super) fn read_from(bytes: &[u8], sidecar: &Sidecar, name: &str) -> Result<Grid<f32>, ReadError> {
    let length = bytes.len() as u64;
    let Some(order) = sidecar.byte_order else {
        let (place, expected) = ("\"byte_order\" in the sidecar", "\"little\" or \"big\"");
        return Err(ReadError::new(name, ReadErrorKind::Header, place, "nothing", expected, "add it to the sidecar"));
    };
    let little = order == ByteOrder::Little;
    match sidecar.sample {
        SampleType::F32 => {
            sidecar.count_exactly(name, length, 4)?;
            let sample = |b: &[u8; 4]| if little { f32::from_le_bytes(*b) } else { f32::from_be_bytes(*b) };
            let samples: Vec<f32> = bytes.as_chunks().0.iter().map(sample).collect();
            sidecar.grid_of_f32(name, &samples)
        }
        SampleType::U16 => {
            sidecar.count_exactly(name, length, 2)?;
            let sample = |b: &[u8; 2]| if little { u16::from_le_bytes(*b) } else { u16::from_be_bytes(*b) };
            let samples: Vec<u16> = bytes.as_chunks().0.iter().map(sample).collect();
            sidecar.grid_of_u16(name, &samples)
        }
    }
}

/// Writes 32-bit little-endian floats and the sidecar: nothing is lost.
///
/// # Errors
/// [`WriteError`]: a value that is neither finite nor no-data, nothing known, or the file system.
pub fn write_f32(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    let samples = flip_rows(grid.values(), grid.width());
    write(path, grid, SampleType::F32, &samples, |sample| sample.to_le_bytes())
}

/// Writes 16-bit little-endian unsigned samples scaled between the lowest and the highest elevation, and the sidecar.
/// Each elevation is kept to half of a step, (max − min)/65534/2, beside one rounding of `f32`.
///
/// # Errors
/// As [`write_f32`].
pub fn write_u16(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    write(path, grid, SampleType::U16, &scaled_u16(grid), |sample| sample.to_le_bytes())
}

fn write<T: Copy, const N: usize>(
    path: &Path,
    grid: &Grid<f32>,
    sample: SampleType,
    samples: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> Result<(), WriteError> {
    Sidecar::of(grid, sample, Some(ByteOrder::Little)).write_with(path, || {
        atomic_write(path, |file| {
            for &sample in samples {
                file.write_all(&bytes(sample))?;
            }
            Ok(())
        })
        .map_err(name_file(path))
    })
}

#[cfg(test)]
mod tests {
    use super::super::sidecar::{example, sidecar_path};
    use super::*;
    use std::fs;

    #[test]
    fn float_raw_gives_back_the_same_grid() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        write_f32(&path, &example()).unwrap();
        assert_eq!(read(&path).unwrap(), example());
        assert_eq!(fs::read(&path).unwrap()[..4], 500.25_f32.to_le_bytes(), "the north-west sample comes first");
    }

    #[test]
    fn sixteen_bit_raw_keeps_elevations_to_half_a_step_and_no_data() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.r16");
        write_u16(&path, &example()).unwrap();
        let back = read(&path).unwrap();
        // Half a step, and half an ulp of f32 at 1076 (2⁻¹⁴).
        let tolerance = 840.0 / 65534.0 / 2.0 + 6.2e-5;
        for (a, b) in example().values().iter().zip(back.values()) {
            assert!((a - b).abs() <= tolerance, "{a} {b}");
        }
        assert_eq!(back.no_data_count(), 1);
        assert_eq!(back.min_max(), example().min_max());
    }

    #[test]
    fn not_a_number_as_no_data_survives_both_sample_types() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        let grid = example().map(Some(f32::NAN), |value| value.unwrap_or(f32::NAN));
        for write in [write_f32, write_u16] {
            write(&path, &grid).unwrap();
            let back = read(&path).unwrap();
            assert!(back.no_data().unwrap().is_nan());
            assert_eq!((back.no_data_count(), back.known(2, 0)), (1, None));
        }
    }

    #[test]
    fn flat_ground_survives_sixteen_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        let flat = example().map(None, |_| 12.5);
        write_u16(&path, &flat).unwrap();
        assert_eq!(read(&path).unwrap(), flat);
    }

    #[test]
    fn big_endian_is_read() {
        let sidecar = Sidecar::of(&example(), SampleType::F32, Some(ByteOrder::Big));
        let bytes: Vec<u8> = flip_rows(example().values(), 3).iter().flat_map(|v: &f32| v.to_be_bytes()).collect();
        assert_eq!(read_from(&bytes, &sidecar, "a.raw").unwrap(), example());
    }

    #[test]
    fn wrong_length_missing_and_broken_sidecars_say_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        write_f32(&path, &example()).unwrap();
        let bytes = fs::read(&path).unwrap();

        fs::write(&path, &bytes[..23]).unwrap();
        let error = read(&path).unwrap_err();
        assert_eq!(error.kind, ReadErrorKind::Truncated);
        assert!(error.to_string().contains("3 × 2 samples"), "{error}");
        fs::write(&path, [&bytes[..], &[0]].concat()).unwrap();
        assert_eq!(&*read(&path).unwrap_err().found, "25 bytes");
        fs::write(&path, &bytes).unwrap();

        let beside = sidecar_path(&path);
        let text = fs::read_to_string(&beside).unwrap();
        for (from, to, place) in [
            ("\"width\": 3", "\"width\": 2147483648", "size in the sidecar"),
            ("\"width\": 3", "\"width\": -3", "line 3, column 13"),
            ("\"width\": 3", "\"widht\": 3", "line 3, column 9"),
            ("30.0", "0.0", "origin and spacing in the sidecar"),
            ("30.0", "-1.0", "origin and spacing in the sidecar"),
            ("terrain-raster/1", "other/1", "\"format\""),
            ("\"min\": 236.0", "\"min\": 1e9", "\"min\", \"max\""),
            ("\"byte_order\": \"little\",", "", "\"byte_order\" in the sidecar"),
        ] {
            assert!(text.contains(from), "{from}");
            fs::write(&beside, text.replace(from, to)).unwrap();
            let error = read(&path).unwrap_err();
            assert_eq!(&*error.place, place, "{error}");
        }
        fs::remove_file(&beside).unwrap();
        let error = read(&path).unwrap_err();
        assert!(error.to_string().contains("a.raw.json: the JSON sidecar"), "{error}");
    }

    #[test]
    fn not_a_number_that_is_not_no_data_is_refused_both_ways() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        write_f32(&path, &example()).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        bytes[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
        fs::write(&path, &bytes).unwrap();
        let error = read(&path).unwrap_err();
        assert_eq!((error.kind, &*error.place), (ReadErrorKind::Value, "column 2, row 1 from the north"));
        assert!(write_f32(&path, &example().map(None, |_| f32::NAN)).is_err());
    }
}
