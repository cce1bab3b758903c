//! The authoring tree: an arena of nodes made for people, serde and proofs. A node names its operands by id, so a
//! subtree used twice is shared (a directed acyclic graph), not copied.

use crate::operator::WeightRule;
use crate::operator::affine::Similarity;
use crate::operator::lod::Lod;
use crate::operator::masked::Mask;
use crate::operator::warp::Warp;
use crate::primitive::Primitive;

/// A node of a [`Tree`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeId(u32);

impl NodeId {
    /// Position in the arena.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A node: primitives carry their parameters, operators the ids of their operands. Lengths in metres.
#[derive(Clone, Debug)]
pub enum Node {
    /// A primitive.
    Primitive(Primitive),
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
    /// `a` where the level of detail is low, `b` where it is high.
    Lod {
        /// The coarse operand.
        a: NodeId,
        /// The fine operand.
        b: NodeId,
        /// The thresholds.
        lod: Lod,
    },
    /// `b` joined to `a` where `a` itself is low and gentle enough.
    Masked {
        /// The base.
        a: NodeId,
        /// What joins it.
        b: NodeId,
        /// Where.
        mask: Mask,
    },
    /// A subtree seen through a deformation of the plane.
    Warp {
        /// The operand.
        node: NodeId,
        /// The deformation.
        warp: Warp,
    },
    /// A subtree turned, scaled and moved.
    Affine {
        /// The operand.
        node: NodeId,
        /// Applied scale first, then rotation, then translation.
        map: Similarity,
    },
}

impl<P: Into<Primitive>> From<P> for Node {
    fn from(primitive: P) -> Node {
        Node::Primitive(primitive.into())
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
    pub fn push(&mut self, node: impl Into<Node>) -> NodeId {
        let node = node.into();
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
        Node::Primitive(_) => (&[], [None, None]),
        Node::Blend(list) => (list, [None, None]),
        Node::Replace { a, b, .. } | Node::Add { a, b, .. } | Node::Lod { a, b, .. } | Node::Masked { a, b, .. } => {
            (&[], [Some(*a), Some(*b)])
        }
        Node::Affine { node, .. } | Node::Warp { node, .. } => (&[], [Some(*node), None]),
    };
    list.iter().copied().chain(pair.into_iter().flatten())
}
