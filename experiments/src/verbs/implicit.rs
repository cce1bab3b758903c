//! `terrain implicit`: a raster or a construction tree as a solid, with its caves and overhangs, as a closed mesh.

use super::{VerbError, numbers, positive, print};
use clap::{Args, ValueEnum};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use terrain_amplify::brush;
use terrain_amplify::field::{Box3, Density};
use terrain_amplify::geology::{Archetype, Geology, archetype};
use terrain_amplify::implicit::heightfield::Implicitisation;
use terrain_amplify::implicit::index::Index;
use terrain_amplify::implicit::surface::Distance;
use terrain_amplify::implicit::volume::{Volume, file};
use terrain_amplify::polygonize::check::Census;
use terrain_amplify::polygonize::{Lattice, Polygonizer};
use terrain_model::io::{read_grid, write_mesh};
use terrain_model::mesh::{Attribute, Mesh};

/// Makes a solid of a raster (.tif, .asc, .hgt, .png, .raw, .exr) or of a construction tree (.ron, terrain-volume/1), and
/// writes it as a closed mesh (.glb, .ply, .obj).
///
/// Rasters of other tools come in as they are; a feature tree through `terrain bake`, curves through `terrain diffuse`.
#[derive(Args, Debug)]
pub struct Implicit {
    /// The raster or the tree
    input: PathBuf,
    /// Side of the cubes, metres [default: the samples' spacing; needed for a tree]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    cell: Option<f64>,
    /// Falloff of a raster's surface, metres [default: two cells]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    radius: Option<f64>,
    /// Elevation of a raster's floor, metres [default: twice the falloff below the lowest sample]
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    floor: Option<f64>,
    /// The distance to a raster's surface
    #[arg(long, value_enum, default_value = "normalised")]
    distance: Measure,
    /// Brush strokes to draw on it (.ron)
    #[arg(long, value_name = "FILE")]
    strokes: Option<PathBuf>,
    /// Rock whose resistance each vertex gets (.glb and .ply): a file (terrain-geology/1) or the name of an archetype
    #[arg(long, value_name = "FILE|NAME")]
    geology: Option<String>,
    /// Vertices lie this near to the surface along their edges, metres [default: a hundredth of a cell]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    tolerance: Option<f64>,
    /// The part to mesh, lower and upper corner, metres [default: all]
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true)]
    part: Option<Part>,
    /// The file to write; its extension is the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Measure {
    /// Straight down, as the paper has it
    Vertical,
    /// Divided by the steepness around
    Normalised,
}

/// A box.
#[derive(Clone, Copy, Debug)]
struct Part(Box3);

impl FromStr for Part {
    type Err = String;
    fn from_str(text: &str) -> Result<Part, String> {
        let [x0, y0, z0, x1, y1, z1] = numbers(text)?;
        let part = Box3 { low: DVec3::new(x0, y0, z0), high: DVec3::new(x1, y1, z1) };
        if part.low.cmplt(part.high).all() {
            Ok(Part(part))
        } else {
            Err("expected the lower corner, then the upper: X0 < X1, Y0 < Y1 and Z0 < Z1".to_owned())
        }
    }
}

/// Text of a file, or a line that names it.
fn read_text(path: &Path) -> Result<String, VerbError> {
    std::fs::read_to_string(path).map_err(|error| VerbError::Other(format!("{}: {error}", path.display())))
}

impl Implicit {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: input that is no volume, settings that do not fit it, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        let extension = |path: &Path| path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension(&self.out).as_deref(), Some("ply" | "obj" | "glb")) {
            // Before the work, and with the words of the writer.
            write_mesh(&self.out, &Mesh::default())?;
        }
        let geology = self.geology.as_deref().map(rock).transpose()?;
        let (mut volume, cell) = match extension(&self.input).as_deref() {
            Some("ron") => self.tree()?,
            _ => self.raster()?,
        };
        if let Some(path) = &self.strokes {
            volume = drawn(volume, path)?;
        }
        let region = self.part.map_or_else(|| volume.support(), |part| part.0);
        if !(region.low.is_finite() && region.high.is_finite()) || region.is_empty() {
            let problem = "the volume has no end in some direction or holds nothing: choose a --box";
            return Err(VerbError::Other(format!("{}: {problem}", self.input.display())));
        }
        let other = |error: terrain_amplify::polygonize::PolygonizeError| VerbError::Other(error.to_string());
        let lattice = match self.part {
            // The border of a part is a wall of the mesh.
            Some(part) => {
                let cells = ((part.0.high - part.0.low) / cell).ceil().max(DVec3::ONE);
                Lattice::new(part.0.low, cell, cells.to_array().map(|n| n as usize)).map_err(other)?
            }
            None => Lattice::over(&region, cell).map_err(other)?,
        };
        let tolerance = self.tolerance.unwrap_or(0.01 * cell);
        let polygonizer = Polygonizer::new(&volume, lattice, tolerance).map_err(other)?;
        let (mut mesh, report) = polygonizer.sparse().map_err(other)?;
        if mesh.triangles.is_empty() {
            let problem = "no rock in the part to mesh; choose another --box or a smaller --cell";
            return Err(VerbError::Other(format!("{}: {problem}", self.input.display())));
        }
        if let Some(geology) = geology {
            let values = mesh.positions.iter().map(|p| geology.value(DVec3::from_array(*p)) as f32).collect();
            mesh.attributes.push(Attribute { name: "resistance".to_owned(), values });
        }
        let census = Census::of(&mesh);
        let unproved = polygonizer.unproved_vertices(&mesh);
        write_mesh(&self.out, &mesh)?;
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        let sound = if census.is_closed() && unproved == 0 {
            format!("closed, vertices within {tolerance} m of the surface along their edges")
        } else {
            format!("{} holes, {unproved} vertices not proved near the surface", census.holes)
        };
        print(&format!(
            "{}: {vertices} vertices, {triangles} triangles, {sound}; {} values of the field, {} of bare ground",
            self.out.display(),
            report.evaluations(),
            report.lookups,
        ))
    }

    fn raster(&self) -> Result<(Volume, f64), VerbError> {
        let grid = read_grid(&self.input)?;
        let cell = self.cell.unwrap_or(grid.spacing().max_element());
        let made = Implicitisation::of(&grid, self.radius.unwrap_or(2.0 * cell));
        let distance = match self.distance {
            Measure::Vertical => Distance::Vertical,
            Measure::Normalised => Distance::Normalised,
        };
        let settings = Implicitisation { distance, floor: self.floor.unwrap_or(made.floor), ..made };
        let volume = settings.volume(&grid);
        let volume = volume.map_err(|error| VerbError::Other(format!("{}: {error}", self.input.display())))?;
        Ok((volume, cell))
    }

    fn tree(&self) -> Result<(Volume, f64), VerbError> {
        let named = |problem: String| VerbError::Other(format!("{}: {problem}", self.input.display()));
        if self.radius.is_some() || self.floor.is_some() {
            return Err(named("--radius and --floor are for rasters: the tree's grounds state theirs".to_owned()));
        }
        let cell = self.cell.ok_or_else(|| named("expected --cell METRES for a tree".to_owned()))?;
        let text = read_text(&self.input)?;
        let folder = self.input.parent().unwrap_or(Path::new("")).to_owned();
        let mut rasters = |name: &str| read_grid(&folder.join(name)).map_err(|error| error.to_string());
        let tree = file::parse(&text).map_err(|error| named(error.to_string()))?;
        Ok((tree.build(&mut rasters).map_err(|error| named(error.to_string()))?, cell))
    }
}

/// A geology from a file, or an archetype by its name.
fn rock(name: &str) -> Result<Geology, VerbError> {
    if let Some(known) = archetype(name) {
        return Ok(known.geology());
    }
    let path = Path::new(name);
    if !path.exists() {
        let names = Archetype::ALL.map(Archetype::name).join(", ");
        return Err(VerbError::Other(format!("--geology {name}: neither a file nor one of {names}")));
    }
    Geology::parse(&read_text(path)?).map_err(|error| VerbError::Other(format!("{name}: {error}")))
}

/// The volume with the strokes of a file.
fn drawn(volume: Volume, path: &Path) -> Result<Volume, VerbError> {
    let named = |problem: String| VerbError::Other(format!("{}: {problem}", path.display()));
    let mut made = Vec::new();
    for (k, stroke) in brush::parse(&read_text(path)?).map_err(|error| named(error.to_string()))?.iter().enumerate() {
        made.extend(stroke.primitives().map_err(|error| named(format!("stroke {k}: {error}")))?);
    }
    let index = Index::new(made).map_err(|k| named(format!("primitive {k} is not sound")))?;
    Ok(Volume::Blend(vec![volume, Volume::Primitives(index.into())]))
}
