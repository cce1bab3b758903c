//! Cross-sections as 1D piecewise quadric functions (Génevaux 2015 §4.1): C¹, constant beyond their ends.

use crate::primitive::{Number, Parameters};
use crate::real::{Mask, Operand};
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

/// A cross-section and where along a skeleton it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Metres along the skeleton.
    pub at: f64,
    /// The cross-section.
    pub profile: Vec<Knot>,
}

/// Are the knots of a profile finite and sorted?
///
/// # Errors
/// Which knots are not, in one line.
pub fn check(knots: &[Knot]) -> Result<(), String> {
    if let Some(k) = knots.iter().position(|k| !(k.distance + k.height + k.slope).is_finite()) {
        return Err(format!("knot {} of a profile is not finite", k + 1));
    }
    match knots.windows(2).position(|k| k[0].distance >= k[1].distance) {
        Some(k) => {
            Err(format!("the knots of a profile need increasing distances; knots {} and {} do not", k + 1, k + 2))
        }
        None => Ok(()),
    }
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

/// Compiled cross-sections along a skeleton; between two of them heights change with the fade 3t² − 2t³, which keeps the
/// slope along the skeleton continuous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sections {
    count: u16,
    pieces: u16,
}

/// Parameters of a section before its pieces: where it stands, and 1 over the distance to the next.
const SECTION_WIDTH: usize = 2;

/// Cross-sections and their parameters. No sections, or one without knots, are flat.
///
/// # Errors
/// Knots or sections that are not finite and sorted, or more than 65 535 of them.
pub fn compile_sections(sections: &[Section]) -> Result<(Sections, Vec<f64>), String> {
    let flat = [Section { at: 0.0, profile: Vec::new() }];
    let sections = if sections.is_empty() { &flat } else { sections };
    for section in sections {
        check(&section.profile)?;
    }
    if !sections.windows(2).all(|s| s[0].at < s[1].at) || !sections.iter().all(|s| s.at.is_finite()) {
        return Err("the sections of a curve need increasing, finite abscissae `at`".to_owned());
    }
    let compiled: Vec<Vec<f64>> = sections.iter().map(|section| compile(&section.profile)).collect();
    let width = compiled.iter().map(Vec::len).max().unwrap_or(0);
    let pieces = width / PIECE_WIDTH;
    let (Ok(count), Ok(pieces)) = (u16::try_from(sections.len()), u16::try_from(pieces)) else {
        return Err("a curve holds at most 65535 sections, each of at most 32767 knots".to_owned());
    };
    let mut out = Vec::new();
    for (k, mut section) in compiled.into_iter().enumerate() {
        out.push(sections[k].at);
        out.push(sections.get(k + 1).map_or(0.0, |next| 1.0 / (next.at - sections[k].at)));
        // All sections have as many pieces as the longest: the last one, a constant, is repeated.
        let last = section[section.len() - PIECE_WIDTH..].to_vec();
        while section.len() < width {
            section.extend(&last);
        }
        out.extend(section);
    }
    Ok((Sections { count, pieces }, out))
}

impl Sections {
    fn stride(self) -> usize {
        SECTION_WIDTH + usize::from(self.pieces) * PIECE_WIDTH
    }
    /// Number of parameters.
    pub fn width(self) -> usize {
        usize::from(self.count) * self.stride()
    }
    /// Height above the skeleton at signed distance `d` and abscissa `s`.
    #[inline(always)]
    pub fn evaluate<R: Number, P: Copy + Into<f64>>(self, p: Parameters<P>, d: R, s: R) -> R {
        let at = |k: usize| evaluate(p.from(k * self.stride() + SECTION_WIDTH), usize::from(self.pieces), d);
        let mut height = at(0);
        for k in 1..usize::from(self.count) {
            let from = p.from((k - 1) * self.stride());
            let t = ((s - from.get(0)) * from.get(1)).clamp01();
            if R::zero().less(t).may_hold() {
                let weight = t.square() * (R::constant(3.0) - t - t);
                let parts = [Operand::new(height, R::one() - weight), Operand::new(at(k), weight)];
                height = R::weighted_mean(&parts, 0.5).elevation;
            }
        }
        height
    }
}
