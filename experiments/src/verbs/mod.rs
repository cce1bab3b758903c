//! The verbs of the `terrain` command: one file each, a struct of arguments and a function that runs it.

pub mod amplify;
pub mod bake;
pub mod convert;
pub mod diffuse;
pub mod eval;
pub mod generate;
pub mod implicit;
pub mod info;
pub mod mesh;
pub mod on_adapter;
mod paged_ground;
mod picture;
pub mod render;
pub mod tessellate;
mod tree_ground;

use crate::scenes::{self, SceneFileError};
use clap::Args;
use glam::DVec2;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::path::Path;
use std::str::FromStr;
use terrain_model::bounds::THRESHOLD;
use terrain_model::io::atomic::atomic_write_bytes;
use terrain_model::io::{ReadError, WriteError};
use terrain_model::program::Program;
use terrain_model::scene::Scene;

/// Why a verb stopped; each prints as one line that names the file, the place and the mend.
#[derive(Debug, thiserror::Error)]
pub enum VerbError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneFileError),
    /// A raster that was read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file that was written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Anything else.
    #[error("{0}")]
    Other(String),
    /// Whoever read our output has gone: not a failure.
    #[error("the output was closed")]
    Closed,
}

/// Prints a line to standard output.
///
/// # Errors
/// [`VerbError::Closed`] when nobody reads it any more.
fn print(line: &str) -> Result<(), VerbError> {
    writeln!(std::io::stdout().lock(), "{line}").map_err(|error| match error.kind() {
        std::io::ErrorKind::BrokenPipe => VerbError::Closed,
        _ => VerbError::Other(format!("standard output: {error}")),
    })
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), VerbError> {
    let file = path.display().to_string();
    atomic_write_bytes(path, bytes).map_err(|source| WriteError::Io { file, source }.into())
}

/// A scene and one of its layers.
#[derive(Args, Debug)]
pub struct SceneArguments {
    /// A scene file, or `builtin:NAME` for an embedded scene
    pub scene: String,
    /// The layer [default: `bedrock` if there is one, else the first]
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
}

impl SceneArguments {
    /// Loads the scene and compiles the layer.
    fn load(&self) -> Result<(Scene, Program), VerbError> {
        let scene = scenes::load(&self.scene)?;
        let layer = self.layer.as_deref().unwrap_or(scene.ground());
        let program = scene.program(layer).map_err(|error| scenes::located(&self.scene, "", error))?;
        Ok((scene, program))
    }
    /// The support of the layer, or a line that says that there is nothing.
    fn support(&self, program: &Program) -> Result<(DVec2, DVec2), VerbError> {
        let nothing = || VerbError::Other(format!("{}: the layer is empty; add a primitive to it", self.scene));
        program.support().ok_or_else(nothing)
    }
}

/// `X,Y`, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point(pub DVec2);

impl FromStr for Point {
    type Err = String;
    fn from_str(text: &str) -> Result<Point, String> {
        let [x, y] = numbers(text)?;
        Ok(Point(DVec2::new(x, y)))
    }
}

/// `X0,Y0,X1,Y1`, metres.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    low: DVec2,
    high: DVec2,
}

impl FromStr for Rectangle {
    type Err = String;
    fn from_str(text: &str) -> Result<Rectangle, String> {
        let [x0, y0, x1, y1] = numbers(text)?;
        if x0 < x1 && y0 < y1 {
            Ok(Rectangle { low: DVec2::new(x0, y0), high: DVec2::new(x1, y1) })
        } else {
            Err("expected the south-west corner, then the north-east: X0 < X1 and Y0 < Y1".to_owned())
        }
    }
}

/// A length above 0, metres.
fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "expected a positive number of metres".to_owned())
}

/// N finite numbers separated by commas.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let fail = || format!("expected {N} finite numbers separated by commas, in metres, found `{}`", text.trim());
    let list: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let list = list.map_err(|_| fail())?;
    if list.iter().all(|number| number.is_finite()) { list.try_into().map_err(|_| fail()) } else { Err(fail()) }
}

/// `WxH` or `N` for `NxN`: columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// The longest side that is accepted: a picture of it fits in the memory of a large machine.
    const MAX: usize = 65_536;
    /// The most samples that are accepted.
    const MAX_SAMPLES: usize = 1 << 28;
}

impl FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Size, String> {
        let (width, height) = text.split_once('x').unwrap_or((text, text));
        let side = |part: &str| part.parse::<usize>().ok().filter(|n| (1..=Size::MAX).contains(n));
        match (side(width), side(height)) {
            (Some(width), Some(height)) if width * height <= Size::MAX_SAMPLES => Ok(Size { width, height }),
            _ => Err(format!("expected N or NxM, each 1 to {} and N·M at most {}", Size::MAX, Size::MAX_SAMPLES)),
        }
    }
}

/// What a raster of samples finds of the terrain.
struct Extent {
    /// South-west corner of the samples on the terrain, metres.
    low: DVec2,
    /// North-east corner.
    high: DVec2,
    /// Least and greatest elevation, metres.
    elevations: [f64; 2],
}

/// The terrain on `side` × `side` samples of a box; `None` when none lies on it.
fn sampled_extent(program: &Program, low: DVec2, high: DVec2, side: usize) -> Option<Extent> {
    let spacing = (high - low) / (side - 1) as f64;
    let baked = program.bake(low, spacing, side, side);
    let mut extent: Option<Extent> = None;
    for (k, (elevation, weight)) in baked.elevation.iter().zip(&baked.weight).enumerate() {
        if f64::from(*weight) < THRESHOLD {
            continue;
        }
        let p = low + spacing * DVec2::new((k % side) as f64, (k / side) as f64);
        let z = f64::from(*elevation);
        let so_far = extent.get_or_insert(Extent { low: p, high: p, elevations: [z, z] });
        so_far.low = so_far.low.min(p);
        so_far.high = so_far.high.max(p);
        so_far.elevations = [so_far.elevations[0].min(z), so_far.elevations[1].max(z)];
    }
    extent
}

/// A bar on a terminal, nothing anywhere else.
fn progress(steps: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %  {elapsed} < {eta}");
    let bar = ProgressBar::new(steps).with_message(what);
    style.map(|style| bar.clone().with_style(style)).unwrap_or(bar)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_one_number_or_two() {
        assert_eq!("7".parse(), Ok(Size { width: 7, height: 7 }));
        assert_eq!("960x540".parse(), Ok(Size { width: 960, height: 540 }));
        for bad in ["", "x", "0", "5x", "5x0", "-1", "65537", "65536x65536", "1x2x3", "99999999999999999999"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }

    #[test]
    fn points_are_two_finite_numbers() {
        assert_eq!("-1.5, 2e3".parse(), Ok(Point(DVec2::new(-1.5, 2000.0))));
        for bad in ["", "1", "1,2,3", "1;2", "nan,0", "0,inf", "a,b"] {
            assert!(bad.parse::<Point>().is_err(), "{bad}");
        }
    }
}
