//! Cross-sections as 1D piecewise quadric functions (Génevaux 2015 §4.1): C¹, constant beyond their ends.

use crate::interval::{Interval, Tri};
use crate::primitive::{Number, Parameters};
use crate::real::{Mask, Operand, Real};
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

/// Slopes over the signed distances `d`: pieces are parabolas, so each is met at its ends.
fn slopes(p: Parameters<f64>, pieces: usize, d: Interval) -> Interval {
    let mut hull: Option<Interval> = None;
    for piece in 0..pieces {
        let k = piece * PIECE_WIDTH;
        let start = if piece == 0 { f64::NEG_INFINITY } else { p.0[k] };
        let end = if piece + 1 < pieces { p.0[k + PIECE_WIDTH] } else { f64::INFINITY };
        let (from, to) = (d.lo().max(start), d.hi().min(end));
        if from > to {
            continue;
        }
        let t = if piece == 0 || piece + 1 == pieces {
            Interval::ZERO
        } else {
            Interval::new(from, to) - Interval::point(p.0[k])
        };
        let here = Interval::point(p.0[k + 2]) + (t + t) * Interval::point(p.0[k + 3]);
        hull = Some(hull.map_or(here, |hull| hull.hull(here)));
    }
    hull.unwrap_or(Interval::ZERO)
}

/// Compiled cross-sections along a skeleton; between two of them heights change with the fade 3t² − 2t³, which keeps the
/// slope along the skeleton continuous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sections {
    count: u16,
    pieces: u16,
    /// All of them are the same on both sides.
    even: bool,
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
    let even = sections.iter().all(|section| mirrored(&section.profile));
    Ok((Sections { count, pieces, even }, out))
}

/// Is a profile the same on both sides?
fn mirrored(knots: &[Knot]) -> bool {
    let same = |(a, b): (&Knot, &Knot)| a.distance == -b.distance && a.height == b.height && a.slope == -b.slope;
    knots.iter().zip(knots.iter().rev()).all(same)
}

/// Over a box: what cross-sections are beside an arc.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// The height.
    pub height: Interval,
    /// Two arcs that read at the same distance differ by a value of one and a value of the other.
    pub differing: Interval,
    /// Is the gradient across the skeleton a normal of it?
    pub settled: bool,
    /// A bound of it.
    pub across: f64,
    /// A bound of how it changes along the skeleton, per metre.
    pub along: f64,
}

impl Sections {
    fn stride(self) -> usize {
        SECTION_WIDTH + usize::from(self.pieces) * PIECE_WIDTH
    }
    /// Appends its numbers of sections and of pieces, and 1 where all are even.
    pub(crate) fn fields(self, out: &mut Vec<u32>) {
        out.extend([u32::from(self.count), u32::from(self.pieces), u32::from(self.even)]);
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
    /// Height at distance `d` from the skeleton, on its left where `side` ≥ d, on its right where −side ≥ d: e(d) + o(side), with
    /// e and o the even and odd part of the section. Where the foot lies on the arc (`inside`), |side| ≥ d.
    #[inline(always)]
    pub fn beside<R: Number, P: Copy + Into<f64>>(self, p: Parameters<P>, d: R, inside: R::Mask, side: R, s: R) -> R {
        if self.even {
            return self.evaluate(p, d, s);
        }
        let side = side.max(-d).min(d);
        if R::ENCLOSES && inside.must_hold() {
            return self.evaluate(p, side, s);
        }
        let even = self.evaluate(p, d, s) + self.evaluate(p, -d, s);
        R::constant(0.5) * (even + (self.evaluate(p, side, s) - self.evaluate(p, -side, s)))
    }
    /// The same over a box, with slope bounds. Two sections are passed between by h₀ + ω(t)·(h₁ − h₀), ω′ = 6t(1 − t). Where the
    /// side is within ±d it moves twice as fast as the point does.
    pub fn enclose(self, p: Parameters<f64>, d: Interval, inside: bool, side: Interval, s: Interval) -> Beside {
        let height = self.beside(p, d, if inside { Tri::Yes } else { Tri::Maybe }, side, s);
        let clamped = Real::min(Real::max(side, -d), d);
        let settled = self.even || inside || side.mignitude() >= d.hi();
        let half = Interval::point(0.5);
        let uniform = self.count == 1;
        let differing = if !uniform {
            height
        } else if self.even {
            Interval::ZERO
        } else {
            half * (self.evaluate(p, clamped, s) - self.evaluate(p, -clamped, s))
        };
        let (mut across, mut along) = (0.0f64, 0.0f64);
        let pieces = usize::from(self.pieces);
        let section = |k: usize| p.from(k * self.stride() + SECTION_WIDTH);
        let at = |k: usize| Interval::point(p.0[k * self.stride()]);
        let last = usize::from(self.count) - 1;
        for k in 0..=last {
            let before_next = k == last || s.lo() <= at(k + 1).hi();
            let after_previous = k == 0 || s.hi() >= at(k - 1).lo();
            if before_next && after_previous {
                let slopes = |d: Interval| slopes(section(k), pieces, d);
                let slope = if self.even {
                    slopes(d).magnitude()
                } else if settled {
                    slopes(clamped).magnitude()
                } else {
                    let even = (half * (slopes(d) - slopes(-d))).magnitude();
                    let odd = (half * (slopes(clamped) + slopes(-clamped))).magnitude();
                    (Interval::point(even) + Interval::point(2.0) * Interval::point(odd)).hi()
                };
                across = across.max(slope);
            }
            if k < last && s.lo() <= at(k + 1).hi() && s.hi() >= at(k).lo() {
                let per_metre = Interval::point(p.0[k * self.stride() + 1]);
                let t = ((s - at(k)) * per_metre).clamp01();
                // t(1 − t) = 1/4 − (t − 1/2)².
                let bump = Interval::point(0.25) - (t - half).square();
                let rise = |d: Interval| evaluate(section(k + 1), pieces, d) - evaluate(section(k), pieces, d);
                let rise = if self.even {
                    rise(d)
                } else if settled {
                    rise(clamped)
                } else {
                    // Even and odd part together.
                    let both = rise(Interval::symmetric(d.hi()));
                    both + both
                };
                along = along.max((Interval::point(6.0) * bump * per_metre * rise).magnitude());
            }
        }
        Beside { height, differing, settled, across, along }
    }
}
