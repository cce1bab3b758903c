//! Elevation, weight and mean gradient at points of tiles, on the device.

use super::{GROUP, RAYS, Tiles};
use crate::context::Context;
use crate::program::{DEEPEST, ProgramError, fits};
use glam::{DVec2, Vec2};

/// Words of a question and of its answer.
const LOOK: usize = 8;
const ANSWER: usize = 4;
/// The shortest line that a gradient is a mean over, on either side, as a share of half a tile.
const SHORTEST: f32 = 1.0 / 64.0;

/// A point of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Which tile.
    pub tile: usize,
    /// Metres from its centre.
    pub at: Vec2,
}

/// The ground at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Metres.
    pub elevation: f32,
    /// α.
    pub weight: f32,
    /// Mean over the lines of [`line()`], or over the part of them on one side of the place where the other end is off the
    /// domain.
    pub gradient: Vec2,
}

/// The ends, metres from the tile's centre, of the lines west to east and south to north through a place that a gradient is a
/// mean over: `reach` metres to either side, cut at the tile's border.
pub fn line(tiles: &Tiles, place: &Place, reach: f32) -> [Vec2; 2] {
    let half = tiles.half() as f32;
    let reach = Vec2::splat(reach.clamp(SHORTEST * half, half));
    [(place.at - reach).max(Vec2::splat(-half)), (place.at + reach).min(Vec2::splat(half))]
}

/// The compiled kernel for one terrain.
#[derive(Debug)]
pub struct Surveyor<'a> {
    kernel: wgpu::ComputePipeline,
    resident: Vec<wgpu::Buffer>,
    context: &'a Context,
    tiles: &'a Tiles,
}

impl<'a> Surveyor<'a> {
    /// A surveyor of the terrain in `tiles`.
    ///
    /// # Errors
    /// When a program of it is too deep, or the device refuses the shader or has no room for the terrain.
    pub fn new(context: &'a Context, tiles: &'a Tiles) -> Result<Surveyor<'a>, ProgramError> {
        let depth = tiles.depth();
        fits(depth, [DEEPEST; 2])?;
        let text = super::source(depth, super::GROUND);
        let kernel = context.kernel("trace/ground.wgsl", &text, "ground")?;
        Ok(Surveyor { kernel, resident: tiles.upload(context)?, context, tiles })
    }

    /// The ground at each place, with the metres to either side that its gradient is a mean over.
    ///
    /// # Errors
    /// When the device fails.
    pub fn look(&self, places: &[(Place, f32)]) -> Result<Vec<Ground>, ProgramError> {
        let mut out = Vec::with_capacity(places.len());
        for places in places.chunks(RAYS) {
            let asked = |(place, reach): &(Place, f32)| {
                let [low, high] = line(self.tiles, place, *reach);
                let [a, b, c] = [place.at, low, high].map(|p| p.to_array().map(f32::to_bits));
                [a[0], a[1], b[0], b[1], c[0], c[1], place.tile as u32, 2]
            };
            let words: Vec<[u32; LOOK]> = places.iter().map(asked).collect();
            let groups = [places.len().div_ceil(GROUP) as u32, 1];
            let answers = self.context.run_after(
                &self.kernel,
                groups,
                &self.resident,
                &[words.as_flattened()],
                ANSWER * places.len(),
            )?;
            for answer in answers.as_chunks::<ANSWER>().0 {
                let [elevation, weight, x, y] = answer.map(f32::from_bits);
                if weight < 0.0 {
                    return Err(ProgramError::Cut);
                }
                out.push(Ground { elevation, weight, gradient: Vec2::new(x, y) });
            }
        }
        Ok(out)
    }
}

impl Tiles {
    /// World position of a place, metres.
    pub fn world(&self, place: &Place) -> DVec2 {
        self.centre(place.tile) + place.at.as_dvec2()
    }
}
