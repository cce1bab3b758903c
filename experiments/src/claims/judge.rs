//! Judges the rows of the ledger by running what they name.

use super::coq::Checked;
use crate::experiment::{Context, ExperimentError};
use crate::found::Found;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use terrain_papers::ledger::{self, Evidence, Row, Run};
use terrain_papers::proofs::{PROOFS, theorems};
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// What became of one piece of evidence.
#[derive(Clone, Debug)]
pub struct Item {
    /// What was asked.
    pub evidence: Evidence,
    /// Does it show what it is cited for? `None` where it could not be run here.
    pub stands: Option<bool>,
    /// In one line; the same on every machine, but for proofs.
    pub line: String,
    /// Boxes looked at.
    pub boxes: u64,
}

/// A row, judged.
pub struct Judged {
    /// The row.
    pub row: Row,
    /// What follows from the evidence as it came out.
    pub fresh: ClaimVerdict,
    /// Its evidence.
    pub items: Vec<Item>,
    /// That of its correction.
    pub corrected: Vec<Item>,
    /// Its control, which must say that it failed.
    pub control: Option<Item>,
}

impl Judged {
    /// Is the recorded verdict the fresh one?
    pub fn agrees(&self) -> bool {
        self.fresh == self.row.claim.verdict
    }
    /// Does the row stand: its recorded verdict is the fresh one, and unless it is open, evidence and control are as they should be?
    pub fn stands(&self) -> bool {
        self.agrees() && (self.is_open() || (self.has_evidence() && self.controlled()))
    }
    /// Is nothing claimed of it?
    pub fn is_open(&self) -> bool {
        self.row.claim.verdict == ClaimVerdict::Open
    }
    /// Was something that shows it run here, and its correction not turned down?
    pub fn has_evidence(&self) -> bool {
        let stands = |item: &Item| item.stands != Some(false);
        !self.items.is_empty() && self.items.iter().all(stands) && self.corrected.iter().all(stands)
    }
    /// Did its control fail, as it should?
    pub fn controlled(&self) -> bool {
        self.control.as_ref().is_some_and(|control| control.stands != Some(false))
    }
}

/// What the evidence is looked up in.
pub struct Sources<'a> {
    /// Results of `coqc`, by file.
    pub proofs: &'a BTreeMap<&'static str, Checked>,
    /// What experiments found, by id.
    pub experiments: &'a BTreeMap<String, Found>,
    /// The root of the repository, where there is one.
    pub root: Option<&'a Path>,
}

/// The experiments that rows name, run or taken from this run.
///
/// # Errors
/// When one of them does not exist or does not finish.
pub fn experiments(ctx: &Context, rows: &[Row]) -> Result<BTreeMap<String, Found>, ExperimentError> {
    let named = rows
        .iter()
        .flat_map(|row| row.evidence().into_iter().chain(row.corrected_evidence()).chain(&row.claim.control));
    let ids: BTreeSet<&String> = named
        .filter_map(|evidence| if let Evidence::Experiment { id, .. } = evidence { Some(id) } else { None })
        .collect();
    ids.into_iter().map(|id| Ok((id.clone(), ctx.found(id)?))).collect()
}

/// Judges the rows; certificates run in parallel.
pub fn judge(rows: Vec<Row>, sources: &Sources<'_>) -> Vec<Judged> {
    rows.into_par_iter().map(|row| one(row, sources)).collect()
}

fn one(row: Row, sources: &Sources<'_>) -> Judged {
    // A certificate answers for itself and for its control: each is run once.
    let mut runs: BTreeMap<String, Result<Run, String>> = BTreeMap::new();
    let mut run = |id: &str| {
        let entry = runs.entry(id.to_owned());
        entry.or_insert_with(|| ledger::run(&row, id).map_err(|error| error.to_string())).clone()
    };
    let mut ask = |evidence: &Evidence| {
        let (stands, line, boxes) = match evidence {
            Evidence::Certificate(id) => match run(id) {
                Ok(run) => (Some(run.stands), run.line, run.boxes),
                Err(why) => (Some(false), why, 0),
            },
            other => {
                let (stands, line) = look_up(&row, other, sources);
                (stands, line, 0)
            }
        };
        Item { evidence: evidence.clone(), stands, line, boxes }
    };
    let items: Vec<Item> = row.evidence().into_iter().map(&mut ask).collect();
    let corrected: Vec<Item> = row.corrected_evidence().into_iter().map(&mut ask).collect();
    let control = row.claim.control.as_ref().map(|evidence| match evidence {
        Evidence::Certificate(id) => {
            let (stands, line) = match run(id) {
                Ok(run) => (Some(run.control_failed), run.control_line),
                Err(why) => (Some(false), why),
            };
            Item { evidence: evidence.clone(), stands, line, boxes: 0 }
        }
        other => {
            let (stands, line) = look_up(&row, other, sources);
            Item { evidence: other.clone(), stands, line, boxes: 0 }
        }
    });
    let fresh = fresh(&row, &items, sources);
    Judged { row, fresh, items, corrected, control }
}

/// The verdict that follows from the evidence as it came out: the lists of the row, less what fell.
fn fresh(row: &Row, items: &[Item], sources: &Sources<'_>) -> ClaimVerdict {
    if items.iter().any(|item| item.stands == Some(false)) {
        return ClaimVerdict::Open;
    }
    for evidence in &row.claim.measured_by {
        let Evidence::Experiment { id, .. } = evidence else { continue };
        return match sources.experiments.get(id).map(|found| found.verdict) {
            Some(Verdict::Reproduced) => ClaimVerdict::Reproduced,
            Some(Verdict::NotReproduced | Verdict::Partial) => ClaimVerdict::NotReproduced,
            _ => ClaimVerdict::Open,
        };
    }
    row.follows()
}

fn look_up(row: &Row, evidence: &Evidence, sources: &Sources<'_>) -> (Option<bool>, String) {
    match evidence {
        Evidence::Certificate(_) => (Some(false), "a certificate is run, not looked up".to_owned()),
        Evidence::Coq { file, lemma } => {
            let stated =
                PROOFS.iter().any(|(path, text)| path == file && theorems(text).iter().any(|name| name == lemma));
            if !stated {
                return (Some(false), "no such lemma".to_owned());
            }
            match sources.proofs.get(file.as_str()) {
                Some(checked @ Checked::Checked) => (Some(true), checked.word()),
                Some(checked @ Checked::Failed(_)) => (Some(false), checked.word()),
                Some(Checked::Skipped) | None => (None, Checked::Skipped.word()),
            }
        }
        Evidence::Test { file, name } => {
            let Some(root) = sources.root else { return (None, "no sources here".to_owned()) };
            let text = std::fs::read_to_string(root.join(file)).unwrap_or_default();
            if text.contains(&format!("fn {name}(")) {
                (Some(true), "run by cargo test".to_owned())
            } else {
                (Some(false), "no such test".to_owned())
            }
        }
        Evidence::Experiment { id, claim } => {
            let Some(found) = sources.experiments.get(id) else { return (Some(false), "it did not run".to_owned()) };
            in_experiment(row.claim.verdict, found, claim)
        }
    }
}

/// A claim, a control or the verdict of an experiment. A claim that is refuted there must be refuted here; one that is tested there may be
/// proved here, by more.
fn in_experiment(verdict: ClaimVerdict, found: &Found, claim: &str) -> (Option<bool>, String) {
    if let Some(control) = claim.strip_prefix("control: ") {
        let failed = found.controls.iter().find(|(name, _)| name == control).map(|(_, failed)| *failed);
        return match failed {
            Some(true) => (Some(true), "the control was caught".to_owned()),
            Some(false) => (Some(false), "the control was missed".to_owned()),
            None => (Some(false), "no such control".to_owned()),
        };
    }
    if claim == "verdict" {
        return (Some(found.verdict <= Verdict::Partial), found.verdict.word().to_owned());
    }
    let Some((_, there)) = found.claims.iter().find(|(id, _)| id == claim) else {
        return (Some(false), "no such claim".to_owned());
    };
    let refuted = |verdict: ClaimVerdict| verdict == ClaimVerdict::Refuted;
    let open = matches!(there, ClaimVerdict::Open | ClaimVerdict::NotReproduced);
    (Some(refuted(*there) == refuted(verdict) && !open), format!("{there} there"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(id: &str) -> Vec<Row> {
        ledger::rows().unwrap().into_iter().filter(|row| row.name() == id).collect()
    }

    fn judged(rows: Vec<Row>, verdict: ClaimVerdict) -> Judged {
        let proofs = BTreeMap::from([("genevaux2015/proofs/Wyvill.v", Checked::Checked)]);
        let found = Found {
            verdict: Verdict::Reproduced,
            claims: vec![("G28".to_owned(), verdict), ("G29".to_owned(), verdict)],
            controls: Vec::new(),
        };
        let experiments = BTreeMap::from([("genevaux2015/wyvill-falloff".to_owned(), found)]);
        judge(rows, &Sources { proofs: &proofs, experiments: &experiments, root: None }).remove(0)
    }

    #[test]
    fn a_row_is_judged_by_what_its_evidence_says_now() {
        let right = judged(rows("genevaux2015/G28"), ClaimVerdict::Refuted);
        assert!(right.agrees() && right.has_evidence() && right.controlled());
        // An experiment that finds otherwise opens the row.
        let other = judged(rows("genevaux2015/G28"), ClaimVerdict::Tested);
        assert!(!other.agrees() && other.fresh == ClaimVerdict::Open && !other.has_evidence());
        // A witness that convicts no one does too.
        let mut moved = rows("genevaux2015/G28");
        moved[0].claim.witness.insert("x".to_owned(), 0.5);
        assert!(!judged(moved, ClaimVerdict::Refuted).agrees());
    }

    #[test]
    fn a_proof_that_fails_or_is_skipped_is_told_apart() {
        let of = |checked: Checked| {
            let proofs = BTreeMap::from([("genevaux2015/proofs/Wyvill.v", checked)]);
            let sources = Sources { proofs: &proofs, experiments: &BTreeMap::new(), root: None };
            judge(rows("genevaux2015/R1"), &sources).remove(0)
        };
        assert!(of(Checked::Checked).agrees());
        assert!(of(Checked::Skipped).agrees() && of(Checked::Skipped).items[0].stands.is_none());
        assert!(!of(Checked::Failed("why".to_owned())).agrees());
    }
}
