//! How each solver converges: iterations by size and on random curves with cracks, error by work, and what Jacobi alone would need.

use super::curves::{Kind, SIDE, random};
use super::rasters::{largest_difference, rms_difference};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::genevaux2015::rays::Random;
use crate::report::{Axis, Cell, Claim, Outcome, Plot, Style, Table};
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Fields, Settings, Solver, diffuse};
use terrain_diffusion::raster::{Domain, rasterise};
use terrain_diffusion::solver::krylov::Stop;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/convergence",
    title: "Convergence of the solvers",
    section: "§5.2",
    about: "Iterations to a relative residual of 10⁻⁸: of Laplace fields on growing rasters, of the elevation on many sets of forty random \
            curves, every fifth a crack. Residual and true error against work on one such set: Krylov iterations, and the paper's \
            cascade as it ends. Work counts visits of a node of the finest raster, by hand from the code: 6 for an iteration of \
            conjugate gradients, 26 for one of BiCGStab, whose smoother sweeps four ways. Jacobi's spectral radius on eight curves, by \
            power iteration.",
    code: "experiments/src/hnaidi2010/convergence.rs",
    test: "experiments/src/hnaidi2010/convergence.rs::jacobi_is_slow_and_slower_on_larger_rasters",
    expected: |profile| Expected {
        seconds: profile.pick(12.0, 400.0),
        memory_bytes: profile.pick(512 << 20, 6 << 30),
        disk_bytes: 128 << 10,
    },
    run,
};

/// Iterations: of a Laplace field, of an elevation.
const LIMITS: (usize, usize) = (8, 25);
/// Curves of a random set.
const CURVES: usize = 40;
const CONVERGING: [Solver; 3] = [Solver::Printed, Solver::Multigrid, Solver::Variational];

fn solve(curves: &[Curve], nodes: usize, solver: Solver, stop: Stop) -> Result<Fields, ExperimentError> {
    let settings = Settings { solver, stop, ..Settings::default() };
    diffuse(curves, Domain::square(SIDE, nodes), &settings).map_err(ExperimentError::failed)
}

fn most(fields: &Fields, elevation: bool) -> usize {
    let of = fields.reports.iter().filter(|report| (report.field == "elevation") == elevation);
    of.map(|report| report.iterations).max().unwrap_or(0)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut failures = Vec::new();
    laplace(ctx, &mut outcome, &mut failures)?;
    cracks(ctx, &mut outcome, &mut failures)?;
    work(ctx, &mut outcome)?;
    jacobi(ctx, &mut outcome)?;
    outcome.absent(
        "paper.schedule_50_10.max_error_of_range",
        "the library has the schedule 5(l − i) of the paper alone, and not the later 50 + 10(l − i)",
    )?;
    if !failures.is_empty() {
        outcome.set_verdict(Verdict::Partial, failures.join("; "));
    }
    Ok(outcome)
}

fn laplace(ctx: &Context, outcome: &mut Outcome, failures: &mut Vec<String>) -> Result<(), ExperimentError> {
    let sizes: &[usize] = ctx.profile.pick(&[129, 257, 513, 1025], &[129, 257, 513, 1025, 2049, 4097]);
    let curves = random(ctx.seed_for("levels"), 30, Kind::Levels).map_err(ExperimentError::failed)?;
    let mut table = Table::new("laplace", "Iterations of conjugate gradients to 10⁻⁸")
        .column("nodes a side")
        .column("amplitude, roughness")
        .column("elevation");
    for &nodes in sizes {
        let fields = solve(&curves, nodes, Solver::Multigrid, Stop::default())?;
        let (noise, elevation) = (most(&fields, false), most(&fields, true));
        let iterations = noise.max(elevation);
        outcome.metric(&format!("laplace.{nodes}.iterations"), iterations as f64)?;
        table.row([Cell::count(nodes as u64), Cell::count(noise as u64), Cell::count(elevation as u64)]);
        if iterations > LIMITS.0 || !fields.reports.iter().all(|report| report.converged) {
            failures.push(format!("a Laplace field at {nodes} nodes a side takes {iterations} iterations"));
        }
    }
    outcome.table(table)?;
    Ok(())
}

fn cracks(ctx: &Context, outcome: &mut Outcome, failures: &mut Vec<String>) -> Result<(), ExperimentError> {
    let tries: &[(usize, usize)] =
        ctx.profile.pick(&[(129, 10), (257, 4)], &[(129, 100), (257, 100), (513, 50), (1025, 10)]);
    let mut table = Table::new("cracks", "Iterations of the elevation to 10⁻⁸, sets of forty curves with cracks")
        .column("nodes a side")
        .column("sets");
    for solver in CONVERGING {
        table = table.column(solver.name());
    }
    let mut seeds = Random(ctx.seed_for("cracks"));
    for &(nodes, sets) in tries {
        let (mut worst, mut failed) = ([0; CONVERGING.len()], [0; CONVERGING.len()]);
        for _ in 0..sets {
            let curves = random(seeds.next(), CURVES, Kind::Cracks).map_err(ExperimentError::failed)?;
            for (k, solver) in CONVERGING.into_iter().enumerate() {
                let fields = solve(&curves, nodes, solver, Stop::default())?;
                worst[k] = most(&fields, true).max(worst[k]);
                failed[k] += usize::from(!fields.reports.iter().all(|report| report.converged));
            }
        }
        let mut row = vec![Cell::count(nodes as u64), Cell::count(sets as u64)];
        for (k, solver) in CONVERGING.into_iter().enumerate() {
            let name = solver.name();
            outcome.metric(&format!("cracks.{nodes}.{name}.most_iterations"), worst[k] as f64)?;
            outcome.metric(&format!("cracks.{nodes}.{name}.not_converged"), failed[k] as f64)?;
            row.push(Cell::count(worst[k] as u64));
            if worst[k] > LIMITS.1 || failed[k] > 0 {
                let problem = format!(
                    "{name} at {nodes} nodes a side: {} iterations, {} sets not converged",
                    worst[k], failed[k]
                );
                failures.push(problem);
            }
        }
        table.row(row);
    }
    outcome.table(table)?;
    Ok(())
}

fn work(ctx: &Context, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let nodes = ctx.profile.pick(257, 513);
    let curves = random(ctx.seed_for("work"), CURVES, Kind::Cracks).map_err(ExperimentError::failed)?;
    let mut table = Table::new("work", "What is left after so many iterations")
        .column("solver")
        .column("iterations")
        .column("visits of a node")
        .column("relative residual")
        .column("largest error of range")
        .column("rms error of range");
    let axis = |label: &str| (Axis::linear("visits of a node"), Axis::log(label));
    let ((x, y), (u, v)) = (axis("relative residual"), axis("largest error of range"));
    let mut residuals = Plot::new("residual", "Residual of the elevation against work", x, y);
    let mut errors = Plot::new("error", "Error of the elevation against work", u, v);
    let mut early = 0.0;
    let mut cascade = [0.0; 2];
    for solver in CONVERGING {
        let exact = solve(&curves, nodes, solver, Stop { relative_residual: 1e-12, iterations: 400 })?.elevation;
        let visits = if solver == Solver::Variational { 6.0 } else { 26.0 };
        let (mut of_residual, mut of_error) = (Vec::new(), Vec::new());
        for iterations in 1..=ctx.profile.pick(8, 12) {
            let stop = Stop { relative_residual: 1e-13, iterations };
            let fields = solve(&curves, nodes, solver, stop)?;
            let residual =
                fields.reports.iter().find(|report| report.field == "elevation").map_or(0.0, |r| r.relative_residual);
            let (error, rms) =
                (largest_difference(&fields.elevation, &exact), rms_difference(&fields.elevation, &exact));
            let at = visits * iterations as f64;
            table.row(row(solver, iterations, at, [residual, error, rms]));
            of_residual.push((at, residual.max(1e-16)));
            of_error.push((at, error.max(1e-16)));
            if solver == Solver::Multigrid && iterations == 1 {
                early = error;
            }
        }
        residuals = residuals.series(solver.name(), Style::LineAndPoints, of_residual);
        errors = errors.series(solver.name(), Style::LineAndPoints, of_error);
        let unconverged = match solver {
            Solver::Printed => Solver::Paper,
            Solver::Multigrid => Solver::Corrected,
            _ => continue,
        };
        let fields = solve(&curves, nodes, unconverged, Stop::default())?;
        let report = fields.reports.iter().find(|report| report.field == "elevation");
        let (residual, iterations) = report.map_or((0.0, 0), |report| (report.relative_residual, report.iterations));
        let (error, rms) = (largest_difference(&fields.elevation, &exact), rms_difference(&fields.elevation, &exact));
        // 5(l − i) sweeps on raster i, each with a quarter of the nodes of the next: 5·Σ k/4^(k − 1).
        let at = 5.0 * (1..10).map(|k| f64::from(k) / libm::pow(4.0, f64::from(k - 1))).sum::<f64>();
        table.row(row(unconverged, iterations, at, [residual, error, rms]));
        residuals = residuals.series(unconverged.name(), Style::Points, [(at, residual)]);
        errors = errors.series(unconverged.name(), Style::Points, [(at, error)]);
        for (name, value) in
            [("relative_residual", residual), ("max_error_of_range", error), ("rms_error_of_range", rms)]
        {
            outcome.metric(&format!("{}.{name}", unconverged.name()), value)?;
        }
        if unconverged == Solver::Paper {
            cascade = [residual, error];
        }
    }
    outcome.table(table)?;
    outcome.plot(residuals)?;
    outcome.plot(errors)?;
    let [residual, error] = cascade;
    let refuted = error > 0.01;
    let mut claim = Claim::new(
        "H3",
        "The Jacobi relaxation converges, in 5(l − i) sweeps on the i-th of l rasters (§5.2).",
        if refuted { ClaimVerdict::Refuted } else { ClaimVerdict::Tested },
        format!(
            "forty random curves with cracks at {nodes} nodes a side: the largest error over the range of the converged field"
        ),
    );
    if refuted {
        claim = claim.witness(format!("relative residual {residual:.1e}, error {:.0} % of the range", 100.0 * error));
    }
    outcome.claim(claim)?;
    outcome.control(
        "one iteration",
        "BiCGStab stopped after its first iteration",
        "its error exceeds 10⁻⁶ of the range",
        early > 1e-6,
    );
    Ok(())
}

fn row(solver: Solver, iterations: usize, visits: f64, [residual, error, rms]: [f64; 3]) -> [Cell; 6] {
    [
        Cell::from(solver.name()),
        Cell::count(iterations as u64),
        Cell::number(visits, "", 3),
        Cell::number(residual, "", 2),
        Cell::number(error, "", 2),
        Cell::number(rms, "", 2),
    ]
}

/// Spectral radius of Jacobi's iteration of ΔF = 0 by power iteration. Its eigenvalues come in pairs ±: two sweeps are one step.
fn spectral_radius(curves: &[Curve], nodes: usize, sweeps: usize) -> f64 {
    let raster = rasterise(curves, &Domain::square(SIDE, nodes));
    let stride = nodes + 2;
    // 1 over the number of neighbours; 0 where the value is given and on the margin.
    let mut share = vec![0.0f64; stride * stride];
    for (i, j) in (0..nodes).flat_map(|j| (0..nodes).map(move |i| (i, j))) {
        let beside = [i > 0, i + 1 < nodes, j > 0, j + 1 < nodes].into_iter().filter(|there| *there).count();
        let free = raster.at(i, j).elevations == 0;
        share[(j + 1) * stride + i + 1] = if free { 1.0 / beside as f64 } else { 0.0 };
    }
    let mut old: Vec<f64> = share.iter().map(|share| if *share > 0.0 { 1.0 } else { 0.0 }).collect();
    let mut new = vec![0.0; old.len()];
    let mut radius = 0.0;
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    for sweep in 0..sweeps / 2 {
        let before = norm(&old);
        for _ in 0..2 {
            for j in 1..=nodes {
                for k in j * stride + 1..=j * stride + nodes {
                    new[k] = share[k] * (old[k - 1] + old[k + 1] + old[k - stride] + old[k + stride]);
                }
            }
            std::mem::swap(&mut old, &mut new);
        }
        let after = norm(&old);
        radius = (after / before).sqrt();
        if sweep % 64 == 63 {
            old.iter_mut().for_each(|v| *v /= after);
        }
    }
    radius
}

fn jacobi(ctx: &Context, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let curves = random(ctx.seed_for("jacobi"), 8, Kind::Levels).map_err(ExperimentError::failed)?;
    let mut table = Table::new("jacobi", "Jacobi's spectral radius, eight curves")
        .column("nodes a side")
        .column("spectral radius")
        .column("sweeps for a digit");
    let tries: &[(usize, usize)] =
        ctx.profile.pick(&[(33, 2000), (65, 4000), (129, 8000)], &[(65, 8000), (129, 30_000), (257, 100_000)]);
    for &(nodes, sweeps) in tries {
        let radius = spectral_radius(&curves, nodes, sweeps);
        let digit = libm::log(0.1) / libm::log(radius);
        outcome.metric(&format!("jacobi.{nodes}.spectral_radius"), radius)?;
        outcome.metric(&format!("jacobi.{nodes}.sweeps_per_digit"), digit)?;
        table.row([Cell::count(nodes as u64), Cell::number(radius, "", 6), Cell::number(digit, "", 3)]);
    }
    outcome.table(table)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobi_is_slow_and_slower_on_larger_rasters() {
        let curves = random(2, 8, Kind::Levels).unwrap();
        let [small, large] = [(33, 2000), (65, 4000)].map(|(nodes, sweeps)| spectral_radius(&curves, nodes, sweeps));
        assert!(0.98 < small && small < large && large < 1.0, "{small} {large}");
        // Everything given: nothing is left to iterate.
        let level = random(2, 200, Kind::Levels).unwrap();
        assert!(spectral_radius(&level, 33, 400) < small);
    }
}
