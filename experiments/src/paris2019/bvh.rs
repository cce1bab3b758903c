//! The paper's index of compact primitives, for the comparison: a tree of bounding boxes (§6), each node's primitives split in
//! half along the axis on which their centres lie farthest apart.

use glam::DVec3;
use terrain_amplify::field::Box3;
use terrain_amplify::implicit::primitive::Primitive;

/// Primitives of a leaf, at most.
const LEAF: usize = 4;

/// A node; an inner one's first child follows it.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Box3,
    /// Of an inner node the second child, of a leaf its first item.
    next: u32,
    /// 0 of an inner node.
    items: u32,
}

/// A tree of bounding boxes over primitives.
#[derive(Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl Bvh {
    /// The tree of `primitives`, which are named by their place.
    pub fn new(primitives: &[Primitive]) -> Bvh {
        let boxes: Vec<Box3> = primitives.iter().map(Primitive::support).collect();
        let mut tree = Bvh { nodes: Vec::new(), items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.build(&boxes, 0, boxes.len());
        }
        tree
    }

    fn build(&mut self, boxes: &[Box3], from: usize, to: usize) {
        let of = |k: &u32| boxes[*k as usize];
        let items = &mut self.items[from..to];
        let bounds = items.iter().map(of).fold(Box3::EMPTY, |all, one| all.hull(&one));
        let place = self.nodes.len();
        self.nodes.push(Node { bounds, next: from as u32, items: items.len() as u32 });
        if items.len() <= LEAF {
            return;
        }
        let centre = |k: &u32| of(k).low + of(k).high;
        let (low, high) = items
            .iter()
            .map(centre)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
        let axis = (high - low).max_position();
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b)));
        self.build(boxes, from, from + half);
        let second = self.nodes.len() as u32;
        self.build(boxes, from + half, to);
        (self.nodes[place].next, self.nodes[place].items) = (second, 0);
    }

    /// Calls `visit` with every primitive of a leaf whose box holds `p`; the number of boxes that were looked at.
    pub fn near(&self, p: DVec3, mut visit: impl FnMut(u32)) -> u64 {
        let (mut stack, mut looked) = ([0u32; 64], 0);
        let mut top = usize::from(!self.nodes.is_empty());
        while top > 0 {
            top -= 1;
            let place = stack[top];
            let node = &self.nodes[place as usize];
            looked += 1;
            if !node.bounds.contains(p) {
                continue;
            }
            if node.items == 0 {
                (stack[top], stack[top + 1]) = (node.next, place + 1);
                top += 2;
            } else {
                self.items[node.next as usize..(node.next + node.items) as usize].iter().for_each(|&k| visit(k));
            }
        }
        looked
    }

    /// Bytes of nodes and items.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenes;
    use super::*;

    #[test]
    fn the_tree_leaves_out_nothing_and_little_is_looked_at() {
        let terrain = scenes::scattered(2_000, 3).unwrap();
        let (_, index) = scenes::parts(&terrain).unwrap();
        let primitives = index.primitives();
        let tree = Bvh::new(primitives);
        let mut boxes = 0;
        for p in scenes::near_surface(500, scenes::side(2_000), 5) {
            let mut found = Vec::new();
            boxes += tree.near(p, |k| found.push(k));
            found.sort_unstable();
            for (k, one) in primitives.iter().enumerate() {
                assert!(found.binary_search(&(k as u32)).is_ok() || one.value(p) == 0.0);
            }
        }
        assert!(boxes / 500 < 200, "{boxes}");
        assert_eq!(Bvh::new(&[]).near(DVec3::ZERO, |_| unreachable!()), 0);
    }
}
