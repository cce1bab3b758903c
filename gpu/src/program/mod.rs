//! The interpreter of tile programs on the device. Twin: `terrain_model::program::TileProgram::run` on `f32`, with the same
//! order of operations.

mod cases;
pub mod conformance;
pub mod encode;

#[cfg(test)]
mod tests;

use crate::context::{Context, ContextError};
use crate::lattice_hash::HASH;
use encode::{Encoded, constant, opcodes};
use std::fmt::Write;
use terrain_model::bounds::THRESHOLD;
use terrain_model::noise::gradient2::{LONG, SHORT};

/// Invocations of one workgroup.
const GROUP: usize = 64;
/// Points of one dispatch: few enough for the smallest limits that wgpu guarantees, many enough to fill a device.
pub const POINTS: usize = 1 << 20;
/// The deepest stacks of operands and of frames.
pub const DEEPEST: usize = 64;

/// A tile program could not be run on the device.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// More than private memory should hold.
    #[error("the tree is {found} levels deep; this interpreter runs {limit}: nest less, or evaluate on the processor")]
    TooDeep {
        /// Levels that the program needs.
        found: usize,
        /// Levels that the interpreter has.
        limit: usize,
    },
    /// One of its buffers does not fit a binding.
    #[error(
        "the program's {what} take {bytes} bytes; a binding of this device holds {limit}: prune it to smaller tiles"
    )]
    TooLarge {
        /// Which buffer.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The most the device binds.
        limit: u64,
    },
    /// A driver that ends loops early left an evaluation undone.
    #[error("the driver ends loops before one evaluation is done: cut the terrain into smaller tiles")]
    Cut,
    /// The device failed.
    #[error(transparent)]
    Context(#[from] ContextError),
}

/// The text of the shader that asks one program at points, with stacks of `depth` operands and frames.
pub fn source(depth: [usize; 2]) -> String {
    machine(depth) + include_str!("../../shaders/program/points.wgsl")
}

/// The text of the machine: what every kernel that runs programs begins with. Its bindings are 0 to 3.
pub(crate) fn machine(depth: [usize; 2]) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "const {name} = {value};");
    };
    for (name, opcode) in opcodes() {
        line(&constant(&name), format!("{opcode}u"));
    }
    line("STACK", format!("{}u", depth[0]));
    line("FRAMES", format!("{}u", depth[1]));
    let present = 0.5 * THRESHOLD;
    let grade = 1.0 / (THRESHOLD - present);
    for (name, value) in
        [("LONG", LONG), ("SHORT", SHORT), ("PRESENCE_GRADE", grade), ("PRESENCE_OFFSET", present * grade)]
    {
        line(name, format!("{:?}f", value as f32));
    }
    [
        text.as_str(),
        HASH,
        include_str!("../../shaders/program/noise.wgsl"),
        include_str!("../../shaders/program/primitives.wgsl"),
        include_str!("../../shaders/program/curves.wgsl"),
        include_str!("../../shaders/program/rasters.wgsl"),
        include_str!("../../shaders/program/operators.wgsl"),
        include_str!("../../shaders/program/machine.wgsl"),
    ]
    .concat()
}

/// The compiled interpreter.
#[derive(Debug)]
pub struct Interpreter {
    kernel: wgpu::ComputePipeline,
    depth: [usize; 2],
}

impl Interpreter {
    /// An interpreter deep enough for `program`, rounded up to a power of two.
    ///
    /// # Errors
    /// When the program is deeper than [`DEEPEST`], or the device refuses the shader.
    pub fn new(context: &Context, program: &Encoded) -> Result<Interpreter, ProgramError> {
        let depth = program.depth.map(|levels| levels.next_power_of_two().max(8));
        fits(depth, [DEEPEST; 2])?;
        Interpreter::compile(context, &source(depth), depth)
    }

    fn compile(context: &Context, source: &str, depth: [usize; 2]) -> Result<Interpreter, ProgramError> {
        Ok(Interpreter { kernel: context.kernel("program/machine.wgsl", source, "program")?, depth })
    }

    /// Elevation and weight at each point, metres from the tile's origin. Where the weight is 0 the elevation means
    /// nothing.
    ///
    /// # Errors
    /// When the program is deeper than this interpreter or larger than the device binds, its driver ends loops early, or the
    /// device fails.
    pub fn evaluate(
        &self,
        context: &Context,
        program: &Encoded,
        points: &[[f32; 2]],
    ) -> Result<Vec<[f32; 2]>, ProgramError> {
        fits(program.depth, self.depth)?;
        let program = bindable(context, program)?;
        let mut out = Vec::with_capacity(points.len());
        for part in points.chunks(POINTS) {
            let at: Vec<u32> = part.as_flattened().iter().map(|x| x.to_bits()).collect();
            let [code, parameters, octaves, images] = program;
            let inputs = [code, parameters, octaves, images, &at];
            let groups = [part.len().div_ceil(GROUP) as u32, 1];
            let words = context.run_on(&self.kernel, groups, &inputs, 2 * part.len())?;
            for pair in words.as_chunks::<2>().0 {
                let [elevation, weight] = pair.map(f32::from_bits);
                if weight < 0.0 {
                    return Err(ProgramError::Cut);
                }
                out.push([elevation, weight]);
            }
        }
        Ok(out)
    }
}

/// The buffers of bindings 0 to 3, each of which the device can bind.
pub(crate) fn bindable<'a>(context: &Context, program: &'a Encoded) -> Result<[&'a [u32]; 4], ProgramError> {
    let limit = context.largest_binding();
    let buffers = [&program.code, &program.parameters, &program.octaves, &program.images].map(Vec::as_slice);
    for (what, words) in ["instructions", "parameters", "octaves", "images"].into_iter().zip(buffers) {
        let bytes = 4 * words.len() as u64;
        if bytes > limit {
            return Err(ProgramError::TooLarge { what, bytes, limit });
        }
    }
    Ok(buffers)
}

/// Are stacks of `limit` deep enough?
pub(crate) fn fits(needed: [usize; 2], limit: [usize; 2]) -> Result<(), ProgramError> {
    match needed.into_iter().zip(limit).find(|(needed, limit)| needed > limit) {
        Some((found, limit)) => Err(ProgramError::TooDeep { found, limit }),
        None => Ok(()),
    }
}
