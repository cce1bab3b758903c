//! The compiled tree: instructions and parameters in two arrays, run by a stack machine over any number.

mod batch;
mod bounds;
mod compile;
mod prune;
mod run;
mod tile;

pub use batch::{Baked, BatchEvaluator, WIDTH};
pub use bounds::BoundsEvaluator;
pub use compile::CompileError;
pub use prune::Pruner;
pub use run::{Evaluator, Sample};
pub use tile::TileProgram;

use crate::noise::{Combination, Octave};
use crate::operator::WeightRule;
use crate::primitive::image::Image;
use std::sync::Arc;

/// One instruction. `at` is the index of its first parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction {
    /// Pushes a constant disc.
    Disc {
        /// First parameter.
        at: u32,
    },
    /// Pushes a disc with noise.
    NoiseDisc {
        /// First parameter.
        at: u32,
        /// How octaves combine.
        combination: Combination,
        /// First octave.
        first: u32,
        /// Number of octaves.
        octaves: u32,
    },
    /// Pushes a curve.
    Curve {
        /// First parameter.
        at: u32,
        /// Number of segments.
        segments: u16,
        /// Number of pieces of the cross-section.
        pieces: u16,
    },
    /// Pushes an image.
    Image {
        /// First parameter.
        at: u32,
        /// Which image.
        image: u16,
        /// Added to the sample index.
        base: [i32; 2],
    },
    /// Pops the operands, pushes their blend.
    Blend {
        /// How many.
        operands: u16,
    },
    /// Pops B, then A; pushes the replacement.
    Replace {
        /// What happens to the weight.
        rule: WeightRule,
    },
    /// Pops B, then A; pushes the addition.
    Add {
        /// What happens to the weight.
        rule: WeightRule,
    },
    /// Enters the frame of a similarity.
    Enter {
        /// First parameter.
        at: u32,
    },
    /// Leaves it and carries the top of the stack back.
    Leave {
        /// First parameter.
        at: u32,
    },
}

/// A tree compiled for world coordinates in `f64`. Elevations and coordinates in metres.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) code: Vec<Instruction>,
    pub(crate) parameters: Arc<Vec<f64>>,
    pub(crate) images: Arc<Vec<Arc<Image>>>,
    /// Octaves placed for the centre of each disc: a table that follows from the parameters.
    pub(crate) octaves: Arc<Vec<Octave<2>>>,
    /// Deepest stack of samples and of frames.
    pub(crate) depth: [usize; 2],
}

impl Program {
    /// The instructions, operands before operators.
    pub fn code(&self) -> &[Instruction] {
        &self.code
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
        pyramids + self.octaves.len() * size_of::<Octave<2>>()
    }
    /// Number of primitive instructions, shared subtrees counted once per use.
    pub fn primitive_instructions(&self) -> usize {
        self.code
            .iter()
            .filter(|i| {
                use Instruction::{Curve, Disc, Image, NoiseDisc};
                matches!(i, Disc { .. } | NoiseDisc { .. } | Curve { .. } | Image { .. })
            })
            .count()
    }
}

impl Instruction {
    /// 32-bit words of the compact form: one word of opcode and small fields with the parameter index, and what does
    /// not fit into it.
    pub fn words(&self) -> usize {
        match self {
            Instruction::NoiseDisc { .. } => 2,
            Instruction::Curve { .. } | Instruction::Image { .. } => 2,
            _ => 1,
        }
    }
}
