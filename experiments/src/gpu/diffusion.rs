//! The six landscapes of Hnaidi 2010 diffused on the adapter and on the processor.

use crate::environment::Gpu;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::hnaidi2010::models::{MODELS, load};
use crate::report::{Cell, Outcome, Table};
use std::time::Instant;
use terrain_diffusion::fields::{Fields, Settings, Solver, diffuse};
use terrain_diffusion::solver::krylov::Stop;
use terrain_gpu::diffusion::Diffuser;
use terrain_gpu::diffusion::compare::Compared;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "gpu/diffusion",
    title: "Landscapes diffused on the adapter",
    section: "Hnaidi 2010, §5, Tables 1 and 2",
    about: "Each system of each landscape is solved by the adapter and by the processor to a tight residual; the two may lie apart by \
            the sum of their residuals times a bound of the inverse, which is solved for. Where the paper's schedule runs, each of its \
            rasters is iterated in f64 too, from what the adapter had on the raster below, and may differ by what f32 loses on the \
            way. Milliseconds are of all systems to that residual, with hierarchies built by the processor, upload and read-back, or of \
            the schedule with its curves drawn. The controls are a product that reads the wrong neighbour and a slope that weighs 0.501.",
    code: "experiments/src/gpu/diffusion.rs",
    test: "gpu/src/diffusion/tests.rs::converged_fields_are_those_of_the_processor_within_what_their_residuals_allow",
    expected: |profile| Expected {
        seconds: profile.pick(15.0, 3600.0),
        memory_bytes: profile.pick(256 << 20, 6 << 30),
        disk_bytes: 32 << 10,
    },
    run,
};

/// Nodes along the longer side, quick and full.
const SIZES: [&[usize]; 2] = [&[65], &[257, 513, 1025, 2048]];
/// What both solve to, so that the bound is far below what one would see.
const TIGHT: Stop = Stop { relative_residual: 1e-11, iterations: 100 };
/// The solvers compared, and whether they are the paper's schedule.
const SOLVERS: [(Solver, bool); 4] =
    [(Solver::Paper, true), (Solver::Corrected, true), (Solver::Multigrid, false), (Solver::Variational, false)];

/// What one solver did on one raster.
struct Row {
    iterations: usize,
    processor_iterations: usize,
    residual: f64,
    milliseconds: f64,
    processor_milliseconds: f64,
    /// Of the elevation from the processor's, metres.
    difference: f64,
    /// The largest share of what a difference may be.
    share: f64,
    converged: bool,
}

fn furthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, next| if next.is_nan() { f64::NAN } else { most.max(next) })
}

fn milliseconds<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, 1e3 * start.elapsed().as_secs_f64())
}

/// Largest share of its bound, over systems.
fn share(found: &[Compared]) -> f64 {
    let share = |found: &Compared| if found.difference == 0.0 { 0.0 } else { found.difference / found.bound };
    found.iter().map(share).fold(0.0, |most, next| if next.is_nan() { f64::NAN } else { most.max(next) })
}

fn measure(device: &Diffuser<'_>, model: &str, size: usize, solver: Solver) -> Result<Row, ExperimentError> {
    let landscape = load(model)?;
    let (curves, domain) = (landscape.curves(), landscape.domain(size));
    let failed = ExperimentError::failed;
    let settings = Settings { solver, stop: TIGHT, ..Settings::default() };
    let most = |fields: &Fields| fields.reports.iter().map(|report| report.iterations).max().unwrap_or(0);
    let residual = |fields: &Fields| fields.reports.iter().map(|report| report.relative_residual).fold(0.0, f64::max);
    if matches!(solver, Solver::Paper | Solver::Corrected) {
        let (fields, milliseconds_of_device) = milliseconds(|| device.diffuse(curves, domain, &settings));
        let (reference, processor_milliseconds) = milliseconds(|| diffuse(curves, domain, &settings));
        let (fields, reference) = (fields.map_err(failed)?, reference.map_err(failed)?);
        let (_, share) = device.compare_cascade(curves, domain, solver.update()).map_err(failed)?;
        return Ok(Row {
            iterations: most(&fields),
            processor_iterations: most(&reference),
            residual: residual(&fields),
            milliseconds: milliseconds_of_device,
            processor_milliseconds,
            difference: furthest(&fields.elevation, &reference.elevation),
            share: share.largest(),
            converged: true,
        });
    }
    let (fields, found) = device.compare(curves, domain, &settings).map_err(failed)?;
    let [milliseconds, processor_milliseconds] =
        [0, 1].map(|side| 1e3 * found.iter().map(|found| found.seconds[side]).sum::<f64>());
    Ok(Row {
        iterations: most(&fields),
        processor_iterations: found.iter().map(|found| found.iterations[1]).max().unwrap_or(0),
        residual: residual(&fields),
        milliseconds,
        processor_milliseconds,
        difference: found.last().map_or(0.0, |found| found.difference),
        share: share(&found),
        converged: found.iter().all(|found| found.converged),
    })
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let device = match crate::gpu::adapter()? {
        Ok(device) => device,
        Err(skipped) => return Ok(skipped),
    };
    let diffuser = Diffuser::new(&device).map_err(ExperimentError::failed)?;
    let sizes = ctx.profile.pick(SIZES[0], SIZES[1]);
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("fields", "The adapter's fields beside the processor's")
        .column("landscape")
        .column("nodes a side")
        .column("solver")
        .column("iterations of the processor");
    for title in
        ["iterations", "relative residual", "difference", "share of what it may be", "time", "time of the processor"]
    {
        table = table.machine_column(title);
    }
    let (mut failures, mut compared, mut largest_share) = (0, 0, 0.0f64);
    let progress = ctx.progress("solves", (MODELS.len() * sizes.len() * SOLVERS.len()) as u64);
    for (model, _) in MODELS {
        for &size in sizes {
            for (solver, schedule) in SOLVERS {
                let row = measure(&diffuser, model, size, solver)?;
                let name = solver.name();
                // A share that is no number is beyond the bound.
                let within = row.share <= 1.0 && row.converged;
                failures += usize::from(!within);
                compared += 1;
                largest_share = if row.share.is_nan() { f64::INFINITY } else { largest_share.max(row.share) };
                let key = if solver == Solver::Multigrid {
                    format!("{model}.{size}")
                } else {
                    format!("{model}.{size}.{name}")
                };
                outcome.timing(&format!("{key}.milliseconds"), row.milliseconds)?;
                outcome.timing(&format!("{key}.processor_milliseconds"), row.processor_milliseconds)?;
                outcome.timing(&format!("{key}.max_difference"), row.difference)?;
                outcome.timing(&format!("{key}.iterations"), row.iterations as f64)?;
                outcome.timing(&format!("{key}.residual"), row.residual)?;
                table.row([
                    Cell::from(model),
                    Cell::count(size as u64),
                    Cell::from(if schedule { format!("{name}, the schedule") } else { name.to_owned() }.as_str()),
                    Cell::count(row.processor_iterations as u64),
                    Cell::count(row.iterations as u64),
                    Cell::number(row.residual, "", 2),
                    Cell::number(row.difference, "m", 2),
                    Cell::number(row.share, "", 2),
                    Cell::number(row.milliseconds, "ms", 3),
                    Cell::number(row.processor_milliseconds, "ms", 3),
                ]);
                progress.advance(1);
            }
        }
    }
    outcome.table(table)?;
    outcome.metric("compared", compared as f64)?;
    outcome.metric("failures", failures as f64)?;
    outcome.timing("largest_share_of_tolerance", largest_share)?;
    outcome.timing("adapter_is_software", f64::from(u8::from(device.description().software)))?;
    controls(&device, &mut outcome)?;
    outcome.deviation(
        "the paper's times are of an unconverged answer on a GTX 275",
        "times of the adapter at hand, shown but not compared: software adapters say nothing of speed",
    );
    if failures > 0 {
        outcome.set_verdict(Verdict::NotReproduced, "the adapter is further from the processor than it may be");
    }
    outcome.gpu(Gpu::from(device.description().clone()));
    Ok(outcome)
}

/// Faults in kernels, which the comparisons must notice.
fn controls(device: &terrain_gpu::context::Context, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let landscape = load("canyon")?;
    let (curves, domain) = (landscape.curves(), landscape.domain(65));
    let faulty = Diffuser::perturbed(device, "product", "sides[w] * south", "sides[w] * north")
        .map_err(ExperimentError::failed)?;
    let settings = Settings { stop: TIGHT, ..Settings::default() };
    let (_, found) = faulty.compare(curves, domain, &settings).map_err(ExperimentError::failed)?;
    let noticed = found.iter().any(|found| !found.converged) || share(&found) > 1.0;
    outcome.control(
        "the wrong neighbour",
        "products at nodes with slopes read the north for the south",
        "no convergence, or a difference beyond the bound",
        noticed,
    );
    let faulty =
        Diffuser::perturbed(device, "jacobi", "0.5 * implied", "0.501 * implied").map_err(ExperimentError::failed)?;
    let (_, share) = faulty.compare_cascade(curves, domain, Solver::Paper.update()).map_err(ExperimentError::failed)?;
    outcome.control(
        "a heavier slope",
        "slopes weigh 0.501 for ½",
        "elevations beyond what f32 loses",
        share.elevation > 1.0,
    );
    Ok(())
}
