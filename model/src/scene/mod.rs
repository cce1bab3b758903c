//! Scene files: RON with named definitions, layers and cameras. Values are checked while they are read, so an error
//! carries line and column; what can only be checked later carries the node's path.

mod build;
mod file;
mod value;

pub(crate) use build::Scope;
pub(crate) use value::{Finite, Point, Point3, Positive, one};

use crate::detail::Focus;
use crate::primitive::image::Image;
use crate::program::{CompileError, Program};
use crate::tree::{NodeId, Tree};
use build::Builder;
use file::SceneFile;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The header every scene starts with.
pub const FORMAT: &str = "terrain-scene/1";

/// Why a scene cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The text is not a scene.
    #[error("{line}:{column}: {problem}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was expected.
        problem: String,
    },
    /// The scene is well formed but a node is not.
    #[error("{path}: {problem}")]
    Node {
        /// Where, as `layers.bedrock.blend[3]`.
        path: String,
        /// What was expected.
        problem: String,
    },
}

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPlacement {
    /// Position of the eye, metres.
    pub eye: DVec3,
    /// Where it looks.
    pub target: DVec3,
    /// Vertical field of view, radians.
    pub field_of_view: f64,
}

/// How a scene asks to be drawn; it changes no geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Appearance {
    /// Unit vector towards the sun.
    pub sun: Option<DVec3>,
    /// Elevation above which snow lies, metres.
    pub snow: Option<f64>,
    /// Whether little grows.
    pub arid: bool,
}

/// An image found by a scene's file name: the raster and its own placement, metres.
#[derive(Clone, Debug)]
pub struct PlacedImage {
    /// The raster.
    pub image: Arc<Image>,
    /// Position of sample (0, 0).
    pub origin: DVec2,
    /// Distance between samples.
    pub spacing: DVec2,
}

impl PlacedImage {
    /// Averages blocks of `factor` × `factor` samples; the mean stands at the middle of its block, and what does not
    /// fill a block is left out. `None` when fewer than 2 × 2 samples remain.
    pub fn reduced(&self, factor: usize) -> Option<PlacedImage> {
        if factor <= 1 {
            return Some(self.clone());
        }
        let image = self.image.reduced(factor)?;
        let half = 0.5 * (factor as f64 - 1.0);
        let origin = self.origin + self.spacing * half;
        Some(PlacedImage { image: Arc::new(image), origin, spacing: self.spacing * factor as f64 })
    }
}

/// A scene: one tree, its layers and its cameras.
#[derive(Clone, Debug)]
pub struct Scene {
    /// All nodes.
    pub tree: Tree,
    /// The layers by name.
    pub layers: BTreeMap<String, NodeId>,
    /// Where detail is wanted; everywhere when there is none.
    pub focus: Option<Focus>,
    /// How it is drawn.
    pub appearance: Appearance,
    /// The cameras by name.
    pub cameras: BTreeMap<String, CameraPlacement>,
    paths: Vec<String>,
}

impl Scene {
    /// Reads a scene. `images` finds the raster behind a file name, or says in one line why it cannot.
    ///
    /// # Errors
    /// [`SceneError`], with the place.
    pub fn read(text: &str, images: &mut dyn FnMut(&str) -> Result<PlacedImage, String>) -> Result<Scene, SceneError> {
        let options = ron::Options::default().with_default_extension(
            ron::extensions::Extensions::IMPLICIT_SOME | ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES,
        );
        let file: SceneFile = options.from_str(text).map_err(|error| SceneError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            problem: error.code.to_string(),
        })?;
        if file.format != FORMAT {
            let problem = format!("expected format \"{FORMAT}\", found \"{}\"", file.format);
            return Err(SceneError::Node { path: "format".to_owned(), problem });
        }
        let mut builder = Builder::new(&file, images);
        for (name, node) in &file.layers {
            let id = builder.node(node, &format!("layers.{name}"))?;
            builder.scene.layers.insert(name.clone(), id);
        }
        // Unused definitions are checked all the same.
        for name in file.definitions.keys() {
            builder.definition(name, &format!("definitions.{name}"))?;
        }
        if let Some(f) = &file.focus {
            let position = DVec2::new(f.position.0.into(), f.position.1.into());
            let focus = Focus { position, near: f.near.into(), far: f.far.into() };
            if !focus.is_sound() {
                let problem = "expected 0 ≤ near < far".to_owned();
                return Err(SceneError::Node { path: "focus".to_owned(), problem });
            }
            builder.scene.focus = Some(focus);
        }
        let sun = file.look.sun.map(|(azimuth, height)| {
            const DEGREE: f64 = std::f64::consts::PI / 180.0;
            let (azimuth, height) = (f64::from(azimuth) * DEGREE, f64::from(height) * DEGREE);
            let flat = libm::cos(height);
            DVec3::new(flat * libm::sin(azimuth), flat * libm::cos(azimuth), libm::sin(height))
        });
        builder.scene.appearance = Appearance { sun, snow: file.look.snow.map(f64::from), arid: file.look.arid };
        for (name, camera) in &file.cameras {
            let point = |p: Point3| DVec3::new(p.0.into(), p.1.into(), p.2.into());
            let degrees = f64::from(camera.field_of_view_degrees);
            let field_of_view = degrees * std::f64::consts::PI / 180.0;
            let placement = CameraPlacement { eye: point(camera.eye), target: point(camera.target), field_of_view };
            if placement.eye == placement.target || degrees >= 180.0 {
                let problem = "expected a target away from the eye and a field of view below 180 degrees".to_owned();
                return Err(SceneError::Node { path: format!("cameras.{name}"), problem });
            }
            builder.scene.cameras.insert(name.clone(), placement);
        }
        Ok(builder.scene)
    }
    /// Compiles a layer.
    ///
    /// # Errors
    /// When the layer does not exist or a node cannot be compiled; the error carries the node's path.
    pub fn program(&self, layer: &str) -> Result<Program, SceneError> {
        let Some(id) = self.layers.get(layer) else {
            let names: Vec<&str> = self.layers.keys().map(String::as_str).collect();
            let problem = format!("no such layer; the scene has {}", names.join(", "));
            return Err(SceneError::Node { path: format!("layers.{layer}"), problem });
        };
        let program = Program::compile(&self.tree, *id);
        program.map(|program| program.with_focus(self.focus.as_ref())).map_err(|CompileError { node, problem }| {
            SceneError::Node { path: self.paths.get(node).cloned().unwrap_or_default(), problem }
        })
    }
    /// The layer that is the ground: `bedrock` if there is one, else the first.
    pub fn ground(&self) -> &str {
        if self.layers.contains_key("bedrock") {
            "bedrock"
        } else {
            self.layers.keys().next().map_or("", String::as_str)
        }
    }
}
