//! What an experiment found. Numbers are finite, names are used once, a value is either measured or absent with a reason, and a
//! control that passes the check it should fail spoils the verdict.

use super::files::is_file_name;
use super::{Plot, Table};
use crate::environment::{Gpu, sha256};
use std::collections::{BTreeMap, BTreeSet};
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// An outcome refused what it was given.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum OutcomeError {
    /// NaN or infinity.
    #[error("`{name}` is {value}: report it as absent, with the reason")]
    NotFinite {
        /// The metric or the cell.
        name: String,
        /// What it was.
        value: f64,
    },
    /// A name is used twice, or is measured and absent at once.
    #[error("`{0}` is reported twice")]
    Twice(String),
    /// A name that cannot be a file or a dotted metric.
    #[error("`{0}` is no name: use lower-case letters, digits, `-`, `_` and `.`")]
    Name(String),
    /// A row with too few or too many cells.
    #[error("table `{table}`, row {row}: {cells} cells for {columns} columns")]
    RowWidth {
        /// The table.
        table: String,
        /// The row, from 1.
        row: usize,
        /// Its cells.
        cells: usize,
        /// The table's columns.
        columns: usize,
    },
    /// A plot that cannot be drawn.
    #[error("plot `{name}`: {why}")]
    Plot {
        /// The plot.
        name: String,
        /// What is wrong.
        why: String,
    },
}

/// A PNG in the experiment's folder, as `Context::write_png` leaves it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PngFile {
    pub(crate) file: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// An image with what is needed to make it again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub(crate) png: PngFile,
    pub(crate) caption: String,
    pub(crate) camera: String,
    pub(crate) seed: Option<u64>,
}

impl Picture {
    /// An image and what it shows.
    pub fn new(png: PngFile, caption: &str) -> Self {
        Self { png, caption: caption.into(), camera: String::new(), seed: None }
    }

    /// Where the camera stands, in words or numbers.
    pub fn camera(mut self, camera: impl Into<String>) -> Self {
        self.camera = camera.into();
        self
    }

    /// The seed behind it.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }
}

/// A row of the ledger.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    pub(crate) id: String,
    pub(crate) statement: String,
    pub(crate) verdict: ClaimVerdict,
    pub(crate) evidence: String,
    pub(crate) margin: Option<f64>,
    pub(crate) witness: String,
    pub(crate) corrected: String,
    pub(crate) place: String,
    pub(crate) control: String,
}

impl Claim {
    /// A statement, what we say of it, and what shows it.
    pub fn new(id: &str, statement: &str, verdict: ClaimVerdict, evidence: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            statement: statement.into(),
            verdict,
            evidence: evidence.into(),
            margin: None,
            witness: String::new(),
            corrected: String::new(),
            place: String::new(),
            control: String::new(),
        }
    }

    /// How far from failing: 0 is on the edge.
    pub const fn margin(mut self, margin: f64) -> Self {
        self.margin = Some(margin);
        self
    }

    /// The numbers that refute it.
    pub fn witness(mut self, witness: impl Into<String>) -> Self {
        self.witness = witness.into();
        self
    }

    /// Where the statement stands.
    pub fn place(mut self, place: impl Into<String>) -> Self {
        self.place = place.into();
        self
    }

    /// The perturbation that its evidence turns down.
    pub fn control(mut self, control: impl Into<String>) -> Self {
        self.control = control.into();
        self
    }

    /// The statement that holds instead.
    pub fn corrected(mut self, corrected: impl Into<String>) -> Self {
        self.corrected = corrected.into();
        self
    }
}

/// Something broken on purpose, which its check must notice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Control {
    pub(crate) name: String,
    pub(crate) broken: String,
    pub(crate) expected: String,
    pub(crate) failed: bool,
}

/// Something the paper leaves open, and what we chose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deviation {
    pub(crate) open: String,
    pub(crate) chosen: String,
}

/// What an experiment found.
#[derive(Clone, Debug)]
pub struct Outcome {
    verdict: Verdict,
    pub(crate) why: String,
    pub(crate) metrics: BTreeMap<String, f64>,
    pub(crate) timings: BTreeMap<String, f64>,
    pub(crate) absent: BTreeMap<String, String>,
    pub(crate) tables: Vec<Table>,
    pub(crate) pictures: Vec<Picture>,
    pub(crate) plots: Vec<Plot>,
    pub(crate) attachments: Vec<(String, String)>,
    pub(crate) claims: Vec<Claim>,
    pub(crate) controls: Vec<Control>,
    pub(crate) deviations: Vec<Deviation>,
    pub(crate) inputs: BTreeMap<String, String>,
    pub(crate) gpu: Option<Gpu>,
    files: BTreeSet<String>,
}

impl Outcome {
    /// An outcome with a verdict and nothing else yet.
    pub fn new(verdict: Verdict) -> Self {
        Self {
            verdict,
            why: String::new(),
            metrics: BTreeMap::new(),
            timings: BTreeMap::new(),
            absent: BTreeMap::new(),
            tables: Vec::new(),
            pictures: Vec::new(),
            plots: Vec::new(),
            attachments: Vec::new(),
            claims: Vec::new(),
            controls: Vec::new(),
            deviations: Vec::new(),
            inputs: BTreeMap::new(),
            gpu: None,
            files: BTreeSet::from(["metrics.csv".to_owned()]),
        }
    }

    /// It cannot run here, and why.
    pub fn skipped(why: impl Into<String>) -> Self {
        Self { why: why.into(), ..Self::new(Verdict::Skipped) }
    }

    /// There is no code for it, and why.
    pub fn not_attempted(why: impl Into<String>) -> Self {
        Self { why: why.into(), ..Self::new(Verdict::NotAttempted) }
    }

    /// Replaces the verdict, and says why it is not better.
    pub fn set_verdict(&mut self, verdict: Verdict, why: impl Into<String>) {
        self.verdict = verdict;
        self.why = why.into();
    }

    /// The verdict: not reproduced, whatever was found, when a control passed its check.
    pub fn verdict(&self) -> Verdict {
        if self.controls.iter().all(|control| control.failed) {
            self.verdict
        } else {
            self.verdict.max(Verdict::NotReproduced)
        }
    }

    /// A number that is the same on every machine. The name is dotted and carries the unit (`_metres`, `_per_pixel`, a bare count).
    ///
    /// # Errors
    /// For NaN, infinity, a name used before or one that is absent.
    pub fn metric(&mut self, name: &str, value: f64) -> Result<(), OutcomeError> {
        self.check_metric(name, value)?;
        self.metrics.insert(name.into(), value);
        Ok(())
    }

    /// A number that depends on the machine, such as a time. It is kept out of every file that is compared byte by byte.
    ///
    /// # Errors
    /// As [`Self::metric`].
    pub fn timing(&mut self, name: &str, value: f64) -> Result<(), OutcomeError> {
        self.check_metric(name, value)?;
        self.timings.insert(name.into(), value);
        Ok(())
    }

    /// A metric that was not measured, and why.
    ///
    /// # Errors
    /// For a name that was measured or is absent already.
    pub fn absent(&mut self, name: &str, why: impl Into<String>) -> Result<(), OutcomeError> {
        self.check_metric(name, 0.0)?;
        self.absent.insert(name.into(), why.into());
        Ok(())
    }

    fn check_metric(&self, name: &str, value: f64) -> Result<(), OutcomeError> {
        if !is_file_name(name) {
            return Err(OutcomeError::Name(name.into()));
        }
        if self.metrics.contains_key(name) || self.timings.contains_key(name) || self.absent.contains_key(name) {
            return Err(OutcomeError::Twice(name.into()));
        }
        if !value.is_finite() {
            return Err(OutcomeError::NotFinite { name: name.into(), value });
        }
        Ok(())
    }

    /// A table, written as `<name>.csv`.
    ///
    /// # Errors
    /// For a name used before, a row of the wrong width, NaN or infinity.
    pub fn table(&mut self, table: Table) -> Result<(), OutcomeError> {
        table.check()?;
        self.claim_file(&table.name, "csv")?;
        self.tables.push(table);
        Ok(())
    }

    /// A plot, written as `<name>.svg` with its data in `<name>.csv`.
    ///
    /// # Errors
    /// For a name used before, and for data that cannot be drawn.
    pub fn plot(&mut self, plot: Plot) -> Result<(), OutcomeError> {
        plot.check()?;
        self.claim_file(&plot.name, "svg")?;
        self.claim_file(&plot.name, "csv")?;
        self.plots.push(plot);
        Ok(())
    }

    /// An image written before with `Context::write_png`.
    pub fn picture(&mut self, picture: Picture) {
        self.pictures.push(picture);
    }

    /// Another file written before with `Context::write`, such as an EXR, and what it holds.
    pub fn attachment(&mut self, file: &str, about: &str) {
        self.attachments.push((file.into(), about.into()));
    }

    /// A row of the ledger.
    ///
    /// # Errors
    /// For a claim reported before, or a margin that is not finite.
    pub fn claim(&mut self, claim: Claim) -> Result<(), OutcomeError> {
        if self.claims.iter().any(|other| other.id == claim.id) {
            return Err(OutcomeError::Twice(claim.id));
        }
        if let Some(value) = claim.margin.filter(|margin| !margin.is_finite()) {
            return Err(OutcomeError::NotFinite { name: format!("margin of {}", claim.id), value });
        }
        self.claims.push(claim);
        Ok(())
    }

    /// Something broken on purpose: what was broken, how the check should notice, and whether it `failed` as it should. When it did
    /// not, the check proves nothing and the experiment is not reproduced.
    pub fn control(&mut self, name: &str, broken: &str, expected: &str, failed: bool) {
        self.controls.push(Control { name: name.into(), broken: broken.into(), expected: expected.into(), failed });
    }

    /// Something the paper leaves open, and what we chose.
    pub fn deviation(&mut self, open: &str, chosen: &str) {
        self.deviations.push(Deviation { open: open.into(), chosen: chosen.into() });
    }

    /// An input the result depends on: its hash goes to the environment.
    pub fn input(&mut self, name: &str, bytes: &[u8]) {
        self.inputs.insert(name.into(), sha256(bytes));
    }

    /// The adapter that was used.
    pub fn gpu(&mut self, gpu: Gpu) {
        self.gpu = Some(gpu);
    }

    fn claim_file(&mut self, name: &str, extension: &str) -> Result<(), OutcomeError> {
        if !is_file_name(name) {
            return Err(OutcomeError::Name(name.into()));
        }
        let file = format!("{name}.{extension}");
        if self.files.insert(file.clone()) { Ok(()) } else { Err(OutcomeError::Twice(file)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_refused_by_name() {
        let mut outcome = Outcome::new(Verdict::Reproduced);
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = outcome.metric("trace.calls_per_pixel", value).unwrap_err();
            assert!(error.to_string().contains("trace.calls_per_pixel"), "{error}");
            assert!(outcome.timing("trace.seconds", value).is_err());
        }
        assert!(outcome.metrics.is_empty() && outcome.timings.is_empty());
        outcome.metric("trace.calls_per_pixel", 28.9).unwrap();
    }

    #[test]
    fn a_metric_is_measured_once_or_absent() {
        let mut outcome = Outcome::new(Verdict::Reproduced);
        outcome.metric("a", 1.0).unwrap();
        assert_eq!(outcome.absent("a", "why"), Err(OutcomeError::Twice("a".into())));
        outcome.absent("b", "why").unwrap();
        assert_eq!(outcome.metric("b", 1.0), Err(OutcomeError::Twice("b".into())));
        assert_eq!(outcome.timing("a", 1.0), Err(OutcomeError::Twice("a".into())));
    }

    #[test]
    fn a_control_that_passes_its_check_spoils_the_verdict() {
        let mut outcome = Outcome::new(Verdict::Reproduced);
        outcome.control("half the bound", "λ halved", "the tracer overshoots", true);
        assert_eq!(outcome.verdict(), Verdict::Reproduced);
        outcome.control("a comparator of a thing with itself", "x against x", "differences", false);
        assert_eq!(outcome.verdict(), Verdict::NotReproduced);
    }

    #[test]
    fn a_spoilt_control_does_not_improve_a_verdict() {
        let mut outcome = Outcome::skipped("no adapter");
        outcome.control("c", "b", "e", false);
        assert_eq!(outcome.verdict(), Verdict::Skipped);
    }

    #[test]
    fn two_files_cannot_share_a_name() {
        let mut outcome = Outcome::new(Verdict::Reproduced);
        outcome.table(Table::new("one", "")).unwrap();
        assert_eq!(outcome.table(Table::new("one", "")), Err(OutcomeError::Twice("one.csv".into())));
        assert_eq!(outcome.table(Table::new("metrics", "")), Err(OutcomeError::Twice("metrics.csv".into())));
        assert!(outcome.table(Table::new("../one", "")).is_err());
    }
}
