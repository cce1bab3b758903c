//! Scene files: RON with named definitions, layers and cameras. Values are checked while they are read, so an error
//! carries line and column; what can only be checked later carries the node's path.

use crate::noise::{Combination, Octaves, mix};
use crate::operator::WeightRule;
use crate::primitive::image::Image;
use crate::profile::Knot;
use crate::program::{CompileError, Program};
use crate::tree::{DiscNoise, Node, NodeId, Similarity, Tree};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::num::NonZeroU32;
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

/// A number above 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Positive(f64);

impl TryFrom<f64> for Positive {
    type Error = String;
    fn try_from(value: f64) -> Result<Positive, String> {
        if value > 0.0 && value.is_finite() {
            Ok(Positive(value))
        } else {
            Err(format!("expected a number above 0, found {value}"))
        }
    }
}
impl From<Positive> for f64 {
    fn from(value: Positive) -> f64 {
        value.0
    }
}

/// Any finite number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Finite(f64);

impl TryFrom<f64> for Finite {
    type Error = String;
    fn try_from(value: f64) -> Result<Finite, String> {
        if value.is_finite() {
            Ok(Finite(value + 0.0))
        } else {
            Err(format!("expected a finite number, found {value}"))
        }
    }
}
impl From<Finite> for f64 {
    fn from(value: Finite) -> f64 {
        value.0
    }
}

type Point = (Finite, Finite);
type Point3 = (Finite, Finite, Finite);

fn one() -> Positive {
    Positive(1.0)
}
fn unit() -> Finite {
    Finite(1.0)
}
fn two() -> Positive {
    Positive(2.0)
}
fn half() -> Positive {
    Positive(0.5)
}
fn field_of_view() -> Positive {
    Positive(45.0)
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    format: String,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    definitions: BTreeMap<String, NodeFile>,
    layers: BTreeMap<String, NodeFile>,
    #[serde(default)]
    cameras: BTreeMap<String, CameraFile>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    eye: Point3,
    target: Point3,
    #[serde(default = "field_of_view")]
    field_of_view_degrees: Positive,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseFile {
    kind: Combination,
    /// Metres of the longest wave.
    wavelength: Positive,
    amplitude: Finite,
    octaves: u32,
    #[serde(default = "two")]
    lacunarity: Positive,
    #[serde(default = "half")]
    gain: Positive,
    #[serde(default)]
    seed: Option<u32>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum NodeFile {
    Disc {
        #[serde(default)]
        name: Option<String>,
        centre: Point,
        #[serde(default)]
        elevation: Finite,
        radius: Positive,
        #[serde(default = "one")]
        weight: Positive,
        #[serde(default)]
        noise: Option<NoiseFile>,
    },
    Curve {
        points: Vec<Point3>,
        radius: Positive,
        #[serde(default = "one")]
        weight: Positive,
        #[serde(default)]
        joint: Option<Positive>,
        #[serde(default)]
        profile: Vec<Knot>,
    },
    Image {
        file: String,
        /// South-west corner; the file's own when absent.
        #[serde(default)]
        origin: Option<Point>,
        /// Metres between samples; the file's own when absent.
        #[serde(default)]
        spacing: Option<(Positive, Positive)>,
        /// Averages blocks of this many samples along each axis into one.
        #[serde(default)]
        reduce: Option<NonZeroU32>,
        margin: Positive,
        #[serde(default = "one")]
        weight: Positive,
        #[serde(default = "unit")]
        elevation_scale: Finite,
        #[serde(default)]
        elevation_offset: Finite,
    },
    Blend(Vec<NodeFile>),
    Replace {
        a: Box<NodeFile>,
        b: Box<NodeFile>,
        #[serde(default)]
        weight_rule: WeightRule,
    },
    Add {
        a: Box<NodeFile>,
        b: Box<NodeFile>,
        #[serde(default)]
        weight_rule: WeightRule,
    },
    Affine {
        node: Box<NodeFile>,
        #[serde(default = "one")]
        scale: Positive,
        #[serde(default)]
        rotation_degrees: Finite,
        #[serde(default)]
        translation: Point,
        #[serde(default = "unit")]
        elevation_scale: Finite,
        #[serde(default)]
        elevation_offset: Finite,
    },
    Instance(String),
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
        let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let file: SceneFile = options.from_str(text).map_err(|error| SceneError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            problem: error.code.to_string(),
        })?;
        if file.format != FORMAT {
            let problem = format!("expected format \"{FORMAT}\", found \"{}\"", file.format);
            return Err(SceneError::Node { path: "format".to_owned(), problem });
        }
        let mut builder = Builder {
            file: &file,
            images,
            scene: Scene { tree: Tree::new(), layers: BTreeMap::new(), cameras: BTreeMap::new(), paths: Vec::new() },
            known: BTreeMap::new(),
            open: Vec::new(),
            loaded: BTreeMap::new(),
        };
        for (name, node) in &file.layers {
            let id = builder.node(node, &format!("layers.{name}"))?;
            builder.scene.layers.insert(name.clone(), id);
        }
        // Unused definitions are checked all the same.
        for name in file.definitions.keys() {
            builder.definition(name, &format!("definitions.{name}"))?;
        }
        for (name, camera) in &file.cameras {
            let point = |p: Point3| DVec3::new(p.0.0, p.1.0, p.2.0);
            let placement = CameraPlacement {
                eye: point(camera.eye),
                target: point(camera.target),
                field_of_view: camera.field_of_view_degrees.0 * std::f64::consts::PI / 180.0,
            };
            if placement.eye == placement.target || camera.field_of_view_degrees.0 >= 180.0 {
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
        Program::compile(&self.tree, *id).map_err(|CompileError { node, problem }| SceneError::Node {
            path: self.paths.get(node).cloned().unwrap_or_default(),
            problem,
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

struct Builder<'a> {
    file: &'a SceneFile,
    images: &'a mut dyn FnMut(&str) -> Result<PlacedImage, String>,
    scene: Scene,
    known: BTreeMap<&'a str, NodeId>,
    open: Vec<&'a str>,
    loaded: BTreeMap<(&'a str, u32), PlacedImage>,
}

impl<'a> Builder<'a> {
    fn push(&mut self, node: Node, path: &str) -> NodeId {
        self.scene.paths.push(path.to_owned());
        self.scene.tree.push(node)
    }
    fn definition(&mut self, name: &str, path: &str) -> Result<NodeId, SceneError> {
        let fail = |problem: String| SceneError::Node { path: path.to_owned(), problem };
        if let Some(id) = self.known.get(name) {
            return Ok(*id);
        }
        let file = self.file;
        let Some((name, node)) = file.definitions.get_key_value(name) else {
            return Err(fail(format!("no definition is named \"{name}\"")));
        };
        if self.open.contains(&name.as_str()) {
            return Err(fail(format!("\"{name}\" contains an instance of itself")));
        }
        self.open.push(name);
        let id = self.node(node, &format!("definitions.{name}"))?;
        self.open.pop();
        self.known.insert(name, id);
        Ok(id)
    }
    fn node(&mut self, node: &'a NodeFile, path: &str) -> Result<NodeId, SceneError> {
        let fail = |problem: &str| SceneError::Node { path: path.to_owned(), problem: problem.to_owned() };
        let built = match node {
            NodeFile::Disc { name, centre, elevation, radius, weight, noise } => {
                let noise = match noise {
                    None => None,
                    Some(noise) => {
                        let seed = match (noise.seed, name) {
                            (Some(seed), _) => seed,
                            (None, Some(name)) => named_seed(self.file.seed, name),
                            (None, None) => {
                                return Err(fail("a disc with noise needs a `name` or a `seed` of its noise"));
                            }
                        };
                        let octaves = Octaves {
                            octaves: noise.octaves,
                            frequency: 1.0 / noise.wavelength.0,
                            lacunarity: noise.lacunarity.0,
                            gain: noise.gain.0,
                            amplitude: noise.amplitude.0,
                        };
                        Some(DiscNoise { combination: noise.kind, octaves, seed })
                    }
                };
                let centre = DVec3::new(centre.0.0, centre.1.0, elevation.0);
                Node::Disc { centre, radius: radius.0, weight: weight.0, noise }
            }
            NodeFile::Curve { points, radius, weight, joint, profile } => Node::Curve {
                points: points.iter().map(|p| DVec3::new(p.0.0, p.1.0, p.2.0)).collect(),
                radius: radius.0,
                weight: weight.0,
                joint: joint.map_or(0.25 * radius.0, f64::from),
                profile: profile.clone(),
            },
            NodeFile::Image { file, origin, spacing, reduce, margin, weight, elevation_scale, elevation_offset } => {
                let reduce = reduce.map_or(1, NonZeroU32::get);
                let key = (file.as_str(), reduce);
                if !self.loaded.contains_key(&key) {
                    let placed = (self.images)(file).map_err(|problem| fail(&problem))?;
                    let reduced = placed.reduced(reduce as usize);
                    let placed = reduced.ok_or_else(|| fail("reducing leaves fewer than 2 × 2 samples"))?;
                    self.loaded.insert(key, placed);
                }
                let placed = &self.loaded[&key];
                Node::Image {
                    image: placed.image.clone(),
                    origin: origin.map_or(placed.origin, |p| DVec2::new(p.0.0, p.1.0)),
                    spacing: spacing.map_or(placed.spacing, |s| DVec2::new(s.0.0, s.1.0)),
                    margin: margin.0,
                    weight: weight.0,
                    elevation_scale: elevation_scale.0,
                    elevation_offset: elevation_offset.0,
                }
            }
            NodeFile::Blend(list) => {
                let mut operands = Vec::with_capacity(list.len());
                for (k, operand) in list.iter().enumerate() {
                    operands.push(self.node(operand, &format!("{path}.blend[{k}]"))?);
                }
                Node::Blend(operands)
            }
            NodeFile::Replace { a, b, weight_rule } => Node::Replace {
                a: self.node(a, &format!("{path}.replace.a"))?,
                b: self.node(b, &format!("{path}.replace.b"))?,
                rule: *weight_rule,
            },
            NodeFile::Add { a, b, weight_rule } => Node::Add {
                a: self.node(a, &format!("{path}.add.a"))?,
                b: self.node(b, &format!("{path}.add.b"))?,
                rule: *weight_rule,
            },
            NodeFile::Affine { node, scale, rotation_degrees, translation, elevation_scale, elevation_offset } => {
                let map = Similarity {
                    scale: scale.0,
                    rotation: rotation_degrees.0 * std::f64::consts::PI / 180.0,
                    translation: DVec2::new(translation.0.0, translation.1.0),
                    elevation_scale: elevation_scale.0,
                    elevation_offset: elevation_offset.0,
                };
                Node::Affine { node: self.node(node, &format!("{path}.affine.node"))?, map }
            }
            NodeFile::Instance(name) => return self.definition(name, path),
        };
        Ok(self.push(built, path))
    }
}

/// The lattice of a named node: a hash of the scene's seed and the name, never of a position in the file.
fn named_seed(seed: u64, name: &str) -> u32 {
    let start = mix(seed as u32, (seed >> 32) as u32);
    name.bytes().fold(start, |state, byte| mix(state, u32::from(byte)))
}
