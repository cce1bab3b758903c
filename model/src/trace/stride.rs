//! The loop of the tracers that ask for bounds over a candidate segment. Over a segment of length δ with slopes of h in
//! [λ₋, λ₊] and the heights a, b at its ends, h(s) ≥ max(a + λ₋·s, b − λ₊·(δ−s)): a value at the far end proves about twice
//! what the near end alone does, and is the near value of the next segment.

use super::march::{DEFLATE, Settings, TOUCH};
use super::{Answer, RayBounds, RayFunction, RayPoint};
use crate::bounds::THRESHOLD;

/// The first candidate, in heights.
const FIRST: f64 = 0.8;
/// What a candidate that was clear at once makes of the number of heights.
const SUCCESS: f64 = 1.2;
/// The share of the longest segment that may be expected to be clear that is asked for.
const BOLD: f64 = 1.0;
/// Where h is seen to fall, the candidate reaches past the expected root.
const PAST: f64 = 1.2;
/// A candidate that was not clear is cut to between these shares.
const LEAST: f64 = 0.4;
const MOST: f64 = 0.7;

/// A candidate is at most this many times as long as the one before.
const GROWTH: f64 = 4.0;
/// Where the border of the domain may be near, a candidate is cut until a step covers at least this share of it.
const WORTHWHILE: f64 = 0.2;

/// What is known where the ray stands.
#[derive(Clone, Copy)]
enum Known {
    /// The height is at least this, in the domain, or it is off the domain.
    AtLeast(f64),
    /// It was asked for.
    Value(RayPoint),
}

/// Traces with the bounds that `over(function, t0, t1)` gives.
pub(super) fn stride<F: RayFunction>(
    function: &mut F,
    settings: &Settings,
    mut over: impl FnMut(&mut F, f64, f64) -> RayBounds,
) -> Answer {
    let Some((start, end)) = function.span() else { return Answer::Miss };
    let mut t = start.max(0.0);
    if t > end {
        return Answer::Miss;
    }
    let first = function.value(t);
    if first.solid() {
        return Answer::Wall { t };
    }
    let mut known = Known::Value(first);
    // Guesses that choose δ and prove nothing: the height at t, dh/dt, and how many heights long a candidate may be.
    let (mut guess, mut mean, mut ratio) = (first.height, 0.0f64, FIRST);
    let mut delta = if first.in_domain() { ratio * guess } else { end - t };
    for _ in 0..settings.max_steps {
        if t >= end {
            return Answer::Miss;
        }
        delta = delta.min(end - t).max(settings.edge);
        let bounds = over(function, t, t + delta);
        let (fall, climb) = (-bounds.slope.lo(), bounds.slope.hi());
        if mean == 0.0 {
            mean = bounds.slope.middle();
        }
        mean = mean.max(-fall).min(climb);
        let inside = bounds.weight.lo() >= THRESHOLD;
        let reach = |height: f64| if fall <= 0.0 { f64::INFINITY } else { height / fall * DEFLATE };
        let floor = match known {
            Known::AtLeast(floor) => floor,
            Known::Value(here) => here.height,
        };
        if bounds.weight.hi() < THRESHOLD || bounds.height.lo() > 0.0 || (inside && reach(floor) >= delta) {
            let left = bounds.height.lo().max((floor - fall.max(0.0) * delta) * DEFLATE - TOUCH).max(0.0);
            t = after(t, delta, end);
            known = Known::AtLeast(if inside { left } else { 0.0 });
            guess = (guess + mean * delta).max(left).min(bounds.height.hi());
            ratio *= SUCCESS;
            let before = delta;
            delta = if inside { ratio * guess.max(settings.epsilon) } else { 2.0 * delta };
            if inside && climb < 0.0 {
                // h only falls: look past the root.
                delta = delta.max(PAST * guess / -mean);
            }
            delta = delta.min(GROWTH * before);
            continue;
        }
        let here = match known {
            Known::Value(point) => point,
            Known::AtLeast(_) => function.value(t),
        };
        known = Known::Value(here);
        guess = here.height;
        // Reached along a stretch that was clear: rounding has put it below.
        if here.solid() || (here.in_domain() && here.height < TOUCH) {
            return Answer::Hit { t };
        }
        let near = reach(here.height);
        if !inside {
            let to_border = (here.weight - THRESHOLD).abs() / bounds.weight_slope.max(f64::MIN_POSITIVE);
            if here.in_domain() && near.min(delta) <= to_border {
                let step = near.min(delta);
                (t, known, delta) = (after(t, step, end), Known::AtLeast(0.0), 2.0 * step);
                continue;
            }
            if to_border < WORTHWHILE * delta && delta > settings.bracket {
                delta *= WORTHWHILE;
                continue;
            }
            // The border of the domain may be inside the step, which has a floor.
            let step = (to_border.min(delta) * DEFLATE).max(settings.edge);
            t = after(t, step, end);
            let point = function.value(t);
            if point.solid() {
                return if here.in_domain() { Answer::Hit { t } } else { Answer::Wall { t } };
            }
            (known, delta) = (Known::Value(point), 2.0 * step);
            continue;
        }
        if near >= delta {
            (t, known, delta) = (after(t, delta, end), Known::AtLeast(0.0), ratio * guess);
            continue;
        }
        let back = |height: f64| if climb <= 0.0 { f64::INFINITY } else { height / climb * DEFLATE };
        let short = delta <= settings.bracket;
        let expected = here.height + mean * delta;
        let shorter = longest(here.height, fall, climb, mean).max(near).max(LEAST * delta).min(MOST * delta);
        if climb >= 0.0 && near + back(expected) < delta && !short {
            // The slopes over less will be smaller.
            delta = shorter;
            ratio = delta / here.height;
            continue;
        }
        let far = after(t, delta, end);
        let there = function.value(far);
        let span = far - t;
        mean = (there.height - here.height) / span;
        if there.height > 0.0 {
            if near + back(there.height) >= span {
                (t, known, guess) = (far, Known::Value(there), there.height);
                delta = longest(there.height, fall, climb, mean).min(2.0 * span);
                ratio = delta / there.height;
            } else if short {
                t = after(t, near, end);
                (known, delta) = (Known::AtLeast(0.0), 2.0 * near);
            } else {
                delta = shorter;
                ratio = delta / here.height;
            }
            continue;
        }
        // The surface is met inside.
        if climb < 0.0 {
            return bracket(function, settings, (t, here.height), (far, there.height));
        }
        if here.height < settings.epsilon && short {
            return Answer::Hit { t };
        }
        delta = shorter;
        if short {
            (t, known) = (after(t, near, end), Known::AtLeast(0.0));
        }
    }
    Answer::GaveUp { t }
}

/// The longest segment that two heights can be expected to prove clear, when h goes on with slope `mean`:
/// δ ≤ a/fall + (a + mean·δ)/climb.
fn longest(height: f64, fall: f64, climb: f64, mean: f64) -> f64 {
    let (fall, climb) = (fall.max(1e-9), climb.max(1e-9));
    let slack = 1.0 - mean / climb;
    if slack <= 0.0 { f64::INFINITY } else { BOLD * height * (1.0 / fall + 1.0 / climb) / slack }
}

/// The root between a point above and one below, where h decreases: by secants kept inside the bracket (Illinois).
fn bracket<F: RayFunction>(function: &mut F, settings: &Settings, above: (f64, f64), below: (f64, f64)) -> Answer {
    let (mut a, mut ha) = above;
    let (mut b, hb) = below;
    // The heights that aim: an end that stays loses half of its own each time, else it would stay for ever.
    let (mut wa, mut wb) = (ha, hb);
    for _ in 0..settings.max_steps {
        if ha < settings.epsilon && b - a <= settings.bracket {
            break;
        }
        let aim = a + (b - a) * wa / (wa - wb);
        // A little to the near side: the answer is a point above.
        let m = (aim - 0.5 * settings.epsilon).max(a + 0.01 * (b - a)).min(b);
        if m <= a || m >= b {
            break;
        }
        let h = function.value(m).height;
        if h >= 0.0 {
            (a, ha, wa) = (m, h, h);
            wb *= 0.5;
        } else {
            (b, wb) = (m, h);
            wa *= 0.5;
        }
    }
    Answer::Hit { t: a }
}

/// A step below the spacing of numbers at t would stand still.
fn after(t: f64, advance: f64, end: f64) -> f64 {
    (t + advance).max(t.next_up()).min(end)
}
