//! What the x and y of a raster mean: just enough of a coordinate reference system to refuse degrees where metres are
//! needed, with the GeoTIFF keys and the well-known text carried along untouched so that a file that is read and written loses
//! nothing.

use serde::{Deserialize, Serialize};

/// The kind of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CrsKind {
    /// A map projection: x is an easting, y a northing.
    Projected {
        /// Its EPSG code, where the file has one.
        epsg: Option<u16>,
        /// Length of a unit of x and y in metres: 1 for metres, 0.3048 for feet.
        metres_per_unit: f64,
    },
    /// Longitude and latitude in degrees.
    Geographic {
        /// Its EPSG code, where the file has one.
        epsg: Option<u16>,
    },
    /// A flat frame in metres, not tied to a map.
    LocalMetres,
}

/// A coordinate reference system: its kind, and what it was read from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crs {
    /// What is known of it.
    pub kind: CrsKind,
    /// The keys, for files that can hold them.
    #[serde(default, skip_serializing_if = "GeoKeys::is_empty")]
    pub keys: GeoKeys,
    /// The well-known text it was read from, where that names no EPSG code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wkt: Option<String>,
}

impl Crs {
    /// A system of which the kind alone is known.
    pub fn new(kind: CrsKind) -> Crs {
        Crs { kind, keys: GeoKeys::default(), wkt: None }
    }

    /// A projection in metres, by EPSG code.
    pub fn projected(epsg: Option<u16>) -> Crs {
        Crs::new(CrsKind::Projected { epsg, metres_per_unit: 1.0 })
    }

    /// Longitude and latitude in degrees, by EPSG code (4326: WGS 84).
    pub fn geographic(epsg: Option<u16>) -> Crs {
        Crs::new(CrsKind::Geographic { epsg })
    }

    /// A flat frame in metres.
    pub fn local_metres() -> Crs {
        Crs::new(CrsKind::LocalMetres)
    }

    /// Whether a unit of x and y is a metre.
    pub fn is_metric(&self) -> bool {
        match self.kind {
            CrsKind::Projected { metres_per_unit, .. } => metres_per_unit == 1.0,
            CrsKind::Geographic { .. } => false,
            CrsKind::LocalMetres => true,
        }
    }

    /// Whether x and y are longitude and latitude in degrees.
    pub fn is_geographic(&self) -> bool {
        matches!(self.kind, CrsKind::Geographic { .. })
    }
}

/// The three GeoTIFF key tags as they stand in a file (OGC GeoTIFF 1.1, §7.1).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeoKeys {
    /// GeoKeyDirectory (34735): a header of four numbers, then four numbers a key.
    pub directory: Vec<u16>,
    /// GeoDoubleParams (34736).
    #[serde(default)]
    pub doubles: Vec<f64>,
    /// GeoAsciiParams (34737), without the closing NUL.
    #[serde(default)]
    pub ascii: String,
}

impl GeoKeys {
    /// Whether there are no keys.
    pub fn is_empty(&self) -> bool {
        self.directory.is_empty()
    }

    /// The value of a key that is stored in the directory itself (tag location 0).
    pub fn short(&self, key: u16) -> Option<u16> {
        self.entries().find(|entry| entry[0] == key && entry[1] == 0).map(|entry| entry[3])
    }

    /// The text of a key that is stored in GeoAsciiParams, without the closing bar.
    pub fn text(&self, key: u16) -> Option<&str> {
        let entry = self.entries().find(|entry| entry[0] == key && entry[1] == 34737)?;
        let start = usize::from(entry[3]);
        let text = self.ascii.get(start..start + usize::from(entry[2]))?;
        Some(text.trim_end_matches(['|', '\0']))
    }

    /// The first number of a key that is stored in GeoDoubleParams.
    pub fn double(&self, key: u16) -> Option<f64> {
        let entry = self.entries().find(|entry| entry[0] == key && entry[1] == 34736)?;
        self.doubles.get(usize::from(entry[3])).copied()
    }

    /// The same keys with a short key set, in its place by ascending number as the standard asks.
    #[must_use]
    pub fn with_short(&self, key: u16, value: u16) -> GeoKeys {
        let header = self.directory.get(..3).map_or([1, 1, 0], |h| [h[0], h[1], h[2]]);
        let mut entries: Vec<[u16; 4]> = self.entries().filter(|entry| entry[0] != key).collect();
        let at = entries.iter().position(|entry| entry[0] > key).unwrap_or(entries.len());
        entries.insert(at, [key, 0, 1, value]);
        let count = u16::try_from(entries.len()).unwrap_or(u16::MAX);
        let mut directory = vec![header[0], header[1], header[2], count];
        directory.extend(entries.iter().take(usize::from(count)).flatten());
        GeoKeys { directory, doubles: self.doubles.clone(), ascii: self.ascii.clone() }
    }

    fn entries(&self) -> impl Iterator<Item = [u16; 4]> + '_ {
        let count = self.directory.get(3).map_or(0, |&n| usize::from(n));
        let body = self.directory.get(4..).unwrap_or(&[]);
        body.chunks_exact(4).take(count).map(|entry| [entry[0], entry[1], entry[2], entry[3]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_metres_are_metric() {
        assert!(Crs::projected(Some(32611)).is_metric());
        assert!(Crs::local_metres().is_metric());
        assert!(!Crs::geographic(Some(4326)).is_metric());
        let feet = CrsKind::Projected { epsg: Some(2263), metres_per_unit: 0.3048 };
        assert!(!Crs::new(feet).is_metric());
    }

    #[test]
    fn setting_a_short_key_keeps_the_others_in_ascending_order() {
        let directory = vec![1, 1, 1, 3, 1024, 0, 1, 1, 1026, 34737, 4, 0, 3072, 0, 1, 32611];
        let keys = GeoKeys { directory, doubles: vec![], ascii: "abc|".into() };
        let patched = keys.with_short(1025, 2);
        assert_eq!(patched.directory[3], 4);
        assert_eq!(patched.directory[8..12], [1025, 0, 1, 2]);
        assert_eq!((patched.short(3072), patched.text(1026)), (Some(32611), Some("abc")));
        assert_eq!(patched.with_short(1025, 1).short(1025), Some(1));
        assert_eq!(patched.with_short(1025, 1).directory.len(), patched.directory.len());
    }

    #[test]
    fn keys_that_point_outside_of_their_tags_are_absent() {
        let keys = GeoKeys {
            directory: vec![1, 1, 0, 9, 1026, 34737, 40, 7, 2057, 34736, 1, 3],
            doubles: vec![],
            ascii: "é".into(),
        };
        assert_eq!((keys.text(1026), keys.double(2057), keys.short(1024)), (None, None, None));
    }
}
