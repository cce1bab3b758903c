//! How the samples of a TIFF lie in the file, checked before anything is decoded or allocated.

use super::super::check::sample_count;
use super::super::error::{ReadError, ReadErrorKind};
use super::directory::Directory;

pub(super) struct Layout {
    pub width: usize,
    pub height: usize,
    /// width × height.
    pub count: usize,
    /// Bytes of a sample.
    pub sample_bytes: usize,
    /// Whether samples are floating-point numbers.
    pub float: bool,
    /// (offset, bytes) of each strip or tile; (0, 0) for one that GDAL left out as all no-data.
    pub chunks: Vec<(u64, u64)>,
    /// The most bytes that decoded strips or tiles may need.
    pub most_bytes: u64,
}

const MEND: &str = "convert it with gdal_translate -b 1 -co COMPRESS=DEFLATE -co PROFILE=GeoTIFF IN OUT";

impl Layout {
    pub fn read(directory: &Directory, file: &str, length: u64) -> Result<Layout, ReadError> {
        let unsupported =
            |tag, found: String, expected| Err(directory.wrong(ReadErrorKind::Unsupported, tag, found, expected, MEND));
        // The most bytes that one byte can decode to: Deflate 1032 (zlib's bound); LZW a 12-bit code for at most 3838
        // bytes; PackBits two bytes for 128.
        let expansion = match directory.first(259, 1)? {
            1 => 1,
            5 => 2560,
            8 | 32946 => 1040,
            32773 => 64,
            other => {
                let expected = "none (1), LZW (5), Deflate (8 or 32946) or PackBits (32773)";
                return unsupported(259, format!("compression {other}"), expected);
            }
        };
        let bands = directory.first(277, 1)?;
        if bands != 1 {
            return unsupported(277, format!("{bands} bands"), "one");
        }
        let colour = directory.first(262, 1)?;
        if colour != 1 {
            return unsupported(262, format!("interpretation {colour}"), "1, where larger is brighter");
        }
        let (format, bits) = (directory.first(339, 1)?, directory.first(258, 1)?);
        if !matches!((format, bits), (1 | 2, 8 | 16 | 32) | (3, 32 | 64)) {
            let expected = "unsigned or signed integers (1, 2) of 8, 16 or 32 bits, or floats (3) of 32 or 64";
            return unsupported(339, format!("sample format {format} of {bits} bits"), expected);
        }
        let predictor = directory.first(317, 1)?;
        if !matches!((predictor, format), (1 | 2, _) | (3, 3)) {
            let expected = "none (1), horizontal (2), or floating-point (3) for floats";
            return unsupported(317, format!("predictor {predictor} with sample format {format}"), expected);
        }
        // The decoder returns such samples with their bytes reversed: better none than wrong ones.
        if predictor == 3 && !directory.is_little_endian() {
            let found = "the floating-point predictor in a big-endian file".into();
            return unsupported(317, found, "it in a little-endian file only");
        }

        let size = (directory.first(256, 0)?, directory.first(257, 0)?);
        let (chunk_bytes, chunks) = chunks(directory, size, bits / 8, length)?;
        let stored: u64 = chunks.iter().fold(0, |sum: u64, &(_, bytes)| sum.saturating_add(bytes)).min(length);
        let sparse = chunks.iter().filter(|&&chunk| chunk == (0, 0)).count() as u64;
        // A left-out tile costs 8 bytes of tags and stands for a whole tile: bounded by a common size, 1024² of f32.
        let sparse_bytes = sparse.saturating_mul(chunk_bytes.min(1 << 22));
        let most_bytes = stored.saturating_mul(expansion).saturating_add(sparse_bytes);
        let count =
            sample_count(file, "tags 256, 257 (ImageWidth, ImageLength)", size, most_bytes / (bits / 8), length)?;
        // A tile is stored whole, also where it reaches beyond the image.
        if chunk_bytes > most_bytes.max(1 << 22) {
            let found = format!("tiles of {chunk_bytes} bytes");
            return unsupported(322, found, "tiles that the file has room for");
        }
        // Both sides fit in a usize, as their product does.
        let most_bytes = most_bytes.max(chunk_bytes);
        let (width, height, sample_bytes) = (size.0 as usize, size.1 as usize, bits as usize / 8);
        Ok(Layout { width, height, count, sample_bytes, float: format == 3, chunks, most_bytes })
    }
}

/// Bytes of a decoded strip or tile, and where each is stored.
fn chunks(
    directory: &Directory,
    (width, height): (u64, u64),
    sample: u64,
    length: u64,
) -> Result<(u64, Vec<(u64, u64)>), ReadError> {
    let tiled = directory.unsigned(324)?.is_some();
    let (offsets_tag, counts_tag) = if tiled { (324, 325) } else { (273, 279) };
    let [offsets, counts] = [offsets_tag, counts_tag].map(|tag| directory.unsigned(tag));
    let (offsets, counts) = (offsets?.unwrap_or_default(), counts?.unwrap_or_default());
    let (across, down) = if tiled {
        (directory.first(322, 0)?, directory.first(323, 0)?)
    } else {
        (width, directory.first(278, height)?.min(height))
    };
    let wrong = |tag, found: String, expected: String| {
        Err(directory.wrong(ReadErrorKind::Header, tag, found, expected, "write the file again with gdal_translate"))
    };
    if across == 0 || down == 0 {
        return wrong(if tiled { 322 } else { 278 }, "zero".into(), "a positive size".into());
    }
    let expected = width.div_ceil(across).checked_mul(height.div_ceil(down));
    if expected != Some(offsets.len() as u64) || offsets.len() != counts.len() {
        let found = format!("{} offsets and {} byte counts", offsets.len(), counts.len());
        let expected = match expected {
            Some(expected) => format!("{expected} of each for {width} × {height} samples"),
            None => "a size that can be".into(),
        };
        return wrong(offsets_tag, found, expected);
    }
    let chunks: Vec<(u64, u64)> = offsets.into_iter().zip(counts).collect();
    for (k, &(offset, count)) in chunks.iter().enumerate() {
        if offset.checked_add(count).is_none_or(|end| end > length) {
            let found = format!("{} {k} is {count} bytes from byte {offset}", if tiled { "tile" } else { "strip" });
            let expected = format!("it inside of the {length} bytes of the file");
            let mend = "copy the whole file again";
            return Err(directory.wrong(ReadErrorKind::Truncated, offsets_tag, found, expected, mend));
        }
    }
    Ok((across.saturating_mul(down).saturating_mul(sample), chunks))
}
