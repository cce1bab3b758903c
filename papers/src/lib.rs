//! What each paper says: tables, claims, errata and their evidence.

pub mod certificates;
pub mod ledger;
pub mod proofs;
pub mod tables;
pub mod verdicts;

/// Folder and citation of each paper, in the order of reports.
pub const PAPERS: &[(&str, &str)] = &[
    ("genevaux2015", "Génevaux et al. 2015, Terrain Modelling from Feature Primitives"),
    ("hnaidi2010", "Hnaidi et al. 2010, Feature based terrain generation using diffusion equation"),
    ("paris2019", "Paris et al. 2019, Terrain Amplification with Implicit 3D Features"),
    ("tessellation", "Run-time terrain tessellation with fractal detail"),
];

/// The embedded files this crate answers from, with their paths in the repository, so that a report can print their hashes.
pub const INPUTS: &[(&str, &str)] = &[
    ("papers/genevaux2015/claims.toml", ledger::GENEVAUX2015),
    ("papers/genevaux2015/tables.toml", tables::GENEVAUX2015),
    ("papers/genevaux2015/verdicts.toml", verdicts::GENEVAUX2015),
    ("papers/hnaidi2010/claims.toml", ledger::HNAIDI2010),
    ("papers/hnaidi2010/tables.toml", tables::HNAIDI2010),
    ("papers/hnaidi2010/verdicts.toml", verdicts::HNAIDI2010),
    ("papers/ledger/verdicts.toml", verdicts::LEDGER),
    ("papers/model/verdicts.toml", verdicts::MODEL),
    ("papers/paris2019/claims.toml", ledger::PARIS2019),
    ("papers/paris2019/tables.toml", tables::PARIS2019),
    ("papers/paris2019/verdicts.toml", verdicts::PARIS2019),
    ("papers/tessellation/claims.toml", ledger::TESSELLATION),
    ("papers/tessellation/verdicts.toml", verdicts::TESSELLATION),
    ("papers/gpu/verdicts.toml", verdicts::GPU),
];
