//! Paris 2019, Table 1: size, memory and polygonization of five scenes, against material stacks and marching cubes.

use super::{Prose, TableError, read};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    table1: Paris2019Table1,
}

/// Table 1 of Paris 2019 (§8), as printed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paris2019Table1 {
    /// The authors' machine.
    pub hardware: String,
    /// What the caption adds.
    pub note: String,
    /// One row per scene, in the paper's order.
    #[serde(rename = "row")]
    pub rows: Vec<Paris2019Row>,
    /// What the prose says otherwise.
    pub prose: Vec<Prose>,
}

/// One scene of Table 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paris2019Row {
    /// The scene and the figure that shows it.
    pub scene: String,
    /// Side of the square terrain, km.
    pub side_km: f64,
    /// Share of the area with more than one primitive in the column — a.
    pub coverage: f64,
    /// Nodes of the tree — #N.
    pub nodes: u32,
    /// Seconds to generate the scene; the paper prints a dash for one made by hand.
    pub generation_seconds: Option<f64>,
    /// User edits — #E.
    pub edits: u32,
    /// Memory of the tree, MB.
    pub megabytes: f64,
    /// Memory of the same scene as material stacks (Arches), MB.
    pub arches_megabytes: f64,
    /// Grid of the polygonization, cells along x, y, z.
    pub grid: [u32; 3],
    /// Seconds of the bounded polygonization — t.
    pub seconds: f64,
    /// Seconds of standard marching cubes — t₀.
    pub baseline_seconds: f64,
    /// Field evaluations of the bounded polygonization — #C.
    pub calls: u64,
    /// Field evaluations of standard marching cubes — #C₀.
    pub baseline_calls: u64,
}

impl Paris2019Row {
    /// t₀/t (derived).
    pub fn speedup(&self) -> f64 {
        self.baseline_seconds / self.seconds
    }

    /// #C₀/#C (derived).
    pub fn call_ratio(&self) -> f64 {
        self.baseline_calls as f64 / self.calls as f64
    }

    /// Memory of material stacks over memory of the tree (derived).
    pub fn memory_ratio(&self) -> f64 {
        self.arches_megabytes / self.megabytes
    }

    /// Horizontal side of a cell, metres (derived).
    pub fn cell_metres(&self) -> f64 {
        self.side_km * 1000.0 / f64::from(self.grid[0])
    }

    /// Bytes per node of the tree, with 1 MB = 10⁶ bytes (derived).
    pub fn bytes_per_node(&self) -> f64 {
        self.megabytes * 1e6 / f64::from(self.nodes)
    }
}

/// Reads Table 1 of Paris 2019.
pub fn paris2019_table1() -> Result<Paris2019Table1, TableError> {
    read::<File>("paris2019", super::PARIS2019).map(|file| file.table1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_columns_are_those_of_the_checklist() {
        // t₀/t, #C₀/#C, memory ratio, cell, bytes per node; half a unit in the last digit of each.
        let expected: [[(f64, f64); 5]; 5] = [
            [(6.9, 0.05), (23.0, 0.5), (100.0, 0.5), (3.0, 0.05), (59.0, 0.5)],
            [(13.3, 0.05), (71.0, 0.5), (14.0, 0.5), (3.4, 0.05), (60.0, 0.5)],
            [(4.9, 0.05), (19.0, 0.5), (12.0, 0.5), (1.1, 0.05), (68.0, 0.5)],
            [(5.4, 0.05), (28.0, 0.5), (1.9, 0.05), (0.54, 0.005), (99.0, 0.5)],
            [(1.44, 0.005), (2.5, 0.05), (1.6, 0.05), (0.73, 0.005), (98.0, 0.5)],
        ];
        let table = paris2019_table1().unwrap();
        assert_eq!(table.rows.len(), expected.len());
        for (row, columns) in table.rows.iter().zip(expected) {
            let ours = [row.speedup(), row.call_ratio(), row.memory_ratio(), row.cell_metres(), row.bytes_per_node()];
            for (value, (printed, half)) in ours.into_iter().zip(columns) {
                assert!((value - printed).abs() <= half, "{}: {value} against {printed}", row.scene);
            }
        }
    }

    #[test]
    fn only_benagil_has_no_generation_time() {
        let table = paris2019_table1().unwrap();
        let without: Vec<&str> =
            table.rows.iter().filter(|row| row.generation_seconds.is_none()).map(|row| row.scene.as_str()).collect();
        assert_eq!(without, ["Benagil (Fig 25)"]);
    }

    #[test]
    fn baseline_calls_are_fewer_than_grid_vertices_on_two_rows() {
        // P22: a standard marching cubes evaluates every vertex at least once, so these two rows cannot be exact.
        let table = paris2019_table1().unwrap();
        let short: Vec<&str> = table
            .rows
            .iter()
            .filter(|row| row.baseline_calls < row.grid.iter().map(|&side| u64::from(side)).product())
            .map(|row| row.scene.as_str())
            .collect();
        assert_eq!(short, ["Karst (Fig 17)", "Benagil (Fig 25)"]);
    }
}
