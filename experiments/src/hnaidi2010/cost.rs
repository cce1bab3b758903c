//! Time against the number of curves on one raster, and against the raster with the same curves.

use super::curves::{Kind, SIDE, random};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Claim, Outcome, Plot, Style, Table};
use std::time::Instant;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Settings, Solver, diffuse};
use terrain_diffusion::raster::Domain;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/cost",
    title: "Time against number of curves and against grid size",
    section: "§6",
    about: "The paper says that time hardly depends on the number of curves and is driven by the size of the grid. One to 512 random \
            curves with slopes and noise on one raster, and 64 curves on rasters of growing size: seconds of rasterising and of all \
            fields, and the exponents of a power law fitted to them. Iterations are the same on every machine.",
    code: "experiments/src/hnaidi2010/cost.rs",
    test: "experiments/src/hnaidi2010/cost.rs::the_exponent_of_a_power_law_is_found",
    expected: |profile| Expected {
        seconds: profile.pick(20.0, 300.0),
        memory_bytes: profile.pick(256 << 20, 3 << 30),
        disk_bytes: 128 << 10,
    },
    run,
};

const SOLVERS: [Solver; 3] = [Solver::Paper, Solver::Multigrid, Solver::Variational];
/// Exponent of the time against curves that counts as hardly any.
const HARDLY: f64 = 0.4;

/// What the time is plotted against, curves, and nodes a side.
type Try = (usize, usize, usize);

/// Seconds, the least of three, and the most iterations of a solve.
fn timed(curves: &[Curve], nodes: usize, solver: Solver) -> Result<(f64, usize), ExperimentError> {
    let settings = Settings { solver, ..Settings::default() };
    let mut best = (f64::INFINITY, 0);
    for _ in 0..3 {
        let start = Instant::now();
        let fields = diffuse(curves, Domain::square(SIDE, nodes), &settings).map_err(ExperimentError::failed)?;
        let seconds = start.elapsed().as_secs_f64();
        best = (seconds.min(best.0), fields.reports.iter().map(|report| report.iterations).max().unwrap_or(0));
    }
    Ok(best)
}

/// The exponent p of y = c·xᵖ by least squares of the logarithms.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (libm::log(*x), libm::log(*y))).collect();
    let n = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (above, below) =
        logs.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
    above / below
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let counts = [1usize, 2, 4, 8, 16, 32, 64, 128, 256, 512];
    let (fixed, sides): (usize, &[usize]) =
        ctx.profile.pick((257, &[129, 257, 513, 1025]), (1025, &[129, 257, 513, 1025, 2049]));
    let curves = random(ctx.seed_for("curves"), 512, Kind::Ridges).map_err(ExperimentError::failed)?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let progress = ctx.progress("solves", (SOLVERS.len() * (counts.len() + sides.len())) as u64);
    let mut exponents = Vec::new();
    let tries: [(&str, Vec<Try>); 2] = [
        ("curves", counts.into_iter().map(|count| (count, count, fixed)).collect()),
        ("nodes", sides.iter().map(|&side| (side * side, 64, side)).collect()),
    ];
    for (what, tries) in tries {
        let mut table = Table::new(what, "Iterations and seconds of all fields")
            .column(what)
            .column("solver")
            .column("most iterations")
            .machine_column("seconds");
        let mut plot = Plot::new(
            &format!("seconds-{what}"),
            &format!("Time against {what}"),
            Axis::log(what),
            Axis::log("seconds"),
        );
        for solver in SOLVERS {
            let mut points = Vec::new();
            for &(x, count, side) in &tries {
                let (seconds, iterations) = timed(&curves[..count], side, solver)?;
                outcome.metric(&format!("{what}.{x}.{}.iterations", solver.name()), iterations as f64)?;
                outcome.timing(&format!("{what}.{x}.{}.seconds", solver.name()), seconds)?;
                table.row([
                    Cell::count(x as u64),
                    Cell::from(solver.name()),
                    Cell::count(iterations as u64),
                    Cell::number(seconds, "s", 3),
                ]);
                points.push((x as f64, seconds));
                progress.advance(1);
            }
            let exponent = exponent(&points);
            outcome.timing(&format!("{what}.{}.log_log_slope", solver.name()), exponent)?;
            exponents.push((what, solver, exponent));
            plot = plot.series(solver.name(), Style::LineAndPoints, points);
        }
        outcome.table(table)?;
        outcome.plot(plot.machine())?;
    }
    let most = |which: &str| {
        let of = exponents.iter().filter(|(what, solver, _)| *what == which && *solver != Solver::Paper);
        of.map(|(_, _, exponent)| *exponent).fold(f64::NEG_INFINITY, f64::max)
    };
    let (by_curves, by_nodes) = (most("curves"), most("nodes"));
    let holds = by_curves < HARDLY && by_nodes > 2.0 * by_curves;
    let verdict = if holds { ClaimVerdict::Reproduced } else { ClaimVerdict::NotReproduced };
    let limit = format!(
        "at {fixed} nodes a side, 1 to 512 curves: an exponent below {HARDLY}, and half of that by nodes at most"
    );
    outcome.claim(Claim::new(
        "C26",
        "The cost is nearly independent of the number of curves and is driven by the size of the grid (§6).",
        verdict,
        limit,
    ))?;
    if !holds {
        outcome.set_verdict(Verdict::NotReproduced, "the number of curves drives the time");
    }
    outcome.control(
        "nodes taken for curves",
        "the exponent of the time by number of nodes held to the limit of that by curves",
        "it exceeds the limit",
        by_nodes > HARDLY,
    );
    outcome.deviation("which curves the paper added", "random ones: half of them cross others, as no author's would");
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_law_is_found() {
        let law = |p: f64| (1..9).map(|k| (f64::from(k), 3.0 * libm::pow(f64::from(k), p))).collect::<Vec<_>>();
        assert!((exponent(&law(1.5)) - 1.5).abs() < 1e-12 && (exponent(&law(0.1)) - 0.1).abs() < 1e-12);
    }
}
