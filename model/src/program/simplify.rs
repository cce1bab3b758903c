//! Lossy pruning: what is too gentle to matter leaves the program, and the elevation it can cost is returned as a bound.
//! Exact pruning ([`Program::prune`]) changes nothing; this trades metres for steps and octaves.

use super::{Instruction, Program};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::operator::{BlendRule, Combine, Frame, Operator, WeightRule};
use crate::primitive::Leaf;
use std::sync::Arc;

/// An operand: where its code starts, its bounds, and how far its elevation may be off, metres.
#[derive(Clone, Copy)]
struct Kept {
    start: usize,
    bounds: Bounds,
    error: f64,
}

impl Program {
    /// A shorter program for a region, with how far its elevations there can be from those of this one, metres. Weights
    /// stay as they are.
    ///
    /// The last octaves of a sum or turbulence leave while together they are no steeper than `slope` (metres per metre),
    /// and so does the second operand of an addition that changes no weight and is no steeper.
    ///
    /// Errors add up as elevations do: a blend, a replacement and a passage of detail average their operands, an addition
    /// adds them, a map scales them, and [`Combine::error`] says so for each.
    #[must_use]
    pub fn simplify(&self, region: Region, slope: f64) -> (Program, f64) {
        let tables = self.tables();
        let mut noises = (*self.noises).clone();
        let mut code: Vec<Instruction> = Vec::with_capacity(self.code.len());
        let mut stack: Vec<Kept> = Vec::new();
        let mut frames = Vec::new();
        let mut here = region;
        for instruction in &self.code {
            match instruction {
                Instruction::Leaf(leaf) => {
                    let p = self.tail(leaf.at());
                    let bounds = leaf.bounds(p, tables, &here);
                    let (leaf, error) = leaf.simplified(p, tables, &here, slope, &mut noises);
                    stack.push(Kept { start: code.len(), bounds, error });
                    code.push(Instruction::Leaf(leaf));
                }
                Instruction::Enter(map) => {
                    frames.push((here, code.len()));
                    here = map.enter_region(self.tail(map.at()), &here);
                    code.push(*instruction);
                }
                Instruction::Leave(map) => {
                    let (Some((outside, start)), Some(inner)) = (frames.pop(), stack.pop()) else { continue };
                    here = outside;
                    let p = self.tail(map.at());
                    let bounds = map.leave_bounds(p, &here, inner.bounds);
                    stack.push(Kept { start, bounds, error: map.error(p, inner.error) });
                    code.push(*instruction);
                }
                Instruction::Combine(operator) => {
                    let p = self.tail(operator.at());
                    let parts = stack.split_off(stack.len() - operator.operands());
                    let bounds: Vec<Bounds> = parts.iter().map(|part| part.bounds).collect();
                    let errors: Vec<f64> = parts.iter().map(|part| part.error).collect();
                    let whole = operator.bounds(p, BlendRule::Corrected, &here, &bounds);
                    let start = parts.first().map_or(code.len(), |part| part.start);
                    let mut error = operator.error(p, &bounds, &errors);
                    if let (Operator::Add(add), [a, b]) = (operator, &parts[..])
                        && add.rule == WeightRule::Keep
                        && let height = b.bounds.elevation.magnitude()
                        && plus_up(b.bounds.weighted_slope, times_up(b.bounds.weight_slope, height)) <= slope
                    {
                        code.truncate(b.start);
                        error = plus_up(a.error, times_up(b.bounds.weight.hi().min(1.0), height));
                    } else {
                        code.push(*instruction);
                    }
                    stack.push(Kept { start, bounds: whole, error });
                }
            }
        }
        let error = stack.first().map_or(0.0, |kept| kept.error);
        (Program { code, noises: Arc::new(noises), ..self.clone() }, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Combination, Octaves};
    use crate::operator::affine::Similarity;
    use crate::operator::masked::{Joining, Mask, Ramp};
    use crate::primitive::disc::{Disc, DiscNoise};
    use crate::tree::{Node, NodeId, Tree};
    use glam::{DVec2, DVec3};

    fn disc(tree: &mut Tree, z: f64, seed: u32, combination: Combination, amplitude: f64) -> NodeId {
        let octaves = Octaves { octaves: 7, frequency: 0.003, lacunarity: 2.0, gain: 0.35, amplitude };
        let noise = DiscNoise { combination, octaves, seed };
        tree.push(Disc { centre: DVec3::new(5.0 * z, 0.0, z), radius: 900.0, weight: 1.0, noise: Some(noise) })
    }

    /// Hills, blended, scaled, with bumps added and sand on what is gentle.
    fn program() -> Program {
        let mut tree = Tree::new();
        let (a, b) = (
            disc(&mut tree, -20.0, 3, Combination::Sum, 60.0),
            disc(&mut tree, 30.0, 4, Combination::Turbulence, 50.0),
        );
        let hills = tree.push(Node::Blend(vec![a, b]));
        let bumps = disc(&mut tree, 0.0, 5, Combination::Sum, 0.01);
        let hills = tree.push(Node::Add { a: hills, b: bumps, rule: WeightRule::Keep });
        let sand = disc(&mut tree, 0.0, 6, Combination::Ridged { offset: 0.8, sharpness: 2.0 }, 3.0);
        let mask = Mask {
            probe: 4.0,
            elevation: Some(Ramp { full: 20.0, none: 60.0 }),
            slope: Some(Ramp { full: 0.2, none: 1.5 }),
            joining: Joining::Add,
        };
        let sandy = tree.push(Node::Masked { a: hills, b: sand, mask });
        let map = Similarity { scale: 0.8, elevation_scale: 1.4, rotation: 0.4, ..Similarity::default() };
        let root = tree.push(Node::Affine { node: sandy, map });
        Program::compile(&tree, root).expect("it compiles")
    }

    #[test]
    fn what_leaves_costs_no_more_than_the_bound_says() {
        let program = program();
        let region = Region::rectangle(DVec2::splat(-300.0), DVec2::splat(300.0));
        let whole = program.simplify(region, 0.0);
        assert_eq!((whole.1, whole.0.octaves(), whole.0.code().len()), (0.0, program.octaves(), program.code().len()));
        let mut last = program.octaves();
        for slope in [0.05, 0.12, 0.3] {
            let (simple, error) = program.simplify(region, slope);
            assert!(simple.octaves() < last && simple.code().len() < program.code().len(), "{slope}");
            last = simple.octaves();
            let mut worst = 0.0f64;
            for k in 0..100 * 100 {
                let at = DVec2::new(-300.0 + 6.0 * f64::from(k % 100), -300.0 + 6.0 * f64::from(k / 100));
                let (x, y) = (program.height(at), simple.height(at));
                assert_eq!(x.1, y.1, "a weight moved");
                worst = worst.max((x.0 - y.0).abs());
            }
            // Control: a bound of a hundredth would be wrong, so the error is neither nothing nor vacuous.
            assert!(worst <= error + 1e-9 && worst > 0.01 * error, "{slope}: {worst} {error}");
            assert!(simple.bounds(region).slope < program.bounds(region).slope);
        }
    }
}
