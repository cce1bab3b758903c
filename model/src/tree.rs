//! The authoring tree: an arena of nodes made for people, serde and proofs. A node names its operands by id, so a
//! subtree used twice is shared (a directed acyclic graph), not copied.

use crate::noise::{Combination, Octaves};
use crate::operator::WeightRule;
use crate::primitive::image::Image;
use crate::profile::Knot;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A node of a [`Tree`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeId(u32);

impl NodeId {
    /// Position in the arena.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The noise that shapes a disc (Génevaux 2015 Fig. 5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscNoise {
    /// How octaves combine.
    pub combination: Combination,
    /// The octaves, 1 to 16.
    pub octaves: Octaves,
    /// Selects the lattices.
    pub seed: u32,
}

/// A node: primitives carry their parameters, operators the ids of their operands. Lengths in metres.
#[derive(Clone, Debug)]
pub enum Node {
    /// Disc around `centre` (z is its elevation).
    Disc {
        /// Centre; z is the elevation before noise.
        centre: DVec3,
        /// Radius of the support.
        radius: f64,
        /// Weight at the centre.
        weight: f64,
        /// Noise, none for a constant disc.
        noise: Option<DiscNoise>,
    },
    /// Polyline with a cross-section.
    Curve {
        /// Vertices with elevations, at least two, no two neighbours equal in the plane.
        points: Vec<DVec3>,
        /// Radius of the support.
        radius: f64,
        /// Weight on the skeleton.
        weight: f64,
        /// How far a joint is smoothed.
        joint: f64,
        /// Cross-section, sorted by distance.
        profile: Vec<Knot>,
    },
    /// Image on an axis-aligned rectangle.
    Image {
        /// The raster.
        image: Arc<Image>,
        /// Position of sample (0, 0).
        origin: DVec2,
        /// Distance between samples along x and y.
        spacing: DVec2,
        /// Width of the border over which the weight rises.
        margin: f64,
        /// Weight inside.
        weight: f64,
        /// Factor of the samples.
        elevation_scale: f64,
        /// Added to the scaled samples.
        elevation_offset: f64,
    },
    /// Blend of any number of operands.
    Blend(Vec<NodeId>),
    /// Replacement of `a` by `b`.
    Replace {
        /// What is replaced.
        a: NodeId,
        /// What replaces it.
        b: NodeId,
        /// What happens to the weight.
        rule: WeightRule,
    },
    /// Addition of `b` to `a`.
    Add {
        /// The base.
        a: NodeId,
        /// The detail.
        b: NodeId,
        /// What happens to the weight.
        rule: WeightRule,
    },
    /// A subtree turned, scaled and moved.
    Affine {
        /// The operand.
        node: NodeId,
        /// Applied scale first, then rotation, then translation.
        map: Similarity,
    },
}

/// Scale, rotation and translation of the plane, with a vertical scale and offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Horizontal factor, positive.
    pub scale: f64,
    /// Anticlockwise, radians.
    pub rotation: f64,
    /// Metres.
    pub translation: DVec2,
    /// Factor of elevations.
    pub elevation_scale: f64,
    /// Metres added to elevations.
    pub elevation_offset: f64,
}

impl Default for Similarity {
    fn default() -> Self {
        Similarity { scale: 1.0, rotation: 0.0, translation: DVec2::ZERO, elevation_scale: 1.0, elevation_offset: 0.0 }
    }
}

/// An arena of nodes. Operands come before the node that uses them, so there are no cycles.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
}

impl Tree {
    /// An empty arena.
    pub fn new() -> Tree {
        Tree::default()
    }
    /// Adds a node and returns its id.
    ///
    /// # Panics
    /// When an operand does not exist in this tree: ids come from this function.
    pub fn push(&mut self, node: Node) -> NodeId {
        let id = NodeId(u32::try_from(self.nodes.len()).expect("a tree holds fewer than 2^32 nodes"));
        for operand in operands(&node) {
            assert!(operand < id, "operand {operand:?} is not in this tree");
        }
        self.nodes.push(node);
        id
    }
    /// The node behind an id.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.index()]
    }
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Has no node been added?
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
    /// Distinct primitives and operators below `root`, as Table 1 of the paper counts them.
    pub fn count(&self, root: NodeId) -> (usize, usize) {
        let mut seen = vec![false; self.nodes.len()];
        let mut pending = vec![root];
        let (mut primitives, mut operators) = (0, 0);
        while let Some(id) = pending.pop() {
            if std::mem::replace(&mut seen[id.index()], true) {
                continue;
            }
            let below: Vec<NodeId> = operands(self.node(id)).collect();
            if below.is_empty() && !matches!(self.node(id), Node::Blend(_)) {
                primitives += 1;
            } else {
                operators += 1;
            }
            pending.extend(below);
        }
        (primitives, operators)
    }
}

/// The operands of a node, in order.
pub fn operands(node: &Node) -> impl Iterator<Item = NodeId> {
    let (list, pair): (&[NodeId], [Option<NodeId>; 2]) = match node {
        Node::Disc { .. } | Node::Curve { .. } | Node::Image { .. } => (&[], [None, None]),
        Node::Blend(list) => (list, [None, None]),
        Node::Replace { a, b, .. } | Node::Add { a, b, .. } => (&[], [Some(*a), Some(*b)]),
        Node::Affine { node, .. } => (&[], [Some(*node), None]),
    };
    list.iter().copied().chain(pair.into_iter().flatten())
}
