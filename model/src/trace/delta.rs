//! How long a candidate segment is: guesses that prove nothing and cost a bound when they are wrong.

use super::Settings;
use super::stride::Segment;
use crate::interval::Interval;

/// The first candidate, in heights.
const FIRST: f64 = 0.8;
/// What a candidate that was clear at once makes of the number of heights.
const SUCCESS: f64 = 1.2;
/// Where h is seen to fall, the candidate reaches past the expected root.
const PAST: f64 = 1.2;
/// A candidate that was not clear is cut to between these shares.
const LEAST: f64 = 0.4;
const MOST: f64 = 0.7;
/// A candidate is at most this many times as long as the one before.
const GROWTH: f64 = 4.0;

/// δ and what it is chosen by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delta {
    /// The candidate, metres.
    pub length: f64,
    /// The height where the ray stands, as far as it is known or expected.
    pub guess: f64,
    /// The mean of dh/dt over what was looked at last.
    pub mean: f64,
    /// How many heights a candidate is long.
    ratio: f64,
}

impl Delta {
    /// At the start of a ray: a share of the `height` above the ground, or all that is left of the ray off the domain.
    pub fn first(height: f64, in_domain: bool, left: f64) -> Delta {
        Delta { length: if in_domain { FIRST * height } else { left }, guess: height, mean: 0.0, ratio: FIRST }
    }
    /// Bounds over the candidate are known.
    pub fn looked(&mut self, segment: &Segment) {
        if self.mean == 0.0 {
            self.mean = Interval::new(-segment.fall, segment.climb).middle();
        }
        self.mean = self.mean.max(-segment.fall).min(segment.climb);
    }
    /// The candidate is behind, by bounds alone; at its end h is between `low` and `high`.
    pub fn cleared(&mut self, segment: &Segment, low: f64, high: f64, settings: &Settings) {
        self.guess = (self.guess + self.mean * segment.span).max(low).min(high);
        self.ratio *= SUCCESS;
        let mut next = if segment.inside { self.ratio * self.guess.max(settings.epsilon) } else { 2.0 * segment.span };
        if segment.inside && segment.climb < 0.0 {
            // h only falls: look past the root.
            next = next.max(PAST * self.guess / -self.mean);
        }
        self.length = next.min(GROWTH * segment.span);
    }
    /// The candidate is behind, by the value at its near end, `guess`.
    pub fn passed(&mut self) {
        self.length = self.ratio * self.guess;
    }
    /// A part of the candidate is behind.
    pub fn stepped(&mut self, step: f64) {
        self.length = 2.0 * step;
    }
    /// The candidate is behind, by the values at both ends; `height` is that at the far one.
    pub fn reached(&mut self, segment: &Segment, height: f64) {
        self.guess = height;
        self.length = self.longest(segment, height).min(2.0 * segment.span);
        self.ratio = self.length / height;
    }
    /// The candidate was not clear: slopes over less will be smaller. `near` is what is clear of it.
    pub fn cut(&mut self, segment: &Segment, height: f64, near: f64) {
        let expected = self.longest(segment, height).max(near);
        self.length = expected.max(LEAST * segment.span).min(MOST * segment.span);
        self.ratio = self.length / height;
    }
    /// The longest segment that the heights at both ends can be expected to prove clear, when h goes on with slope `mean`:
    /// δ ≤ a/fall + (a + mean·δ)/climb.
    fn longest(&self, segment: &Segment, height: f64) -> f64 {
        let (fall, climb) = (segment.fall.max(1e-9), segment.climb.max(1e-9));
        let slack = 1.0 - self.mean / climb;
        if slack <= 0.0 { f64::INFINITY } else { height * (1.0 / fall + 1.0 / climb) / slack }
    }
}
