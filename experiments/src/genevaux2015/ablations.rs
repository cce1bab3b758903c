//! What each means of acceleration saves (§8.2): hierarchical boxes, frequency pruning, and one tracer against another.

use super::scenes::table_scenes;
use crate::experiment::{Context, Expected, Experiment, ExperimentError, Profile};
use crate::model::throughput::instructions_each;
use crate::report::{Cell, Outcome, Table};
use crate::scenes;
use glam::DVec2;
use rayon::prelude::*;
use terrain_model::program::Program;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::{Answer, HeightRay, RayFunction, Settings, Surface, Tracer};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/ablations",
    title: "What boxes, frequency pruning and the choice of tracer save",
    section: "§7.3.1, §8.2",
    about: "Pictures of the scenes are traced with everything on, without the quadtree of pruned programs (hierarchical boxes), and, \
            where detail depends on the distance, without frequency pruning: full detail everywhere. Counted are evaluations a pixel (a \
            value, a bound, an enclosure or a normal is one), instructions that they run (nodes of the tree), octaves of noise, and \
            the slope bound that sphere tracing steps by; these counts are the same on every machine. \
            With valgrind present, machine instructions a pixel of Fig. 3 stand beside them.",
    code: "experiments/src/genevaux2015/ablations.rs",
    test: "experiments/src/genevaux2015/ablations.rs::boxes_change_no_hit_and_save_visits",
    expected: |profile| Expected { seconds: profile.pick(20.0, 600.0), memory_bytes: 256 << 20, disk_bytes: 256 << 10 },
    run,
};

/// What a picture took, per pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cost {
    pixels: u64,
    hits: u64,
    gave_up: u64,
    evaluations: u64,
    visits: u64,
}

impl Cost {
    fn merge(self, o: Cost) -> Cost {
        Cost {
            pixels: self.pixels + o.pixels,
            hits: self.hits + o.hits,
            gave_up: self.gave_up + o.gave_up,
            evaluations: self.evaluations + o.evaluations,
            visits: self.visits + o.visits,
        }
    }
    /// Nodes visited, a pixel.
    pub(super) fn visits_per_pixel(&self) -> f64 {
        self.per_pixel(self.visits)
    }
    fn per_pixel(&self, count: u64) -> f64 {
        count as f64 / self.pixels.max(1) as f64
    }
}

/// Traces one ray a pixel, with the normal where the ground is hit.
pub(super) fn cost(surface: &Surface<'_>, camera: &Camera, tracer: Tracer, settings: &Settings) -> Cost {
    let row = |row: usize| {
        let mut field = HeightRay::new(surface);
        let mut cost = Cost::default();
        for column in 0..camera.width() {
            field.aim(camera.ray(column as f64 + 0.5, row as f64 + 0.5));
            let answer = tracer.trace(surface, &mut field, settings);
            if let Answer::Hit { t } = answer {
                field.sample(t);
            }
            cost = cost.merge(Cost {
                pixels: 1,
                hits: u64::from(matches!(answer, Answer::Hit { .. })),
                gave_up: u64::from(matches!(answer, Answer::GaveUp { .. })),
                evaluations: field.evaluations(),
                visits: field.visits(),
            });
        }
        cost
    };
    (0..camera.height()).into_par_iter().map(row).reduce(Cost::default, Cost::merge)
}

/// Mean number of octaves that are left around the points of a raster of the support.
fn octaves(surface: &Surface<'_>, low: DVec2, high: DVec2) -> f64 {
    const SIDE: usize = 64;
    let at = |k: usize| low + (high - low) * DVec2::new((k % SIDE) as f64 + 0.5, (k / SIDE) as f64 + 0.5) / SIDE as f64;
    let all: usize = (0..SIDE * SIDE).map(|k| surface.cells().at(at(k)).octaves()).sum();
    all as f64 / (SIDE * SIDE) as f64
}

/// Traces `count` pixels of a scene of Table 1, the first ones of a sequence that covers the picture evenly: what the hidden
/// command `count-pixels` runs.
///
/// # Errors
/// No such scene or tracer.
pub fn count_pixels(scene: &str, tracer: &str, count: u32) -> Result<u64, ExperimentError> {
    let found = table_scenes().map_err(ExperimentError::failed)?.into_iter().find(|known| known.name == scene);
    let scene = found.ok_or_else(|| ExperimentError::failed(format!("{scene}: no such scene")))?;
    let tracer = Tracer::WITH_PAPER.into_iter().find(|known| known.name() == tracer);
    let tracer = tracer.ok_or_else(|| ExperimentError::failed("no such tracer"))?;
    let placement = scene.scene.cameras.get("main").ok_or_else(|| ExperimentError::failed("no main camera"))?;
    let camera = Camera::new(placement, 1920, 1080);
    let settings = picture_settings(scene.extent.max_element());
    let surface = Surface::new(&scene.program);
    let mut field = HeightRay::new(&surface);
    // The plane's golden ratio.
    let (mut at, step) = (DVec2::splat(0.5), DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3));
    let mut evaluations = 0;
    for _ in 0..count {
        at = (at + step).fract();
        field.aim(camera.ray(at.x * camera.width() as f64, at.y * camera.height() as f64));
        if let Answer::Hit { t } = tracer.trace(&surface, &mut field, &settings) {
            field.sample(t);
        }
        evaluations += field.evaluations();
    }
    Ok(evaluations)
}

/// ε of a picture, as in Table 1.
fn picture_settings(size: f64) -> Settings {
    let epsilon = 1e-4 * size;
    Settings { epsilon, bracket: 10.0 * epsilon, edge: 1e-4 * epsilon, ..Settings::default() }
}

struct Subject {
    name: &'static str,
    program: Program,
    camera: Camera,
    low: DVec2,
    high: DVec2,
    settings: Settings,
}

/// The scenes of Table 1, and one whose detail depends on the distance.
fn subjects(ctx: &Context) -> Result<Vec<Subject>, ExperimentError> {
    let (width, height) = ctx.profile.pick((80, 45), (960, 540));
    let mut all = Vec::new();
    for scene in table_scenes().map_err(ExperimentError::failed)? {
        // A quick run leaves out the scenes whose slopes are steep.
        if ctx.profile == Profile::Quick && !["fig3", "fig19"].contains(&scene.name) {
            continue;
        }
        let Some(placement) = scene.scene.cameras.get("main") else { continue };
        all.push(Subject {
            name: scene.name,
            camera: Camera::new(placement, width, height),
            low: DVec2::ZERO,
            high: scene.extent,
            settings: picture_settings(scene.extent.max_element()),
            program: scene.program,
        });
    }
    let scene = scenes::load("builtin:fig16_lod").map_err(ExperimentError::failed)?;
    let program = scene.program(scene.ground()).map_err(ExperimentError::failed)?;
    let placement = scene.cameras.get("main").ok_or_else(|| ExperimentError::failed("fig16_lod has no main camera"))?;
    let (low, high) = program.support().ok_or_else(|| ExperimentError::failed("fig16_lod is empty"))?;
    let size = (high - low).max_element();
    let camera = Camera::new(placement, width, height);
    all.push(Subject { name: "fig16_lod", program, camera, low, high, settings: picture_settings(size) });
    Ok(all)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let titles = ["tracer", "boxes", "octaves filtered", "evaluations a pixel", "instructions a pixel", "hits"];
    let table = Table::new("costs", "What a pixel takes, normals included");
    let mut table = titles.into_iter().fold(table.column("scene"), Table::column);
    let mut filters = Table::new("frequencies", "Frequency pruning, with boxes")
        .column("scene")
        .column("octaves filtered")
        .column("octaves a point")
        .column("slope bound");
    let subjects = subjects(ctx)?;
    let progress = ctx.progress("pictures", subjects.len() as u64);
    let (mut same, mut saved, mut filtered) = (true, true, true);
    for subject in &subjects {
        let Subject { name, program, camera, low, high, settings } = subject;
        let full = program.with_focus(None);
        let filters_something = *name == "fig16_lod";
        let ways: &[(&str, bool, bool)] = if filters_something {
            &[("all", true, true), ("without_boxes", false, true), ("without_frequency_pruning", true, false)]
        } else {
            &[("all", true, false), ("without_boxes", false, false)]
        };
        let mut costs = Vec::new();
        for (way, boxes, filter) in ways {
            let surface = Surface::new(if *filter { program } else { &full });
            let surface = if *boxes { surface } else { surface.without_cells() };
            let mut of_tracers = Vec::new();
            for tracer in Tracer::WITH_PAPER {
                let cost = cost(&surface, camera, tracer, settings);
                let (evaluations, visits) = (cost.per_pixel(cost.evaluations), cost.per_pixel(cost.visits));
                let prefix = format!("{name}.{}.{way}", tracer.name());
                outcome.metric(&format!("{prefix}.evaluations_per_pixel"), evaluations)?;
                outcome.metric(&format!("{prefix}.instructions_visited_per_pixel"), visits)?;
                let word = |yes: bool| Cell::from(if yes { "yes" } else { "no" });
                table.row([
                    Cell::from(*name),
                    Cell::from(tracer.name()),
                    word(*boxes),
                    word(*filter),
                    Cell::number(evaluations, "", 4),
                    Cell::number(visits, "", 4),
                    Cell::count(cost.hits),
                ]);
                of_tracers.push(cost);
            }
            if *boxes && filters_something {
                let (octaves, slope) = (octaves(&surface, *low, *high), surface.global().slope);
                outcome.metric(&format!("{name}.{way}.octaves_per_point"), octaves)?;
                outcome.metric(&format!("{name}.{way}.slope_bound"), slope)?;
                let word = if *filter { "yes" } else { "no" };
                filters.row([
                    Cell::from(*name),
                    Cell::from(word),
                    Cell::number(octaves, "", 4),
                    Cell::number(slope, "", 4),
                ]);
                costs.push((of_tracers, octaves, slope));
            } else {
                costs.push((of_tracers, 0.0, 0.0));
            }
        }
        for (with, without) in costs[0].0.iter().zip(&costs[1].0) {
            same &= with.hits.abs_diff(without.hits) <= with.pixels / 1000;
            saved &=
                with.evaluations <= without.evaluations + without.evaluations / 100 && with.visits < without.visits;
        }
        if let [(with, fewer, gentler), _, (without, more, steeper)] = &costs[..] {
            let evaluations = |costs: &[Cost]| costs.iter().map(|cost| cost.evaluations).sum::<u64>();
            filtered = fewer < more && gentler <= steeper && evaluations(with) <= evaluations(without);
        }
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.table(filters)?;
    // A quick run does not wait for callgrind. Squares that are first met between few and many pixels are built in the count.
    for tracer in Tracer::WITH_PAPER {
        let name = format!("fig3.{}.instructions_per_pixel", tracer.name());
        let counted = match ctx.profile {
            Profile::Quick => Err("counted at full size".to_owned()),
            Profile::Full => instructions_each(&["count-pixels", "fig3", tracer.name()], [2_000, 6_000]),
        };
        match counted {
            Ok(count) => outcome.timing(&name, count)?,
            Err(why) => outcome.absent(&name, why)?,
        }
    }
    if !(same && saved && filtered) {
        let why = format!(
            "boxes leave the hits as they are: {same}; they save instructions and cost no evaluations: {saved}; frequency pruning saves \
             octaves and evaluations and lowers the slope bound: {filtered}"
        );
        outcome.set_verdict(Verdict::Partial, why);
    }
    outcome.control(
        "without boxes",
        "the quadtree of pruned programs turned off",
        "every evaluation visits the whole program",
        saved,
    );
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_change_no_hit_and_save_visits() {
        let scene = table_scenes().unwrap().into_iter().find(|scene| scene.name == "fig3").unwrap();
        let camera = Camera::new(&scene.scene.cameras["main"], 24, 16);
        let settings = Settings { epsilon: 0.1, bracket: 1.0, edge: 1e-5, ..Settings::default() };
        let surface = Surface::new(&scene.program);
        let plain = surface.clone().without_cells();
        for tracer in Tracer::WITH_PAPER {
            let (with, without) =
                (cost(&surface, &camera, tracer, &settings), cost(&plain, &camera, tracer, &settings));
            assert_eq!((with.hits, with.gave_up), (without.hits, without.gave_up), "{tracer:?}");
            assert_eq!(without.visits, without.evaluations * scene.program.code().len() as u64);
            // δ as printed grows to spans that only large squares hold: they save less of them.
            let least = if tracer == Tracer::AcceleratedPaper { 1.5 } else { 2.0 };
            assert!(least * (with.visits as f64) < without.visits as f64, "{tracer:?}: {with:?} {without:?}");
        }
    }
}
