//! One curve is changed at a time, and the terrain follows.

use super::models::{MODELS, load};
use super::rasters::largest_difference;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use glam::DVec2;
use std::time::Instant;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::edit::Editor;
use terrain_diffusion::fields::{Fields, Settings, Solver, diffuse};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/editing",
    title: "One curve changed: latency",
    section: "§6",
    about: "A curve of each model is moved by a hundredth of the landscape. The rows it reaches are drawn anew and every solve starts \
            from the fields as they were: iterations and seconds beside those of a fresh start, and how far the two answers differ.",
    code: "experiments/src/hnaidi2010/editing.rs",
    test: "diffusion/src/edit.rs::edited_fields_are_those_of_a_fresh_start_in_fewer_iterations",
    expected: |profile| Expected {
        seconds: profile.pick(4.0, 90.0),
        memory_bytes: profile.pick(128 << 20, 2 << 30),
        disk_bytes: 64 << 10,
    },
    run,
};

/// A share of the range by which edited and fresh elevations may differ, both being converged.
const TOLERANCE: f64 = 1e-4;

/// The curve, moved.
fn moved(curve: &Curve, by: DVec2) -> Result<Curve, ExperimentError> {
    let control = curve.control().iter().map(|p| *p + by).collect();
    Curve::new(control, curve.points().to_vec()).map_err(ExperimentError::failed)
}

fn iterations(fields: &Fields) -> usize {
    fields.reports.iter().map(|report| report.iterations).sum()
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let nodes = ctx.profile.pick(257, 1025);
    let solvers = [Solver::Multigrid, Solver::Variational];
    let mut table = Table::new("edits", "Iterations of all solves after one curve was moved, and of a fresh start")
        .column("model")
        .column("solver")
        .column("iterations, edited")
        .column("iterations, fresh")
        .column("largest difference (% of range)")
        .machine_column("seconds, edited")
        .machine_column("seconds, fresh");
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let progress = ctx.progress("edits", (MODELS.len() * solvers.len()) as u64);
    let (mut worst, mut unseen, mut stale) = (0.0f64, f64::INFINITY, f64::INFINITY);
    for (name, title) in MODELS {
        let landscape = load(name)?;
        let domain = landscape.domain(nodes);
        let by = DVec2::splat(0.01 * domain.spacing * (nodes - 1) as f64);
        for solver in solvers {
            let settings = Settings { solver, ..Settings::default() };
            let mut editor =
                Editor::new(landscape.curves().to_vec(), domain, settings).map_err(ExperimentError::failed)?;
            let before = editor.fields().clone();
            let index = editor.curves().len() / 2;
            let curve = moved(&editor.curves()[index], by)?;
            let start = Instant::now();
            editor.put(index, curve).map_err(ExperimentError::failed)?;
            let edited_seconds = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let fresh = diffuse(editor.curves(), domain, &settings).map_err(ExperimentError::failed)?;
            let fresh_seconds = start.elapsed().as_secs_f64();
            let differs = largest_difference(&editor.fields().elevation, &fresh.elevation);
            worst = worst.max(differs);
            unseen = unseen.min(largest_difference(&before.elevation, &editor.fields().elevation));
            stale = stale.min(largest_difference(&before.elevation, &fresh.elevation));
            let id = format!("{name}.{nodes}.{}", solver.name());
            outcome.metric(&format!("{id}.iterations"), iterations(editor.fields()) as f64)?;
            outcome.metric(&format!("{id}.fresh_iterations"), iterations(&fresh) as f64)?;
            outcome.timing(&format!("{id}.seconds"), edited_seconds)?;
            outcome.timing(&format!("{id}.fresh_seconds"), fresh_seconds)?;
            table.row([
                Cell::from(title),
                Cell::from(solver.name()),
                Cell::count(iterations(editor.fields()) as u64),
                Cell::count(iterations(&fresh) as u64),
                Cell::number(100.0 * differs, "%", 2),
                Cell::number(edited_seconds, "s", 3),
                Cell::number(fresh_seconds, "s", 3),
            ]);
            progress.advance(1);
        }
    }
    outcome.table(table)?;
    outcome.metric("max_difference_of_range", worst)?;
    outcome.control(
        "the fields before the edit",
        "stale fields instead of the edited ones",
        "they differ from a fresh start by more than the tolerance",
        stale > TOLERANCE && unseen > TOLERANCE,
    );
    if worst > TOLERANCE {
        outcome.set_verdict(Verdict::NotReproduced, "edited fields are not those of a fresh start");
    }
    outcome.deviation(
        "the paper edits by hand and gives no latency",
        "one curve of each model moved by a hundredth of the landscape, all else kept",
    );
    Ok(outcome)
}
