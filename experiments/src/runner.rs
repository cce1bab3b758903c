//! Runs experiments one after another: each in its own folder, measured, and unable to bring the others down.

use crate::environment::Environment;
use crate::experiment::{Context, Experiment, ExperimentError, Profile, seed_of};
use crate::found::Found;
use crate::memory::PeakMemory;
use crate::report::files::{self, WriteError};
use crate::report::{Record, Report};
use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;
use terrain_papers::verdicts::Verdict;

/// One of `count` parts of the list: every `count`-th experiment from the `index`-th, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed =
            text.split_once('/').and_then(|(i, n)| Some(Self { index: i.parse().ok()?, count: n.parse().ok()? }));
        parsed
            .filter(|shard| (1..=shard.count).contains(&shard.index))
            .ok_or_else(|| format!("`{text}` is no shard: write i/n with 1 ≤ i ≤ n, as 1/4"))
    }
}

impl Shard {
    /// The experiments of this part. The parts of all indices are disjoint and leave none out.
    pub fn of<T>(self, all: Vec<T>) -> Vec<T> {
        all.into_iter().skip(self.index - 1).step_by(self.count).collect()
    }
    /// Whether part `index` of a long run, from 0, belongs to this shard.
    pub fn holds(self, index: u64) -> bool {
        index % self.count as u64 == self.index as u64 - 1
    }
}

/// How to run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Sizes.
    pub profile: Profile,
    /// The run's seed.
    pub seed: u64,
    /// Where the report goes.
    pub out: PathBuf,
}

/// Runs the experiments, writes the report and returns it.
///
/// # Errors
/// When a file cannot be written, or a folder of the report holds something that is not ours. An experiment that fails is no error:
/// its record says so.
pub fn run(experiments: &[&'static Experiment], settings: &Settings) -> Result<Report, WriteError> {
    let mut environment = Environment::gather();
    environment.seeds.insert("run".into(), settings.seed.to_string());
    let hardware = environment.hardware();
    // Every folder is looked at before anything is replaced or computed.
    for experiment in experiments {
        for folder in folders(experiment, settings) {
            files::check_ours(&folder)?;
        }
    }
    let mut records = Vec::new();
    let mut found = BTreeMap::new();
    for (i, experiment) in experiments.iter().copied().enumerate() {
        eprintln!("[{}/{}] {}: {}", i + 1, experiments.len(), experiment.id, experiment.title);
        let seed = seed_of(settings.seed, experiment.id);
        environment.seeds.insert(experiment.id.into(), format!("{seed:#018x}"));
        for folder in folders(experiment, settings) {
            files::fresh_folder(&folder)?;
        }
        let out = settings.out.join(experiment.id);
        let mut context = Context::new(experiment.id, settings.profile, settings.seed, out, hardware.clone());
        context.earlier = found.clone();
        let record = measure(experiment, &context);
        record.write(&settings.out)?;
        environment.inputs.extend(record.outcome.inputs.clone());
        if let Some(gpu) = &record.outcome.gpu {
            environment.set_gpu(gpu.clone());
        }
        if record.error.is_none() {
            found.insert(experiment.id.to_owned(), Found::of(&record.outcome));
        }
        records.push(record);
    }
    let report = Report { profile: settings.profile, seed: settings.seed, environment, records };
    report.write(&settings.out)?;
    Ok(report)
}

fn folders(experiment: &Experiment, settings: &Settings) -> [PathBuf; 2] {
    [settings.out.join(experiment.id), settings.out.join("timings").join(experiment.id)]
}

fn measure(experiment: &'static Experiment, context: &Context) -> Record {
    let peak = PeakMemory::start();
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| (experiment.run)(context)))
        .unwrap_or_else(|payload| Err(ExperimentError::Failed(format!("panic: {}", message(payload.as_ref())))));
    let seconds = start.elapsed().as_secs_f64();
    Record::new(experiment, result.map_err(|error| error.to_string()), seconds, peak.bytes())
}

fn message(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

/// What keeps a run from status 0, one line each: experiments that did not finish, and verdicts worse than the recorded ones.
pub fn regressions(report: &Report, recorded: &BTreeMap<String, Verdict>) -> Vec<String> {
    let mut lines = Vec::new();
    for record in &report.records {
        let (id, verdict) = (record.experiment.id, record.verdict());
        if let Some(error) = &record.error {
            lines.push(format!("{id} did not finish: {error}"));
        } else if let Some(&before) = recorded.get(id).filter(|&&before| verdict.is_worse_than(before)) {
            let why = record.why();
            let colon = if why.is_empty() { "" } else { ": " };
            lines.push(format!("{id} is {verdict}, recorded as {before}{colon}{why}"));
        }
    }
    lines
}
