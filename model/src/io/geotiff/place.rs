//! Where the samples of a GeoTIFF are, and in which system: between the geographic tags and [`Crs`].

use glam::DVec2;

use super::super::error::{ReadError, ReadErrorKind};
use super::directory::Directory;
use crate::grid::{Crs, CrsKind, GeoKeys};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const CITATION: u16 = 1026;
const GEOGRAPHIC_TYPE: u16 = 2048;
const ANGULAR_UNITS: u16 = 2054;
const PROJECTED_TYPE: u16 = 3072;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const USER_DEFINED: u16 = 32767;
const METRE: u16 = 9001;
/// How ESRI's tools cite a system that has no code; GDAL reads the text behind it.
const WKT_CITATION: &str = "ESRI PE String = ";

/// Longest citation that is written; the count of a key is a 16-bit number.
const CITED: usize = 60_000;

/// The keys of a file; empty when it has none.
pub(super) fn keys(directory: &Directory) -> Result<GeoKeys, ReadError> {
    let shorts = directory.unsigned(34735)?.unwrap_or_default();
    Ok(GeoKeys {
        directory: shorts.into_iter().map(|short| u16::try_from(short).unwrap_or(0)).collect(),
        doubles: directory.doubles(34736)?.unwrap_or_default(),
        ascii: directory.text(34737).unwrap_or_default(),
    })
}

/// (origin, spacing): position of the south-west sample, and (dx, dy).
pub(super) fn place(directory: &Directory, keys: &GeoKeys, height: usize) -> Result<(DVec2, DVec2), ReadError> {
    let wrong = |tag, found: String, expected: &str, mend: &str| {
        Err(directory.wrong(ReadErrorKind::Header, tag, found, expected, mend))
    };
    // Raster point (column, row from the north) `tie` is at `at`.
    let (tie, at, spacing) = if let Some(matrix) = directory.doubles(34264)? {
        let &[dx, turn_x, _, x, turn_y, dy, _, y, ..] = matrix.as_slice() else {
            return wrong(34264, format!("{} numbers", matrix.len()), "16", "write the file again with gdal_translate");
        };
        if turn_x != 0.0 || turn_y != 0.0 || dx < 0.0 || dy > 0.0 {
            let found = format!("a turned or mirrored raster ({dx}, {turn_x}; {turn_y}, {dy})");
            let mend = "straighten it with gdalwarp IN OUT";
            let expected = "columns to the east and rows to the south";
            return Err(directory.wrong(ReadErrorKind::Unsupported, 34264, found, expected, mend));
        }
        (DVec2::ZERO, DVec2::new(x, y), DVec2::new(dx, -dy))
    } else {
        let mend = "give it a place with gdal_translate -a_ullr WEST NORTH EAST SOUTH IN OUT";
        let Some(scale) = directory.doubles(33550)? else {
            return wrong(33550, "nothing".into(), "the spacing of the samples", mend);
        };
        let Some(tie) = directory.doubles(33922)? else {
            return wrong(33922, "nothing".into(), "the place of one raster point", mend);
        };
        let (&[dx, dy, ..], &[i, j, _, x, y, ..]) = (scale.as_slice(), tie.as_slice()) else {
            let found = format!("{} numbers, and {} in tag 33550", tie.len(), scale.len());
            return wrong(33922, found, "6, and 3", mend);
        };
        (DVec2::new(i, j), DVec2::new(x, y), DVec2::new(dx, dy))
    };
    let positive = |s: f64| s.is_finite() && s > 0.0;
    if !positive(spacing.x) || !positive(spacing.y) {
        let found = format!("spacing ({}, {})", spacing.x, spacing.y);
        return wrong(33550, found, "positive and finite", "set it with gdal_translate -tr DX DY IN OUT");
    }
    let half = if keys.short(RASTER_TYPE) == Some(2) { 0.0 } else { 0.5 };
    let column = half - tie.x;
    let row = (height - 1) as f64 + half - tie.y;
    Ok((DVec2::new(at.x + column * spacing.x, at.y - row * spacing.y), spacing))
}

/// The system that the keys describe; `None` where they name no model (key 1024).
pub(super) fn crs(directory: &Directory, keys: GeoKeys) -> Result<Option<Crs>, ReadError> {
    let Some(model) = keys.short(MODEL_TYPE) else { return Ok(None) };
    let epsg = |key| keys.short(key).filter(|code| !matches!(code, 0 | 32767..));
    let metres_per_unit = match keys.short(LINEAR_UNITS) {
        None | Some(METRE) => 1.0,
        Some(9002) => 0.3048,
        Some(9003) => 1200.0 / 3937.0,
        // Any other unit: by its size if the file gives it, or of unknown length, which is not metric either.
        Some(_) => keys.double(LINEAR_UNIT_SIZE).unwrap_or(0.0),
    };
    let kind = match model {
        1 => CrsKind::Projected { epsg: epsg(PROJECTED_TYPE), metres_per_unit },
        2 => {
            if let Some(unit) = keys.short(ANGULAR_UNITS).filter(|unit| !matches!(unit, 9102 | 9122)) {
                let found = format!("angular unit {unit}");
                let mend = "convert it with gdalwarp -t_srs EPSG:4326 IN OUT";
                return Err(directory.wrong(ReadErrorKind::Unsupported, 34735, found, "degrees (9102)", mend));
            }
            CrsKind::Geographic { epsg: epsg(GEOGRAPHIC_TYPE) }
        }
        3 => {
            let mend = "convert it with gdalwarp -t_srs EPSG:4326 IN OUT";
            let expected = "projected or geographic ones";
            return Err(directory.wrong(ReadErrorKind::Unsupported, 34735, "geocentric coordinates", expected, mend));
        }
        _ if metres_per_unit == 1.0 => CrsKind::LocalMetres,
        _ => CrsKind::Projected { epsg: None, metres_per_unit },
    };
    let wkt = keys.text(CITATION).and_then(|text| text.strip_prefix(WKT_CITATION)).map(str::to_owned);
    Ok(Some(Crs { kind, keys, wkt }))
}

/// The keys to write for a system: its own, or the fewest that say what it is; with the given raster type.
pub(super) fn keys_of(crs: Option<&Crs>, raster_type: u16) -> GeoKeys {
    let Some(crs) = crs else {
        // No system: the raster type alone.
        return GeoKeys::default().with_short(RASTER_TYPE, raster_type);
    };
    if !crs.keys.is_empty() {
        return crs.keys.with_short(RASTER_TYPE, raster_type);
    }
    let keys = GeoKeys::default().with_short(RASTER_TYPE, raster_type);
    match crs.kind {
        CrsKind::Projected { epsg, metres_per_unit } => {
            let mut keys = keys.with_short(MODEL_TYPE, 1).with_short(PROJECTED_TYPE, epsg.unwrap_or(USER_DEFINED));
            if let Some(text) = crs.wkt.as_deref().filter(|text| text.is_ascii() && text.len() < CITED) {
                keys = cited(&keys, &format!("{WKT_CITATION}{text}"));
            }
            if metres_per_unit == 1.0 {
                return keys.with_short(LINEAR_UNITS, METRE);
            }
            let mut keys = keys.with_short(LINEAR_UNITS, USER_DEFINED).with_short(LINEAR_UNIT_SIZE, 0);
            point_at(&mut keys, LINEAR_UNIT_SIZE, 34736, 1);
            keys.doubles = vec![metres_per_unit];
            keys
        }
        CrsKind::Geographic { epsg } => {
            let keys = keys.with_short(MODEL_TYPE, 2).with_short(GEOGRAPHIC_TYPE, epsg.unwrap_or(USER_DEFINED));
            keys.with_short(ANGULAR_UNITS, 9102)
        }
        CrsKind::LocalMetres => {
            cited(&keys.with_short(MODEL_TYPE, USER_DEFINED), "local metres").with_short(LINEAR_UNITS, METRE)
        }
    }
}

/// The same keys with a citation, in printable ASCII of at most [`CITED`] characters.
fn cited(keys: &GeoKeys, citation: &str) -> GeoKeys {
    let mut keys = keys.with_short(CITATION, 0);
    keys.ascii = format!("{citation}|");
    let count = keys.ascii.len() as u16;
    point_at(&mut keys, CITATION, 34737, count);
    keys
}

/// Makes `key` point at the first `count` values of the tag `location` instead of holding its value.
fn point_at(keys: &mut GeoKeys, key: u16, location: u16, count: u16) {
    if let Some(entry) = keys.directory.chunks_exact_mut(4).skip(1).find(|entry| entry[0] == key) {
        entry[1] = location;
        entry[2] = count;
        entry[3] = 0;
    }
}
