//! The tessellation paper: one module per table, figure or claim.

mod cameras;
mod cracks;
mod edges;
mod fig3;
mod fig5;
mod fig6;
mod fig8;
mod pages;
pub(crate) mod picture;
mod popping;
mod scenes;
mod storage;
mod variants;

use crate::experiment::Experiment;

/// This paper's experiments, in the order of the report.
pub const EXPERIMENTS: &[&Experiment] = &[
    &fig3::EXPERIMENT,
    &fig5::EXPERIMENT,
    &fig6::EXPERIMENT,
    &fig8::EXPERIMENT,
    &cracks::EXPERIMENT,
    &edges::EXPERIMENT,
    &popping::EXPERIMENT,
    &storage::EXPERIMENT,
    &variants::EXPERIMENT,
    &pages::EXPERIMENT,
];
