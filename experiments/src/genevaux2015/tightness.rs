//! How far every bound is from what it bounds: bound over the largest value reached, node by node, beside the certificate from above and
//! against recorded ratios.

mod nodes;

use crate::experiment::{Context, Expected, Experiment, ExperimentError, Profile};
use crate::report::{Cell, Outcome, Table};
use rayon::prelude::*;
use std::collections::BTreeMap;
use terrain_model::bounds::{Bounds, Region};
use terrain_model::certify::slope::{Quantity, SlopeSupremum, supremum};
use terrain_model::trace::Surface;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/tightness",
    title: "Bounds against certified suprema",
    section: "§7.3",
    about: "For every kind of node, a bound that the node gives over a whole region is divided by the largest value of what it bounds \
            that was reached at a point: at most the supremum, so that no ratio is flattered. Branch and bound over duals of intervals \
            finds it without asking for bounds, and encloses the supremum from above beside it; where its budget ends before the two \
            meet, the gap is what is undecided. A ratio of 1 is sharp. A bound that gets looser than recorded fails; so does one that a point exceeds.",
    code: "experiments/src/genevaux2015/tightness.rs",
    test: "experiments/src/genevaux2015/tightness.rs::the_gate_fires_on_looser_bounds_and_on_wrong_ones",
    expected: |profile| Expected {
        seconds: profile.pick(25.0, 600.0),
        memory_bytes: profile.pick(64 << 20, 512 << 20),
        disk_bytes: 1 << 18,
    },
    run,
};

/// Quick ratios as last recorded: node, quantity, ratio.
const RECORD: &str = include_str!("../../records/tightness.csv");
/// What a ratio may exceed the recorded one by: witnesses move a little with the last bits of a build.
const SLACK: f64 = 1.01;

const QUANTITIES: [(Quantity, &str, &str); 7] = [
    (Quantity::Slope, COVERED, ""),
    (Quantity::Slope, "slope", ""),
    (Quantity::WeightSlope, "weight_slope", "1/m"),
    (Quantity::WeightedSlope, "weighted_slope", ""),
    (Quantity::Elevation, "elevation", "m"),
    (Quantity::Depth, "depth", "m"),
    (Quantity::Weight, "weight", ""),
];

/// The slope bound that tracers use: the largest over a cover of the terrain.
const COVERED: &str = "covered_slope";

fn bound_of(bounds: &Bounds, quantity: Quantity) -> f64 {
    match quantity {
        Quantity::Slope => bounds.slope,
        Quantity::WeightSlope => bounds.weight_slope,
        Quantity::WeightedSlope => bounds.weighted_slope,
        Quantity::Elevation => bounds.elevation.hi(),
        Quantity::Depth => -bounds.elevation.lo(),
        Quantity::Weight => bounds.weight.hi(),
    }
}

/// One bound beside what it bounds.
struct Measured {
    bound: f64,
    found: SlopeSupremum,
    /// Size that differences are compared with: of an end of a range, the range; of anything else, itself.
    size: f64,
}

impl Measured {
    /// Bound over the largest value found, at least the true ratio. For an end of a range of elevations: 1 plus how far it lies
    /// outside, in ranges, since an elevation of 0 means nothing.
    fn ratio(&self) -> Option<f64> {
        let off = self.bound - self.found.at_least;
        (self.size > 0.0 && off.is_finite()).then(|| 1.0 + off / self.size)
    }
    /// Does a point exceed the bound, beyond the rounding of its evaluation?
    fn exceeded(&self) -> bool {
        self.found.at_least > self.bound + 1e-9 * (self.size + self.bound.abs())
    }
}

fn recorded() -> BTreeMap<(&'static str, &'static str), f64> {
    let rows = RECORD.lines().skip(1).filter_map(|line| {
        let mut fields = line.split(',');
        Some(((fields.next()?, fields.next()?), fields.next()?.parse().ok()?))
    });
    rows.collect()
}

/// Why a ratio is turned down.
fn refused(ratio: f64, record: Option<f64>) -> Option<String> {
    match record {
        Some(record) if ratio <= record * SLACK => None,
        Some(record) => Some(format!("{ratio:.4} times the supremum, recorded {record:.4}")),
        None => Some("no recorded ratio".to_owned()),
    }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let nodes = nodes::nodes().map_err(ExperimentError::failed)?;
    let budget = ctx.profile.pick(6_000, 200_000);
    let progress = ctx.progress("nodes", nodes.len() as u64);
    let measured: Vec<Vec<Measured>> = nodes
        .par_iter()
        .map(|node| {
            let bounds = node.program.bounds(Region::rectangle(node.low, node.high));
            let over = |of: Quantity| supremum(&node.program, of, node.low, node.high, 0.01, budget);
            let covered = Surface::new(&node.program).global().slope;
            let slope = over(Quantity::Slope);
            // f_high − f_low, from the two suprema of f and −f.
            let ends = [over(Quantity::Elevation), over(Quantity::Depth)];
            let range = ends[0].at_least + ends[1].at_least;
            let of = |(quantity, name, _): (Quantity, &str, &str)| {
                let bound = if name == COVERED { covered } else { bound_of(&bounds, quantity) };
                let (found, size) = match quantity {
                    Quantity::Slope => (slope, slope.at_least),
                    Quantity::Elevation => (ends[0], range),
                    Quantity::Depth => (ends[1], range),
                    _ => {
                        let found = over(quantity);
                        (found, found.at_least)
                    }
                };
                Measured { bound, found, size }
            };
            let row = QUANTITIES.into_iter().map(of).collect();
            progress.advance(1);
            row
        })
        .collect();
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let table = Table::new("bounds", "Bounds over the whole region, and the suprema of what they bound");
    let titles = ["quantity", "bound", "reached", "certified", "bound over reached", "recorded", "boxes"];
    let mut table = titles.into_iter().fold(table.column("node"), Table::column);
    let record = recorded();
    let mut wrong: Vec<String> = Vec::new();
    let mut ratios = Vec::new();
    for (node, row) in nodes.iter().zip(&measured) {
        for ((_, name, unit), one) in QUANTITIES.iter().zip(row) {
            let key = (node.name, *name);
            let number = |value: f64| {
                if value.is_finite() { Cell::number(value, unit, 5) } else { Cell::missing("no bound") }
            };
            let known = record.get(&key).copied();
            if one.exceeded() {
                wrong.push(format!("{}: {name} exceeds its bound", node.name));
            }
            let metric = format!("{}.{name}.bound_over_supremum", node.name);
            let ratio = one.ratio();
            match ratio {
                Some(ratio) => {
                    outcome.metric(&metric, ratio)?;
                    ratios.push((key, ratio));
                    if ctx.profile == Profile::Quick
                        && let Some(why) = refused(ratio, known)
                    {
                        wrong.push(format!("{}: {name}: {why}", node.name));
                    }
                }
                None => {
                    outcome.absent(&metric, if one.bound.is_finite() { "it is 0 everywhere" } else { "no bound" })?
                }
            }
            let decided = one.found.at_most - one.found.at_least <= 0.01 * one.found.at_least.abs();
            table.row([
                Cell::from(node.name),
                Cell::from(*name),
                number(one.bound),
                number(one.found.at_least),
                if decided || one.found.at_most.is_finite() {
                    number(one.found.at_most)
                } else {
                    Cell::missing("undecided: no certificate within the budget")
                },
                ratio.map_or_else(|| Cell::missing("0 or without bound"), |ratio| Cell::number(ratio, "", 4)),
                known.map_or_else(|| Cell::missing("none"), |known| Cell::number(known, "", 4)),
                Cell::count(one.found.boxes),
            ]);
        }
        if let Some(ratio) = row[0].ratio() {
            outcome.metric(&format!("{}.bound_over_supremum", node.name), ratio)?;
        }
    }
    outcome.table(table)?;
    let lines = ratios.iter().map(|((node, quantity), ratio)| format!("{node},{quantity},{ratio:.6}\n"));
    let lines: String = std::iter::once("node,quantity,ratio\n".to_owned()).chain(lines).collect();
    ctx.write("ratios.csv", lines.as_bytes())?;
    outcome.attachment("ratios.csv", "the ratios as experiments/records/tightness.csv records them");
    if !wrong.is_empty() {
        outcome.set_verdict(Verdict::NotReproduced, wrong.join("; "));
    }
    let looser = ratios.iter().filter(|((_, _), ratio)| refused(1.1 * ratio, Some(*ratio)).is_some()).count();
    outcome.control(
        "bounds a tenth looser",
        "every bound multiplied by 1.1, compared with today's ratios",
        "all are turned down",
        looser == ratios.len() && !ratios.is_empty(),
    );
    let smaller = measured.iter().flatten().filter(|one| one.size > 0.0);
    let caught = smaller.filter(|one| Measured { bound: one.found.at_least - 0.05 * one.size, ..**one }.exceeded());
    outcome.control(
        "bounds below what is reached",
        "every bound set 5 % of its size below the largest value found",
        "a point exceeds every one",
        caught.count() == measured.iter().flatten().filter(|one| one.size > 0.0).count(),
    );
    outcome.deviation(
        "The paper gives bounds and does not say how tight they are.",
        "bounds over one region around each node; the supremum is enclosed by branch and bound within a budget of boxes.",
    );
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn the_gate_fires_on_looser_bounds_and_on_wrong_ones() {
        assert_eq!(refused(1.5, Some(1.5)), None);
        assert!(refused(1.6, Some(1.5)).is_some() && refused(1.0, None).is_some());
        let found = SlopeSupremum { witness: DVec2::ZERO, at_least: 2.0, at_most: 2.01, boxes: 9 };
        let measured = |bound: f64| Measured { bound, found, size: 2.0 };
        assert!(measured(1.99).exceeded() && !measured(2.0).exceeded());
        assert_eq!(measured(3.0).ratio(), Some(1.5));
        assert_eq!(measured(f64::INFINITY).ratio(), None);
    }
}
