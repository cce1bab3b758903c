//! Certificates: what a row of a ledger is shown by when it is read. Each runs the library's own formulas and answers the same
//! bits on every machine. There are two kinds: a *proof* searches a box or a family and encloses a supremum; a *witness* takes the
//! numbers that the ledger carries and convicts a printed formula by interval arithmetic.
//!
//! Each has a control: the same computation on a perturbed formula, which must not succeed.

mod arithmetic;
mod authored;
mod blends;
mod falloff;
mod family;
mod hnaidi2010;
mod hunt;
mod images;
mod noises;
mod operators;
mod paris2019;
mod search;
mod skeletons;
mod terrain;
mod tessellation;
mod tracing;
mod volumes;
mod witness;

pub use hunt::{Prey, hunt};
pub use search::{Finding, Form};
pub use witness::{Check, Side, Sides, Violation};

/// Something that can be run to show a statement.
#[derive(Clone, Copy)]
pub struct Certificate {
    /// Its name in `claims.toml`.
    pub id: &'static str,
    /// What it shows, in one sentence.
    pub shows: &'static str,
    /// The perturbation that makes it fail.
    pub control: &'static str,
    /// The functions of the library whose bounds it certifies, as `file::function` below `model/src`.
    pub certifies: &'static [&'static str],
    /// How.
    pub kind: Kind,
}

/// How a certificate shows what it shows.
#[derive(Clone, Copy)]
pub enum Kind {
    /// By a search.
    Proof(fn(Form) -> Finding),
    /// By the witness of the row.
    Witness(&'static dyn Violation),
}

/// Every certificate.
pub fn all() -> impl Iterator<Item = &'static Certificate> {
    [
        falloff::ALL,
        blends::ALL,
        operators::ALL,
        noises::ALL,
        images::ALL,
        skeletons::ALL,
        tracing::ALL,
        arithmetic::ALL,
        hnaidi2010::ALL,
        paris2019::ALL,
        volumes::ALL,
        tessellation::ALL,
    ]
    .into_iter()
    .flatten()
}

/// The certificate with an id.
pub fn find(id: &str) -> Option<&'static Certificate> {
    all().find(|certificate| certificate.id == id)
}
