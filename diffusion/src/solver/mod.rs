//! Solvers of the discrete fields.

pub mod cascade;
pub mod cycle;
mod dense;
pub mod engine;
pub mod equations;
pub mod guided;
pub mod held;
pub mod hierarchy;
mod interpolation;
pub mod krylov;
pub mod laplace;
mod rows;
mod stencil;
pub mod variational;

/// A field could not be solved for.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// No node is held by a value.
    #[error("no curve gives this field a value: nothing holds it; give one constraint point a value")]
    Unheld,
    /// Some nodes follow slopes around in circles.
    #[error(
        "the slopes around column {column}, row {row} lead in a circle and never to an elevation: give a curve there an elevation, \
         or shorten its slopes"
    )]
    Adrift {
        /// From the west.
        column: usize,
        /// From the south.
        row: usize,
    },
    /// A setting outside its range.
    #[error("{what} is {value}: expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// It.
        value: f64,
        /// The range.
        expected: &'static str,
    },
    /// Some part of the field is held by no value.
    #[error(transparent)]
    Singular(#[from] cycle::Singular),
    /// The paper's iterations were asked of what solves systems.
    #[error("the paper's iterations solve no system: expected a solver that converges")]
    Schedule,
    /// A device that was to solve failed.
    #[error(transparent)]
    Device(Box<dyn std::error::Error + Send + Sync>),
}

#[cfg(test)]
mod direct_tests;
#[cfg(test)]
mod samples;
