//! Rays followed on the device, over tiles whose programs were pruned on the processor: sphere tracing with the slope of the
//! whole terrain, with each tile's own, or with the gradient in the tile along the ray (Génevaux 2015 §7.1, §7.2; Galin 2020).
//! A step is shortened by what rounding may have put between the device's height and the true one (claims G18), so that `f32`
//! never passes the surface; a hit is therefore a height that is small, not a change of sign. A dispatch follows a ray for so
//! many turns and leaves its state to the next, so that none runs long and none passes what a driver gives an invocation.

pub mod compare;
mod ground;
mod tiles;

#[cfg(test)]
mod tests;

pub use ground::{Ground, Place, Surveyor, line};
pub use tiles::Tiles;

use crate::context::Context;
use crate::program::{DEEPEST, ProgramError, bindable, fits, machine};
use glam::DVec3;
use rayon::prelude::*;
use terrain_model::bounds::THRESHOLD;
use terrain_model::trace::{Answer, HeightRay, Ray, RayFunction, Surface};

/// Invocations of one workgroup.
const GROUP: usize = 64;
/// Rays of one dispatch.
const RAYS: usize = 1 << 18;
/// Words of a ray.
const BEAM: usize = 16;
/// Where, among them, what is read here stands.
const CELL: usize = 8;
const S: usize = 10;
const KIND: usize = 11;
const STEPS: usize = 12;
const SLACK: usize = 14;
const SOUND: usize = 15;
/// What a ray has come to before it has come to anything.
const UNDERWAY: u32 = 0;
/// Turns of a ray in one dispatch: as many as end in well under a second.
const TURNS: usize = 4096;
/// Iterations of all loops together that Mesa's processor gives each of eight invocations that share them.
const SOFTWARE_LOOPS: usize = 65_535 / 8;

/// Which bound a step is taken by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The slope of the whole terrain: sphere tracing (§7.1).
    Global,
    /// The slope of the tile, with which δ is what the ray has left of the tile: accelerated tracing (§7.2).
    Tile,
    /// The gradient in the tile along the ray (Galin 2020).
    Gradient,
}

impl Bound {
    /// From the loosest to the tightest.
    pub const ALL: [Bound; 3] = [Bound::Global, Bound::Tile, Bound::Gradient];
    /// The name of the tracer of `terrain_model::trace` that is the twin.
    pub fn name(self) -> &'static str {
        match self {
            Bound::Global => "sphere",
            Bound::Tile => "accelerated",
            Bound::Gradient => "segment",
        }
    }
}

/// When the tracer stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Which bound steps are taken by.
    pub bound: Bound,
    /// A height below this is a hit, metres; never less than what rounding can resolve.
    pub epsilon: f64,
    /// Steps before giving up.
    pub most_steps: u32,
    /// Factor of the slope bound: 1, or less in a control.
    pub share: f64,
}

/// What the device found along one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Where the solid is met, metres along the ray.
    pub answer: Answer,
    /// Evaluations of the terrain.
    pub steps: u32,
    /// How far the device's height and place may be from the true ones at a hit, metres.
    pub slack: f64,
    /// Where that is, on a tile; means nothing for a miss.
    pub place: Place,
}

/// The kernels' own texts.
pub const MARCH: &str = include_str!("../../shaders/trace/march.wgsl");
/// See [`MARCH`].
pub const GROUND: &str = include_str!("../../shaders/trace/ground.wgsl");

/// A kernel over tiles, with stacks of `depth` operands and frames.
pub fn source(depth: [usize; 2], kernel: &str) -> String {
    let threshold = format!("const T: f32 = {:?}f;\n", THRESHOLD as f32);
    machine(depth) + &threshold + include_str!("../../shaders/trace/tile.wgsl") + kernel
}

/// The compiled tracer of one terrain.
#[derive(Debug)]
pub struct Tracer<'a> {
    kernel: wgpu::ComputePipeline,
    resident: Vec<wgpu::Buffer>,
    context: &'a Context,
    tiles: &'a Tiles,
}

impl<'a> Tracer<'a> {
    /// A tracer of the terrain in `tiles`.
    ///
    /// # Errors
    /// When a program of it is too deep, or the device refuses the shader or has no room for the terrain.
    pub fn new(context: &'a Context, tiles: &'a Tiles) -> Result<Tracer<'a>, ProgramError> {
        let depth = tiles.depth();
        fits(depth, [DEEPEST; 2])?;
        let kernel = context.kernel("trace/march.wgsl", &source(depth, MARCH), "trace")?;
        Ok(Tracer { kernel, resident: tiles.upload(context)?, context, tiles })
    }

    /// Follows each ray, as [`beams`] prepared it.
    ///
    /// # Errors
    /// When the device fails.
    pub fn trace(&self, beams: &Beams<'_>, settings: &Settings) -> Result<Vec<Found>, ProgramError> {
        let software = (SOFTWARE_LOOPS / self.tiles.cost).clamp(1, TURNS);
        self.trace_by(beams, settings, if self.context.description().software { software } else { TURNS })
    }

    /// The same with so many turns of a ray in the first dispatch.
    fn trace_by(&self, beams: &Beams<'_>, settings: &Settings, turns: usize) -> Result<Vec<Found>, ProgramError> {
        let mut out = Vec::with_capacity(beams.rays.len());
        for (words, rays) in beams.words.chunks(RAYS).zip(beams.rays.chunks(RAYS)) {
            let mut words = words.to_vec();
            self.march(&mut words, settings, turns)?;
            out.extend(words.iter().zip(rays).map(|(words, ray)| self.tiles.found(words, ray)));
        }
        Ok(out)
    }

    /// Dispatches until no ray is underway. Where a driver cut the loops of an invocation short, its rays start the dispatch
    /// again with half as many turns.
    fn march(&self, beams: &mut [[u32; BEAM]], settings: &Settings, mut turns: usize) -> Result<(), ProgramError> {
        let tiles = self.tiles;
        let mut pending: Vec<usize> = (0..beams.len()).collect();
        while !pending.is_empty() {
            let words: Vec<u32> = pending.iter().flat_map(|k| beams[*k]).collect();
            let grid = tiles.grid(settings, turns as u32);
            let groups = [pending.len().div_ceil(GROUP) as u32, 1];
            let after =
                self.context.run_after(&self.kernel, groups, &self.resident, &[&words, &grid], BEAM * pending.len())?;
            let mut after = after.as_chunks::<BEAM>().0.iter();
            let (mut cut, before) = (false, pending.len());
            pending.retain(|k| {
                let Some(after) = after.next() else { return false };
                if after[SOUND] == 0 {
                    cut = true;
                    return true;
                }
                beams[*k] = *after;
                after[KIND] == UNDERWAY
            });
            if cut && turns == 1 {
                return Err(ProgramError::Cut);
            }
            // Where few rays are left, few share a limit.
            let few = pending.len() <= before / 2;
            turns = if cut { turns / 2 } else { (turns << usize::from(few)).min(TURNS) };
        }
        Ok(())
    }
}

/// At the border of the domain: what is thinner than this, metres, can be passed unseen. 64 units of a tile's half.
fn least_step(half: f64) -> f64 {
    64.0 * f64::from(f32::EPSILON) * half
}

/// Rays as the device reads them.
#[derive(Debug)]
pub struct Beams<'r> {
    rays: &'r [Ray],
    words: Vec<[u32; BEAM]>,
}

/// Brings rays to where they first can meet the terrain, relative to the tile there. What `f32` makes of that place is where
/// the ray's drift starts.
pub fn beams<'r>(surface: &Surface<'_>, tiles: &Tiles, rays: &'r [Ray]) -> Beams<'r> {
    let words = rays.par_iter().map_init(
        || HeightRay::new(surface),
        |along, ray| {
            along.aim(*ray);
            let Some((start, _)) = along.span() else {
                // Off the grid, where nothing is met.
                let mut off = [0; BEAM];
                off[CELL] = u32::MAX;
                return off;
            };
            let p = ray.at(start.max(0.0));
            let [i, j] = tiles.cell(p.truncate());
            let local = (p.truncate() - tiles.centre(j * tiles.columns + i)).extend(p.z);
            let stored = local.as_vec3();
            // In f64 the place is off by less than 2⁻⁵⁰ of the numbers it is made of.
            let sizes = ray.origin.abs().max_element() + p.abs().max_element() + start.abs();
            let drift = ((stored.as_dvec3() - local).length() + sizes * 4.0 * f64::EPSILON) as f32;
            let across = ray.direction.truncate().length() as f32;
            let (stored, direction) = (stored.to_array(), ray.direction.as_vec3().to_array());
            let [[x, y, z], [u, v, w]] = [stored, direction].map(|vector| vector.map(f32::to_bits));
            let [drift, across] = [drift, across].map(|x| x.next_up().to_bits());
            // It starts at 0, underway, as if it came from where nothing is.
            [x, y, z, drift, u, v, w, across, i as u32, j as u32, 0, UNDERWAY, 0, 1, 0, 0]
        },
    );
    Beams { rays, words: words.collect() }
}

impl Tiles {
    fn depth(&self) -> [usize; 2] {
        // Few different depths, so that drivers know the kernel again.
        self.encoded.depth.map(|levels| levels.next_power_of_two().max(8))
    }
    /// The buffers of bindings 0 to 4.
    fn upload(&self, context: &Context) -> Result<Vec<wgpu::Buffer>, ProgramError> {
        let program = bindable(context, &self.encoded)?;
        let words = program.into_iter().chain([self.records.as_slice()]);
        Ok(words.map(|words| context.upload(words)).collect::<Result<_, _>>()?)
    }
    /// What the shader knows of the whole grid.
    fn grid(&self, settings: &Settings, turns: u32) -> Vec<u32> {
        let half = self.half();
        let numbers = [settings.epsilon, least_step(half), self.steepest, settings.share].map(|x| x as f32);
        let mut grid = vec![self.columns as u32, self.rows as u32];
        grid.extend([half as f32].into_iter().chain(numbers).map(f32::to_bits));
        grid.extend([settings.bound as u32, settings.most_steps, turns, 2]);
        grid
    }
    /// The answer in `f64`: the place that the device names, as metres along the ray.
    fn found(&self, beam: &[u32; BEAM], ray: &Ray) -> Found {
        let single = |k: usize| f64::from(f32::from_bits(beam[k]));
        let [entered, direction] = [0, 4].map(|k| DVec3::new(single(k), single(k + 1), single(k + 2)));
        let tile = beam[CELL + 1].wrapping_mul(self.columns as u32).wrapping_add(beam[CELL]) as usize;
        let at = || (entered + self.centre(tile).extend(0.0) - ray.origin).dot(ray.direction) + single(S);
        let answer = match beam[KIND] {
            2 => Answer::Hit { t: at() },
            3 => Answer::Wall { t: at() },
            4 => Answer::GaveUp { t: at() },
            _ => Answer::Miss,
        };
        let at = (entered + direction * single(S)).truncate().as_vec2();
        Found { answer, steps: beam[STEPS], slack: single(SLACK), place: Place { tile, at } }
    }
}
