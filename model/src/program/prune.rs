//! Exact pruning to a box: what is left computes, in f64, the same bits on the box. Child order and the order of every
//! sum are kept; a term that is dropped was exactly 0.

use super::layout::depth;
use super::{Instruction, Program};
use crate::bounds::Region;
use crate::interval::Interval;
use crate::operator::{Combine, Fate, Frame, Operator, Part, Pruned, blend, both_needed};
use crate::primitive::Leaf;
use crate::real::Operand;

/// How it is known that a primitive has no weight on a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// By the range of its weight that the primitive itself gives.
    Ranges,
    /// By running its formula on the box, as the certified tracer does: nothing that `bounds` relies on is asked, so what
    /// the level of detail filters out stays.
    Enclosures,
}

/// What became of an instruction's subtree.
#[derive(Clone, Copy, Debug)]
struct Kept {
    /// First instruction of the subtree in the new code.
    start: usize,
    part: Part,
}

/// Prunes one program to many boxes, reusing its stacks. It asks for weights alone, which cost a fraction of what
/// [`super::BoundsEvaluator`] derives.
#[derive(Debug)]
pub struct Pruner<'a> {
    program: &'a Program,
    evidence: Evidence,
    finest: f64,
    stack: Vec<Kept>,
    parts: Vec<Part>,
    fates: Vec<Fate>,
    /// Where each open frame starts in the new code, and the region seen from outside it.
    opened: Vec<(usize, Region)>,
}

impl Program {
    /// The program for a box. Two rules: an operand with α ≡ 0 leaves (in a blend its term is +0; in a replacement or
    /// an addition of weight rule *keep* the result is operand A, bit for bit); where α_B ≡ 1 in a replacement, A is
    /// needed for its weight alone and its noises go; an octave or an operand that the level of detail filters out on the
    /// whole box leaves.
    pub fn prune(&self, region: Region) -> Program {
        Pruner::new(self).prune(region)
    }
}

impl<'a> Pruner<'a> {
    /// A pruner of `program`.
    pub fn new(program: &'a Program) -> Pruner<'a> {
        Pruner::with_evidence(program, Evidence::Ranges)
    }
    /// The same by the evidence given.
    pub fn with_evidence(program: &'a Program, evidence: Evidence) -> Pruner<'a> {
        Pruner {
            program,
            evidence,
            finest: f64::INFINITY,
            stack: Vec::new(),
            parts: Vec::new(),
            fates: Vec::new(),
            opened: Vec::new(),
        }
    }
    /// The least grain ([`Leaf::grain`]) of the primitives that began or ended in the last box, metres; infinite when none
    /// did. Smaller boxes are pruned better down to about this width.
    pub fn finest(&self) -> f64 {
        self.finest
    }
    /// [`Program::prune`] to the next box.
    pub fn prune(&mut self, region: Region) -> Program {
        let Pruner { program, evidence, finest, stack, parts, fates, opened } = self;
        let proved = *evidence == Evidence::Enclosures;
        *finest = f64::INFINITY;
        let mut code: Vec<Instruction> = Vec::with_capacity(program.code.len());
        stack.clear();
        opened.clear();
        let mut here = region;
        for instruction in &program.code {
            match instruction {
                Instruction::Leaf(leaf) => {
                    let p = program.tail(leaf.at());
                    let weight = if proved {
                        let Operand { weight, .. } = leaf.weight_only().sample(p, program.tables(), here.extent);
                        Interval::new(weight.lo().max(0.0), weight.hi().max(0.0))
                    } else {
                        leaf.weight_range(p, &here)
                    };
                    let absent = weight.hi() <= 0.0;
                    stack.push(Kept { start: code.len(), part: Part { absent, weight } });
                    if !absent {
                        code.push(Instruction::Leaf(if proved { *leaf } else { leaf.pruned(p, &here) }));
                        if weight.lo() <= 0.0 {
                            // As seen from outside the maps that are open.
                            let scale = here.extent[0].width() / region.extent[0].width();
                            *finest = finest.min(leaf.grain(p) / scale);
                        }
                    }
                }
                Instruction::Enter(map) => {
                    opened.push((code.len(), here));
                    let p = program.tail(map.at());
                    here = if proved {
                        Region { extent: map.enter(p, here.extent), ends: None }
                    } else {
                        map.enter_region(p, &here)
                    };
                    code.push(*instruction);
                }
                Instruction::Leave(_) => {
                    let (Some((start, outside)), Some(inner)) = (opened.pop(), stack.pop()) else { continue };
                    here = outside;
                    if inner.part.absent {
                        code.truncate(start);
                    } else {
                        code.push(*instruction);
                    }
                    stack.push(Kept { start, ..inner });
                }
                Instruction::Combine(operator) => {
                    let first = stack.len() - operator.operands();
                    let start = stack.get(first).map_or(code.len(), |kept| kept.start);
                    parts.clear();
                    parts.extend(stack[first..].iter().map(|kept| kept.part));
                    fates.clear();
                    fates.resize(parts.len(), Fate::Keep);
                    let Pruned { code: left, result } = if proved && operator.focus().is_some() {
                        both_needed(parts, fates);
                        Pruned { code: Some(*operator), result: Part { absent: false, weight: UNKNOWN } }
                    } else {
                        operator.prune(program.tail(operator.at()), &here, parts, fates)
                    };
                    settle(&mut code, &stack[first..], fates);
                    stack.truncate(first);
                    code.extend(left.map(Instruction::Combine));
                    stack.push(Kept { start, part: result });
                }
            }
        }
        let depth = depth(&code);
        Program { code, depth, ..(*program).clone() }
    }
}

/// Carries out what was decided for the operands, the last first, so that the places of the others stand.
fn settle(code: &mut Vec<Instruction>, operands: &[Kept], fates: &[Fate]) {
    let mut end = code.len();
    for (kept, fate) in operands.iter().zip(fates).rev() {
        match fate {
            Fate::Keep => {}
            Fate::Drop => {
                code.drain(kept.start..end);
            }
            Fate::WeightOnly => {
                for instruction in &mut code[kept.start..end] {
                    if let Instruction::Leaf(leaf) = instruction {
                        *leaf = leaf.weight_only();
                    }
                }
            }
            Fate::Empty => code.insert(kept.start, EMPTY),
        }
        end = kept.start;
    }
}

/// A weight of which nothing is known.
const UNKNOWN: Interval = Interval::FROM_ZERO;

/// What stands for an operand that left no code: elevation 0, weight 0.
const EMPTY: Instruction = Instruction::Combine(Operator::Blend(blend::Code { operands: 0 }));
