//! A program re-based to a tile: every parameter relative to the tile's origin and rounded once to `f32`, so that
//! `f32` executors never see world coordinates. A noise octave carries the lattice cell of the origin as integers.

use super::run::Text;
use super::{Evaluator, Instruction, Program};
use crate::noise::Octave;
use crate::operator::{self, AFFINE_WIDTH};
use crate::primitive::image::Image;
use crate::primitive::{Number, Parameters, curve, disc, image};
use glam::DVec2;
use std::sync::Arc;

/// A program for one tile, in coordinates relative to its origin.
#[derive(Clone, Debug)]
pub struct TileProgram {
    /// World position of the tile's origin, metres.
    pub origin: DVec2,
    code: Vec<Instruction>,
    parameters: Vec<f32>,
    octaves: Vec<Octave<2>>,
    images: Arc<Vec<Arc<Image>>>,
    depth: [usize; 2],
}

impl TileProgram {
    /// `program` re-based to `origin`.
    pub fn new(program: &Program, origin: DVec2) -> TileProgram {
        let mut tile = TileProgram {
            origin,
            code: Vec::with_capacity(program.code.len()),
            parameters: Vec::new(),
            octaves: Vec::new(),
            images: program.images.clone(),
            depth: program.depth,
        };
        let mut frames = vec![origin];
        for instruction in &program.code {
            let here = frames[frames.len() - 1];
            let tail = |at: u32| &program.parameters[at as usize..];
            let at_new = tile.parameters.len() as u32;
            let rebased = match *instruction {
                Instruction::Disc { at } => {
                    tile.store_disc(&tail(at)[..disc::WIDTH], here);
                    Instruction::Disc { at: at_new }
                }
                Instruction::NoiseDisc { at, combination, first, octaves } => {
                    let p = tail(at);
                    tile.store_disc(&p[..disc::WIDTH], here);
                    let table = &program.octaves[first as usize..(first + octaves) as usize];
                    let first = tile.octaves.len() as u32;
                    let from_centre = here - DVec2::new(p[0], p[1]);
                    tile.octaves.extend(table.iter().map(|octave| octave.moved_to(from_centre.to_array()).rounded()));
                    Instruction::NoiseDisc { at: at_new, combination, first, octaves }
                }
                Instruction::Curve { at, segments, pieces } => {
                    let p = tail(at);
                    let count = curve::WIDTH
                        + usize::from(segments) * curve::SEGMENT_WIDTH
                        + usize::from(pieces) * crate::profile::PIECE_WIDTH;
                    tile.parameters.extend(p[..count].iter().map(|v| *v as f32));
                    for segment in 0..usize::from(segments) {
                        let k = curve::WIDTH + segment * curve::SEGMENT_WIDTH;
                        tile.parameters[at_new as usize + k] = (p[k] - here.x) as f32;
                        tile.parameters[at_new as usize + k + 1] = (p[k + 1] - here.y) as f32;
                    }
                    Instruction::Curve { at: at_new, segments, pieces }
                }
                Instruction::Image { at, image, .. } => {
                    let p = tail(at);
                    let cells = (here - DVec2::new(p[0], p[1])) * DVec2::new(p[2], p[3]);
                    let whole = cells.floor();
                    let rest = cells - whole;
                    let mut q = p[..image::WIDTH].to_vec();
                    (q[0], q[1], q[4], q[5]) = (0.0, 0.0, rest.x, rest.y);
                    (q[6], q[7]) = (p[6] - here.x, p[7] - here.y);
                    tile.parameters.extend(q.iter().map(|v| *v as f32));
                    Instruction::Image { at: at_new, image, base: [wrap(whole.x), wrap(whole.y)] }
                }
                Instruction::Enter { at } => {
                    let p = tail(at);
                    let inner = operator::enter::<f64, f64>(Parameters(p), here.to_array());
                    frames.push(DVec2::from_array(inner));
                    // The operand's own origin moves along: no translation is left.
                    let mut q: Vec<f32> = p[..AFFINE_WIDTH].iter().map(|v| *v as f32).collect();
                    (q[4], q[5]) = (0.0, 0.0);
                    tile.parameters.extend(q);
                    Instruction::Enter { at: at_new }
                }
                Instruction::Leave { at } => {
                    frames.pop();
                    tile.parameters.extend(tail(at)[..AFFINE_WIDTH].iter().map(|v| *v as f32));
                    Instruction::Leave { at: at_new }
                }
                combine => combine,
            };
            tile.code.push(rebased);
        }
        tile
    }
    /// The instructions.
    pub fn code(&self) -> &[Instruction] {
        &self.code
    }
    fn store_disc(&mut self, p: &[f64], here: DVec2) {
        self.parameters.extend([(p[0] - here.x) as f32, (p[1] - here.y) as f32]);
        self.parameters.extend(p[2..].iter().map(|v| *v as f32));
    }
    #[inline(always)]
    pub(crate) fn text(&self) -> Text<'_, f32> {
        Text {
            code: &self.code,
            parameters: &self.parameters,
            octaves: &self.octaves,
            tiled: true,
            images: &self.images,
        }
    }
    /// An evaluator for this tile.
    pub fn evaluator<R: Number>(&self) -> Evaluator<R> {
        Evaluator::with_depth(self.depth)
    }
    /// Elevation and weight at `x`, metres from the origin, on any number: `f64` is the oracle of the `f32` paths.
    pub fn run<R: Number>(&self, evaluator: &mut Evaluator<R>, x: [R; 2]) -> (R, R) {
        evaluator.run_text(self.text(), x)
    }
}

/// A whole number of any size, modulo 2³².
fn wrap(whole: f64) -> i32 {
    const SPAN: f64 = 4_294_967_296.0;
    (whole - (whole / SPAN).floor() * SPAN) as u32 as i32
}

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn cells_wrap_as_32_bit_integers() {
        assert_eq!(wrap(-1.0), -1);
        assert_eq!(wrap(4_294_967_296.0 + 5.0), 5);
        assert_eq!(wrap(2_147_483_648.0), i32::MIN);
    }
}
