//! A program re-based to a tile: every parameter relative to the tile's origin and rounded once to `f32`, so that
//! `f32` executors never see world coordinates. A noise octave carries the lattice cell of the origin as integers.

use super::run::Text;
use super::{Evaluator, Instruction, Program, TileLayout};
use crate::noise::Octave;
use crate::operator::{Combine, Frame};
use crate::primitive::image::Image;
use crate::primitive::{Leaf, Number, Tables};
use glam::DVec2;
use std::sync::Arc;

/// A program for one tile, in coordinates relative to its origin.
#[derive(Clone, Debug)]
pub struct TileProgram {
    /// World position of the tile's origin, metres.
    pub origin: DVec2,
    code: Vec<Instruction>,
    layout: TileLayout,
    images: Arc<Vec<Arc<Image>>>,
    depth: [usize; 2],
}

impl TileProgram {
    /// `program` re-based to `origin`.
    pub fn new(program: &Program, origin: DVec2) -> TileProgram {
        let mut layout = TileLayout::default();
        let mut opened = Vec::new();
        let mut here = origin;
        let rebased = program.code.iter().map(|instruction| match instruction {
            Instruction::Leaf(leaf) => {
                Instruction::Leaf(leaf.rebase(program.tail(leaf.at()), program.tables(), here, &mut layout))
            }
            Instruction::Combine(operator) => {
                Instruction::Combine(operator.rebase(program.tail(operator.at()), here, &mut layout))
            }
            Instruction::Enter(map) => {
                let (map, inner) = map.rebase(program.tail(map.at()), here, &mut layout);
                opened.push((map, here));
                here = inner;
                Instruction::Enter(map)
            }
            Instruction::Leave(map) => {
                let (map, outside) = opened.pop().unwrap_or((*map, here));
                here = outside;
                Instruction::Leave(map)
            }
        });
        let code = rebased.collect();
        TileProgram { origin, code, layout, images: program.images.clone(), depth: program.depth }
    }
    /// The instructions.
    pub fn code(&self) -> &[Instruction] {
        &self.code
    }
    /// The parameters, relative to the origin and rounded once.
    pub fn parameters(&self) -> &[f32] {
        &self.layout.parameters
    }
    /// The octaves of every noise, placed for the origin.
    pub fn octaves(&self) -> &[Octave<2>] {
        &self.layout.octaves
    }
    /// The rasters that its instructions name, those of the whole program.
    pub fn images(&self) -> &[Arc<Image>] {
        &self.images
    }
    pub(crate) fn depth(&self) -> [usize; 2] {
        self.depth
    }
    #[inline(always)]
    pub(crate) fn text(&self) -> Text<'_, f32> {
        let tables = Tables { octaves: &self.layout.octaves, tiled: true, noises: &[], images: &self.images };
        Text { code: &self.code, parameters: &self.layout.parameters, tables }
    }
    /// An evaluator for this tile.
    pub fn evaluator<R: Number>(&self) -> Evaluator<R> {
        Evaluator::with_depth(self.depth)
    }
    /// Elevation and weight at `x`, metres from the origin, on any number: `f64` is the oracle of the `f32` paths.
    pub fn run<R: Number>(&self, evaluator: &mut Evaluator<R>, x: [R; 2]) -> (R, R) {
        evaluator.reach(self.depth);
        evaluator.run_text(self.text(), x)
    }
}
