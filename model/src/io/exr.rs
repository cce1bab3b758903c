//! OpenEXR: named layers of 32-bit floats, without loss (ZIP), and elevations with a JSON sidecar for their place.
//!
//! In memory row 0 is in the south, as in a [`Grid`]; the first line of an EXR file is its top, the north.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, Error, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, MetaData, ReadChannels, ReadLayers, SampleType, Text, Vec2, WritableImage,
};

use super::atomic::atomic_write;
use super::check::{flip_rows, load, sample_count, writable};
use super::error::{Failure, ReadError, ReadErrorKind, WriteError, name_file};
use super::sidecar::{SampleType as Stored, Sidecar};
use crate::grid::Grid;

/// The layer that holds the elevations of a grid.
pub const ELEVATION: &str = "elevation";

/// The layers of a file: each `width * height` values, row-major from the south.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Samples from west to east.
    pub width: usize,
    /// Samples from south to north.
    pub height: usize,
    /// Name and values, in alphabetical order.
    pub layers: Vec<(String, Vec<f32>)>,
}

/// Writes named layers, each `width * height` floats row-major from the south, as channels of one image.
///
/// # Errors
/// [`WriteError`]: no layer, a name that is empty, doubled, or longer than 255 bytes or not ASCII, a layer of another
/// size, the file system. Values are written as they are, NaN included.
pub fn write_layers(path: &Path, width: usize, height: usize, layers: &[(&str, &[f32])]) -> Result<(), WriteError> {
    let cannot = |problem: String, mend: &str| Err(WriteError::cannot(path, problem, mend));
    if layers.is_empty() || width == 0 || height == 0 || width.max(height) > i32::MAX as usize {
        let problem = format!("{} layers of {width} × {height} samples are no EXR image", layers.len());
        return cannot(problem, "write at least one layer with at least one sample");
    }
    let mut channels = Vec::new();
    for (k, &(name, values)) in layers.iter().enumerate() {
        let plain = !name.is_empty() && name.len() <= 255 && name.bytes().all(|b| b.is_ascii_graphic());
        let Some(text) = Text::new_or_none(name).filter(|_| plain) else {
            return cannot(format!("{name:?} cannot name a layer"), "use 1 to 255 printable ASCII characters");
        };
        if layers[..k].iter().any(|(other, _)| *other == name) {
            return cannot(format!("two layers are named {name:?}"), "give each its own name");
        }
        if width.checked_mul(height) != Some(values.len()) {
            let problem = format!("layer {name:?} has {} values, the image {width} × {height}", values.len());
            return cannot(problem, "make them equal");
        }
        channels.push(AnyChannel::new(text, FlatSamples::F32(flip_rows(values, width))));
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let layer = Layer::new(Vec2(width, height), LayerAttributes::default(), encoding, channels);
    let image = Image::from_layer(layer);
    atomic_write(path, |file| {
        image.write().to_buffered(file).map_err(|error| match error {
            Error::Io(error) => Failure::Io(error),
            other => Failure::other(other),
        })
    })
    .map_err(name_file(path))
}

/// Reads the layers of an EXR file: all channels of its single image, in 32-bit floats, uncompressed, RLE or ZIP.
///
/// # Errors
/// [`ReadError`]: not an EXR file, a truncated one, or one that holds several images, deep data, sub-sampled channels,
/// other sample types or other compressions.
pub fn read_layers(path: &Path) -> Result<Layers, ReadError> {
    let (name, bytes) = load(path)?;
    read_layers_from(&bytes, &name)
}

pub(super) fn read_layers_from(bytes: &[u8], name: &str) -> Result<Layers, ReadError> {
    let broken = |error: Error| {
        let kind =
            if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) { ReadErrorKind::Truncated } else { ReadErrorKind::Magic };
        let mend = "check that the file is an OpenEXR image, and copy the whole file again";
        ReadError::new(name, kind, "header or blocks", error, "an OpenEXR image that can be decoded", mend)
    };
    let unsupported = |found: String, expected: &str| {
        let mend = "convert it with oiiotool IN -d float --compression zip -o OUT";
        Err(ReadError::new(name, ReadErrorKind::Unsupported, "header", found, expected, mend))
    };
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    let [header] = meta.headers.as_slice() else {
        return unsupported(format!("{} images", meta.headers.len()), "one");
    };
    if header.deep || !matches!(header.blocks, exr::meta::BlockDescription::ScanLines) {
        return unsupported("deep data or tiles".into(), "flat scan lines");
    }
    // The most bytes that one stored byte can decode to: 1032 for Deflate, 64 for the run lengths of RLE.
    let expansion = match header.compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 => 1032,
        other => return unsupported(format!("compression {other}"), "none, RLE or ZIP"),
    };
    let channels = &header.channels.list;
    for channel in channels {
        if channel.sample_type != SampleType::F32 || channel.sampling != Vec2(1, 1) {
            let found = format!("layer {}: {:?}, sampling {:?}", channel.name, channel.sample_type, channel.sampling);
            return unsupported(found, "32-bit floats at every sample");
        }
    }
    let size = header.layer_size;
    let room = (bytes.len() as u64).saturating_mul(expansion) / 4 / (channels.len() as u64).max(1);
    sample_count(name, "data window", (size.x() as u64, size.y() as u64), room, bytes.len() as u64)?;

    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let size = image.layer_data.size;
    let layers = image.layer_data.channel_data.list.into_iter();
    let layers = layers.map(|channel| {
        let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
        (channel.name.to_string(), flip_rows(&values, size.x()))
    });
    Ok(Layers { width: size.x(), height: size.y(), layers: layers.collect() })
}

/// Reads the elevations of `path`, its layer [`ELEVATION`] or its only layer, placed by the sidecar `path.json`.
///
/// # Errors
/// As [`read_layers`]; no such layer, and what can be wrong with a sidecar and with values.
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    read_from(&bytes, &Sidecar::load(path)?, &name)
}

pub(super) fn read_from(bytes: &[u8], sidecar: &Sidecar, name: &str) -> Result<Grid<f32>, ReadError> {
    let Layers { width, height, layers } = read_layers_from(bytes, name)?;
    if (width as u64, height as u64) != (sidecar.width, sidecar.height) || sidecar.sample != Stored::F32 {
        let found = format!("{width} × {height} floats");
        let expected = format!("{} × {} samples of type {:?}", sidecar.width, sidecar.height, sidecar.sample);
        let mend = "correct the sidecar, or take the one written with the image";
        return Err(ReadError::new(name, ReadErrorKind::Header, "size in the sidecar", found, expected, mend));
    }
    let only = layers.len() == 1;
    let Some((_, values)) = layers.iter().find(|(layer, _)| only || layer == ELEVATION) else {
        let names: Vec<&str> = layers.iter().map(|(layer, _)| layer.as_str()).collect();
        let mend = "rename the layer, or read it with read_layers";
        let found = format!("layers {}", names.join(", "));
        return Err(ReadError::new(name, ReadErrorKind::Header, "layers", found, "one named elevation", mend));
    };
    sidecar.grid_of_f32(name, &flip_rows(values, width))
}

/// Writes the elevations as the layer [`ELEVATION`], and the sidecar: nothing is lost.
///
/// # Errors
/// [`WriteError`]: a value that is neither finite nor no-data, nothing known, the file system.
pub fn write(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    Sidecar::of(grid, Stored::F32, None)
        .write_with(path, || write_layers(path, grid.width(), grid.height(), &[(ELEVATION, grid.values())]))
}

#[cfg(test)]
mod tests {
    use super::super::sidecar::example;
    use super::*;
    use std::fs;

    #[test]
    fn layers_come_back_by_name_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let elevation = [1.5, -0.0, f32::MAX, 4.0, 5.0, 1e-40];
        let weight = [0.0, 0.25, 0.5, 0.75, 1.0, 1.0 / 3.0];
        write_layers(&path, 3, 2, &[("weight", &weight), ("elevation", &elevation)]).unwrap();
        let back = read_layers(&path).unwrap();
        assert_eq!((back.width, back.height), (3, 2));
        assert_eq!(back.layers, [("elevation".into(), elevation.to_vec()), ("weight".into(), weight.to_vec())]);
    }

    #[test]
    fn elevations_keep_their_place_through_the_sidecar() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, &example()).unwrap();
        assert_eq!(read(&path).unwrap(), example());
    }

    #[test]
    fn layers_that_no_reader_could_name_are_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let one: &[f32] = &[1.0];
        let bad: [&[(&str, &[f32])]; 5] =
            [&[], &[("", one)], &[("a", one), ("a", one)], &[("a", &[])], &[("a b\n", one)]];
        for layers in bad {
            assert!(write_layers(&path, 1, 1, layers).is_err(), "{layers:?}");
        }
        assert!(!path.exists());
    }

    #[test]
    fn truncated_foreign_and_oversized_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, &example()).unwrap();
        let bytes = fs::read(&path).unwrap();
        for length in [0, 3, 20, 150, bytes.len() - 1] {
            assert!(read_layers_from(&bytes[..length], "a.exr").is_err(), "{length}");
        }
        assert_eq!(read_layers_from(b"P5 2 2 255 aaaa", "a.exr").unwrap_err().kind, ReadErrorKind::Magic);
        // The data window's last corner, (2, 1), becomes (2³¹ − 2, 2³¹ − 2).
        let at = bytes.windows(10).position(|w| w == b"dataWindow").unwrap() + 11 + 6 + 4 + 8;
        let mut huge = bytes.clone();
        huge[at..at + 4].copy_from_slice(&(i32::MAX - 1).to_le_bytes());
        huge[at + 4..at + 8].copy_from_slice(&(i32::MAX - 1).to_le_bytes());
        let error = read_layers_from(&huge, "a.exr").unwrap_err();
        assert_eq!(error.kind, ReadErrorKind::Truncated, "{error}");
    }
}
