//! The falloff and the two ramps made of polynomials (Génevaux 2015 §4.1, §6, appendix).

use super::search::{Finding, Form, Formula, Number, Smooth, below, smooth_below};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use terrain_model::detail::{smooth, smooth_slope};
use terrain_model::dual::Dual;
use terrain_model::falloff::{WYVILL_SLOPE, fade, wyvill, wyvill_steepness};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "wyvill-slope",
        shows: "|g′| ≤ 96√5/125 on [0, 1.1], within 1e-5 of what is attained.",
        control: "(1 − x²)⁴ in place of (1 − x²)³",
        certifies: &[],
        kind: Kind::Proof(wyvill_slope),
    },
    Certificate {
        id: "wyvill-range",
        shows: "g stays in [0, 1] and does not rise.",
        control: "the cube without the condition |x| < r",
        certifies: &[],
        kind: Kind::Proof(wyvill_range),
    },
    Certificate {
        id: "wyvill-steepness",
        shows: "Over each of 15 intervals of distances, |g′| stays below what `wyvill_steepness` says of it.",
        control: "what it says, × 0.97",
        certifies: &[],
        kind: Kind::Proof(steepness),
    },
    Certificate {
        id: "fade-slope",
        shows: "The quintic fade rises from 0 to 1, by at most 15/8.",
        control: "15/8 × 0.99",
        certifies: &[],
        kind: Kind::Proof(fade_slope),
    },
    Certificate {
        id: "smooth-slope",
        shows: "3t² − 2t³ rises from 0 to 1, and over each of 10 intervals by at most what `smooth_slope` says.",
        control: "what it says, × 0.97",
        certifies: &[],
        kind: Kind::Proof(ramp),
    },
    Certificate {
        id: "filter-corrected",
        shows: "1 − (1 − t²)³ rises from 0 to 1 on [0, 1], by at most 96√5/125.",
        control: "the printed (1 − t²)³",
        certifies: &[],
        kind: Kind::Proof(filter),
    },
    Certificate {
        id: "falloff-signed",
        shows: "The printed falloff of a signed distance leaves [0, 1].",
        control: "the falloff of the squared distance",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["x"], root: [(-10.0, 2.0)], measure: Signed }),
    },
    Certificate {
        id: "falloff-maximum",
        shows: "The printed constant is not the maximum of g′.",
        control: "the maximum of |g′|",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["x"], root: [(0.0, 1.0)], measure: Maximum }),
    },
    Certificate {
        id: "filter-falls",
        shows: "The printed filter falls between two levels of detail.",
        control: "1 − (1 − t²)³",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["t0", "gap"], root: [(0.01, 0.9), (0.01, 0.1)], measure: Filter }),
    },
    Certificate {
        id: "weights-kink",
        shows: "Where two parts of a skeleton are equally near, the slope of the weight jumps.",
        control: "the Lipschitz bound L/r in place of C¹",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["distance", "radius"],
            root: [(0.1, 4.0), (0.1, 5.0)],
            measure: MedialAxis,
        }),
    },
];

/// g′ by the library's formula, or that of another power.
struct Slope {
    quartic: bool,
    sign: f64,
}
impl Formula<1> for Slope {
    fn value<R: Number>(&self, [x]: [R; 1]) -> (R, R) {
        let u = Dual::<R, 1>::variable(x, 0).square();
        let v = (Dual::one() - u).max(Dual::zero());
        let g = if self.quartic { v.square().square() } else { wyvill(u) };
        (g.slope[0] * R::constant(self.sign), R::zero())
    }
}

fn wyvill_slope(form: Form) -> Finding {
    let quartic = form == Form::Perturbed;
    let falls = below(&Slope { quartic, sign: -1.0 }, [(0.0, 1.1)], WYVILL_SLOPE * 1.000_01);
    Finding::all([falls, below(&Slope { quartic, sign: 1.0 }, [(0.0, 1.1)], 1e-9)])
}

/// g itself, or the cube that goes on past the radius.
struct Value {
    cut: bool,
    sign: f64,
}
impl Smooth<1> for Value {
    fn value<R: Real>(&self, [x]: [R; 1]) -> R {
        let u = x.square();
        let v = R::one() - u;
        let g = if self.cut { wyvill(u) } else { v.square() * v };
        g * R::constant(self.sign)
    }
}

fn wyvill_range(form: Form) -> Finding {
    let cut = form == Form::Stated;
    let root = [(0.0, 2.0)];
    Finding::all([
        smooth_below(&Value { cut, sign: 1.0 }, root, 1.0 + 1e-9),
        smooth_below(&Value { cut, sign: -1.0 }, root, 1e-9),
    ])
}

fn steepness(form: Form) -> Finding {
    let slope = Slope { quartic: false, sign: -1.0 };
    let ends = [0.0, 0.2, 0.4, 0.5, 0.7, 1.0];
    let pairs = (0..ends.len()).flat_map(|i| (i + 1..ends.len()).map(move |j| (ends[i], ends[j])));
    Finding::all(pairs.map(|(lo, hi)| {
        let said = wyvill_steepness(Interval::new(lo * lo, hi * hi)) * form.pick(1.000_1, 0.97);
        below(&slope, [(lo, hi)], said)
    }))
}

/// A rising ramp: its slope, or less than nothing.
struct Ramp<F> {
    of: F,
    sign: f64,
}
impl Formula<1> for Ramp<Fade> {
    fn value<R: Number>(&self, [t]: [R; 1]) -> (R, R) {
        (fade(Dual::<R, 1>::variable(t, 0)).0.slope[0] * R::constant(self.sign), R::zero())
    }
}
impl Formula<1> for Ramp<Cubic> {
    fn value<R: Number>(&self, [t]: [R; 1]) -> (R, R) {
        (smooth(Dual::<R, 1>::variable(t, 0)).slope[0] * R::constant(self.sign), R::zero())
    }
}
impl Formula<1> for Ramp<Rising> {
    fn value<R: Number>(&self, [t]: [R; 1]) -> (R, R) {
        let g = wyvill(Dual::<R, 1>::variable(t, 0).square());
        let b = if self.of.corrected { Dual::one() - g } else { g };
        (b.slope[0] * R::constant(self.sign), R::zero())
    }
}
struct Fade;
struct Cubic;
struct Rising {
    corrected: bool,
}

fn fade_slope(form: Form) -> Finding {
    let steepest = form.pick(1.000_01, 0.99) * 15.0 / 8.0;
    let unit = [(0.0, 1.0)];
    Finding::all([
        below(&Ramp { of: Fade, sign: 1.0 }, unit, steepest),
        below(&Ramp { of: Fade, sign: -1.0 }, unit, 1e-6),
    ])
}

fn ramp(form: Form) -> Finding {
    let ends = [0.0, 0.3, 0.45, 0.6, 1.0];
    let pairs = (0..ends.len()).flat_map(|i| (i + 1..ends.len()).map(move |j| (ends[i], ends[j])));
    let slopes = pairs.map(|(lo, hi)| {
        let said = smooth_slope(Interval::new(lo, hi)) * form.pick(1.000_1, 0.97);
        below(&Ramp { of: Cubic, sign: 1.0 }, [(lo, hi)], said)
    });
    Finding::all(slopes.chain([below(&Ramp { of: Cubic, sign: -1.0 }, [(0.0, 1.0)], 1e-6)]))
}

fn filter(form: Form) -> Finding {
    let of = |sign| Ramp { of: Rising { corrected: form == Form::Stated }, sign };
    let unit = [(0.0, 1.0)];
    Finding::all([below(&of(1.0), unit, WYVILL_SLOPE * 1.000_1), below(&of(-1.0), unit, 1e-6)])
}

struct Signed;
impl Measure<1> for Signed {
    fn sides<R: Number>(&self, [x]: [R; 1]) -> Sides<R> {
        let v = R::one() - x.square();
        // The printed condition is x < 1.
        let inside = x.less(R::one());
        let printed = R::select(inside, v.square() * v, R::zero());
        Sides::forms(printed.abs(), wyvill(x.square()).abs(), R::one())
    }
}

struct Maximum;
impl Measure<1> for Maximum {
    fn sides<R: Number>(&self, [x]: [R; 1]) -> Sides<R> {
        let slope = wyvill(Dual::<R, 1>::variable(x, 0).square()).slope[0];
        let constant = R::constant(WYVILL_SLOPE);
        Sides::forms((constant - slope).abs(), (constant - slope.abs()).abs(), R::constant(1e-6))
    }
}

struct Filter;
impl Measure<2> for Filter {
    fn sides<R: Number>(&self, [t0, gap]: [R; 2]) -> Sides<R> {
        let printed = |t: R| wyvill(t.square());
        let corrected = |t: R| R::one() - wyvill(t.square());
        let t1 = t0 + gap;
        // How far the filter falls over the gap, per level of detail: a rising one by less than nothing.
        let fall = |b: &dyn Fn(R) -> R| (b(t0) - b(t1)) / gap;
        Sides::forms(fall(&printed), fall(&corrected), R::constant(1e-9))
    }
}

struct MedialAxis;
impl Measure<2> for MedialAxis {
    fn sides<R: Number>(&self, [distance, radius]: [R; 2]) -> Sides<R> {
        // One-sided slopes are ∓g′(d/r)/r on the two sides; C¹ would have no jump.
        let d = Dual::<R, 1>::variable(distance, 0);
        let slope = wyvill((d / Dual::fixed(radius)).square()).slope[0].abs();
        let over = slope - R::constant(WYVILL_SLOPE) / radius;
        Sides::forms(slope + slope, over, R::constant(1e-9))
    }
}
