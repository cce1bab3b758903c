//! `terrain diffuse`: feature curves diffused to a terrain, and its layers (Hnaidi 2010).

use super::{VerbError, print};
use crate::landscapes;
use clap::{Args, ValueEnum};
use glam::DVec2;
use std::path::{Path, PathBuf};
use terrain_diffusion::detail::detail;
use terrain_diffusion::fields::{Fields, Settings, Solver, diffuse};
use terrain_diffusion::landscape::Landscape;
use terrain_diffusion::raster::Domain;
use terrain_diffusion::solver::krylov::Stop;
use terrain_gpu::context::Context;
use terrain_gpu::diffusion::Diffuser;
use terrain_model::grid::{Crs, Grid};
use terrain_model::io::write_grid;

/// Diffuses feature curves to a raster (.tif, .asc, .hgt, .png, .raw, .r32, .r16, .exr) or a mesh (.ply, .obj, .glb).
///
/// The raster is the terrain: the diffused elevation and the detail on it. A solve that does not meet a tolerance that was
/// asked for is said, and ends with status 1 after the files are written.
#[derive(Args, Debug)]
pub struct Diffuse {
    /// A file of feature curves, text (.ron) or compact, or `builtin:NAME` for an embedded landscape
    curves: String,
    /// Nodes along the longer side
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=16_384))]
    size: u32,
    /// How fields are solved for: `paper` and `corrected` run the paper's iterations, the others converge
    #[arg(long, value_name = "NAME", default_value = "multigrid", value_parser = solver)]
    solver: Solver,
    /// Relative residual of every field [default: 1e-8]
    #[arg(long, value_name = "X", value_parser = tolerance)]
    tolerance: Option<f64>,
    /// Where fields are solved for; curves are drawn and detail is added on the processor
    #[arg(long, value_enum, default_value = "cpu")]
    backend: Backend,
    /// The adapter, by any part of its name [default: TERRAIN_ADAPTER, or the fastest kind there is]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Writes each layer beside FILE as well: NAME-smooth, -detail, -amplitude, -roughness, -gradient (metres up for a metre
    /// along the direction), -direction-x, -direction-y
    #[arg(long)]
    layers: bool,
    /// The file to write; its extension is the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Where fields are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// On the processor
    Cpu,
    /// On a graphics adapter: to the same residual, measured in double precision; `paper` and `corrected` in single precision
    Gpu,
}

fn solver(name: &str) -> Result<Solver, String> {
    let known = || Solver::ALL.map(Solver::name).join(", ");
    Solver::ALL.into_iter().find(|solver| solver.name() == name).ok_or_else(|| format!("expected one of {}", known()))
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| *x > 0.0 && *x < 1.0);
    number.ok_or_else(|| "expected a number above 0 and below 1, such as 1e-8".to_owned())
}

impl Diffuse {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: curves that are none or hold no elevation, a file that cannot be written, a tolerance that was not met.
    pub fn run(&self) -> Result<(), VerbError> {
        let landscape = landscapes::load(&self.curves).map_err(VerbError::Other)?;
        let default = Stop::default();
        let stop = Stop { relative_residual: self.tolerance.unwrap_or(default.relative_residual), ..default };
        let settings = Settings { solver: self.solver, stop, whole_gradient: self.layers, ..Settings::default() };
        let domain = landscape.domain(self.size as usize);
        let fields = self.solve(&landscape, domain, &settings)?;
        let noise = landscape.frame().detail;
        let detail = detail(&domain, &fields.amplitude, &fields.roughness, |p, a, r| noise.at(p, a, r));
        let terrain: Vec<f64> = fields.elevation.iter().zip(&detail).map(|(smooth, detail)| smooth + detail).collect();
        let written = write(&self.out, &fields, &terrain)?;
        if self.layers {
            self.write_layers(&fields, &detail)?;
        }
        self.say(&landscape, &fields, &written)?;
        self.check(&fields)
    }

    fn solve(&self, landscape: &Landscape, domain: Domain, settings: &Settings) -> Result<Fields, VerbError> {
        let other = |error: &dyn std::fmt::Display| VerbError::Other(error.to_string());
        let solved = if self.backend == Backend::Gpu {
            let context = Context::new(self.adapter.as_deref()).map_err(|error| other(&error))?;
            let diffuser = Diffuser::new(&context).map_err(|error| other(&error))?;
            print(&format!("on {}", context.description().name))?;
            diffuser.diffuse(landscape.curves(), domain, settings)
        } else {
            diffuse(landscape.curves(), domain, settings)
        };
        solved.map_err(|error| VerbError::Other(format!("{}: {error}", self.curves)))
    }

    fn write_layers(&self, fields: &Fields, detail: &[f64]) -> Result<(), VerbError> {
        let part = |k: usize| fields.gradient.iter().map(|value| f64::from(value[k])).collect::<Vec<f64>>();
        let layers: [(&str, &[f64]); 7] = [
            ("smooth", &fields.elevation),
            ("detail", detail),
            ("amplitude", &fields.amplitude),
            ("roughness", &fields.roughness),
            ("gradient", &part(0)),
            ("direction-x", &part(1)),
            ("direction-y", &part(2)),
        ];
        for (name, values) in layers {
            write(&beside(&self.out, name), fields, values)?;
        }
        Ok(())
    }

    fn say(&self, landscape: &Landscape, fields: &Fields, written: &Grid<f32>) -> Result<(), VerbError> {
        for report in &fields.reports {
            let (field, iterations, residual) = (report.field, report.iterations, report.relative_residual);
            print(&format!("{field}: {iterations} iterations, relative residual {residual:.1e}"))?;
        }
        let range = written.min_max().map_or(String::new(), |(low, high)| format!(", {low} to {high} m"));
        let domain = fields.domain;
        print(&format!(
            "{}: {} curves, {} × {} nodes, {} m apart{range}",
            self.out.display(),
            landscape.curves().len(),
            domain.width,
            domain.height,
            domain.spacing,
        ))
    }

    /// The paper's iterations are given: only a tolerance that was asked for is held against them.
    fn check(&self, fields: &Fields) -> Result<(), VerbError> {
        let given = matches!(self.solver, Solver::Paper | Solver::Corrected);
        let Some(limit) = self.tolerance.or((!given).then_some(Stop::default().relative_residual)) else {
            return Ok(());
        };
        let missed =
            fields.reports.iter().find(|report| report.relative_residual.is_nan() || report.relative_residual > limit);
        missed.map_or(Ok(()), |report| {
            let mend = if given { "use --solver multigrid, or leave --tolerance out" } else { "use a larger --tolerance" };
            Err(VerbError::Other(format!(
                "{}: written, but {} is left with a relative residual of {:.1e} after {} iterations, above {limit:e}; {mend}",
                self.out.display(),
                report.field,
                report.relative_residual,
                report.iterations,
            )))
        })
    }
}

fn write(path: &Path, fields: &Fields, values: &[f64]) -> Result<Grid<f32>, VerbError> {
    let domain = fields.domain;
    let values = values.iter().map(|value| *value as f32).collect();
    let grid = Grid::new(domain.origin, DVec2::splat(domain.spacing), domain.width, domain.height, values)
        .map_err(|error| VerbError::Other(error.to_string()))?;
    let grid = grid.with_crs(Some(Crs::local_metres()));
    write_grid(path, &grid)?;
    Ok(grid)
}

/// `folder/NAME-layer.extension` of `folder/NAME.extension`.
fn beside(path: &Path, layer: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{layer}.{extension}"))
}
