//! `terrain render`: a picture of a scene by one of the tracers.

use super::picture::{self, Format, Stats};
use super::{Extent, SceneArguments, Size, VerbError, print, progress, sampled_extent};
use clap::{Args, ValueEnum};
use glam::DVec3;
use rayon::prelude::*;
use std::path::PathBuf;
use std::time::Instant;
use terrain_model::scene::{CameraPlacement, Scene};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::shade::{Look, Pixel, render_row, shade};
use terrain_model::trace::{Answer, HeightRay, Settings, Surface, Tracer};

/// The name of the certified tracer, on the command line and in statistics.
pub(super) const CERTIFIED: &str = "certified";

/// The least step at the border of the domain, metres: far below a pixel of any scene. A ray that all but touches the border
/// creeps along it, so the default of the tracers, made for comparisons, would give such a ray up.
const EDGE: f64 = 1e-3;

/// How rays are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// One slope bound for the whole terrain
    Sphere,
    /// A slope bound for each piece of the ray
    Accelerated,
    /// The same with pieces that double after every step, as printed in the paper
    AcceleratedPaper,
    /// Bounds of the slope along the ray, for each piece of it
    Segment,
    /// A proof for each pixel: slow; what it cannot decide is magenta
    Certified,
}

impl Method {
    /// The marching tracer, none for proofs.
    fn marching(self) -> Option<Tracer> {
        match self {
            Method::Sphere => Some(Tracer::Sphere),
            Method::Accelerated => Some(Tracer::Accelerated),
            Method::AcceleratedPaper => Some(Tracer::AcceleratedPaper),
            Method::Segment => Some(Tracer::Segment),
            Method::Certified => None,
        }
    }
}

/// Draws a scene.
///
/// The sun stands in the west; haze follows from the size of the scene. Magenta is a pixel whose ray was given up, or that
/// the certified tracer could not decide. Shadows of a certified picture are traced by `accelerated`. A cut through the
/// terrain, at the border of its domain, is drawn in bands.
#[derive(Args, Debug)]
pub struct Render {
    #[command(flatten)]
    scene: SceneArguments,
    /// The picture: .png (sRGB), or .exr with layers R, G, B, depth, steps and normal
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// A camera of the scene [default: the first, or if there is none a view from the south-west]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Pixels
    #[arg(long, value_name = "WxH", default_value = "960x540")]
    size: Size,
    /// How rays are followed
    #[arg(long, value_enum, default_value = "accelerated")]
    tracer: Method,
    /// Leaves out cast shadows
    #[arg(long)]
    no_shadows: bool,
    /// Writes counts and times as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Writes evaluations a pixel as colours, dark for few
    #[arg(long, value_name = "FILE.png")]
    step_map: Option<PathBuf>,
}

impl Render {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: the scene, the camera, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        Format::of(&self.out)?;
        let (scene, program) = self.scene.load()?;
        let (low, high) = self.scene.support(&program)?;
        // The support's margin, where weights fade out, shows nothing: frame what lies on the terrain.
        let extent = sampled_extent(&program, low, high, 128).unwrap_or(Extent { low, high, elevations: [0.0, 1.0] });
        let placement = self.placement(&scene, &extent)?;
        let camera = Camera::new(&placement, self.size.width, self.size.height);
        let look = Look { shadows: !self.no_shadows, ..Look::over(extent.low, extent.high, extent.elevations) };

        let surface = Surface::new(&program);
        let settings = Settings { edge: EDGE, ..Settings::default() };
        let mut pixels = vec![Pixel::EMPTY; self.size.width * self.size.height];
        let bar = progress(self.size.height as u64, "tracing");
        let start = Instant::now();
        pixels.par_chunks_mut(self.size.width).enumerate().for_each_init(
            || (HeightRay::new(&surface), CertifiedTracer::new(&program)),
            |(field, certified), (row, out)| {
                match self.tracer.marching() {
                    Some(tracer) => render_row(&surface, field, &camera, tracer, &settings, &look, row, out),
                    None => {
                        for (column, pixel) in out.iter_mut().enumerate() {
                            let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
                            let before = certified.evaluations();
                            let answer = answer(certified.trace(&ray, &Effort::default()));
                            *pixel = shade(&surface, field, &ray, answer, Tracer::Accelerated, &settings, &look);
                            pixel.evaluations += certified.evaluations() - before;
                        }
                    }
                }
                bar.inc(1);
            },
        );
        let seconds = start.elapsed().as_secs_f64();
        bar.finish_and_clear();

        picture::write(&self.out, self.size, &pixels)?;
        let name = self.tracer.marching().map_or(CERTIFIED, Tracer::name);
        let stats = Stats::of(name, self.size, &pixels, seconds);
        if let Some(path) = &self.stats {
            stats.write(path)?;
        }
        print(&format!(
            "{}: {} hits, {} walls, {} misses, {} open, {:.1} evaluations a pixel, {seconds:.2} s",
            self.out.display(),
            stats.hits,
            stats.walls,
            stats.misses,
            stats.gave_up + stats.undecided,
            stats.evaluations_per_pixel,
        ))?;
        if let Some(path) = &self.step_map {
            let top = picture::write_step_map(path, self.size, &pixels)?;
            print(&format!("{}: brightest from {top} evaluations on", path.display()))?;
        }
        Ok(())
    }

    fn placement(&self, scene: &Scene, extent: &Extent) -> Result<CameraPlacement, VerbError> {
        let Some(name) = &self.camera else {
            return Ok(scene.cameras.values().next().copied().unwrap_or_else(|| overview(extent)));
        };
        scene.cameras.get(name).copied().ok_or_else(|| {
            let names: Vec<&str> = scene.cameras.keys().map(String::as_str).collect();
            let known = if names.is_empty() {
                "the scene has none; leave out --camera for a view from the south-west".to_owned()
            } else {
                format!("the scene has {}", names.join(", "))
            };
            VerbError::Other(format!("{}: cameras.{name}: no such camera; {known}", self.scene.scene))
        })
    }
}

/// The whole terrain, seen from the south-west.
fn overview(&Extent { low, high, elevations }: &Extent) -> CameraPlacement {
    let centre = (0.5 * (low + high)).extend(0.5 * (elevations[0] + elevations[1]));
    let radius = 0.5 * (high - low).length();
    let eye = centre + DVec3::new(-1.0, -1.15, 0.8).normalize() * (2.1 * radius);
    CameraPlacement { eye, target: centre, field_of_view: std::f64::consts::PI / 5.0 }
}

/// A proof as an answer: a hit at its far end, where h < 0 is proved.
fn answer(certified: Certified) -> Answer {
    match certified {
        Certified::Hit { t1, .. } => Answer::Hit { t: t1 },
        Certified::Wall { t1, .. } => Answer::Wall { t: t1 },
        Certified::Miss => Answer::Miss,
        Certified::Undecided { t0, .. } => Answer::GaveUp { t: t0 },
    }
}
