//! What the experiments on meshes share: the pieces of ground, the regular mesh that a mesh is measured against, a vertex
//! moved as a control, and a drawing of triangles from above.

use super::scenes::{TableScene, table_scenes};
use crate::experiment::{Context, ExperimentError};
use crate::report::PngFile;
use glam::DVec2;
use terrain_model::mesh::Mesh;
use terrain_model::mesh::deviation::certify;
use terrain_model::mesh::regular::{refuted, regular};
use terrain_model::program::Program;
use terrain_papers::tables::genevaux2015_table1;

/// A square of a scene, and how well it is to be meshed.
pub struct Ground {
    /// The scene.
    pub scene: TableScene,
    /// South-west corner, metres.
    pub low: DVec2,
    /// North-east corner, metres.
    pub high: DVec2,
    /// Metres.
    pub tolerance: f64,
}

/// The scenes that are meshed, and to what, metres.
const TOLERANCES: [(&str, f64); 2] = [("fig3", 5.0), ("fig19", 800.0)];

/// Two scenes of Table 1: the middle half of each side to 5 m (Fig. 3) and 800 m (Fig. 19), or all
/// of it to half of that.
///
/// # Errors
/// A scene or the table that cannot be read: a bug.
pub fn grounds(ctx: &Context) -> Result<Vec<Ground>, ExperimentError> {
    let table = genevaux2015_table1()?;
    let scenes = table_scenes().map_err(ExperimentError::failed)?;
    scenes
        .into_iter()
        .filter(|scene| TOLERANCES.iter().any(|(name, _)| *name == scene.name))
        .map(|scene| {
            let row = table.rows.iter().find(|row| row.scene == scene.row);
            let row = row.ok_or_else(|| ExperimentError::failed(format!("Table 1 has no row {}", scene.row)))?;
            let extent = DVec2::from_array(row.extent_km) * 1000.0;
            let (margin, share) = ctx.profile.pick((0.25, 1.0), (0.0, 0.5));
            let tolerance = TOLERANCES.iter().find(|(name, _)| *name == scene.name).map_or(0.0, |(_, metres)| *metres);
            let tolerance = share * tolerance;
            let (low, high) = (extent * margin, extent * (1.0 - margin));
            Ok(Ground { scene, low, high, tolerance })
        })
        .collect()
}

/// Samples a side of the coarsest regular mesh, of sides 2^(k/8), in which no point tried lies further than the tolerance
/// from the terrain, and its triangles. To prove that it has none would only make it finer.
///
/// # Errors
/// A mesh too large to make.
pub fn regular_of_equal_error(ground: &Ground) -> Result<(usize, usize), ExperimentError> {
    let program = &ground.scene.program;
    for k in 24..=104 {
        let side = libm::exp2(f64::from(k) / 8.0) as usize;
        let mesh = regular(program, [ground.low, ground.high], [side, side]).map_err(ExperimentError::failed)?;
        if !refuted(program, &mesh, ground.tolerance) {
            return Ok((side, mesh.triangles.len()));
        }
    }
    Err(ExperimentError::failed("no regular mesh of up to 8192 samples a side is good enough"))
}

/// The control: the triangles around the middle vertex are proved good, and with that vertex raised by twice the tolerance
/// they are refuted.
pub fn moved_vertex_is_noticed(program: &Program, mesh: &Mesh, tolerance: f64, budget: u32) -> bool {
    let vertex = mesh.positions.len() as u32 / 2;
    let mut around = mesh.clone();
    around.triangles.retain(|triangle| triangle.contains(&vertex));
    if around.triangles.is_empty() || !certify(program, &around, tolerance, budget).holds() {
        return false;
    }
    around.positions[vertex as usize][2] += 2.0 * tolerance;
    let found = certify(program, &around, tolerance, budget);
    found.open.len() == around.triangles.len() && found.at_least > tolerance
}

/// The sides of the triangles from above, north up, black on white.
///
/// # Errors
/// A file that cannot be written.
pub fn draw(ctx: &Context, name: &str, ground: &Ground, mesh: &Mesh) -> Result<PngFile, ExperimentError> {
    const SIDE: u32 = 800;
    let last = f64::from(SIDE - 1);
    let mut pixels = vec![255u8; (3 * SIDE * SIDE) as usize];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|index| {
            let [x, y, _] = mesh.positions[index as usize];
            let share = (DVec2::new(x, y) - ground.low) / (ground.high - ground.low);
            DVec2::new(share.x, 1.0 - share.y) * last
        });
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let steps = (to - from).abs().max_element().ceil().max(1.0);
            for step in 0..=steps as u32 {
                let p = from + (to - from) * (f64::from(step) / steps) + 0.5;
                let at = 3 * (p.y as usize * SIDE as usize + p.x as usize);
                pixels[at..at + 3].fill(0);
            }
        }
    }
    ctx.write_png(name, SIDE, SIDE, &pixels)
}
