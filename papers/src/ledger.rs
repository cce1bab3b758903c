//! The ledger: one row per checkable statement of a paper, with what shows it. A row's verdict is not believed: it follows again from
//! its evidence each time certificates are run.

use crate::certificates::{self, Certificate, Check, Finding, Form, Kind as How};
use crate::verdicts::ClaimVerdict;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;

/// Folder and text of each `claims.toml`.
const FILES: &[(&str, &str)] = &[
    ("genevaux2015", GENEVAUX2015),
    ("hnaidi2010", HNAIDI2010),
    ("paris2019", PARIS2019),
    ("tessellation", TESSELLATION),
];
pub(crate) const GENEVAUX2015: &str = include_str!("../genevaux2015/claims.toml");
pub(crate) const HNAIDI2010: &str = include_str!("../hnaidi2010/claims.toml");
pub(crate) const PARIS2019: &str = include_str!("../paris2019/claims.toml");
pub(crate) const TESSELLATION: &str = include_str!("../tessellation/claims.toml");

/// What sort of statement a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A formula or a definition.
    Formula,
    /// An inequality.
    Bound,
    /// What an algorithm promises.
    Guarantee,
    /// A number of the prose, a table or a caption.
    Figure,
}

impl Kind {
    /// The word of `claims.toml`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Formula => "formula",
            Self::Bound => "bound",
            Self::Guarantee => "guarantee",
            Self::Figure => "figure",
        }
    }
}

/// Something that shows a statement. In `claims.toml`: `certificate ID`, `coq FILE LEMMA`, `test PATH::NAME`, `experiment ID CLAIM`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum Evidence {
    /// Run on the spot.
    Certificate(String),
    /// A lemma of `papers/<paper>/proofs/`.
    Coq {
        /// `papers/<paper>/proofs/` and the file, from the paper's folder on: `genevaux2015/proofs/Blend.v`.
        file: String,
        /// The lemma.
        lemma: String,
    },
    /// A test of the workspace.
    Test {
        /// From the root of the repository.
        file: String,
        /// Its name.
        name: String,
    },
    /// A claim of an experiment.
    Experiment {
        /// The experiment.
        id: String,
        /// The claim's id in it, or the name of a control.
        claim: String,
    },
}

impl TryFrom<String> for Evidence {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (word, rest) = text.split_once(' ').unwrap_or((&text, ""));
        let two = |by: &str| rest.split_once(by).map(|(a, b)| (a.to_owned(), b.to_owned()));
        match word {
            "certificate" if !rest.is_empty() => Some(Self::Certificate(rest.to_owned())),
            "coq" => two(" ").map(|(file, lemma)| Self::Coq { file, lemma }),
            "test" => two("::").map(|(file, name)| Self::Test { file, name }),
            "experiment" => two(" ").map(|(id, claim)| Self::Experiment { id, claim }),
            _ => None,
        }
        .ok_or_else(|| {
            format!("`{text}` is no evidence: certificate ID, coq FILE LEMMA, test PATH::NAME or experiment ID CLAIM")
        })
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Certificate(id) => write!(f, "certificate {id}"),
            Self::Coq { file, lemma } => write!(f, "coq {file} {lemma}"),
            Self::Test { file, name } => write!(f, "test {file}::{name}"),
            Self::Experiment { id, claim } => write!(f, "experiment {id} {claim}"),
        }
    }
}

/// What holds in place of a refuted statement.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Corrected {
    /// In our words.
    pub statement: String,
    /// What proves it.
    #[serde(default)]
    pub proved_by: Vec<Evidence>,
    /// What tests it.
    #[serde(default)]
    pub tested_by: Vec<Evidence>,
}

/// A row.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Unique within its paper.
    pub id: String,
    /// Section, equation, figure.
    pub place: String,
    /// What sort of statement it is.
    pub kind: Kind,
    /// The statement in our words.
    pub statement: String,
    /// What we say of it.
    pub verdict: ClaimVerdict,
    /// When the statement as printed is right, or what it presumes.
    #[serde(default)]
    pub holds_when: Vec<String>,
    /// Why it fails, in numbers and words.
    #[serde(default)]
    pub why: String,
    /// The numbers of its witness certificate.
    #[serde(default)]
    pub witness: BTreeMap<String, f64>,
    /// What refutes it.
    #[serde(default)]
    pub refuted_by: Vec<Evidence>,
    /// What proves it.
    #[serde(default)]
    pub proved_by: Vec<Evidence>,
    /// What tests it.
    #[serde(default)]
    pub tested_by: Vec<Evidence>,
    /// What measures it.
    #[serde(default)]
    pub measured_by: Vec<Evidence>,
    /// A perturbation of it that evidence turns down: a certificate (its own control), a lemma, a test, or a control of an
    /// experiment. Only open rows go without.
    #[serde(default)]
    pub control: Option<Evidence>,
    /// What holds instead.
    #[serde(default)]
    pub corrected: Option<Corrected>,
}

/// A row and its paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The paper's folder.
    pub paper: &'static str,
    /// The row.
    pub claim: Claim,
}

/// A ledger could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LedgerError {
    /// The file is no ledger; the text names the line.
    #[error("papers/{paper}/claims.toml: {source}")]
    Syntax {
        /// The paper's folder.
        paper: &'static str,
        /// What is wrong and where.
        source: Box<toml::de::Error>,
    },
    /// A row says something that cannot be.
    #[error("papers/{paper}/claims.toml, {id}: {what}")]
    Row {
        /// The paper's folder.
        paper: &'static str,
        /// The row.
        id: String,
        /// What is wrong.
        what: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    claim: Vec<Claim>,
}

/// Every row of every paper, in the order of the files.
///
/// # Errors
/// When a file cannot be read, an id stands twice, or a row contradicts itself.
pub fn rows() -> Result<Vec<Row>, LedgerError> {
    let mut rows: Vec<Row> = Vec::new();
    for (paper, text) in FILES {
        for row in parse(paper, text)? {
            if rows.iter().any(|other| other.paper == *paper && other.claim.id == row.claim.id) {
                return Err(row.error("it stands twice"));
            }
            rows.push(row);
        }
    }
    Ok(rows)
}

fn parse(paper: &'static str, text: &str) -> Result<Vec<Row>, LedgerError> {
    let file: File = toml::from_str(text).map_err(|source| LedgerError::Syntax { paper, source: Box::new(source) })?;
    file.claim
        .into_iter()
        .map(|claim| {
            let row = Row { paper, claim };
            row.check().map_err(|what| row.error(&what))?;
            Ok(row)
        })
        .collect()
}

impl Row {
    fn error(&self, what: &str) -> LedgerError {
        LedgerError::Row { paper: self.paper, id: self.claim.id.clone(), what: what.to_owned() }
    }
    /// `paper/id`.
    pub fn name(&self) -> String {
        format!("{}/{}", self.paper, self.claim.id)
    }
    fn check(&self) -> Result<(), String> {
        let claim = &self.claim;
        let refuted = claim.verdict == ClaimVerdict::Refuted;
        if refuted == claim.refuted_by.is_empty() {
            return Err("`refuted_by` and the verdict do not go together".to_owned());
        }
        if refuted && claim.why.is_empty() && claim.witness.is_empty() {
            return Err("a refutation needs a witness or `why`".to_owned());
        }
        if claim.verdict == ClaimVerdict::Proved && claim.proved_by.is_empty() {
            return Err("proved by nothing".to_owned());
        }
        if claim.verdict == ClaimVerdict::Open && !self.evidence().is_empty() {
            return Err("an open row has no evidence".to_owned());
        }
        Ok(())
    }
    /// What shows the statement itself, or refutes it.
    pub fn evidence(&self) -> Vec<&Evidence> {
        let claim = &self.claim;
        claim.refuted_by.iter().chain(&claim.proved_by).chain(&claim.tested_by).chain(&claim.measured_by).collect()
    }
    /// What shows the corrected statement.
    pub fn corrected_evidence(&self) -> Vec<&Evidence> {
        self.claim.corrected.iter().flat_map(|c| c.proved_by.iter().chain(&c.tested_by)).collect()
    }
    /// The verdict that the lists of evidence amount to when all of it stands; measured verdicts are taken from the row.
    pub fn follows(&self) -> ClaimVerdict {
        let claim = &self.claim;
        if !claim.refuted_by.is_empty() {
            ClaimVerdict::Refuted
        } else if !claim.proved_by.is_empty() {
            ClaimVerdict::Proved
        } else if !claim.measured_by.is_empty() {
            claim.verdict
        } else if !claim.tested_by.is_empty() {
            ClaimVerdict::Tested
        } else {
            ClaimVerdict::Open
        }
    }
    /// The numbers of the witness in the order of a certificate; `None` when a name is missing or superfluous.
    pub fn witness_of(&self, certificate: &Certificate) -> Option<Vec<f64>> {
        let How::Witness(violation) = certificate.kind else { return Some(Vec::new()) };
        let names = violation.names();
        if names.len() != self.claim.witness.len() {
            return None;
        }
        names.iter().map(|name| self.claim.witness.get(*name).copied()).collect()
    }
}

/// What running a certificate for a row has shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The certificate.
    pub id: &'static str,
    /// Does it show what it is cited for?
    pub stands: bool,
    /// In one line.
    pub line: String,
    /// Did its control fail, as it should?
    pub control_failed: bool,
    /// How the control went, in one line.
    pub control_line: String,
    /// Boxes looked at.
    pub boxes: u64,
}

/// Runs a certificate, with the witness of the row when it is of that kind, and its control.
///
/// # Errors
/// When there is no such certificate, or the row's witness does not have its numbers.
pub fn run(row: &Row, id: &str) -> Result<Run, LedgerError> {
    let certificate = certificates::find(id).ok_or_else(|| row.error(&format!("no certificate `{id}`")))?;
    match certificate.kind {
        How::Proof(prove) => {
            let (stated, perturbed) = (prove(Form::Stated), prove(Form::Perturbed));
            let boxes = match stated {
                Finding::Proved { boxes, .. } | Finding::Undecided { boxes, .. } => boxes,
                Finding::Refuted { .. } => 0,
            };
            Ok(Run {
                id: certificate.id,
                stands: stated.proved(),
                line: stated.line(),
                control_failed: !perturbed.proved(),
                control_line: perturbed.line(),
                boxes,
            })
        }
        How::Witness(violation) => {
            let x = row.witness_of(certificate);
            let check = x.and_then(|x| Check::at(violation, &x)).ok_or_else(|| {
                row.error(&format!("the witness needs exactly the numbers {}", violation.names().join(", ")))
            })?;
            let corrected = check.corrected;
            Ok(Run {
                id: certificate.id,
                stands: check.convicts(),
                line: check.line(),
                control_failed: check.corrected_holds(),
                control_line: format!(
                    "not convicted: {:.6} is at most {:.6}",
                    corrected.value.hi(),
                    corrected.limit.lo()
                ),
                boxes: 1,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW: &str = r#"
        [[claim]]
        id = "X"
        place = "§1"
        kind = "bound"
        statement = "s"
        verdict = "proved"
        proved_by = ["certificate wyvill-slope"]
        control = "certificate wyvill-slope"
    "#;

    #[test]
    fn every_ledger_can_be_read() {
        assert!(rows().unwrap().len() >= 120);
    }

    #[test]
    fn a_row_that_contradicts_itself_is_refused() {
        assert_eq!(parse("genevaux2015", ROW).unwrap().len(), 1);
        for (from, to, what) in [
            ("\"proved\"", "\"refuted\"", "do not go together"),
            ("proved_by", "refuted_by", "do not go together"),
            ("certificate wyvill", "certficate wyvill", "is no evidence"),
            ("place", "palce", "palce"),
            ("\"proved\"", "\"open\"", "open row"),
        ] {
            let error = parse("genevaux2015", &ROW.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(what) && error.contains("papers/genevaux2015/claims.toml"), "{error}");
        }
    }

    #[test]
    fn a_certificate_that_does_not_exist_is_an_error() {
        let row = &parse("genevaux2015", ROW).unwrap()[0];
        assert!(run(row, "no-such").unwrap_err().to_string().contains("no-such"));
    }

    #[test]
    fn evidence_reads_back_as_it_is_written() {
        for text in ["certificate a", "coq p/proofs/A.v b", "test a/b.rs::c", "experiment a/b c d"] {
            assert_eq!(Evidence::try_from(text.to_owned()).unwrap().to_string(), text);
        }
    }
}
