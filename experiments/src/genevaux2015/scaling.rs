//! Time of a query against the number of primitives, from ten to a hundred thousand, at equal overlap.

use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::generate::Scatter;
use crate::genevaux2015::rays::Random;
use crate::report::{Axis, Cell, Claim, Outcome, Plot, Style, Table};
use crate::scenes::parse;
use glam::DVec2;
use std::hint::black_box;
use std::time::Instant;
use terrain_model::bounds::Region;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::program::{BoundsEvaluator, Cells, Evaluator, Evidence, Program, Pruner};
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/scaling",
    title: "Time of a query against the number of primitives",
    section: "§3, §5.1, §8.2",
    about: "The paper hangs many overlapping primitives under one blend with a grid. Here a quadtree of pruned programs does this for \
            every operator: a query runs the program of the smallest square that holds it. Scenes of ten to a hundred thousand discs, \
            level, of fractal noise and of ridges, four over each point on average, are asked for values, bounds over boxes, \
            enclosures along segments, pruned programs and rasters. Times are of the second and later passes over the same places; \
            the first pass, which builds the squares, is given apart. Values are compared bit by bit with the plain loop.",
    code: "experiments/src/genevaux2015/scaling.rs",
    test: "experiments/src/genevaux2015/scaling.rs::squares_keep_every_bit_and_another_scene_is_noticed",
    expected: |profile| Expected {
        seconds: profile.pick(20.0, 120.0),
        memory_bytes: profile.pick(1 << 30, 2 << 30),
        disk_bytes: 256 << 10,
    },
    run,
};

/// Numbers of primitives.
const SIZES: [u32; 5] = [10, 100, 1_000, 10_000, 100_000];
/// Mean number of primitives over a point.
const OVERLAP: f64 = 4.0;
/// At most this many times the time of a hundred primitives is aimed at for a hundred thousand.
const AIM: f64 = 4.0;
/// Metres: side of the boxes and tiles, length of the segments.
const BOX: f64 = 8.0;
/// Samples a side of a raster, a metre apart.
const RASTER: usize = 128;

/// What is asked, in the order of [`Times::seconds`].
const QUERIES: [&str; 5] = ["value", "box", "segment", "prune", "batch"];

/// Seconds of one query of each kind, and of the first pass over the values.
#[derive(Clone, Copy, Debug)]
struct Times {
    seconds: [f64; QUERIES.len()],
    first: f64,
}

/// A generated scene and where it is asked.
struct Trial {
    program: Program,
    cells: Cells,
    points: Vec<DVec2>,
}

impl Trial {
    fn new(primitives: u32, seed: u64, points: usize) -> Result<Trial, ExperimentError> {
        let scatter = Scatter { primitives, overlap: OVERLAP, seed };
        let scene = parse("generated", &scatter.text()).map_err(ExperimentError::failed)?;
        let program = scene.program(scene.ground()).map_err(ExperimentError::failed)?;
        let mut random = Random(seed ^ 0x5CA1E);
        // Off the border, where fewer primitives overlap.
        let inset = DVec2::splat(50.0);
        let size = scatter.extent() - 2.0 * inset;
        let points =
            (0..points).map(|_| inset + size * DVec2::new(random.range(0.0, 1.0), random.range(0.0, 1.0))).collect();
        let cells = Cells::new(&program, Evidence::Ranges);
        Ok(Trial { program, cells, points })
    }
    /// Instructions that a value runs on average.
    fn visits(&self) -> f64 {
        let all: usize = self.points.iter().map(|p| self.cells.at(*p).code().len()).sum();
        all as f64 / self.points.len() as f64
    }
    /// Values whose bits differ from those of the plain loop over `program`, among the first `count`.
    fn differing(&self, program: &Program, count: usize) -> usize {
        let (mut plain, mut own) = (Evaluator::<f64>::new(program), Evaluator::<f64>::new(program));
        let mut differ = 0;
        for p in &self.points[..count] {
            let bits = |(f, a): (f64, f64)| (f.to_bits(), a.to_bits());
            differ += usize::from(bits(plain.height(program, *p)) != bits(own.height(self.cells.at(*p), *p)));
        }
        differ
    }
    fn values(&self) -> f64 {
        let mut evaluator = Evaluator::<f64>::new(&self.program);
        self.points.iter().map(|p| evaluator.height(self.cells.at(*p), *p).0).sum()
    }
    fn boxes(&self) -> f64 {
        let mut evaluator = BoundsEvaluator::new(&self.program);
        let bound = |p: &DVec2| {
            let q = *p + BOX;
            evaluator.bounds_of(self.cells.over(*p, q), Region::rectangle(*p, q)).slope
        };
        self.points.iter().map(bound).filter(|slope| slope.is_finite()).sum()
    }
    fn segments(&self) -> f64 {
        let mut evaluator = Evaluator::<Dual<Interval, 1>>::new(&self.program);
        let along = |p: &DVec2| {
            let t = Dual::<Interval, 1>::variable(Interval::new(0.0, BOX), 0);
            let x = [Dual::fixed(Interval::point(p.x)) + t, Dual::fixed(Interval::point(p.y)) + t];
            evaluator.run(self.cells.over(*p, *p + BOX), x).1.value.hi()
        };
        self.points.iter().map(along).sum()
    }
    fn pruned(&self) -> f64 {
        let prune = |p: &DVec2| {
            let (low, high) = (*p - BOX, *p + BOX);
            Pruner::new(self.cells.over(low, high)).prune(Region::rectangle(low, high)).code().len() as f64
        };
        self.points.iter().map(prune).sum()
    }
    /// Rasters at the first of `points`, one for every `RASTER`² of them.
    fn rasters(&self) -> f64 {
        let count = self.points.len().div_ceil(RASTER * RASTER);
        let bake = |p: &DVec2| f64::from(self.cells.bake(*p, DVec2::ONE, RASTER, RASTER).elevation[0]);
        self.points[..count].iter().map(bake).sum()
    }
    fn times(&self, rounds: usize) -> Times {
        let timed = |way: &dyn Fn() -> f64, queries: usize| {
            let start = Instant::now();
            black_box(way());
            start.elapsed().as_secs_f64() / queries as f64
        };
        let n = self.points.len();
        let first = timed(&|| self.values(), n);
        let rasters = n.div_ceil(RASTER * RASTER) * RASTER * RASTER;
        let ways: [(&dyn Fn() -> f64, usize); QUERIES.len()] = [
            (&|| self.values(), n),
            (&|| self.boxes(), n),
            (&|| self.segments(), n),
            (&|| self.pruned(), n),
            (&|| self.rasters(), rasters),
        ];
        // The least of some passes, the first of which only builds: what else the machine does makes the others slower.
        let seconds = ways.map(|(way, queries)| {
            timed(way, queries);
            (0..rounds).map(|_| timed(way, queries)).fold(f64::INFINITY, f64::min)
        });
        Times { seconds, first }
    }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let points = ctx.profile.pick(10_000, 50_000);
    let rounds = ctx.profile.pick(3, 7);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(ExperimentError::failed)?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("times", "One thread; a query after the squares are built")
        .column("primitives")
        .column("instructions a value runs")
        .column("bytes of squares");
    for query in QUERIES {
        table = table.machine_column(query);
    }
    let mut table = table.machine_column("first value");
    let mut all: Vec<(f64, Times)> = Vec::new();
    let (mut differ, mut noticed) = (0, false);
    let progress = ctx.progress("scenes", SIZES.len() as u64);
    for primitives in SIZES {
        let trial = Trial::new(primitives, ctx.seed_for("scatter"), points)?;
        let times = pool.install(|| trial.times(rounds));
        let compared = if primitives > 10_000 { 200 } else { 2_000 };
        differ += trial.differing(&trial.program, compared);
        if primitives == 1_000 {
            let other = Trial::new(primitives, ctx.seed_for("other"), 1)?;
            noticed = trial.differing(&other.program, compared) > compared / 2;
        }
        outcome.timing(&format!("seconds_per_evaluation.{primitives}"), times.seconds[0])?;
        outcome.timing(&format!("seconds_per_first_evaluation.{primitives}"), times.first)?;
        for (query, seconds) in QUERIES.into_iter().zip(times.seconds).skip(1) {
            outcome.timing(&format!("seconds_per_{query}.{primitives}"), seconds)?;
        }
        let (visits, bytes) = (trial.visits(), trial.cells.bytes());
        outcome.metric(&format!("instructions_visited.{primitives}"), visits)?;
        outcome.metric(&format!("bytes.{primitives}"), trial.program.bytes() as f64)?;
        outcome.metric(&format!("bytes_acceleration.{primitives}"), bytes as f64)?;
        let mut row = vec![Cell::count(primitives.into()), Cell::number(visits, "", 3), Cell::count(bytes as u64)];
        row.extend(times.seconds.iter().chain([&times.first]).map(|s| Cell::number(s * 1e9, "ns", 3)));
        table.row(row);
        all.push((f64::from(primitives), times));
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.metric("values_whose_bits_differ", differ as f64)?;
    let mut plot =
        Plot::new("times", "Seconds a query at equal overlap", Axis::log("primitives"), Axis::log("seconds a query"));
    for (k, query) in QUERIES.into_iter().enumerate() {
        plot = plot.series(query, Style::LineAndPoints, all.iter().map(|(n, times)| (*n, times.seconds[k])));
    }
    outcome.plot(plot.machine())?;
    let (hundred, most) = (all[1].1, all[SIZES.len() - 1].1);
    let mut slowest = 0.0f64;
    for (k, query) in QUERIES.into_iter().enumerate() {
        let ratio = most.seconds[k] / hundred.seconds[k];
        outcome.timing(&format!("{query}.hundred_thousand_over_hundred"), ratio)?;
        slowest = slowest.max(ratio);
    }
    if differ > 0 {
        outcome.set_verdict(Verdict::NotReproduced, format!("{differ} values differ from the plain loop"));
    } else if slowest > AIM {
        let why = format!(
            "one kind of query takes {slowest:.1} times as long among 100 000 primitives as among 100; the aim is {AIM}"
        );
        outcome.set_verdict(Verdict::Partial, why);
    }
    let statement = "A value of the quadtree's programs has the bits of the plain loop over all primitives.";
    let verdict = if differ == 0 { ClaimVerdict::Tested } else { ClaimVerdict::Refuted };
    let mut claim = Claim::new("squares-exact", statement, verdict, "compared at 200 to 2 000 points of each scene");
    if differ > 0 {
        claim = claim.witness(format!("{differ} values differ"));
    }
    outcome.claim(claim)?;
    outcome.control("another scene", "the plain loop over a scene of another seed", "most values differ", noticed);
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_keep_every_bit_and_another_scene_is_noticed() {
        let trial = Trial::new(3_000, 5, 1_000).unwrap();
        assert_eq!(trial.differing(&trial.program, 1_000), 0);
        // Of three thousand primitives few are looked at.
        assert!(trial.visits() < 12.0, "{}", trial.visits());
        let other = Trial::new(3_000, 6, 1).unwrap();
        assert!(trial.differing(&other.program, 1_000) > 500);
    }
}
