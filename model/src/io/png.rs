//! PNG: elevations in 16 bits of grey with a JSON sidecar (see [`super::sidecar`]), and plain 8-bit RGB pictures.

use std::io::Cursor;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, Limits};

use super::atomic::atomic_write;
use super::check::{load, sample_count, writable};
use super::error::{Failure, ReadError, ReadErrorKind, WriteError, name_file};
use super::sidecar::{SampleType, Sidecar, scaled_u16};
use crate::grid::Grid;

/// Reads 16-bit grey by the sidecar `path.json`.
///
/// # Errors
/// [`ReadError`]: no sidecar, a sidecar that is not sound or of another size, a file that is not a PNG of 16-bit grey,
/// or a truncated one.
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    read_from(&bytes, &Sidecar::load(path)?, &name)
}

pub(super) fn read_from(bytes: &[u8], sidecar: &Sidecar, name: &str) -> Result<Grid<f32>, ReadError> {
    let kind = if bytes.starts_with(b"\x89PNG\r\n\x1a\n") { ReadErrorKind::Truncated } else { ReadErrorKind::Magic };
    let broken = |place, error: ImageError| {
        let mend = "check that the file is a PNG, and copy the whole file again";
        ReadError::new(name, kind, place, error, "a PNG that can be decoded", mend)
    };
    let length = bytes.len() as u64;
    // Deflate expands at most 1032 times; the limit also covers the decoder's own buffers of a few rows.
    let room = length.saturating_mul(1032);
    let mut limits = Limits::default();
    limits.max_alloc = Some(room.max(1 << 20));
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(|error| broken("header", error))?;
    let (width, height) = decoder.dimensions();
    if (u64::from(width), u64::from(height)) != (sidecar.width, sidecar.height) {
        let (found, expected) = (format!("{width} × {height}"), format!("{} × {}", sidecar.width, sidecar.height));
        let mend = "correct the sidecar, or take the one written with the image";
        return Err(ReadError::new(name, ReadErrorKind::Header, "size in the sidecar", found, expected, mend));
    }
    let colour = decoder.original_color_type();
    if colour != ExtendedColorType::L16 || sidecar.sample != SampleType::U16 {
        let (found, expected) = (format!("{colour:?}, {:?} in the sidecar", sidecar.sample), "16-bit grey, u16");
        let mend = "convert it to 16-bit grey; 8 bits are too coarse for elevations";
        return Err(ReadError::new(name, ReadErrorKind::Unsupported, "colour type", found, expected, mend));
    }
    let count = sample_count(name, "size", (sidecar.width, sidecar.height), room / 2, length)?;
    let mut decoded = vec![0; 2 * count];
    decoder.read_image(&mut decoded).map_err(|error| broken("image data", error))?;
    let samples: Vec<u16> = decoded.as_chunks().0.iter().map(|b| u16::from_ne_bytes(*b)).collect();
    sidecar.grid_of_u16(name, &samples)
}

/// Writes 16-bit grey scaled between the lowest and the highest elevation, north up, and the sidecar. Each elevation is
/// kept to half of a step, (max − min)/65534/2, beside one rounding of `f32`.
///
/// # Errors
/// [`WriteError`]: a value that is neither finite nor no-data, nothing known, a side above 2³¹ − 1, the file system.
pub fn write(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    let bytes: Vec<u8> = scaled_u16(grid).iter().flat_map(|sample| sample.to_ne_bytes()).collect();
    Sidecar::of(grid, SampleType::U16, None)
        .write_with(path, || encode(path, grid.width(), grid.height(), &bytes, ExtendedColorType::L16))
}

/// Writes a picture: `3 * width * height` bytes, red, green, blue, from the top left, row by row.
///
/// # Errors
/// [`WriteError`]: another number of bytes, an empty picture, or the file system.
pub fn write_png_rgb8(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<(), WriteError> {
    encode(path, width, height, rgb, ExtendedColorType::Rgb8)
}

fn encode(path: &Path, width: usize, height: usize, bytes: &[u8], colour: ExtendedColorType) -> Result<(), WriteError> {
    let size = usize::from(colour.bits_per_pixel() / 8);
    let expected = width.checked_mul(height).and_then(|count| count.checked_mul(size));
    let sides = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let sides = sides.filter(|&(width, height)| width > 0 && height > 0 && width.max(height) <= i32::MAX as u32);
    let (Some((columns, rows)), true) = (sides, expected == Some(bytes.len())) else {
        let problem = format!("{} bytes are no picture of {width} × {height} pixels of {size} bytes", bytes.len());
        return Err(WriteError::cannot(path, problem, "give width · height pixels"));
    };
    atomic_write(path, |file| {
        PngEncoder::new_with_quality(file, CompressionType::Default, FilterType::Adaptive)
            .write_image(bytes, columns, rows, colour)
            .map_err(|error| match error {
                ImageError::IoError(error) => Failure::Io(error),
                other => Failure::other(other),
            })
    })
    .map_err(name_file(path))
}

#[cfg(test)]
mod tests {
    use super::super::sidecar::{example, sidecar_path};
    use super::*;
    use std::fs;

    #[test]
    fn elevations_are_kept_to_half_a_step_and_their_place_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write(&path, &example()).unwrap();
        let back = read(&path).unwrap();
        // Half a step, and half an ulp of f32 at 1076 (2⁻¹⁴).
        let tolerance = 840.0 / 65534.0 / 2.0 + 6.2e-5;
        for (a, b) in example().values().iter().zip(back.values()) {
            assert!((a - b).abs() <= tolerance, "{a} {b}");
        }
        assert_eq!(
            (back.origin(), back.spacing(), back.crs()),
            (example().origin(), example().spacing(), example().crs())
        );
        assert_eq!((back.known(2, 0), back.no_data()), (None, Some(-9999.0)));
    }

    #[test]
    fn picture_has_its_first_pixel_at_the_top_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9];
        write_png_rgb8(&path, 2, 2, &rgb).unwrap();
        let image = image::load_from_memory(&fs::read(&path).unwrap()).unwrap().into_rgb8();
        assert_eq!(image.get_pixel(1, 0).0, [0, 255, 0]);
        for (width, height) in [(2, 1), (0, 0), (usize::MAX, 2)] {
            assert!(write_png_rgb8(&path, width, height, &rgb).is_err());
        }
    }

    #[test]
    fn other_colours_sizes_and_truncated_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write(&path, &example()).unwrap();
        let bytes = fs::read(&path).unwrap();

        write_png_rgb8(&path, 3, 2, &[0; 18]).unwrap();
        assert_eq!(read(&path).unwrap_err().kind, ReadErrorKind::Unsupported);
        write_png_rgb8(&path, 3, 1, &[0; 9]).unwrap();
        assert_eq!(&*read(&path).unwrap_err().place, "size in the sidecar");
        for length in [4, 20, 40, bytes.len() - 20] {
            fs::write(&path, &bytes[..length]).unwrap();
            let error = read(&path).unwrap_err();
            assert!(matches!(error.kind, ReadErrorKind::Truncated | ReadErrorKind::Magic), "{length}: {error}");
        }
        fs::remove_file(sidecar_path(&path)).unwrap();
        assert_eq!(read(&path).unwrap_err().kind, ReadErrorKind::Io);
    }
}
