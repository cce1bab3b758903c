//! What the figures show: the mountain of the diffusion paper as a coarse raster, and the walls of a canyon. The paper's own elevations
//! of Puget Sound are not shipped.

use super::picture::{Look, Picture, Scene};
use crate::experiment::{Context, ExperimentError};
use crate::hnaidi2010::models;
use crate::report;
use glam::DVec3;
use terrain_diffusion::fields::{Settings, Solver};
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::FINEST;
use terrain_gpu::tessellate::view::View;
use terrain_model::grid::Grid;
use terrain_model::noise::Octaves;

/// The mountain, so many nodes along each side, its detail left out: that is what tessellation adds.
pub fn mountain(nodes: usize) -> Result<Grid<f64>, ExperimentError> {
    let landscape = models::load("mountain")?;
    let domain = landscape.domain(nodes);
    let settings = Settings { solver: Solver::Variational, ..Settings::default() };
    let (fields, _) = models::terrain(&landscape, domain, &settings)?;
    let spacing = glam::DVec2::splat(domain.spacing);
    Grid::new(glam::DVec2::ZERO, spacing, domain.width, domain.height, fields.elevation)
        .map_err(ExperimentError::failed)
}

/// A canyon of 1.1 km with walls of 70°, 8 m between samples.
pub fn canyon() -> Result<Grid<f64>, ExperimentError> {
    let grid = crate::paris2019::landscapes::canyon(8.0, 1)?;
    let values = grid.values().iter().map(|z| f64::from(*z)).collect();
    grid.with_values(values, None).map_err(ExperimentError::failed)
}

/// The paper's six octaves, the first as long as two samples, at most `amplitude` samples high; less on level and on low ground.
pub fn detail(ground: &Ground, amplitude: f64, space: Space) -> Result<Detail, ExperimentError> {
    let spacing = ground.spacing()[0];
    let octaves =
        Octaves { octaves: 6, frequency: 0.5 / spacing, lacunarity: 2.0, gain: 0.5, amplitude: amplitude * spacing };
    let mut detail = Detail::new(&octaves, 3, space).ok_or_else(|| ExperimentError::failed("octaves are not sound"))?;
    (detail.floor, detail.elevation) = ([0.3, 0.5], ground.range());
    Ok(detail)
}

/// A camera for a picture of `size`: eye and target as shares of the ground's sides, metres above the displaced ground there.
pub fn looking(
    (ground, detail): (&Ground, &Detail),
    eye: [f64; 3],
    target: [f64; 3],
    size: [usize; 2],
) -> Result<View, ExperimentError> {
    let [x, y] = ground.extent();
    let placed =
        |p: [f64; 3]| DVec3::new(p[0] * x, p[1] * y, detail.elevation_over(ground, [p[0] * x, p[1] * y]) + p[2]);
    let (eye, target) = (placed(eye), placed(target));
    let half = size.map(|n| 0.5 * n as f64);
    View::new(eye.to_array(), (target - eye).to_array(), 1.2 * half[0], half)
        .ok_or_else(|| ExperimentError::failed("a camera looks straight down"))
}

/// Draws with edges of `edge` pixels and writes the file `name`.
pub fn shoot(
    ctx: &Context,
    (ground, detail, look): (&Ground, &Detail, &Look),
    view: View,
    edge: f64,
    (name, caption): (&str, &str),
) -> Result<(report::Picture, Picture), ExperimentError> {
    let size = view.half.map(|half| (2.0 * half) as usize);
    let refinement = Refinement::new(ground, detail, view, edge, FINEST);
    let drawn = Scene { ground, detail, view, refinement, look: look.clone() }.picture(size);
    let file = ctx.write_png(name, size[0] as u32, size[1] as u32, &drawn.pixels)?;
    let [x, y, z] = view.eye;
    let picture = report::Picture::new(file, caption).camera(format!("from ({x:.0}, {y:.0}, {z:.0}) m")).seed(3);
    Ok((picture, drawn))
}

/// Columns and rows of pictures.
pub fn size(ctx: &Context) -> [usize; 2] {
    ctx.profile.pick([640, 360], [1920, 1080])
}
