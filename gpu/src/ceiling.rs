//! What a device can do at the most, measured on it: bytes moved by a copy, operations of a chain of fused multiplications and additions.
//! Other times are held against these, not against a data sheet.

use crate::context::{Context, ContextError};
use crate::meter::Spent;

/// The copy.
pub const STREAM: &str = include_str!("../shaders/ceiling/stream.wgsl");
/// The chain.
pub const CHAIN: &str = include_str!("../shaders/ceiling/chain.wgsl");

/// Multiplications and additions of an invocation of [`CHAIN`]: 256 turns of 4 vectors of 4.
const OPERATIONS: u64 = 256 * 4 * 4 * 2;
/// Times that each is measured; the best counts.
const ROUNDS: usize = 5;

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceilings {
    /// Read and written, together.
    pub bytes_per_second: f64,
    /// Multiplications and additions in `f32`.
    pub operations_per_second: f64,
}

/// A part of the work was not done: times of it would mean nothing.
#[derive(Debug, thiserror::Error)]
pub enum CeilingError {
    /// The device failed.
    #[error(transparent)]
    Context(#[from] ContextError),
    /// A kernel's result is not what it computes.
    #[error("the {0} that measures the device gave a wrong result")]
    Wrong(&'static str),
}

/// Seconds of compute passes, or of the wall where the device has no clock.
fn seconds(spent: &Spent) -> f64 {
    spent.compute_seconds.filter(|seconds| *seconds > 0.0).unwrap_or(spent.wall_seconds)
}

/// Measures with copies of `mebibytes` and chains of as many invocations as there are words in one mebibyte for each.
///
/// # Errors
/// When the device fails or a kernel's result is wrong.
pub fn measure(context: &Context, mebibytes: usize) -> Result<Ceilings, CeilingError> {
    let largest = usize::try_from(context.largest_binding()).unwrap_or(usize::MAX);
    // Workgroups along one axis are at most 65,535.
    let words = (mebibytes << 18).min(largest / 4).min(65_535 * 256 * 4) & !3;
    let stream = context.kernel("ceiling/stream.wgsl", STREAM, "stream")?;
    let from: Vec<u32> = (0..words as u32).collect();
    let source = [context.upload(&from)?];
    let groups = [words.div_ceil(4 * 256) as u32, 1];
    let mut fastest = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        let (copied, spent) = context.metered(|| context.run_after(&stream, groups, &source, &[], words))?;
        if copied? != from {
            return Err(CeilingError::Wrong("copy"));
        }
        fastest[0] = fastest[0].min(seconds(&spent));
    }
    let chain = context.kernel("ceiling/chain.wgsl", CHAIN, "chain")?;
    let start = [0.5f32, 0.5, 3.0, -2.0, 0.25, 7.0].map(f32::to_bits);
    let chains = (mebibytes << 12).clamp(256, 65_535 * 256);
    for _ in 0..ROUNDS {
        let groups = [chains.div_ceil(256) as u32, 1];
        let (ends, spent) = context.metered(|| context.run(&chain, groups, &start, chains))?;
        if !ends?.iter().all(|end| f32::from_bits(*end) == 1.0) {
            return Err(CeilingError::Wrong("chain"));
        }
        fastest[1] = fastest[1].min(seconds(&spent));
    }
    Ok(Ceilings {
        bytes_per_second: 8.0 * words as f64 / fastest[0],
        operations_per_second: (OPERATIONS * chains as u64) as f64 / fastest[1],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::device;

    #[test]
    fn a_device_moves_and_computes_at_a_finite_rate_and_a_chain_that_ends_elsewhere_is_wrong() {
        let Some(context) = device() else { return };
        let found = measure(&context, 1).unwrap();
        eprintln!("{}: {found:?}", context.description().name);
        assert!(found.bytes_per_second.is_finite() && found.bytes_per_second > 1e6, "{found:?}");
        assert!(found.operations_per_second.is_finite() && found.operations_per_second > 1e6, "{found:?}");
        let other = CHAIN.replace("x.x + x.y", "x.x + 2.0 * x.y");
        assert_ne!(other, CHAIN);
        let kernel = context.kernel("ceiling/chain.wgsl", &other, "chain").unwrap();
        let start = [0.5f32, 0.5, 3.0, -2.0, 0.25, 7.0].map(f32::to_bits);
        let ends = context.run(&kernel, [1, 1], &start, 256).unwrap();
        assert!(ends.iter().all(|end| f32::from_bits(*end) != 1.0));
    }
}
