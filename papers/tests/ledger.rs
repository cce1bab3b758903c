//! Every row stands: its files and lemmas exist, its certificates run to its verdict, and its control fails.

use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use terrain_papers::certificates::{self, Kind};
use terrain_papers::ledger::{Evidence, Row, rows, run};
use terrain_papers::proofs::{PROOFS, theorems};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Everything a row names.
fn named(row: &Row) -> Vec<Evidence> {
    let mut all: Vec<Evidence> = row.evidence().into_iter().chain(row.corrected_evidence()).cloned().collect();
    all.extend(row.claim.control.clone());
    all
}

/// What is wrong with a piece of evidence that can be seen without running it.
fn missing(evidence: &Evidence) -> Option<String> {
    let there = match evidence {
        Evidence::Certificate(id) => certificates::find(id).is_some(),
        Evidence::Coq { file, lemma } => {
            PROOFS.iter().any(|(path, text)| path == file && theorems(text).iter().any(|name| name == lemma))
        }
        Evidence::Test { file, name } => {
            let text = std::fs::read_to_string(root().join(file)).unwrap_or_default();
            text.find(&format!("fn {name}(")).is_some_and(|at| {
                // Its attribute stands just before it, and does not switch it off.
                let before = &text[..at];
                let attributes = &before[before.rfind("\n\n").unwrap_or(0)..];
                attributes.contains("#[test]") && !attributes.contains("#[ignore")
            })
        }
        // The experiments are another crate's: its ledger experiment looks these up and compares.
        Evidence::Experiment { .. } => true,
    };
    (!there).then(|| format!("{evidence} does not exist"))
}

#[test]
fn what_a_row_names_exists() {
    let wrong: Vec<String> = rows()
        .unwrap()
        .iter()
        .flat_map(|row| {
            named(row).iter().filter_map(missing).map(|what| format!("{}: {what}", row.name())).collect::<Vec<_>>()
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn what_does_not_exist_is_noticed() {
    for text in ["certificate nothing", "coq genevaux2015/proofs/Blend.v nothing", "test model/src/falloff.rs::nothing"]
    {
        assert!(missing(&Evidence::try_from(text.to_owned()).unwrap()).is_some(), "{text}");
    }
}

#[test]
fn witnesses_convict_and_the_corrected_statement_is_not_convicted() {
    let rows = rows().unwrap();
    let wrong: Vec<String> = rows
        .par_iter()
        .flat_map_iter(|row| {
            let ids =
                named(row).into_iter().filter_map(|e| if let Evidence::Certificate(id) = e { Some(id) } else { None });
            let witnesses: BTreeSet<String> =
                ids.filter(|id| certificates::find(id).is_some_and(|c| matches!(c.kind, Kind::Witness(_)))).collect();
            witnesses
                .into_iter()
                .filter_map(|id| match run(row, &id) {
                    Ok(run) if run.stands && run.control_failed => None,
                    Ok(run) => Some(format!("{}: {id}: {} | {}", row.name(), run.line, run.control_line)),
                    Err(error) => Some(error.to_string()),
                })
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn verdicts_follow_from_evidence() {
    for row in rows().unwrap() {
        assert_eq!(row.claim.verdict, row.follows(), "{}", row.name());
    }
}

#[test]
fn every_row_has_a_control_unless_it_is_open() {
    for row in rows().unwrap() {
        let open = row.claim.verdict == terrain_papers::verdicts::ClaimVerdict::Open;
        assert!(open || row.claim.control.is_some(), "{}", row.name());
    }
}

#[test]
fn every_certificate_serves_a_row() {
    let named: BTreeSet<String> = rows()
        .unwrap()
        .iter()
        .flat_map(named)
        .filter_map(|evidence| if let Evidence::Certificate(id) = evidence { Some(id) } else { None })
        .collect();
    let unused: Vec<&str> = certificates::all().map(|c| c.id).filter(|id| !named.contains(*id)).collect();
    assert!(unused.is_empty(), "{unused:?}");
}
