//! Primitives that do nothing for a picture: each is taken out of its tree in turn, and the pixels that this changes are
//! counted on a part of them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use terrain_model::bounds::THRESHOLD;
use terrain_model::program::{Certified, Evaluator, Program};
use terrain_model::tree::{Node, NodeId, Tree};

/// A point of the ground that a pixel shows.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where, metres.
    pub at: DVec3,
    /// What the pixel covers there, metres.
    pub footprint: f64,
}

/// A pixel has changed when its ground is higher or lower by this part of its footprint.
const VISIBLE: f64 = 0.1;

/// The tree below `root` without the primitive `removed`, wherever it is used. What a node is left with when an operand goes is
/// the other; `None` when nothing is left.
fn without(tree: &Tree, root: NodeId, removed: NodeId) -> Option<(Tree, NodeId)> {
    let mut out = Tree::new();
    let mut known = BTreeMap::new();
    let root = copy(tree, root, removed, &mut out, &mut known)?;
    Some((out, root))
}

fn copy(
    tree: &Tree,
    id: NodeId,
    removed: NodeId,
    out: &mut Tree,
    known: &mut BTreeMap<NodeId, Option<NodeId>>,
) -> Option<NodeId> {
    if id == removed {
        return None;
    }
    if let Some(done) = known.get(&id) {
        return *done;
    }
    let mut go = |id: NodeId| copy(tree, id, removed, out, known);
    let pair = |a: Option<NodeId>, b: Option<NodeId>| a.zip(b).ok_or(a.or(b));
    let node = match tree.node(id) {
        Node::Primitive(primitive) => Ok(Node::Primitive(primitive.clone())),
        Node::Blend(list) => {
            let left: Vec<NodeId> = list.iter().filter_map(|operand| go(*operand)).collect();
            if left.is_empty() { Err(None) } else { Ok(Node::Blend(left)) }
        }
        Node::Replace { a, b, rule } => pair(go(*a), go(*b)).map(|(a, b)| Node::Replace { a, b, rule: *rule }),
        Node::Add { a, b, rule } => pair(go(*a), go(*b)).map(|(a, b)| Node::Add { a, b, rule: *rule }),
        Node::Lod { a, b, lod } => pair(go(*a), go(*b)).map(|(a, b)| Node::Lod { a, b, lod: *lod }),
        Node::Masked { a, b, mask } => pair(go(*a), go(*b)).map(|(a, b)| Node::Masked { a, b, mask: *mask }),
        Node::Warp { node, warp } => go(*node).map(|node| Node::Warp { node, warp: warp.clone() }).ok_or(None),
        Node::Affine { node, map } => go(*node).map(|node| Node::Affine { node, map: *map }).ok_or(None),
    };
    let made = match node {
        Ok(node) => Some(out.push(node)),
        Err(other) => other,
    };
    known.insert(id, made);
    made
}

/// The primitives below `root`, and whether a map of the plane, or a mask, stands anywhere above one.
pub fn primitives(tree: &Tree, root: NodeId) -> (Vec<NodeId>, bool) {
    let mut pending = vec![root];
    let mut seen = BTreeMap::new();
    let mut moved = false;
    while let Some(id) = pending.pop() {
        if seen.insert(id, matches!(tree.node(id), Node::Primitive(_))).is_some() {
            continue;
        }
        moved |= matches!(tree.node(id), Node::Warp { .. } | Node::Affine { .. } | Node::Masked { .. });
        pending.extend(terrain_model::tree::operands(tree.node(id)));
    }
    (seen.into_iter().filter_map(|(id, primitive)| primitive.then_some(id)).collect(), moved)
}

/// For each of these primitives below `root`, on how many of the points the ground changes without it.
///
/// # Errors
/// A tree that does not compile without one.
pub fn changes(
    tree: &Tree,
    root: NodeId,
    (chosen, moved): (&[NodeId], bool),
    focus: impl Fn(Program) -> Program + Sync,
    seen: &[Seen],
) -> Result<Vec<u64>, String> {
    // What stays is certified once.
    let certified = Certified::default();
    let compile = |tree: &Tree, root| {
        Program::compile_with(tree, root, &certified).map(&focus).map_err(|error| error.to_string())
    };
    let whole = compile(tree, root)?;
    let heights = |program: &Program, points: &mut dyn Iterator<Item = &Seen>| -> Vec<(f64, f64)> {
        let mut evaluator = Evaluator::new(program);
        points.map(|p| evaluator.run(program, [p.at.x, p.at.y])).collect()
    };
    chosen
        .par_iter()
        .map(|removed| {
            // Outside its own support, which is known where nothing moves it, a primitive changes nothing.
            let support = if moved { None } else { compile(tree, *removed)?.support() };
            let inside = |p: DVec2| support.is_none_or(|(lo, hi)| p.cmpge(lo).all() && p.cmple(hi).all());
            let near: Vec<&Seen> = seen.iter().filter(|p| inside(p.at.truncate())).collect();
            let Some((tree, root)) = without(tree, root, *removed) else { return Ok(near.len() as u64) };
            let before = heights(&whole, &mut near.iter().copied());
            let after = heights(&compile(&tree, root)?, &mut near.iter().copied());
            let differs = |k: &usize| {
                let ((f, a), (g, b)) = (before[*k], after[*k]);
                (a >= THRESHOLD) != (b >= THRESHOLD) || (f - g).abs() > VISIBLE * near[*k].footprint
            };
            Ok((0..near.len()).filter(differs).count() as u64)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain_model::primitive::disc::Disc;

    #[test]
    fn a_primitive_that_does_nothing_is_found() {
        let disc = |x: f64, z: f64| Disc { centre: DVec3::new(x, 0.0, z), radius: 50.0, weight: 1.0, noise: None };
        let mut tree = Tree::new();
        let plain = tree.push(Disc { radius: 1000.0, ..disc(0.0, 0.0) });
        let hill = tree.push(disc(0.0, 30.0));
        // As high as the plain around it, and out of sight.
        let idle = tree.push(disc(100.0, 0.0));
        let away = tree.push(disc(400.0, 30.0));
        let root = tree.push(Node::Blend(vec![plain, hill, idle, away]));
        let seen: Vec<Seen> =
            (-200..200).map(|k| Seen { at: DVec3::new(f64::from(k), 0.0, 0.0), footprint: 1.0 }).collect();
        let (all, moved) = primitives(&tree, root);
        let counts = changes(&tree, root, (&all, moved), |program| program, &seen).unwrap();
        assert_eq!(counts.iter().filter(|count| **count == 0).count(), 2, "{counts:?}");
        assert!(counts[0] > 300 && counts[1] > 60, "{counts:?}");
    }
}
