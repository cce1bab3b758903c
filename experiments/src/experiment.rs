//! An experiment is a function from a seed to an outcome. Its context gives it the profile, seeds, progress, what other experiments find
//! and atomic writes into its own folder; nothing else may influence what it finds.
//!
//! ```
//! use terrain_experiments::experiment::{Context, ExperimentError};
//! use terrain_experiments::report::{Axis, Compared, Comparison, Outcome, Plot, Style, Tolerance};
//!
//! fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
//!     let start = std::time::Instant::now();
//!     let table1 = terrain_papers::tables::genevaux2015_table1()?;
//!     let mut compared = Comparison::new("calls", "Calls per pixel", &table1.hardware, &ctx.hardware);
//!     let progress = ctx.progress("scenes", table1.rows.len() as u64);
//!     for row in &table1.rows {
//!         let ours = 30.0; // trace the scene with rays of ctx.seed_for(&row.scene)
//!         let tolerance = Tolerance::ratio(0.5, 2.0, "the paper's camera is not published");
//!         compared.push(Compared::new(&row.scene, "per pixel", table1.calls_per_pixel(row), ours, tolerance));
//!         progress.advance(1);
//!     }
//!     let mut outcome = Outcome::new(compared.verdict());
//!     outcome.table(compared.into_table())?;
//!     outcome.metric("table1.fig1.calls_per_pixel", 30.0)?;
//!     outcome.timing("table1.run_seconds", start.elapsed().as_secs_f64())?;
//!     let plot = Plot::new("steps", "Steps along one ray", Axis::linear("t (m)"), Axis::log("step (m)"));
//!     outcome.plot(plot.series("accelerated", Style::LineAndPoints, [(0.0, 1.0), (1.0, 2.0)]))?;
//!     outcome.control("half the slope bound", "λ halved", "the tracer passes through the ground", true);
//!     outcome.deviation("the camera is not published", "one that shows the figure's valley");
//!     Ok(outcome)
//! }
//! # let out = std::env::temp_dir();
//! # run(&Context::new("a/b", terrain_experiments::experiment::Profile::Quick, 1, out, "here".into())).unwrap();
//! ```

use crate::found::Found;
use crate::report::files::{self, WriteError};
use crate::report::{Outcome, OutcomeError, PngFile};
use indicatif::{ProgressBar, ProgressStyle};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// One table, figure or claim of a paper, and the function that reproduces it.
pub struct Experiment {
    /// `paper/name`: the folder of its files and its anchor in the report.
    pub id: &'static str,
    /// What it shows, in a few words.
    pub title: &'static str,
    /// Its place in the paper.
    pub section: &'static str,
    /// One paragraph: what is measured and how.
    pub about: &'static str,
    /// Source file, from the root of the repository.
    pub code: &'static str,
    /// The test that holds it, `path/to/file.rs::test_name`.
    pub test: &'static str,
    /// What it costs, stated before it runs.
    pub expected: fn(Profile) -> Expected,
    /// Runs it.
    pub run: fn(&Context) -> Result<Outcome, ExperimentError>,
}

/// How large an experiment runs. The code is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Small sizes: minutes for everything on two cores.
    Quick,
    /// The paper's sizes.
    Full,
}

impl Profile {
    /// The word of `report.json`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Full => "full",
        }
    }

    /// One of two values, by profile.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// What an experiment is expected to cost on two cores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Wall time, seconds.
    pub seconds: f64,
    /// Peak resident memory, bytes.
    pub memory_bytes: u64,
    /// Size of the files it leaves, bytes.
    pub disk_bytes: u64,
}

/// An experiment could not finish.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The outcome refused a value.
    #[error(transparent)]
    Outcome(#[from] OutcomeError),
    /// A paper's printed table could not be read.
    #[error(transparent)]
    Table(#[from] terrain_papers::tables::TableError),
    /// Anything else, in one line.
    #[error("{0}")]
    Failed(String),
}

impl ExperimentError {
    /// Wraps any error or message: `.map_err(ExperimentError::failed)`.
    pub fn failed(error: impl fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }
}

/// What a running experiment may use.
pub struct Context {
    /// How large to run.
    pub profile: Profile,
    /// This experiment's own seed: a hash of the run's seed and the experiment's id.
    pub seed: u64,
    /// This experiment's folder. Nothing that depends on the machine is written here.
    pub out: PathBuf,
    /// This machine in one line, for the column "our hardware".
    pub hardware: String,
    pub(crate) run_seed: u64,
    /// What the experiments found that ran before this one, by id.
    pub(crate) earlier: BTreeMap<String, Found>,
}

impl Context {
    /// The context of experiment `id` in a run with `run_seed`.
    pub fn new(id: &str, profile: Profile, run_seed: u64, out: PathBuf, hardware: String) -> Self {
        Self { profile, seed: seed_of(run_seed, id), out, hardware, run_seed, earlier: BTreeMap::new() }
    }

    /// A seed for one use within the experiment ("rays", "cameras"): uses never share a sequence.
    pub fn seed_for(&self, label: &str) -> u64 {
        seed_of(self.seed, label)
    }

    /// A bar on a terminal, log lines elsewhere, over `total` steps.
    pub fn progress(&self, label: &str, total: u64) -> Progress {
        Progress::new(label, total)
    }

    /// Writes a file of the experiment's folder: to a temporary name, then renamed.
    ///
    /// # Errors
    /// When the name is not a plain file name or the disk refuses.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), WriteError> {
        files::write(&self.out.join(files::checked(name)?), bytes)
    }

    /// Lets `write` make a file under a temporary path, then renames it: for writers that take a path.
    ///
    /// # Errors
    /// When the name is not a plain file name, or with what `write` returns.
    pub fn write_with<E: fmt::Display>(
        &self,
        name: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), ExperimentError> {
        files::write_with(&self.out.join(files::checked(name)?), write)
    }

    /// Writes an 8-bit RGB image, row by row from the top, as `name.png`.
    ///
    /// # Errors
    /// When `rgb` is not `3 · width · height` long, or the disk refuses.
    pub fn write_png(&self, name: &str, width: u32, height: u32, rgb: &[u8]) -> Result<PngFile, ExperimentError> {
        let pixels = u64::from(width) * u64::from(height);
        let image =
            (rgb.len() as u64 == 3 * pixels).then(|| image::RgbImage::from_raw(width, height, rgb.to_vec())).flatten();
        let image = image.ok_or_else(|| {
            ExperimentError::failed(format!("{name}: {} bytes are no {width} × {height} RGB", rgb.len()))
        })?;
        let file = format!("{name}.png");
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).map_err(ExperimentError::failed)?;
        self.write(&file, bytes.get_ref())?;
        Ok(PngFile { file, width, height })
    }
}

/// SHA-256 of seed and label, cut to 64 bits: no structure of the labels survives.
pub(crate) fn seed_of(seed: u64, label: &str) -> u64 {
    let digest = Sha256::new().chain_update(seed.to_le_bytes()).chain_update(label.as_bytes()).finalize();
    digest.iter().take(8).fold(0, |hash, &byte| hash << 8 | u64::from(byte))
}

/// Progress over a known number of steps; it can be shared by threads.
pub struct Progress {
    bar: Option<ProgressBar>,
    label: String,
    total: u64,
    done: AtomicU64,
}

/// With more steps than this, a log gets one line per tenth.
const LOGGED_STEPS: u64 = 20;

impl Progress {
    fn new(label: &str, total: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("  {msg:28} {bar:32} {pos}/{len} {elapsed}");
            let bar = ProgressBar::new(total);
            style.map_or_else(|_| bar.clone(), |style| bar.clone().with_style(style)).with_message(label.to_owned())
        });
        Self { bar, label: label.to_owned(), total, done: AtomicU64::new(0) }
    }

    /// Counts `steps` more as done.
    pub fn advance(&self, steps: u64) {
        let before = self.done.fetch_add(steps, Ordering::Relaxed);
        match &self.bar {
            Some(bar) => bar.inc(steps),
            None => {
                let marks = self.total.clamp(1, if self.total > LOGGED_STEPS { 10 } else { LOGGED_STEPS });
                let mark = |done: u64| done.saturating_mul(marks) / self.total.max(1);
                if mark(before + steps) > mark(before) {
                    eprintln!("  {}: {} of {}", self.label, before + steps, self.total);
                }
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn context(out: &Path) -> Context {
        Context::new("paper/x", Profile::Quick, 7, out.to_owned(), "machine".into())
    }

    #[test]
    fn seeds_depend_on_the_run_the_experiment_and_the_use() {
        let seeds = [seed_of(1, "a/b"), seed_of(2, "a/b"), seed_of(1, "a/c")];
        assert!(seeds[0] != seeds[1] && seeds[0] != seeds[2]);
        assert_eq!(seeds[0], seed_of(1, "a/b"));
        let context = context(Path::new("unused"));
        assert_ne!(context.seed_for("rays"), context.seed_for("cameras"));
    }

    #[test]
    fn an_interrupted_write_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let result = context(folder.path()).write_with("half.txt", |path| {
            std::fs::write(path, "half").unwrap();
            Err("interrupted")
        });
        assert_eq!(result.unwrap_err().to_string(), "interrupted");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_name_cannot_leave_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["../x", "a/b", "", ".hidden", "Ä"] {
            assert!(context(folder.path()).write(name, b"").is_err(), "{name}");
        }
    }

    #[test]
    fn an_image_of_the_wrong_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let context = context(folder.path());
        assert!(context.write_png("a", 2, 2, &[0; 11]).is_err());
        assert!(context.write_png("a", 2, 2, &[0; 13]).is_err());
        assert!(context.write_png("a", 2, 2, &[0; 12]).is_ok());
    }
}
