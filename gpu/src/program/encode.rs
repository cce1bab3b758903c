//! Tile programs as the words that the shader reads: instructions, parameters, octaves and rasters in one buffer each.

use std::ops::Range;
use std::sync::Arc;
use terrain_model::noise::{Octave, mix};
use terrain_model::primitive::image::Image;
use terrain_model::program::{Instruction, TileProgram};

/// The two instructions that the shader knows beside those of the model: a blend starts, and an operand of it is done.
pub const STREAMED: [&str; 2] = ["BeginBlend", "Accumulate"];

/// Every opcode, by name: those of the model in the order of its enums, then [`STREAMED`].
pub fn opcodes() -> Vec<(String, u32)> {
    let names = Instruction::names().into_iter().chain(STREAMED.map(str::to_owned));
    names.zip(0..).collect()
}

/// The same name as a constant of a shader: `DetailDisc` is `DETAIL_DISC`.
pub fn constant(name: &str) -> String {
    let mut out = String::new();
    for (k, letter) in name.chars().enumerate() {
        if k > 0 && letter.is_uppercase() {
            out.push('_');
        }
        out.extend(letter.to_uppercase());
    }
    out
}

/// What the shader reads of one tile or of several.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// Instructions: opcode, with the length in words above bit 16, then the fields.
    pub code: Vec<u32>,
    /// The parameters of all tiles, `f32` as bits.
    pub parameters: Vec<u32>,
    /// Their octaves, [`OCTAVE_WORDS`] each.
    pub octaves: Vec<u32>,
    /// The rasters that an instruction names: width, height, samples.
    pub images: Vec<u32>,
    /// Deepest stack of operands and of frames.
    pub depth: [usize; 2],
    /// Where each raster stands in `images`; one that several tiles name is stored once.
    placed: Vec<(Arc<Image>, u32)>,
}

/// Words of an octave.
pub const OCTAVE_WORDS: usize = 8;

impl Default for Encoded {
    /// Without tiles. Every table starts with a record that nothing names: an empty buffer cannot be bound.
    fn default() -> Encoded {
        let (parameters, octaves, images) = (vec![0], vec![0; OCTAVE_WORDS], vec![0; 2]);
        Encoded { code: Vec::new(), parameters, octaves, images, depth: [1, 1], placed: Vec::new() }
    }
}

impl Encoded {
    /// The words of `tile`.
    pub fn new(tile: &TileProgram) -> Encoded {
        let mut out = Encoded::default();
        out.push(tile);
        out
    }
    /// Whether an instruction names a raster.
    pub fn has_images(&self) -> bool {
        !self.placed.is_empty()
    }
    /// Appends `tile` and returns which words of `code` are its program.
    pub fn push(&mut self, tile: &TileProgram) -> Range<u32> {
        let start = self.code.len() as u32;
        let names = opcodes();
        let opcode = |name: &str| names.iter().find(|(known, _)| known == name).map_or(0, |(_, opcode)| *opcode);
        let [begin, accumulate] = STREAMED.map(opcode);
        let blends = Blends::of(tile.code());
        let at = [self.parameters.len() as u32, (self.octaves.len() / OCTAVE_WORDS) as u32];
        let mut octave_ratios = vec![1.0; tile.octaves().len()];
        for (k, instruction) in tile.code().iter().enumerate() {
            self.code.extend(std::iter::repeat_n(begin | 1 << 16, blends.begins[k]));
            let name = instruction.name();
            let mut fields = instruction.fields();
            fields[0] += at[0];
            match name.as_str() {
                "Disc" | "DetailDisc" if fields.len() > 1 => {
                    let noise = fields[1] as usize..(fields[1] + fields[2]) as usize;
                    for of in noise.clone() {
                        octave_ratios[of] = tile.octaves()[of].amplitude / tile.octaves()[noise.start].amplitude;
                    }
                    fields[1] += at[1];
                }
                "Image" => self.place(tile, &mut fields, [1, 4]),
                "Quad" | "Strip" => self.place(tile, &mut fields, [1, 3]),
                _ => {}
            }
            self.code.push(opcode(&name) | (fields.len() as u32 + 1) << 16);
            self.code.extend(fields);
            if blends.accumulates[k] {
                self.code.push(accumulate | 1 << 16);
            }
        }
        if tile.code().is_empty() {
            // Nothing is a blend of nothing.
            self.code.extend([begin | 1 << 16, opcode("Blend") | 1 << 16]);
        }
        self.parameters.extend(tile.parameters().iter().map(|value| value.to_bits()));
        self.octaves
            .extend(tile.octaves().iter().zip(octave_ratios).flat_map(|(octave, ratio)| words_of(octave, ratio)));
        self.depth = [0, 1].map(|k| self.depth[k].max(blends.depth[k]));
        start..self.code.len() as u32
    }
    /// Puts the place of a raster where its index is; the second is absent in an instruction without a raster of weights.
    fn place(&mut self, tile: &TileProgram, fields: &mut [u32], which: [usize; 2]) {
        for field in which {
            let Some(index) = fields.get_mut(field) else { return };
            let image = &tile.images()[*index as usize];
            let known = self.placed.iter().find(|(placed, _)| Arc::ptr_eq(placed, image)).map(|(_, at)| *at);
            *index = known.unwrap_or_else(|| {
                let at = self.images.len() as u32;
                self.images.extend([image.width() as u32, image.height() as u32]);
                self.images.extend(image.samples().iter().map(|sample| sample.to_bits()));
                self.placed.push((image.clone(), at));
                at
            });
        }
    }
}

/// The keys of the seed are mixed here once, not at every point, and hold the cell of the tile's origin already.
fn words_of(octave: &Octave<2>, ratio: f64) -> [u32; OCTAVE_WORDS] {
    let key = |axis: usize| mix(octave.lattice.seed, axis as u32 + 1).wrapping_add(octave.lattice.base[axis] as u32);
    let single = |value: f64| (value as f32).to_bits();
    let [x, y] = octave.offset.map(single);
    [key(0), key(1), x, y, single(octave.frequency), single(octave.amplitude), single(ratio), 0]
}

/// Where blends start and where their operands end.
struct Blends {
    /// Of each instruction: how many blends start before it.
    begins: Vec<usize>,
    /// Of each instruction: whether it ends an operand of a blend.
    accumulates: Vec<bool>,
    depth: [usize; 2],
}

impl Blends {
    fn of(code: &[Instruction]) -> Blends {
        let mut begins = vec![0; code.len()];
        let mut accumulates = vec![false; code.len()];
        // First and last instruction of each operand on the stack.
        let mut stack: Vec<(usize, usize)> = Vec::new();
        let mut opened = Vec::new();
        for (k, instruction) in code.iter().enumerate() {
            if matches!(instruction, Instruction::Enter(_)) {
                opened.push(k);
                continue;
            }
            let parts = stack.split_off(stack.len().saturating_sub(instruction.operands()));
            let mut first = parts.first().map_or(k, |part| part.0);
            if matches!(instruction, Instruction::Leave(_)) {
                first = opened.pop().unwrap_or(first);
            }
            if instruction.name() == "Blend" {
                begins[first] += 1;
                parts.iter().for_each(|part| accumulates[part.1] = true);
            }
            stack.push((first, k));
        }
        let (mut now, mut depth) = ([0usize, 1usize], [1usize, 1usize]);
        for (k, instruction) in code.iter().enumerate() {
            now[0] += begins[k];
            match instruction {
                Instruction::Enter(_) => now[1] += 1,
                Instruction::Leave(_) => now[1] -= 1,
                Instruction::Leaf(_) => now[0] += 1,
                Instruction::Combine(_) if instruction.name() == "Blend" => {}
                Instruction::Combine(_) => now[0] = now[0] + 1 - instruction.operands(),
            }
            depth = [depth[0].max(now[0]), depth[1].max(now[1])];
            now[0] -= usize::from(accumulates[k]);
        }
        Blends { begins, accumulates, depth }
    }
}
