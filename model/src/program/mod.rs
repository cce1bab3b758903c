//! The compiled tree: instructions and parameters in two arrays, run by a stack machine over any number.

mod batch;
mod bounds;
mod cells;
mod certified;
mod compile;
mod focus;
mod layout;
mod prune;
mod run;
mod simplify;
mod tile;

pub use batch::{Baked, BatchEvaluator, WIDTH};
pub use bounds::BoundsEvaluator;
pub use cells::Cells;
pub use certified::Certified;
pub use compile::CompileError;
pub use layout::{Layout, TileLayout};
pub use prune::{Evidence, Pruner};
pub use run::{Evaluator, Sample};
pub use tile::TileProgram;

use crate::noise::{Bounds as NoiseBounds, Octave};
use crate::operator::{Combine as _, Frame as _, Map, Operator, WeightRule};
use crate::primitive::image::Image;
use crate::primitive::{Code as Leaf, Leaf as _, Parameters, Tables};
use std::sync::Arc;

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction {
    /// Pushes a primitive.
    Leaf(Leaf),
    /// Pops its operands and pushes what they combine to.
    Combine(Operator),
    /// Enters the frame of a map.
    Enter(Map),
    /// Leaves it and carries the top of the stack back.
    Leave(Map),
}

/// A tree compiled for world coordinates in `f64`. Elevations and coordinates in metres.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) code: Vec<Instruction>,
    pub(crate) parameters: Arc<Vec<f64>>,
    pub(crate) images: Arc<Vec<Arc<Image>>>,
    /// Octaves placed for the centre of each disc: a table that follows from the parameters.
    pub(crate) octaves: Arc<Vec<Octave<2>>>,
    /// Range and slope of each noise, which follow from the parameters too.
    pub(crate) noises: Arc<Vec<NoiseBounds>>,
    /// Deepest stack of samples and of frames.
    pub(crate) depth: [usize; 2],
}

impl Program {
    /// The instructions, operands before operators.
    pub fn code(&self) -> &[Instruction] {
        &self.code
    }
    /// The parameters from the `at`-th on.
    pub(crate) fn tail(&self, at: u32) -> Parameters<'_, f64> {
        Parameters(&self.parameters[at as usize..])
    }
    pub(crate) fn tables(&self) -> Tables<'_> {
        Tables { octaves: &self.octaves, tiled: false, noises: &self.noises, images: &self.images }
    }
    /// Whether an operator has a weight rule as printed, whose elevation jumps where an operand's support ends (claims,
    /// *Nesting*).
    pub fn jumps(&self) -> bool {
        self.code.iter().any(|instruction| match instruction {
            Instruction::Combine(Operator::Replace(code)) => code.rule == WeightRule::CombinePaper,
            Instruction::Combine(Operator::Add(code)) => code.rule == WeightRule::CombinePaper,
            _ => false,
        })
    }
    /// Number of parameters.
    pub fn parameter_count(&self) -> usize {
        self.parameters.len()
    }
    /// The `k`-th parameter.
    pub fn parameter(&self, k: usize) -> f64 {
        self.parameters[k]
    }
    /// Bytes of the compact form: instructions as 32-bit words, parameters as `f32`, images as stored.
    pub fn bytes(&self) -> usize {
        let words: usize = self.code.iter().map(Instruction::words).sum();
        let images: usize = self.images.iter().map(|image| image.bytes()).sum();
        4 * (words + self.parameters.len()) + images
    }
    /// Bytes of what only accelerates and follows from the rest: image pyramids and tables of octaves.
    pub fn acceleration_bytes(&self) -> usize {
        let pyramids: usize = self.images.iter().map(|image| image.acceleration_bytes()).sum();
        let noises = self.octaves.len() * size_of::<Octave<2>>() + self.noises.len() * size_of::<NoiseBounds>();
        pyramids + noises
    }
    /// Number of primitive instructions, shared subtrees counted once per use.
    pub fn primitive_instructions(&self) -> usize {
        self.code.iter().filter(|i| matches!(i, Instruction::Leaf(_))).count()
    }
}

impl Instruction {
    /// The names of all kinds of instructions, in the order of their opcodes.
    pub fn names() -> Vec<String> {
        let maps =
            ["Enter", "Leave"].into_iter().flat_map(|way| Map::NAMES.iter().map(move |name| format!("{way}{name}")));
        Leaf::NAMES.iter().chain(Operator::NAMES).map(|name| (*name).to_owned()).chain(maps).collect()
    }
    /// The name of its kind.
    pub fn name(&self) -> String {
        match self {
            Instruction::Leaf(leaf) => leaf.name().to_owned(),
            Instruction::Combine(operator) => operator.name().to_owned(),
            Instruction::Enter(map) => format!("Enter{}", map.name()),
            Instruction::Leave(map) => format!("Leave{}", map.name()),
        }
    }
    /// What it says beside its kind, as words: the index of its first parameter, then its own fields.
    pub fn fields(&self) -> Vec<u32> {
        let mut out = Vec::new();
        match self {
            Instruction::Leaf(leaf) => leaf.fields(&mut out),
            Instruction::Combine(operator) => operator.fields(&mut out),
            Instruction::Enter(map) | Instruction::Leave(map) => map.fields(&mut out),
        }
        out
    }
    /// How many values it takes from the stack. All but `Enter` leave one.
    pub fn operands(&self) -> usize {
        match self {
            Instruction::Leaf(_) | Instruction::Enter(_) => 0,
            Instruction::Combine(operator) => operator.operands(),
            Instruction::Leave(_) => 1,
        }
    }
    /// 32-bit words of the compact form: one word of opcode and small fields with the parameter index, and what does
    /// not fit into it.
    pub fn words(&self) -> usize {
        match self {
            Instruction::Leaf(leaf) => leaf.words(),
            _ => 1,
        }
    }
}
