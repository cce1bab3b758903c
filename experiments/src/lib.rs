//! Experiments that reproduce every table and figure, and the terrain command.

pub mod claims;
pub mod environment;
pub mod experiment;
mod found;
pub mod generate;
pub mod genevaux2015;
mod gpu;
pub mod hnaidi2010;
pub mod landscapes;
pub mod layers;
mod memory;
pub mod model;
pub mod paris2019;
pub mod report;
pub mod runner;
pub mod scenes;
mod tessellation;
pub mod verbs;

use experiment::Experiment;

/// Every experiment, in the order of the report.
pub fn experiments() -> Vec<&'static Experiment> {
    // The ledger comes last: it builds on what the others find.
    [
        model::EXPERIMENTS,
        genevaux2015::EXPERIMENTS,
        hnaidi2010::EXPERIMENTS,
        paris2019::EXPERIMENTS,
        tessellation::EXPERIMENTS,
        gpu::EXPERIMENTS,
        claims::EXPERIMENTS,
    ]
    .concat()
}

/// The experiments that `ids` name, in the order of the report: an id, or a paper for all of its experiments.
///
/// # Errors
/// One line for the first id that names nothing, with the nearest that do.
pub fn select(all: &[&'static Experiment], ids: &[String]) -> Result<Vec<&'static Experiment>, String> {
    let names = |experiment: &Experiment, id: &str| {
        experiment.id == id || experiment.id.strip_prefix(id).is_some_and(|rest| rest.starts_with('/'))
    };
    for id in ids {
        if !all.iter().any(|experiment| names(experiment, id)) {
            return Err(unknown(all, id));
        }
    }
    Ok(all.iter().copied().filter(|experiment| ids.iter().any(|id| names(experiment, id))).collect())
}

fn unknown(all: &[&'static Experiment], id: &str) -> String {
    let distance = |experiment: &&Experiment| {
        let name = experiment.id.rsplit('/').next().unwrap_or(experiment.id);
        strsim::damerau_levenshtein(experiment.id, id).min(strsim::damerau_levenshtein(name, id))
    };
    let mut nearest: Vec<&Experiment> = all.to_vec();
    nearest.sort_by_key(distance);
    let nearest: Vec<&str> = nearest.iter().take(3).map(|experiment| experiment.id).collect();
    if nearest.is_empty() {
        return format!("no experiment `{id}`: there is none yet");
    }
    format!("no experiment `{id}`; the nearest: {}", nearest.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn ids_are_unique_and_name_their_paper() {
        let mut seen = BTreeSet::new();
        for experiment in experiments() {
            assert!(seen.insert(experiment.id), "{} stands twice", experiment.id);
            let (paper, name) = experiment.id.split_once('/').expect("paper/name");
            assert!(report::is_file_name(paper) && report::is_file_name(name), "{}", experiment.id);
        }
    }

    #[test]
    fn the_code_and_the_test_of_each_experiment_exist() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        for experiment in experiments() {
            assert!(root.join(experiment.code).is_file(), "{}: no file {}", experiment.id, experiment.code);
            let (file, name) = experiment.test.split_once("::").expect("path/to/file.rs::test_name");
            let text = std::fs::read_to_string(root.join(file)).unwrap_or_default();
            assert!(text.contains(&format!("fn {name}(")), "{}: no test {}", experiment.id, experiment.test);
        }
    }

    #[test]
    fn each_experiment_has_a_recorded_verdict_and_each_record_an_experiment() {
        let ours: BTreeSet<String> = experiments().iter().map(|experiment| experiment.id.to_owned()).collect();
        let recorded: BTreeSet<String> = terrain_papers::verdicts::recorded().unwrap().into_keys().collect();
        assert_eq!(ours, recorded, "papers/<paper>/verdicts.toml and the list of experiments differ");
    }
}
