//! Feature curves: piecewise cubic Béziers with constraint points along them (Hnaidi 2010 §3.1).
//!
//! A constraint point may give an elevation with the half-width of a plateau, slopes to the left and to the right with how far they
//! reach, and a noise with amplitude and roughness; each category is optional. Its place u runs from 0 to 1 by length along the curve.
//! Between the points that give a category, elevations follow a natural cubic spline and everything else is linear (§4.1); before the
//! first and after the last of them the values stay.

use glam::DVec2;

/// An elevation and the plateau around it: (h, r) of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elevation {
    /// h, metres.
    pub height: f64,
    /// r: to each side the elevation holds this far, metres.
    pub radius: f64,
}

/// How the ground falls away to one side: (a, θ) or (b, φ) of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// How far beyond the plateau the slope reaches, metres.
    pub extent: f64,
    /// The slope at its inner end, radians, positive upwards away from the curve; it ramps to 0 at the outer end.
    pub angle: f64,
}

/// Slopes to both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// To the left when looking along the curve.
    pub left: Side,
    /// To the right.
    pub right: Side,
}

/// Noise: (A, R) of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// A, metres.
    pub amplitude: f64,
    /// R: 0 smooth, 1 every octave as strong as the first.
    pub roughness: f64,
}

/// What is wanted at one place of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstraintPoint {
    /// u: 0 at the start of the curve, 1 at its end, by length.
    pub place: f64,
    /// (h, r).
    pub elevation: Option<Elevation>,
    /// (a, b, θ, φ).
    pub gradient: Option<Gradient>,
    /// (A, R).
    pub noise: Option<Noise>,
}

/// Why a curve is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// Control points that do not make pieces of four, ends shared.
    #[error("{found} control points: expected 4, 7, 10, …, since pieces of four share their ends")]
    ControlPoints {
        /// How many there are.
        found: usize,
    },
    /// A coordinate or value that is no finite number.
    #[error("{what} is {value}: expected a finite number")]
    NotFinite {
        /// Which value.
        what: String,
        /// It.
        value: f64,
    },
    /// The curve has no length.
    #[error("the curve has length 0: expected control points that differ")]
    NoLength,
    /// Fewer than two constraint points, or none at an end.
    #[error(
        "{found} constraint points, the first at {first}, the last at {last}: expected at least two, at 0 and at 1"
    )]
    Ends {
        /// How many there are.
        found: usize,
        /// Place of the first.
        first: f64,
        /// Place of the last.
        last: f64,
    },
    /// Places that do not ascend.
    #[error("constraint point {index} is at {place}, after one at {before}: expected places that ascend from 0 to 1")]
    Order {
        /// Number of the point, from 0.
        index: usize,
        /// Its place.
        place: f64,
        /// The place before.
        before: f64,
    },
    /// A value outside its range.
    #[error("constraint point {index}: {what} is {value}, expected {expected}")]
    Range {
        /// Number of the point, from 0.
        index: usize,
        /// Which value.
        what: &'static str,
        /// It.
        value: f64,
        /// The range.
        expected: &'static str,
    },
    /// No category is given anywhere.
    #[error("no constraint point gives an elevation, slopes or a noise: the curve has no effect")]
    Idle,
}

/// A checked curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    control: Vec<DVec2>,
    points: Vec<ConstraintPoint>,
    elevation: Spline,
    radius: Linear,
    /// Extent and tangent of the slope, to the left and to the right.
    sides: [[Linear; 2]; 2],
    noise: [Linear; 2],
    /// Length up to the start of each of `PARTS` parts of each piece, metres; the whole length last.
    lengths: Vec<f64>,
}

/// Parts of a Bézier piece by whose chords its length is measured: one chord of 1/64 is short by less than a part in 10⁴ of a half turn.
const PARTS: usize = 64;

/// What a curve wants at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// h, metres.
    pub elevation: Option<f64>,
    /// r, metres; 0 without an elevation.
    pub radius: f64,
    /// (extent in metres, tangent of the slope) to the left and to the right.
    pub sides: Option<[[f64; 2]; 2]>,
    /// (A in metres, R).
    pub noise: Option<[f64; 2]>,
}

impl Curve {
    /// A curve from control points (four to a piece, ends shared), metres, and constraint points.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn new(control: Vec<DVec2>, points: Vec<ConstraintPoint>) -> Result<Curve, CurveError> {
        if control.len() < 4 || control.len() % 3 != 1 {
            return Err(CurveError::ControlPoints { found: control.len() });
        }
        for (k, p) in control.iter().enumerate() {
            finite(|| format!("x of control point {k}"), p.x)?;
            finite(|| format!("y of control point {k}"), p.y)?;
        }
        check_points(&points)?;
        let over = |get: &dyn Fn(&ConstraintPoint) -> Option<f64>| -> Vec<[f64; 2]> {
            points.iter().filter_map(|point| get(point).map(|value| [point.place, value])).collect()
        };
        let side = |pick: &dyn Fn(&Gradient) -> Side| {
            [
                Linear(over(&|point| point.gradient.as_ref().map(|g| pick(g).extent))),
                Linear(over(&|point| point.gradient.as_ref().map(|g| libm::tan(pick(g).angle)))),
            ]
        };
        let mut curve = Curve {
            elevation: Spline::through(over(&|point| point.elevation.map(|e| e.height))),
            radius: Linear(over(&|point| point.elevation.map(|e| e.radius))),
            sides: [side(&|g| g.left), side(&|g| g.right)],
            noise: [
                Linear(over(&|point| point.noise.map(|n| n.amplitude))),
                Linear(over(&|point| point.noise.map(|n| n.roughness))),
            ],
            control,
            points,
            lengths: Vec::new(),
        };
        let mut total = 0.0;
        for piece in 0..curve.pieces() {
            for part in 0..PARTS {
                curve.lengths.push(total);
                let at = |k: usize| curve.at(piece, k as f64 / PARTS as f64);
                total += at(part).distance(at(part + 1));
            }
        }
        curve.lengths.push(total);
        if total > 0.0 && total.is_finite() { Ok(curve) } else { Err(CurveError::NoLength) }
    }

    /// Its control points, metres.
    pub fn control(&self) -> &[DVec2] {
        &self.control
    }
    /// Its constraint points, by place.
    pub fn points(&self) -> &[ConstraintPoint] {
        &self.points
    }
    /// Number of Bézier pieces.
    pub fn pieces(&self) -> usize {
        self.control.len() / 3
    }
    /// Metres.
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }
    /// The point at parameter `t` of a piece, metres.
    pub fn at(&self, piece: usize, t: f64) -> DVec2 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.control[3 * piece + k]);
        let s = 1.0 - t;
        let (ab, bc, cd) = (a * s + b * t, b * s + c * t, c * s + d * t);
        let (abc, bcd) = (ab * s + bc * t, bc * s + cd * t);
        abc * s + bcd * t
    }
    /// The place u of parameter `t` of a piece.
    pub fn place(&self, piece: usize, t: f64) -> f64 {
        let part = ((t * PARTS as f64) as usize).min(PARTS - 1);
        let k = piece * PARTS + part;
        let along = t * PARTS as f64 - part as f64;
        (self.lengths[k] + along * (self.lengths[k + 1] - self.lengths[k])) / self.length()
    }
    /// Chords that stay within `tolerance` metres of the curve: their ends, and the place u of each.
    ///
    /// A chord over a step of the parameter deviates by at most ⅛·sup‖B″‖·step², and B″ lies between its values at the ends of a piece.
    pub fn polyline(&self, tolerance: f64) -> Vec<(DVec2, f64)> {
        let mut line = vec![(self.control[0], 0.0)];
        for piece in 0..self.pieces() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.control[3 * piece + k]);
            let second = 6.0 * (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
            let parts = libm::ceil((second / (8.0 * tolerance)).sqrt()).clamp(1.0, 65_536.0) as usize;
            for part in 1..=parts {
                let t = part as f64 / parts as f64;
                let next = (self.at(piece, t), self.place(piece, t));
                if next.0 != line[line.len() - 1].0 {
                    line.push(next);
                }
            }
        }
        line
    }
    /// What it wants at place `u`.
    pub fn wanted(&self, u: f64) -> Wanted {
        let elevation = self.elevation.at(u);
        Wanted {
            elevation,
            radius: self.radius.at(u).unwrap_or(0.0),
            sides: self.sides[0][0]
                .at(u)
                .map(|_| [0, 1].map(|side| [0, 1].map(|what: usize| self.sides[side][what].at(u).unwrap_or(0.0)))),
            noise: self.noise[0].at(u).map(|_| [0, 1].map(|what: usize| self.noise[what].at(u).unwrap_or(0.0))),
        }
    }
    /// How far from the curve it wants anything at most, metres.
    pub fn reach(&self) -> f64 {
        let largest = |linear: &Linear| linear.0.iter().fold(0.0f64, |most, [_, value]| most.max(*value));
        let extents = largest(&self.sides[0][0]).max(largest(&self.sides[1][0]));
        largest(&self.radius) + extents
    }
}

fn finite(what: impl FnOnce() -> String, value: f64) -> Result<(), CurveError> {
    if value.is_finite() { Ok(()) } else { Err(CurveError::NotFinite { what: what(), value }) }
}

fn check_points(points: &[ConstraintPoint]) -> Result<(), CurveError> {
    let ends = [points.first(), points.last()].map(|point| point.map_or(f64::NAN, |point| point.place));
    if points.len() < 2 || ends != [0.0, 1.0] {
        return Err(CurveError::Ends { found: points.len(), first: ends[0], last: ends[1] });
    }
    for (index, pair) in points.windows(2).enumerate() {
        let (before, place) = (pair[0].place, pair[1].place);
        // A place that is no number does not ascend either.
        if place.is_nan() || place <= before {
            return Err(CurveError::Order { index: index + 1, place, before });
        }
    }
    const LENGTH: &str = "a finite number of metres, 0 or more";
    for (index, point) in points.iter().enumerate() {
        let range = |what, value: f64, fits: bool, expected| {
            if fits && value.is_finite() { Ok(()) } else { Err(CurveError::Range { index, what, value, expected }) }
        };
        if let Some(Elevation { height, radius }) = point.elevation {
            range("the height", height, true, "a finite number of metres")?;
            range("the radius", radius, radius >= 0.0, LENGTH)?;
        }
        for side in point.gradient.iter().flat_map(|gradient| [gradient.left, gradient.right]) {
            range("the extent of a slope", side.extent, side.extent >= 0.0, LENGTH)?;
            range("the angle of a slope", side.angle, side.angle.abs() < 1.55, "less than 89° either way, in radians")?;
        }
        if let Some(Noise { amplitude, roughness }) = point.noise {
            range("the amplitude", amplitude, amplitude >= 0.0, LENGTH)?;
            range("the roughness", roughness, (0.0..=1.0).contains(&roughness), "0 to 1")?;
        }
    }
    let gives =
        |point: &ConstraintPoint| point.elevation.is_some() || point.gradient.is_some() || point.noise.is_some();
    if points.iter().any(gives) { Ok(()) } else { Err(CurveError::Idle) }
}

/// Linear between (place, value), constant beyond; empty where the category is not given.
#[derive(Clone, Debug, Default, PartialEq)]
struct Linear(Vec<[f64; 2]>);

impl Linear {
    fn at(&self, u: f64) -> Option<f64> {
        let (&[first, a], &[last, b]) = (self.0.first()?, self.0.last()?);
        if u <= first {
            return Some(a);
        }
        if u >= last {
            return Some(b);
        }
        let k = self.0.partition_point(|&[place, _]| place <= u);
        let ([x0, y0], [x1, y1]) = (self.0[k - 1], self.0[k]);
        Some(y0 + (y1 - y0) * ((u - x0) / (x1 - x0)))
    }
}

/// The natural cubic spline through (place, value), constant beyond. It may leave the range of its values between them (claims H9).
#[derive(Clone, Debug, Default, PartialEq)]
struct Spline {
    knots: Vec<[f64; 2]>,
    /// Second derivative at each knot.
    bend: Vec<f64>,
}

impl Spline {
    /// Solves h₋·m₋ + 2(h₋ + h₊)·m + h₊·m₊ = 6·(slope₊ − slope₋) for the second derivatives m, which vanish at both ends.
    fn through(knots: Vec<[f64; 2]>) -> Spline {
        let n = knots.len();
        let mut bend = vec![0.0; n];
        if n > 2 {
            let step = |k: usize| knots[k + 1][0] - knots[k][0];
            let slope = |k: usize| (knots[k + 1][1] - knots[k][1]) / step(k);
            // Thomas's algorithm: the ratio of the upper diagonal, and the right-hand side.
            let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
            for k in 1..n - 1 {
                let pivot = 2.0 * (step(k - 1) + step(k)) - step(k - 1) * upper[k - 1];
                upper[k] = step(k) / pivot;
                right[k] = (6.0 * (slope(k) - slope(k - 1)) - step(k - 1) * right[k - 1]) / pivot;
            }
            for k in (1..n - 1).rev() {
                bend[k] = right[k] - upper[k] * bend[k + 1];
            }
        }
        Spline { knots, bend }
    }
    fn at(&self, u: f64) -> Option<f64> {
        let (&[first, a], &[last, b]) = (self.knots.first()?, self.knots.last()?);
        if u <= first {
            return Some(a);
        }
        if u >= last {
            return Some(b);
        }
        let k = self.knots.partition_point(|&[place, _]| place <= u);
        let ([x0, y0], [x1, y1]) = (self.knots[k - 1], self.knots[k]);
        let (h, p, q) = (x1 - x0, x1 - u, u - x0);
        let (m0, m1) = (self.bend[k - 1], self.bend[k]);
        let bent = (m0 * p * p * p + m1 * q * q * q) / (6.0 * h);
        Some(bent + (y0 / h - m0 * h / 6.0) * p + (y1 / h - m1 * h / 6.0) * q)
    }
}

#[cfg(test)]
#[path = "curve_tests.rs"]
mod tests;
