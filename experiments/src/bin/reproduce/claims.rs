//! `reproduce claims`: rows of the ledger with what shows them, and `reproduce proofs`: what `coqc` says of each file.

use std::path::PathBuf;
use std::process::ExitCode;
use terrain_experiments::claims::coq::{self, Checked};
use terrain_experiments::claims::judge::{Item, Judged};
use terrain_experiments::claims::{hunted, plot, whole};
use terrain_experiments::experiment::{Context, Profile};
use terrain_papers::certificates::find;
use terrain_papers::ledger::Evidence;
use terrain_papers::proofs::{PROOFS, theorems};

/// What to print.
pub struct Run {
    /// A paper's folder; all when absent.
    pub paper: Option<String>,
    /// A row's id; all when absent.
    pub id: Option<String>,
    /// Look for violations too.
    pub hunt: bool,
    /// Sizes.
    pub profile: Profile,
    /// The run's seed.
    pub seed: u64,
    /// Where plots go.
    pub out: PathBuf,
}

impl Run {
    /// Judges the rows and prints them. Status 1 when one does not stand.
    ///
    /// # Errors
    /// One line, when the ledger cannot be read or nothing is chosen.
    pub fn run(&self) -> Result<ExitCode, String> {
        let chosen = |row: &terrain_papers::ledger::Row| {
            self.paper.as_ref().is_none_or(|paper| *paper == row.paper)
                && self.id.as_ref().is_none_or(|id| *id == row.claim.id || *id == row.name())
        };
        let out = self.out.join("claims");
        let context = Context::new("ledger/claims", self.profile, self.seed, out.clone(), String::new());
        let whole = whole(&context, chosen).map_err(|error| error.to_string())?;
        if whole.judged.is_empty() {
            return Err("no such row; `reproduce claims` lists all".to_owned());
        }
        let mut stands = true;
        for judged in &whole.judged {
            let right = judged.stands();
            stands &= right;
            if self.id.is_some() {
                self.page(judged)?;
            } else {
                let mark = if right { ' ' } else { '!' };
                println!("{mark} {:28} {:14} {}", judged.row.name(), judged.fresh, judged.row.claim.statement);
            }
        }
        if self.hunt {
            for (row, id, prey) in hunted(&whole.judged, self.seed as u32) {
                match prey {
                    Some(prey) => println!(
                        "hunt {row:24} {id:26} {:10.5} of the printed bound, {:.5} proved, at {:.5?}",
                        prey.ratio, prey.proved, prey.at
                    ),
                    None => println!("hunt {row:24} {id:26} nothing to compare"),
                }
            }
        }
        if self.id.is_none() {
            println!(
                "{} rows; {}",
                whole.judged.len(),
                if stands { "all stand" } else { "those marked ! do not stand" }
            );
        }
        Ok(ExitCode::from(u8::from(!stands)))
    }

    /// A row with everything that is known of it.
    fn page(&self, judged: &Judged) -> Result<(), String> {
        let claim = &judged.row.claim;
        println!("{}  {}  ({}, {})", judged.row.name(), judged.fresh, claim.place, claim.kind.word());
        if !judged.agrees() {
            println!("  recorded as {}", claim.verdict);
        }
        println!("  {}", claim.statement);
        for condition in &claim.holds_when {
            println!("  holds when: {condition}");
        }
        if !claim.why.is_empty() {
            println!("  why: {}", claim.why);
        }
        for (name, value) in &claim.witness {
            println!("  witness: {name} = {value}");
        }
        judged.items.iter().for_each(|item| print_item("", item));
        if let Some(control) = &judged.control {
            print_item("control: ", control);
        }
        if let Some(corrected) = &claim.corrected {
            println!("  corrected: {}", corrected.statement);
            judged.corrected.iter().for_each(|item| print_item("", item));
        }
        for id in plot::ids(judged) {
            let Some(svg) = plot::of(judged, &id).and_then(|plot| plot.svg().ok()) else { continue };
            let file = self.out.join("claims").join(format!("{id}.svg"));
            let folder = file.parent().unwrap_or(&self.out);
            std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&file, svg)).map_err(|e| e.to_string())?;
            println!("  plot: {}", file.display());
        }
        Ok(())
    }
}

fn print_item(label: &str, item: &Item) {
    let mark = match item.stands {
        Some(true) => "stands",
        Some(false) => "FALLS",
        None => "not run",
    };
    println!("  {label}{} [{mark}] {}", item.evidence, item.line);
    match &item.evidence {
        Evidence::Certificate(id) => {
            if let Some(certificate) = find(id) {
                let control = if label.is_empty() { "" } else { certificate.control };
                println!(
                    "      {}{}",
                    certificate.shows,
                    if control.is_empty() { String::new() } else { format!(" Control: {control}.") }
                );
            }
        }
        Evidence::Coq { file, lemma } => {
            for line in statement(file, lemma) {
                println!("      {line}");
            }
        }
        _ => {}
    }
}

/// The lines that state a lemma, up to its proof.
fn statement(file: &str, lemma: &str) -> Vec<&'static str> {
    let Some((_, text)) = PROOFS.iter().find(|(path, _)| *path == file) else { return Vec::new() };
    let states = |line: &&str| {
        let mut words = line.split_whitespace();
        matches!(words.next(), Some("Lemma" | "Theorem" | "Corollary"))
            && words.next().is_some_and(|name| name.trim_end_matches(':') == lemma)
    };
    text.lines().skip_while(|line| !states(line)).take_while(|line| !line.starts_with("Proof")).collect()
}

/// Checks every file and prints what it says. Status 1 when one failed, and where `strict`, when one was skipped.
///
/// # Errors
/// One line, when there is no place for temporary files.
pub fn proofs(strict: bool) -> Result<ExitCode, String> {
    let checked = coq::check_all().map_err(|error| error.to_string())?;
    let mut bad = false;
    for (path, text) in PROOFS {
        let said = checked.get(path).map_or_else(|| "not asked".to_owned(), Checked::word);
        println!("{said:8}  papers/{path}: {}", theorems(text).join(", "));
        bad |= match checked.get(path) {
            Some(Checked::Checked) => false,
            Some(Checked::Skipped) => strict,
            _ => true,
        };
    }
    println!(
        "{} theorems in {} files; allowed below them: {}",
        coq::stated(),
        PROOFS.len(),
        terrain_papers::proofs::ALLOWED.join(", ")
    );
    Ok(ExitCode::from(u8::from(bad)))
}
