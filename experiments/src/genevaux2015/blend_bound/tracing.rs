//! What the printed bound does to pictures: two scenes traced with it and with the corrected one, ray by ray against the
//! certified tracer, and a picture with the pixels it gets wrong.

use super::super::rays::{Ground, Random, Tally, compare, total};
use super::search::{Disc, blend, equal_pair};
use crate::experiment::{Context, ExperimentError};
use crate::report::Picture;
use glam::{DVec2, DVec3};
use terrain_model::operator::BlendRule;
use terrain_model::program::Program;
use terrain_model::scene::CameraPlacement;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::Effort;
use terrain_model::trace::shade::{Landscape, Look, Pixel, View, render, to_srgb8};
use terrain_model::trace::{Settings, Surface, Tracer};

/// A scene made for the printed bound.
pub struct Scene {
    /// In words.
    pub name: &'static str,
    /// Its ground.
    pub program: Program,
    /// Where it is looked at from.
    pub placement: CameraPlacement,
    /// Box that rays are drawn over, metres.
    pub extent: (DVec2, DVec2),
    /// Lowest and highest ground, metres.
    pub elevations: [f64; 2],
}

/// The worst equal pair, a hundred metres large: the crease lies between a plain and a plateau 100 m higher.
///
/// # Errors
/// When it does not compile: a bug.
pub fn crease() -> Result<Scene, ExperimentError> {
    let discs = equal_pair(0.608_309).map(|disc| Disc {
        centre: disc.centre * 100.0,
        radius: 100.0,
        elevation: 100.0 * disc.elevation,
        ..disc
    });
    Ok(Scene {
        name: "crease of two discs",
        program: blend(&discs)?,
        placement: CameraPlacement {
            eye: DVec3::new(-170.0, -60.0, 120.0),
            target: DVec3::new(0.0, 0.0, 50.0),
            field_of_view: 0.6,
        },
        // Where both weights are felt.
        extent: (DVec2::new(-40.0, -25.0), DVec2::new(40.0, 25.0)),
        elevations: [0.0, 100.0],
    })
}

/// Height of a spire over its radius.
const SLENDER: f64 = 2.2;

/// Spires on a plain: discs of weight 0.02 over one of weight 0.505, no two spires overlapping, so that each is a blend of
/// two operands. α is hardly above 1/2 anywhere, where the printed bound is short by nearly the whole 1/T.
///
/// # Errors
/// When it does not compile: a bug.
pub fn spires() -> Result<Scene, ExperimentError> {
    let (base, thin) = (0.505, 0.02);
    let mut discs = vec![Disc { centre: DVec2::ZERO, radius: 3000.0, weight: base, elevation: 0.0 }];
    let mut random = Random(2015);
    let mut highest = 0.0f64;
    for row in -3i32..=3 {
        for column in -3i32..=3 {
            let grid = DVec2::new(f64::from(column) + 0.5 * f64::from(row.rem_euclid(2)), 0.87 * f64::from(row)) * 62.0;
            let shift = DVec2::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0));
            let radius = random.range(14.0, 25.0);
            let peak = radius * SLENDER * random.range(0.8, 1.2);
            if grid.length() > 126.0 {
                continue;
            }
            highest = highest.max(peak);
            // f at the centre is thin·z / (base + thin).
            let elevation = peak * (base + thin) / thin;
            discs.push(Disc { centre: grid + shift, radius, weight: thin, elevation });
        }
    }
    Ok(Scene {
        name: "spires",
        program: blend(&discs)?,
        placement: CameraPlacement {
            eye: DVec3::new(-235.0, -120.0, 68.0),
            target: DVec3::new(0.0, 0.0, 8.0),
            field_of_view: 0.62,
        },
        extent: (DVec2::splat(-140.0), DVec2::splat(140.0)),
        elevations: [0.0, highest],
    })
}

/// ε of a tenth of a millimetre per hundred metres, at least a millimetre.
pub fn settings() -> Settings {
    Settings { epsilon: 1e-3, bracket: 1e-2, edge: 1e-7, ..Settings::default() }
}

/// The tracers of the paper: §7.1 with one bound for the terrain, §7.2 with one per candidate segment.
pub const TRACERS: [Tracer; 2] = [Tracer::Sphere, Tracer::Accelerated];

/// A terrain with everything that is printed of its bounds: the blend's without 1/T and, for sphere tracing, which divides by √(1 + λ²)
/// here, the λ of f alone in place of that root.
fn as_printed(program: &Program, tracer: Tracer) -> Surface<'_> {
    let surface = Surface::with_rule(program, BlendRule::Paper);
    if tracer != Tracer::Sphere {
        return surface;
    }
    let slope = surface.global().slope;
    surface.with_slope_cap((slope * slope - 1.0).max(0.0).sqrt())
}

/// One tracer with either bound, on the same rays.
pub struct Traced {
    /// Which.
    pub tracer: Tracer,
    /// With the printed bounds.
    pub paper: Tally,
    /// With ours.
    pub corrected: Tally,
}

/// Traces `rays` rays of the five families with each tracer.
pub fn trace(scene: &Scene, seed: u64, rays: u64) -> Vec<Traced> {
    let corrected = Surface::with_rule(&scene.program, BlendRule::Corrected);
    let printed = TRACERS.map(|tracer| as_printed(&scene.program, tracer));
    let steepest = (1.0 + corrected.global().slope * corrected.global().slope).sqrt();
    let effort = Effort { bracket: settings().epsilon / steepest, budget: 20_000 };
    let camera = Camera::new(&scene.placement, 480, 270);
    let ground = Ground { program: &scene.program, camera, extent: scene.extent, elevations: scene.elevations };
    let tracers: Vec<_> =
        TRACERS.iter().zip(&printed).flat_map(|(&tracer, printed)| [(tracer, printed), (tracer, &corrected)]).collect();
    let tallies = compare(&ground, &tracers, &settings(), &effort, seed, 0..rays, &|_| {});
    TRACERS
        .iter()
        .zip(tallies.chunks_exact(2))
        .map(|(&tracer, pair)| Traced { tracer, paper: total(&pair[0]), corrected: total(&pair[1]) })
        .collect()
}

/// A hit of the printed bound this much behind the other's is marked, metres: far above ε, far below a pixel.
const LATE: f64 = 0.05;

/// Renders a scene with each tracer and both bounds, writes the pictures and returns the shares of pixels that the printed bounds get
/// wrong, in the order of [`TRACERS`], and the share that ours gets wrong against the other tracer's.
///
/// # Errors
/// When a picture cannot be written.
pub fn pictures(
    ctx: &Context,
    scene: &Scene,
    name: &str,
    size: (u32, u32),
) -> Result<(Vec<Picture>, Vec<f64>, f64), ExperimentError> {
    let (width, height) = size;
    let camera = Camera::new(&scene.placement, width as usize, height as usize);
    let (lo, hi) = scene.extent;
    let look = Look { shadows: false, ..Look::over(lo, hi, scene.elevations) };
    let corrected = Surface::with_rule(&scene.program, BlendRule::Corrected);
    let draw = |surface: &Surface<'_>, tracer| {
        let (landscape, settings) = (Landscape::from(surface.clone()), &settings());
        render(&View { landscape: &landscape, pixel: camera.pixel(), tracer, settings, look: &look }, &camera)
    };
    let truth = draw(&corrected, Tracer::Accelerated);
    let placement = &scene.placement;
    let from = format!("{name}: eye {}, target {}", placement.eye, placement.target);
    let plain: Vec<u8> = truth.iter().flat_map(|pixel| to_srgb8(pixel.colour)).collect();
    let plain = ctx.write_png(&format!("{name}_corrected"), width, height, &plain)?;
    let mut pictures = vec![Picture::new(plain, "The accelerated tracer with the corrected bounds").camera(&from)];
    let share = |missed: &[bool]| missed.iter().filter(|&&missed| missed).count() as f64 / missed.len() as f64;
    let missed = |pixels: &[Pixel]| -> Vec<bool> {
        truth.iter().zip(pixels).map(|(right, wrong)| is_missed(right, wrong)).collect()
    };
    let mut shares = Vec::new();
    for tracer in TRACERS {
        let wrong = draw(&as_printed(&scene.program, tracer), tracer);
        let missed = missed(&wrong);
        shares.push(share(&missed));
        let marked: Vec<u8> = wrong
            .iter()
            .zip(&missed)
            .flat_map(|(pixel, &missed)| if missed { [230, 20, 30] } else { to_srgb8(pixel.colour) })
            .collect();
        let marked = ctx.write_png(&format!("{name}_printed_{}", tracer.name()), width, height, &marked)?;
        let caption = format!(
            "The {} tracer with the printed bounds: red where the ground is missed, or met more than {LATE} m behind it",
            tracer.name()
        );
        pictures.push(Picture::new(marked, &caption).camera(&from));
    }
    let ours = share(&missed(&draw(&corrected, Tracer::Sphere)));
    Ok((pictures, shares, ours))
}

fn is_missed(right: &Pixel, wrong: &Pixel) -> bool {
    match (right.answer.distance(), wrong.answer.distance()) {
        (Some(t), Some(late)) => late > t + LATE,
        (Some(_), None) => true,
        (None, _) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain_model::trace::Answer;

    #[test]
    fn the_printed_bound_misses_ground_that_the_corrected_bound_finds() {
        for scene in [crease().unwrap(), spires().unwrap()] {
            for Traced { tracer, paper, corrected } in trace(&scene, 5, 600) {
                let name = format!("{}, {}", scene.name, tracer.name());
                assert!(paper.missed_hits > 0, "{name}: {paper:?}");
                assert!(corrected.clean() && corrected.hits > 60, "{name}: {corrected:?}");
                assert!(corrected.undecided < 15, "{name}: {corrected:?}");
            }
        }
    }

    #[test]
    fn spires_stand_apart() {
        let program = spires().unwrap().program;
        let deepest = (0..200 * 200).map(|k| DVec2::new(f64::from(k % 200), f64::from(k / 200)) * 1.5 - 150.0);
        // Two overlapping spires would weigh more than the base and one.
        assert!(deepest.map(|p| program.height(p).1).fold(0.0, f64::max) <= 0.525);
    }

    #[test]
    fn a_pixel_is_missed_only_behind_the_other() {
        let pixel = |answer| Pixel { answer, ..Pixel::EMPTY };
        let hit = |t| pixel(Answer::Hit { t });
        assert!(is_missed(&hit(10.0), &hit(11.0)) && is_missed(&hit(10.0), &pixel(Answer::Miss)));
        assert!(!is_missed(&hit(10.0), &hit(10.01)) && !is_missed(&hit(10.0), &hit(9.0)));
        assert!(!is_missed(&pixel(Answer::Miss), &hit(9.0)));
    }
}
