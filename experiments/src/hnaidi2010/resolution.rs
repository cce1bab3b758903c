//! The same curves on coarse and on fine rasters: whether they are the same terrain, by solver.

use super::curves::{Kind, SIDE, random};
use super::models::load;
use super::rasters::{largest_difference, range, rms_difference};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Settings, Solver, diffuse};
use terrain_diffusion::raster::Domain;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/resolution",
    title: "The same curves at several resolutions",
    section: "§6",
    about: "The paper has terrains at different resolutions from the same curves. Three landscapes, and forty random curves with cracks, \
            are diffused on rasters whose nodes are nodes of the finest one; what a coarse raster differs from it there, over its \
            range, largest and root mean square, for each solver. The detail is a function of position and is left out.",
    code: "experiments/src/hnaidi2010/resolution.rs",
    test: "experiments/src/hnaidi2010/resolution.rs::the_same_raster_does_not_differ_and_other_curves_do",
    expected: |profile| Expected {
        seconds: profile.pick(12.0, 300.0),
        memory_bytes: profile.pick(256 << 20, 3 << 30),
        disk_bytes: 128 << 10,
    },
    run,
};

/// What the least-squares field is held to where the coarse raster has a quarter of the fine one's nodes a side.
const LIMIT: f64 = 0.01;

type Case = (&'static str, Vec<Curve>, fn(&[Curve], usize) -> Domain);

fn cases(seed: u64) -> Result<Vec<Case>, ExperimentError> {
    let mut cases: Vec<Case> = Vec::new();
    for name in ["canyon", "mountain", "island"] {
        let landscape = load(name)?;
        let domain: fn(&[Curve], usize) -> Domain = match name {
            "canyon" => |_, nodes| Domain::square(6000.0, nodes),
            "mountain" => |_, nodes| Domain::square(8000.0, nodes),
            _ => |_, nodes| Domain::square(8800.0, nodes),
        };
        let square = domain(&[], 129);
        if landscape.domain(129) != square {
            return Err(ExperimentError::failed(format!("{name}: its rectangle is not the one expected here")));
        }
        cases.push((name, landscape.curves().to_vec(), domain));
    }
    let curves = random(seed, 40, Kind::Cracks).map_err(ExperimentError::failed)?;
    cases.push(("random", curves, |_, nodes| Domain::square(SIDE, nodes)));
    Ok(cases)
}

/// Every `step`-th value along both axes.
fn thinned(values: &[f64], nodes: usize, step: usize) -> Vec<f64> {
    let places = (0..nodes).step_by(step).flat_map(|j| (0..nodes).step_by(step).map(move |i| (i, j)));
    places.map(|(i, j)| values[j * nodes + i]).collect()
}

/// The share of nodes that differ by more than a hundredth of the range.
fn share_off(coarse: &[f64], fine: &[f64]) -> f64 {
    let [low, high] = range(fine);
    let off = coarse.iter().zip(fine).filter(|(a, b)| (*a - *b).abs() > 0.01 * (high - low)).count();
    off as f64 / fine.len() as f64
}

fn solve(curves: &[Curve], domain: Domain, solver: Solver) -> Result<Vec<f64>, ExperimentError> {
    let settings = Settings { solver, ..Settings::default() };
    Ok(diffuse(curves, domain, &settings).map_err(ExperimentError::failed)?.elevation)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let (sizes, finest): (&[usize], usize) = ctx.profile.pick((&[65, 129, 257], 513), (&[129, 257, 513, 1025], 2049));
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("resolution", "Difference from the finest raster, percent of the range")
        .column("curves")
        .column("solver")
        .column("nodes a side")
        .column("largest")
        .column("rms")
        .column("nodes off by more than 1 %");
    let mut worst = vec![vec![0.0f64; sizes.len()]; Solver::ALL.len()];
    let cases = cases(ctx.seed_for("curves"))?;
    let progress = ctx.progress("curves", cases.len() as u64);
    for (name, curves, domain) in &cases {
        for (k, solver) in Solver::ALL.into_iter().enumerate() {
            let fine = solve(curves, domain(curves, finest), solver)?;
            for (s, &nodes) in sizes.iter().enumerate() {
                let coarse = solve(curves, domain(curves, nodes), solver)?;
                let fine = thinned(&fine, finest, (finest - 1) / (nodes - 1));
                let (largest, rms) = (largest_difference(&coarse, &fine), rms_difference(&coarse, &fine));
                worst[k][s] = worst[k][s].max(largest);
                let prefix = format!("{name}.{nodes}.{}", solver.name());
                outcome.metric(&format!("{prefix}.max_difference_of_range"), largest)?;
                outcome.metric(&format!("{prefix}.rms_difference_of_range"), rms)?;
                let off = share_off(&coarse, &fine);
                outcome.metric(&format!("{prefix}.share_off_by_a_hundredth"), off)?;
                table.row([
                    Cell::from(*name),
                    Cell::from(solver.name()),
                    Cell::count(nodes as u64),
                    Cell::number(100.0 * largest, "%", 3),
                    Cell::number(100.0 * rms, "%", 3),
                    Cell::number(100.0 * off, "%", 3),
                ]);
            }
        }
        progress.advance(1);
    }
    outcome.table(table)?;
    let caption = format!("Largest difference from {finest} nodes a side, over all curves");
    let mut plot = Plot::new("difference", &caption, Axis::log("nodes a side"), Axis::log("percent of the range"));
    for (solver, line) in Solver::ALL.into_iter().zip(&worst) {
        let points = sizes.iter().zip(line).map(|(nodes, most)| (*nodes as f64, 100.0 * most.max(1e-9)));
        plot = plot.series(solver.name(), Style::LineAndPoints, points);
    }
    outcome.plot(plot)?;
    let quarter = sizes.iter().position(|nodes| (nodes - 1) * 4 == finest - 1).unwrap_or(0);
    for (k, solver) in Solver::ALL.into_iter().enumerate() {
        outcome.metric(&format!("{}.quarter.max_difference_of_range", solver.name()), worst[k][quarter])?;
        if solver == Solver::Variational && worst[k][quarter] > LIMIT {
            let why = format!(
                "{} nodes a side differ from {finest} by {:.1} % of the range with the least-squares field, more than {} %",
                sizes[quarter],
                100.0 * worst[k][quarter],
                100.0 * LIMIT
            );
            outcome.set_verdict(Verdict::Partial, why);
        }
    }
    let (_, curves, domain) = &cases[0];
    let whole = solve(curves, domain(curves, 129), Solver::Variational)?;
    let fewer = solve(&curves[..30], domain(curves, 129), Solver::Variational)?;
    outcome.control(
        "other curves",
        "the canyon with 30 of its 74 curves at the same resolution",
        "it differs by more than the limit",
        largest_difference(&fewer, &whole) > LIMIT,
    );
    outcome.deviation(
        "the width of a curve without a plateau",
        "half a cell's diagonal to each side on every raster: thin curves are wider on coarse ones",
    );
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_raster_does_not_differ_and_other_curves_do() {
        let cases = cases(1).unwrap();
        let (_, curves, domain) = &cases[0];
        let (coarse, fine) = (
            solve(curves, domain(curves, 65), Solver::Multigrid),
            solve(curves, domain(curves, 129), Solver::Multigrid),
        );
        let fine = thinned(&fine.unwrap(), 129, 2);
        let difference = largest_difference(coarse.as_ref().unwrap(), &fine);
        assert!(difference > 0.0 && largest_difference(&fine, &fine) == 0.0 && fine.len() == 65 * 65);
        let other = solve(&curves[..15], domain(curves, 65), Solver::Multigrid).unwrap();
        assert!(rms_difference(&other, &fine) > rms_difference(coarse.as_ref().unwrap(), &fine));
    }
}
