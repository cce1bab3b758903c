//! Where compiling puts what instructions refer to: parameters and tables.

use super::{Certified, Instruction};
use crate::noise::{Bounds as NoiseBounds, Octave};
use crate::operator::Combine;
use crate::primitive::image::Image;
use std::sync::Arc;

/// The deepest stacks of samples and of frames that `code` needs.
pub(super) fn depth(code: &[Instruction]) -> [usize; 2] {
    let (mut now, mut deepest) = ([0, 1], [0, 1]);
    for instruction in code {
        match instruction {
            Instruction::Leaf(_) => now[0] += 1,
            Instruction::Combine(operator) => now[0] = now[0] + 1 - operator.operands(),
            Instruction::Enter(_) => now[1] += 1,
            Instruction::Leave(_) => now[1] -= 1,
        }
        deepest = [deepest[0].max(now[0]), deepest[1].max(now[1])];
    }
    deepest
}

/// The parameters and tables of a program in the making.
#[derive(Debug, Default)]
pub struct Layout {
    pub(crate) parameters: Vec<f64>,
    pub(crate) octaves: Vec<Octave<2>>,
    pub(crate) noises: Vec<NoiseBounds>,
    pub(crate) images: Vec<Arc<Image>>,
    pub(crate) certified: Certified,
}

impl Layout {
    /// Stores parameters and returns the index of the first.
    pub fn store(&mut self, parameters: impl IntoIterator<Item = f64>) -> u32 {
        let at = self.parameters.len() as u32;
        self.parameters.extend(parameters);
        at
    }
    /// The index of a raster; one that is used twice is stored once.
    ///
    /// # Errors
    /// When there are more than 65 536.
    pub fn image(&mut self, image: &Arc<Image>) -> Result<u16, String> {
        let index = self.images.iter().position(|known| Arc::ptr_eq(known, image)).unwrap_or_else(|| {
            self.images.push(image.clone());
            self.images.len() - 1
        });
        u16::try_from(index).map_err(|_| "a scene holds at most 65536 images".to_owned())
    }
}

/// The parameters and octaves of a tile in the making.
#[derive(Clone, Debug, Default)]
pub struct TileLayout {
    pub(crate) parameters: Vec<f32>,
    pub(crate) octaves: Vec<Octave<2>>,
}

impl TileLayout {
    /// Stores parameters, each rounded once, and returns the index of the first.
    pub fn store(&mut self, parameters: impl IntoIterator<Item = f64>) -> u32 {
        let at = self.parameters.len() as u32;
        self.parameters.extend(parameters.into_iter().map(|v| v as f32));
        at
    }
}
