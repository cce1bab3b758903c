//! Exact pruning to a box: what is left computes, in f64, the same bits on the box. Child order and the order of every
//! sum are kept; a term that is dropped was exactly 0.

use super::{BoundsEvaluator, Instruction, Program};
use crate::bounds::{Bounds, Region};

/// What became of an instruction's subtree.
#[derive(Clone, Copy)]
struct Kept {
    /// First instruction of the subtree in the new code.
    start: usize,
    /// Its weight is exactly 0 on the box.
    absent: bool,
}

impl Program {
    /// The program for a box. Two rules: an operand with α ≡ 0 leaves (in a blend its term is +0; in a replacement or
    /// an addition of weight rule *keep* the result is operand A, bit for bit); where α_B ≡ 1 in a replacement, A is
    /// needed for its weight alone and its noises go.
    pub fn prune(&self, region: Region) -> Program {
        self.prune_with(&mut BoundsEvaluator::new(self), region)
    }
    /// [`Program::prune`] with an evaluator kept between boxes.
    pub fn prune_with(&self, evaluator: &mut BoundsEvaluator<'_>, region: Region) -> Program {
        let mut code: Vec<Instruction> = Vec::with_capacity(self.code.len());
        let mut stack: Vec<Kept> = Vec::new();
        let mut opened: Vec<usize> = Vec::new();
        let mut visited = vec![(Bounds::ABSENT, Bounds::ABSENT); self.code.len()];
        evaluator.visit(region, |index, operands, result| {
            visited[index] = (operands.get(1).copied().unwrap_or(Bounds::ABSENT), *result);
        });
        for (index, instruction) in self.code.iter().enumerate() {
            let (second, result) = visited[index];
            match *instruction {
                Instruction::Enter { .. } => {
                    opened.push(code.len());
                    code.push(*instruction);
                }
                Instruction::Leave { .. } => {
                    let start = opened.pop().unwrap_or(0);
                    let inner = stack.pop().unwrap_or(Kept { start, absent: true });
                    if inner.absent {
                        code.truncate(start);
                    } else {
                        code.push(*instruction);
                    }
                    stack.push(Kept { start, absent: inner.absent });
                }
                Instruction::Blend { operands } => {
                    let parts = stack.split_off(stack.len() - usize::from(operands));
                    let kept = parts.iter().filter(|part| !part.absent).count();
                    let start = parts[0].start;
                    if kept > 0 {
                        code.push(Instruction::Blend { operands: kept as u16 });
                    }
                    stack.push(Kept { start, absent: kept == 0 });
                }
                Instruction::Replace { rule } => {
                    let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                    if rule != crate::operator::WeightRule::Keep {
                        // Both weights enter the result: dropping either would change its rounding.
                        Self::restore(&mut code, &a, &b);
                        code.push(*instruction);
                        stack.push(Kept { start: a.start, absent: false });
                    } else if a.absent || b.absent {
                        code.truncate(b.start);
                        stack.push(a);
                    } else {
                        if second.weight.lo() >= 1.0 {
                            for old in &mut code[a.start..b.start] {
                                if let Instruction::NoiseDisc { at, .. } = *old {
                                    *old = Instruction::Disc { at };
                                }
                            }
                        }
                        code.push(*instruction);
                        stack.push(a);
                    }
                }
                Instruction::Add { rule } => {
                    let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                    if rule != crate::operator::WeightRule::Keep {
                        Self::restore(&mut code, &a, &b);
                        code.push(*instruction);
                        stack.push(Kept { start: a.start, absent: false });
                    } else {
                        if a.absent || b.absent {
                            code.truncate(b.start);
                        } else {
                            code.push(*instruction);
                        }
                        stack.push(a);
                    }
                }
                _ => {
                    let start = code.len();
                    if !result.is_absent() {
                        code.push(*instruction);
                    }
                    stack.push(Kept { start, absent: result.is_absent() });
                }
            }
        }
        Program { code, ..self.clone() }
    }
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
