//! The words a verdict can be, their order from best to worst, and the verdicts that experiments have earned so far, which a
//! later run must not fall below.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

pub(crate) const GENEVAUX2015: &str = include_str!("../genevaux2015/verdicts.toml");
pub(crate) const GPU: &str = include_str!("../gpu/verdicts.toml");
pub(crate) const HNAIDI2010: &str = include_str!("../hnaidi2010/verdicts.toml");
pub(crate) const LEDGER: &str = include_str!("../ledger/verdicts.toml");
pub(crate) const MODEL: &str = include_str!("../model/verdicts.toml");
pub(crate) const PARIS2019: &str = include_str!("../paris2019/verdicts.toml");
pub(crate) const TESSELLATION: &str = include_str!("../tessellation/verdicts.toml");

/// Folder and text of each `verdicts.toml`: one per paper, that of the experiments on the model's own executors, that of the adapter, and that of the ledger.
const FILES: &[(&str, &str)] = &[
    ("model", MODEL),
    ("genevaux2015", GENEVAUX2015),
    ("hnaidi2010", HNAIDI2010),
    ("paris2019", PARIS2019),
    ("tessellation", TESSELLATION),
    ("gpu", GPU),
    ("ledger", LEDGER),
];

/// What an experiment says of the paper's table or figure. The order is from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Verdict {
    /// Every compared value lies within its tolerance.
    #[serde(rename = "reproduced")]
    Reproduced,
    /// Some compared values do.
    #[serde(rename = "partial")]
    Partial,
    /// It ran, and the paper's values did not come out; also an experiment that failed, or one whose control passed.
    #[serde(rename = "not reproduced")]
    NotReproduced,
    /// It could not run here: the report says why.
    #[serde(rename = "skipped")]
    Skipped,
    /// There is no code for it.
    #[serde(rename = "not attempted")]
    NotAttempted,
}

impl Verdict {
    /// The word that reports and `verdicts.toml` use.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Partial => "partial",
            Self::NotReproduced => "not reproduced",
            Self::Skipped => "skipped",
            Self::NotAttempted => "not attempted",
        }
    }

    /// Whether this verdict falls below the recorded one. A machine that lacks what an experiment needs takes nothing back from what
    /// another machine showed.
    pub fn is_worse_than(self, recorded: Self) -> bool {
        self > recorded && self != Self::Skipped
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// What the ledger says of one statement of a paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClaimVerdict {
    /// A proof or a certificate that was run.
    #[serde(rename = "proved")]
    Proved,
    /// A test that tried to break it and failed.
    #[serde(rename = "tested")]
    Tested,
    /// False as printed: there is a witness.
    #[serde(rename = "refuted")]
    Refuted,
    /// A measured statement that our measurement agrees with.
    #[serde(rename = "reproduced")]
    Reproduced,
    /// A measured statement that our measurement disagrees with.
    #[serde(rename = "not reproduced")]
    NotReproduced,
    /// Not decided.
    #[serde(rename = "open")]
    Open,
}

impl ClaimVerdict {
    /// The word that reports and ledgers use.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Proved => "proved",
            Self::Tested => "tested",
            Self::Refuted => "refuted",
            Self::Reproduced => "reproduced",
            Self::NotReproduced => "not reproduced",
            Self::Open => "open",
        }
    }
}

impl fmt::Display for ClaimVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// The recorded verdicts could not be read.
#[derive(Debug, thiserror::Error)]
pub enum VerdictsError {
    /// The file is not TOML of the form `"id" = "verdict"`.
    #[error("papers/{paper}/verdicts.toml: {source}")]
    Syntax {
        /// The paper's folder.
        paper: &'static str,
        /// What is wrong and where.
        source: toml::de::Error,
    },
    /// An id is in another paper's file.
    #[error("papers/{paper}/verdicts.toml: `{id}` does not start with `{paper}/`")]
    WrongPaper {
        /// The paper's folder.
        paper: &'static str,
        /// The id.
        id: String,
    },
}

/// The verdict recorded for each experiment id, over all papers.
///
/// # Errors
/// When a file has a word that is no verdict, or an id of another paper.
pub fn recorded() -> Result<BTreeMap<String, Verdict>, VerdictsError> {
    let mut all = BTreeMap::new();
    for (paper, text) in FILES {
        all.extend(parse(paper, text)?);
    }
    Ok(all)
}

fn parse(paper: &'static str, text: &str) -> Result<BTreeMap<String, Verdict>, VerdictsError> {
    let verdicts: BTreeMap<String, Verdict> =
        toml::from_str(text).map_err(|source| VerdictsError::Syntax { paper, source })?;
    match verdicts.keys().find(|id| id.split_once('/').is_none_or(|(folder, _)| folder != paper)) {
        Some(id) => Err(VerdictsError::WrongPaper { paper, id: id.clone() }),
        None => Ok(verdicts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{NotAttempted, NotReproduced, Partial, Reproduced, Skipped};

    #[test]
    fn order_runs_from_reproduced_to_not_attempted_and_a_skip_takes_nothing_back() {
        let order = [Reproduced, Partial, NotReproduced, NotAttempted];
        for (i, better) in order.iter().enumerate() {
            assert!(!better.is_worse_than(*better) && !Skipped.is_worse_than(*better));
            for worse in &order[i + 1..] {
                assert!(worse.is_worse_than(*better) && !better.is_worse_than(*worse));
            }
        }
    }

    #[test]
    fn recorded_verdicts_can_be_read() {
        recorded().unwrap();
    }

    #[test]
    fn an_unknown_word_is_refused_with_its_line() {
        let error = parse("genevaux2015", "\"genevaux2015/x\" = \"fine\"\n").unwrap_err().to_string();
        assert!(error.contains("line 1") && error.contains("fine"), "{error}");
    }

    #[test]
    fn an_id_of_another_paper_is_refused() {
        let error = parse("genevaux2015", "\"paris2019/x\" = \"partial\"\n").unwrap_err().to_string();
        assert!(error.contains("paris2019/x"), "{error}");
    }

    #[test]
    fn words_read_back_as_the_verdict_they_name() {
        for verdict in [Reproduced, Partial, NotReproduced, Skipped, NotAttempted] {
            let text = format!("\"p/x\" = \"{verdict}\"");
            assert_eq!(parse("p", &text).unwrap()["p/x"], verdict);
        }
    }
}
