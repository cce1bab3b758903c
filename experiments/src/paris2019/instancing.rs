//! What instancing saves: groups of primitives stored once and placed many times, against the same primitives stored each.

use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use glam::DVec3;
use std::sync::Arc;
use terrain_amplify::field::Density;
use terrain_amplify::implicit::primitive::Primitive;
use terrain_amplify::implicit::skeleton::Skeleton;
use terrain_amplify::implicit::volume::{Instance, Placement, Volume};
use terrain_papers::verdicts::Verdict;

use super::scenes::uniform;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/instancing",
    title: "Instancing",
    section: "§8.3",
    about: "The paper reports that instancing halves the memory of a replicated primitive. Copies of groups of point primitives, all at \
            multiples of 1/8 m so that no coordinate is rounded, stored once and placed, against every primitive stored, 36 bytes \
            each, the index that either would have left out. Fields of both are compared.",
    code: "experiments/src/paris2019/instancing.rs",
    test: "amplify/src/implicit/volume/memory.rs::what_is_shared_counts_once",
    expected: |_| Expected { seconds: 1.0, memory_bytes: 64 << 20, disk_bytes: 8 << 10 },
    run,
};

const COPIES: u32 = 200;
/// Primitives of a group; the mean stroke of the sea cave has 24.
const GROUPS: [u32; 6] = [1, 2, 4, 8, 24, 64];
/// The group that `bytes_ratio` is about.
const TYPICAL: u32 = 24;

/// A multiple of 1/8 m below `size`.
fn eighths(seed: u32, k: u32, size: f64) -> f64 {
    (uniform(seed, k) * 8.0 * size).floor() / 8.0
}

fn group(seed: u32, count: u32) -> Vec<Primitive> {
    let one = |k: u32| Primitive {
        skeleton: Skeleton::Point([0, 1, 2].map(|j| eighths(seed, 3 * k + j, 6.0) as f32)),
        radius: 3.0,
        energy: if k.is_multiple_of(3) { 0.5 } else { -0.5 },
    };
    (0..count).map(one).collect()
}

fn place(seed: u32, k: u32) -> DVec3 {
    let at = |j: u32| eighths(seed ^ 0x5151, 3 * k + j, 400.0);
    DVec3::new(at(0), at(1), 0.125 * at(2))
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let seed = ctx.seed as u32;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("instancing", "Bytes of 200 copies of a group of primitives")
        .column("primitives of the group")
        .column("each stored")
        .column("instanced")
        .column("ratio");
    let mut ratios = Vec::new();
    let (mut largest, mut moved) = (0.0f64, 0.0f64);
    for count in GROUPS {
        let own = group(seed, count);
        let copies: Vec<DVec3> = (0..COPIES).map(|k| place(seed, k)).collect();
        let mut all = Vec::new();
        for at in &copies {
            for one in &own {
                let Skeleton::Point(p) = one.skeleton else { continue };
                let p = DVec3::from_array(p.map(f64::from)) + *at;
                all.push(Primitive { skeleton: Skeleton::Point(p.as_vec3().to_array()), ..*one });
            }
        }
        let stored = Volume::Few(all.into());
        let child = Volume::Few(own.into());
        let instance = |at: &DVec3| {
            let placement = Placement::new(*at, 0.0, 1.0).ok_or_else(|| ExperimentError::failed("a placement"))?;
            Ok(Volume::Instance(Arc::new(Instance { child: child.clone(), placement })))
        };
        let instances = copies.iter().map(instance).collect::<Result<Vec<_>, ExperimentError>>()?;
        let instanced = Volume::Blend(instances);
        for k in 0..400 {
            let around = copies[k as usize % copies.len()];
            let p = around + DVec3::new(uniform(7, 3 * k), uniform(7, 3 * k + 1), uniform(7, 3 * k + 2)) * 6.0;
            let f = instanced.value(p);
            largest = largest.max((f - stored.value(p)).abs());
            moved = moved.max((f - stored.value(p + 0.125)).abs());
        }
        let [[one, _], [other, _]] = [stored.bytes(), instanced.bytes()];
        let ratio = one as f64 / other as f64;
        outcome.metric(&format!("n{count}.bytes_ratio"), ratio)?;
        if count == TYPICAL {
            outcome.metric("bytes_ratio", ratio)?;
            if ratio < 2.0 {
                outcome.set_verdict(Verdict::NotReproduced, format!("a ratio of {ratio} for {TYPICAL} primitives"));
            }
        }
        ratios.push((f64::from(count), ratio));
        table.row([
            Cell::count(u64::from(count)),
            Cell::count(one as u64),
            Cell::count(other as u64),
            Cell::number(ratio, "", 3),
        ]);
    }
    outcome.table(table)?;
    let plot =
        Plot::new("ratios", "Bytes saved", Axis::log("primitives of the group"), Axis::log("stored each / instanced"));
    outcome.plot(plot.series("200 copies", Style::LineAndPoints, ratios))?;
    outcome.metric("largest_difference", largest)?;
    // Sums of up to 64 primitives of energy 1/2 in another order.
    if largest > 1e-12 {
        outcome.set_verdict(Verdict::NotReproduced, format!("fields differ by {largest}"));
    }
    outcome.control("a copy elsewhere", "the stored field an eighth of a metre away", "it differs", moved > 1e-3);
    outcome.deviation(
        "which primitive the paper replicates",
        "groups of 1 to 64 point primitives; one alone is smaller than a placement",
    );
    Ok(outcome)
}
