//! What becomes of slopes that no elevation holds, as rasters grow fine.

use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Claim, Outcome, Plot, Style, Table};
use terrain_diffusion::plane::Plane;
use terrain_diffusion::solver::guided::{self, Constraint, Slope, Update};
use terrain_diffusion::solver::held;
use terrain_diffusion::solver::krylov::Stop;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/basins",
    title: "Slopes that lead from nothing",
    section: "§4.1, Fig. 9",
    about: "Where slopes of several curves meet, the paper leaves the gradient empty and fills it by diffusion. A filled field of directions \
            may part from a point that no curve holds. A disc of such slopes of −½ in a square whose border is level: the lowest \
            elevation grows with the number of cells without bound. Slopes that no given elevation is upstream of are therefore left \
            to diffusion.",
    code: "experiments/src/hnaidi2010/basins.rs",
    test: "diffusion/src/solver/held.rs::slopes_that_part_from_nothing_dig_deeper_on_every_finer_raster",
    expected: |profile| Expected { seconds: profile.pick(1.0, 2.0), memory_bytes: 32 << 20, disk_bytes: 32 << 10 },
    run,
};

/// Squared radius of the disc, sides of the square being 1.
const DISC: f64 = 0.1;

/// What the square is made of: where slopes begin, which of them are followed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Try {
    /// All of them.
    Followed,
    /// Those that a given elevation is upstream of.
    Held,
    /// All of them, with a given elevation at the point they part from.
    Crest,
}

impl Try {
    const ALL: [Try; 3] = [Try::Followed, Try::Held, Try::Crest];
    fn name(self) -> &'static str {
        match self {
            Try::Followed => "followed",
            Try::Held => "left-to-diffusion",
            Try::Crest => "held-at-the-crest",
        }
    }
}

/// The lowest elevation of a square of side 1 with `n` nodes a side, its border at 0.
fn lowest(n: usize, what: Try) -> Result<f64, ExperimentError> {
    let spacing = 1.0 / (n - 1) as f64;
    let border = |i: usize, j: usize| i == 0 || j == 0 || i == n - 1 || j == n - 1;
    let slope = |i: usize, j: usize| {
        let [x, y] = [i, j].map(|k| k as f64 * spacing - 0.49);
        (x * x + y * y < DISC).then(|| Slope::along([x, y], -0.5)).flatten()
    };
    let crest = (0.49 / spacing).round() as usize;
    let held =
        |i: usize, j: usize| border(i, j) || (what == Try::Crest && i.abs_diff(crest) < 2 && j.abs_diff(crest) < 2);
    let nodes: Vec<(usize, usize)> = (0..n * n).map(|node| (node % n, node / n)).collect();
    let given: Vec<usize> = nodes.iter().filter(|&&(i, j)| held(i, j)).map(|(i, j)| j * n + i).collect();
    let slopes: Vec<(usize, Slope)> =
        nodes.iter().filter(|&&(i, j)| !held(i, j)).filter_map(|&(i, j)| Some((j * n + i, slope(i, j)?))).collect();
    let dropped = if what == Try::Held { held::adrift(n, n, &slopes, &given) } else { Vec::new() };
    let mut rows: Vec<Vec<(u32, Constraint)>> = vec![Vec::new(); n];
    let level = |node: usize| if border(node % n, node / n) { 0.0 } else { 0.16 };
    given.iter().for_each(|node| rows[node / n].push(((node % n) as u32, Constraint::Elevation(level(*node)))));
    let followed = slopes.iter().filter(|(node, _)| dropped.binary_search(node).is_err());
    followed.for_each(|(node, slope)| rows[node / n].push(((node % n) as u32, Constraint::Slope(*slope))));
    rows.iter_mut().for_each(|row| row.sort_by_key(|(i, _)| *i));
    let mut elevation = Plane::new(n, n);
    let equations =
        guided::equations(spacing, Update::Corrected, &rows, &mut elevation).map_err(ExperimentError::failed)?;
    let progress = guided::solve(&equations, &mut elevation, Stop::default()).map_err(ExperimentError::failed)?;
    if !progress.converged {
        return Err(ExperimentError::failed(format!("{n} nodes, {}: not converged", what.name())));
    }
    Ok(elevation.iter(0).fold(0.0, f64::min))
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let sides = [9usize, 13, 17, 21, 25];
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("basins", "Lowest elevation in a square of side 1 whose border is level, slopes of −½")
        .column("nodes a side")
        .column("slopes")
        .column("lowest elevation");
    let mut plot = Plot::new("depth", "How deep slopes dig", Axis::linear("nodes a side"), Axis::log("depth + 0.01"));
    let progress = ctx.progress("squares", (sides.len() * Try::ALL.len()) as u64);
    let mut depths = Vec::new();
    for what in Try::ALL {
        let mut points = Vec::new();
        for n in sides {
            let depth = -lowest(n, what)?;
            outcome.metric(&format!("{}.{n}.depth", what.name()), depth)?;
            table.row([Cell::count(n as u64), Cell::from(what.name()), Cell::number(-depth, "", 4)]);
            points.push((n as f64, depth + 0.01));
            depths.push((what, n, depth));
            progress.advance(1);
        }
        plot = plot.series(what.name(), Style::LineAndPoints, points);
    }
    outcome.table(table)?;
    outcome.plot(plot)?;
    let of = |what: Try, n: usize| {
        depths.iter().find(|found| found.0 == what && found.1 == n).map_or(f64::NAN, |found| found.2)
    };
    // A slope of ½ over half the diagonal cannot dig deeper than this.
    let possible = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
    let blows_up = of(Try::Followed, 25) > 100.0 * possible && of(Try::Followed, 25) > 4.0 * of(Try::Followed, 17);
    let mut claim = Claim::new(
        "H14",
        "Gradients that are left empty where slopes meet, and filled by diffusion, guide the elevation (§4.1).",
        if blows_up { ClaimVerdict::Refuted } else { ClaimVerdict::Tested },
        "slopes of −½ that part from a point without an elevation, 9 to 25 nodes a side",
    );
    if blows_up {
        claim = claim
            .witness(format!("25 nodes a side: {:.3e} deep where {possible:.2} is possible", of(Try::Followed, 25)));
    }
    outcome.claim(claim)?;
    outcome.control(
        "an elevation at the crest",
        "the point that slopes part from is given an elevation",
        "the same slopes dig no deeper than they can",
        of(Try::Crest, 25) < possible && of(Try::Held, 25) < possible,
    );
    if !blows_up {
        outcome.set_verdict(Verdict::NotReproduced, "the depth does not grow");
    }
    Ok(outcome)
}
