//! `terrain render`: a picture of a scene by one of the tracers.

use super::on_adapter::Device;
use super::picture::{self, Format, Stats};
use super::{Extent, SceneArguments, Size, VerbError, print, progress, sampled_extent};
use crate::layers::Layers;
use crate::scenes;
use clap::{Args, ValueEnum};
use glam::DVec3;
use rayon::prelude::*;
use std::path::PathBuf;
use std::time::Instant;
use terrain_model::scene::{CameraPlacement, Scene};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::shade::{Eye, Look, Pixel, View};
use terrain_model::trace::{Answer, Settings, Tracer};

/// The name of the certified tracer, on the command line and in statistics.
pub(super) const CERTIFIED: &str = "certified";

/// The least step at the border of the domain, metres: far below a pixel of any scene. A ray that all but touches the border
/// creeps along it, so the default of the tracers, made for comparisons, would give such a ray up.
const EDGE: f64 = 1e-3;

/// ε in parts of the distance of the ground: about a hundredth of a pixel of a picture of 1000 rows.
const EPSILON: f64 = 1e-5;

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
    #[command(flatten)]
    device: Device,
    /// Follows N × N rays a pixel and averages their colours; all else is that of the first
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=8))]
    antialias: u8,
    /// Height above the ground at which a ray has met it, metres [default: a hundred-thousandth of the ground's distance]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    epsilon: Option<f64>,
    /// Leaves out cast shadows and reflections
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
        if self.device.is_adapter() && self.tracer == Method::Certified {
            return Err(VerbError::Other(
                "--tracer certified: proofs run on the processor; leave out --backend".to_owned(),
            ));
        }
        let (scene, program) = self.scene.load()?;
        let (low, high) = self.scene.support(&program)?;
        // The support's margin, where weights fade out, shows nothing: frame what lies on the terrain.
        let extent = sampled_extent(&program, low, high, 128).unwrap_or(Extent { low, high, elevations: [0.0, 1.0] });
        let placement = self.placement(&scene, &extent)?;
        let fine = usize::from(self.antialias);
        let camera = Camera::new(&placement, self.size.width * fine, self.size.height * fine);
        // A layer that was asked for is drawn by itself.
        let layers = match self.scene.layer {
            None => Layers::of(&scene, program).map_err(|error| scenes::located(&self.scene.scene, "", error))?,
            Some(_) => Layers { ground: program, water: None, sand: None, vegetation: None },
        };
        let landscape = layers.landscape();
        let look = Look::seen(&landscape.ground, &camera).wished(&scene.appearance);
        let look = Look { shadows: !self.no_shadows, ..look };
        let epsilon = self.epsilon.unwrap_or(EPSILON * look.size);
        let settings = Settings { epsilon, bracket: 10.0 * epsilon, edge: EDGE, ..Settings::default() };
        let tracer = self.tracer.marching().unwrap_or(Tracer::Accelerated);
        let view = View { landscape: &landscape, pixel: camera.pixel(), tracer, settings: &settings, look: &look };
        let mut pixels = vec![Pixel::EMPTY; camera.width() * camera.height()];
        let bar = progress(camera.height() as u64, "tracing");
        let start = Instant::now();
        let mut adapter = None;
        if self.device.is_adapter() {
            adapter = Some(self.device.draw(&view, &camera, &mut pixels, &|rows| bar.inc(rows))?);
        } else {
            pixels.par_chunks_mut(camera.width()).enumerate().for_each_init(
                || (Eye::new(&view), CertifiedTracer::new(&layers.ground)),
                |(eye, certified), (row, out)| {
                    if self.tracer.marching().is_some() {
                        eye.row(&camera, row, out);
                    } else {
                        proved_row(eye, certified, &camera, row, out);
                    }
                    bar.inc(1);
                },
            );
        }
        let pixels = picture::averaged(pixels, camera.width(), fine);
        let seconds = start.elapsed().as_secs_f64();
        bar.finish_and_clear();

        picture::write(&self.out, self.size, &pixels)?;
        let name = self.tracer.marching().map_or(CERTIFIED, Tracer::name);
        let stats = Stats { adapter, ..Stats::of(name, self.size, &pixels, seconds) };
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

/// One row of a picture by proofs.
fn proved_row(eye: &mut Eye<'_>, certified: &mut CertifiedTracer<'_>, camera: &Camera, row: usize, out: &mut [Pixel]) {
    for (column, pixel) in out.iter_mut().enumerate() {
        let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
        let before = certified.evaluations();
        *pixel = eye.shade(&ray, answer(certified.trace(&ray, &Effort::default())));
        pixel.evaluations += certified.evaluations() - before;
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "expected a number above 0".to_owned())
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
