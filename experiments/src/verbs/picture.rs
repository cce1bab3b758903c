//! Rendered pixels as files: a PNG, an EXR with what the tracer knew, a map of the cost, and statistics.

use super::{Size, VerbError, write_bytes};
use serde::Serialize;
use std::path::Path;
use terrain_model::io::{exr, write_png_rgb8};
use terrain_model::trace::Answer;
use terrain_model::trace::shade::{Pixel, to_srgb8};

/// What a picture cost.
#[derive(Serialize)]
pub(super) struct Stats {
    pub tracer: &'static str,
    /// What followed the rays from the eye; null for the processor.
    pub adapter: Option<String>,
    pub width: usize,
    pub height: usize,
    pub pixels: usize,
    pub hits: usize,
    pub walls: usize,
    pub misses: usize,
    pub gave_up: usize,
    pub undecided: usize,
    /// Of the rays from the eye, the normal of a hit included.
    pub evaluations: u64,
    pub shadow_evaluations: u64,
    pub evaluations_per_pixel: f64,
    /// Over the pixels that show terrain only; null when none does.
    pub evaluations_per_terrain_pixel: Option<f64>,
    pub most_evaluations: u64,
    /// Wall clock of tracing and shading, on `threads` threads.
    pub seconds: f64,
    pub threads: usize,
}

impl Stats {
    /// Counts. A certified tracer that does not end is undecided; the others have given up.
    pub fn of(tracer: &'static str, size: Size, pixels: &[Pixel], seconds: f64) -> Stats {
        let count = |what: fn(&Answer) -> bool| pixels.iter().filter(|pixel| what(&pixel.answer)).count();
        let open = count(|answer| matches!(answer, Answer::GaveUp { .. }));
        let (gave_up, undecided) = if tracer == super::render::CERTIFIED { (0, open) } else { (open, 0) };
        let evaluations: u64 = pixels.iter().map(|pixel| pixel.evaluations).sum();
        let terrain = || pixels.iter().filter(|pixel| pixel.answer.distance().is_some());
        let on_terrain = terrain().map(|pixel| pixel.evaluations).sum::<u64>() as f64;
        Stats {
            tracer,
            adapter: None,
            width: size.width,
            height: size.height,
            pixels: pixels.len(),
            hits: count(|answer| matches!(answer, Answer::Hit { .. })),
            walls: count(|answer| matches!(answer, Answer::Wall { .. })),
            misses: count(|answer| matches!(answer, Answer::Miss)),
            gave_up,
            undecided,
            evaluations,
            shadow_evaluations: pixels.iter().map(|pixel| pixel.shadow_evaluations).sum(),
            evaluations_per_pixel: evaluations as f64 / pixels.len() as f64,
            evaluations_per_terrain_pixel: (terrain().count() > 0).then(|| on_terrain / terrain().count() as f64),
            most_evaluations: pixels.iter().map(|pixel| pixel.evaluations).max().unwrap_or(0),
            seconds,
            threads: rayon::current_num_threads(),
        }
    }
    /// Writes JSON.
    pub fn write(&self, path: &Path) -> Result<(), VerbError> {
        let text = serde_json::to_string_pretty(self).map_err(|error| VerbError::Other(error.to_string()))?;
        write_bytes(path, (text + "\n").as_bytes())
    }
}

/// Writes the picture: sRGB in a PNG; in an EXR the linear colours R, G, B, then depth (metres along the ray, infinite for a
/// miss), steps (evaluations) and normal.x, .y, .z.
pub(super) fn write(path: &Path, size: Size, pixels: &[Pixel]) -> Result<(), VerbError> {
    if Format::of(path)? == Format::Png {
        let rgb: Vec<u8> = pixels.iter().flat_map(|pixel| to_srgb8(pixel.colour)).collect();
        return Ok(write_png_rgb8(path, size.width, size.height, &rgb)?);
    }
    // An EXR writer takes rows from the south, here the bottom.
    let layer =
        |value: &dyn Fn(&Pixel) -> f32| -> Vec<f32> { pixels.chunks(size.width).rev().flatten().map(value).collect() };
    let depth = |pixel: &Pixel| match pixel.answer {
        Answer::Hit { t } | Answer::Wall { t } | Answer::GaveUp { t } => t as f32,
        Answer::Miss => f32::INFINITY,
    };
    let layers = [
        ("R", layer(&|pixel| pixel.colour[0])),
        ("G", layer(&|pixel| pixel.colour[1])),
        ("B", layer(&|pixel| pixel.colour[2])),
        ("depth", layer(&depth)),
        ("steps", layer(&|pixel| pixel.evaluations as f32)),
        ("normal.x", layer(&|pixel| pixel.normal.x as f32)),
        ("normal.y", layer(&|pixel| pixel.normal.y as f32)),
        ("normal.z", layer(&|pixel| pixel.normal.z as f32)),
    ];
    let layers: Vec<(&str, &[f32])> = layers.iter().map(|(name, values)| (*name, values.as_slice())).collect();
    Ok(exr::write_layers(path, size.width, size.height, &layers)?)
}

/// Means of blocks of `fine` × `fine` colours of a picture `width` wide; all else is that of the first in a block.
pub(super) fn averaged(pixels: Vec<Pixel>, width: usize, fine: usize) -> Vec<Pixel> {
    if fine == 1 {
        return pixels;
    }
    let (columns, rows) = (width / fine, pixels.len() / width / fine);
    let mut out = Vec::with_capacity(columns * rows);
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let first = row * fine * width + column * fine;
        let mut sum = [0.0f32; 3];
        for k in 0..fine * fine {
            let pixel = &pixels[first + k / fine * width + k % fine];
            for (sum, colour) in sum.iter_mut().zip(pixel.colour) {
                *sum += colour;
            }
        }
        out.push(Pixel { colour: sum.map(|sum| sum / (fine * fine) as f32), ..pixels[first] });
    }
    out
}

/// What a picture can be written as.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Exr,
}

impl Format {
    /// By extension, so that a wrong name is told before an hour of tracing.
    pub fn of(path: &Path) -> Result<Format, VerbError> {
        match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("png") => Ok(Format::Png),
            Some("exr") => Ok(Format::Exr),
            _ => Err(VerbError::Other(format!("{}: no writer for this picture; use .png or .exr", path.display()))),
        }
    }
}

/// Dark to bright through blue, green and yellow, even in lightness.
const RAMP: [[f32; 3]; 6] = [
    [0.267, 0.005, 0.329],
    [0.254, 0.265, 0.530],
    [0.164, 0.471, 0.558],
    [0.135, 0.659, 0.518],
    [0.478, 0.821, 0.319],
    [0.993, 0.906, 0.144],
];

/// Writes the evaluations of each pixel as a colour: darkest for none, brightest for the 99th percentile and above. Returns
/// that percentile.
pub(super) fn write_step_map(path: &Path, size: Size, pixels: &[Pixel]) -> Result<u64, VerbError> {
    if Format::of(path)? != Format::Png {
        return Err(VerbError::Other(format!("{}: a step map is a .png", path.display())));
    }
    let mut sorted: Vec<u64> = pixels.iter().map(|pixel| pixel.evaluations).collect();
    sorted.sort_unstable();
    let top = sorted[(sorted.len() - 1) * 99 / 100].max(1);
    let colour = |pixel: &Pixel| {
        let x = (pixel.evaluations as f32 / top as f32).min(1.0) * (RAMP.len() - 1) as f32;
        let k = (x as usize).min(RAMP.len() - 2);
        let f = x - k as f32;
        [0, 1, 2].map(|c| ((RAMP[k][c] * (1.0 - f) + RAMP[k + 1][c] * f) * 255.0 + 0.5) as u8)
    };
    let rgb: Vec<u8> = pixels.iter().flat_map(colour).collect();
    write_png_rgb8(path, size.width, size.height, &rgb)?;
    Ok(top)
}
