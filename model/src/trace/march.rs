//! When a marching tracer stops, and the loop of those that ask for a value after every step: advance by a step that is
//! safe, confirm a hit by a change of sign. Tracers that ask for bounds over segments have a loop of their own, `stride`.

use super::{Answer, RayFunction, RayPoint};

/// When a tracer stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// ε: a hit is reported where 0 ≤ h < ε, metres of height.
    pub epsilon: f64,
    /// How far behind the reported point the sign may change at most, metres along the ray.
    pub bracket: f64,
    /// Where the domain's border is approached, the least step, metres: what is thinner can be passed unseen.
    pub edge: f64,
    /// Steps before giving up.
    pub max_steps: u32,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { epsilon: 1e-3, bracket: 1e-2, edge: 1e-7, max_steps: 200_000 }
    }
}

/// Below this height a point counts as on the surface: rounding of `h` itself, metres.
pub(super) const TOUCH: f64 = 1e-9;

/// a / b rounded down, for b > 0.
pub(super) fn over_down(a: f64, b: f64) -> f64 {
    (a / b).next_down()
}

/// The place at most `step` ahead of `t`, rounded down: the sum is off by at most half of what `next_down` takes. A step below
/// the spacing of numbers at t would stand still.
pub(super) fn ahead(t: f64, step: f64, end: f64) -> f64 {
    (t + step).next_down().max(t.next_up()).min(end)
}

/// How far one may go from a point.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// No surface within this distance.
    Free(f64),
    /// The bound covers this much only; the border of the domain may be inside, so the step has a floor.
    Border(f64),
}

/// Marches with the steps of `step(function, t, end, point)`.
pub(super) fn march<F: RayFunction>(
    function: &mut F,
    settings: &Settings,
    mut step: impl FnMut(&mut F, f64, f64, RayPoint) -> Step,
) -> Answer {
    let Some((start, end)) = function.span() else { return Answer::Miss };
    let mut t = start.max(0.0);
    if t > end {
        return Answer::Miss;
    }
    let mut point = function.value(t);
    if point.solid() {
        return Answer::Wall { t };
    }
    for _ in 0..settings.max_steps {
        if t >= end {
            return Answer::Miss;
        }
        if point.in_domain() && point.height < settings.epsilon && crosses(function, settings, t, point) {
            return Answer::Hit { t };
        }
        let (advance, at_border) = match step(function, t, end, point) {
            Step::Free(s) => (s, false),
            Step::Border(s) => (s.max(settings.edge), true),
        };
        let before = point;
        t = ahead(t, advance, end);
        point = function.value(t);
        if point.solid() {
            // A free step ends outside; a border step may have entered, or leave a sliver of rounding.
            return if at_border && !before.in_domain() { Answer::Wall { t } } else { Answer::Hit { t } };
        }
    }
    Answer::GaveUp { t }
}

/// Is the surface met within the bracket behind `t`? By a change of sign, not by nearness alone: a ray that passes a
/// crest at half ε does not hit it.
fn crosses<F: RayFunction>(function: &mut F, settings: &Settings, t: f64, point: RayPoint) -> bool {
    if point.height < TOUCH {
        return true;
    }
    let slope = function.slope(t);
    if slope >= 0.0 {
        return false;
    }
    let reach = 2.0 * point.height / -slope;
    reach <= settings.bracket && function.value(t + reach).solid()
}
