//! Stored certificates: the splits that led to a proof, so that a long search is checked without being repeated. The
//! checker knows nothing of how the splits were found: it follows them and asks for an upper bound on each leaf.
//!
//! A file is a sequence of pieces in the order of the root's cutting, each a length in bytes (`u32`, little endian)
//! and bits from the lowest up, in depth-first order, low half first: 0 for a leaf, 1 and then the axis in 3 bits for
//! a split.

use super::{Objective, Search, Verdict, halves, join, pieces};
use crate::interval::Interval;
use rayon::prelude::*;
use thiserror::Error;

/// Proves as [`prove_below`](super::prove_below) does, and returns the splits too when it succeeds.
pub fn record<const N: usize>(
    objective: &impl Objective<N>,
    root: [Interval; N],
    target: f64,
    budget: u64,
) -> (Verdict<N>, Vec<u8>) {
    let results: Vec<(Verdict<N>, Bits)> = pieces(root)
        .par_iter()
        .map(|piece| {
            let mut bits = Bits::default();
            let mut search = Search { objective, target, budget, boxes: 0, worst: f64::NEG_INFINITY };
            let verdict = search.run(*piece, &mut |split| match split {
                None => bits.push(0, 1),
                Some(axis) => bits.push(1 | (axis as u8) << 1, 4),
            });
            (verdict, bits)
        })
        .collect();
    let mut file = Vec::new();
    for (_, bits) in &results {
        file.extend((bits.bytes.len() as u32).to_le_bytes());
        file.extend(&bits.bytes);
    }
    (join(results.into_iter().map(|(verdict, _)| verdict).collect()), file)
}

/// Why a stored certificate was turned down.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CheckError {
    /// The bytes do not describe a split of the root.
    #[error("the certificate is malformed in piece {piece}")]
    Malformed {
        /// Number of the piece.
        piece: usize,
    },
    /// A leaf's bound exceeds the target.
    #[error("piece {piece} has a leaf bounded by {bound} only")]
    TooHigh {
        /// Number of the piece.
        piece: usize,
        /// The bound found.
        bound: f64,
    },
}

/// Checks the pieces of a stored certificate that `chosen` picks (all, for a proof) and returns the number of leaves
/// looked at.
pub fn check<const N: usize>(
    objective: &impl Objective<N>,
    root: [Interval; N],
    target: f64,
    file: &[u8],
    chosen: impl Fn(usize) -> bool + Sync,
) -> Result<u64, CheckError> {
    let roots = pieces(root);
    let mut rest = file;
    let mut parts = Vec::new();
    for (piece, root) in roots.into_iter().enumerate() {
        let Some((length, tail)) = rest.split_first_chunk::<4>() else { return Err(CheckError::Malformed { piece }) };
        let length = u32::from_le_bytes(*length) as usize;
        if tail.len() < length {
            return Err(CheckError::Malformed { piece });
        }
        parts.push((piece, root, &tail[..length]));
        rest = &tail[length..];
    }
    if !rest.is_empty() {
        return Err(CheckError::Malformed { piece: parts.len() });
    }
    let counts: Result<Vec<u64>, CheckError> = parts
        .into_par_iter()
        .filter(|part| chosen(part.0))
        .map(|(piece, root, bytes)| check_piece(objective, piece, root, target, bytes))
        .collect();
    Ok(counts?.iter().sum())
}

fn check_piece<const N: usize>(
    objective: &impl Objective<N>,
    piece: usize,
    root: [Interval; N],
    target: f64,
    bytes: &[u8],
) -> Result<u64, CheckError> {
    let malformed = CheckError::Malformed { piece };
    let mut position = 0;
    let mut bit = || {
        let byte = bytes.get(position / 8).ok_or(malformed)?;
        position += 1;
        Ok(byte >> ((position - 1) % 8) & 1)
    };
    let mut stack = vec![root];
    let mut leaves = 0;
    while let Some(part) = stack.pop() {
        if bit()? == 1 {
            let axis = bit()? as usize + 2 * bit()? as usize + 4 * bit()? as usize;
            if axis >= N {
                return Err(malformed);
            }
            let [low, high] = halves(part, axis);
            stack.push(high);
            stack.push(low);
        } else if !objective.outside(&part) {
            leaves += 1;
            let bound = objective.upper(&part, target).bound;
            // Written so that a NaN is turned down.
            if !matches!(bound.partial_cmp(&target), Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)) {
                return Err(CheckError::TooHigh { piece, bound });
            }
        }
    }
    Ok(leaves)
}

/// Bits packed from the lowest up.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    length: usize,
}

impl Bits {
    fn push(&mut self, value: u8, count: usize) {
        for k in 0..count {
            if self.length.is_multiple_of(8) {
                self.bytes.push(0);
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= (value >> k & 1) << (self.length % 8);
            }
            self.length += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::noise::{Gradient2, Slope};

    #[test]
    fn a_stored_proof_is_accepted_and_a_tampered_one_is_not() {
        let slope = Slope { noise: Gradient2, face: 0, ordered: false };
        let root = [Interval::new(0.0, 0.5), Interval::UNIT, Interval::UNIT];
        let (verdict, file) = record(&slope, root, 2.1, 100_000);
        let Verdict::Proved { boxes, .. } = verdict else { panic!("{verdict:?}") };
        let leaves = check(&slope, root, 2.1, &file, |_| true).expect("accepted");
        assert!(leaves > 256 && leaves < boxes);
        // Controls: a lower target, a lost split, lost bytes, bytes too many.
        assert!(matches!(check(&slope, root, 2.07, &file, |_| true), Err(CheckError::TooHigh { .. })));
        let mut cut = file.clone();
        let split = (0..256).scan(0, |at, _| {
            let start = *at;
            *at += 4 + u32::from_le_bytes([cut[start], cut[start + 1], cut[start + 2], cut[start + 3]]) as usize;
            Some(start)
        });
        let split = split.filter(|&at| cut[at + 4] & 1 == 1).last().expect("some piece is split");
        cut[split + 4] &= !1;
        assert!(check(&slope, root, 2.1, &cut, |_| true).is_err());
        assert!(check(&slope, root, 2.1, &file[..file.len() - 1], |_| true).is_err());
        let mut long = file;
        long.push(0);
        assert!(check(&slope, root, 2.1, &long, |_| true).is_err());
    }
}
