//! Reading a GeoTIFF into a grid of `f32`.

use std::io::Cursor;
use std::path::Path;

use tiff::TiffError;
use tiff::decoder::{Decoder, DecodingResult, Limits};

use super::super::check::{flip_rows, load, sound};
use super::super::error::{ReadError, ReadErrorKind};
use super::directory::Directory;
use super::layout::Layout;
use super::place::{crs, keys, place};
use crate::grid::Grid;

/// Reads the first image of a GeoTIFF: u8, i8, u16, i16, u32, i32, f32 or f64 samples, uncompressed or in LZW, Deflate
/// or PackBits, in strips or tiles.
///
/// Samples become `f32`: exact up to 24 bits, rounded to nearest beyond. The file and the grid are in memory together.
///
/// # Errors
/// [`ReadError`] naming the tag, strip or sample: see [`ReadErrorKind`].
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    read_from(&bytes, &name)
}

/// As [`read`], from the bytes of a file; `name` stands in messages.
///
/// # Errors
/// As [`read`].
pub fn read_from(bytes: &[u8], name: &str) -> Result<Grid<f32>, ReadError> {
    let directory = Directory::read(bytes, name)?;
    let layout = Layout::read(&directory, name, bytes.len() as u64)?;
    if directory.text(42112).is_some_and(|xml| xml.contains("role=\"scale\"") || xml.contains("role=\"offset\"")) {
        let mend = "apply them with gdal_translate -unscale IN OUT";
        let found = "a scale or an offset for the samples";
        return Err(directory.wrong(ReadErrorKind::Unsupported, 42112, found, "elevations in metres", mend));
    }
    let keys = keys(&directory)?;
    let (origin, spacing) = place(&directory, &keys, layout.height)?;
    let no_data = NoData::read(&directory, layout.float)?;
    let values = decode(bytes, name, &layout, &no_data)?;
    let crs = crs(&directory, keys)?;
    let grid = Grid::new(origin, spacing, layout.width, layout.height, flip_rows(&values, layout.width))
        .map_err(|error| ReadError::grid(name, "tags 33550, 33922", &error))?;
    sound(name, grid.with_no_data(no_data.declared.map(|_| no_data.marker)).with_crs(crs))
}

/// The no-data value as declared in GDAL_NODATA, and as it is in a grid of `f32`.
struct NoData {
    declared: Option<f64>,
    marker: f32,
    float: bool,
}

impl NoData {
    fn read(directory: &Directory, float: bool) -> Result<NoData, ReadError> {
        let Some(text) = directory.text(42113) else { return Ok(NoData { declared: None, marker: 0.0, float }) };
        let Ok(declared) = text.trim().parse::<f64>() else {
            let (found, mend) = (format!("{text:?}"), "set it with gdal_translate -a_nodata VALUE IN OUT");
            return Err(directory.wrong(ReadErrorKind::Header, 42113, found, "a number", mend));
        };
        let marker = declared as f32;
        // −1.8e308, the customary marker of f64 files, has no f32.
        let marker = if marker.is_infinite() { f32::MIN } else { marker };
        Ok(NoData { declared: Some(declared), marker, float })
    }

    /// A sample as `f32`. Float samples are compared as `f32`, since the text of the tag is often rounded to that.
    fn apply(&self, sample: f64) -> f32 {
        let value = sample as f32;
        match self.declared {
            Some(declared) if sample == declared || (sample.is_nan() && declared.is_nan()) => self.marker,
            Some(declared) if self.float && value == declared as f32 => self.marker,
            _ => value,
        }
    }
}

/// The samples from the north-west, row by row.
fn decode(bytes: &[u8], name: &str, layout: &Layout, no_data: &NoData) -> Result<Vec<f32>, ReadError> {
    let broken = |place: String, error: TiffError| {
        let mend = "copy the whole file again, or write it again with gdal_translate";
        ReadError::new(name, ReadErrorKind::Truncated, place, error, "samples that can be decoded", mend)
    };
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|error| broken("the first directory".into(), error))?;
    let most = usize::try_from(layout.most_bytes).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most;
    limits.intermediate_buffer_size = most.max(bytes.len());
    decoder = decoder.with_limits(limits);

    // Zeroed memory is not touched before a strip is decoded into it, so a header that lies costs address space only.
    let mut values = vec![0.0_f32; layout.count];
    let (chunk_width, chunk_height) = decoder.chunk_dimensions();
    let (chunk_width, chunk_height) = (chunk_width.max(1) as usize, chunk_height.max(1) as usize);
    let across = layout.width.div_ceil(chunk_width);
    for (k, &stored) in layout.chunks.iter().enumerate() {
        let (column, row) = (k % across * chunk_width, k / across * chunk_height);
        let width = chunk_width.min(layout.width.saturating_sub(column));
        let rows = values.chunks_exact_mut(layout.width).skip(row).take(chunk_height);
        let targets = rows.filter_map(|row| row.get_mut(column..column + width));
        if stored == (0, 0) {
            targets.for_each(|target| target.fill(no_data.marker));
            continue;
        }
        // Whole rows of the tile, also where they reach beyond the image: the decoder's other path, which skips what is
        // beyond, loses the end of LZW data (image-tiff issue 395).
        let mut samples = DecodingResult::U8(Vec::new());
        decoder
            .read_chunk_to_buffer(&mut samples, k as u32, chunk_width * layout.sample_bytes)
            .map_err(|error| broken(format!("strip or tile {k}"), error))?;
        if !copy(targets, samples, chunk_width, no_data) {
            let found = "fewer samples than its size says";
            let (place, mend) = (format!("strip or tile {k}"), "copy the whole file again");
            return Err(ReadError::new(name, ReadErrorKind::Truncated, place, found, "all of them", mend));
        }
    }
    Ok(values)
}

/// Copies a decoded chunk, `width` samples a row, into the rows it covers, which may be shorter; false when it has too
/// few.
fn copy<'a>(
    targets: impl Iterator<Item = &'a mut [f32]>,
    samples: DecodingResult,
    width: usize,
    no_data: &NoData,
) -> bool {
    fn rows<'a, T: Copy>(
        targets: impl Iterator<Item = &'a mut [f32]>,
        samples: &[T],
        width: usize,
        convert: impl Fn(T) -> f32,
    ) -> bool {
        let mut sources = samples.chunks_exact(width.max(1));
        for target in targets {
            let Some(source) = sources.next() else { return false };
            for (value, &sample) in target.iter_mut().zip(source) {
                *value = convert(sample);
            }
        }
        true
    }
    match samples {
        DecodingResult::U8(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::I8(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::U16(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::I16(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::U32(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::I32(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::F32(s) => rows(targets, &s, width, |v| no_data.apply(f64::from(v))),
        DecodingResult::F64(s) => rows(targets, &s, width, |v| no_data.apply(v)),
        // The layout admits no other sample type.
        DecodingResult::U64(_) | DecodingResult::I64(_) | DecodingResult::F16(_) => false,
    }
}
