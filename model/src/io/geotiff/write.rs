//! Writing a grid as a GeoTIFF of 32-bit floats or 16-bit integers, in Deflate.

use std::io::{Seek, Write};
use std::path::Path;

use tiff::TiffError;
use tiff::encoder::colortype::{ColorType, Gray32Float, GrayI16};
use tiff::encoder::{
    Compression, DeflateLevel, Predictor, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue,
};
use tiff::tags::Tag;

use super::super::atomic::atomic_write;
use super::super::check::{flip_rows, writable};
use super::super::error::{Failure, WriteError, name_file};
use super::place::keys_of;
use crate::grid::{Grid, Sample};

/// What a file says its pixels are (GeoKey 1025). Either way the samples are read back at the same place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RasterType {
    /// PixelIsArea, 1: the tie point is the outer corner of the north-west cell. For programs that ignore the key.
    Area,
    /// PixelIsPoint, 2: the tie point is the north-west sample. What a [`Grid`] is.
    #[default]
    Point,
}

/// Writes 32-bit floats. BigTIFF is used where the samples alone exceed 3.5 GB.
///
/// The tie point is the northernmost: the southern origin is read back to one rounding of the northern coordinate.
///
/// # Errors
/// [`WriteError`]: a value that is neither finite nor no-data, nothing known, a side above 2³² − 1, the file system.
pub fn write_f32(path: &Path, grid: &Grid<f32>, raster_type: RasterType) -> Result<(), WriteError> {
    writable(path, grid)?;
    // The encoder has no floating-point predictor, and without one more effort gains nothing.
    write::<Gray32Float, f32>(path, grid, raster_type, (DeflateLevel::Fast, Predictor::None))
}

/// Writes 16-bit signed integers, differenced along rows before they are compressed: see [`Grid::to_i16`].
///
/// # Errors
/// As [`write_f32`].
pub fn write_i16(path: &Path, grid: &Grid<i16>, raster_type: RasterType) -> Result<(), WriteError> {
    writable(path, &grid.to_f32())?;
    write::<GrayI16, i16>(path, grid, raster_type, (DeflateLevel::Best, Predictor::Horizontal))
}

fn write<C: ColorType<Inner = T>, T: Sample>(
    path: &Path,
    grid: &Grid<T>,
    raster_type: RasterType,
    (level, predictor): (DeflateLevel, Predictor),
) -> Result<(), WriteError>
where
    [T]: TiffValue,
{
    let bytes = grid.values().len() as u64 * size_of::<T>() as u64;
    atomic_write(path, |file| {
        if bytes > 3_500_000_000 {
            encode::<C, T, TiffKindBig, _>(file, grid, raster_type, (level, predictor))
        } else {
            encode::<C, T, TiffKindStandard, _>(file, grid, raster_type, (level, predictor))
        }
        .map_err(|error| match error {
            TiffError::IoError(error) => Failure::Io(error),
            other => Failure::other(other),
        })
    })
    .map_err(name_file(path))
}

fn encode<C: ColorType<Inner = T>, T: Sample, K: TiffKind, W: Write + Seek>(
    file: W,
    grid: &Grid<T>,
    raster_type: RasterType,
    (level, predictor): (DeflateLevel, Predictor),
) -> Result<(), TiffError>
where
    [T]: TiffValue,
{
    let (width, height) = (u32::try_from(grid.width())?, u32::try_from(grid.height())?);
    let mut encoder =
        TiffEncoder::<W, K>::new_generic(file)?.with_compression(Compression::Deflate(level)).with_predictor(predictor);
    let mut image = encoder.new_image::<C>(width, height)?;
    let tags = image.encoder();

    let spacing = grid.spacing();
    let (half, code) = match raster_type {
        RasterType::Area => (0.5, 1),
        RasterType::Point => (0.0, 2),
    };
    let west = grid.origin().x - half * spacing.x;
    let north = grid.bounds().1.y + half * spacing.y;
    tags.write_tag(Tag::ModelPixelScaleTag, &[spacing.x, spacing.y, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, west, north, 0.0][..])?;
    let keys = keys_of(grid.crs(), code);
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys.directory[..])?;
    if !keys.doubles.is_empty() {
        tags.write_tag(Tag::GeoDoubleParamsTag, &keys.doubles[..])?;
    }
    // The format wants ASCII: another character becomes one '?', so that the offsets of the keys keep.
    let ascii: String = keys.ascii.chars().map(|c| if c.is_ascii() && c != '\0' { c } else { '?' }).collect();
    if !ascii.is_empty() {
        tags.write_tag(Tag::GeoAsciiParamsTag, ascii.as_str())?;
    }
    if let Some(marker) = grid.no_data() {
        tags.write_tag(Tag::GdalNodata, text_of(marker.to_f64()).as_str())?;
    }
    image.write_data(&flip_rows(grid.values(), grid.width()))
}

/// The shortest decimals that give back `value`, in the spelling GDAL uses.
fn text_of(value: f64) -> String {
    if value.is_nan() {
        "nan".into()
    } else if value.abs() < 1e16 {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}
