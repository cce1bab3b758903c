//! The stack machine: one loop for the scalar reference, dual numbers, intervals and SIMD lanes.

use super::{Instruction, Program};
use crate::dual::Dual;
use crate::noise::Octave;
use crate::operator;
use crate::primitive::image::Image;
use crate::primitive::{Number, Parameters, curve, disc, image};
use crate::real::{Mask, Operand};
use glam::DVec2;
use std::sync::Arc;

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
    pub octaves: &'a [Octave<2>],
    /// Octaves are placed for the origin of a tile instead of the centre of their disc.
    pub tiled: bool,
    pub images: &'a [Arc<Image>],
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
        let text = Text {
            code: &program.code,
            parameters: &program.parameters,
            octaves: &program.octaves,
            tiled: false,
            images: &program.images,
        };
        run(text, &mut self.stack, &mut self.frames, x)
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
        match *instruction {
            Instruction::Disc { at } => {
                let p = tail(at);
                stack[top] = Operand::new(disc::elevation(p), disc::weight(p, here));
                top += 1;
            }
            Instruction::NoiseDisc { at, combination, first, octaves } => {
                let p = tail(at);
                let weight: R = disc::weight(p, here);
                let mut elevation: R = disc::elevation(p);
                // Outside the support the elevation is never used: this is the tree as bounding volumes.
                if R::zero().less(weight).may_hold() {
                    let c = p.pair::<R>(0);
                    let at = if text.tiled { here } else { [here[0] - c[0], here[1] - c[1]] };
                    let octaves = &text.octaves[first as usize..(first + octaves) as usize];
                    elevation = elevation + combination.plane(octaves, at);
                }
                stack[top] = Operand::new(elevation, weight);
                top += 1;
            }
            Instruction::Curve { at, segments, pieces } => {
                let (elevation, weight) = curve::sample(tail(at), usize::from(segments), usize::from(pieces), here);
                stack[top] = Operand::new(elevation, weight);
                top += 1;
            }
            Instruction::Image { at, image, base } => {
                let (elevation, weight) = image::sample(tail(at), &text.images[usize::from(image)], base, here);
                stack[top] = Operand::new(elevation, weight);
                top += 1;
            }
            Instruction::Blend { operands } => {
                let first = top - usize::from(operands);
                stack[first] = R::weighted_mean(&stack[first..top], 0.0);
                top = first + 1;
            }
            Instruction::Replace { rule } => {
                stack[top - 2] = operator::replace(rule, stack[top - 2], stack[top - 1]);
                top -= 1;
            }
            Instruction::Add { rule } => {
                stack[top - 2] = operator::add(rule, stack[top - 2], stack[top - 1]);
                top -= 1;
            }
            Instruction::Enter { at } => {
                here = operator::enter(tail(at), here);
                frame += 1;
                frames[frame] = here;
            }
            Instruction::Leave { at } => {
                stack[top - 1] = operator::leave(tail(at), stack[top - 1]);
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
