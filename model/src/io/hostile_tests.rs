//! No reader may panic, whatever the bytes: random ones, and valid files with bytes changed, cut off, or repeated.

use proptest::collection::vec;
use proptest::prelude::*;

use super::sidecar::{ByteOrder, SampleType, Sidecar, example, sidecar_path};
use super::{esri_ascii, exr, geotiff, hgt, png, raw, read_grid, write_grid};
use crate::grid::Grid;

/// A change to a valid file.
#[derive(Debug, Clone)]
enum Change {
    Byte {
        at: usize,
        value: u8,
    },
    /// A number where a header is likely to hold one.
    Word {
        at: usize,
        value: u32,
    },
    Cut {
        at: usize,
    },
    Repeat {
        from: usize,
        length: usize,
    },
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let length = bytes.len();
        match *self {
            Change::Byte { at, value } => bytes[at % length] = value,
            Change::Word { at, value } => {
                for (offset, byte) in value.to_le_bytes().into_iter().enumerate() {
                    bytes[(at + offset) % length] = byte;
                }
            }
            Change::Cut { at } => bytes.truncate(at % length),
            Change::Repeat { from, length: count } => {
                let from = from % length;
                bytes.extend_from_within(from..length.min(from + count));
            }
        }
    }
}

fn changes() -> impl Strategy<Value = Vec<Change>> {
    // Half of the changes fall in the first 200 bytes, where most headers are.
    let at = || prop_oneof![0_usize..200, any::<usize>()];
    let word = prop_oneof![Just(0), Just(1), Just(u32::MAX), Just(1 << 31), Just(1 << 16), any::<u32>()];
    let change = prop_oneof![
        4 => (at(), any::<u8>()).prop_map(|(at, value)| Change::Byte { at, value }),
        4 => (at(), word).prop_map(|(at, value)| Change::Word { at, value }),
        1 => at().prop_map(|at| Change::Cut { at }),
        1 => (at(), 0_usize..64).prop_map(|(from, length)| Change::Repeat { from, length }),
    ];
    vec(change, 1..6)
}

/// A valid file of each format, and the reader of its bytes. A result that claims success must be a sound grid.
struct Format {
    valid: Vec<u8>,
    read: fn(&[u8]) -> Option<Grid<f32>>,
}

fn sidecar(sample: SampleType) -> Sidecar {
    Sidecar::of(&example(), sample, Some(ByteOrder::Little))
}

fn formats() -> Vec<Format> {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        let path = folder.path().join(name);
        write_grid(&path, &example()).unwrap();
        std::fs::read(&path).unwrap()
    };
    let sixteen = folder.path().join("b.tif");
    let integers = example().to_i16().unwrap();
    geotiff::write_i16(&sixteen, &integers, geotiff::RasterType::Area).unwrap();
    vec![
        Format { valid: file("a.tif"), read: |b| geotiff::read_from(b, "a.tif").ok() },
        Format { valid: std::fs::read(sixteen).unwrap(), read: |b| geotiff::read_from(b, "b.tif").ok() },
        Format { valid: file("a.asc"), read: |b| esri_ascii::read_from(b, None, "a.asc").ok() },
        Format {
            valid: b"PROJCS[\"a\",UNIT[\"Meter\",1.0]]".to_vec(),
            read: |b| {
                esri_ascii::read_from(b"ncols 1 nrows 1 xllcorner 0 yllcorner 0 cellsize 1 7", Some(b), "a.asc").ok()
            },
        },
        Format { valid: file("a.raw"), read: |b| raw::read_from(b, &sidecar(SampleType::F32), "a.raw").ok() },
        Format { valid: file("a.r16"), read: |b| raw::read_from(b, &sidecar(SampleType::U16), "a.r16").ok() },
        Format { valid: file("a.png"), read: |b| png::read_from(b, &sidecar(SampleType::U16), "a.png").ok() },
        Format { valid: file("a.exr"), read: |b| exr::read_from(b, &sidecar(SampleType::F32), "a.exr").ok() },
        Format {
            valid: std::fs::read(sidecar_path(&folder.path().join("a.raw"))).unwrap(),
            read: |b| {
                let sidecar = Sidecar::parse(b, "a.raw.json").ok()?;
                raw::read_from(&[7; 24], &sidecar, "a.raw").ok()
            },
        },
        Format { valid: vec![1; 2 * 1201 * 1201], read: |b| hgt::read_from(b, "N36W085", "a.hgt").ok() },
    ]
}

fn assert_sound(grid: &Grid<f32>) {
    assert!(grid.min_max().is_some());
    assert!(grid.values().iter().all(|&v| v.is_finite() || grid.is_no_data(v)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    #[test]
    fn changed_files_are_read_soundly_or_refused(k in 0_usize..9, changes in changes()) {
        thread_local!(static FORMATS: Vec<Format> = formats());
        FORMATS.with(|formats| {
            let mut bytes = formats[k].valid.clone();
            for change in &changes {
                change.apply(&mut bytes);
            }
            if let Some(grid) = (formats[k].read)(&bytes) {
                assert_sound(&grid);
            }
        });
    }

    #[test]
    fn random_bytes_are_read_soundly_or_refused(
        k in 0_usize..10,
        signature in 0_usize..6,
        tail in vec(any::<u8>(), 0..300),
    ) {
        thread_local!(static FORMATS: Vec<Format> = formats());
        let signatures: [&[u8]; 6] =
            [b"", b"II*\0\x08\0\0\0", b"MM\0+\0\x08\0\0", b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01\x02\0\0\0", b"ncols 3 "];
        let bytes = [signatures[signature], &tail].concat();
        FORMATS.with(|formats| {
            if let Some(grid) = (formats[k].read)(&bytes) {
                assert_sound(&grid);
            }
        });
    }

    #[test]
    fn any_file_name_is_read_or_refused(name in "[\\PC&&[^/]]{0,12}", extension in "(tif|asc|hgt|png|raw|r16|exr|)") {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("{name}.{extension}"));
        if std::fs::write(&path, b"7").is_ok() {
            prop_assert!(!read_grid(&path).unwrap_err().to_string().contains('\n'));
        }
    }
}

#[test]
fn unchanged_files_are_read() {
    // The control of the tests above: their readers do accept what is valid.
    for (k, format) in formats().iter().enumerate() {
        assert_sound(&(format.read)(&format.valid).unwrap_or_else(|| panic!("format {k} refused its own file")));
    }
}
