//! The focus of a program: every instruction that depends on κ gets the focus as seen from its own frame.

use super::{Instruction, Program};
use crate::detail::{self, Focus, FocusSlot};
use crate::operator::{Combine, Frame};
use crate::primitive::Leaf;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Program {
    /// The same program with full detail at `focus` and less further off; with `None`, or a focus that is not sound,
    /// full detail everywhere.
    #[must_use]
    pub fn with_focus(&self, focus: Option<&Focus>) -> Program {
        let focus = focus.copied().filter(Focus::is_sound);
        let mut parameters = (*self.parameters).clone();
        let mut code = self.code.clone();
        let mut frames = Vec::new();
        let mut here = focus;
        // What was stored where: instances in one frame share their parameters, in several each has its own.
        let mut stored: BTreeMap<u32, Vec<(u32, [f64; detail::WIDTH])>> = BTreeMap::new();
        let mut store = |at: u32, slot: FocusSlot, here: Option<Focus>| {
            let wanted = detail::parameters(here.as_ref());
            let copies = stored.entry(at).or_default();
            if let Some((known, _)) = copies.iter().find(|(_, has)| *has == wanted) {
                return *known;
            }
            let first = at as usize;
            let to = if copies.is_empty() {
                first
            } else {
                parameters.extend_from_within(first..first + slot.count);
                parameters.len() - slot.count
            };
            parameters[to + slot.offset..to + slot.offset + detail::WIDTH].copy_from_slice(&wanted);
            copies.push((to as u32, wanted));
            to as u32
        };
        for instruction in &mut code {
            match instruction {
                Instruction::Leaf(leaf) => {
                    if let Some(slot) = leaf.focus() {
                        *leaf = leaf.stored_at(store(leaf.at(), slot, here));
                    }
                }
                Instruction::Combine(operator) => {
                    if let Some(slot) = operator.focus() {
                        *operator = operator.stored_at(store(operator.at(), slot, here));
                    }
                }
                Instruction::Enter(map) => {
                    frames.push(here);
                    let p = self.tail(map.at());
                    here = here.map(|focus| map.focus(p, focus));
                }
                Instruction::Leave(_) => here = frames.pop().flatten(),
            }
        }
        Program { code, parameters: Arc::new(parameters), ..self.clone() }
    }
    /// Octaves of noise that an evaluation may visit.
    pub fn octaves(&self) -> usize {
        self.code.iter().map(|i| if let Instruction::Leaf(leaf) = i { leaf.octaves() } else { 0 }).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Combination, Octaves};
    use crate::operator::affine::Similarity;
    use crate::primitive::detail_disc::DetailDisc;
    use crate::primitive::disc::{Disc, DiscNoise};
    use crate::tree::{Node, Tree};
    use glam::{DVec2, DVec3};

    #[test]
    fn instances_see_the_focus_of_the_world_from_their_own_frames() {
        let octaves = Octaves { octaves: 5, frequency: 0.01, lacunarity: 2.0, gain: 0.5, amplitude: 30.0 };
        let noise = Some(DiscNoise { combination: Combination::Sum, octaves, seed: 9 });
        let disc = Disc { centre: DVec3::ZERO, radius: 500.0, weight: 1.0, noise };
        let mut tree = Tree::new();
        let node = tree.push(DetailDisc { disc, filters: DetailDisc::even_filters(5) });
        let map = |x: f64, scale: f64| Similarity {
            scale,
            rotation: 0.7,
            translation: DVec2::new(x, 30.0),
            ..Similarity::default()
        };
        let (a, b) = (map(-2000.0, 1.5), map(2000.0, 0.5));
        let near = tree.push(Node::Affine { node, map: a });
        let far = tree.push(Node::Affine { node, map: b });
        let root = tree.push(Node::Blend(vec![near, far]));
        let focus = Focus { position: DVec2::new(-2000.0, 0.0), near: 300.0, far: 3000.0 };
        let bare = Program::compile(&tree, root).expect("it compiles");
        let program = bare.with_focus(Some(&focus));
        // The near one has all its octaves, the far one the first alone, whatever its scale.
        assert_eq!(
            program
                .prune(crate::bounds::Region::rectangle(DVec2::new(-2000.0, 0.0), DVec2::new(-1990.0, 10.0)))
                .octaves(),
            5
        );
        assert_eq!(
            program
                .prune(crate::bounds::Region::rectangle(DVec2::new(2000.0, 0.0), DVec2::new(2010.0, 10.0)))
                .octaves(),
            1
        );
        assert_eq!(program.height(DVec2::new(-1995.0, 5.0)), bare.height(DVec2::new(-1995.0, 5.0)));
        assert_ne!(program.height(DVec2::new(2005.0, 5.0)), bare.height(DVec2::new(2005.0, 5.0)));
        // A second focus replaces the first, none restores the whole.
        assert_eq!(program.with_focus(None).height(DVec2::new(2005.0, 5.0)), bare.height(DVec2::new(2005.0, 5.0)));
    }
}
