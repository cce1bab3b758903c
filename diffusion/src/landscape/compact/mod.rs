//! The compact form of a landscape, for the sizes of Hnaidi 2010 Table 1: 16 bits a number.
//!
//! Little-endian. The header is exact: `TCC1`, the frame, and the ranges of all numbers of the curves, each widened to an `f32`. A number
//! is kept as its place among the 65 536 evenly spaced ones of its range, an angle among 65 535 around 0. Names of curves are not kept.
//!
//! ```text
//! curve   count of points of the path · 4 + kind (0 Bézier, 1 smooth, 2 ring)     varint
//!         x, y of each                                                            2 × 16 bits
//!         count of constraint points                                              varint
//! point   what follows, and what is as before                                     8 bits, see the constants
//!         u, but for the first and the last                                       16 bits
//!         height · radius · extent, angle to the left · to the right · A, R       16 bits each
//! ```

mod read;
mod write;

use super::{Feature, Frame, Landscape, LandscapeError};

const MAGIC: &[u8; 4] = b"TCC1";

/// A height follows.
const HEIGHT: u8 = 1;
/// A radius follows; else the height has that of the elevation before, 0 at first.
const RADIUS: u8 = 2;
/// There are slopes.
const SLOPES: u8 = 4;
/// They are those before, and nothing follows.
const SAME_SLOPES: u8 = 8;
/// They are equal to both sides, and only the left one follows.
const EVEN: u8 = 16;
/// There is a noise.
const NOISE: u8 = 32;
/// It is the one before, and nothing follows.
const SAME_NOISE: u8 = 64;

/// The range of one kind of number, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    low: f32,
    high: f32,
}

impl Range {
    /// The narrowest that holds `values`; only 0 if there are none.
    fn of(values: impl Iterator<Item = f64> + Clone) -> Range {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| values.clone().fold(start, pick);
        let (low, high) = (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return Range { low: 0.0, high: 0.0 };
        }
        let (down, up) = (low as f32, high as f32);
        Range {
            low: if f64::from(down) > low { down.next_down() } else { down },
            high: if f64::from(up) < high { up.next_up() } else { up },
        }
    }
    fn width(self) -> f64 {
        f64::from(self.high) - f64::from(self.low)
    }
    fn code(self, value: f64) -> u16 {
        let part = (value - f64::from(self.low)) / self.width();
        // A range of one value has no width, and its code is 0.
        (part * 65_535.0).round() as u16
    }
    fn value(self, code: u16) -> f64 {
        f64::from(self.low) + self.width() * f64::from(code) / 65_535.0
    }
    /// Half of the step between two codes.
    fn error(self) -> f64 {
        self.width() / 131_070.0
    }
}

/// Ranges of all numbers of the curves. Radii, extents, amplitudes start at 0, so that 0 stays 0; so does a level slope.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ranges {
    x: Range,
    y: Range,
    height: Range,
    radius: Range,
    extent: Range,
    /// From minus to plus the steepest.
    angle: Range,
    amplitude: Range,
}

const UNIT: Range = Range { low: 0.0, high: 1.0 };

/// The largest error of each kind of number in the compact form: half of the step between two values, up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Of x and of y of the points of paths, metres, relative to the landscape's origin.
    pub position: [f64; 2],
    /// Of u; more where constraint points are nearer than a step, since they stay apart by one.
    pub place: f64,
    /// Metres.
    pub height: f64,
    /// Metres.
    pub radius: f64,
    /// Metres.
    pub extent: f64,
    /// Radians.
    pub angle: f64,
    /// Metres.
    pub amplitude: f64,
    /// Of R.
    pub roughness: f64,
}

impl Ranges {
    fn of(frame: &Frame, features: &[Feature]) -> Ranges {
        let origin = frame.origin;
        let positions = features.iter().flat_map(|feature| feature.path.points());
        let points = features.iter().flat_map(|feature| &feature.points);
        let elevations = points.clone().filter_map(|point| point.elevation);
        let sides = points.clone().filter_map(|point| point.gradient).flat_map(|g| [g.left, g.right]);
        let amplitudes = points.filter_map(|point| point.noise).map(|noise| noise.amplitude);
        let zero = std::iter::once(0.0);
        let steepest = sides.clone().fold(0.0f64, |most, side| most.max(side.angle.abs()));
        Ranges {
            x: Range::of(positions.clone().map(|p| p.x - origin.x)),
            y: Range::of(positions.map(|p| p.y - origin.y)),
            height: Range::of(elevations.clone().map(|e| e.height)),
            radius: Range::of(zero.clone().chain(elevations.map(|e| e.radius))),
            extent: Range::of(zero.clone().chain(sides.map(|side| side.extent))),
            angle: Range::of([-steepest, steepest].into_iter()),
            amplitude: Range::of(zero.chain(amplitudes)),
        }
    }
    fn all(&mut self) -> [&mut Range; 7] {
        let Ranges { x, y, height, radius, extent, angle, amplitude } = self;
        [x, y, height, radius, extent, angle, amplitude]
    }
    fn precision(&self) -> Precision {
        Precision {
            position: [self.x.error(), self.y.error()],
            place: UNIT.error(),
            height: self.height.error(),
            radius: self.radius.error(),
            extent: self.extent.error(),
            angle: f64::from(self.angle.high) / 65_534.0,
            amplitude: self.amplitude.error(),
            roughness: UNIT.error(),
        }
    }
    fn angle_code(&self, angle: f64) -> u16 {
        let most = f64::from(self.angle.high);
        let signed = if most > 0.0 { (angle / most * 32_767.0).round() as i16 } else { 0 };
        signed as u16
    }
    fn angle(&self, code: u16) -> f64 {
        f64::from(self.angle.high) * f64::from(code as i16) / 32_767.0
    }
}

impl Landscape {
    /// What [`Landscape::to_compact`] loses.
    pub fn compact_precision(&self) -> Precision {
        Ranges::of(&self.frame, &self.features).precision()
    }
    /// The compact form. What it loses ([`Landscape::compact_precision`]) changes the elevations of the six models at 129² by less than
    /// 10⁻⁴ of their range on average; a node at the edge of a plateau may fall to the other side of it, and single ones change by up
    /// to a twentieth (tested).
    ///
    /// # Errors
    /// [`LandscapeError`] of a curve that 16 bits leave nothing of: way-points nearer to each other than a step.
    pub fn to_compact(&self) -> Result<Vec<u8>, LandscapeError> {
        let bytes = write::write(&self.frame, &self.features);
        Landscape::from_compact(&bytes)?;
        Ok(bytes)
    }
    /// Reads the compact form.
    ///
    /// # Errors
    /// [`LandscapeError::Bytes`] with the place for bytes that are none, [`LandscapeError::Value`] for curves that are none.
    pub fn from_compact(bytes: &[u8]) -> Result<Landscape, LandscapeError> {
        let (frame, features) = read::read(bytes)
            .map_err(|(offset, problem)| LandscapeError::Bytes { offset, problem: problem.to_owned() })?;
        Landscape::new(frame, features)
    }
}

#[cfg(test)]
mod tests;
