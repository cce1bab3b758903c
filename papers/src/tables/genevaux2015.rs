//! Génevaux 2015, Table 1: calls and times of sphere tracing and of a regular mesh on six scenes.

use super::{Prose, TableError, read};
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    table1: Genevaux2015Table1,
}

/// Table 1 of Génevaux 2015 (§8), as printed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Genevaux2015Table1 {
    /// The authors' machine.
    pub hardware: String,
    /// Image width, pixels.
    pub width_pixels: u32,
    /// Image height, pixels.
    pub height_pixels: u32,
    /// What the caption adds.
    pub note: String,
    /// One row per scene, in the paper's order.
    #[serde(rename = "row")]
    pub rows: Vec<Genevaux2015Row>,
    /// What the prose says otherwise.
    pub prose: Vec<Prose>,
}

/// One scene of Table 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Genevaux2015Row {
    /// The figure that shows it.
    pub scene: String,
    /// Extent, km × km.
    pub extent_km: [f64; 2],
    /// Evaluations of the terrain, sphere tracing.
    pub sphere_tracing_calls: u64,
    /// Time of sphere tracing, milliseconds.
    pub sphere_tracing_ms: f64,
    /// Evaluations of the terrain, regular mesh.
    pub mesh_calls: u64,
    /// Time of the regular mesh, milliseconds.
    pub mesh_ms: f64,
    /// Leaves of the tree.
    pub primitives: u32,
    /// Inner nodes of the tree.
    pub operators: u32,
    /// Size of the tree in memory, kB.
    pub kilobytes: u32,
}

impl Genevaux2015Table1 {
    /// Sphere-tracing calls per pixel of the image (derived).
    pub fn calls_per_pixel(&self, row: &Genevaux2015Row) -> f64 {
        row.sphere_tracing_calls as f64 / (f64::from(self.width_pixels) * f64::from(self.height_pixels))
    }
}

impl Genevaux2015Row {
    /// Surface, km².
    pub fn surface_km2(&self) -> f64 {
        self.extent_km[0] * self.extent_km[1]
    }

    /// Sphere-tracing calls per millisecond, in millions (derived).
    pub fn megacalls_per_ms(&self) -> f64 {
        self.sphere_tracing_calls as f64 / 1e6 / self.sphere_tracing_ms
    }

    /// Primitives per km² (derived).
    pub fn primitives_per_km2(&self) -> f64 {
        f64::from(self.primitives) / self.surface_km2()
    }
}

/// Reads Table 1 of Génevaux 2015.
pub fn genevaux2015_table1() -> Result<Genevaux2015Table1, TableError> {
    read::<File>("genevaux2015", super::GENEVAUX2015).map(|file| file.table1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a unit in the last printed digit.
    fn prints_as(value: f64, digits: usize, printed: &str) {
        assert_eq!(format!("{value:.digits$}"), printed);
    }

    #[test]
    fn derived_columns_are_those_of_the_checklist() {
        let table = genevaux2015_table1().unwrap();
        let expected = [
            ("Fig 1", "28.9", "0.33"),
            ("Fig 3", "26.5", "1.53"),
            ("Fig 19", "24.1", "0.83"),
            ("Fig 20", "31.8", "0.24"),
            ("Fig 21", "38.1", "0.14"),
            ("Fig 22", "25.1", "0.14"),
        ];
        assert_eq!(table.rows.len(), expected.len());
        for (row, (scene, per_pixel, speed)) in table.rows.iter().zip(expected) {
            assert_eq!(row.scene, scene);
            prints_as(table.calls_per_pixel(row), 1, per_pixel);
            prints_as(row.megacalls_per_ms(), 2, speed);
        }
    }

    #[test]
    fn densities_contradict_the_prose_of_section_8_1() {
        let table = genevaux2015_table1().unwrap();
        let density = |scene: &str| table.rows.iter().find(|row| row.scene == scene).unwrap().primitives_per_km2();
        prints_as(density("Fig 1"), 1, "17.5");
        prints_as(density("Fig 22"), 0, "411");
        prints_as(density("Fig 21"), 3, "0.005");
        prints_as(density("Fig 19"), 4, "0.0004");
        assert!(table.prose.iter().any(|prose| prose.place == "§8.1"));
    }
}
