//! How long edges turn out on the screen, against the length that was asked for.

use super::cameras::{JACKSBORO, camera, places};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use rayon::prelude::*;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/edges",
    title: "Achieved length of edges on the screen",
    section: "§6",
    about: "Displaced edges with an end in the image are measured as edge · focal ÷ distance. Of those whose leaf was not stopped by the \
            finest level, 95 % must lie within a factor 2 of the target. The control measures against a target three times as long.",
    code: "experiments/src/tessellation/edges.rs",
    test: "gpu/src/tessellate/tests.rs::edges_not_stopped_lie_within_a_factor_two_of_the_target",
    expected: |profile| Expected { seconds: profile.pick(10.0, 100.0), memory_bytes: 256 << 20, disk_bytes: 64 << 10 },
    run,
};

/// Bins of an eighth of an octave, from 1/16 to 16 times the target.
const BINS: usize = 64;

#[derive(Clone)]
struct Lengths {
    bins: Vec<u64>,
    all: u64,
    within: u64,
    within_of_control: u64,
    stopped: u64,
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let (cameras, seed, places) = (ctx.profile.pick(300u32, 3000), ctx.seed_for("cameras"), places()?);
    let one = |k: u32| -> Result<Lengths, ExperimentError> {
        let place = &places[k as usize % places.len()];
        let refinement = Refinement::new(&place.ground, &place.detail, camera(place, seed, k)?, 24.0, 24);
        let mut found = Lengths { bins: vec![0; BINS], all: 0, within: 0, within_of_control: 0, stopped: 0 };
        for leaf in refinement.leaves(true) {
            let ratios = refinement.edge_ratios(&leaf);
            if leaf.level == refinement.finest() {
                found.stopped += ratios.len() as u64;
                continue;
            }
            found.all += ratios.len() as u64;
            for ratio in ratios {
                found.within += u64::from((0.5..=2.0).contains(&ratio));
                found.within_of_control += u64::from((0.5..=2.0).contains(&(ratio / 3.0)));
                found.bins[((libm::log2(ratio) + 4.0) * 8.0).clamp(0.0, BINS as f64 - 1.0) as usize] += 1;
            }
        }
        Ok(found)
    };
    let each: Vec<Lengths> = (0..cameras).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let of_place =
        |at: usize, pick: fn(&Lengths) -> u64| each.iter().skip(at).step_by(places.len()).map(pick).sum::<u64>() as f64;
    let sum = |pick: fn(&Lengths) -> u64| (0..places.len()).map(|at| of_place(at, pick)).sum::<f64>();
    let (all, stopped) = (sum(|e| e.all).max(1.0), sum(|e| e.stopped));
    let [within, control] = [sum(|e| e.within), sum(|e| e.within_of_control)].map(|n| 100.0 * n / all);
    let stopped_percent = 100.0 * stopped / (all + stopped);
    let mut outcome = Outcome::new(if within >= 95.0 { Verdict::Reproduced } else { Verdict::Partial });
    outcome.input("jacksboro.tif", JACKSBORO);
    let mut table = Table::new("lengths", "Edges in the image").column("quantity").column("value");
    table.row(["edges not stopped".into(), Cell::number(all, "", 9)]);
    table.row(["within a factor 2 of the target".into(), Cell::number(within, "%", 4)]);
    table.row(["stopped by the finest level, of all".into(), Cell::number(stopped_percent, "%", 4)]);
    for (at, place) in places.iter().enumerate() {
        let within = 100.0 * of_place(at, |e| e.within) / of_place(at, |e| e.all).max(1.0);
        table.row([format!("within a factor 2, {}", place.name).into(), Cell::number(within, "%", 4)]);
    }
    outcome.table(table)?;
    outcome.metric("within_factor_2_percent", within)?;
    outcome.metric("stopped_percent", stopped_percent)?;
    outcome.control("a longer target", "three times as long", "fewer than 95 % are within", control < 95.0);
    let bins = (0..BINS).map(|bin| {
        let count = each.iter().map(|e| e.bins[bin]).sum::<u64>() as f64;
        (libm::exp2((bin as f64 + 0.5) / 8.0 - 4.0), 100.0 * count / all)
    });
    let axes = (Axis::log("length ÷ target"), Axis::linear("edges (%)"));
    let plot = Plot::new("histogram", "Projected lengths over the target", axes.0, axes.1);
    outcome.plot(plot.series("edges", Style::LineAndPoints, bins))?;
    Ok(outcome)
}
