//! `terrain info`: what a scene or a raster holds.

use super::{SceneArguments, VerbError, print, sampled_extent};
use crate::scenes::BUILTIN;
use clap::Args;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::path::Path;
use terrain_model::bounds::Region;
use terrain_model::grid::Grid;
use terrain_model::io::read_grid;

/// Samples along a side of the raster that the range of elevations is taken from.
const SIDE: usize = 256;

/// Says what a scene or a raster holds.
///
/// Of a scene: layers and cameras; of each layer its primitives and operators (shared ones once), bytes of the compiled
/// program and of what only accelerates it, the box of its support, elevations found on 256 x 256 samples, and what its
/// bounds say over the whole support. Of a raster: size, spacing, origin, reference system, range, no-data and SHA-256
/// of the file. A bound that is infinite is null in JSON.
#[derive(Args, Debug)]
pub struct Info {
    /// A scene (.ron or `builtin:NAME`), or a raster
    #[arg(value_name = "SCENE|DEM")]
    file: String,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

impl Info {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: the scene or the raster cannot be read.
    pub fn run(&self) -> Result<(), VerbError> {
        let path = Path::new(&self.file);
        let is_scene =
            self.file.starts_with(BUILTIN) || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"));
        let facts = if is_scene { scene(&self.file)? } else { raster(path)? };
        if self.json {
            return print(&facts.to_string());
        }
        let mut lines = Vec::new();
        text(&facts, 0, &mut lines);
        print(&lines.join("\n"))
    }
}

/// JSON has no infinity: null.
fn finite(number: f64) -> Value {
    if number.is_finite() { json!(number) } else { Value::Null }
}

fn scene(file: &str) -> Result<Value, VerbError> {
    let arguments = |layer: Option<String>| SceneArguments { scene: file.to_owned(), layer };
    let scene = crate::scenes::load(file)?;
    let mut layers = serde_json::Map::new();
    for (name, root) in &scene.layers {
        let arguments = arguments(Some(name.clone()));
        let program = scene.program(name).map_err(|error| crate::scenes::located(file, "", error))?;
        let (primitives, operators) = scene.tree.count(*root);
        let (low, high) = arguments.support(&program)?;
        let bounds = program.bounds(Region::rectangle(low, high));
        layers.insert(
            name.clone(),
            json!({
                "primitives": primitives,
                "operators": operators,
                "instructions": program.code().len(),
                "bytes": program.bytes(),
                "bytes_acceleration": program.acceleration_bytes(),
                "support": [low.x, low.y, high.x, high.y],
                "elevation_sampled": sampled_extent(&program, low, high, SIDE).map(|extent| extent.elevations),
                "bounds": {
                    "elevation": [finite(bounds.elevation.lo()), finite(bounds.elevation.hi())],
                    "weight": [bounds.weight.lo(), bounds.weight.hi()],
                    "slope": finite(bounds.slope),
                    "slope_on_support": finite(bounds.support_slope),
                    "weight_slope": finite(bounds.weight_slope),
                },
            }),
        );
    }
    let cameras: serde_json::Map<String, Value> = scene
        .cameras
        .iter()
        .map(|(name, camera)| {
            let degrees = camera.field_of_view * 180.0 / std::f64::consts::PI;
            let facts = json!({
                "eye": camera.eye.to_array(),
                "target": camera.target.to_array(),
                "field_of_view_degrees": degrees,
            });
            (name.clone(), facts)
        })
        .collect();
    Ok(json!({ "scene": file, "ground": scene.ground(), "layers": layers, "cameras": cameras }))
}

fn raster(path: &Path) -> Result<Value, VerbError> {
    let grid: Grid<f32> = read_grid(path)?;
    let bytes = std::fs::read(path).map_err(|error| VerbError::Other(format!("{}: {error}", path.display())))?;
    let hash: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let (low, high) = grid.bounds();
    let crs = grid.crs().and_then(|crs| serde_json::to_value(crs.kind).ok());
    Ok(json!({
        "raster": path.display().to_string(),
        "size": [grid.width(), grid.height()],
        "spacing": grid.spacing().to_array(),
        "origin": low.to_array(),
        "far_corner": high.to_array(),
        "crs": crs,
        "metric": grid.is_metric(),
        "elevation": grid.min_max().map(|(lo, hi)| [lo, hi]),
        "no_data_share": grid.no_data_count() as f64 / grid.values().len() as f64,
        "bytes": bytes.len(),
        "sha256": hash,
    }))
}

/// An indented outline of a JSON object, with units where the key does not say them.
fn text(value: &Value, depth: usize, lines: &mut Vec<String>) {
    let Value::Object(map) = value else { return };
    for (key, value) in map {
        let indent = "  ".repeat(depth);
        let label = key.replace('_', " ");
        match value {
            Value::Object(inner) if inner.is_empty() => lines.push(format!("{indent}{label}: none")),
            Value::Object(_) => {
                lines.push(format!("{indent}{}", if depth % 2 == 1 { key } else { &label }));
                text(value, depth + 1, lines);
            }
            Value::Null if key == "crs" => lines.push(format!("{indent}{label}: not stated")),
            Value::Null => lines.push(format!("{indent}{label}: no bound")),
            Value::Array(list) => {
                let list: Vec<String> = list.iter().map(Value::to_string).collect();
                lines.push(format!("{indent}{label}: {}", list.join(" ")));
            }
            Value::String(string) => lines.push(format!("{indent}{label}: {string}")),
            other => lines.push(format!("{indent}{label}: {other}")),
        }
    }
}
