//! How many point values a second one core computes over terrains of 1,000 primitives to the karst's 165,773.

use super::scenes;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use std::time::Instant;
use terrain_amplify::field::Density;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/queries",
    title: "Queries of the implicit terrain",
    section: "§6",
    about: "The paper computes about a million values of f a second with several thousand primitives in a tree of bounding \
            volumes. Point primitives within 2 m of a heightfield, supports overlapping about threefold, asked at random points \
            within 2 m of it, one thread. Values are compared to the bit with a sum over all primitives.",
    code: "experiments/src/paris2019/queries.rs",
    test: "amplify/src/implicit/index.rs::the_index_leaves_out_nothing_to_the_bit",
    expected: |profile| Expected {
        seconds: profile.pick(4.0, 12.0),
        memory_bytes: profile.pick(256, 512) << 20,
        disk_bytes: 32 << 10,
    },
    run,
};

/// The paper's figure, values a second (§6).
const PAPER: f64 = 1e6;
/// Bytes a primitive that the paper's Table 1 comes to at best: 9.9 MB over 165,773.
const PAPER_BYTES: f64 = 59.7;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let counts = [1_000usize, 5_000, 20_000, 165_773];
    let queries = ctx.profile.pick(1_000_000, 4_000_000);
    let seed = ctx.seed as u32;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("queries", "Random values within 2 m of the surface, one thread")
        .column("primitives")
        .column("covering a query")
        .column("looked at for a query")
        .column("bytes a primitive")
        .column("index, bytes a primitive")
        .machine_column("queries a second")
        .machine_column("index built in");
    let plot = Plot::new("work", "Primitives looked at for a query", Axis::log("primitives"), Axis::linear("a query"));
    let (mut looked, mut covering) = (Vec::new(), Vec::new());
    let (mut wrong, mut slow) = (0, Vec::new());
    let progress = ctx.progress("terrains", counts.len() as u64);
    for count in counts {
        let start = Instant::now();
        let terrain = scenes::scattered(count, seed)?;
        let built = start.elapsed().as_secs_f64();
        let points = scenes::near_surface(queries, scenes::side(count), seed ^ 1);
        // The first pass warms the caches, as the paper's meshers and tracers would; the best of three counts.
        let mut best = f64::INFINITY;
        let mut sum = 0.0;
        for _ in 0..4 {
            let start = Instant::now();
            sum = terrain.values(&points).iter().sum();
            best = best.min(start.elapsed().as_secs_f64());
        }
        if !f64::is_finite(sum) {
            return Err(ExperimentError::failed("a value is not finite"));
        }
        let per_second = f64::from(queries) / best;
        let (ground, index) = scenes::parts(&terrain)?;
        let near: usize = points.iter().map(|&p| index.near(p).count()).sum();
        let covers = |&k: &u32, p| index.primitives()[k as usize].value(p) != 0.0;
        let hit: usize = points.iter().map(|&p| index.near(p).filter(|k| covers(k, p)).count()).sum();
        let [near, hit] = [near, hit].map(|n| n as f64 / f64::from(queries));
        for &p in points.iter().take(200) {
            let all = index.primitives().iter().fold(0.0, |sum, one| sum + one.value(p));
            wrong += u32::from(ground.value(p) + all != terrain.value(p));
        }
        let [own, beside] = index.bytes().map(|bytes| bytes as f64 / count as f64);
        outcome.timing(&format!("n{count}.queries_per_second_per_core"), per_second)?;
        outcome.metric(&format!("n{count}.bytes_per_primitive"), own)?;
        outcome.metric(&format!("n{count}.index_bytes_per_primitive"), beside)?;
        outcome.metric(&format!("n{count}.primitives_per_query"), near)?;
        table.row([
            Cell::count(count as u64),
            Cell::number(hit, "", 3),
            Cell::number(near, "", 3),
            Cell::number(own, "", 3),
            Cell::number(beside, "", 3),
            Cell::number(per_second / 1e6, "M/s", 3),
            Cell::number(built, "s", 2),
        ]);
        if per_second < PAPER {
            slow.push(format!("{count} primitives: {per_second:.0} a second"));
        }
        if own > PAPER_BYTES {
            slow.push(format!("{own} bytes a primitive"));
        }
        looked.push((count as f64, near));
        covering.push((count as f64, hit));
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.plot(plot.series("looked at", Style::LineAndPoints, looked).series(
        "covering",
        Style::LineAndPoints,
        covering,
    ))?;
    outcome.metric("wrong_values", f64::from(wrong))?;
    outcome.deviation(
        "how the paper's queries are distributed, and over which scene",
        "uniform within 2 m of the surface, supports overlapping about threefold",
    );
    let terrain = scenes::scattered(1_000, seed)?;
    let (ground, index) = scenes::parts(&terrain)?;
    let fewer = &index.primitives()[..999];
    let lost = scenes::near_surface(20_000, scenes::side(1_000), seed ^ 1)
        .iter()
        .any(|&p| ground.value(p) + fewer.iter().fold(0.0, |sum, one| sum + one.value(p)) != terrain.value(p));
    outcome.control("a lost primitive", "the last of 1,000 left out of the sum", "some value differs", lost);
    if wrong > 0 {
        outcome.set_verdict(Verdict::NotReproduced, format!("{wrong} values differ from the sum over all"));
    } else if let Some(why) = slow.first() {
        outcome.set_verdict(Verdict::Partial, why.clone());
    }
    Ok(outcome)
}
