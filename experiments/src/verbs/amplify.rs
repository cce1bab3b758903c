//! `terrain amplify`: a heightfield with the landforms of a recipe, as a closed mesh with its rock and stress.

use super::{VerbError, positive, print, progress, write_bytes};
use clap::Args;
use glam::{DVec2, DVec3};
use serde::Serialize;
use std::path::{Path, PathBuf};
use terrain_amplify::landform::raster::bilinear;
use terrain_amplify::polygonize::check::Census;
use terrain_amplify::polygonize::{Lattice, Polygonizer, Report};
use terrain_amplify::recipe::{Amplified, Pantry, Recipe, amplify};
use terrain_model::grid::Grid;
use terrain_model::io::{read_grid, write_grid, write_mesh};
use terrain_model::mesh::{Attribute, Mesh};

/// Gives a raster (.tif, .asc, .hgt, .png, .raw, .exr) the landforms of a recipe (terrain-recipe/1): sea cliffs, canyons, karst,
/// hoodoos, brush strokes. Writes a closed mesh (.glb, .ply, .obj).
///
/// The same raster, recipe and seed give the same mesh on any number of threads.
#[derive(Args, Debug)]
pub struct Amplify {
    /// The raster, elevations in metres
    input: PathBuf,
    /// The recipe; the files it names are relative to it
    #[arg(long, value_name = "FILE")]
    recipe: PathBuf,
    /// Tells this terrain from others of the recipe
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Side of the cubes, metres [default: the samples' spacing]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    cell: Option<f64>,
    /// Vertices lie this near to the surface along their edges, metres [default: a hundredth of a cell]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    tolerance: Option<f64>,
    /// The file to write; its extension is the format. Vertices of .glb and .ply carry resistance and stress
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// What was made, as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// A folder for the maps stress.tif, resistance.tif and effects.tif
    #[arg(long, value_name = "FOLDER")]
    maps: Option<PathBuf>,
}

/// What was made, as `--report` writes it.
#[derive(Serialize)]
struct Account<'a> {
    recipe: &'a Recipe,
    seed: u32,
    landforms: Vec<Landform>,
    primitives: usize,
    primitive_bytes: usize,
    index_bytes: usize,
    coverage: f64,
    cell_metres: f64,
    tolerance_metres: f64,
    vertices: usize,
    triangles: usize,
    evaluations: u64,
    ground_lookups: u64,
    holes: u64,
    non_manifold_edges: u64,
}

#[derive(Serialize)]
struct Landform {
    name: &'static str,
    primitives: usize,
}

/// Files beside the recipe.
struct Beside<'a> {
    folder: &'a Path,
    ground: &'a Grid<f32>,
}

impl Pantry for Beside<'_> {
    /// A picture says nothing of its place: it is spread over the ground.
    fn raster(&mut self, name: &str) -> Result<Grid<f32>, String> {
        let path = self.folder.join(name);
        let grid = read_grid(&path).map_err(|error| error.to_string())?;
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
            return Ok(grid);
        }
        let (low, high) = self.ground.bounds();
        let gaps = DVec2::new(grid.width() as f64 - 1.0, grid.height() as f64 - 1.0).max(DVec2::ONE);
        let (width, height) = (grid.width(), grid.height());
        let placed = Grid::new(low, (high - low) / gaps, width, height, grid.values().to_vec());
        placed.map_err(|error| error.to_string())
    }
    fn text(&mut self, name: &str) -> Result<String, String> {
        std::fs::read_to_string(self.folder.join(name)).map_err(|error| error.to_string())
    }
}

impl Amplify {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: input that is no raster or recipe, parameters out of their ranges, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        let extension = self.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("ply" | "obj" | "glb")) {
            // Before the work, and with the words of the writer.
            write_mesh(&self.out, &Mesh::default())?;
        }
        let named = |problem: String| VerbError::Other(format!("{}: {problem}", self.recipe.display()));
        let text = std::fs::read_to_string(&self.recipe).map_err(|error| named(error.to_string()))?;
        let recipe = Recipe::parse(&text).map_err(|error| named(error.to_string()))?;
        let grid = read_grid(&self.input)?;
        let cell = self.cell.unwrap_or(grid.spacing().max_element());
        let folder = self.recipe.parent().unwrap_or(Path::new(""));
        let bar = progress(recipe.landforms.len() as u64 + 1, "landforms");
        let mut beside = Beside { folder, ground: &grid };
        let amplified = amplify(&grid, &recipe, &mut beside, self.seed, |k, _| bar.set_position(k as u64));
        let amplified = amplified.map_err(|error| named(error.to_string()))?;
        bar.set_position(recipe.landforms.len() as u64);
        let (mesh, report, tolerance) = self.mesh(&amplified, cell)?;
        bar.finish_and_clear();
        let census = Census::of(&mesh);
        write_mesh(&self.out, &mesh)?;
        if let Some(folder) = &self.maps {
            let failed = |error: std::io::Error| VerbError::Other(format!("{}: {error}", folder.display()));
            std::fs::create_dir_all(folder).map_err(failed)?;
            let maps = amplified.maps(&grid);
            for (name, map) in [("stress", maps.stress), ("resistance", maps.resistance), ("effects", maps.effects)] {
                write_grid(&folder.join(name).with_extension("tif"), &map)?;
            }
        }
        let [primitive_bytes, index_bytes] = amplified.bytes();
        let account = Account {
            recipe: &recipe,
            seed: self.seed,
            landforms: amplified
                .made
                .iter()
                .map(|made| Landform { name: made.landform, primitives: made.primitives })
                .collect(),
            primitives: amplified.index.primitives().len(),
            primitive_bytes,
            index_bytes,
            coverage: amplified.coverage(&grid, cell),
            cell_metres: cell,
            tolerance_metres: tolerance,
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            evaluations: report.evaluations(),
            ground_lookups: report.lookups,
            holes: census.holes,
            non_manifold_edges: census.non_manifold_edges,
        };
        if let Some(path) = &self.report {
            let text = serde_json::to_string_pretty(&account).map_err(|error| VerbError::Other(error.to_string()))?;
            write_bytes(path, text.as_bytes())?;
        }
        let landforms: Vec<String> = account.landforms.iter().map(|l| format!("{} {}", l.primitives, l.name)).collect();
        print(&format!(
            "{}: {} vertices, {} triangles, {}; primitives: {}; {:.1} % of the ground",
            self.out.display(),
            account.vertices,
            account.triangles,
            if census.is_closed() { "closed".to_owned() } else { format!("{} holes", census.holes) },
            landforms.join(", "),
            100.0 * account.coverage,
        ))
    }

    fn mesh(&self, amplified: &Amplified, cell: f64) -> Result<(Mesh, Report, f64), VerbError> {
        let other = |error: terrain_amplify::polygonize::PolygonizeError| VerbError::Other(error.to_string());
        let lattice = Lattice::over(&amplified.support(), cell).map_err(other)?;
        let tolerance = self.tolerance.unwrap_or(0.01 * cell);
        let polygonizer = Polygonizer::new(&amplified.volume, lattice, tolerance).map_err(other)?;
        let (mut mesh, report) = polygonizer.sparse().map_err(other)?;
        let at = |f: &dyn Fn(DVec3) -> f64| mesh.positions.iter().map(|p| f(DVec3::from_array(*p)) as f32).collect();
        let resistance: Vec<f32> = at(&|p| amplified.geology.value(p));
        let stress: Vec<f32> = at(&|p| bilinear(&amplified.stress, p.truncate()));
        mesh.attributes.push(Attribute { name: "resistance".to_owned(), values: resistance });
        mesh.attributes.push(Attribute { name: "stress".to_owned(), values: stress });
        Ok((mesh, report, tolerance))
    }
}
