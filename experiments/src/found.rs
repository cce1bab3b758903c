//! What an experiment found, for another to build on: its verdict, claims and controls.

use crate::experiment::{Context, ExperimentError};
use crate::report::Outcome;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// What an experiment found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Its verdict.
    pub verdict: Verdict,
    /// Its claims and what it says of each.
    pub claims: Vec<(String, ClaimVerdict)>,
    /// Its controls and whether each failed, as it should.
    pub controls: Vec<(String, bool)>,
}

impl Found {
    /// What is in an outcome.
    pub fn of(outcome: &Outcome) -> Found {
        Found {
            verdict: outcome.verdict(),
            claims: outcome.claims.iter().map(|claim| (claim.id.clone(), claim.verdict)).collect(),
            controls: outcome.controls.iter().map(|control| (control.name.clone(), control.failed)).collect(),
        }
    }
}

/// A folder that goes when it is dropped.
pub struct Scratch(pub std::path::PathBuf);

impl Scratch {
    /// A folder of this process, for one use.
    ///
    /// # Errors
    /// When there is no place for temporary files.
    pub fn new(label: &str) -> Result<Scratch, ExperimentError> {
        let folder = std::env::temp_dir().join(format!("terrain-{}-{}", std::process::id(), label.replace('/', "-")));
        std::fs::create_dir_all(&folder).map_err(ExperimentError::failed)?;
        Ok(Scratch(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed is left to the system's temporary folder.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Context {
    /// What experiment `id` finds with this run's seed and sizes: taken from this run when it went before, else run now. An experiment is
    /// a function of its seed, so the two are the same.
    ///
    /// # Errors
    /// When there is no such experiment, or with what it returns.
    pub fn found(&self, id: &str) -> Result<Found, ExperimentError> {
        if let Some(found) = self.earlier.get(id) {
            return Ok(found.clone());
        }
        let all = crate::experiments();
        let experiment = all
            .iter()
            .find(|experiment| experiment.id == id)
            .ok_or_else(|| ExperimentError::failed(format!("no experiment `{id}`")))?;
        let scratch = Scratch::new(id)?;
        let context = Context::new(id, self.profile, self.run_seed, scratch.0.clone(), self.hardware.clone());
        Ok(Found::of(&(experiment.run)(&context)?))
    }
}
