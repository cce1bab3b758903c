//! A slope bound of the mean over arcs, derived by hand. Intervals of ∇f would forget that its parts cancel.
//!
//! With weights w = v³, v = 1 − (D − D₀)/E, W = Σ w and index 0 for the nearest arc, almost everywhere
//!
//!   ∇f = Σ (w/W)·∇fₖ + Σ (fₖ − f)·∇wₖ / W,   ∇wₖ = −3vₖ²·(∇Dₖ − ∇D₀)/E,   w₀ = 1, ∇w₀ = 0.
//!
//! **What an arc carries.** fₖ = zₖ + c. The section is read at the distance d to the skeleton, whose gradient is a normal.
//! z and s depend on the angle about the centre alone wherever denominators are not held, so that their gradient is
//! tangential: dz/du·√(1 + (khu)²)/(h·c) between the ends, the grade of the neighbour over R past an end. A convex
//! combination of gradients is no longer than Z along and C across, with a cosine between them at most that of the nearest
//! arc's normal and any arc's tangent: 0 for an arc that takes part alone and is not past an end.
//!
//! **What weights pull.** Sections are read at the same distance by all, so that what is averaged differs by z alone, by
//! what stands at different abscissae, and by the odd part of a section past an end. f is a mean, so |fₖ − f| ≤ (1 − wₖ/W)·M
//! with M the spread of what is averaged, and the second sum is at most (M·ν/E)·Σ 3vₖ²·(W − wₖ)/W², over all arcs but one.
//! For two arcs that is at most max 3v²/(1 + v³)² = 0.840, at v³ = ½. For many, Σ v²|fₖ − f| ≤ (Σ w|fₖ − f|)^(2/3)·(Σ |fₖ − f|)^(1/3)
//! by Hölder, and Σ w|fₖ − f| ≤ W·M/2 over an interval of length M: the sum is at most 3·2^(−2/3)·(n/W)^(1/3). ν ≥ ‖∇Dₖ − ∇D₀‖
//! comes from a box around the gradients: 2 for legs that face each other, little where one arc continues another. On a
//! small box the sum itself, on intervals, may say less.
//!
//! **Who takes part.** Neighbours differ in distance by little while each varies much over a box. So D − D₀ is enclosed by
//! the mean value form of its differences: their value in the middle, and their gradient times the way from there.

use super::Chain;
use super::arc::{self, CORE, Place};
use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::primitive::Parameters;
use crate::profile::Sections;
use crate::real::{Operand, Real};

/// What one arc contributes over a box.
struct Part {
    operand: Operand<Interval>,
    /// Elevation of the skeleton, and what sections add that may differ from arc to arc.
    z: Interval,
    differing: Interval,
    /// v.
    closeness: Interval,
    /// Slope bounds along and across the arc.
    along: f64,
    across: f64,
    /// ∇D, and ∇d where it exists.
    pull: [Interval; 2],
    normal: [Interval; 2],
    /// The direction in which z and s change, if it is one, and the cosine it encloses with the arc's own normal.
    tangent: Option<[Interval; 2]>,
    cosine: f64,
    /// D in the middle of the box.
    centre: Interval,
    /// May it be the nearest?
    nearest: bool,
}

/// Arcs that are compared pair by pair.
const MOST: usize = 32;
/// max 3v²/(1 + v³)² = 3·(1/2)^(2/3)/(9/4), rounded up.
const PAIR: f64 = 0.839_947_366_6;
/// 3·2^(−2/3), rounded up.
const MANY: f64 = 1.889_881_574_9;

fn hull(a: [Interval; 2], b: [Interval; 2]) -> [Interval; 2] {
    [a[0].hull(b[0]), a[1].hull(b[1])]
}
fn diagonal(x: [Interval; 2]) -> Interval {
    Interval::length(Interval::point(x[0].width()), Interval::point(x[1].width()))
}

/// The largest |c₀ + c₁u + c₂u²|, by its Taylor form about the middle: off by |c₂|·(half width)² at most.
fn steepest(c: [f64; 3], u: Interval) -> f64 {
    let [c0, c1, c2] = c.map(Interval::point);
    let m = Interval::point(u.middle());
    let t = u - m;
    let taylor = c0 + m * (c1 + m * c2) + t * (c1 + (m + m) * c2) + c2 * t.square();
    taylor.meet(c0 + u * (c1 + u * c2)).magnitude()
}

fn cube(v: f64) -> Interval {
    Interval::point(v).square() * Interval::point(v)
}

/// The largest cosine between the normal of an arc that may be the nearest and the tangent of any.
fn cosine(parts: &[Part]) -> f64 {
    let mut largest = 0.0f64;
    for (k, part) in parts.iter().enumerate() {
        let Some(tangent) = part.tangent else { return 1.0 };
        for (j, own) in parts.iter().enumerate().filter(|(_, part)| part.nearest) {
            let dot = own.normal[0] * tangent[0] + own.normal[1] * tangent[1];
            largest = largest.max(if j == k { part.cosine } else { dot.magnitude() });
        }
    }
    largest.min(1.0)
}

/// Σ 3v²·(W − w)/W² over all parts but one; W is at least `weight`.
fn pulled(parts: &[Part], weight: Interval) -> Interval {
    let (mut sum, mut smallest) = (Interval::ZERO, f64::INFINITY);
    for part in parts {
        // (W − w)/W² falls in w, and in W beyond 2w.
        let own = cube(part.closeness.lo());
        let least = Interval::point(weight.lo().max(1.0 + own.lo()));
        let term =
            Interval::point(3.0) * Interval::point(part.closeness.hi()).square() * (least - own) / least.square();
        let term = term.hi().min(PAIR);
        sum = sum + Interval::point(term);
        smallest = smallest.min(term);
    }
    let share = libm::cbrt((parts.len() as f64 - 1.0) / weight.lo());
    let count = Interval::point(share) * Interval::new(1.0 - 1e-12, 1.0 + 1e-12);
    Real::min(sum - Interval::point(smallest), Interval::point(MANY) * count)
}

/// ‖Σ 3v²·(fₖ − f)·(∇Dₖ − ∇D₀)‖ / W, on intervals, whichever arc is the nearest.
fn pulled_here(parts: &[Part], weight: Interval) -> Interval {
    let differing = |part: &Part| part.z + part.differing;
    let operands: Vec<Operand<Interval>> =
        parts.iter().map(|part| Operand::new(differing(part), part.operand.weight)).collect();
    let mean = Interval::weighted_mean(&operands, 1.0).elevation;
    let rate = |part: &Part| Interval::point(3.0) * part.closeness.square() * (differing(part) - mean);
    let rates: Vec<Interval> = parts.iter().map(rate).collect();
    // One of these is the nearest; its own weight is constant.
    let mut largest = 0.0f64;
    for (j, own) in parts.iter().enumerate().filter(|(_, part)| part.nearest) {
        let mut sum = [Interval::ZERO; 2];
        for (k, part) in parts.iter().enumerate().filter(|(k, _)| *k != j) {
            for axis in 0..2 {
                sum[axis] = sum[axis] + rates[k] * (part.pull[axis] - own.pull[axis]);
            }
        }
        largest = largest.max((Interval::length(sum[0], sum[1]) / weight).hi());
    }
    Interval::point(largest)
}

impl Chain<'_, f64> {
    /// Elevation over the box `x`, and a bound of its slope. `nearest` is the distance to the skeleton.
    pub fn enclose(
        &self,
        x: [Interval; 2],
        nearest: Interval,
        sections: Sections,
        section: Parameters<f64>,
    ) -> (Interval, f64) {
        let mut parts: Vec<Part> = Vec::new();
        let middle = x.map(|x| Interval::point(x.middle()));
        if self.arcs == 1 {
            let place = arc::place(self.arc(0), x);
            parts.push(self.part(self.arc(0), &place, Interval::ZERO, middle, nearest, sections, section));
        } else {
            self.for_each(x, nearest, |p, place, excess| {
                parts.push(self.part(p, place, excess, middle, nearest, sections, section));
            });
        }
        if parts.len() > 1 && parts.len() <= MOST {
            self.compare(&mut parts, [x[0] - middle[0], x[1] - middle[1]]);
        }
        let largest = |of: fn(&Part) -> f64| Interval::point(parts.iter().map(of).fold(0.0, f64::max));
        let (along, across) = (largest(|part| part.along), largest(|part| part.across));
        let operands: Vec<Operand<Interval>> = parts.iter().map(|part| part.operand).collect();
        let elevation = Interval::weighted_mean(&operands, 1.0).elevation;
        let two = Interval::point(2.0);
        let carried = along.square() + across.square() + two * along * across * Interval::point(cosine(&parts));
        let carried = Real::sqrt(carried);
        let (Some(first), true) = (parts.first(), parts.len() > 1) else { return (elevation, carried.hi()) };
        let mut pull = first.pull;
        let (mut z, mut differing) = (first.z, first.differing);
        for part in &parts {
            pull = hull(pull, part.pull);
            (z, differing) = (z.hull(part.z), differing.hull(part.differing));
        }
        let spread = Interval::point(z.width()) + Interval::point(differing.width());
        let turn = Real::min(diagonal(pull), Interval::point(2.0));
        let weight = parts.iter().fold(Interval::ZERO, |sum, part| sum + cube(part.closeness.lo()));
        let weight = Interval::point(weight.lo().max(1.0));
        let rate = Real::min(spread * turn * pulled(&parts, weight), pulled_here(&parts, weight));
        let rate = rate * Interval::point(self.p.0[0]);
        (elevation, (carried + rate).hi())
    }
    /// Closeness and weights from differences, by the mean value form; arcs that turn out to be too far leave.
    fn compare(&self, parts: &mut Vec<Part>, from_middle: [Interval; 2]) {
        let per_width = Interval::point(self.p.0[0]);
        let excess = |k: usize| {
            let (mut lo, mut hi) = (0.0f64, 0.0f64);
            for other in parts.iter() {
                let [x, y] = [0, 1].map(|axis| (parts[k].pull[axis] - other.pull[axis]) * from_middle[axis]);
                let difference = (parts[k].centre - other.centre + x + y) * per_width;
                (lo, hi) = (lo.max(difference.lo()), hi.max(difference.hi()));
            }
            Interval::new(lo, hi)
        };
        let excess: Vec<Interval> = (0..parts.len()).map(excess).collect();
        let one = Interval::point(1.0);
        for (part, excess) in parts.iter_mut().zip(excess) {
            let v = Real::max(one - excess, Interval::ZERO);
            let v = Interval::new(v.lo().clamp(0.0, 1.0), v.hi().clamp(0.0, 1.0));
            part.closeness = part.closeness.meet(v);
            part.operand.weight = part.operand.weight.meet(wyvill(excess));
            part.nearest = part.nearest && excess.lo() <= 0.0;
        }
        parts.retain(|part| part.closeness.hi() > 0.0);
    }
    #[allow(clippy::too_many_arguments)]
    fn part(
        &self,
        p: Parameters<f64>,
        place: &Place<Interval>,
        excess: Interval,
        middle: [Interval; 2],
        nearest: Interval,
        sections: Sections,
        section: Parameters<f64>,
    ) -> Part {
        let get = |k: usize| Interval::point(p.0[k]);
        let one = Interval::point(1.0);
        let Place { at: [a, b], ratio: [ratio, c], past, side, distance, .. } = *place;
        let (z, s) = arc::elevation(p, place, Interval::point(self.p.0[2]));
        let on_arc = past[0].hi() < 0.0 && past[1].hi() < 0.0;
        let beside = sections.enclose(section, nearest, on_arc, side, s);
        // Slopes along the arc, of z and of the abscissa.
        let core = Interval::point(CORE);
        let u = arc::position(p, place);
        let turn = get(4) / get(5) * u;
        let moves = Real::sqrt(one + turn.square()) * get(5) / Real::max(Real::abs(c), core);
        let held = c.lo() < CORE;
        let inside = |coefficients: [f64; 3]| Interval::point(steepest(coefficients, u)) * moves;
        let inner = [
            inside([p.0[11], 2.0 * p.0[12], (3.0 * p.0[13]).next_up()]),
            inside([p.0[17], 0.0, (3.0 * p.0[18]).next_up()]),
        ];
        let goes_on = one / Real::max(ratio, core);
        let beyond = |end: usize, grade: Interval| if past[end].hi() > 0.0 { grade * goes_on } else { Interval::ZERO };
        let outer = |grades: [Interval; 2]| [beyond(0, Real::abs(grades[0])), beyond(1, Real::abs(grades[1]))];
        let together = |inner: Interval, outer: [Interval; 2]| {
            // Before the centre a point is past one end at most, and past an end u does not move.
            if held { inner + outer[0] + outer[1] } else { Real::max(inner, Real::max(outer[0], outer[1])) }
        };
        let grade = together(inner[0], outer([get(14), get(15)]));
        let pace = together(inner[1], outer([one, one]));
        let along = grade + pace * Interval::point(beside.along);
        // From the foot to the point, in the frame of the arc.
        let radial = [-get(4) * a / ratio, c / ratio].map(|x| x.meet(Interval::symmetric(1.0)) * side);
        let from_end = [Real::abs(a) - get(8), b - get(9)];
        let outward = if a.lo() >= 0.0 {
            from_end[0]
        } else if a.hi() <= 0.0 {
            -from_end[0]
        } else {
            from_end[0].hull(-from_end[0])
        };
        let past_end = [outward, from_end[1]];
        let off = if on_arc {
            radial
        } else if past[0].lo() > 0.0 || past[1].lo() > 0.0 {
            past_end
        } else {
            hull(radial, past_end)
        };
        let [dx, dy] = [get(2), get(3)];
        let turned = |v: [Interval; 2]| [v[0] * dx - v[1] * dy, v[0] * dy + v[1] * dx];
        let unit = Interval::symmetric(1.0);
        let over = |v: [Interval; 2], l: Interval| v.map(|x| if l.lo() > 0.0 { (x / l).meet(unit) } else { unit });
        let tangent = over([c, get(4) * a], ratio);
        let cosine = if on_arc {
            0.0
        } else {
            let outward = over(past_end, distance);
            (outward[0] * tangent[0] + outward[1] * tangent[1]).magnitude().min(1.0)
        };
        let tangential = !held && ratio.lo() >= CORE && beside.settled;
        let v = Real::max(one - excess, Interval::ZERO);
        Part {
            operand: Operand::new(z + beside.height, wyvill(excess)),
            z,
            differing: beside.differing,
            closeness: Interval::new(v.lo().clamp(0.0, 1.0), v.hi().clamp(0.0, 1.0)),
            along: along.hi(),
            across: beside.across,
            pull: over(turned(off), self.rounded(distance)),
            normal: over(turned(off), distance),
            tangent: tangential.then(|| turned(tangent)),
            cosine,
            centre: self.rounded(arc::place(p, middle).distance),
            nearest: distance.lo() <= nearest.hi(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::{Objective, Upper, Verdict, prove_below};
    use crate::dual::Dual;

    /// Σ 3vₖ²·|fₖ − f| / W over all but the nearest, for N = 2n + 1 numbers: v₁ … vₙ, f₀ … fₙ, all in [0, 1]; over (n/W)^(1/3).
    struct Pulled<const N: usize>;

    fn pulled_of<R: Real, const N: usize>(x: [R; N], root: impl Fn(R) -> R) -> R {
        let n = N / 2;
        let (mut weight, mut sum) = (R::one(), x[n]);
        for k in 0..n {
            let w = x[k].square() * x[k];
            weight = weight + w;
            sum = sum + w * x[n + 1 + k];
        }
        let mean = sum / weight;
        let pull =
            (0..n).fold(R::zero(), |pull, k| pull + R::constant(3.0) * x[k].square() * (x[n + 1 + k] - mean).abs());
        // (S/W)·(W/n)^(1/3), cubed so that no root is needed: S³/(n·W²).
        root(pull.square() * pull / (weight.square() * R::constant(n as f64)))
    }

    impl<const N: usize> Objective<N> for Pulled<N> {
        fn upper(&self, part: &[Interval; N], _: f64) -> Upper {
            let whole: [Dual<Interval, N>; N] = std::array::from_fn(|k| Dual::variable(part[k], k));
            let natural = pulled_of(whole, |x| x);
            let mut through_middle = pulled_of(part.map(|x| Interval::point(x.middle())), |x| x);
            let mut axis = (0, -1.0);
            for k in 0..N {
                through_middle = through_middle + natural.slope[k] * (part[k] - Interval::point(part[k].middle()));
                let effect = natural.slope[k].magnitude() * part[k].width();
                if effect > axis.1 {
                    axis = (k, effect);
                }
            }
            Upper { bound: natural.value.hi().min(through_middle.hi()), axis: axis.0 }
        }
        fn at(&self, x: [f64; N]) -> f64 {
            pulled_of(x, |x| x)
        }
    }

    /// The two constants of the bound, for every closeness and every elevation: of a pair, and of Hölder's inequality.
    #[test]
    fn what_weights_pull_is_certified_for_all_closeness_and_elevations() {
        let root = [Interval::UNIT; 3];
        // One other arc: S³/(1·W²) is not the sum itself, which is S/W; that one is at most PAIR.
        let pair = |v: Interval| {
            let one = Interval::point(1.0);
            (Interval::point(3.0) * v.square() / (one + v.square() * v).square()).hi()
        };
        let worst = (0..100_000)
            .fold(0.0f64, |worst, k| worst.max(pair(Interval::new(f64::from(k) / 1e5, f64::from(k + 1) / 1e5))));
        assert!(worst < PAIR + 1e-4 && pair(Interval::point(libm::cbrt(0.5))) > PAIR - 1e-6, "{worst}");
        let target = MANY * MANY * MANY;
        assert!(matches!(prove_below(&Pulled::<3>, root, target, 20_000), Verdict::Proved { .. }));
        assert!(matches!(prove_below(&Pulled::<5>, [Interval::UNIT; 5], target, 20_000), Verdict::Proved { .. }));
        // Control: what is attained refutes a target below it.
        let attained = Pulled::<3>.at([libm::cbrt(0.5), 0.0, 1.0]);
        assert!(matches!(prove_below(&Pulled::<3>, root, 0.9 * attained, 20_000), Verdict::Refuted { .. }));
    }
}
