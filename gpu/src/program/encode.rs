//! A tile program as the words that the shader reads: instructions, parameters and octaves in one buffer each.

use super::ProgramError;
use terrain_model::noise::{Octave, mix};
use terrain_model::program::{Instruction, TileProgram};

/// The kinds of instructions that the shader runs, by their names in the model.
pub const SUPPORTED: &[&str] = &[
    "Disc",
    "DetailDisc",
    "Curve",
    "Contour",
    "Blend",
    "Replace",
    "Add",
    "Lod",
    "Masked",
    "EnterAffine",
    "EnterWarp",
    "LeaveAffine",
    "LeaveWarp",
];

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

/// What the shader reads of one tile. Every buffer holds at least one record: an empty one cannot be bound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// Instructions: opcode, with the length in words above bit 16, then the fields.
    pub code: Vec<u32>,
    /// The tile's parameters, `f32` as bits.
    pub parameters: Vec<u32>,
    /// Its octaves, [`OCTAVE_WORDS`] each.
    pub octaves: Vec<u32>,
    /// Deepest stack of operands and of frames.
    pub depth: [usize; 2],
}

/// Words of an octave.
pub const OCTAVE_WORDS: usize = 8;

impl Encoded {
    /// The words of `tile`.
    ///
    /// # Errors
    /// When it holds a node that the shader does not run.
    pub fn new(tile: &TileProgram) -> Result<Encoded, ProgramError> {
        let names = opcodes();
        let opcode = |name: &str| names.iter().find(|(known, _)| known == name).map_or(0, |(_, opcode)| *opcode);
        let [begin, accumulate] = STREAMED.map(opcode);
        let blends = Blends::of(tile.code());
        let mut code = Vec::new();
        let mut octave_ratios = vec![1.0; tile.octaves().len()];
        for (k, instruction) in tile.code().iter().enumerate() {
            code.extend(std::iter::repeat_n(begin | 1 << 16, blends.begins[k]));
            let name = instruction.name();
            if !SUPPORTED.contains(&name.as_str()) {
                return Err(ProgramError::Unsupported(name));
            }
            let fields = instruction.fields();
            let noisy = name.ends_with("Disc");
            if let (true, [_, first, count, ..]) = (noisy, fields.as_slice()) {
                let noise = *first as usize..(*first + *count) as usize;
                for of in noise.clone() {
                    octave_ratios[of] = tile.octaves()[of].amplitude / tile.octaves()[noise.start].amplitude;
                }
            }
            code.push(opcode(&name) | (fields.len() as u32 + 1) << 16);
            code.extend(fields);
            if blends.accumulates[k] {
                code.push(accumulate | 1 << 16);
            }
        }
        let mut parameters: Vec<u32> = tile.parameters().iter().map(|value| value.to_bits()).collect();
        let mut octaves: Vec<u32> =
            tile.octaves().iter().zip(octave_ratios).flat_map(|(octave, ratio)| words_of(octave, ratio)).collect();
        if parameters.is_empty() {
            parameters.push(0);
        }
        if octaves.is_empty() {
            octaves.resize(OCTAVE_WORDS, 0);
        }
        Ok(Encoded { code, parameters, octaves, depth: blends.depth })
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
