//! The JSON file that says what RAW, PNG and EXR cannot: size, place, scale, no-data and reference system.
//!
//! The sidecar of `dem.raw` is `dem.raw.json`:
//! ```json
//! { "format": "terrain-raster/1", "width": 2, "height": 2, "origin": [0.0, 0.0], "spacing": [30.0, 30.0],
//!   "sample": "u16", "byte_order": "little", "min": 236.0, "max": 1076.0, "no_data": -9999.0,
//!   "crs": { "kind": "local_metres" } }
//! ```
//! `origin` is the south-west sample, `spacing` (dx, dy), rows are stored from north to south as images are. A `f32`
//! sample is the elevation in metres. A `u16` sample s is min + (max − min)·(s − a)/(65535 − a), with a = 1 and s = 0
//! for no-data where `no_data` is given (the value that marks it in memory: a number, or "nan"), and a = 0 otherwise.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::atomic::{atomic_write_bytes, remove_if_present};
use super::check::{flip_rows, sample_count, sound};
use super::error::{ReadError, ReadErrorKind, WriteError, name_of};
use crate::grid::{Crs, Grid};

const FORMAT: &str = "terrain-raster/1";

/// How a sample is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleType {
    /// The elevation itself.
    F32,
    /// A step of (max − min)/65535, or /65534 where there is no-data.
    U16,
}

/// The order of the bytes of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ByteOrder {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Marker {
    Number(f32),
    Text(NotANumber),
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum NotANumber {
    Nan,
}

/// The contents of a sidecar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sidecar {
    format: String,
    pub width: u64,
    pub height: u64,
    origin: [f64; 2],
    spacing: [f64; 2],
    pub sample: SampleType,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub byte_order: Option<ByteOrder>,
    min: f64,
    max: f64,
    #[serde(default)]
    no_data: Option<Marker>,
    #[serde(default)]
    crs: Option<Crs>,
}

/// `dem.raw` → `dem.raw.json`.
pub fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

impl Sidecar {
    /// What a grid needs said beside its samples. `grid` has a known value.
    pub fn of(grid: &Grid<f32>, sample: SampleType, byte_order: Option<ByteOrder>) -> Sidecar {
        let (min, max) = grid.min_max().unwrap_or((0.0, 0.0));
        Sidecar {
            format: FORMAT.into(),
            width: grid.width() as u64,
            height: grid.height() as u64,
            origin: grid.origin().to_array(),
            spacing: grid.spacing().to_array(),
            sample,
            byte_order,
            min: f64::from(min),
            max: f64::from(max),
            no_data: grid.no_data().map(|v| if v.is_nan() { Marker::Text(NotANumber::Nan) } else { Marker::Number(v) }),
            crs: grid.crs().cloned(),
        }
    }

    /// Reads the sidecar of `path`.
    pub fn load(path: &Path) -> Result<Sidecar, ReadError> {
        let path = sidecar_path(path);
        let name = name_of(&path);
        let bytes = fs::read(&path).map_err(|error| {
            let mend = "write it beside the data (its fields are in the documentation of terrain_model::io::sidecar), \
                        or convert from a format that carries its own size";
            ReadError::new(&name, ReadErrorKind::Io, "the JSON sidecar", error, "a readable file", mend)
        })?;
        Sidecar::parse(&bytes, &name)
    }

    /// Reads a sidecar from its text.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Sidecar, ReadError> {
        let sidecar: Sidecar = serde_json::from_slice(bytes).map_err(|error| {
            let place = format!("line {}, column {}", error.line(), error.column());
            let mend = "correct the JSON; its fields are in the documentation of terrain_model::io::sidecar";
            ReadError::new(name, ReadErrorKind::Header, place, error, "a terrain-raster/1 sidecar", mend)
        })?;
        if sidecar.format != FORMAT {
            let found = format!("{:?}", sidecar.format);
            let mend = "convert the file with the program that wrote it";
            return Err(ReadError::new(name, ReadErrorKind::Magic, "\"format\"", found, FORMAT, mend));
        }
        if !(sidecar.min.is_finite() && sidecar.max.is_finite() && sidecar.min <= sidecar.max) {
            let found = format!("min {}, max {}", sidecar.min, sidecar.max);
            let mend = "write the lowest and highest elevation";
            return Err(ReadError::new(name, ReadErrorKind::Header, "\"min\", \"max\"", found, "min ≤ max", mend));
        }
        Ok(sidecar)
    }

    /// The number of samples, which must fill `bytes` of the data file exactly at `size` bytes each.
    pub fn count_exactly(&self, file: &str, bytes: u64, size: u64) -> Result<usize, ReadError> {
        let count = sample_count(file, "size in the sidecar", (self.width, self.height), bytes / size, bytes)?;
        if count as u64 * size != bytes {
            let found = format!("{bytes} bytes");
            let expected = format!("{} × {} samples of {size} bytes: {}", self.width, self.height, count as u64 * size);
            let mend = "correct width, height or sample in the sidecar, or copy the whole file again";
            return Err(ReadError::new(file, ReadErrorKind::Truncated, "length of the file", found, expected, mend));
        }
        Ok(count)
    }

    /// The grid of `f32` samples given from north to south.
    pub fn grid_of_f32(&self, file: &str, samples: &[f32]) -> Result<Grid<f32>, ReadError> {
        let (width, height) = (self.width as usize, self.height as usize);
        let grid = Grid::new(self.origin.into(), self.spacing.into(), width, height, flip_rows(samples, width))
            .map_err(|error| ReadError::grid(file, "origin and spacing in the sidecar", &error))?;
        sound(file, grid.with_no_data(self.marker()).with_crs(self.crs.clone()))
    }

    /// The grid of scaled 16-bit samples given from north to south.
    pub fn grid_of_u16(&self, file: &str, samples: &[u16]) -> Result<Grid<f32>, ReadError> {
        let marker = self.marker();
        let first = if marker.is_some() { 1.0 } else { 0.0 };
        let step = (self.max - self.min) / (65535.0 - first);
        let value = |&s: &u16| match marker {
            Some(marker) if s == 0 => marker,
            _ => (self.min + step * (f64::from(s) - first)) as f32,
        };
        let values: Vec<f32> = samples.iter().map(value).collect();
        self.grid_of_f32(file, &values)
    }

    /// Four samples of no meaning, where the raster begins: its place, spacing, marker and reference system.
    pub fn place(&self, file: &str) -> Result<Grid<f32>, ReadError> {
        let grid = Grid::new(self.origin.into(), self.spacing.into(), 2, 2, vec![0.0; 4])
            .map_err(|error| ReadError::grid(file, "origin and spacing in the sidecar", &error))?;
        Ok(grid.with_no_data(self.marker()).with_crs(self.crs.clone()))
    }

    fn marker(&self) -> Option<f32> {
        self.no_data.map(|marker| match marker {
            Marker::Number(value) => value,
            Marker::Text(NotANumber::Nan) => f32::NAN,
        })
    }

    /// Writes the data file through `write`, then this sidecar. The old sidecar goes first: an interruption between
    /// the two leaves data without a sidecar, an error when read, never data with a sidecar that lies.
    pub fn write_with(&self, path: &Path, write: impl FnOnce() -> Result<(), WriteError>) -> Result<(), WriteError> {
        let beside = sidecar_path(path);
        let io = |source| WriteError::Io { file: name_of(&beside), source };
        let text = serde_json::to_vec_pretty(self).map_err(|error| io(error.into()))?;
        remove_if_present(&beside).map_err(io)?;
        write()?;
        atomic_write_bytes(&beside, &text).map_err(io)
    }
}

/// The elevations of `grid` as scaled 16-bit samples from north to south; the step is at most (max − min)/65534, so
/// each elevation is kept to half of that, and to one rounding of `f32`.
pub(super) fn scaled_u16(grid: &Grid<f32>) -> Vec<u16> {
    let (min, max) = grid.min_max().map_or((0.0, 0.0), |(low, high)| (f64::from(low), f64::from(high)));
    let first = if grid.no_data().is_some() { 1.0 } else { 0.0 };
    let scale = if max > min { (65535.0 - first) / (max - min) } else { 0.0 };
    let scaled = grid.map(None, |value| match value {
        None => 0,
        // Within 0..=65535 by the choice of min and max; `as` saturates on the last rounding.
        Some(value) => (first + (f64::from(value) - min) * scale).round() as u16,
    });
    flip_rows(scaled.values(), grid.width())
}

/// Place of a grid that the tests of several formats share.
#[cfg(test)]
pub(super) fn example() -> Grid<f32> {
    let values = vec![236.0, 1076.0, -9999.0, 500.25, 501.5, 777.0];
    Grid::new([-3.5, 1e6].into(), [30.0, 20.0].into(), 3, 2, values)
        .unwrap()
        .with_no_data(Some(-9999.0))
        .with_crs(Some(Crs::projected(Some(32611))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn example_of_the_documentation_is_a_sidecar() {
        let text: String = include_str!("sidecar.rs")
            .lines()
            .skip_while(|line| *line != "//! ```json")
            .skip(1)
            .map_while(|line| line.strip_prefix("//! ").filter(|line| *line != "```"))
            .collect();
        let sidecar = Sidecar::parse(text.as_bytes(), "a.raw.json").unwrap();
        let grid = sidecar.grid_of_u16("a.raw", &[0, 1, 65535, 1]).unwrap();
        assert_eq!(grid.values(), [1076.0, 236.0, -9999.0, 236.0]);
        assert_eq!((grid.known(0, 1), grid.crs()), (None, Some(&Crs::local_metres())));
    }
}
