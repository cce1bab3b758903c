//! Cross-sections as 1D piecewise quadric functions (Génevaux 2015 §4.1): C¹, constant beyond their ends.

use crate::primitive::{Number, Parameters};
use serde::{Deserialize, Serialize};

/// Parameters of a piece: where it starts, and the coefficients of 1, t, t² with t measured from there.
pub const PIECE_WIDTH: usize = 4;

/// One point of an authored cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knot {
    /// Signed distance from the skeleton, metres, positive on the left.
    pub distance: f64,
    /// Height above the skeleton, metres.
    pub height: f64,
    /// Slope at the knot.
    #[serde(default)]
    pub slope: f64,
}

/// The C¹ piecewise quadric through the knots: two parabolas per interval that meet halfway, flat beyond the ends.
/// Returns the pieces' parameters, [`PIECE_WIDTH`] each. Knots must be sorted and finite; a profile without knots is 0.
pub fn compile(knots: &[Knot]) -> Vec<f64> {
    let Some((first, last)) = knots.first().zip(knots.last()) else { return vec![0.0, 0.0, 0.0, 0.0] };
    let mut pieces = vec![first.distance, first.height, 0.0, 0.0];
    for pair in knots.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let h = 0.5 * (b.distance - a.distance);
        // The slope at the middle follows from the heights; both halves are then quadratic Hermite pieces.
        let middle_slope = (b.height - a.height) / h - 0.5 * (a.slope + b.slope);
        let c0 = (middle_slope - a.slope) / (2.0 * h);
        let middle_height = a.height + h * (a.slope + h * c0);
        let c1 = (b.slope - middle_slope) / (2.0 * h);
        pieces.extend([a.distance, a.height, a.slope, c0]);
        pieces.extend([a.distance + h, middle_height, middle_slope, c1]);
    }
    pieces.extend([last.distance, last.height, 0.0, 0.0]);
    pieces
}

/// The cross-section at signed distance `d`. The first piece is the constant left of its start; the others hold from
/// their start on.
#[inline(always)]
pub fn evaluate<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, pieces: usize, d: R) -> R {
    let mut height = p.get::<R>(1);
    for piece in 1..pieces {
        let k = piece * PIECE_WIDTH;
        let start = p.get::<R>(k);
        // Clamped to its own interval, so that an interval argument does not extrapolate the parabola.
        let end = if piece + 1 < pieces { d.min(p.get(k + PIECE_WIDTH)) } else { d };
        let t = (end - start).max(R::zero());
        let value = p.get::<R>(k + 1) + t * (p.get::<R>(k + 2) + t * p.get::<R>(k + 3));
        height = R::select(d.less(start), height, value);
    }
    height
}
