//! First hits of rays over a carved terrain: the tracers against proof, and what they cost.

use super::scenes;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::genevaux2015::record::{BLOCK, Block, Counter, Record, Recorded};
use crate::report::{Cell, Outcome, Table};
use glam::DVec3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use terrain_amplify::field::Density;
use terrain_amplify::implicit::ray::{Certified, DensityRay, SETTINGS, Traceable, Tracer};
use terrain_amplify::implicit::volume::Volume;
use terrain_model::trace::{Answer, Ray, RayFunction, segment, sphere};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/tracing",
    title: "Rays through carved terrain",
    section: "§3.2",
    about: "The paper names direct ray tracing as the other way to see its terrain. Rays from above over a heightfield carved by \
            10,000 point primitives, some steep, some grazing: sphere tracing with one tight global bound, tracing with the bound \
            of a box around the candidate segment, and segment tracing (Galin 2020) with f′ enclosed along it, each against first \
            hits that enclosures along the ray prove without any slope bound.",
    code: "experiments/src/paris2019/tracing.rs",
    test: "amplify/src/implicit/ray.rs::every_tracer_meets_the_surface_first_where_values_do",
    expected: |profile| Expected { seconds: profile.pick(4.0, 200.0), memory_bytes: 128 << 20, disk_bytes: 16 << 10 },
    run,
};

const PRIMITIVES: usize = 10_000;
/// Metres between the ends of a proved hit.
const BRACKET: f64 = 1e-3;

/// The `k`-th ray: from 40 to 60 m above the waves' mean towards a point near them, up to 300 m away.
fn ray(seed: u32, side: f64, k: u32) -> Ray {
    let random = |j: u32| scenes::uniform(seed, 6 * k + j);
    let origin = DVec3::new(random(0) * side, random(1) * side, 40.0 + 20.0 * random(2));
    let away = 300.0 * (random(3) - 0.5);
    let across = 300.0 * (random(4) - 0.5);
    let target = DVec3::new(origin.x + away, origin.y + across, 10.0 * random(5) - 5.0);
    Ray { origin, direction: (target - origin).normalize() }
}

/// What one tracer did over all rays.
#[derive(Clone, Copy, Default)]
struct Tally {
    steps: u64,
    missed: u64,
    early: u64,
    gave_up: u64,
}

impl Tally {
    fn plus(self, other: Tally) -> Tally {
        Tally {
            steps: self.steps + other.steps,
            missed: self.missed + other.missed,
            early: self.early + other.early,
            gave_up: self.gave_up + other.gave_up,
        }
    }
    fn of(answer: Answer, truth: Certified, steps: u64) -> Tally {
        let gave_up = u64::from(matches!(answer, Answer::GaveUp { .. }));
        let (missed, early) = match truth {
            Certified::Hit { t0, t1 } => (
                answer.distance().is_none_or(|t| t > t1 + 1e-9),
                answer.distance().is_some_and(|t| t < t0 - SETTINGS.bracket),
            ),
            Certified::Miss => (false, answer.distance().is_some()),
            Certified::Inside | Certified::Undecided { .. } => (false, false),
        };
        Tally { steps, missed: u64::from(missed), early: u64::from(early), gave_up }
    }
}

/// The terrain of this experiment, whose rays are recorded in blocks by `reproduce rays carved`.
#[derive(Debug)]
pub struct Carved {
    volume: Volume,
    seed: u32,
}

impl Carved {
    /// The terrain of a seed.
    ///
    /// # Errors
    /// A terrain that cannot be made.
    pub fn new(seed: u64) -> Result<Carved, ExperimentError> {
        let seed = seed as u32;
        Ok(Carved { volume: scenes::scattered(PRIMITIVES, seed)?, seed })
    }
}

impl Recorded for Carved {
    fn name(&self) -> &str {
        "carved"
    }
    fn record(&self) -> &str {
        include_str!("../../records/carved.csv")
    }
    /// Of the field at a thousand points, the rays' settings and the seed: the first 16 digits of a SHA-256.
    fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(format!("{} {PRIMITIVES} {BRACKET} {SETTINGS:?}", self.seed));
        for p in scenes::near_surface(1_000, scenes::side(PRIMITIVES), self.seed ^ 3) {
            hash.update(self.volume.value(p).to_bits().to_le_bytes());
        }
        hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
    }
    fn count(
        &self,
        _: u64,
        body: &mut dyn FnMut(&Counter<'_>) -> Result<(), ExperimentError>,
    ) -> Result<(), ExperimentError> {
        let surface = Traceable::new(&self.volume);
        let side = scenes::side(PRIMITIVES);
        body(&|index| {
            let rays = (index * BLOCK) as u32..((index + 1) * BLOCK) as u32;
            let each = rays.into_par_iter().map(|k| {
                let ray = ray(self.seed ^ 2, side, k);
                let truth = DensityRay::new(&surface, ray).certify(BRACKET);
                let wrong = Tracer::ALL.map(|tracer| {
                    let mut ray = DensityRay::new(&surface, ray);
                    let tally = Tally::of(tracer.trace(&mut ray, &SETTINGS), truth, 0);
                    [tally.missed, tally.early, tally.gave_up]
                });
                let hit = u64::from(matches!(truth, Certified::Hit { .. }));
                let open = u64::from(matches!(truth, Certified::Undecided { .. }));
                // A volume has no walls that end its domain.
                Block { truth: [hit, 0, open], wrong }
            });
            each.reduce(Block::none, |a, b| a.plus(&b))
        })
    }
}

/// What long runs have counted of rays over such a terrain, of the record's own seed.
fn recorded(outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let text = include_str!("../../records/carved.csv");
    if text.is_empty() {
        return Ok(outcome.absent("recorded_rays", "no long run is recorded")?);
    }
    let record = Record::read(text).map_err(ExperimentError::failed)?;
    if !record.is_of(&Carved::new(record.seed())?) {
        return Ok(outcome.absent("recorded_rays", "the terrain has changed since its rays were recorded")?);
    }
    let Block { truth: [hits, _, undecided], wrong } = record.total();
    outcome.metric("recorded_rays", record.rays() as f64)?;
    outcome.metric("recorded_proved_hits", hits as f64)?;
    outcome.metric("recorded_undecided", undecided as f64)?;
    for (tracer, [missed, early, gave_up]) in Tracer::ALL.into_iter().zip(wrong) {
        let name = tracer.name();
        outcome.metric(&format!("{name}.recorded_missed_hits"), missed as f64)?;
        if missed + early + gave_up > 0 {
            let why = format!("{name}, recorded: {missed} missed, {early} early, {gave_up} gave up");
            outcome.set_verdict(Verdict::NotReproduced, why);
        }
    }
    Ok(())
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let rays = ctx.profile.pick(20_000u32, 1_000_000);
    let seed = ctx.seed as u32;
    let terrain = scenes::scattered(PRIMITIVES, seed)?;
    let surface = Traceable::new(&terrain);
    let side = scenes::side(PRIMITIVES);
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let progress = ctx.progress("rays", u64::from(rays));
    // Per ray: proved hits, undecided, the proof's evaluations; a tally for each tracer, and one for the control.
    let each = |k: u32| {
        let ray = ray(seed ^ 2, side, k);
        let mut proof = DensityRay::new(&surface, ray);
        let truth = proof.certify(BRACKET);
        let tallies = Tracer::ALL.map(|tracer| {
            let mut ray = DensityRay::new(&surface, ray);
            Tally::of(tracer.trace(&mut ray, &SETTINGS), truth, ray.evaluations())
        });
        let mut wrong = DensityRay::new(&surface, ray);
        let answer = sphere::trace(&mut wrong, surface.slope() * 0.1, 0.0, &SETTINGS);
        let wrong = Tally::of(answer, truth, wrong.evaluations());
        progress.advance(1);
        let hit = u64::from(matches!(truth, Certified::Hit { .. }));
        let undecided = u64::from(matches!(truth, Certified::Undecided { .. }));
        ([hit, undecided, proof.evaluations()], [tallies[0], tallies[1], tallies[2], wrong])
    };
    let none = || ([0u64; 3], [Tally::default(); 4]);
    let (counts, tallies) = (0..rays)
        .into_par_iter()
        .map(each)
        .reduce(none, |a, b| (std::array::from_fn(|k| a.0[k] + b.0[k]), std::array::from_fn(|k| a.1[k].plus(b.1[k]))));
    let [hits, undecided, evaluations] = counts;
    let n = f64::from(rays);
    let mut table = Table::new("tracers", "First hits over 10,000 primitives, against proof")
        .column("tracer")
        .column("evaluations a ray")
        .column("missed first hits")
        .column("hits where there is air");
    for (tracer, tally) in Tracer::ALL.into_iter().zip(tallies) {
        let name = tracer.name();
        outcome.metric(&format!("{name}.steps_per_ray"), tally.steps as f64 / n)?;
        outcome.metric(&format!("{name}.missed_hits"), tally.missed as f64)?;
        outcome.metric(&format!("{name}.early_hits"), tally.early as f64)?;
        table.row([
            Cell::from(name),
            Cell::number(tally.steps as f64 / n, "", 4),
            Cell::count(tally.missed),
            Cell::count(tally.early),
        ]);
        if tally.missed + tally.early + tally.gave_up > 0 {
            let why = format!("{name}: {} missed, {} early, {} gave up", tally.missed, tally.early, tally.gave_up);
            outcome.set_verdict(Verdict::NotReproduced, why);
        }
    }
    table.row([
        Cell::from("certified"),
        Cell::number(evaluations as f64 / n, "", 4),
        Cell::from("proved"),
        Cell::count(undecided),
    ]);
    outcome.table(table)?;
    outcome.metric("rays", n)?;
    outcome.metric("proved_hits", hits as f64)?;
    outcome.metric("undecided_rays", undecided as f64)?;
    outcome.metric("global_slope_per_metre", surface.slope())?;
    recorded(&mut outcome)?;
    outcome.deviation("the paper publishes no figures of tracing", "first hits are held against proof instead");
    outcome.control(
        "a tenth of the slope bound",
        "λ divided by 10 under the sphere tracer",
        "first hits are missed",
        tallies[3].missed > 0,
    );
    // The control of the proof itself: a tracer of another terrain's rays cannot agree with it.
    let ray0 = ray(seed ^ 2, side, 0);
    let down = Ray { origin: ray0.origin, direction: -DVec3::Z };
    let answer = segment::trace(&mut DensityRay::new(&surface, down), &SETTINGS);
    let shifted = answer.distance().map_or(0.0, |t| t + 0.05);
    let truth = DensityRay::new(&surface, down).certify(BRACKET);
    outcome.control(
        "a hit 5 cm too deep",
        "the distance of a vertical ray's hit, 5 cm added",
        "it counts as missed",
        Tally::of(Answer::Hit { t: shifted }, truth, 0).missed == 1,
    );
    Ok(outcome)
}
