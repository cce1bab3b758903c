//! What is kept of a run: one record per experiment, and the files each leaves. This is the one place that decides which file goes
//! to the experiment's folder and which to `timings/`.

use super::files::{self, WriteError};
use super::{Outcome, csv, number};
use crate::environment::Environment;
use crate::experiment::{Experiment, Profile};
use std::path::Path;
use terrain_papers::verdicts::Verdict;

/// A run: where it was made and what each experiment found.
pub struct Report {
    /// Sizes.
    pub profile: Profile,
    /// The run's seed.
    pub seed: u64,
    /// Machine and revision.
    pub environment: Environment,
    /// One record per experiment, in the order they ran.
    pub records: Vec<Record>,
}

/// One experiment of a run.
pub struct Record {
    /// The experiment.
    pub experiment: &'static Experiment,
    /// What it found; empty and not reproduced when it failed.
    pub outcome: Outcome,
    /// Why it could not finish: an error or a panic.
    pub error: Option<String>,
    /// Wall time.
    pub seconds: f64,
    /// Peak resident memory, or why it is not known.
    pub peak_memory_bytes: Result<u64, String>,
    pub(crate) drawings: Vec<String>,
}

impl Record {
    /// A record of what `run` returned. Plots are drawn here, so that one that cannot be drawn is a failure of its experiment.
    pub fn new(
        experiment: &'static Experiment,
        result: Result<Outcome, String>,
        seconds: f64,
        peak_memory_bytes: Result<u64, String>,
    ) -> Self {
        let drawn = result.and_then(|outcome| {
            let drawings: Result<Vec<String>, _> = outcome.plots.iter().map(super::Plot::svg).collect();
            drawings.map(|drawings| (outcome, drawings)).map_err(|error| error.to_string())
        });
        match drawn {
            Ok((outcome, drawings)) => Self { experiment, outcome, error: None, seconds, peak_memory_bytes, drawings },
            Err(error) => Self {
                experiment,
                outcome: Outcome::new(Verdict::NotReproduced),
                error: Some(error),
                seconds,
                peak_memory_bytes,
                drawings: Vec::new(),
            },
        }
    }

    /// Its verdict; a failed experiment is not reproduced.
    pub fn verdict(&self) -> Verdict {
        self.outcome.verdict()
    }

    /// Why the verdict is not better, in words; empty when there is nothing to say.
    pub(crate) fn why(&self) -> String {
        let spoilt = self.outcome.controls.iter().filter(|control| !control.failed);
        let mut reasons: Vec<String> = self.error.iter().map(|error| format!("It did not finish: {error}")).collect();
        reasons
            .extend(spoilt.map(|control| format!("The control “{}” passed the check it should fail.", control.name)));
        if !self.outcome.why.is_empty() {
            reasons.push(self.outcome.why.clone());
        }
        reasons.join(" ")
    }

    /// The folder of a file, from the root of the report.
    pub(crate) fn folder(&self, machine: bool) -> String {
        if machine { format!("timings/{}", self.experiment.id) } else { self.experiment.id.into() }
    }

    /// Every file of the record, from the root of the report, with its bytes.
    pub(crate) fn files(&self) -> Vec<(String, String)> {
        let mut files = Vec::new();
        let mut add = |machine: bool, name: &str, text: String| {
            files.push((format!("{}/{name}", self.folder(machine)), text));
        };
        for table in &self.outcome.tables {
            let name = format!("{}.csv", table.name);
            if table.has_deterministic_part() {
                add(false, &name, table.deterministic_csv());
            }
            if table.depends_on_machine() {
                add(true, &name, table.full_csv());
            }
        }
        for (plot, drawing) in self.outcome.plots.iter().zip(&self.drawings) {
            add(plot.machine, &format!("{}.svg", plot.name), drawing.clone());
            add(plot.machine, &format!("{}.csv", plot.name), plot.csv());
        }
        if !self.outcome.metrics.is_empty() {
            let lines = self.outcome.metrics.iter().map(|(name, value)| csv::line(&[name, &number::exact(*value)]));
            add(false, "metrics.csv", std::iter::once(csv::line(&["metric", "value"])).chain(lines).collect());
        }
        files
    }

    /// Writes the tables, plots and metrics below `out`.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn write(&self, out: &Path) -> Result<(), WriteError> {
        self.files().iter().try_for_each(|(path, text)| files::write(&out.join(path), text.as_bytes()))
    }
}

impl Report {
    /// Writes `report.json` and `index.html`.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn write(&self, out: &Path) -> Result<(), WriteError> {
        let json = format!("{:#}\n", super::json(self));
        files::write(&out.join("report.json"), json.as_bytes())?;
        let page = super::page(self, sources_from(out).as_deref());
        files::write(&out.join("index.html"), page.as_bytes())
    }
}

/// How a page in `out` reaches the sources: only when it lies inside the repository, so that no machine path enters a page.
fn sources_from(out: &Path) -> Option<String> {
    let inside = out.canonicalize().ok()?;
    let depth = inside.strip_prefix(crate::environment::repository()?).ok()?.components().count();
    Some("../".repeat(depth))
}
