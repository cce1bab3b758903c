//! Boxes around groups of a polyline's neighbouring segments, in a hierarchy that is walked front to back.

use crate::field::Box3;
use glam::DVec3;
use std::ops::Range;
use terrain_model::real::Real;

/// A leaf holds at most so many segments: a box costs about as much to test as a segment.
const LEAF: u32 = 8;

/// A node before its children; the hierarchy is an array in this order.
#[derive(Clone, Debug)]
pub(super) struct Node {
    extent: Box3,
    /// Of a leaf; empty above.
    segments: Range<u32>,
    /// The first node that is not below this one.
    next: u32,
}

impl Node {
    /// The squared distance to its box, metres².
    #[inline(always)]
    pub fn distance_squared<R: Real>(&self, p: [R; 3]) -> R {
        let side = |k: usize| {
            let (low, high) = (R::constant(self.extent.low[k]), R::constant(self.extent.high[k]));
            (low - p[k]).max(p[k] - high).max(R::zero()).square()
        };
        side(0) + side(1) + side(2)
    }
}

/// The hierarchy over the segments between neighbouring `points`; one point counts as a segment.
pub(super) fn grow(points: &[DVec3]) -> Vec<Node> {
    let mut nodes = Vec::new();
    branch(points, 0..(points.len() as u32 - 1).max(1), &mut nodes);
    nodes
}

fn branch(points: &[DVec3], segments: Range<u32>, nodes: &mut Vec<Node>) {
    let own = &points[segments.start as usize..(segments.end as usize + 1).min(points.len())];
    let extent = own.iter().fold(Box3::EMPTY, |all, &p| all.hull(&Box3::new(p, p)));
    let here = nodes.len();
    let count = segments.end - segments.start;
    nodes.push(Node { extent, segments: segments.clone(), next: 0 });
    if count > LEAF {
        let middle = segments.start + count.div_ceil(LEAF).div_ceil(2) * LEAF;
        nodes[here].segments = 0..0;
        branch(points, segments.start..middle, nodes);
        branch(points, middle..segments.end, nodes);
    }
    nodes[here].next = nodes.len() as u32;
}

/// The box of the root.
pub(super) fn extent(nodes: &[Node]) -> Box3 {
    nodes.first().map_or(Box3::EMPTY, |root| root.extent)
}

/// Carries `state` through the segments in their order, leaving out those below a node that is `far`.
#[inline(always)]
pub(super) fn fold<S>(
    nodes: &[Node],
    mut state: S,
    far: impl Fn(&S, &Node) -> bool,
    near: impl Fn(S, usize) -> S,
) -> S {
    let mut at = 0;
    while let Some(node) = nodes.get(at) {
        if far(&state, node) {
            at = node.next as usize;
            continue;
        }
        for k in node.segments.clone() {
            state = near(state, k as usize);
        }
        at += 1;
    }
    state
}
