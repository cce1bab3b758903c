//! Runs `coqc` on the proofs of the papers, in a folder of their own, and reads what their theorems rest on.

use crate::experiment::ExperimentError;
use crate::found::Scratch;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use terrain_papers::proofs::{PROOFS, forbidden, holes, question, theorems};

/// What became of one file of proofs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Checked {
    /// Every theorem is proved from the axioms of the reals.
    Checked,
    /// Not, and why.
    Failed(String),
    /// There is no `coqc` here.
    Skipped,
}

impl Checked {
    /// The word of reports.
    pub fn word(&self) -> String {
        match self {
            Self::Checked => "checked".to_owned(),
            Self::Failed(why) => format!("failed: {why}"),
            Self::Skipped => "skipped (coqc not installed)".to_owned(),
        }
    }
}

/// Checks one text as `name`.v in `folder`.
fn check(folder: &Path, name: &str, text: &str) -> Checked {
    let failed = |why: String| Checked::Failed(why);
    let found = holes(text);
    if !found.is_empty() {
        return failed(format!("it says {}", found.join(", ")));
    }
    let path = folder.join(format!("{name}.v"));
    if let Err(error) = std::fs::write(&path, question(text)) {
        return failed(error.to_string());
    }
    let output = match Command::new("coqc").args(["-q", "-w", "none"]).arg(&path).current_dir(folder).output() {
        Ok(output) => output,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Checked::Skipped,
        Err(error) => return failed(error.to_string()),
    };
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).lines().collect::<Vec<_>>().join(" ");
        return failed(said.replace(&folder.display().to_string(), ""));
    }
    match forbidden(&String::from_utf8_lossy(&output.stdout)) {
        Ok(names) if names.is_empty() => Checked::Checked,
        Ok(names) => failed(format!("it rests on {}", names.join(", "))),
        Err(why) => failed(why),
    }
}

/// Checks every file, by its path below `papers/`.
///
/// # Errors
/// When there is no place for temporary files.
pub fn check_all() -> Result<BTreeMap<&'static str, Checked>, ExperimentError> {
    let folder = Scratch::new("proofs")?;
    Ok(PROOFS
        .par_iter()
        .enumerate()
        .map(|(k, (path, text))| {
            let name = path.rsplit('/').next().unwrap_or(path).trim_end_matches(".v");
            (*path, check(&folder.0, &format!("P{k}_{name}"), text))
        })
        .collect())
}

/// How many theorems the files state.
pub fn stated() -> usize {
    PROOFS.iter().map(|(_, text)| theorems(text).len()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_statement_a_hole_and_an_axiom_are_turned_down() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str, text: &str| check(folder.path(), name, text);
        let right = of("Right", "Lemma a : 1 = 1. Proof. reflexivity. Qed.\nLemma b : 2 = 2. Proof. reflexivity. Qed.");
        if right == Checked::Skipped {
            println!("skipped: coqc is not installed");
            return;
        }
        assert_eq!(right, Checked::Checked);
        let wrong = of("Wrong", "Lemma a : 1 = 2. Proof. reflexivity. Qed.\nLemma b : 2 = 2. Proof. reflexivity. Qed.");
        assert!(matches!(wrong, Checked::Failed(_)), "{wrong:?}");
        assert!(matches!(of("Hole", "Lemma a : 1 = 2. Proof. Admitted."), Checked::Failed(_)));
        // `Variable` outside a section is an axiom by another name.
        let free = of(
            "Free",
            "Variable lunch : 1 = 2. Lemma a : 1 = 2. Proof. exact lunch. Qed. Lemma b : 1 = 1. Proof. reflexivity. Qed.",
        );
        assert!(matches!(&free, Checked::Failed(why) if why.contains("lunch")), "{free:?}");
    }
}
