//! `terrain bake`: a layer sampled to a raster, or to the mesh through its samples.

use super::{Rectangle, SceneArguments, Size, VerbError, print};
use clap::Args;
use glam::DVec2;
use std::path::PathBuf;
use terrain_model::bounds::THRESHOLD;
use terrain_model::grid::{Crs, Grid};
use terrain_model::io::{exr, write_grid};

/// Samples a layer to a raster (.tif, .asc, .hgt, .png, .raw, .r32, .r16, .exr) or a mesh (.ply, .obj, .glb).
///
/// The outer samples lie on the border of the region. Where the weight is below 1/2 there is no terrain: no-data. An .exr
/// holds the elevation and, as a second layer, the weight.
#[derive(Args, Debug)]
pub struct Bake {
    #[command(flatten)]
    scene: SceneArguments,
    /// Samples from west to east and from south to north, at least 2 each; N is NxN
    #[arg(long, value_name = "N[xM]")]
    size: Size,
    /// South-west and north-east corners, metres [default: a box around all that has weight]
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    region: Option<Rectangle>,
    /// The file to write; its extension is the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Bake {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: the scene, a region without terrain, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        let other = |line: String| VerbError::Other(line);
        let Size { width, height } = self.size;
        if width < 2 || height < 2 {
            return Err(other(format!("--size {width}x{height}: expected at least 2 samples a side")));
        }
        let (_, program) = self.scene.load()?;
        let (low, high) = match self.region {
            Some(region) => (region.low, region.high),
            None => self.scene.support(&program)?,
        };
        let spacing = (high - low) / DVec2::new((width - 1) as f64, (height - 1) as f64);
        let baked = program.bake(low, spacing, width, height);

        let on_terrain = |weight: f32| f64::from(weight) >= THRESHOLD;
        let pairs = || baked.elevation.iter().copied().zip(baked.weight.iter().copied());
        let lowest = pairs().filter(|pair| on_terrain(pair.1)).fold(f32::INFINITY, |low, pair| low.min(pair.0));
        if lowest == f32::INFINITY {
            let problem = "no sample lies on the terrain; choose another --region or a larger --size";
            return Err(other(format!("{}: {problem}", self.scene.scene)));
        }
        // The marker of 16-bit formats, unless the terrain is deeper.
        let no_data = if lowest > -32768.0 { -32768.0 } else { f32::MIN };
        let values: Vec<f32> = pairs().map(|(z, weight)| if on_terrain(weight) { z } else { no_data }).collect();
        let known = values.iter().filter(|z| **z != no_data).count();
        let grid = Grid::new(low, spacing, width, height, values).map_err(|error| other(error.to_string()))?;
        let grid = grid.with_no_data(Some(no_data)).with_crs(Some(Crs::local_metres()));
        write_grid(&self.out, &grid)?;
        if self.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
            // The same elevations again, beside the weight: the sidecar that was just written stays true.
            let layers = [(exr::ELEVATION, grid.values()), ("weight", &baked.weight[..])];
            exr::write_layers(&self.out, width, height, &layers)?;
        }
        let range = grid.min_max().map_or(String::new(), |(lo, hi)| format!(", {lo} to {hi} m"));
        let share = 100.0 * known as f64 / (width * height) as f64;
        print(&format!(
            "{}: {width} × {height} samples, {} × {} m apart{range}, {share:.1} % on the terrain",
            self.out.display(),
            spacing.x,
            spacing.y,
        ))
    }
}
