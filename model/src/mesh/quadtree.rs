//! The restricted quadtree: cells are split until each is good enough, and leaves that share a side differ by at most
//! one level. A leaf is triangulated as a fan about its centre that has a corner wherever a smaller neighbour has one,
//! so leaves meet without cracks. What a cell stands for is asked of a [`Refine`]: nothing here knows of elevations.

use rayon::prelude::*;

/// A square of the tree over a grid of roots: at level l the roots' squares are cut into 2ˡ × 2ˡ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// 0 for a root.
    pub level: u32,
    /// Column, from the west.
    pub i: u32,
    /// Row, from the south.
    pub j: u32,
}

/// Sides of a cell whose neighbour is one level finer: bits from the south, anticlockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Sides(pub u8);

impl Sides {
    /// South, east, north, west.
    pub fn has(self, side: usize) -> bool {
        self.0 >> side & 1 == 1
    }
}

/// Steps to the neighbours across the south, east, north and west side.
const STEPS: [[i64; 2]; 4] = [[0, -1], [1, 0], [0, 1], [-1, 0]];

/// What becomes of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement<N> {
    /// Nothing to show: no triangles, and no neighbour is split on its account.
    LeaveOut,
    /// Good enough, with what is to be remembered about it.
    Keep(N),
    /// To be split. On the finest level it stays, and this is remembered.
    Split(N),
}

/// Says which cells are good enough. Answers must depend on the arguments alone.
pub trait Refine: Sync {
    /// What is remembered about a leaf.
    type Note: Clone + Send + Sync;
    /// What one thread needs to judge cells, one after the other.
    type Scratch;
    /// A fresh scratch.
    fn scratch(&self) -> Self::Scratch;
    /// Judges a cell that would be triangulated as [`fan`] (`cell`, `sides`).
    fn judge(&self, scratch: &mut Self::Scratch, cell: Cell, sides: Sides) -> Judgement<Self::Note>;
}

#[derive(Clone, Debug)]
enum Node<N> {
    /// With the sides it was judged with; none yet for a new leaf.
    Leaf { judged: Option<Sides>, judgement: Option<Judgement<N>> },
    /// Its four children follow one another: south-west, south-east, north-west, north-east.
    Inner(usize),
}

/// A leaf of a finished tree.
#[derive(Clone, Copy, Debug)]
pub struct Leaf<'a, N> {
    /// Where.
    pub cell: Cell,
    /// Which of its sides have a corner in the middle.
    pub sides: Sides,
    /// What [`Refine::judge`] said of this cell with these sides.
    pub note: &'a N,
    /// Was it to be split, had there been a finer level?
    pub unfinished: bool,
}

/// A restricted quadtree.
#[derive(Clone, Debug)]
pub struct Quadtree<N> {
    roots: [u32; 2],
    finest: u32,
    nodes: Vec<(Cell, Node<N>)>,
}

/// A point of the lattice that leaves have their corners and centres on: half the finest cell apart.
pub type Point = [u32; 2];

/// The deepest level that indices of lattice points have room for, with up to 64 roots a side.
pub const MAX_LEVEL: u32 = 20;

impl<N: Clone + Send + Sync> Quadtree<N> {
    /// The tree over `roots` columns and rows of roots (at least one and at most 64 each; clamped), no finer than
    /// level `finest` (at most [`MAX_LEVEL`]). Every leaf was judged with the sides that it ends with. The result does
    /// not depend on the number of threads.
    pub fn build<R: Refine<Note = N>>(roots: [u32; 2], finest: u32, refine: &R) -> Quadtree<N> {
        Quadtree::grow(roots, finest, refine, true)
    }

    /// As [`Quadtree::build`], but `restricted` says whether neighbours are kept within one level and given corners:
    /// a tree without shows what the rule is for.
    pub(super) fn grow<R: Refine<Note = N>>(roots: [u32; 2], finest: u32, refine: &R, restricted: bool) -> Quadtree<N> {
        let roots = roots.map(|n| n.clamp(1, 64));
        let mut tree = Quadtree { roots, finest: finest.min(MAX_LEVEL), nodes: Vec::new() };
        for j in 0..roots[1] {
            for i in 0..roots[0] {
                tree.nodes.push((Cell { level: 0, i, j }, Node::Leaf { judged: None, judgement: None }));
            }
        }
        let mut pending: Vec<usize> = (0..tree.nodes.len()).collect();
        while !pending.is_empty() {
            let sides: Vec<Sides> = pending
                .iter()
                .map(|&node| if restricted { tree.sides(tree.nodes[node].0) } else { Sides::default() })
                .collect();
            let judgements: Vec<Judgement<N>> = pending
                .par_iter()
                .zip(&sides)
                .map_init(
                    || refine.scratch(),
                    |scratch, (&node, &sides)| refine.judge(scratch, tree.nodes[node].0, sides),
                )
                .collect();
            let before = tree.nodes.len();
            for ((&node, sides), judgement) in pending.iter().zip(sides).zip(judgements) {
                let split = matches!(judgement, Judgement::Split(_)) && tree.nodes[node].0.level < tree.finest;
                // Making room for a neighbour may have split it already.
                if let Node::Leaf { .. } = tree.nodes[node].1 {
                    tree.nodes[node].1 = Node::Leaf { judged: Some(sides), judgement: Some(judgement) };
                    if split {
                        tree.split(node, restricted);
                    }
                }
            }
            pending =
                (before..tree.nodes.len()).filter(|&node| matches!(tree.nodes[node].1, Node::Leaf { .. })).collect();
            if pending.is_empty() && restricted {
                // All is settled but the leaves whose fan has changed since they were judged.
                pending = (0..tree.nodes.len()).filter(|&node| tree.changed(node)).collect();
            }
        }
        tree
    }

    /// Splits a leaf, after its neighbours that are larger.
    fn split(&mut self, node: usize, restricted: bool) {
        let mut stack = vec![node];
        while let Some(&node) = stack.last() {
            let (cell, Node::Leaf { .. }) = self.nodes[node] else {
                stack.pop();
                continue;
            };
            let larger = STEPS.iter().find_map(|&step| {
                let beside = self.find(self.across(cell, step)?);
                (restricted && self.nodes[beside].0.level < cell.level && !self.left_out(beside)).then_some(beside)
            });
            if let Some(beside) = larger {
                stack.push(beside);
                continue;
            }
            stack.pop();
            let first = self.nodes.len();
            for (di, dj) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let child = Cell { level: cell.level + 1, i: 2 * cell.i + di, j: 2 * cell.j + dj };
                self.nodes.push((child, Node::Leaf { judged: None, judgement: None }));
            }
            self.nodes[node].1 = Node::Inner(first);
        }
    }

    fn left_out(&self, node: usize) -> bool {
        matches!(self.nodes[node].1, Node::Leaf { judgement: Some(Judgement::LeaveOut), .. })
    }

    fn changed(&self, node: usize) -> bool {
        let (cell, Node::Leaf { judged, .. }) = &self.nodes[node] else { return false };
        !self.left_out(node) && *judged != Some(self.sides(*cell))
    }

    /// The cell of the same size across a side, if the roots reach that far.
    fn across(&self, cell: Cell, [di, dj]: [i64; 2]) -> Option<Cell> {
        let go = |at: u32, step: i64, roots: u32| {
            let to = i64::from(at) + step;
            (0..i64::from(roots) << cell.level).contains(&to).then_some(to as u32)
        };
        Some(Cell { level: cell.level, i: go(cell.i, di, self.roots[0])?, j: go(cell.j, dj, self.roots[1])? })
    }

    /// The node of `cell`, or the leaf that holds it.
    fn find(&self, cell: Cell) -> usize {
        let up = |at: u32| at >> cell.level;
        let mut node = (up(cell.j) * self.roots[0] + up(cell.i)) as usize;
        for level in (0..cell.level).rev() {
            let Node::Inner(first) = self.nodes[node].1 else { break };
            node = first + (cell.i >> level & 1) as usize + 2 * (cell.j >> level & 1) as usize;
        }
        node
    }

    fn sides(&self, cell: Cell) -> Sides {
        let finer = |step| {
            let beside = self.across(cell, step).map(|beside| &self.nodes[self.find(beside)]);
            matches!(beside, Some((at, Node::Inner(_))) if at.level == cell.level)
        };
        Sides((0..4).fold(0, |bits, k| bits | u8::from(finer(STEPS[k])) << k))
    }

    /// The leaves that are kept, in the order of their cells (level, column, row).
    pub fn leaves(&self) -> Vec<Leaf<'_, N>> {
        let mut leaves: Vec<Leaf<'_, N>> = self
            .nodes
            .iter()
            .filter_map(|(cell, node)| {
                let Node::Leaf { judged: Some(sides), judgement: Some(judgement) } = node else { return None };
                let leaf = |note, unfinished| Some(Leaf { cell: *cell, sides: *sides, note, unfinished });
                match judgement {
                    Judgement::LeaveOut => None,
                    Judgement::Keep(note) => leaf(note, false),
                    Judgement::Split(note) => leaf(note, true),
                }
            })
            .collect();
        leaves.sort_by_key(|leaf| leaf.cell);
        leaves
    }
}

/// The triangles of a cell, anticlockwise: about its centre, with a corner in the middle of each side in `sides`.
pub fn fan(finest: u32, cell: Cell, sides: Sides) -> impl Iterator<Item = [Point; 3]> + Clone {
    let half = 1u32 << (finest - cell.level);
    let (west, south) = (2 * half * cell.i, 2 * half * cell.j);
    let centre = [west + half, south + half];
    // Corners and middles of sides, from the south-west corner on.
    let ring = [[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
    let ring = ring.map(|[i, j]| [west + i * half, south + j * half]);
    (0..4).flat_map(move |side| {
        let (from, middle, to) = (ring[2 * side], ring[2 * side + 1], ring[(2 * side + 2) % 8]);
        let first = if sides.has(side) { middle } else { to };
        let second = sides.has(side).then_some([centre, middle, to]);
        std::iter::once([centre, from, first]).chain(second)
    })
}

/// Lattice points along each side of the roots: coordinates run from 0 to these, both included.
pub fn lattice(roots: [u32; 2], finest: u32) -> [u32; 2] {
    roots.map(|n| n << (finest + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Splits what meets the points of a list, down to the finest level; leaves out what lies south of a row.
    struct Spots {
        spots: Vec<[f64; 2]>,
        finest: u32,
        bare: f64,
    }

    impl Refine for Spots {
        type Note = Sides;
        type Scratch = ();
        fn scratch(&self) {}
        fn judge(&self, (): &mut (), cell: Cell, sides: Sides) -> Judgement<Sides> {
            let side = 1.0 / f64::from(1u32 << cell.level);
            let (x, y) = (f64::from(cell.i) * side, f64::from(cell.j) * side);
            let inside = |p: &[f64; 2]| p[0] >= x && p[0] < x + side && p[1] >= y && p[1] < y + side;
            if y + side <= self.bare {
                Judgement::LeaveOut
            } else if cell.level < self.finest && self.spots.iter().any(inside) {
                Judgement::Split(sides)
            } else {
                Judgement::Keep(sides)
            }
        }
    }

    fn area([a, b, c]: [Point; 3]) -> i64 {
        let [a, b, c] = [a, b, c].map(|p| p.map(i64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Whether the side of the leaf in the finest cells' units is met by leaves at most one level away.
    fn restricted(tree: &Quadtree<Sides>) -> bool {
        tree.leaves().iter().all(|leaf| {
            STEPS.iter().all(|&step| {
                let Some(beside) = tree.across(leaf.cell, step) else { return true };
                let found = tree.find(beside);
                tree.left_out(found) || tree.nodes[found].0.level + 1 >= leaf.cell.level
            })
        })
    }

    proptest! {
        #[test]
        fn leaves_tile_the_roots_and_neighbours_differ_by_one_level(
            spots in prop::collection::vec([0.0f64..3.0, 0.0f64..2.0], 1..6), finest in 1u32..7,
        ) {
            let refine = Spots { spots, finest, bare: 0.0 };
            let tree = Quadtree::build([3, 2], finest, &refine);
            prop_assert!(restricted(&tree));
            let mut twice = 0;
            for leaf in tree.leaves() {
                prop_assert_eq!(*leaf.note, leaf.sides);
                for triangle in fan(finest, leaf.cell, leaf.sides) {
                    prop_assert!(area(triangle) > 0);
                    twice += area(triangle);
                }
            }
            let [width, height] = lattice([3, 2], finest).map(i64::from);
            prop_assert_eq!(twice, 2 * width * height);
        }
    }

    #[test]
    fn an_unrestricted_tree_is_not_restricted() {
        let refine = Spots { spots: vec![[0.501, 0.501]], finest: 6, bare: 0.0 };
        assert!(!restricted(&Quadtree::grow([1, 1], 6, &refine, false)));
        assert!(restricted(&Quadtree::build([1, 1], 6, &refine)));
    }

    #[test]
    fn what_is_left_out_is_not_split_for_its_neighbours() {
        let refine = Spots { spots: vec![[0.1, 0.51]], finest: 6, bare: 0.5 };
        let tree = Quadtree::build([1, 1], 6, &refine);
        assert!(tree.leaves().iter().all(|leaf| leaf.cell.j >= 1 << leaf.cell.level >> 1));
        let bare = tree.nodes.iter().filter(|(cell, _)| cell.level == 1 && cell.j == 0);
        assert!(bare.map(|(_, node)| matches!(node, Node::Leaf { .. })).eq([true, true]));
    }
}
