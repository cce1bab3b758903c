//! `terrain mesh`: a layer as a regular mesh, or as one that is proved to lie within a distance of the terrain.

use super::{Rectangle, SceneArguments, Size, VerbError, positive, print};
use clap::{ArgGroup, Args, ValueEnum};
use glam::DVec2;
use std::path::PathBuf;
use terrain_model::io::write_mesh;
use terrain_model::mesh::adaptive::{self, Adaptive, adaptive};
use terrain_model::mesh::regular::regular;
use terrain_model::mesh::tin::{self, Tin, tin};
use terrain_model::mesh::{self, MeshError};

/// Levels of an adaptive mesh: its smallest cells are 1/4096 of the extent.
const FINEST: u32 = 12;
/// Across the border of the terrain, triangles of a network have no longer sides than this share of the extent.
const BORDER: f64 = 1.0 / 1024.0;
/// The most vertices of a network.
const VERTICES: usize = 1 << 22;

/// Meshes a layer (.ply, .obj, .glb): regular with --size, or adaptive or irregular (tin) with --error.
///
/// Vertices lie on the terrain. With --error every triangle is proved to lie within so many metres of it, straight up and
/// down; triangles for which no proof is found are counted in the line that is printed. A triangle is kept when its three
/// corners lie on the terrain, where the weight is at least 1/2.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("fineness").required(true).args(["size", "error"])))]
pub struct Mesh {
    #[command(flatten)]
    scene: SceneArguments,
    /// What kind of mesh [default: regular with --size, adaptive with --error]
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// Samples of a regular mesh from west to east and from south to north, at least 2 each; N is NxN
    #[arg(long, value_name = "N[xM]", value_parser = at_least_two)]
    size: Option<Size>,
    /// Largest vertical distance of an adaptive mesh or a network from the terrain
    #[arg(long, value_name = "METRES", value_parser = positive)]
    error: Option<f64>,
    /// South-west and north-east corners, metres [default: a box around all that has weight]
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    extent: Option<Rectangle>,
    /// The file to write; its extension is the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Samples at equal distances
    Regular,
    /// Squares of several sizes, cut into triangles without cracks
    Adaptive,
    /// A triangulated irregular network: the fewest triangles, the most work
    Tin,
}

fn at_least_two(text: &str) -> Result<Size, String> {
    let size: Size = text.parse()?;
    if size.width < 2 || size.height < 2 { Err("expected at least 2 samples a side".to_owned()) } else { Ok(size) }
}

impl Mesh {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: the scene, an extent without terrain, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        let refuse = |error: MeshError| VerbError::Other(error.to_string());
        let extension = self.out.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("ply" | "obj" | "glb")) {
            // Before the work, and with the words of the writer.
            write_mesh(&self.out, &mesh::Mesh::default())?;
        }
        let (_, program) = self.scene.load()?;
        let (low, high) = match self.extent {
            Some(extent) => (extent.low, extent.high),
            None => self.scene.support(&program)?,
        };
        let (mesh, found) = match (self.kind, self.size, self.error) {
            (None | Some(Kind::Regular), Some(Size { width, height }), _) => {
                (regular(&program, [low, high], [width, height]).map_err(refuse)?, String::new())
            }
            (None | Some(Kind::Adaptive), _, Some(tolerance)) => {
                let budget = adaptive::Settings::BUDGET;
                let settings = adaptive::Settings { low, high, tolerance, finest: FINEST, budget };
                let Adaptive { mesh, at_most, at_least, open, .. } = adaptive(&program, &settings).map_err(refuse)?;
                (mesh, proved(tolerance, at_most, at_least, open.len()))
            }
            (Some(Kind::Tin), _, Some(tolerance)) => {
                let border = (high - low).max_element() * BORDER;
                let budget = tin::Settings::BUDGET;
                let settings = tin::Settings { low, high, tolerance, border, vertices: VERTICES, budget };
                let Tin { mesh, at_most, at_least, open } = tin(&program, &settings).map_err(refuse)?;
                (mesh, proved(tolerance, at_most, at_least, open.len()))
            }
            (Some(Kind::Regular), None, _) => {
                return Err(VerbError::Other("--kind regular: expected --size N[xM] instead of --error".to_owned()));
            }
            (Some(Kind::Adaptive | Kind::Tin), _, None) | (None, None, None) => {
                let problem = "this kind of mesh is made to a distance: expected --error METRES instead of --size";
                return Err(VerbError::Other(problem.to_owned()));
            }
        };
        if mesh.triangles.is_empty() {
            let problem =
                "no triangle lies on the terrain; choose another --extent, a larger --size or a smaller --error";
            return Err(VerbError::Other(format!("{}: {problem}", self.scene.scene)));
        }
        let mesh = mesh.with_normals();
        write_mesh(&self.out, &mesh)?;
        let DVec2 { x, y } = high - low;
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        print(&format!("{}: {vertices} vertices, {triangles} triangles over {x} × {y} m{found}", self.out.display()))
    }
}

/// What is known of the distance, in words.
fn proved(tolerance: f64, at_most: f64, at_least: f64, open: usize) -> String {
    if open == 0 {
        format!(", proved to lie within {at_most} m of the terrain; {at_least} m is reached")
    } else {
        format!(
            ", of which {open} are not proved to lie within {tolerance} m of the terrain: within {at_most} m is; {at_least} m \
             is reached"
        )
    }
}
