//! Table 1: evaluations, times and sizes of the paper's scenes, and every tracer against the certified one.

use super::ablations::cost;
use super::rays::{Family, Tally, Trial, compare, compare_climbing, total};
use super::record::Record;
use super::scenes::{TableScene, table_scenes};
use super::signed_error::{self, against_certified, largest_lead};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::layers::Layers;
use crate::report::{Cell, Compared, Comparison, Outcome, Picture, Table, Tolerance};
use glam::DVec2;
use std::time::Instant;
use terrain_model::bounds::THRESHOLD;
use terrain_model::certify::slope::slope_supremum;
use terrain_model::program::Program;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::shade::{Landscape, Look, Pixel, View, render, to_srgb8};
use terrain_model::trace::{Answer, Settings, Surface, Tracer};
use terrain_papers::tables::{Genevaux2015Row, genevaux2015_table1};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/table1",
    title: "Table 1: scenes, tracers, sizes",
    section: "§8, Table 1",
    about: "Each scene of the table is rebuilt with the paper's number of primitives and operators. We count evaluations per pixel of \
            each tracer (a query of elevation, of a bound, or of a normal is one), time a regular mesh, and compare every tracer \
            with the certified one on rays of five families: through the picture, grazing, from below, from outside, and along the \
            border of the domain. A miss is an answer beyond the certified bracket plus τ, or none; a false hit has h ≥ ε proved \
            where it lies, or a certified miss.",
    code: "experiments/src/genevaux2015/table1.rs",
    test: "experiments/src/genevaux2015/rays.rs::answers_are_counted_by_where_they_lie",
    expected: |profile| Expected {
        seconds: profile.pick(60.0, 30000.0),
        memory_bytes: profile.pick(256 << 20, 1 << 30),
        disk_bytes: profile.pick(8 << 20, 64 << 20),
    },
    run,
};

/// The share of a scene's certified supremum that the control's slope bound is capped at.
const CONTROL: f64 = 0.6;
/// The steepest terrain that sphere tracing is compared on, metres per metre.
const GENTLE: f64 = 100.0;
/// The share of undecided rays that a scene may have.
const UNDECIDED: f64 = 1e-3;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let table = genevaux2015_table1().map_err(ExperimentError::failed)?;
    let scenes = table_scenes().map_err(ExperimentError::failed)?;
    let mut outcome = Outcome::new(Verdict::Partial);
    let mut compared =
        Comparison::new("table1", "Table 1, the paper's columns and ours", &table.hardware, &ctx.hardware);
    let mut safety = safety_table();
    let mut clean = true;
    for scene in &scenes {
        let row = table
            .rows
            .iter()
            .find(|row| row.scene == scene.row)
            .ok_or_else(|| ExperimentError::failed(format!("Table 1 has no row {}", scene.row)))?;
        let calls = table.calls_per_pixel(row);
        clean &= run_scene(ctx, scene, row, calls, &mut outcome, &mut compared, &mut safety)?;
    }
    let verdict = compared.verdict();
    outcome.table(compared.into_table())?;
    outcome.table(safety)?;
    outcome.deviation("cameras are not published", "cameras that show the figure's subject, committed with the scenes");
    outcome.deviation(
        "positions and profiles of the primitives are not published",
        "scenes with the same counts and the same subject",
    );
    outcome.deviation(
        "ε of the hit test is not published",
        "10⁻⁴ of the scene's side in pictures (a tenth of a pixel), 10⁻⁶ of it in the comparison with the certified tracer",
    );
    outcome.deviation("normals by finite differences", "the exact gradient, one evaluation a pixel");
    outcome.deviation(
        "how steeply the paper's cameras look down is not published; evaluations fall with it",
        "aerial cameras, 60° down and more; oblique ones stand beside them and are drawn by genevaux2015/figures",
    );
    if clean {
        outcome.set_verdict(verdict, "by the rows that have a tolerance: counts, sizes, evaluations a pixel");
    } else {
        outcome.set_verdict(
            Verdict::NotReproduced,
            "a tracer missed the ground, or the certified one left too many rays open",
        );
    }
    Ok(outcome)
}

fn safety_table() -> Table {
    [
        "rays",
        "certified hits",
        "walls",
        "missed",
        "false",
        "gave up",
        "undecided",
        "largest lead",
        "evaluations per ray",
    ]
    .into_iter()
    .fold(
        Table::new("tracers", "Every tracer against the certified one, by family of rays")
            .column("scene")
            .column("tracer")
            .column("family"),
        Table::column,
    )
}

fn safety_row(scene: &str, tracer: &str, family: &str, tally: &Tally) -> Vec<Cell> {
    let mut cells: Vec<Cell> = [scene, tracer, family].into_iter().map(Cell::from).collect();
    let counts =
        [tally.rays, tally.hits, tally.walls, tally.missed_hits, tally.false_hits, tally.gave_up, tally.undecided];
    cells.extend(counts.into_iter().map(Cell::count));
    cells.push(Cell::number(tally.max_early, "m", 3));
    cells.push(Cell::number(tally.evaluations as f64 / tally.rays.max(1) as f64, "", 4));
    cells
}

fn run_scene(
    ctx: &Context,
    scene: &TableScene,
    row: &Genevaux2015Row,
    paper_calls: f64,
    outcome: &mut Outcome,
    compared: &mut Comparison,
    safety: &mut Table,
) -> Result<bool, ExperimentError> {
    let name = scene.name;
    let program = &scene.program;
    let (primitives, operators) = scene.scene.tree.count(scene.scene.layers[scene.scene.ground()]);
    outcome.metric(&format!("{name}.primitives"), primitives as f64)?;
    outcome.metric(&format!("{name}.operators"), operators as f64)?;
    outcome.metric(&format!("{name}.bytes"), program.bytes() as f64)?;
    outcome.metric(&format!("{name}.bytes_acceleration"), program.acceleration_bytes() as f64)?;
    let exact = Tolerance::absolute(0.0, "the scene is built to the paper's counts");
    compared.push(Compared::new(
        format!("{}, primitives", row.scene),
        "",
        f64::from(row.primitives),
        primitives as f64,
        exact.clone(),
    ));
    compared.push(Compared::new(
        format!("{}, operators", row.scene),
        "",
        f64::from(row.operators),
        operators as f64,
        exact,
    ));
    let size = Tolerance::ratio(0.0, 1.0, "no larger than the paper's");
    compared.push(Compared::new(
        format!("{}, memory", row.scene),
        "kB",
        f64::from(row.kilobytes),
        program.bytes() as f64 / 1000.0,
        size,
    ));

    let extent = scene.extent;
    mesh(ctx, name, program, extent, row, outcome, compared)?;

    let surface = Surface::new(program);
    let Trial { settings, effort, ground } = Trial::new(scene, &surface, extent)?;
    let coarse = picture_settings(extent);
    outcome.metric(&format!("{name}.picture_epsilon_metres"), coarse.epsilon)?;
    pictures(ctx, scene, &surface, &coarse, row, paper_calls, outcome, compared)?;

    let start = Instant::now();
    let supremum = slope_supremum(program, DVec2::ZERO, extent, 0.05, ctx.profile.pick(60_000, 1_000_000));
    outcome.timing(&format!("{name}.slope_supremum_seconds"), start.elapsed().as_secs_f64())?;
    outcome.metric(&format!("{name}.slope_bound"), surface.global().slope)?;
    outcome.metric(&format!("{name}.slope_supremum_at_least"), supremum.at_least)?;
    outcome.metric(&format!("{name}.slope_supremum_at_most"), supremum.at_most)?;
    outcome.metric(&format!("{name}.tau_metres"), effort.bracket)?;
    outcome.metric(&format!("{name}.epsilon_metres"), settings.epsilon)?;

    let rays = ctx.profile.pick(scene.quick_rays, 1_000_000);
    // Sphere tracing takes a step of h/λ; where the bound of the whole terrain is this steep, comparing it would take days.
    let compared_tracers: Vec<Tracer> = Tracer::ALL
        .into_iter()
        .filter(|tracer| *tracer != Tracer::Sphere || surface.global().slope <= GENTLE)
        .collect();
    if !compared_tracers.contains(&Tracer::Sphere) {
        let why = "the slope bound of the whole terrain is above 100: days of steps";
        for what in ["missed_hits", "false_hits", "gave_up", "max_early_metres"] {
            outcome.absent(&format!("{name}.sphere.{what}"), why)?;
        }
    }
    // The control: slope bounds capped at 0.6 of a slope that the terrain reaches must show misses.
    let broken = surface.clone().with_slope_cap(CONTROL * supremum.at_least);
    let mut tracers: Vec<_> = compared_tracers.iter().map(|tracer| (*tracer, &surface)).collect();
    tracers.push((Tracer::Sphere, &broken));
    let progress = ctx.progress(&format!("{name}: rays against the certified tracer"), rays);
    let seed = ctx.seed_for(name);
    let start = Instant::now();
    let tallies = compare(&ground, &tracers, &settings, &effort, seed, 0..rays, &|n| progress.advance(n));
    let mut clean = true;
    for (tracer, families) in compared_tracers.iter().zip(&tallies) {
        for (family, tally) in Family::ALL.into_iter().zip(families) {
            safety.row(safety_row(name, tracer.name(), family.name(), tally));
        }
        let all = total(families);
        let metric = |outcome: &mut Outcome, what: &str, value: f64| {
            outcome.metric(&format!("{name}.{}.{what}", tracer.name()), value)
        };
        metric(outcome, "missed_hits", all.missed_hits as f64)?;
        metric(outcome, "false_hits", all.false_hits as f64)?;
        metric(outcome, "gave_up", all.gave_up as f64)?;
        metric(outcome, "max_early_metres", all.max_early)?;
        clean &= all.clean() && all.undecided as f64 <= UNDECIDED * all.rays as f64;
    }
    clean &= recorded(scene, outcome, safety)?;
    outcome.metric(&format!("{name}.undecided"), total(&tallies[0]).undecided as f64)?;
    outcome.metric(&format!("{name}.rays"), rays as f64)?;

    outcome.timing(&format!("{name}.rays_seconds"), start.elapsed().as_secs_f64())?;

    let wrong = total(&tallies[compared_tracers.len()]);
    // And where the bound is wrong: rays that climb past the steepest place. The right bounds must hold there too.
    let steep = ctx.profile.pick(scene.quick_rays / 10, 50_000);
    let climbing = compare_climbing(&ground, &tracers, &settings, &effort, (seed, supremum.witness), 0..steep);
    for (tracer, families) in compared_tracers.iter().zip(&climbing) {
        let tally = total(families);
        safety.row(safety_row(name, tracer.name(), "past the steepest place", &tally));
        clean &= tally.clean() && tally.undecided as f64 <= UNDECIDED * tally.rays as f64;
    }
    let steepest = total(&climbing[compared_tracers.len()]);
    safety.row(safety_row(name, "sphere, bound × 0.6 of the supremum", "past the steepest place", &steepest));
    let wrong = Tally { missed_hits: wrong.missed_hits + steepest.missed_hits, ..wrong };
    outcome.metric(&format!("{name}.control_missed_hits"), wrong.missed_hits as f64)?;
    safety.row(safety_row(name, "sphere, bound × 0.6 of the supremum", "all", &wrong));
    let broke = format!("sphere tracing {name} with its slope bound capped at 0.6 of the certified supremum");
    outcome.control(&format!("{name}: slope bound too small"), &broke, "missed hits", wrong.missed_hits > 0);
    Ok(clean)
}

/// What earlier, longer runs counted: `reproduce rays` keeps it, and `.ci/run` counts a drawn block again.
fn recorded(scene: &TableScene, outcome: &mut Outcome, safety: &mut Table) -> Result<bool, ExperimentError> {
    let name = scene.name;
    if scene.record.is_empty() {
        outcome.absent(&format!("{name}.recorded_rays"), "no long run is recorded for this scene")?;
        return Ok(true);
    }
    let record = Record::read(scene.record)
        .map_err(|problem| ExperimentError::failed(format!("record of {name}: {problem}")))?;
    if !record.is_of(scene) {
        outcome.absent(&format!("{name}.recorded_rays"), "the scene has changed since its rays were recorded")?;
        return Ok(true);
    }
    let all = record.total();
    let [hits, walls, undecided] = all.truth;
    let from = format!("recorded: seed {}, commit {}", record.seed(), record.commits().join(", "));
    let mut clean = undecided as f64 <= UNDECIDED * record.rays() as f64;
    for (tracer, [missed_hits, false_hits, gave_up]) in Tracer::ALL.into_iter().zip(all.wrong) {
        let rays = record.rays();
        let tally = Tally { rays, hits, walls, missed_hits, false_hits, gave_up, undecided, ..Tally::default() };
        let mut row = safety_row(name, tracer.name(), &from, &tally);
        // The record does not keep these two.
        row.truncate(row.len() - 2);
        row.extend([Cell::from("–"), Cell::from("–")]);
        safety.row(row);
        clean &= tally.clean();
        let counts = [("missed_hits", missed_hits), ("false_hits", false_hits), ("gave_up", gave_up)];
        for (what, count) in counts {
            outcome.metric(&format!("{name}.{}.recorded_{what}", tracer.name()), count as f64)?;
        }
    }
    outcome.metric(&format!("{name}.recorded_rays"), record.rays() as f64)?;
    outcome.metric(&format!("{name}.recorded_undecided"), undecided as f64)?;
    Ok(clean)
}

/// ε of a picture: 10⁻⁴ of the scene's side, about a tenth of what a pixel covers when the scene fills 1080 rows.
fn picture_settings(extent: DVec2) -> Settings {
    let epsilon = 1e-4 * extent.max_element();
    Settings { epsilon, bracket: 10.0 * epsilon, edge: 1e-4 * epsilon, ..Settings::default() }
}

fn mesh(
    ctx: &Context,
    name: &str,
    program: &Program,
    extent: DVec2,
    row: &Genevaux2015Row,
    outcome: &mut Outcome,
    compared: &mut Comparison,
) -> Result<(), ExperimentError> {
    let full = (row.mesh_calls as f64).sqrt();
    let side = ctx.profile.pick(0.5 * full, full) as usize;
    let spacing = extent / (side as f64 - 1.0);
    let start = Instant::now();
    let baked = program.bake(DVec2::ZERO, spacing, side, side);
    let seconds = start.elapsed().as_secs_f64();
    let inside = baked.weight.iter().filter(|w| f64::from(**w) >= THRESHOLD).count();
    outcome.timing(&format!("{name}.mesh_seconds"), seconds)?;
    outcome.metric(&format!("{name}.mesh_calls"), (side * side) as f64)?;
    outcome.metric(&format!("{name}.mesh_terrain_share"), inside as f64 / (side * side) as f64)?;
    let why = "different hardware: the paper's ran on a GPU, ours on this CPU";
    compared.push(
        Compared::new(
            format!("{}, regular mesh, ns per call", row.scene),
            "ns",
            row.mesh_ms * 1e6 / row.mesh_calls as f64,
            seconds * 1e9 / (side * side) as f64,
            Tolerance::shown_only(why),
        )
        .machine(),
    );
    Ok(())
}

#[allow(clippy::too_many_arguments)]
fn pictures(
    ctx: &Context,
    scene: &TableScene,
    surface: &Surface<'_>,
    settings: &Settings,
    row: &Genevaux2015Row,
    paper_calls: f64,
    outcome: &mut Outcome,
    compared: &mut Comparison,
) -> Result<(), ExperimentError> {
    let name = scene.name;
    let (width, height): (u32, u32) = ctx.profile.pick((192, 108), (1920, 1080));
    let placement =
        scene.scene.cameras.get("main").ok_or_else(|| ExperimentError::failed("a scene needs a main camera"))?;
    let camera = Camera::new(placement, width as usize, height as usize);
    let look = Look::seen(surface, &camera).wished(&scene.scene.appearance);
    // Counted is the ground alone: the paper's counts have no rays to the sun.
    let ground = Landscape::from(surface.clone());
    let plain = Look { shadows: false, ..look };
    for tracer in Tracer::WITH_PAPER {
        let metric = |what: &str| format!("{name}.{}.{what}", tracer.name());
        let Some(part) = part_of_the_pixels(ctx, tracer, surface) else {
            let why = "the slope bound of the whole terrain is above 5000: a ray would take more than a million steps";
            for what in ["evaluations_per_pixel", "evaluations_per_terrain_pixel", "terrain_share"] {
                outcome.absent(&metric(what), why)?;
            }
            continue;
        };
        let (width, height) = (width / part, height / part);
        let camera = Camera::new(placement, width as usize, height as usize);
        let view = View { landscape: &ground, pixel: camera.pixel(), tracer, settings, look: &plain };
        let start = Instant::now();
        let pixels = render(&view, &camera);
        let seconds = start.elapsed().as_secs_f64();
        let terrain = pixels.iter().filter(|p| matches!(p.answer, Answer::Hit { .. })).count();
        let evaluations: u64 = pixels.iter().map(|p| p.evaluations).sum();
        let per_pixel = evaluations as f64 / pixels.len() as f64;
        outcome.metric(&metric("evaluations_per_pixel"), per_pixel)?;
        let on_terrain: u64 =
            pixels.iter().filter(|p| matches!(p.answer, Answer::Hit { .. })).map(|p| p.evaluations).sum();
        let per_terrain_pixel = on_terrain as f64 / terrain.max(1) as f64;
        outcome.metric(&metric("evaluations_per_terrain_pixel"), per_terrain_pixel)?;
        outcome.metric(&metric("terrain_share"), terrain as f64 / pixels.len() as f64)?;
        outcome.metric(&metric("pixels"), pixels.len() as f64)?;
        outcome.timing(&metric("seconds"), seconds)?;
        let tolerance = match tracer {
            Tracer::Sphere | Tracer::AcceleratedPaper => {
                Tolerance::shown_only("the paper's column is its accelerated tracer, its choice of δ unlike the text's")
            }
            Tracer::Accelerated => Tolerance::ratio(0.0, 1.0, "no more evaluations than the paper's"),
            Tracer::Segment => Tolerance::ratio(0.0, 0.5, "half of what the paper's accelerated tracer takes"),
        };
        let label = |what: &str| format!("{}, {what}, {}", row.scene, tracer.name());
        compared.push(Compared::new(label("calls per pixel"), "per pixel", paper_calls, per_pixel, tolerance));
        compared.push(Compared::new(
            label("calls per terrain pixel"),
            "per pixel",
            paper_calls,
            per_terrain_pixel,
            Tolerance::shown_only("the paper divides by all pixels"),
        ));
        compared.push(
            Compared::new(
                label("ns per call"),
                "ns",
                row.sphere_tracing_ms * 1e6 / row.sphere_tracing_calls as f64,
                seconds * 1e9 / evaluations.max(1) as f64,
                Tolerance::shown_only("different hardware: the paper's ran on a GPU, ours on this CPU"),
            )
            .machine(),
        );
        if part <= 2 {
            let steps = ctx.write_png(&format!("{name}_{}_steps", tracer.name()), width, height, &heat(&pixels))?;
            let caption = format!("Evaluations per pixel, {} tracer: black 0, white 128 and more", tracer.name());
            outcome.picture(Picture::new(steps, &caption).camera(format!("{name}, main")));
        }
    }
    let layers = Layers::of(&scene.scene, scene.program.clone()).map_err(ExperimentError::failed)?;
    let landscape = layers.landscape();
    let view = View { landscape: &landscape, pixel: camera.pixel(), tracer: Tracer::Segment, settings, look: &look };
    let colours: Vec<u8> = render(&view, &camera).iter().flat_map(|p| to_srgb8(p.colour)).collect();
    let image = ctx.write_png(name, width, height, &colours)?;
    outcome.picture(Picture::new(image, &format!("After {}", row.scene)).camera(format!("{name}, main")));
    let (width, height): (u32, u32) = ctx.profile.pick((96, 54), (480, 270));
    let camera = Camera::new(placement, width as usize, height as usize);
    for tracer in [Tracer::Accelerated, Tracer::Segment] {
        let visits = cost(surface, &camera, tracer, settings).visits_per_pixel();
        outcome.metric(&format!("{name}.{}.node_visits_per_pixel", tracer.name()), visits)?;
        compared.push(Compared::new(
            format!("{}, node visits per pixel beside the calls, {}", row.scene, tracer.name()),
            "per pixel",
            paper_calls,
            visits,
            Tolerance::shown_only(
                "the paper counts calls; a call visits the nodes of the program pruned to where it asks",
            ),
        ));
    }
    let start = Instant::now();
    let agreement = against_certified(surface, &camera, Tracer::Segment, settings);
    outcome.timing(&format!("{name}.picture_certified_seconds"), start.elapsed().as_secs_f64())?;
    let lead = largest_lead(&agreement);
    outcome.metric(&format!("{name}.segment.picture_max_early_metres"), lead)?;
    let drawn =
        ctx.write_png(&format!("{name}_signed_error"), width, height, &signed_error::colours(&agreement, lead))?;
    let caption = format!(
        "Segment tracer against the certified one: white within the certified bracket, blue up to {lead:.2} m before it (0 ≤ h < ε), \
         red beyond it, grey nothing met, magenta missed, orange false, green undecided"
    );
    outcome.picture(Picture::new(drawn, &caption).camera(format!("{name}, main")));
    Ok(())
}

/// The two tracers that are not ours may take thousands of evaluations a pixel: they are counted on every n-th pixel of every
/// n-th row, n by the slope bound for sphere tracing and twice as large in a quick run; `None` where that would still take days.
fn part_of_the_pixels(ctx: &Context, tracer: Tracer, surface: &Surface<'_>) -> Option<u32> {
    let fewer = ctx.profile.pick(2, 1);
    match (tracer, surface.global().slope) {
        (Tracer::Accelerated | Tracer::Segment, _) => Some(1),
        (Tracer::Sphere, ..=GENTLE) => Some(fewer),
        (Tracer::AcceleratedPaper, _) => Some(6 * fewer),
        (Tracer::Sphere, ..=5000.0) => Some(12),
        (Tracer::Sphere, _) => None,
    }
}

/// Counts of evaluations as a ramp from black over violet and orange to white.
fn heat(pixels: &[Pixel]) -> Vec<u8> {
    const RAMP: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.02], [0.34, 0.06, 0.43], [0.73, 0.22, 0.33], [0.98, 0.56, 0.04], [1.0, 1.0, 0.9]];
    pixels
        .iter()
        .flat_map(|pixel| {
            let x = (pixel.evaluations as f64 / 128.0).clamp(0.0, 1.0) * 4.0;
            let (i, t) = ((x as usize).min(3), x - x.floor().min(3.0));
            [0, 1, 2].map(|k| ((RAMP[i][k] + t * (RAMP[i + 1][k] - RAMP[i][k])) * 255.0 + 0.5) as u8)
        })
        .collect()
}
