//! How many samples of a feature tree one thread computes in a second: the scalar reference on the whole program, the same on
//! the program pruned to tiles, and SIMD lanes on re-based tiles. Speed without agreement is worth nothing, so the lanes are
//! held to the rounding error that running error analysis derives for them.

use super::floor::operations_per_sample;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::genevaux2015::scenes::table_scenes;
use crate::report::{Cell, Claim, Outcome, Table};
use crate::scenes;
use glam::DVec2;
use std::hint::black_box;
use std::process::Command;
use std::time::Instant;
use terrain_model::bounds::{Region, THRESHOLD};
use terrain_model::interval::Interval;
use terrain_model::program::{BatchEvaluator, Evaluator, Program, Pruner, TileProgram, busy_lanes};
use terrain_model::rounding::Rounded;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "model/throughput",
    title: "Samples a second on one thread",
    section: "executors of the tree",
    about: "A scene of 20 primitives on 1 km² is sampled on a grid by one thread in three ways, in turn: the f64 reference on the whole \
            program, the f64 reference on the program pruned to each tile of 32 × 32 samples, and 16 lanes of f32 on the pruned tile \
            re-based to its corner. Pruning and re-basing are part of the time. Ratios are medians over rounds, within one run. \
            Every lane is compared with f64 on the same tile program, against the tolerance derived for it. Regular meshes of five \
            million samples are timed on all threads beside the least time that arithmetic alone would take.",
    code: "experiments/src/model/throughput.rs",
    test: "experiments/src/model/throughput.rs::lanes_agree_with_the_reference_and_a_shifted_reference_is_convicted",
    expected: |profile| Expected { seconds: profile.pick(15.0, 95.0), memory_bytes: 256 << 20, disk_bytes: 64 << 10 },
    run,
};

/// What the SIMD path aims at, in samples of the reference on the whole program …
const AIM_WHOLE: f64 = 8.0;
/// … and on the pruned program.
const AIM_PRUNED: f64 = 3.0;
/// Samples along the side of a tile, as in [`Program::bake`].
const TILE: usize = 32;
/// What an f64 evaluation of the oracle itself may be off by, metres: elevations here stay below 2¹⁰ m and no path is longer than
/// 2¹⁰ operations of 2⁻⁵³ each, together under 2⁻³³ m.
const ORACLE: f64 = 1e-9;
/// The command word that makes `reproduce` evaluate and nothing else, for counting instructions.
pub const COUNT_COMMAND: &str = "count-scalar";

/// A square that is sampled: its south-west corner, its side in metres and the samples along it.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    /// South-west corner, metres.
    pub origin: DVec2,
    /// Metres.
    pub side: f64,
    /// Samples along each side.
    pub samples: usize,
}

impl Raster {
    fn spacing(&self) -> f64 {
        self.side / (self.samples - 1) as f64
    }
    fn at(&self, i: usize, j: usize) -> DVec2 {
        self.origin + DVec2::new(i as f64, j as f64) * self.spacing()
    }
    /// Corner and size, in samples, of each tile.
    fn tiles(&self) -> impl Iterator<Item = ([usize; 2], [usize; 2])> {
        let starts = move || (0..self.samples).step_by(TILE);
        let size = |start: usize| (self.samples - start).min(TILE);
        starts().flat_map(move |j| starts().map(move |i| ([i, j], [size(i), size(j)])))
    }
    fn region(&self, [i, j]: [usize; 2], [columns, rows]: [usize; 2]) -> Region {
        let (corner, far) = (self.at(i, j), self.at(i + columns - 1, j + rows - 1));
        let slack = DVec2::splat(1e-12) * (corner.abs().max(far.abs()) + self.spacing());
        Region::rectangle(corner - slack, far + slack)
    }
}

/// The scene of Fig. 3: 20 primitives and three operators on 1 km².
///
/// # Errors
/// What is wrong with the embedded scene: a bug.
pub fn scene() -> Result<Program, ExperimentError> {
    let scene = scenes::load("builtin:fig3").map_err(ExperimentError::failed)?;
    scene.program(scene.ground()).map_err(ExperimentError::failed)
}

/// The reference on the whole program, row by row.
fn whole_scalar(program: &Program, raster: &Raster) -> f64 {
    let mut evaluator = Evaluator::<f64>::new(program);
    let mut sum = 0.0;
    for j in 0..raster.samples {
        for i in 0..raster.samples {
            sum += evaluator.height(program, raster.at(i, j)).0;
        }
    }
    sum
}

/// The reference on the program pruned to each tile.
fn pruned_scalar(program: &Program, raster: &Raster) -> f64 {
    let mut evaluator = Evaluator::<f64>::new(program);
    let mut pruner = Pruner::new(program);
    let mut sum = 0.0;
    for (start, size) in raster.tiles() {
        let pruned = pruner.prune(raster.region(start, size));
        for j in start[1]..start[1] + size[1] {
            for i in start[0]..start[0] + size[0] {
                sum += evaluator.height(&pruned, raster.at(i, j)).0;
            }
        }
    }
    sum
}

/// The SIMD path that bakes rasters.
fn batch(program: &Program, raster: &Raster) -> f64 {
    let n = raster.samples;
    let baked = program.bake(raster.origin, DVec2::splat(raster.spacing()), n, n);
    baked.elevation.iter().map(|v| f64::from(*v)).sum()
}

/// Samples a second of each way, and the ratios of the last to the others.
#[derive(Clone, Copy, Debug)]
pub struct Throughput {
    /// f64 on the whole program.
    pub scalar: f64,
    /// f64 on the pruned program.
    pub pruned: f64,
    /// Lanes.
    pub batch: f64,
    /// Median over rounds of batch ÷ scalar.
    pub over_scalar: f64,
    /// Median over rounds of batch ÷ pruned.
    pub over_pruned: f64,
}

/// Times the three ways in turn for `rounds` rounds on one thread.
///
/// # Errors
/// When no thread can be started.
pub fn measure(program: &Program, raster: &Raster, rounds: usize) -> Result<Throughput, ExperimentError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(ExperimentError::failed)?;
    let timed = |way: fn(&Program, &Raster) -> f64| {
        let start = Instant::now();
        black_box(way(black_box(program), black_box(raster)));
        start.elapsed().as_secs_f64()
    };
    let times: Vec<[f64; 3]> = pool.install(|| {
        timed(batch);
        (0..rounds.max(1)).map(|_| [timed(whole_scalar), timed(pruned_scalar), timed(batch)]).collect()
    });
    let samples = (raster.samples * raster.samples) as f64;
    let speed = |way: usize| samples / median(times.iter().map(|t| t[way]));
    Ok(Throughput {
        scalar: speed(0),
        pruned: speed(1),
        batch: speed(2),
        over_scalar: median(times.iter().map(|t| t[0] / t[2])),
        over_pruned: median(times.iter().map(|t| t[1] / t[2])),
    })
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// How far lanes lie from the reference on the same tile programs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement {
    /// Samples on the terrain that were compared.
    pub compared: usize,
    /// Those of them that lie farther from the reference than was derived for them.
    pub exceeded: usize,
    /// Largest distance, metres.
    pub deviation: f64,
    /// Largest distance of a weight.
    pub weight_deviation: f64,
    /// Largest derived tolerance, metres.
    pub tolerance: f64,
    /// Largest distance over tolerance.
    pub used: f64,
    /// Largest distance between the reference on the tile and in world coordinates: what rounding parameters to f32 costs, metres.
    pub parameters: f64,
}

/// Compares every `stride`-th sample of the raster; `shift` metres are added to the reference.
pub fn agreement(program: &Program, raster: &Raster, stride: usize, shift: f64) -> Agreement {
    let mut pruner = Pruner::new(program);
    let mut lanes = BatchEvaluator::new(program);
    let mut world = Evaluator::<f64>::new(program);
    let mut result = Agreement::default();
    for (start, size) in raster.tiles() {
        let corner = raster.at(start[0], start[1]);
        let tile = TileProgram::new(&pruner.prune(raster.region(start, size)), corner);
        let n = size[0] * size[1];
        let step = raster.spacing();
        let x: Vec<f32> = (0..n).map(|k| ((k % size[0]) as f64 * step) as f32).collect();
        let y: Vec<f32> = (0..n).map(|k| ((k / size[0]) as f64 * step) as f32).collect();
        let (mut f, mut a) = (vec![0.0; n], vec![0.0; n]);
        lanes.evaluate(&tile, &x, &y, &mut f, &mut a);
        let (mut oracle, mut error) = (tile.evaluator::<f64>(), tile.evaluator::<Rounded>());
        let first = (start[0] * 7 + start[1]) % stride;
        for k in (first..n).step_by(stride) {
            let at = [f64::from(x[k]), f64::from(y[k])];
            let (elevation, weight) = tile.run(&mut oracle, at);
            if weight < THRESHOLD {
                continue;
            }
            let exact = |v: f64| Rounded::new(Interval::point(v), 0.0);
            let (allowed, allowed_weight) = tile.run(&mut error, at.map(exact));
            let off = (f64::from(f[k]) - (elevation + shift)).abs();
            let off_weight = (f64::from(a[k]) - weight).abs();
            result.compared += 1;
            let within = off <= allowed.error + ORACLE && off_weight <= allowed_weight.error + ORACLE;
            result.exceeded += usize::from(!within);
            result.deviation = result.deviation.max(off);
            result.weight_deviation = result.weight_deviation.max(off_weight);
            result.tolerance = result.tolerance.max(allowed.error);
            result.used = result.used.max(off / (allowed.error + ORACLE));
            let there = world.height(program, corner + DVec2::from_array(at)).0;
            result.parameters = result.parameters.max((elevation - there).abs());
        }
    }
    result
}

/// Evaluates the scene's reference at `count` points, the first ones of one sequence: what [`COUNT_COMMAND`] runs.
///
/// # Errors
/// When the scene does not compile.
pub fn count_scalar(count: u32) -> Result<f64, ExperimentError> {
    let program = scene()?;
    let mut evaluator = Evaluator::<f64>::new(&program);
    // The plane's golden ratio: each prefix of the sequence covers the square evenly.
    let (mut p, step) = (DVec2::splat(0.5), DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3));
    let mut sum = 0.0;
    for _ in 0..count {
        p = (p + step).fract();
        sum += evaluator.height(&program, p * 1000.0).0;
    }
    Ok(black_box(sum))
}

/// Instructions of one evaluation of the reference: callgrind's count for many points less that for few, over their difference.
///
/// # Errors
/// Why it could not be counted, in words.
pub fn instructions_per_evaluation() -> Result<f64, String> {
    instructions_each(&[COUNT_COMMAND], [500, 8_500])
}

/// Instructions of one unit of the hidden command `words` of `reproduce`, which takes the number of units as its last word:
/// callgrind's count for many of them less that for few, over their difference.
///
/// # Errors
/// Why it could not be counted, in words.
pub fn instructions_each(words: &[&str], counts: [u32; 2]) -> Result<f64, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    if own.file_stem().and_then(|name| name.to_str()) != Some("reproduce") {
        return Err("only the `reproduce` command can be run under callgrind".into());
    }
    let count = |units: u32| -> Result<f64, String> {
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&own)
            .args(words)
            .arg(units.to_string())
            .output()
            .map_err(|error| format!("valgrind did not start: {error}"))?;
        let text = String::from_utf8_lossy(&output.stderr);
        let collected = text.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok());
        collected.ok_or_else(|| format!("callgrind gave no count and ended with {}", output.status))
    };
    let [few, many] = [count(counts[0])?, count(counts[1])?];
    Ok((many - few) / f64::from(counts[1] - counts[0]))
}

/// Samples along the side of the regular meshes: five million in all.
const MESH: usize = 2_237;
/// Seconds that a mesh of five million samples is to take at most on two cores.
const MESH_AIM: f64 = 1.0;

/// Regular meshes of the scenes of Table 1 on all threads, and the arithmetic floor: operations of what pruning leaves over what
/// lanes reach on operations alone.
fn meshes(outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let least = |way: &mut dyn FnMut()| {
        let seconds = (0..3).map(|_| {
            let start = Instant::now();
            way();
            start.elapsed().as_secs_f64()
        });
        seconds.fold(f64::INFINITY, f64::min)
    };
    let mut operations = 0;
    let busy = least(&mut || {
        let (count, sum) = busy_lanes(black_box(4_000_000));
        black_box(sum);
        operations = count;
    });
    let peak = operations as f64 / busy;
    let threads = rayon::current_num_threads();
    outcome.timing("lane_operations_per_second", peak)?;
    outcome.timing("mesh_threads", threads as f64)?;
    let mut table = Table::new("meshes", "Regular meshes of five million samples, all threads")
        .column("scene")
        .column("operations a sample")
        .machine_column("seconds")
        .machine_column("floor, seconds")
        .machine_column("over the floor")
        .column("aim, seconds on two cores");
    for scene in table_scenes().map_err(ExperimentError::failed)? {
        let (name, program) = (scene.name, &scene.program);
        let spacing = scene.extent / (MESH - 1) as f64;
        let seconds = least(&mut || {
            black_box(program.bake(DVec2::ZERO, spacing, MESH, MESH));
        });
        let each = operations_per_sample(program, scene.extent, spacing * (TILE - 1) as f64, 64);
        let floor = each * (MESH * MESH) as f64 / (peak * threads as f64);
        outcome.metric(&format!("mesh.{name}.operations_per_sample"), each)?;
        outcome.timing(&format!("mesh.{name}.seconds"), seconds)?;
        outcome.timing(&format!("mesh.{name}.over_floor"), seconds / floor)?;
        table.row([
            Cell::from(name),
            Cell::number(each, "", 4),
            Cell::number(seconds, "s", 3),
            Cell::number(floor, "s", 3),
            Cell::number(seconds / floor, "", 3),
            Cell::number(MESH_AIM, "s", 1),
        ]);
    }
    outcome.metric("mesh.samples", (MESH * MESH) as f64)?;
    outcome.table(table)?;
    Ok(())
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let program = scene()?;
    let raster = Raster { origin: DVec2::ZERO, side: 1000.0, samples: ctx.profile.pick(512, 2048) };
    let rounds = ctx.profile.pick(9, 11);
    let speeds = measure(&program, &raster, rounds)?;
    let agree = agreement(&program, &raster, ctx.profile.pick(41, 211), 0.0);
    let shifted = agreement(&program, &Raster { samples: 128, ..raster }, 41, 0.05);

    let fast = speeds.over_scalar >= AIM_WHOLE && speeds.over_pruned >= AIM_PRUNED;
    let held = agree.exceeded == 0 && agree.compared > 0;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    if !held {
        outcome.set_verdict(
            Verdict::NotReproduced,
            "A lane lies farther from the reference than its derived rounding error.",
        );
    } else if !fast {
        let why = format!(
            "Lanes are {:.1} times as fast as the reference and {:.1} times as fast as the pruned one: one of \
             them is less than its aim, {AIM_WHOLE} and {AIM_PRUNED}.",
            speeds.over_scalar, speeds.over_pruned
        );
        outcome.set_verdict(Verdict::Partial, why);
    }
    let mut table = Table::new("speed", "Samples a second on one thread, 20 primitives on 1 km²")
        .column("way")
        .machine_column("samples a second")
        .machine_column("lanes are faster by")
        .column("aim");
    table.row([
        "f64, whole program".into(),
        Cell::number(speeds.scalar, "1/s", 3),
        Cell::number(speeds.over_scalar, "", 3),
        Cell::number(AIM_WHOLE, "", 1),
    ]);
    table.row([
        "f64, pruned to tiles".into(),
        Cell::number(speeds.pruned, "1/s", 3),
        Cell::number(speeds.over_pruned, "", 3),
        Cell::number(AIM_PRUNED, "", 1),
    ]);
    table.row([
        "f32 lanes, pruned and re-based".into(),
        Cell::number(speeds.batch, "1/s", 3),
        Cell::number(1.0, "", 2),
        Cell::missing("the measured path"),
    ]);
    outcome.table(table)?;
    outcome.timing("scalar_per_second", speeds.scalar)?;
    outcome.timing("pruned_scalar_per_second", speeds.pruned)?;
    outcome.timing("batch_per_second", speeds.batch)?;
    outcome.timing("batch_over_scalar", speeds.over_scalar)?;
    outcome.timing("batch_over_pruned_scalar", speeds.over_pruned)?;
    outcome.metric("max_deviation_metres", agree.deviation)?;
    outcome.metric("max_tolerance_metres", agree.tolerance)?;
    outcome.metric("max_deviation_over_tolerance", agree.used)?;
    outcome.metric("max_weight_deviation", agree.weight_deviation)?;
    outcome.metric("max_parameter_deviation_metres", agree.parameters)?;
    outcome.metric("compared_samples", agree.compared as f64)?;
    outcome.metric("samples", (raster.samples * raster.samples) as f64)?;
    match instructions_per_evaluation() {
        Ok(count) => outcome.timing("instructions_per_scalar_evaluation", count)?,
        Err(why) => outcome.absent("instructions_per_scalar_evaluation", why)?,
    }
    meshes(&mut outcome)?;
    let statement = "Lanes on a re-based tile lie within the derived rounding error of f64 on the same tile.";
    let verdict = if held { ClaimVerdict::Tested } else { ClaimVerdict::Refuted };
    let evidence = format!("{} samples; the margin is the unused part of the tolerance", agree.compared);
    let mut claim = Claim::new("lanes-agree", statement, verdict, evidence).margin(1.0 - agree.used);
    if !held {
        claim = claim.witness(format!("{} samples exceed it", agree.exceeded));
    }
    outcome.claim(claim)?;
    outcome.control(
        "a shifted reference",
        "5 cm added to the reference",
        "lanes lie outside the derived tolerance",
        shifted.exceeded > 0,
    );
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Raster = Raster { origin: DVec2::ZERO, side: 1000.0, samples: 96 };

    #[test]
    fn lanes_agree_with_the_reference_and_a_shifted_reference_is_convicted() {
        let program = scene().unwrap();
        let right = agreement(&program, &SMALL, 11, 0.0);
        assert!(right.compared > 500 && right.exceeded == 0 && right.used > 0.001, "{right:?}");
        assert!(agreement(&program, &SMALL, 11, 0.05).exceeded > right.compared / 2);
    }

    #[test]
    fn the_three_ways_sample_the_same_terrain() {
        let program = scene().unwrap();
        assert_eq!(program.primitive_instructions(), 20);
        let (whole, pruned, lanes) =
            (whole_scalar(&program, &SMALL), pruned_scalar(&program, &SMALL), batch(&program, &SMALL));
        assert_eq!(whole.to_bits(), pruned_by_rows(&program).to_bits());
        // Summed in another order: nothing but rounding may differ.
        assert!(
            (whole - pruned).abs() < 1e-9 * whole && (whole - lanes).abs() < 1e-4 * whole,
            "{whole} {pruned} {lanes}"
        );
    }

    /// Pruned tile by tile, summed row by row.
    fn pruned_by_rows(program: &Program) -> f64 {
        let mut heights = vec![0.0; SMALL.samples * SMALL.samples];
        for (start, size) in SMALL.tiles() {
            let pruned = program.prune(SMALL.region(start, size));
            for j in start[1]..start[1] + size[1] {
                for i in start[0]..start[0] + size[0] {
                    heights[j * SMALL.samples + i] = pruned.height(SMALL.at(i, j)).0;
                }
            }
        }
        heights.iter().sum()
    }
}
