//! Solvers of the discrete fields.

pub mod cycle;
mod dense;
mod interpolation;
pub mod krylov;
pub mod laplace;

/// A field could not be solved for.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// No node is held by a value.
    #[error("no curve gives this field a value: nothing holds it; give one constraint point a value")]
    Unheld,
    /// Some part of the field is held by no value.
    #[error(transparent)]
    Singular(#[from] cycle::Singular),
}
