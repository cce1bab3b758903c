//! The loop of the tracers that ask for bounds over a candidate segment. Over a segment of length δ with slopes of h in
//! [λ₋, λ₊] and the heights a, b at its ends, h(s) ≥ max(a + λ₋·s, b − λ₊·(δ−s)): a value at the far end proves about twice
//! what the near end alone does, and is the near value of the next segment.
//!
//! What is proved is rounded to the safe side, quotients and places along the ray down and lengths up. The height at a point
//! is what `f64` computes, less [`TOUCH`].

use super::delta::Delta;
use super::march::{Settings, TOUCH, ahead, over_down};
use super::{Answer, RayBounds, RayFunction, RayPoint};
use crate::bounds::THRESHOLD;

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

/// A candidate with its bounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Its length, rounded up.
    pub span: f64,
    /// −h′ is at most this.
    pub fall: f64,
    /// h′ is at most this.
    pub climb: f64,
    /// All of it lies in the domain.
    pub inside: bool,
}

impl Segment {
    fn new(t: f64, far: f64, bounds: &RayBounds) -> Segment {
        let (fall, climb) = (-bounds.slope.lo(), bounds.slope.hi());
        Segment { span: (far - t).next_up(), fall, climb, inside: bounds.weight.lo() >= THRESHOLD }
    }
    /// From a point of this height on, h stays positive up to this distance within the segment.
    fn reach(&self, height: f64) -> f64 {
        if self.fall <= 0.0 { f64::INFINITY } else { over_down(height, self.fall) }
    }
    /// The same backwards.
    fn back(&self, height: f64) -> f64 {
        if self.climb <= 0.0 { f64::INFINITY } else { over_down(height, self.climb) }
    }
    /// Do heights at both ends prove all of it?
    fn clear_between(&self, near: f64, far: f64) -> bool {
        (self.reach(near) + self.back(far)).next_down() >= self.span
    }
    /// h at the far end is at least this where it is at least `height` at the near one.
    fn left(&self, height: f64) -> f64 {
        (height - (self.fall.max(0.0) * self.span).next_up()).next_down()
    }
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
    let mut delta = Delta::first(first.height, first.in_domain(), end - t);
    for _ in 0..settings.max_steps {
        if t >= end {
            return Answer::Miss;
        }
        let far = (t + delta.length.min(end - t).max(settings.edge)).max(t.next_up()).min(end);
        let bounds = over(function, t, far);
        let segment = Segment::new(t, far, &bounds);
        delta.looked(&segment);
        let floor = match known {
            Known::AtLeast(floor) => floor,
            Known::Value(here) => here.height - TOUCH,
        };
        let off = bounds.weight.hi() < THRESHOLD;
        if off || bounds.height.lo() > 0.0 || (segment.inside && segment.reach(floor) >= segment.span) {
            let left = bounds.height.lo().max(segment.left(floor)).max(0.0);
            known = Known::AtLeast(if segment.inside { left } else { 0.0 });
            delta.cleared(&segment, left, bounds.height.hi(), settings);
            t = far;
            continue;
        }
        let here = match known {
            Known::Value(point) => point,
            Known::AtLeast(_) => function.value(t),
        };
        known = Known::Value(here);
        delta.guess = here.height;
        // Reached along a stretch that was clear: rounding has put it below.
        if here.solid() || (here.in_domain() && here.height < TOUCH) {
            return Answer::Hit { t };
        }
        let floor = here.height - TOUCH;
        let near = segment.reach(floor);
        if !segment.inside {
            match border(function, settings, &mut delta, (t, end), (&segment, &bounds), (here, near)) {
                Border::Look => {}
                Border::Free(to) => (t, known) = (to, Known::AtLeast(0.0)),
                Border::At(to, point) => (t, known) = (to, Known::Value(point)),
                Border::Met(answer) => return answer,
            }
            continue;
        }
        if near >= segment.span {
            (t, known) = (far, Known::AtLeast(0.0));
            delta.passed();
            continue;
        }
        let short = segment.span <= settings.bracket;
        let expected = here.height + delta.mean * segment.span;
        if segment.climb >= 0.0 && !short && !segment.clear_between(floor, expected) {
            delta.cut(&segment, here.height, near);
            continue;
        }
        let there = function.value(far);
        delta.mean = (there.height - here.height) / segment.span;
        if there.height > TOUCH && segment.clear_between(floor, there.height - TOUCH) {
            (t, known) = (far, Known::Value(there));
            delta.reached(&segment, there.height);
        } else if there.height <= 0.0 && segment.climb < 0.0 {
            return bracket(function, settings, (t, here.height), (far, there.height));
        } else if there.height <= 0.0 && short && here.height < settings.epsilon {
            return Answer::Hit { t };
        } else if short {
            (t, known) = (ahead(t, near, end), Known::AtLeast(0.0));
            delta.stepped(near);
        } else {
            delta.cut(&segment, here.height, near);
        }
    }
    Answer::GaveUp { t }
}

/// What is done where a candidate may meet the border of the domain.
enum Border {
    /// Looks at a shorter candidate.
    Look,
    /// Steps to a place that is clear.
    Free(f64),
    /// Steps to a place that was looked at.
    At(f64, RayPoint),
    /// The solid is met.
    Met(Answer),
}

fn border<F: RayFunction>(
    function: &mut F,
    settings: &Settings,
    delta: &mut Delta,
    (t, end): (f64, f64),
    (segment, bounds): (&Segment, &RayBounds),
    (here, near): (RayPoint, f64),
) -> Border {
    let to_border = over_down((here.weight - THRESHOLD).abs(), bounds.weight_slope.max(f64::MIN_POSITIVE));
    // The segment's length is rounded up; what is stepped within it is not.
    let clear = near.min(segment.span.next_down());
    if here.in_domain() && clear <= to_border {
        delta.stepped(clear);
        return Border::Free(ahead(t, clear, end));
    }
    if to_border < WORTHWHILE * segment.span && segment.span > settings.bracket {
        delta.length = WORTHWHILE * segment.span;
        return Border::Look;
    }
    // The border of the domain may be inside the step, which has a floor.
    let step = to_border.min(segment.span.next_down()).max(settings.edge);
    delta.stepped(step);
    let to = ahead(t, step, end);
    let point = function.value(to);
    if point.solid() {
        return Border::Met(if here.in_domain() { Answer::Hit { t: to } } else { Answer::Wall { t: to } });
    }
    Border::At(to, point)
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
