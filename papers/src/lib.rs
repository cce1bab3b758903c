//! What each paper says: tables, claims, errata and their evidence.

pub mod tables;
pub mod verdicts;

/// The embedded files this crate answers from, with their paths in the repository, so that a report can print their hashes.
pub const INPUTS: &[(&str, &str)] = &[
    ("papers/genevaux2015/tables.toml", tables::GENEVAUX2015),
    ("papers/genevaux2015/verdicts.toml", verdicts::GENEVAUX2015),
    ("papers/hnaidi2010/tables.toml", tables::HNAIDI2010),
    ("papers/paris2019/tables.toml", tables::PARIS2019),
];
