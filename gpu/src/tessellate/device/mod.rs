//! Tessellation on the device, kernel after kernel without a word to the host between: refinement, displacement, drawing.

pub mod displace;
pub mod refine;

#[cfg(test)]
mod tests;

use crate::context::ContextError;

/// The device could not tessellate.
#[derive(Debug, thiserror::Error)]
pub enum TessellateError {
    /// A buffer does not fit a binding.
    #[error(
        "the {what} take {bytes} bytes; a binding of this device holds {limit}: use a coarser ground or longer edges"
    )]
    TooLarge {
        /// Which buffer.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The most the device binds.
        limit: u64,
    },
    /// A list was too short. What it leaves out has descendants, so more may be needed than this camera asked for.
    #[error("this camera needs room for {needed} {what} at least, there is room for {capacity}")]
    Overflow {
        /// Which list.
        what: &'static str,
        /// How many were pushed.
        needed: u32,
        /// How many fit.
        capacity: u32,
    },
    /// Only some of the ground is in memory.
    #[error("the ground is in pages on disk, and the device wants all of it: take a part, or the processor")]
    Paged,
    /// The device failed.
    #[error(transparent)]
    Context(#[from] ContextError),
}
