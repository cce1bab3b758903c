//! Hnaidi 2010, Tables 1 and 2: how many feature curves a scene has, how many bytes, and how long it takes on three grids.

use super::{TableError, read};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    table1: Hnaidi2010Table1,
    table2: Hnaidi2010Table2,
}

/// Table 1 of Hnaidi 2010 (§6), as printed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hnaidi2010Table1 {
    /// What the caption adds.
    pub note: String,
    /// One row per scene, in the paper's order.
    #[serde(rename = "row")]
    pub rows: Vec<Hnaidi2010Curves>,
}

/// One scene of Table 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hnaidi2010Curves {
    /// The scene's name.
    pub scene: String,
    /// Number of feature curves.
    pub features: u32,
    /// Size of the file, kB (1000 bytes).
    pub kilobytes: f64,
}

impl Hnaidi2010Curves {
    /// Bytes per feature curve (derived).
    pub fn bytes_per_curve(&self) -> f64 {
        self.kilobytes * 1000.0 / f64::from(self.features)
    }
}

/// Table 2 of Hnaidi 2010 (§6), as printed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hnaidi2010Table2 {
    /// The authors' machine.
    pub hardware: String,
    /// What the caption adds.
    pub note: String,
    /// Side of the three square grids, in samples.
    pub grid_sides: [u32; 3],
    /// One row per scene, in the paper's order.
    #[serde(rename = "row")]
    pub rows: Vec<Hnaidi2010Times>,
}

/// One scene of Table 2.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hnaidi2010Times {
    /// The scene's name.
    pub scene: String,
    /// Seconds on each of the three grids.
    pub seconds: [f64; 3],
}

impl Hnaidi2010Table2 {
    /// Millions of samples per second on each of the three grids (derived).
    pub fn megasamples_per_second(&self, row: &Hnaidi2010Times) -> [f64; 3] {
        std::array::from_fn(|i| {
            let side = f64::from(self.grid_sides[i]);
            side * side / 1e6 / row.seconds[i]
        })
    }
}

/// Reads Table 1 of Hnaidi 2010.
pub fn hnaidi2010_table1() -> Result<Hnaidi2010Table1, TableError> {
    read::<File>("hnaidi2010", super::HNAIDI2010).map(|file| file.table1)
}

/// Reads Table 2 of Hnaidi 2010.
pub fn hnaidi2010_table2() -> Result<Hnaidi2010Table2, TableError> {
    read::<File>("hnaidi2010", super::HNAIDI2010).map(|file| file.table2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_takes_41_to_62_bytes() {
        let sizes: Vec<f64> = hnaidi2010_table1().unwrap().rows.iter().map(Hnaidi2010Curves::bytes_per_curve).collect();
        assert_eq!(sizes.len(), 6);
        assert!(sizes.iter().all(|size| (40.5..62.0).contains(size)), "{sizes:?}");
    }

    #[test]
    fn throughput_grows_from_1_4_to_6_3_megasamples_per_second() {
        let table = hnaidi2010_table2().unwrap();
        let mountain = table.megasamples_per_second(&table.rows[0]);
        assert_eq!(format!("{:.1} {:.1}", mountain[0], mountain[2]), "1.4 6.3");
    }

    #[test]
    fn both_tables_list_the_same_scenes() {
        let curves: Vec<String> = hnaidi2010_table1().unwrap().rows.into_iter().map(|row| row.scene).collect();
        let times: Vec<String> = hnaidi2010_table2().unwrap().rows.into_iter().map(|row| row.scene).collect();
        assert_eq!(curves, times);
    }
}
