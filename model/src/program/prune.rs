//! Exact pruning to a box: what is left computes, in f64, the same bits on the box. Child order and the order of every
//! sum are kept; a term that is dropped was exactly 0.

use super::{Instruction, Program};
use crate::bounds::Region;
use crate::interval::Interval;
use crate::operator::{self, WeightRule};
use crate::primitive::{Parameters, curve, disc, image};
use crate::real::Real;

/// What became of an instruction's subtree.
#[derive(Clone, Copy, Debug)]
struct Kept {
    /// First instruction of the subtree in the new code.
    start: usize,
    /// Its weight is exactly 0 on the box.
    absent: bool,
    /// Encloses its weight on the box.
    weight: Interval,
}

/// Prunes one program to many boxes, reusing its stacks. It asks for weights alone, which cost a fraction of what
/// [`super::BoundsEvaluator`] derives.
#[derive(Debug)]
pub struct Pruner<'a> {
    program: &'a Program,
    stack: Vec<Kept>,
    /// Where each open frame starts in the new code, and the region seen from outside it.
    opened: Vec<(usize, Region)>,
}

impl Program {
    /// The program for a box. Two rules: an operand with α ≡ 0 leaves (in a blend its term is +0; in a replacement or
    /// an addition of weight rule *keep* the result is operand A, bit for bit); where α_B ≡ 1 in a replacement, A is
    /// needed for its weight alone and its noises go.
    pub fn prune(&self, region: Region) -> Program {
        Pruner::new(self).prune(region)
    }
}

impl<'a> Pruner<'a> {
    /// A pruner of `program`.
    pub fn new(program: &'a Program) -> Pruner<'a> {
        Pruner { program, stack: Vec::new(), opened: Vec::new() }
    }
    /// [`Program::prune`] to the next box.
    pub fn prune(&mut self, region: Region) -> Program {
        let Pruner { program, stack, opened } = self;
        let mut code: Vec<Instruction> = Vec::with_capacity(program.code.len());
        stack.clear();
        opened.clear();
        let mut here = region;
        for instruction in &program.code {
            let tail = |at: u32| Parameters(&program.parameters[at as usize..]);
            let weight = match *instruction {
                Instruction::Disc { at } | Instruction::NoiseDisc { at, .. } => disc::weight_range(tail(at), &here),
                Instruction::Curve { at, segments, .. } => curve::weight_range(tail(at), usize::from(segments), &here),
                Instruction::Image { at, .. } => image::weight_range(tail(at), &here),
                Instruction::Enter { at } => {
                    opened.push((code.len(), here));
                    here = operator::enter_region(tail(at), &here);
                    code.push(*instruction);
                    continue;
                }
                Instruction::Leave { .. } => {
                    let (Some((start, outside)), Some(inner)) = (opened.pop(), stack.pop()) else { continue };
                    here = outside;
                    if inner.absent {
                        code.truncate(start);
                    } else {
                        code.push(*instruction);
                    }
                    stack.push(Kept { start, ..inner });
                    continue;
                }
                Instruction::Blend { operands } => {
                    let first = stack.len() - usize::from(operands);
                    let parts = &stack[first..];
                    let kept = parts.iter().filter(|part| !part.absent).count();
                    let start = parts.first().map_or(code.len(), |part| part.start);
                    let weight = parts.iter().fold(Interval::ZERO, |sum, part| sum + part.weight);
                    stack.truncate(first);
                    if kept > 0 {
                        code.push(Instruction::Blend { operands: kept as u16 });
                    }
                    stack.push(Kept { start, absent: kept == 0, weight });
                    continue;
                }
                Instruction::Replace { rule } => {
                    let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                    if rule != WeightRule::Keep {
                        // Both weights enter the result: dropping either would change its rounding.
                        Program::restore(&mut code, &a, &b);
                        code.push(*instruction);
                        let t = b.weight.clamp01();
                        let weight = (Interval::point(1.0) - t) * a.weight + t.square();
                        stack.push(Kept { start: a.start, absent: false, weight });
                    } else if a.absent || b.absent {
                        code.truncate(b.start);
                        stack.push(a);
                    } else {
                        if b.weight.lo() >= 1.0 {
                            for old in &mut code[a.start..b.start] {
                                if let Instruction::NoiseDisc { at, .. } = *old {
                                    *old = Instruction::Disc { at };
                                }
                            }
                        }
                        code.push(*instruction);
                        stack.push(a);
                    }
                    continue;
                }
                Instruction::Add { rule } => {
                    let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                    if rule != WeightRule::Keep {
                        Program::restore(&mut code, &a, &b);
                        code.push(*instruction);
                        let weight = a.weight + b.weight.clamp01().square();
                        stack.push(Kept { start: a.start, absent: false, weight });
                    } else {
                        if a.absent || b.absent {
                            code.truncate(b.start);
                        } else {
                            code.push(*instruction);
                        }
                        stack.push(a);
                    }
                    continue;
                }
            };
            let absent = weight.hi() <= 0.0;
            let start = code.len();
            if !absent {
                code.push(*instruction);
            }
            stack.push(Kept { start, absent, weight });
        }
        Program { code, ..(*program).clone() }
    }
}

impl Program {
    /// An operand that both weights need but that left no code behind is written as an empty blend, which is 0 with
    /// weight 0.
    fn restore(code: &mut Vec<Instruction>, a: &Kept, b: &Kept) {
        if b.absent {
            code.push(Instruction::Blend { operands: 0 });
        }
        if a.absent {
            code.insert(a.start, Instruction::Blend { operands: 0 });
        }
    }
}
