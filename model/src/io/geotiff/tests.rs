//! Files built byte by byte, so that the reader is not tested against our own writer, and tags of our own files read by
//! the `tiff` crate.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use glam::DVec2;
use tiff::decoder::Decoder;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, colortype as colour};
use tiff::tags::Tag;

use super::super::error::{ReadError, ReadErrorKind};
use super::super::sidecar::example;
use super::{RasterType, read, read_from, write_f32, write_i16};
use crate::grid::{Crs, CrsKind, Grid};

/// A little-endian TIFF under construction: (tag, type, values as bytes).
#[derive(Clone)]
struct Tiff {
    tags: Vec<(u16, u16, Vec<u8>)>,
    data: Vec<Vec<u8>>,
}

const SHORT: u16 = 3;
const LONG: u16 = 4;
const DOUBLE: u16 = 12;

impl Tiff {
    /// Elevations 1 … 6 on 3 × 2 samples of 10 × 20 m with the tie point at (100, 1000).
    fn new() -> Tiff {
        let rows: Vec<u8> = [1_i16, 2, 3, 4, 5, 6].iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut tiff = Tiff { tags: vec![], data: vec![rows] };
        for (tag, value) in [(256, 3), (257, 2), (258, 16), (259, 1), (262, 1), (277, 1), (278, 2), (339, 2)] {
            tiff.shorts(tag, &[value]);
        }
        tiff.doubles(33550, &[10.0, 20.0, 0.0]).doubles(33922, &[0.0, 0.0, 0.0, 100.0, 1000.0, 0.0]);
        tiff
    }

    fn set(&mut self, tag: u16, kind: u16, bytes: Vec<u8>) -> &mut Tiff {
        self.tags.retain(|entry| entry.0 != tag);
        self.tags.push((tag, kind, bytes));
        self
    }

    fn without(&mut self, tag: u16) -> &mut Tiff {
        self.tags.retain(|entry| entry.0 != tag);
        self
    }

    fn shorts(&mut self, tag: u16, values: &[u16]) -> &mut Tiff {
        self.set(tag, SHORT, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    fn longs(&mut self, tag: u16, values: &[u32]) -> &mut Tiff {
        self.set(tag, LONG, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    fn doubles(&mut self, tag: u16, values: &[f64]) -> &mut Tiff {
        self.set(tag, DOUBLE, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    fn bytes(&self) -> Vec<u8> {
        let mut file = b"II*\0\0\0\0\0".to_vec();
        let mut offsets = Vec::new();
        for chunk in &self.data {
            offsets.push(if chunk.is_empty() { 0 } else { file.len() as u32 });
            file.extend(chunk);
        }
        let counts: Vec<u32> = self.data.iter().map(|chunk| chunk.len() as u32).collect();
        let tiled = self.tags.iter().any(|entry| entry.0 == 322);
        let mut whole = self.clone();
        for (tag, values) in [(if tiled { 324 } else { 273 }, offsets), (if tiled { 325 } else { 279 }, counts)] {
            if !self.tags.iter().any(|entry| entry.0 == tag) {
                whole.longs(tag, &values);
            }
        }
        whole.tags.sort_by_key(|entry| entry.0);
        let mut directory = (whole.tags.len() as u16).to_le_bytes().to_vec();
        for (tag, kind, bytes) in &whole.tags {
            let size = [0, 1, 1, 2, 4, 8, 0, 0, 0, 0, 0, 0, 8][usize::from(*kind)];
            directory.extend(tag.to_le_bytes());
            directory.extend(kind.to_le_bytes());
            directory.extend((bytes.len() as u32 / size).to_le_bytes());
            if bytes.len() <= 4 {
                directory.extend([&bytes[..], &[0; 4]].concat()[..4].iter());
            } else {
                directory.extend((file.len() as u32).to_le_bytes());
                file.extend(bytes);
            }
        }
        directory.extend([0; 4]);
        let start = file.len() as u32;
        file[4..8].copy_from_slice(&start.to_le_bytes());
        file.extend(directory);
        file
    }

    fn read(&self) -> Result<Grid<f32>, ReadError> {
        read_from(&self.bytes(), "a.tif")
    }
}

#[test]
fn area_puts_samples_half_a_spacing_inside_and_point_on_the_tie() {
    let keys = |raster_type| [1, 1, 0, 1, 1025, 0, 1, raster_type];
    let area = Tiff::new().shorts(34735, &keys(1)).read().unwrap();
    // West 100 + 5; the southern of two rows of 20 m below 1000 has its sample at 1000 − 20 − 10.
    assert_eq!((area.origin(), area.spacing()), (DVec2::new(105.0, 970.0), DVec2::new(10.0, 20.0)));
    assert_eq!(area.values(), [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    assert_eq!(Tiff::new().read().unwrap().origin(), area.origin(), "area is the default");
    let point = Tiff::new().shorts(34735, &keys(2)).read().unwrap();
    assert_eq!(point.origin(), DVec2::new(100.0, 980.0));
    assert_eq!(point.crs(), None);
}

#[test]
fn tie_point_may_be_any_raster_point_and_a_matrix_says_the_same() {
    let tied = Tiff::new().doubles(33922, &[1.0, 2.0, 0.0, 110.0, 960.0, 0.0]).read().unwrap();
    assert_eq!(tied.origin(), DVec2::new(105.0, 970.0));
    let matrix = |m: [f64; 8]| Tiff::new().without(33550).without(33922).doubles(34264, &[m, [0.0; 8]].concat()).read();
    let straight = matrix([10.0, 0.0, 0.0, 100.0, 0.0, -20.0, 0.0, 1000.0]).unwrap();
    assert_eq!((straight.origin(), straight.spacing()), (tied.origin(), tied.spacing()));
    let turned = matrix([10.0, 1.0, 0.0, 100.0, 1.0, -20.0, 0.0, 1000.0]).unwrap_err();
    assert_eq!(turned.kind, ReadErrorKind::Unsupported);
    assert!(turned.to_string().contains("gdalwarp"), "{turned}");
}

#[test]
fn tiles_are_cut_at_the_edge_and_left_out_ones_are_no_data() {
    // 20 × 18 samples in tiles of 16 × 16: value 100·row + column; the north-east tile is left out.
    let mut tiff = Tiff::new();
    let tile = |row0: i16, column0: i16| -> Vec<u8> {
        let cells = (0..16).flat_map(|r| (0..16).map(move |c| 100 * (row0 + r) + column0 + c));
        cells.flat_map(|v: i16| v.to_le_bytes()).collect()
    };
    tiff.data = vec![tile(0, 0), vec![], tile(16, 0), tile(16, 16)];
    tiff.shorts(256, &[20]).shorts(257, &[18]).shorts(322, &[16]).shorts(323, &[16]).without(278);
    let grid = tiff.set(42113, 2, b"-1\0".to_vec()).read().unwrap();
    for (i, j, _, value) in grid.positions() {
        let (row, column) = (17 - j, i);
        let expected = if row < 16 && column >= 16 { -1.0 } else { (100 * row + column) as f32 };
        assert_eq!(value, expected, "row {row}, column {column}");
    }
    assert_eq!(grid.no_data_count(), 64);
}

#[test]
fn every_sample_type_and_compression_is_read() {
    fn image<C: colour::ColorType>(values: [C::Inner; 6], compression: Compression, big: bool) -> Vec<f32>
    where
        [C::Inner]: tiff::encoder::TiffValue,
    {
        fn fill<C: colour::ColorType, K: tiff::encoder::TiffKind>(
            mut encoder: TiffEncoder<&mut Cursor<Vec<u8>>, K>,
            values: &[C::Inner],
        ) where
            [C::Inner]: tiff::encoder::TiffValue,
        {
            let mut image = encoder.new_image::<C>(3, 2).unwrap();
            image.encoder().write_tag(Tag::ModelPixelScaleTag, &[1.0, 1.0, 0.0][..]).unwrap();
            image.encoder().write_tag(Tag::ModelTiepointTag, &[0.0; 6][..]).unwrap();
            image.rows_per_strip(1).unwrap();
            image.write_data(values).unwrap();
        }
        let mut file = Cursor::new(Vec::new());
        if big {
            fill::<C, _>(TiffEncoder::new_big(&mut file).unwrap().with_compression(compression), &values);
        } else {
            fill::<C, _>(TiffEncoder::new(&mut file).unwrap().with_compression(compression), &values);
        }
        read_from(file.get_ref(), "a.tif").unwrap().into_values()
    }
    let expected = [4.0, 5.0, 6.0, 1.0, 2.0, 3.0];
    let deflate = Compression::Deflate(DeflateLevel::Fast);
    for compression in [Compression::Uncompressed, Compression::Lzw, deflate, Compression::Packbits] {
        for big in [false, true] {
            assert_eq!(image::<colour::Gray8>([1, 2, 3, 4, 5, 6], compression, big), expected);
            assert_eq!(image::<colour::Gray16>([1, 2, 3, 4, 5, 6], compression, big), expected);
            assert_eq!(image::<colour::GrayI16>([1, 2, 3, 4, 5, 6], compression, big), expected);
            assert_eq!(image::<colour::GrayI32>([1, 2, 3, 4, 5, 6], compression, big), expected);
            assert_eq!(image::<colour::Gray32Float>([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], compression, big), expected);
            assert_eq!(image::<colour::Gray64Float>([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], compression, big), expected);
        }
    }
}

#[test]
fn no_data_without_an_f32_and_no_data_rounded_in_its_tag_are_found() {
    let mut tiff = Tiff::new();
    tiff.data = vec![[f64::MIN, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()).collect()];
    tiff.shorts(258, &[64]).shorts(339, &[3]).set(42113, 2, b"-1.7976931348623157e+308\0".to_vec());
    let grid = tiff.read().unwrap();
    assert_eq!((grid.no_data(), grid.no_data_count()), (Some(f32::MIN), 1));

    tiff.data = vec![[f32::MIN, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()).collect()];
    tiff.shorts(258, &[32]).set(42113, 2, b"-3.4028235e+38\0".to_vec());
    assert_eq!(tiff.read().unwrap().no_data_count(), 1);
    tiff.data = vec![[f32::NAN, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()).collect()];
    assert_eq!(tiff.read().unwrap_err().place.as_ref(), "column 1, row 1 from the north");
    assert_eq!(tiff.set(42113, 2, b"nan\0".to_vec()).read().unwrap().no_data_count(), 1);
}

#[test]
fn every_broken_file_is_one_line_with_its_place() {
    use ReadErrorKind::{Header, Truncated, Unsupported, Value};
    let text = |s: &str| s.as_bytes().to_vec();
    type Edit<'a> = Box<dyn Fn(&mut Tiff) + 'a>;
    let cases: Vec<(Edit, ReadErrorKind, &str)> = vec![
        (Box::new(|t| _ = t.longs(256, &[1 << 31]).longs(257, &[1 << 31])), Header, "tag 273"),
        (
            Box::new(|t| _ = t.longs(256, &[1 << 31]).longs(257, &[1 << 31]).longs(278, &[1 << 31])),
            Truncated,
            "tags 256",
        ),
        (Box::new(|t| _ = t.longs(256, &[30])), Truncated, "tags 256, 257"),
        (Box::new(|t| _ = t.longs(256, &[0])), Header, "tag 278"),
        (Box::new(|t| _ = t.longs(257, &[1 << 31])), Header, "tag 273"),
        (Box::new(|t| _ = t.longs(273, &[4_000_000_000])), Truncated, "tag 273"),
        (Box::new(|t| _ = t.longs(279, &[4_000_000_000])), Truncated, "tag 273"),
        (Box::new(|t| _ = t.longs(279, &[8])), Truncated, "tags 256, 257"),
        (Box::new(|t| _ = t.shorts(278, &[0])), Header, "tag 278"),
        (Box::new(|t| _ = t.shorts(259, &[7])), Unsupported, "tag 259"),
        (Box::new(|t| _ = t.shorts(277, &[3])), Unsupported, "tag 277"),
        (Box::new(|t| _ = t.shorts(262, &[0])), Unsupported, "tag 262"),
        (Box::new(|t| _ = t.shorts(258, &[12])), Unsupported, "tag 339"),
        (Box::new(|t| _ = t.shorts(317, &[3])), Unsupported, "tag 317"),
        (Box::new(|t| _ = t.without(33550)), Header, "tag 33550"),
        (Box::new(|t| _ = t.without(33922)), Header, "tag 33922"),
        (Box::new(|t| _ = t.doubles(33550, &[10.0])), Header, "tag 33922"),
        (Box::new(|t| _ = t.shorts(33550, &[10, 20, 0])), Header, "tag 33550"),
        (Box::new(|t| _ = t.doubles(33550, &[0.0, 20.0, 0.0])), Header, "tag 33550"),
        (Box::new(|t| _ = t.doubles(33550, &[10.0, -20.0, 0.0])), Header, "tag 33550"),
        (Box::new(|t| _ = t.doubles(33550, &[10.0, f64::NAN, 0.0])), Header, "tag 33550"),
        (Box::new(|t| _ = t.doubles(33922, &[0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0])), Header, "tags 33550"),
        (Box::new(|t| _ = t.doubles(34264, &[1.0; 3])), Header, "tag 34264"),
        (Box::new(|t| _ = t.set(42113, 2, text("none\0"))), Header, "tag 42113"),
        (Box::new(|t| _ = t.set(42112, 2, text("<Item role=\"scale\">0.1</Item>\0"))), Unsupported, "tag 42112"),
        (Box::new(|t| _ = t.shorts(34735, &[1, 1, 0, 1, 1024, 0, 1, 3])), Unsupported, "tag 34735"),
        (Box::new(|t| t.data = vec![vec![9; 12]]), Value, ""),
    ];
    for (k, (edit, kind, place)) in cases.iter().enumerate() {
        let mut tiff = Tiff::new();
        edit(&mut tiff);
        if *kind == Value {
            // 0x0909 everywhere, declared as no-data.
            tiff.set(42113, 2, text("2313\0"));
        }
        let error = tiff.read().unwrap_err();
        assert_eq!(error.kind, *kind, "case {k}: {error}");
        assert!(error.place.starts_with(place), "case {k}: {error}");
        let line = error.to_string();
        assert!(line.starts_with("a.tif: ") && line.contains("; expected ") && !line.contains('\n'), "{line}");
    }
}

#[test]
fn truncation_anywhere_and_foreign_files_are_errors() {
    let bytes = Tiff::new().bytes();
    for length in 0..bytes.len() - 4 {
        let error = read_from(&bytes[..length], "a.tif").unwrap_err();
        let kinds = [ReadErrorKind::Magic, ReadErrorKind::Truncated];
        assert!(kinds.contains(&error.kind), "{length}: {error}");
    }
    assert_eq!(read_from(b"\x89PNG\r\n\x1a\n", "a.tif").unwrap_err().kind, ReadErrorKind::Magic);
}

fn pixels(path: &Path) -> Decoder<Cursor<Vec<u8>>> {
    Decoder::new(Cursor::new(fs::read(path).unwrap())).unwrap()
}

#[test]
fn tags_that_we_write_are_those_of_the_standard() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    for (raster_type, code, west, north) in
        [(RasterType::Point, 2, -3.5, 1_000_020.0), (RasterType::Area, 1, -18.5, 1_000_030.0)]
    {
        write_f32(&path, &example(), raster_type).unwrap();
        let mut file = pixels(&path);
        assert_eq!(file.get_tag_f64_vec(Tag::Unknown(33550)).unwrap(), [30.0, 20.0, 0.0]);
        assert_eq!(file.get_tag_f64_vec(Tag::Unknown(33922)).unwrap(), [0.0, 0.0, 0.0, west, north, 0.0]);
        let keys = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, code, 3072, 0, 1, 32611, 3076, 0, 1, 9001];
        assert_eq!(file.get_tag_u16_vec(Tag::Unknown(34735)).unwrap(), keys);
        assert_eq!(file.get_tag_ascii_string(Tag::Unknown(42113)).unwrap(), "-9999");
        assert_eq!(file.get_tag_u32(Tag::Compression).unwrap(), 8);
        // ASCII of the tag itself, with its closing NUL.
        assert!(fs::read(&path).unwrap().windows(6).any(|w| w == b"-9999\0"));
        assert_eq!(read(&path).unwrap().origin(), example().origin());
    }
}

#[test]
fn written_grid_is_read_back_with_its_system() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let feet = Crs::new(CrsKind::Projected { epsg: None, metres_per_unit: 0.5 });
    let systems =
        [Crs::projected(Some(32611)), Crs::geographic(Some(4326)), Crs::geographic(None), Crs::local_metres(), feet];
    for system in systems {
        for grid in [example(), example().map(Some(f32::NAN), |v| v.unwrap_or(f32::NAN)), example().map(None, |_| 1.5)]
        {
            let grid = grid.with_crs(Some(system.clone()));
            write_f32(&path, &grid, RasterType::Point).unwrap();
            let back = read(&path).unwrap();
            assert_eq!(back.crs().unwrap().kind, system.kind);
            // The bits, since NaN is not equal to itself.
            let bits = |grid: &Grid<f32>| grid.values().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&back), bits(&grid));
            assert_eq!(back.no_data().map(f32::to_bits), grid.no_data().map(f32::to_bits));
            assert_eq!((back.origin(), back.spacing()), (grid.origin(), grid.spacing()));
        }
    }
    write_f32(&path, &example().with_crs(None), RasterType::Point).unwrap();
    assert_eq!(read(&path).unwrap().crs(), None);
}

#[test]
fn keys_that_we_do_not_understand_survive_reading_and_writing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let mut tiff = Tiff::new();
    let ascii = "UTM 11 | by hand|";
    let directory = [1, 1, 1, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 2057, 34736, 1, 1, 3073, 34737, 17, 0];
    tiff.shorts(34735, &directory).doubles(34736, &[0.25, 6378137.0]).set(34737, 2, format!("{ascii}\0").into_bytes());
    write_f32(&path, &tiff.read().unwrap(), RasterType::Point).unwrap();
    let mut file = pixels(&path);
    let mut expected = directory.to_vec();
    expected[11] = 2;
    assert_eq!(file.get_tag_u16_vec(Tag::Unknown(34735)).unwrap(), expected);
    assert_eq!(file.get_tag_f64_vec(Tag::Unknown(34736)).unwrap(), [0.25, 6378137.0]);
    assert_eq!(file.get_tag_ascii_string(Tag::Unknown(34737)).unwrap(), ascii);
}

#[test]
fn sixteen_bit_file_is_small_and_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let values = (0..300 * 200).map(|k| (k % 300 + 2 * (k / 300)) as i16).collect();
    let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 300, 200, values).unwrap().with_no_data(Some(i16::MIN));
    write_i16(&path, &grid, RasterType::Point).unwrap();
    assert_eq!(read(&path).unwrap().values(), grid.to_f32().values());
    assert!(fs::metadata(&path).unwrap().len() < 5000, "a plane is all but nothing once it is differenced");
}

#[test]
fn shipped_elevations_are_whole_metric_and_without_voids() {
    let bytes = include_bytes!("../../../../experiments/data/jacksboro/jacksboro.tif");
    let grid = read_from(bytes, "jacksboro.tif").unwrap();
    assert_eq!((grid.width(), grid.height(), grid.min_max()), (403, 344, Some((236.0, 1076.0))));
    assert_eq!(grid.crs().map(|crs| crs.kind), Some(CrsKind::LocalMetres));
    assert_eq!((grid.no_data_count(), grid.origin()), (0, DVec2::ZERO));
    // The first value of the source, at the north-west, and the spacing that its README states.
    assert_eq!(grid.get(0, 343), Some(483.0));
    assert!((grid.spacing() - DVec2::new(74.5732, 92.4750)).abs().max_element() < 5e-5);
    assert!(bytes.len() < 200_000);
}
