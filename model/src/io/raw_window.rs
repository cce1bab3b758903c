//! RAW rasters of 32-bit floats read window by window: what is larger than memory, or seen in part.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use glam::DVec2;

use super::error::{ReadError, ReadErrorKind, name_of};
use super::sidecar::{ByteOrder, SampleType, Sidecar};
use crate::grid::{Crs, Grid};

/// A RAW file and what its sidecar says. The file is opened for each window.
#[derive(Debug, Clone)]
pub struct RawWindows {
    path: PathBuf,
    size: [usize; 2],
    /// Says where the raster is and in what units; its samples mean nothing.
    place: Grid<f32>,
    little: bool,
}

impl RawWindows {
    /// Reads the sidecar and the length of `path`.
    ///
    /// # Errors
    /// [`ReadError`]: no sidecar, one that is not sound or not of 32-bit floats, or a file of another length.
    pub fn open(path: &Path) -> Result<RawWindows, ReadError> {
        let (name, sidecar) = (name_of(path), Sidecar::load(path)?);
        let wrong = |place: &str, found: &str, expected: &str, mend: &str| {
            ReadError::new(&name, ReadErrorKind::Unsupported, place, found, expected, mend)
        };
        if sidecar.sample != SampleType::F32 {
            return Err(wrong(
                "\"sample\" in the sidecar",
                "\"u16\"",
                "\"f32\"",
                "convert it: `terrain convert FILE OUT.r32`",
            ));
        }
        let Some(order) = sidecar.byte_order else {
            return Err(wrong(
                "\"byte_order\" in the sidecar",
                "nothing",
                "\"little\" or \"big\"",
                "add it to the sidecar",
            ));
        };
        let length = std::fs::metadata(path).map_err(|error| ReadError::io(&name, &error))?.len();
        sidecar.count_exactly(&name, length, 4)?;
        let size = [sidecar.width as usize, sidecar.height as usize];
        Ok(RawWindows { path: path.to_owned(), size, place: sidecar.place(&name)?, little: order == ByteOrder::Little })
    }
    /// Samples from west to east and from south to north.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }
    /// Metres between them.
    pub fn spacing(&self) -> DVec2 {
        self.place.spacing()
    }
    /// The south-west sample.
    pub fn origin(&self) -> DVec2 {
        self.place.origin()
    }
    /// Reference system.
    pub fn crs(&self) -> Option<&Crs> {
        self.place.crs()
    }
    /// Elevations of columns and rows `first` to `last`, both included, row by row from the south; NaN where there is none.
    ///
    /// # Errors
    /// [`ReadError`]: a window that is not of the raster, or the disk.
    pub fn window(&self, first: [usize; 2], last: [usize; 2]) -> Result<Vec<f32>, ReadError> {
        let name = name_of(&self.path);
        if (0..2).any(|k| first[k] > last[k] || last[k] >= self.size[k]) {
            let found = format!("columns {} to {}, rows {} to {}", first[0], last[0], first[1], last[1]);
            let expected = format!("a window of {} × {} samples", self.size[0], self.size[1]);
            return Err(ReadError::new(
                &name,
                ReadErrorKind::Value,
                "window",
                found,
                expected,
                "ask for a part of the raster",
            ));
        }
        let io = |error: std::io::Error| ReadError::io(&name, &error);
        let mut file = File::open(&self.path).map_err(io)?;
        let width = last[0] - first[0] + 1;
        let mut values = Vec::with_capacity(width * (last[1] - first[1] + 1));
        let mut row = vec![0u8; 4 * width];
        for j in first[1]..=last[1] {
            // Rows are stored from the north.
            let at = 4 * ((self.size[1] - 1 - j) as u64 * self.size[0] as u64 + first[0] as u64);
            file.seek(SeekFrom::Start(at)).map_err(io)?;
            file.read_exact(&mut row).map_err(io)?;
            let sample = |b: &[u8; 4]| if self.little { f32::from_le_bytes(*b) } else { f32::from_be_bytes(*b) };
            let known = |z: f32| if self.place.no_data() == Some(z) { f32::NAN } else { z };
            values.extend(row.as_chunks().0.iter().map(sample).map(known));
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::raw;

    #[test]
    fn a_window_is_the_same_part_of_the_whole_and_what_is_no_part_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.r32");
        let values = (0..37 * 23).map(|k| if k == 40 { -9999.0 } else { (k * k % 997) as f32 }).collect();
        let grid =
            Grid::new([5.0, -7.0].into(), [2.0, 3.0].into(), 37, 23, values).unwrap().with_no_data(Some(-9999.0));
        raw::write_f32(&path, &grid.with_crs(Some(Crs::local_metres()))).unwrap();
        let whole = raw::read(&path).unwrap();
        let windows = RawWindows::open(&path).unwrap();
        assert_eq!((windows.size(), windows.origin(), windows.spacing()), ([37, 23], whole.origin(), whole.spacing()));
        assert_eq!(windows.crs(), Some(&Crs::local_metres()));
        for (first, last) in [([0, 0], [36, 22]), ([3, 1], [9, 17]), ([36, 22], [36, 22])] {
            let found = windows.window(first, last).unwrap();
            let mut expected = Vec::new();
            for j in first[1]..=last[1] {
                expected.extend((first[0]..=last[0]).map(|i| whole.known(i, j)));
            }
            assert_eq!(found.iter().map(|z| (!z.is_nan()).then_some(*z)).collect::<Vec<_>>(), expected);
        }
        // Control: the same window a row farther is another.
        assert_ne!(windows.window([3, 1], [9, 1]).unwrap(), windows.window([3, 2], [9, 2]).unwrap());
        for (first, last) in [([0, 0], [37, 0]), ([4, 0], [3, 0])] {
            let error = windows.window(first, last).unwrap_err().to_string();
            assert!(error.contains("37 × 23") && !error.contains('\n'), "{error}");
        }
        std::fs::write(&path, [0; 12]).unwrap();
        assert_eq!(RawWindows::open(&path).unwrap_err().kind, ReadErrorKind::Truncated);
        let scaled = folder.path().join("b.r16");
        raw::write_u16(&scaled, &whole).unwrap();
        assert_eq!(RawWindows::open(&scaled).unwrap_err().kind, ReadErrorKind::Unsupported);
        assert!(RawWindows::open(&folder.path().join("none.r32")).is_err());
    }
}
