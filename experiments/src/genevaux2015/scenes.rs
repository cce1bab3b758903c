//! The paper's scenes, built into the program.

use crate::scenes;
use glam::DVec2;
use terrain_model::program::Program;
use terrain_model::scene::Scene;
use terrain_papers::tables::genevaux2015_table1;

/// A scene of Table 1 with its ground compiled.
pub struct TableScene {
    /// Name in metrics, as `fig3`.
    pub name: &'static str,
    /// Name in the paper's table.
    pub row: &'static str,
    /// The scene.
    pub scene: Scene,
    /// Its ground.
    pub program: Program,
    /// Its size, metres.
    pub extent: DVec2,
    /// Rays that a quick run compares the tracers on.
    pub quick_rays: u64,
    /// The committed record of long comparisons, empty before the first.
    pub record: &'static str,
}

/// Name in metrics, name in the table, rays of a quick comparison, record of long ones.
const SCENES: [(&str, &str, u64, &str); 6] = [
    ("fig1", "Fig 1", 2_500, include_str!("../../records/fig1.csv")),
    ("fig3", "Fig 3", 2_500, include_str!("../../records/fig3.csv")),
    ("fig19", "Fig 19", 2_500, include_str!("../../records/fig19.csv")),
    ("fig20", "Fig 20", 2_500, include_str!("../../records/fig20.csv")),
    ("fig21", "Fig 21", 2_500, include_str!("../../records/fig21.csv")),
    ("fig22", "Fig 22", 2_500, include_str!("../../records/fig22.csv")),
];

/// The scenes of the table, in its order.
///
/// # Errors
/// What is wrong with a built-in scene: a bug.
pub fn table_scenes() -> Result<Vec<TableScene>, String> {
    let table = genevaux2015_table1().map_err(|error| error.to_string())?;
    SCENES
        .into_iter()
        .map(|(name, row, quick_rays, record)| {
            let printed = table.rows.iter().find(|printed| printed.scene == row);
            let printed = printed.ok_or_else(|| format!("Table 1 has no row {row}"))?;
            let extent = DVec2::from_array(printed.extent_km) * 1000.0;
            let scene = scenes::load(&format!("builtin:{name}")).map_err(|error| error.to_string())?;
            let program = scene.program(scene.ground()).map_err(|error| format!("{name}: {error}"))?;
            Ok(TableScene { name, row, scene, program, extent, quick_rays, record })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_the_counts_of_the_table() {
        let table = genevaux2015_table1().unwrap();
        for scene in table_scenes().unwrap() {
            let row = table.rows.iter().find(|row| row.scene == scene.row).expect("a row of the table");
            let root = scene.scene.layers[scene.scene.ground()];
            let (primitives, operators) = scene.scene.tree.count(root);
            assert_eq!((primitives as u32, operators as u32), (row.primitives, row.operators), "{}", scene.name);
        }
    }
}
