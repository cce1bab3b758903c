//! Rays from the eye followed on an adapter; the processor shades what they meet.

use super::VerbError;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use terrain_gpu::context::Context;
use terrain_gpu::trace::{self, Bound, Tiles};
use terrain_model::trace::Ray;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::shade::{Eye, Pixel, View};

/// Tiles along the longer side of a terrain: more are slower to make and faster to trace.
const TILES: usize = 64;
/// Rays that are followed before their pixels are shaded.
const BAND: usize = 1 << 20;

/// Where rays are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// On the processor
    Cpu,
    /// On a graphics adapter, in single precision, shortened by what that may be off by
    Gpu,
}

/// Which device follows the rays from the eye.
#[derive(Args, Debug)]
pub struct Device {
    /// Where rays from the eye are followed; shadows and reflections stay on the processor
    #[arg(long, value_enum, default_value = "cpu")]
    backend: Backend,
    /// The adapter, by any part of its name [default: TERRAIN_ADAPTER, or the fastest kind there is]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl Device {
    /// Whether it is an adapter.
    pub fn is_adapter(&self) -> bool {
        self.backend == Backend::Gpu
    }

    /// Traces and shades the picture of `view`; `advance` hears of the rows. Returns the adapter's name.
    ///
    /// # Errors
    /// When there is no adapter, none of the name, no tracer of the kind, or the adapter fails.
    pub fn draw(
        &self,
        view: &View<'_>,
        camera: &Camera,
        pixels: &mut [Pixel],
        advance: &dyn Fn(u64),
    ) -> Result<String, VerbError> {
        let other = |error: &dyn std::fmt::Display| VerbError::Other(error.to_string());
        let bound = Bound::ALL.into_iter().find(|bound| bound.name() == view.tracer.name()).ok_or_else(|| {
            let known = Bound::ALL.map(Bound::name).join(", ");
            VerbError::Other(format!("--tracer {}: not on an adapter; there are {known}", view.tracer.name()))
        })?;
        let context = Context::new(self.adapter.as_deref()).map_err(|error| other(&error))?;
        let surface = &view.landscape.ground;
        let Some(tiles) = Tiles::new(surface, TILES) else {
            return Err(VerbError::Other("the terrain is empty".to_owned()));
        };
        let tracer = trace::Tracer::new(&context, &tiles).map_err(|error| other(&error))?;
        let settings =
            trace::Settings { bound, epsilon: view.settings.epsilon, most_steps: view.settings.max_steps, share: 1.0 };
        let width = camera.width().max(1);
        let band = width * (BAND / width).max(1);
        for (first, pixels) in pixels.chunks_mut(band).enumerate() {
            let ray = |k: usize| camera.ray((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
            let rays: Vec<Ray> = (0..pixels.len()).into_par_iter().map(|k| ray(first * band + k)).collect();
            let beams = trace::beams(surface, &tiles, &rays);
            let found = tracer.trace(&beams, &settings).map_err(|error| other(&error))?;
            let rows = pixels.par_chunks_mut(width).zip(rays.par_chunks(width).zip(found.par_chunks(width)));
            rows.for_each_init(
                || Eye::new(view),
                |eye, (row, (rays, found))| {
                    for (pixel, (ray, found)) in row.iter_mut().zip(rays.iter().zip(found)) {
                        *pixel = eye.shade(ray, found.answer);
                        pixel.evaluations += u64::from(found.steps);
                    }
                },
            );
            advance((pixels.len() / width) as u64);
        }
        Ok(context.description().name.clone())
    }
}
