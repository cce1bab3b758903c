//! The stack machine: one loop for the scalar reference, dual numbers, intervals and SIMD lanes.

use super::{Instruction, Program};
use crate::dual::Dual;
use crate::operator::{Combine, Frame};
use crate::primitive::{Leaf, Number, Parameters, Tables};
use crate::real::Operand;
use glam::DVec2;

/// What a query returns: elevation, weight and their gradients, from one traversal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// f, metres; 0 off the support.
    pub elevation: f64,
    /// α ≥ 0; terrain exists where it is at least [`crate::bounds::THRESHOLD`].
    pub weight: f64,
    /// ∇f, metres per metre.
    pub gradient: DVec2,
    /// ∇α, per metre.
    pub weight_gradient: DVec2,
}

/// Runs programs on numbers of type `R`, reusing its stacks.
#[derive(Debug)]
pub struct Evaluator<R> {
    stack: Vec<Operand<R>>,
    frames: Vec<[R; 2]>,
}

/// The parts of a program that the machine reads.
#[derive(Clone, Copy)]
pub(crate) struct Text<'a, P> {
    pub code: &'a [Instruction],
    pub parameters: &'a [P],
    pub tables: Tables<'a>,
}

impl<R: Number> Evaluator<R> {
    /// An evaluator with stacks deep enough for `program`.
    pub fn new(program: &Program) -> Evaluator<R> {
        Evaluator::with_depth(program.depth)
    }
    pub(crate) fn with_depth(depth: [usize; 2]) -> Evaluator<R> {
        Evaluator { stack: vec![Operand::absent(); depth[0].max(1)], frames: vec![[R::zero(); 2]; depth[1].max(1)] }
    }
    /// Elevation and weight at `x`, without the 0 that stands for elevation off the support: where the weight is 0 the
    /// elevation means nothing.
    pub fn run(&mut self, program: &Program, x: [R; 2]) -> (R, R) {
        self.reach(program.depth);
        let text = Text { code: &program.code, parameters: &program.parameters, tables: program.tables() };
        run(text, &mut self.stack, &mut self.frames, x)
    }
    /// Makes the stacks as deep as a program needs that is not the one the evaluator was made for.
    #[inline(always)]
    pub(crate) fn reach(&mut self, depth: [usize; 2]) {
        if self.stack.len() < depth[0] || self.frames.len() < depth[1] {
            *self = Evaluator::with_depth([depth[0].max(self.stack.len()), depth[1].max(self.frames.len())]);
        }
    }
    #[inline(always)]
    pub(crate) fn run_text<P: Copy + Into<f64>>(&mut self, text: Text<'_, P>, x: [R; 2]) -> (R, R) {
        run(text, &mut self.stack, &mut self.frames, x)
    }
}

/// Runs `text` at `x`. The stacks must be as deep as the program needs.
#[inline(always)]
fn run<R: Number, P: Copy + Into<f64>>(
    text: Text<'_, P>,
    stack: &mut [Operand<R>],
    frames: &mut [[R; 2]],
    x: [R; 2],
) -> (R, R) {
    let mut top = 0;
    let mut frame = 0;
    frames[0] = x;
    let mut here = x;
    for instruction in text.code {
        let tail = |at: u32| Parameters(&text.parameters[at as usize..]);
        match instruction {
            Instruction::Leaf(leaf) => {
                stack[top] = leaf.sample(tail(leaf.at()), text.tables, here);
                top += 1;
            }
            Instruction::Combine(operator) => {
                let first = top - operator.operands();
                stack[first] = operator.combine(tail(operator.at()), here, &stack[first..top]);
                top = first + 1;
            }
            Instruction::Enter(map) => {
                here = map.enter(tail(map.at()), here);
                frame += 1;
                frames[frame] = here;
            }
            Instruction::Leave(map) => {
                stack[top - 1] = map.leave(tail(map.at()), stack[top - 1]);
                frame -= 1;
                here = frames[frame];
            }
        }
    }
    if top == 0 { (R::zero(), R::zero()) } else { (stack[0].elevation, stack[0].weight) }
}

impl Evaluator<f64> {
    /// Elevation (0 off the support) and weight at a point.
    pub fn height(&mut self, program: &Program, p: DVec2) -> (f64, f64) {
        let (elevation, weight) = self.run(program, [p.x, p.y]);
        if weight > 0.0 { (elevation, weight) } else { (0.0, 0.0) }
    }
}

impl Evaluator<Dual<f64, 2>> {
    /// Elevation, weight and their gradients at a point.
    pub fn sample(&mut self, program: &Program, p: DVec2) -> Sample {
        let (f, a) = self.run(program, [Dual::variable(p.x, 0), Dual::variable(p.y, 1)]);
        if a.value > 0.0 {
            Sample {
                elevation: f.value,
                weight: a.value,
                gradient: DVec2::from_array(f.slope),
                weight_gradient: DVec2::from_array(a.slope),
            }
        } else {
            Sample { elevation: 0.0, weight: 0.0, gradient: DVec2::ZERO, weight_gradient: DVec2::ZERO }
        }
    }
}

impl Program {
    /// Elevation (0 off the support) and weight at a point. Hot loops keep an [`Evaluator`].
    pub fn height(&self, p: DVec2) -> (f64, f64) {
        Evaluator::<f64>::new(self).height(self, p)
    }
    /// Elevation, weight and both gradients at a point, in one traversal.
    pub fn sample(&self, p: DVec2) -> Sample {
        Evaluator::<Dual<f64, 2>>::new(self).sample(self, p)
    }
}
