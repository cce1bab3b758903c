//! The ledger as an experiment: every row of every paper is judged by running what it names, violations are hunted, proofs are checked.

pub mod coq;
mod coverage;
pub mod judge;
pub mod plot;

use crate::environment::repository;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Claim, Outcome, Table};
use coq::Checked;
use judge::{Item, Judged, Sources, experiments, judge};
use rayon::prelude::*;
use std::time::Instant;
use terrain_papers::certificates::{self, Kind, Prey, hunt};
use terrain_papers::ledger::rows;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// This experiment, which belongs to no paper.
pub const EXPERIMENTS: &[&Experiment] = &[&EXPERIMENT];

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "ledger/claims",
    title: "The ledger",
    section: "all four papers",
    about: "Every statement that can be checked, with its verdict and what shows it. Certificates are run here: branch and bound over \
            intervals on the library's own formulas, and witnesses that interval arithmetic convicts; each has a control, a perturbed \
            formula that must fail. Proofs are checked by Coq where it is installed. What other experiments say of a statement must \
            agree. Violations of each refuted statement are hunted from nothing: random points, gradient ascent, intervals.",
    code: "experiments/src/claims/mod.rs",
    test: "papers/tests/ledger.rs::verdicts_follow_from_evidence",
    expected: |_| Expected { seconds: 40.0, memory_bytes: 256 << 20, disk_bytes: 1 << 20 },
    run,
};

/// Everything that is known of the ledger in one run.
pub struct Whole {
    /// The rows.
    pub judged: Vec<Judged>,
    /// What `coqc` said of each file.
    pub proofs: std::collections::BTreeMap<&'static str, Checked>,
}

/// Judges the rows that `chosen` picks.
///
/// # Errors
/// When the ledger cannot be read, or an experiment it names does not finish.
pub fn whole(ctx: &Context, chosen: impl Fn(&terrain_papers::ledger::Row) -> bool) -> Result<Whole, ExperimentError> {
    let rows: Vec<_> = rows().map_err(ExperimentError::failed)?.into_iter().filter(chosen).collect();
    let found = experiments(ctx, &rows)?;
    let proofs = coq::check_all()?;
    let root = repository();
    let sources = Sources { proofs: &proofs, experiments: &found, root: root.as_deref() };
    let judged = judge(rows, &sources);
    Ok(Whole { judged, proofs })
}

/// Every witness certificate that a row names, hunted; by its id.
pub fn hunted(judged: &[Judged], seed: u32) -> Vec<(String, String, Option<Prey>)> {
    let named: Vec<(String, &'static certificates::Certificate)> = judged
        .iter()
        .flat_map(|judged| judged.items.iter().map(move |item| (judged.row.name(), &item.evidence)))
        .filter_map(|(row, evidence)| match evidence {
            terrain_papers::ledger::Evidence::Certificate(id) => Some((row, certificates::find(id)?)),
            _ => None,
        })
        .collect();
    named
        .into_par_iter()
        .filter_map(|(row, certificate)| match certificate.kind {
            Kind::Witness(violation) => Some((row, certificate.id.to_owned(), hunt(violation, seed))),
            Kind::Proof(_) => None,
        })
        .collect()
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let start = Instant::now();
    let progress = ctx.progress("ledger", 2);
    let Whole { judged, proofs } = whole(ctx, |_| true)?;
    progress.advance(1);
    let hunts = hunted(&judged, ctx.seed_for("hunt") as u32);
    progress.advance(1);
    drop(progress);

    let fallen: Vec<String> = judged.iter().filter(|judged| !judged.stands()).map(|judged| judged.row.name()).collect();
    let failed = proofs.values().filter(|checked| matches!(checked, Checked::Failed(_))).count();
    let right = fallen.is_empty() && failed == 0;
    let mut outcome = Outcome::new(if right { Verdict::Reproduced } else { Verdict::NotReproduced });
    if !right {
        outcome.set_verdict(Verdict::NotReproduced, format!("rows or proofs that do not stand: {}", fallen.join(", ")));
    }
    outcome.table(by_paper(&judged))?;
    outcome.table(proof_table(&proofs))?;
    outcome.table(hunt_table(&hunts))?;
    outcome.table(certificate_table(&judged))?;
    for (judged, id) in judged.iter().flat_map(|judged| plot::ids(judged).map(move |id| (judged, id))).take(PLOTS) {
        if let Some(plot) = plot::of(judged, &id) {
            outcome.plot(plot)?;
        }
    }
    let count = |verdict: ClaimVerdict| judged.iter().filter(|judged| judged.fresh == verdict).count() as f64;
    outcome.metric("rows", judged.len() as f64)?;
    for verdict in VERDICTS {
        outcome.metric(&verdict.word().replace(' ', "_"), count(verdict))?;
    }
    let without = judged.iter().filter(|judged| !judged.is_open() && !judged.has_evidence()).count();
    outcome.metric("without_evidence", without as f64)?;
    let uncontrolled = judged.iter().filter(|judged| !judged.is_open() && !judged.controlled()).count();
    outcome.metric("rows_without_control", uncontrolled as f64)?;
    let blend = hunts.iter().find(|(_, id, _)| id == "blend-printed").and_then(|(_, _, prey)| prey.as_ref());
    outcome.metric("hunt.blend_ratio", blend.map_or(0.0, |prey| prey.proved))?;
    let caught = hunts.iter().filter(|(_, _, prey)| prey.as_ref().is_some_and(|prey| prey.proved > 1.0)).count();
    outcome.metric("hunt.statements", hunts.len() as f64)?;
    outcome.metric("hunt.violated", caught as f64)?;
    outcome.metric("coq.theorems", coq::stated() as f64)?;
    outcome.timing("coq.failed", failed as f64)?;
    let checked = proofs.values().filter(|checked| **checked == Checked::Checked).count();
    outcome.timing("coq.files_checked", checked as f64)?;
    match repository().map(|root| coverage::coverage(&root)) {
        Some(Ok(coverage)) => {
            outcome.metric("bounds", coverage.functions as f64)?;
            outcome.metric("bounds_without_certificate", coverage.without.len() as f64)?;
            outcome.metric("certified_functions_unknown", coverage.unknown.len() as f64)?;
        }
        _ => outcome.absent("bounds_without_certificate", "the sources are not here")?,
    }
    outcome.metric("certificates", certificates::all().count() as f64)?;
    outcome.timing("run_seconds", start.elapsed().as_secs_f64())?;
    controls(&mut outcome, &judged, blend)?;
    for judged in &judged {
        outcome.claim(claim(judged))?;
    }
    Ok(outcome)
}

/// Plots in the report; `reproduce claims --id` draws any.
const PLOTS: usize = 6;

const VERDICTS: [ClaimVerdict; 6] = [
    ClaimVerdict::Proved,
    ClaimVerdict::Tested,
    ClaimVerdict::Refuted,
    ClaimVerdict::Reproduced,
    ClaimVerdict::NotReproduced,
    ClaimVerdict::Open,
];

/// The whole judgement is checked too: a witness moved to where the statement holds must lose its row.
fn controls(outcome: &mut Outcome, judged: &[Judged], blend: Option<&Prey>) -> Result<(), ExperimentError> {
    let row = judged.iter().find(|judged| judged.row.name() == "genevaux2015/G28");
    let mut moved = row.ok_or_else(|| ExperimentError::failed("no row G28"))?.row.clone();
    moved.claim.witness.insert("x".to_owned(), 0.5);
    let run = terrain_papers::ledger::run(&moved, "falloff-signed").map_err(ExperimentError::failed)?;
    outcome.control(
        "a witness where nothing is wrong",
        "the witness of G28 moved to x = r/2",
        "the statement is not convicted",
        !run.stands,
    );
    outcome.control(
        "a hunt for what is not there",
        "the printed blend bound with its factor 1/T, from the hunt's own find",
        "its ratio is at most 1",
        blend.is_some_and(|prey| prey.ratio * terrain_model::bounds::THRESHOLD <= 1.0 + 1e-9),
    );
    Ok(())
}

fn by_paper(judged: &[Judged]) -> Table {
    let table = Table::new("papers", "Rows by paper and verdict, as judged here").column("paper").column("rows");
    let mut table = VERDICTS.iter().fold(table, |table, verdict| table.column(verdict.word()));
    for (paper, citation) in terrain_papers::PAPERS {
        let of: Vec<&Judged> = judged.iter().filter(|judged| judged.row.paper == *paper).collect();
        let mut cells = vec![Cell::from(*citation), Cell::count(of.len() as u64)];
        cells.extend(
            VERDICTS.iter().map(|verdict| Cell::count(of.iter().filter(|j| j.fresh == *verdict).count() as u64)),
        );
        table.row(cells);
    }
    table
}

fn proof_table(proofs: &std::collections::BTreeMap<&'static str, Checked>) -> Table {
    let table = Table::new("proofs", "Proofs in Coq: every theorem rests on the axioms of the reals alone");
    let mut table = table.column("file").column("theorems").machine_column("coqc says");
    for (path, text) in terrain_papers::proofs::PROOFS {
        let said = proofs.get(path).map_or_else(|| "not asked".to_owned(), Checked::word);
        let theorems = terrain_papers::proofs::theorems(text).len();
        table.row([Cell::from(format!("papers/{path}")), Cell::count(theorems as u64), Cell::from(said)]);
    }
    table
}

fn hunt_table(hunts: &[(String, String, Option<Prey>)]) -> Table {
    let titles = ["statement", "found ÷ printed", "proved by intervals", "at"];
    let table = Table::new("hunt", "Violations found from nothing: random points, gradient ascent, intervals");
    let mut table = titles.into_iter().fold(table.column("row"), Table::column);
    for (row, id, prey) in hunts {
        let cells = match prey {
            Some(prey) => [
                Cell::number(prey.ratio, "", 5),
                if prey.proved > 1.0 { Cell::number(prey.proved, "", 5) } else { Cell::missing("no violation proved") },
                Cell::from(prey.at.iter().map(|x| format!("{x:.5}")).collect::<Vec<_>>().join(", ")),
            ],
            None => [Cell::missing("nothing to compare"), Cell::missing("none"), Cell::from("")],
        };
        table.row([Cell::from(row.as_str()), Cell::from(id.as_str())].into_iter().chain(cells));
    }
    table
}

fn certificate_table(judged: &[Judged]) -> Table {
    let titles = ["shows", "came out", "boxes", "control"];
    let table = Table::new("certificates", "Certificates, each with the perturbation that makes it fail");
    let mut table = titles.into_iter().fold(table.column("certificate"), Table::column);
    for certificate in certificates::all() {
        let of = |judged: &Judged| {
            let mut items = judged.items.iter().chain(&judged.corrected).cloned();
            items.find(|item| item.evidence.to_string() == format!("certificate {}", certificate.id))
        };
        let Some(item) = judged.iter().find_map(of) else { continue };
        table.row([
            Cell::from(certificate.id),
            Cell::from(certificate.shows),
            Cell::from(item.line),
            Cell::count(item.boxes),
            Cell::from(certificate.control),
        ]);
    }
    table
}

/// The row as the report prints it. What depends on the machine, whether `coqc` is there, stays out.
fn claim(judged: &Judged) -> Claim {
    let row = &judged.row.claim;
    let names = |items: &[Item]| items.iter().map(|item| item.evidence.to_string()).collect::<Vec<_>>().join("; ");
    let numbers = row.witness.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ");
    let convicted = judged.items.iter().find(|item| item.boxes == 1 && !numbers.is_empty());
    let mut witness = row.why.clone();
    if let Some(item) = convicted {
        witness = format!("{witness} At {numbers}: {}.", item.line);
    }
    let mut statement = row.statement.clone();
    if !row.holds_when.is_empty() {
        statement = format!("{statement} (Holds when: {}.)", row.holds_when.join("; "));
    }
    let corrected = row
        .corrected
        .as_ref()
        .map_or_else(String::new, |corrected| format!("{} [{}]", corrected.statement, names(&judged.corrected)));
    let control = judged.control.as_ref().map_or_else(String::new, |control| control.evidence.to_string());
    Claim::new(&judged.row.name(), &statement, judged.fresh, names(&judged.items))
        .witness(witness.trim())
        .corrected(corrected)
        .place(format!("{}, {}", row.place, row.kind.word()))
        .control(control)
}
