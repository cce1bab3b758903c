//! A quadtree over the plane around an outline: each leaf is wholly on it, wholly farther than R from it, or knows the few
//! pieces and edges that can matter to its points.

use super::border::Piece;
use super::edges::{Edges, Extent};
use glam::DVec2;

/// A leaf with no more pieces and edges is not split.
const FEW: usize = 6;
/// A leaf is not split below this part of R.
const LEAST: f64 = 1.0 / 256.0;

/// What the outline is in a square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Node {
    /// On the outline.
    Inside,
    /// Farther than R.
    Far,
    /// Four squares from this node on, x first.
    Split(u32),
    /// The pieces that can be nearest, and the edges that can be nearer than R to a point on the outline: ranges of
    /// [`Tree::lists`]. Without `member` no point is on it.
    Near { pieces: [u32; 2], edges: [u32; 2], member: bool },
}

#[derive(Clone, Debug)]
pub(super) struct Tree {
    centre: DVec2,
    half: f64,
    nodes: Vec<Node>,
    lists: Vec<u32>,
}

impl Tree {
    pub fn list(&self, range: [u32; 2]) -> &[u32] {
        &self.lists[range[0] as usize..range[1] as usize]
    }
    /// The leaf that holds `p`.
    #[inline(always)]
    pub fn leaf(&self, p: DVec2) -> Node {
        if !(p - self.centre).abs().cmple(DVec2::splat(self.half)).all() {
            return Node::Far;
        }
        let (mut centre, mut half) = (self.centre, self.half);
        let mut node = self.nodes[0];
        while let Node::Split(first) = node {
            let k = u32::from(p.x >= centre.x) + 2 * u32::from(p.y >= centre.y);
            (centre, half) = child(centre, half, k);
            node = self.nodes[(first + k) as usize];
        }
        node
    }
    /// [`Node::Inside`] or [`Node::Far`], if every leaf that meets the rectangle is that.
    pub fn over(&self, region: &Extent) -> Option<Node> {
        let reach = DVec2::splat(self.half);
        let (low, high) = (self.centre - reach, self.centre + reach);
        if !(region.low.cmple(high).all() && low.cmple(region.high).all()) {
            return Some(Node::Far);
        }
        let around = low.cmple(region.low).all() && region.high.cmple(high).all();
        let mut all = if around { None } else { Some(Node::Far) };
        self.agree(0, self.centre, self.half, region, &mut all).then_some(all).flatten()
    }
    fn agree(&self, k: u32, centre: DVec2, half: f64, region: &Extent, all: &mut Option<Node>) -> bool {
        match self.nodes[k as usize] {
            Node::Near { .. } => false,
            Node::Split(first) => (0..4).all(|k| {
                let right = if k & 1 == 0 { region.low.x < centre.x } else { region.high.x >= centre.x };
                let upper = if k & 2 == 0 { region.low.y < centre.y } else { region.high.y >= centre.y };
                let (below, side) = child(centre, half, k);
                !(right && upper) || self.agree(first + k, below, side, region, all)
            }),
            leaf => *all.get_or_insert(leaf) == leaf,
        }
    }
    /// Bytes of nodes and lists.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.lists[..])
    }
}

#[inline(always)]
fn child(centre: DVec2, half: f64, k: u32) -> (DVec2, f64) {
    let half = half * 0.5;
    let side = |high: bool| if high { half } else { -half };
    (centre + DVec2::new(side(k & 1 == 1), side(k & 2 == 2)), half)
}

/// Grows a tree.
pub(super) struct Grower<'a> {
    pub edges: &'a Edges,
    pub pieces: &'a [Piece],
    pub radius: f64,
    /// By how much a distance or a corner of a square may be off, metres.
    pub error: f64,
}

impl Grower<'_> {
    pub fn grow(&self, extent: &Extent) -> Tree {
        let half = (extent.high - extent.low).max_element() * 0.5 + self.radius + 4.0 * self.error;
        let centre = extent.low.midpoint(extent.high);
        let mut tree = Tree { centre, half, nodes: vec![Node::Far], lists: Vec::new() };
        let pieces = (0..self.pieces.len() as u32).collect();
        let edges = (0..self.edges.all.len() as u32).collect();
        self.fill(&mut tree, 0, (centre, half), pieces, edges);
        tree
    }

    /// Distances from the square's points differ from that of its centre by half the diagonal at most.
    fn fill(&self, tree: &mut Tree, slot: usize, (centre, half): (DVec2, f64), pieces: Vec<u32>, edges: Vec<u32>) {
        let reach = half * std::f64::consts::SQRT_2 + 2.0 * self.error;
        let far = |list: Vec<u32>, of: &dyn Fn(usize) -> DVec2| -> Vec<(u32, f64)> {
            let distance = |k: u32| (k, of(k as usize).length());
            list.into_iter().map(distance).filter(|(_, distance)| distance - reach <= self.radius).collect()
        };
        let edges = far(edges, &|k| self.edges.all[k].offset(centre));
        let mut pieces = far(pieces, &|k| self.pieces[k].offset(centre, self.radius));
        let best = pieces.iter().fold(f64::INFINITY, |best, piece| best.min(piece.1));
        pieces.retain(|piece| piece.1 - reach <= best + reach);
        // With one edge nearer than R to the whole square, none of it is on the outline.
        let ruled_out = edges.iter().any(|edge| edge.1 + reach < self.radius);
        if pieces.is_empty() {
            // The border is farther than R: all of the square is on the outline, or none.
            let on = !ruled_out && edges.iter().all(|edge| edge.1 >= self.radius) && self.edges.holds(centre);
            tree.nodes[slot] = if on { Node::Inside } else { Node::Far };
            return;
        }
        if edges.is_empty() && self.edges.holds(centre) {
            tree.nodes[slot] = Node::Inside;
            return;
        }
        // Two points of the square that are no nearer than R to any edge are on the same side of all edges if they are nearer
        // than R to each other; so then are they and the centre.
        let small = 2.0 * reach < self.radius;
        let member = !ruled_out && !edges.is_empty() && (!small || self.edges.holds(centre));
        let count = pieces.len() + if member { edges.len() } else { 0 };
        if (small || !member) && count <= FEW || half < self.radius * LEAST {
            let names = |list: &[(u32, f64)]| list.iter().map(|one| one.0).collect::<Vec<_>>();
            let mut store = |list: &[(u32, f64)]| {
                let from = tree.lists.len() as u32;
                tree.lists.extend(names(list));
                [from, tree.lists.len() as u32]
            };
            let pieces = store(&pieces);
            let edges = if member { store(&edges) } else { [0, 0] };
            tree.nodes[slot] = Node::Near { pieces, edges, member };
            return;
        }
        let first = tree.nodes.len() as u32;
        tree.nodes[slot] = Node::Split(first);
        tree.nodes.extend([Node::Far; 4]);
        for k in 0..4 {
            let names = |list: &[(u32, f64)]| list.iter().map(|one| one.0).collect();
            self.fill(tree, (first + k) as usize, child(centre, half, k), names(&pieces), names(&edges));
        }
    }
}
