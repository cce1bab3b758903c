//! From the text of a scene to its tree: definitions are built once and shared, images are loaded once.

use super::file::{NodeFile, SceneFile};
use super::{Appearance, PlacedImage, Scene, SceneError};
use crate::noise::mix;
use crate::operator::affine::Similarity;
use crate::operator::lod::Lod;
use crate::operator::masked::Mask;
use crate::operator::warp::{Control, Warp};
use crate::primitive::for_each_primitive;
use crate::tree::{Node, NodeId, Tree};
use glam::DVec2;
use std::collections::BTreeMap;
use std::num::NonZeroU32;

/// Finds the raster behind a file name, or says in one line why it cannot.
type Images<'a> = &'a mut dyn FnMut(&str) -> Result<PlacedImage, String>;

/// What a primitive may ask of its scene.
pub(crate) struct Scope<'a> {
    seed: u64,
    images: Images<'a>,
    loaded: BTreeMap<(String, u32), PlacedImage>,
}

impl Scope<'_> {
    /// The lattice of a node: its explicit seed, or a hash of the scene's seed and its name, never of a position in the
    /// file. `None` when it has neither.
    pub fn seed(&self, name: Option<&str>, seed: Option<u32>) -> Option<u32> {
        let named = |name: &str| {
            let start = mix(self.seed as u32, (self.seed >> 32) as u32);
            name.bytes().fold(start, |state, byte| mix(state, u32::from(byte)))
        };
        seed.or_else(|| name.map(named))
    }
    /// The raster behind a file name, averaged over blocks of `reduce` samples along each axis.
    pub fn image(&mut self, file: &str, reduce: Option<NonZeroU32>) -> Result<PlacedImage, String> {
        let reduce = reduce.map_or(1, NonZeroU32::get);
        let key = (file.to_owned(), reduce);
        if let Some(placed) = self.loaded.get(&key) {
            return Ok(placed.clone());
        }
        let placed = (self.images)(file)?;
        let placed = placed.reduced(reduce as usize).ok_or("reducing leaves fewer than 2 × 2 samples")?;
        self.loaded.insert(key, placed.clone());
        Ok(placed)
    }
}

pub(super) struct Builder<'a> {
    file: &'a SceneFile,
    scope: Scope<'a>,
    pub scene: Scene,
    known: BTreeMap<&'a str, NodeId>,
    open: Vec<&'a str>,
}

impl<'a> Builder<'a> {
    pub fn new(file: &'a SceneFile, images: Images<'a>) -> Builder<'a> {
        Builder {
            file,
            scope: Scope { seed: file.seed, images, loaded: BTreeMap::new() },
            scene: Scene {
                tree: Tree::new(),
                layers: BTreeMap::new(),
                cameras: BTreeMap::new(),
                focus: None,
                appearance: Appearance::default(),
                paths: Vec::new(),
            },
            known: BTreeMap::new(),
            open: Vec::new(),
        }
    }
    fn push(&mut self, node: Node, path: &str) -> NodeId {
        self.scene.paths.push(path.to_owned());
        self.scene.tree.push(node)
    }
    pub fn definition(&mut self, name: &str, path: &str) -> Result<NodeId, SceneError> {
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
    pub fn node(&mut self, node: &'a NodeFile, path: &str) -> Result<NodeId, SceneError> {
        let fail = |problem: String| SceneError::Node { path: path.to_owned(), problem };
        macro_rules! build {
            ($($(#[$doc:meta])* $name:ident $file:ident $authored:ident,)*) => {
        match node {
            $(NodeFile::$name(file) => Node::from(file.build(&mut self.scope).map_err(fail)?),)*
            NodeFile::River(file) => Node::from(file.build(&mut self.scope).map_err(fail)?),
            NodeFile::Road(file) => Node::from(file.build(&mut self.scope).map_err(fail)?),
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
            NodeFile::Lod { a, b, from, to, passage } => Node::Lod {
                a: self.node(a, &format!("{path}.lod.a"))?,
                b: self.node(b, &format!("{path}.lod.b"))?,
                lod: Lod { from: (*from).into(), to: (*to).into(), passage: *passage },
            },
            NodeFile::Masked { a, b, probe, elevation, slope, joining } => Node::Masked {
                a: self.node(a, &format!("{path}.masked.a"))?,
                b: self.node(b, &format!("{path}.masked.b"))?,
                mask: Mask { probe: (*probe).into(), elevation: *elevation, slope: *slope, joining: *joining },
            },
            NodeFile::Warp { node, controls } => {
                let controls: Vec<Control> = controls
                    .iter()
                    .map(|c| Control {
                        centre: DVec2::new(c.centre.0.into(), c.centre.1.into()),
                        radius: c.radius.into(),
                        shift: DVec2::new(c.shift.0.into(), c.shift.1.into()),
                    })
                    .collect();
                let warp = Warp::new(&controls).map_err(fail)?;
                Node::Warp { node: self.node(node, &format!("{path}.warp.node"))?, warp }
            }
            NodeFile::Affine { node, scale, rotation_degrees, translation, elevation_scale, elevation_offset } => {
                let map = Similarity {
                    scale: (*scale).into(),
                    rotation: f64::from(*rotation_degrees) * std::f64::consts::PI / 180.0,
                    translation: DVec2::new(translation.0.into(), translation.1.into()),
                    elevation_scale: (*elevation_scale).into(),
                    elevation_offset: (*elevation_offset).into(),
                };
                Node::Affine { node: self.node(node, &format!("{path}.affine.node"))?, map }
            }
            NodeFile::Instance(name) => return self.definition(name, path),
        }
            };
        }
        let built = for_each_primitive!(build);
        Ok(self.push(built, path))
    }
}
