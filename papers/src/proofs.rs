//! The Coq proofs: which files there are, which theorems they state, and what a run of `coqc` says of them. A theorem counts only when
//! its file compiles and nothing but the axioms of the standard reals is below it.

/// Path below `papers/` and text of every file.
pub const PROOFS: &[(&str, &str)] = &[
    ("genevaux2015/proofs/Blend.v", include_str!("../genevaux2015/proofs/Blend.v")),
    ("genevaux2015/proofs/March.v", include_str!("../genevaux2015/proofs/March.v")),
    ("genevaux2015/proofs/Operators.v", include_str!("../genevaux2015/proofs/Operators.v")),
    ("genevaux2015/proofs/Wyvill.v", include_str!("../genevaux2015/proofs/Wyvill.v")),
    ("hnaidi2010/proofs/Diffusion.v", include_str!("../hnaidi2010/proofs/Diffusion.v")),
    ("paris2019/proofs/Columns.v", include_str!("../paris2019/proofs/Columns.v")),
    ("paris2019/proofs/Sigmoid.v", include_str!("../paris2019/proofs/Sigmoid.v")),
    ("tessellation/proofs/Nesting.v", include_str!("../tessellation/proofs/Nesting.v")),
];

/// The axioms that the real numbers of Coq's standard library and Coquelicot rest on. Nothing else may be below a theorem.
pub const ALLOWED: &[&str] = &[
    "ClassicalDedekindReals.sig_forall_dec",
    "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
    "Classical_Prop.classic",
];

/// Words that leave a hole in a proof, or state what is not proved.
const HOLES: &[&str] = &[
    "Admitted",
    "admit",
    "give_up",
    "Abort",
    "Axiom",
    "Axioms",
    "Parameter",
    "Parameters",
    "Conjecture",
    "bypass_check",
];

/// The text without comments, which may nest.
fn code(text: &str) -> String {
    let (mut depth, mut out) = (0usize, String::new());
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let cut = match rest.get(..2) {
            Some("(*") => {
                depth += 1;
                2
            }
            Some("*)") => {
                depth = depth.saturating_sub(1);
                2
            }
            _ => {
                if depth == 0 {
                    out.push(letter);
                }
                letter.len_utf8()
            }
        };
        rest = &rest[cut..];
    }
    out
}

/// The theorems of a file, by name, in order.
pub fn theorems(text: &str) -> Vec<String> {
    let code = code(text);
    let words: Vec<&str> = code.split_whitespace().collect();
    let stated = words.windows(2).filter(|pair| matches!(pair[0], "Lemma" | "Theorem" | "Corollary"));
    stated.map(|pair| pair[1].trim_end_matches(':').to_owned()).collect()
}

/// The words of a file that leave a hole.
pub fn holes(text: &str) -> Vec<&'static str> {
    let code = code(text);
    let words: Vec<&str> = code.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).collect();
    HOLES.iter().copied().filter(|hole| words.contains(hole)).collect()
}

/// What is given to `coqc`: the file, and a question for the axioms below all of its theorems at once.
pub fn question(text: &str) -> String {
    let all = theorems(text).join(", ");
    format!("{text}\nDefinition all_theorems_of_this_file := ({all}).\nPrint Assumptions all_theorems_of_this_file.\n")
}

/// The axioms that an answer of `coqc` to [`question`] names and that are not allowed.
///
/// # Errors
/// When the answer is none: neither axioms nor their absence is reported.
pub fn forbidden(answer: &str) -> Result<Vec<String>, String> {
    if answer.contains("Closed under the global context") {
        return Ok(Vec::new());
    }
    let Some((_, list)) = answer.split_once("Axioms:") else {
        return Err("coqc did not say what the theorems rest on".to_owned());
    };
    // A name stands at the start of a line, its type behind a colon or on the next, indented lines.
    let names = list.lines().filter(|line| !line.starts_with(' ') && !line.is_empty());
    let names = names.map(|line| line.split([' ', ':']).next().unwrap_or(line));
    Ok(names.filter(|name| !ALLOWED.contains(name)).map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn every_proof_on_disk_is_listed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found = BTreeSet::new();
        for (paper, _) in crate::PAPERS {
            let Ok(folder) = std::fs::read_dir(root.join(paper).join("proofs")) else { continue };
            for entry in folder {
                let name = entry.unwrap().file_name().into_string().unwrap();
                assert!(name.ends_with(".v"), "papers/{paper}/proofs holds {name}");
                found.insert(format!("{paper}/proofs/{name}"));
            }
        }
        assert_eq!(found, PROOFS.iter().map(|(path, _)| (*path).to_owned()).collect());
    }

    #[test]
    fn no_proof_has_a_hole_and_every_file_states_something() {
        for (path, text) in PROOFS {
            assert!(holes(text).is_empty(), "{path}: {:?}", holes(text));
            assert!(theorems(text).len() > 2, "{path}");
            let (stated, proved) = (theorems(text).len(), code(text).matches("Qed.").count());
            assert_eq!(stated, proved, "{path}: {stated} theorems, {proved} proofs");
        }
    }

    #[test]
    fn holes_are_seen_and_comments_are_not_code() {
        let text =
            "(* Admitted (* nested *) Lemma no : x. *) Lemma a : 1 = 1. Proof. admit. Admitted.\nTheorem b: True.";
        assert_eq!(theorems(text), ["a", "b"]);
        assert_eq!(holes(text), ["Admitted", "admit"]);
        assert!(holes("Lemma admitted_rate : x. Qed.").is_empty());
    }

    #[test]
    fn an_axiom_that_is_not_of_the_reals_is_found() {
        let answer = "Axioms:\nClassical_Prop.classic : forall P : Prop, P \\/ ~ P\nMine.free_lunch\n  : False\n";
        assert_eq!(forbidden(answer).unwrap(), ["Mine.free_lunch"]);
        assert!(forbidden("Closed under the global context\n").unwrap().is_empty());
        assert!(forbidden("").is_err());
    }
}
