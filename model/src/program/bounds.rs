//! Bounds of the whole program over a box or a segment, by the same stack machine.

use super::{Instruction, Program};
use crate::bounds::{Bounds, Region};
use crate::operator::{BlendRule, Combine, Frame};
use crate::primitive::{Extent, Leaf};

/// Computes bounds of a program over regions, reusing its stacks.
#[derive(Debug)]
pub struct BoundsEvaluator<'a> {
    program: &'a Program,
    rule: BlendRule,
    stack: Vec<Bounds>,
    frames: Vec<Region>,
}

impl<'a> BoundsEvaluator<'a> {
    /// Bounds by the corrected rules.
    pub fn new(program: &'a Program) -> BoundsEvaluator<'a> {
        BoundsEvaluator::with_rule(program, BlendRule::Corrected)
    }
    /// Bounds with the blend rule given: the paper's is kept to show what it misses.
    pub fn with_rule(program: &'a Program, rule: BlendRule) -> BoundsEvaluator<'a> {
        BoundsEvaluator { program, rule, stack: Vec::new(), frames: Vec::new() }
    }
    /// Bounds over a region.
    pub fn bounds(&mut self, region: Region) -> Bounds {
        self.bounds_of(self.program, region)
    }
    /// Bounds over a region of another program, as one pruned to a box around the region is.
    pub fn bounds_of(&mut self, program: &Program, region: Region) -> Bounds {
        let BoundsEvaluator { rule, stack, frames, .. } = self;
        let tables = program.tables();
        stack.clear();
        frames.clear();
        let mut here = region;
        for instruction in &program.code {
            match instruction {
                Instruction::Leaf(leaf) => stack.push(leaf.bounds(program.tail(leaf.at()), tables, &here)),
                Instruction::Combine(operator) => {
                    let first = stack.len() - operator.operands();
                    let result = operator.bounds(program.tail(operator.at()), *rule, &here, &stack[first..]);
                    stack.truncate(first);
                    stack.push(result);
                }
                Instruction::Enter(map) => {
                    frames.push(here);
                    here = map.enter_region(program.tail(map.at()), &here);
                }
                Instruction::Leave(map) => {
                    let (Some(outside), Some(inner)) = (frames.pop(), stack.pop()) else { continue };
                    here = outside;
                    stack.push(map.leave_bounds(program.tail(map.at()), &here, inner));
                }
            }
        }
        stack.first().copied().unwrap_or(Bounds::ABSENT)
    }
}

impl Program {
    /// Bounds over a region, by the corrected rules. Hot loops keep a [`BoundsEvaluator`].
    pub fn bounds(&self, region: Region) -> Bounds {
        BoundsEvaluator::new(self).bounds(region)
    }
    /// A box that holds the support {α > 0}, as (south-west, north-east) corners, metres; `None` for an empty program.
    pub fn support(&self) -> Option<Extent> {
        let mut stack: Vec<Option<Extent>> = Vec::new();
        for instruction in &self.code {
            match instruction {
                Instruction::Leaf(leaf) => stack.push(leaf.support(self.tail(leaf.at()))),
                Instruction::Combine(operator) => {
                    let first = stack.len() - operator.operands();
                    let result = operator.support(&stack[first..]);
                    stack.truncate(first);
                    stack.push(result);
                }
                Instruction::Enter(_) => {}
                Instruction::Leave(map) => {
                    let inner = stack.pop().flatten();
                    stack.push(inner.and_then(|inner| map.support(self.tail(map.at()), inner)));
                }
            }
        }
        stack.pop().flatten()
    }
}
