//! The scenes of Table 1 traced on the adapter, every pixel against the certified tracer of the processor.

use crate::environment::Gpu;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::genevaux2015::rays::Trial;
use crate::genevaux2015::scenes::{TableScene, table_scenes};
use crate::genevaux2015::signed_error::{Agreement, agreement, colours, largest_lead};
use crate::report::{Cell, Outcome, Picture, Table};
use glam::{DVec2, DVec3, Vec2};
use std::time::Instant;
use terrain_gpu::context::Context as Device;
use terrain_gpu::trace::compare::{Compared, compare, prove};
use terrain_gpu::trace::{Bound, Found, Ground, Settings, Surveyor, Tiles, Tracer, beams};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::Certified;
use terrain_model::trace::{Answer, Ray, Surface};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "gpu/tracing",
    title: "Scenes of Table 1 traced on the adapter",
    section: "Génevaux 2015, §7, §8.2",
    about: "Each pixel of each scene's picture is traced on the adapter with the slope bound of the whole terrain, with that of a tile, \
            and with the gradient in the tile along the ray. Steps are shortened by what f32 may be off by: Rounded derives it at 16 \
            points of each tile and of its neighbours, ten times that for the device, twice that between the points. A miss is an answer beyond the \
            certified bracket by more than this slack, or none; a false hit has no ground within ε and the slack. A ray that \
            passes within ε of a crest is met there, unlike by the tracers of the processor, which ask for a change of sign. The \
            control takes a third of the bound. A quick run takes every 13th pixel with the first bound and every 5th with the second. \
            Milliseconds are of all pixels by the third, upload and read-back included.",
    code: "experiments/src/gpu/tracing.rs",
    test: "gpu/src/trace/tests.rs::no_certified_hit_is_missed_and_a_third_of_the_bound_misses",
    expected: |profile| Expected {
        seconds: profile.pick(20.0, 20000.0),
        memory_bytes: profile.pick(256 << 20, 2 << 30),
        disk_bytes: profile.pick(1 << 20, 24 << 20),
    },
    run,
};

/// Tiles along the longer side of a scene, quick and full: more are slower to make and faster to trace.
const TILES: [usize; 2] = [48, 128];
/// Every how manyth pixel is traced by each bound in a quick run; the control takes as many as the first.
const QUICK: [usize; 3] = [13, 5, 1];
/// The steepest terrain that is traced with one bound, metres per metre: beyond it a ray takes too many steps.
const GENTLE: f64 = 100.0;
/// Steps of a ray.
const STEPS: u32 = 200_000;
/// The control's share of the bound.
const CONTROL: f64 = 1.0 / 3.0;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let device = match crate::gpu::adapter()? {
        Ok(device) => device,
        Err(skipped) => return Ok(skipped),
    };
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("tracers", "The adapter's answers against the certified tracer's").column("scene");
    for title in ["bound", "rays", "certified hits", "missed", "false", "gave up", "undecided"] {
        table = table.column(title);
    }
    table = table.machine_column("grazes").machine_column("evaluations per ray").machine_column("milliseconds");
    let mut clean = true;
    for scene in table_scenes().map_err(ExperimentError::failed)? {
        clean &= run_scene(ctx, &device, &scene, &mut outcome, &mut table)?;
    }
    outcome.table(table)?;
    outcome.timing("adapter_is_software", f64::from(u8::from(device.description().software)))?;
    outcome.deviation(
        "the paper's numbers are of a GTX 670 at 1920 × 1080",
        "times of the adapter at hand, shown but not compared: software adapters say nothing of speed",
    );
    if !clean {
        outcome.set_verdict(Verdict::NotReproduced, "the adapter missed ground, or met ground that is not there");
    }
    outcome.gpu(Gpu::from(device.description().clone()));
    Ok(outcome)
}

/// What one bound found, and how long it took.
struct Traced {
    compared: Compared,
    found: Vec<Found>,
    milliseconds: f64,
}

fn row(name: &str, bound: Bound, compared: &Compared, milliseconds: f64) -> Vec<Cell> {
    let counts = [
        compared.rays,
        compared.hits,
        compared.missed,
        compared.false_hits,
        compared.gave_up,
        compared.undecided,
        compared.grazes,
    ];
    let mut cells = vec![Cell::from(name), Cell::from(bound.name())];
    cells.extend(counts.map(|count| Cell::count(count as u64)));
    cells.push(Cell::number(compared.steps as f64 / compared.rays.max(1) as f64, "", 4));
    cells.push(Cell::number(milliseconds, "ms", 3));
    cells
}

fn run_scene(
    ctx: &Context,
    device: &Device,
    scene: &TableScene,
    outcome: &mut Outcome,
    table: &mut Table,
) -> Result<bool, ExperimentError> {
    let name = scene.name;
    let surface = Surface::new(&scene.program);
    let Trial { settings, effort, .. } = Trial::new(scene, &surface, scene.extent)?;
    let (width, height) = ctx.profile.pick((32, 18), (1366, 768));
    let placement =
        scene.scene.cameras.get("main").ok_or_else(|| ExperimentError::failed("a scene needs a main camera"))?;
    let camera = Camera::new(placement, width, height);
    let at = |k: usize| camera.ray((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
    let rays: Vec<Ray> = (0..width * height).map(at).collect();
    let proved = prove(&surface, &rays, &effort);

    let tiles = Tiles::new(&surface, ctx.profile.pick(TILES[0], TILES[1]))
        .ok_or_else(|| ExperimentError::failed(format!("{name} is empty")))?;
    let tracer = Tracer::new(device, &tiles).map_err(ExperimentError::failed)?;
    let trace = |bound: Bound, share: f64, every: usize| -> Result<Traced, ExperimentError> {
        let settings = Settings { bound, epsilon: settings.epsilon, most_steps: STEPS, share };
        let rays: Vec<Ray> = rays.iter().step_by(every).copied().collect();
        let proved: Vec<Certified> = proved.iter().step_by(every).copied().collect();
        let beams = beams(&surface, &tiles, &rays);
        let start = Instant::now();
        let found = tracer.trace(&beams, &settings).map_err(ExperimentError::failed)?;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        let compared = compare((&surface, &tiles), &settings, &rays, &proved, &found);
        Ok(Traced { compared, found, milliseconds })
    };
    let mut clean = true;
    let mut missed = 0;
    for (bound, every) in Bound::ALL.into_iter().zip(ctx.profile.pick(QUICK, [1; 3])) {
        if bound == Bound::Global && surface.global().slope > GENTLE {
            continue;
        }
        let Traced { compared, found, milliseconds } = trace(bound, 1.0, every)?;
        clean &= compared.missed + compared.false_hits + compared.gave_up == 0;
        missed += compared.missed;
        table.row(row(name, bound, &compared, milliseconds));
        if bound == Bound::Gradient {
            outcome.timing(&format!("{name}.milliseconds"), milliseconds)?;
            outcome.timing(&format!("{name}.largest_slack_metres"), compared.largest_slack)?;
            picture(ctx, outcome, name, (device, &tiles), &camera, (&proved, &found, effort.bracket))?;
        }
    }
    outcome.metric(&format!("{name}.missed_hits"), missed as f64)?;
    outcome.metric(&format!("{name}.margin_metres"), tiles.largest_margins()[0])?;
    let control = trace(Bound::Tile, CONTROL, ctx.profile.pick(QUICK[0], 1))?.compared;
    let broken = format!("tracing {name} with a third of each tile's bound");
    outcome.control(&format!("{name}: bound too small"), &broken, "missed hits", control.missed > 0);
    Ok(clean)
}

/// Left what the adapter sees, right how far it lies from the proof.
fn picture(
    ctx: &Context,
    outcome: &mut Outcome,
    name: &str,
    (device, tiles): (&Device, &Tiles),
    camera: &Camera,
    (proved, found, bracket): (&[Certified], &[Found], f64),
) -> Result<(), ExperimentError> {
    let surveyor = Surveyor::new(device, tiles).map_err(ExperimentError::failed)?;
    let met: Vec<&Found> = found.iter().filter(|found| found.answer.distance().is_some()).collect();
    let reach = |found: &Found| found.answer.distance().map_or(0.0, |t| 0.5 * camera.pixel() * t) as f32;
    let places: Vec<_> = met.iter().map(|found| (found.place, reach(found))).collect();
    let mut ground = surveyor.look(&places).map_err(ExperimentError::failed)?.into_iter();
    let depths = met.iter().filter_map(|found| found.answer.distance());
    let [near, far] = depths.fold([f64::INFINITY, 0.0], |[near, far]: [f64; 2], t| [near.min(t), far.max(t)]);
    let seen: Vec<u8> = found.iter().flat_map(|found| shade(found, &mut ground, [near, far])).collect();
    let signed: Vec<Agreement> = proved
        .iter()
        .zip(found)
        .map(|(proved, found)| agreement(found.answer, *proved, bracket + found.slack))
        .collect();
    let lead = largest_lead(&signed);
    let difference = colours(&signed, lead);
    let row = 3 * camera.width();
    let both: Vec<u8> = seen.chunks(row).zip(difference.chunks(row)).flat_map(|(a, b)| [a, b].concat()).collect();
    let (width, height) = (2 * camera.width() as u32, camera.height() as u32);
    let drawn = ctx.write_png(name, width, height, &both)?;
    let caption = format!(
        "Left, what the adapter sees: its normals in the light, its depth as haze. Right, its answers against the certified brackets: \
         white within, blue up to {lead:.2} m before, red beyond by less than the slack, grey nothing met, magenta missed, orange \
         met within ε of ground that the proof passes, green undecided"
    );
    outcome.picture(Picture::new(drawn, &caption).camera(format!("{name}, main")));
    Ok(())
}

/// A pixel, from the next ground where the ray has met any.
fn shade(found: &Found, ground: &mut impl Iterator<Item = Ground>, [near, far]: [f64; 2]) -> [u8; 3] {
    const SKY: DVec3 = DVec3::new(0.80, 0.86, 0.93);
    const CUT: DVec3 = DVec3::new(0.45, 0.36, 0.28);
    const SUN: DVec3 = DVec3::new(-0.86, -0.24, 0.40);
    let colour = match (found.answer, found.answer.distance().and_then(|t| Some((t, ground.next()?)))) {
        (Answer::Wall { .. }, _) => CUT,
        (_, Some((t, ground))) => {
            let Vec2 { x, y } = ground.gradient;
            let normal = (-DVec2::new(f64::from(x), f64::from(y))).extend(1.0).normalize();
            let lit = 0.2 + 0.8 * normal.dot(SUN.normalize()).max(0.0);
            let haze = 0.35 * (t - near) / (far - near).max(f64::MIN_POSITIVE);
            DVec3::splat(lit).lerp(SKY, haze)
        }
        (_, None) => SKY,
    };
    colour.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0) + 0.5) as u8)
}
