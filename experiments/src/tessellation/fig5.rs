//! Figures 5 and 7: a mountain without and with six octaves, from near and from the ground, and what they do to its base shape.

use super::picture::Look;
use super::scenes::{detail, looking, mountain, shoot, size};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use rayon::prelude::*;
use terrain_gpu::tessellate::displace::{Detail, Rule, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::triangle::SIDE;
use terrain_model::noise::Octaves;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/fig5",
    title: "Figures 5 and 7: detail off and on, and the base shape",
    section: "§5, Figs. 5, 7",
    about: "The paper asks that fBm's parameters leave the base shape as it is (§5), without a measure. Here it is the drift: the mean \
            change of elevation over blocks of 8 × 8 samples, as a root mean square over blocks, in parts of the amplitude. No point may \
            move farther than the amplitude. The control has waves of 64 samples: it changes the shape.",
    code: "experiments/src/tessellation/fig5.rs",
    test: "gpu/src/tessellate/tests.rs::displacement_keeps_within_its_amplitude_and_comes_near_it",
    expected: |profile| Expected {
        seconds: profile.pick(8.0, 60.0),
        memory_bytes: profile.pick(1, 4) << 30,
        disk_bytes: profile.pick(3 << 20, 24 << 20),
    },
    run,
};

/// Nodes along a side, and samples along a block's.
const NODES: usize = 129;
const BLOCK: u32 = 8;
/// Points along a block's side.
const POINTS: u32 = 2 * BLOCK;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let ground = Ground::new(&mountain(NODES)?, 0.6).map_err(ExperimentError::failed)?;
    let (none, plain) = (detail(&ground, 0.0, Space::Volume)?, detail(&ground, 3.0, Space::Volume)?);
    let (mut hollow, mut product) = (plain.clone(), plain.clone());
    hollow.concavity = Some([0.2, 0.25 / ground.spacing()[0]]);
    product.rule = Rule::Multifractal { offset: 0.9 };
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let near = looking((&ground, &plain), [0.325, 0.1875, 400.0], [0.5375, 0.525, 100.0], size(ctx))?;
    let level = looking((&ground, &plain), [0.42, 0.36, 10.0], [0.515, 0.60, 60.0], size(ctx))?;
    let look = Look::over(&ground);
    let shots = [
        (&none, near, ("without", "Fig. 5, left: tessellated and smoothed, without noise")),
        (&plain, near, ("with", "Fig. 5, right: six octaves, less of them on level and on low ground")),
        (&hollow, near, ("hollows", "The paper's future work: less noise in hollows")),
        (&product, near, ("multifractal", "The multifractal in place of the sum")),
        (&plain, level, ("ground", "Fig. 7: the mountain from the ground, six octaves")),
    ];
    for (detail, view, name) in shots {
        outcome.picture(shoot(ctx, (&ground, detail, &look), view, 6.0, name)?.0);
    }
    let long = Octaves {
        octaves: 1,
        frequency: 1.0 / (64.0 * ground.spacing()[0]),
        lacunarity: 2.0,
        gain: 0.5,
        amplitude: plain.amplitude(),
    };
    let mut long = Detail::new(&long, 3, Space::Volume).ok_or_else(|| ExperimentError::failed("octaves"))?;
    (long.floor, long.elevation) = (plain.floor, plain.elevation);
    let mut table = Table::new("drift", "What noise does to the base shape")
        .column("detail")
        .column("drift, in amplitudes")
        .column("root mean square, in amplitudes")
        .column("farthest, in amplitudes");
    let mut found = Vec::new();
    let plane = detail(&ground, 3.0, Space::Plan)?;
    let kinds = [
        ("sum", &plain),
        ("less in hollows", &hollow),
        ("multifractal", &product),
        ("waves of 64 samples", &long),
        ("sum, in the plane", &plane),
    ];
    for (name, detail) in kinds {
        let [drift, mean, most] = change(&ground, detail);
        table.row([name.into(), Cell::number(drift, "", 3), Cell::number(mean, "", 3), Cell::number(most, "", 3)]);
        found.push([drift, most]);
    }
    outcome.table(table)?;
    let [drift, _] = found[0];
    let worst = [1, 2, 4].iter().fold(drift, |worst, kind| worst.max(found[*kind][0]));
    let most = found.iter().fold(0.0f64, |most, [_, far]| most.max(*far));
    outcome.metric("drift", drift)?;
    for (name, kind) in [("hollows", 1), ("multifractal", 2), ("plane", 4)] {
        outcome.metric(&format!("drift.{name}"), found[kind][0])?;
    }
    outcome.metric("largest_displacement", most)?;
    outcome.control("long waves", "64 samples", "a drift five times as large", found[3][0] > 5.0 * drift);
    outcome.deviation(
        "Mount Rainier beside a photograph",
        "the diffusion paper's mountain, 129 × 129 samples; neither elevations nor photograph are shipped",
    );
    if most > 1.0 + 1e-9 || worst > 0.05 {
        outcome.set_verdict(Verdict::NotReproduced, format!("a drift of {worst}, {most} amplitudes at most"));
    }
    Ok(outcome)
}

/// Drift, root mean square and largest displacement in amplitudes, over blocks; 2 × 2 points a cell.
fn change(ground: &Ground, detail: &Detail) -> [f64; 3] {
    let cells = NODES as u32 - 1;
    let unit = SIDE / cells;
    let along = cells / BLOCK;
    let block = |block: u32| {
        let corner = [block % along, block / along].map(|k| k * BLOCK * unit);
        let (mut sum, mut squares, mut most) = (0.0, 0.0, 0.0f64);
        for k in 0..POINTS * POINTS {
            let [i, j] = [k % POINTS, k / POINTS].map(|i| i * unit / 2 + unit / 4);
            let vertex = [corner[0] + i, corner[1] + j];
            let (p, q) = (ground.smooth(vertex).0, detail.position(ground, vertex, 0.0));
            let far = (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>();
            (sum, squares, most) = (sum + q[2] - p[2], squares + far, most.max(far));
        }
        let count = f64::from(POINTS * POINTS);
        [sum / count, squares / count, most]
    };
    let blocks: Vec<[f64; 3]> = (0..along * along).into_par_iter().map(block).collect();
    let mean = |of: &dyn Fn(&[f64; 3]) -> f64| (blocks.iter().map(of).sum::<f64>() / blocks.len() as f64).sqrt();
    let most = blocks.iter().fold(0.0f64, |most, block| most.max(block[2])).sqrt();
    [mean(&|block| block[0] * block[0]), mean(&|block| block[1]), most].map(|metres| metres / detail.amplitude())
}
