//! Figure 3: Phong tessellation off and on, and how much of the fold at the raster's lines it takes away.

use super::picture::Look;
use super::scenes::{detail, looking, mountain, shoot, size};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use terrain_gpu::tessellate::displace::Space;
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::triangle::SIDE;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/fig3",
    title: "Figure 3: Phong tessellation",
    section: "§4, Fig. 3",
    about: "A coarse raster of the diffusion paper's mountain, without noise. At every sample line the surface folds; the angle between \
            the normals on both sides is measured at the middle of each cell's border. Phong tessellation pulls the surface towards \
            the planes of its corners, so that folds are smaller.",
    code: "experiments/src/tessellation/fig3.rs",
    test: "gpu/src/tessellate/tests.rs::the_normal_is_that_of_the_displaced_surface_and_not_of_the_smooth_one",
    expected: |profile| Expected {
        seconds: profile.pick(4.0, 30.0),
        memory_bytes: 512 << 20,
        disk_bytes: profile.pick(1 << 20, 8 << 20),
    },
    run,
};

/// Nodes along a side.
const NODES: usize = 65;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let grid = mountain(NODES)?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("folds", "Angle between the normals on both sides of a sample line")
        .column("α")
        .column("root mean square")
        .column("largest")
        .column("the surface moves at most");
    let mut folds = Vec::new();
    for alpha in [0.0, 0.3, 0.6, 1.0] {
        let ground = Ground::new(&grid, alpha).map_err(ExperimentError::failed)?;
        let [mean, most] = fold(&ground, NODES - 1, 0.0)?;
        let moved = moved(&ground, NODES - 1);
        table.row([
            Cell::number(alpha, "", 2),
            Cell::number(mean.to_degrees(), "°", 3),
            Cell::number(most.to_degrees(), "°", 3),
            Cell::number(moved, "m", 3),
        ]);
        folds.push(mean);
        if alpha == 0.0 || alpha == 0.6 {
            let detail = detail(&ground, 0.0, Space::Volume)?;
            let view = looking((&ground, &detail), [0.30, 0.22, 60.0], [0.52, 0.55, 0.0], size(ctx))?;
            let name = if alpha == 0.0 {
                ("off", "Without Phong tessellation")
            } else {
                ("on", "With Phong tessellation, α = 0.6")
            };
            outcome.picture(shoot(ctx, (&ground, &detail, &Look::over(&ground)), view, 6.0, name)?.0);
        }
    }
    outcome.table(table)?;
    outcome.metric("fold_off_degrees", folds[0].to_degrees())?;
    outcome.metric("fold_on_degrees", folds[2].to_degrees())?;
    outcome.metric("reduction", folds[2] / folds[0])?;
    outcome.deviation("the paper's elevations of Puget Sound", "a mountain of the diffusion paper's, 65 × 65 samples");
    let [off, on] = [0.0, 0.6].map(|alpha| Ground::new(&grid, alpha).map_err(ExperimentError::failed));
    let [off, on] = [fold(&off?, NODES - 1, 0.25)?[0], fold(&on?, NODES - 1, 0.25)?[0]];
    outcome.control("within cells", "a quarter of a cell beside the lines", "folds are not reduced", !reduced(off, on));
    if !reduced(folds[0], folds[2]) {
        outcome.set_verdict(Verdict::NotReproduced, "folds are not reduced by a quarter");
    }
    Ok(outcome)
}

fn reduced(off: f64, on: f64) -> bool {
    on < 0.75 * off
}

/// Root mean square and largest angle, radians, over the lines from south to north, or the share `beside` of a cell east of them.
fn fold(ground: &Ground, cells: usize, beside: f64) -> Result<[f64; 2], ExperimentError> {
    let flat = detail(ground, 0.0, Space::Volume)?;
    let unit = SIDE / cells.next_power_of_two() as u32;
    let (mut squares, mut most, mut count) = (0.0, 0.0f64, 0.0);
    for i in 1..cells as u32 {
        for j in 0..cells as u32 {
            let y = j * unit + unit / 2;
            let x = i * unit + (beside * f64::from(unit)) as u32;
            let [a, b] = [x - 1, x + 1].map(|x| flat.normal(ground, [x, y], 0.0));
            let apart: f64 = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt();
            let angle = 2.0 * libm::asin((0.5 * apart).min(1.0));
            squares += angle * angle;
            most = most.max(angle);
            count += 1.0;
        }
    }
    Ok([(squares / count).sqrt(), most])
}

/// The farthest move of a cell's middle, metres.
fn moved(ground: &Ground, cells: usize) -> f64 {
    let unit = SIDE / cells.next_power_of_two() as u32;
    let middles = (0..cells * cells).map(|k| [k % cells, k / cells].map(|i| i as u32 * unit + unit / 2));
    let from_raster = |vertex| {
        let ((p, _), [x, y]) = (ground.smooth(vertex), ground.metres(vertex));
        let q = [x, y, ground.elevation([x, y])];
        (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>().sqrt()
    };
    middles.map(from_raster).fold(0.0, f64::max)
}
