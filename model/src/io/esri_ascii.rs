//! ESRI ASCII grids (`.asc`): a header of names and numbers, then elevations from the north-west, in text.
//!
//! `xllcorner`/`yllcorner` are the outer corner of the south-west cell, half a cell from its sample;
//! `xllcenter`/`yllcenter` the sample itself. Cells are `cellsize` square, or `dx` by `dy`. A header without
//! `NODATA_value` means −9999, as ESRI has it. The format cannot say what its coordinates are: a `.prj` file of the
//! same name is asked first (`GEOGCS…`, `PROJCS…`, `LOCAL_CS…`); without an answer, a raster that lies within ±360°, ±90°
//! with a cell of at most 0.1 is taken for degrees, since metres mistaken for degrees are refused with a clear
//! message and degrees mistaken for metres would pass in silence. Any other raster has no stated system.

use std::fs;
use std::io::Write;
use std::path::Path;

use glam::DVec2;

use super::atomic::{atomic_write, atomic_write_bytes, remove_if_present};
use super::check::{flip_rows, load, sample_count, sound, writable};
use super::error::{Failure, ReadError, ReadErrorKind, WriteError, name_file, name_of, quoted};
use super::wkt;
use crate::grid::{Crs, Grid};

/// Reads an ESRI ASCII grid, and the `.prj` file beside it if there is one.
///
/// # Errors
/// [`ReadError`] naming the line: an unknown, missing or doubled header entry, a token that is not a number, too few
/// or too many elevations, a value that is neither finite nor no-data, or no value at all.
pub fn read(path: &Path) -> Result<Grid<f32>, ReadError> {
    let (name, bytes) = load(path)?;
    let projection = fs::read(path.with_extension("prj")).ok();
    read_from(&bytes, projection.as_deref(), &name)
}

/// Reads the bytes of an ESRI ASCII grid; `projection` is the text of its `.prj` file, `name` stands in messages.
///
/// # Errors
/// As [`read`].
pub fn read_from(bytes: &[u8], projection: Option<&[u8]>, name: &str) -> Result<Grid<f32>, ReadError> {
    let mut tokens = Tokens { lines: bytes.split(|&b| b == b'\n'), rest: &[], line: 0 };
    let header = Header::read(&mut tokens, name)?;
    // Every value takes a digit and a separator, the last one no separator.
    let capacity = (bytes.len() as u64).div_ceil(2);
    let count = sample_count(name, "ncols, nrows", (header.columns, header.rows), capacity, bytes.len() as u64)?;
    let (width, height) = (header.columns as usize, header.rows as usize);
    let mut values: Vec<f32> = Vec::with_capacity(count);
    let mut token = header.first;
    while let Some((line, text)) = token {
        if values.len() == count {
            let found = format!("{} after the last elevation", quoted(text));
            let expected = format!("the end of the file after {count} values");
            let mend = "correct ncols and nrows, or remove what follows";
            return Err(ReadError::new(name, ReadErrorKind::Truncated, format!("line {line}"), found, expected, mend));
        }
        let value = number::<f32>(text).ok_or_else(|| not_a_number(name, line, text, "an elevation"))?;
        if !value.is_finite() && !header.no_data.is_nan() {
            return Err(not_a_number(name, line, text, "a finite elevation or the no-data value"));
        }
        values.push(value);
        token = tokens.next();
    }
    if values.len() != count {
        let (place, found) = (format!("end of the file, line {}", tokens.line), format!("{} values", values.len()));
        let expected = format!("{width} × {height} = {count}");
        let mend = "copy the whole file again, or correct ncols and nrows";
        return Err(ReadError::new(name, ReadErrorKind::Truncated, place, found, expected, mend));
    }
    let grid = Grid::new(header.origin, header.spacing, width, height, flip_rows(&values, width))
        .map_err(|error| ReadError::grid(name, "header", &error))?;
    let degrees = || looks_like_degrees(&grid).then(|| Crs::geographic(None));
    let crs = projection.and_then(|text| wkt::read(&String::from_utf8_lossy(text))).or_else(degrees);
    sound(name, grid.with_no_data(Some(header.no_data)).with_crs(crs))
}

/// Writes an ESRI ASCII grid with `xllcenter`, which keeps the origin exactly, the shortest decimals that give back
/// each `f32`, and its system in a `.prj` file of the same name. Where the system has no text (a projection of which only the
/// unit is known), or is not stated, an old `.prj` file is removed, since it would be read back with these elevations.
///
/// # Errors
/// [`WriteError`]: a value that is neither finite nor no-data, nothing known, or the file system.
pub fn write(path: &Path, grid: &Grid<f32>) -> Result<(), WriteError> {
    writable(path, grid)?;
    let projection = path.with_extension("prj");
    let io = |source| WriteError::Io { file: name_of(&projection), source };
    remove_if_present(&projection).map_err(io)?;
    atomic_write(path, |file| {
        writeln!(file, "ncols {}\nnrows {}", grid.width(), grid.height())?;
        writeln!(file, "xllcenter {}\nyllcenter {}", grid.origin().x, grid.origin().y)?;
        let DVec2 { x: dx, y: dy } = grid.spacing();
        if dx == dy {
            writeln!(file, "cellsize {dx}")?;
        } else {
            writeln!(file, "dx {dx}\ndy {dy}")?;
        }
        writeln!(file, "NODATA_value {}", grid.no_data().unwrap_or(-9999.0))?;
        for row in grid.rows().rev() {
            for (i, value) in row.iter().enumerate() {
                if grid.no_data().is_none() && *value == -9999.0 {
                    return Err(Failure::other("the elevation −9999 would be read as no-data"));
                }
                write!(file, "{}{value}", if i == 0 { "" } else { " " })?;
            }
            writeln!(file)?;
        }
        Ok(())
    })
    .map_err(name_file(path))?;
    match grid.crs().and_then(wkt::write) {
        Some(text) => atomic_write_bytes(&projection, format!("{text}\n").as_bytes()).map_err(io),
        None => Ok(()),
    }
}

struct Header<'a> {
    columns: u64,
    rows: u64,
    origin: DVec2,
    spacing: DVec2,
    no_data: f32,
    /// The first elevation, met while looking for the end of the header.
    first: Option<(usize, &'a [u8])>,
}

impl<'a> Header<'a> {
    fn read(tokens: &mut Tokens<'a>, name: &str) -> Result<Header<'a>, ReadError> {
        const NAMES: [&str; 10] = [
            "ncols",
            "nrows",
            "xllcorner",
            "xllcenter",
            "yllcorner",
            "yllcenter",
            "cellsize",
            "dx",
            "dy",
            "nodata_value",
        ];
        let mut entries: [Option<f64>; 10] = [None; 10];
        let mut no_data = -9999.0_f32;
        let first = loop {
            let Some((line, key)) = tokens.next() else { break None };
            if !key[0].is_ascii_alphabetic() || number::<f64>(key).is_some() {
                break Some((line, key));
            }
            let place = format!("line {line}");
            let entry = NAMES.iter().position(|name| key.eq_ignore_ascii_case(name.as_bytes()));
            let Some(entry) = entry else {
                let expected = "one of ncols, nrows, xllcorner, xllcenter, yllcorner, yllcenter, cellsize, dx, dy, \
                                NODATA_value, or an elevation";
                let mend = "correct the header; is this an ESRI ASCII grid?";
                return Err(ReadError::new(name, ReadErrorKind::Magic, place, quoted(key), expected, mend));
            };
            let value = tokens.next().map(|(_, text)| text).unwrap_or_default();
            let Some(parsed) = number::<f64>(value) else {
                return Err(not_a_number(name, line, value, &format!("a number after {}", NAMES[entry])));
            };
            if NAMES[entry] == "nodata_value" {
                no_data = number(value).unwrap_or(no_data);
            }
            if entries[entry].replace(parsed).is_some() {
                let found = format!("a second {}", NAMES[entry]);
                return Err(ReadError::new(name, ReadErrorKind::Header, place, found, "one", "remove the wrong one"));
            }
        };
        let [columns, rows, x_corner, x_center, y_corner, y_center, cell, dx, dy, _] = entries;
        let missing = |what: &str| {
            let mend = "add it to the header; is this an ESRI ASCII grid?";
            ReadError::new(name, ReadErrorKind::Header, "header", format!("no {what}"), what, mend)
        };
        let spacing = match (cell, dx, dy) {
            (Some(cell), None, None) => DVec2::splat(cell),
            (None, Some(dx), Some(dy)) => DVec2::new(dx, dy),
            (None, None, None) => return Err(missing("cellsize")),
            _ => return Err(missing("either cellsize or both dx and dy")),
        };
        let origin = |corner: Option<f64>, center: Option<f64>, half: f64, what| match (corner, center) {
            (Some(corner), None) => Ok(corner + half),
            (None, Some(center)) => Ok(center),
            _ => Err(missing(what)),
        };
        let side = |value: Option<f64>, what| {
            let value = value.ok_or_else(|| missing(what))?;
            // Above 2⁵³ a float is no exact count, and no file is that long.
            if value.fract() == 0.0 && (1.0..=9.007e15).contains(&value) {
                return Ok(value as u64);
            }
            let (expected, mend) = ("a positive whole number", "correct the header");
            Err(ReadError::new(name, ReadErrorKind::Header, what, value, expected, mend))
        };
        Ok(Header {
            columns: side(columns, "ncols")?,
            rows: side(rows, "nrows")?,
            origin: DVec2::new(
                origin(x_corner, x_center, spacing.x / 2.0, "either xllcorner or xllcenter")?,
                origin(y_corner, y_center, spacing.y / 2.0, "either yllcorner or yllcenter")?,
            ),
            spacing,
            no_data,
            first,
        })
    }
}

/// The words of a text with the number of their line, from 1.
struct Tokens<'a> {
    lines: std::slice::Split<'a, u8, fn(&u8) -> bool>,
    rest: &'a [u8],
    line: usize,
}

impl<'a> Tokens<'a> {
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        loop {
            self.rest = self.rest.trim_ascii_start();
            if !self.rest.is_empty() {
                let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
                let (token, rest) = self.rest.split_at(end);
                self.rest = rest;
                return Some((self.line, token));
            }
            self.rest = self.lines.next()?;
            self.line += 1;
        }
    }
}

fn number<F: std::str::FromStr>(token: &[u8]) -> Option<F> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

fn not_a_number(name: &str, line: usize, token: &[u8], expected: &str) -> ReadError {
    let found = if token.is_empty() { "nothing".to_string() } else { quoted(token) };
    let mend = if token.contains(&b',') { "write decimals with a point" } else { "correct the number" };
    ReadError::new(name, ReadErrorKind::Value, format!("line {line}"), found, expected, mend)
}

fn looks_like_degrees(grid: &Grid<f32>) -> bool {
    let (low, high) = grid.bounds();
    let within = |p: DVec2| p.x.abs() <= 360.0 && p.y.abs() <= 90.0;
    grid.spacing().max_element() <= 0.1 && within(low) && within(high)
}

#[cfg(test)]
#[path = "esri_ascii_tests.rs"]
mod tests;
