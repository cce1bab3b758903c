//! Formulas of Paris 2019 that need no field: octaves, blended resistance, the sigmoid, erosion's response.

use super::search::{Finding, Form, Number, Smooth, smooth_below};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use terrain_amplify::implicit::sigmoid::Sigmoid;
use terrain_model::dual::Dual;
use terrain_model::falloff::wyvill;
use terrain_model::real::Real;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "octaves-count",
        shows: "A sum from 0 to o has o + 1 terms, and exceeds the range of o octaves.",
        control: "the range 2 − 2⁻ᵒ",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["last_amplitude"], root: [(0.01, 0.5)], measure: Octaves }),
    },
    Certificate {
        id: "resistance-sum",
        shows: "The sum of two resistances exceeds 1.",
        control: "the sum clamped to 1",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["rho_a", "rho_b"],
            root: [(0.0, 1.0), (0.0, 1.0)],
            measure: Resistance,
        }),
    },
    Certificate {
        id: "erosion-negative",
        shows: "Erosion's response of a resistance above 1 is negative.",
        control: "a resistance clamped to 1",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["rho", "sigma", "beta"],
            root: [(0.0, 3.0), (0.0, 1.0), (0.0, 1.0)],
            measure: Erosion,
        }),
    },
    Certificate {
        id: "erosion-order",
        shows: "Erosion's response is not symmetric: the order of its arguments matters.",
        control: "arguments by name",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["rho", "sigma"], root: [(0.0, 1.0), (0.0, 1.0)], measure: Order }),
    },
    Certificate {
        id: "queue-order",
        shows: "The head of a queue by decreasing resistance is not the least resistant candidate.",
        control: "a queue by increasing resistance",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["rho_a", "rho_b"], root: [(0.0, 1.0), (0.0, 1.0)], measure: Queue }),
    },
    Certificate {
        id: "erosion-range",
        shows: "On [0, 1]³ erosion's response lies in [0, 1].",
        control: "resistances up to 1.1",
        certifies: &[],
        kind: Kind::Proof(erosion_range),
    },
    Certificate {
        id: "plane-signed",
        shows: "The falloff of a signed distance from a plane leaves [0, 1].",
        control: "the falloff of the squared distance",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["x"], root: [(-10.0, 2.0)], measure: SignedPlane }),
    },
    Certificate {
        id: "warp-folds",
        shows: "p + δ(p) runs backwards where δ is steeper than 1.",
        control: "an amplitude with Lip(δ) < 1",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["amplitude", "radius", "x"],
            root: [(0.0, 2.0), (0.2, 2.0), (0.0, 1.0)],
            measure: Fold,
        }),
    },
    Certificate {
        id: "sigmoid-at-zero",
        shows: "The printed cubic is T at 0, not 0.",
        control: "σ(x) − T, which is 0 there",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["radius"], root: [(0.1, 30.0)], measure: AtZero }),
    },
    Certificate {
        id: "sigmoid-odd",
        shows: "Extended as an odd function the printed cubic jumps by 2T at 0.",
        control: "T + s with s odd",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["radius", "step"],
            root: [(0.1, 30.0), (1e-6, 0.01)],
            measure: OddJump,
        }),
    },
    Certificate {
        id: "sigmoid-overshoot",
        shows: "With T = 1/2 and a wide radius the cubic exceeds 2T.",
        control: "the unit-free T + T(3y − y³)/2",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["radius", "share"],
            root: [(0.5, 30.0), (0.0, 1.0)],
            measure: Overshoot,
        }),
    },
    Certificate {
        id: "sigmoid-monotone",
        shows: "For R ≤ 3T the cubic rises on [0, R] and stays within [T, 2T].",
        control: "R up to 4T",
        certifies: &[],
        kind: Kind::Proof(monotone),
    },
    Certificate {
        id: "union-by-min",
        shows: "The minimum of two disjoint balls is below T at the centre of either: their union is empty.",
        control: "the maximum",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["f_a", "f_b"], root: [(0.5, 1.0), (0.0, 1.0)], measure: Union }),
    },
    Certificate {
        id: "prism-level",
        shows: "With f_P = T inside the prism, deep rock has exactly the level of the surface.",
        control: "f_P = 2T inside",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["f_t"], root: [(0.6, 1.0)], measure: Prism }),
    },
    Certificate {
        id: "min-crease",
        shows: "The minimum of a rising and a falling field has a crease.",
        control: "Lipschitz with the larger constant",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["step"], root: [(1e-6, 0.1)], measure: Crease }),
    },
    Certificate {
        id: "perturbed-radius",
        shows: "d̃ = d/(R + t) behind a falloff of radius R does not end where the skeleton's influence should.",
        control: "a falloff of radius 1",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["radius"], root: [(1.5, 20.0)], measure: PerturbedRadius }),
    },
];

const T: f64 = terrain_amplify::field::THRESHOLD;

struct Octaves;
impl Measure<1> for Octaves {
    fn sides<R: Number>(&self, [last]: [R; 1]) -> Sides<R> {
        // last = 2⁻ᵒ: the sum to o is 2 − 2⁻ᵒ, that of o terms 2 − 2·2⁻ᵒ.
        let two = R::constant(2.0);
        Sides::limits(two - last, two - last - last, two - last + R::constant(1e-12))
    }
}

struct Resistance;
impl Measure<2> for Resistance {
    fn sides<R: Number>(&self, [a, b]: [R; 2]) -> Sides<R> {
        Sides::forms(a + b, (a + b).clamp01(), R::one())
    }
}

/// e(ρ, σ) = σ(1 − ρ)(1 − β) + σβ (§6.1).
fn erosion<R: Real>(rho: R, sigma: R, beta: R) -> R {
    sigma * (R::one() - rho * (R::one() - beta))
}

struct Erosion;
impl Measure<3> for Erosion {
    fn sides<R: Number>(&self, [rho, sigma, beta]: [R; 3]) -> Sides<R> {
        Sides::forms(-erosion(rho, sigma, beta), -erosion(rho.clamp01(), sigma, beta), R::constant(1e-9))
    }
}

struct Order;
impl Measure<2> for Order {
    fn sides<R: Number>(&self, [rho, sigma]: [R; 2]) -> Sides<R> {
        let beta = R::constant(0.1);
        let (right, swapped) = (erosion(rho, sigma, beta), erosion(sigma, rho, beta));
        let again = erosion(rho, sigma, beta);
        Sides::forms((right - swapped).abs(), (right - again).abs(), R::constant(1e-6))
    }
}

struct Queue;
impl Measure<2> for Queue {
    fn sides<R: Number>(&self, [a, b]: [R; 2]) -> Sides<R> {
        // How much more resistant than the least the head is.
        let least = a.min(b);
        Sides::forms(a.max(b) - least, a.min(b) - least, R::constant(1e-6))
    }
}

struct Response {
    sign: f64,
}
impl Smooth<3> for Response {
    fn value<R: Real>(&self, [rho, sigma, beta]: [R; 3]) -> R {
        erosion(rho, sigma, beta) * R::constant(self.sign)
    }
}

fn erosion_range(form: Form) -> Finding {
    let root = [(0.0, form.pick(1.0, 1.1)), (0.0, 1.0), (0.0, 1.0)];
    Finding::all([
        smooth_below(&Response { sign: 1.0 }, root, 1.0 + 1e-9),
        smooth_below(&Response { sign: -1.0 }, root, 1e-3),
    ])
}

struct SignedPlane;
impl Measure<1> for SignedPlane {
    fn sides<R: Number>(&self, [x]: [R; 1]) -> Sides<R> {
        let v = R::one() - x.square();
        let printed = R::select(x.less(R::one()), v.square() * v, R::zero());
        Sides::forms(-printed, -wyvill(x.square()), R::constant(1e-9))
    }
}

struct Fold;
impl Measure<3> for Fold {
    fn sides<R: Number>(&self, [amplitude, radius, x]: [R; 3]) -> Sides<R> {
        let slope = |amplitude: R| {
            let x = Dual::<R, 1>::variable(x, 0);
            let bump = wyvill((x / Dual::fixed(radius)).square());
            (x + Dual::fixed(amplitude) * bump).slope[0]
        };
        let gentle = amplitude.min(radius * R::constant(0.58));
        Sides::forms(-slope(amplitude), -slope(gentle), R::constant(1e-9))
    }
}

/// The printed cubic on [0, R] (§5.1) at y = x/R, by the formula that is drawn.
fn cubic<R: Real>(radius: R, y: R) -> R {
    Sigmoid::Paper.value(radius * y, radius)
}

struct AtZero;
impl Measure<1> for AtZero {
    fn sides<R: Number>(&self, [radius]: [R; 1]) -> Sides<R> {
        let at = cubic(radius, R::zero());
        Sides::forms(at.abs(), (at - R::constant(T)).abs(), R::constant(1e-9))
    }
}

struct OddJump;
impl Measure<2> for OddJump {
    fn sides<R: Number>(&self, [radius, step]: [R; 2]) -> Sides<R> {
        // Between −step and step, as shares of R; slope 1 would allow 2·step·R and a little.
        let up = cubic(radius, step);
        let odd = up + up;
        let corrected = (up - R::constant(T)) + (up - R::constant(T));
        Sides::forms(odd, corrected, R::constant(2.1) * step * radius)
    }
}

struct Overshoot;
impl Measure<2> for Overshoot {
    fn sides<R: Number>(&self, [radius, y]: [R; 2]) -> Sides<R> {
        let unit_free = Sigmoid::UnitFree.value(radius * y, radius);
        Sides::forms(cubic(radius, y), unit_free, R::constant(2.0 * T * (1.0 + 1e-12)))
    }
}

/// −σ′ with 3T/R as the variable, at least 1.
struct Falling;
impl Smooth<2> for Falling {
    fn value<R: Real>(&self, [ratio, y]: [R; 2]) -> R {
        // s′ = (1 − y)(1 − 3(1 − 2τ)y), τ = ratio/3.
        let one = R::one();
        -((one - y) * (one - y * (R::constant(3.0) - R::constant(2.0) * ratio)))
    }
}

fn monotone(form: Form) -> Finding {
    smooth_below(&Falling, [(form.pick(1.0, 0.75), 8.0), (0.0, 1.0)], 1e-4)
}

struct Union;
impl Measure<2> for Union {
    fn sides<R: Number>(&self, [a, b]: [R; 2]) -> Sides<R> {
        // A point of A, f_A ≥ T, must be a point of the union: how far below T it lies.
        let short = |f: R| R::constant(T) - f;
        Sides::forms(short(a.min(b)), short(a.max(b)), R::constant(1e-9)).where_positive(a - R::constant(T))
    }
}

struct Prism;
impl Measure<1> for Prism {
    fn sides<R: Number>(&self, [f]: [R; 1]) -> Sides<R> {
        // Where f_T exceeds T by 0.1 or more, so should the intersection.
        let short = |f_p: f64| R::constant(T + 0.1) - f.min(R::constant(f_p));
        Sides::forms(short(T), short(2.0 * T), R::constant(1e-9)).where_positive(f - R::constant(T + 0.1))
    }
}

struct Crease;
impl Measure<1> for Crease {
    fn sides<R: Number>(&self, [step]: [R; 1]) -> Sides<R> {
        let slope = |x: R| {
            let x = Dual::<R, 1>::variable(x, 0);
            x.min(-x).slope[0]
        };
        // A C¹ function's slope changes by little over a short way; 100 per metre is granted.
        let jump = (slope(-step) - slope(step)).abs() / (step + step);
        let lipschitz = slope(step).abs() - R::one();
        Sides::forms(jump, lipschitz, R::constant(100.0) * R::one()).where_positive(R::constant(1e-3) - step)
    }
}

struct PerturbedRadius;
impl Measure<1> for PerturbedRadius {
    fn sides<R: Number>(&self, [radius]: [R; 1]) -> Sides<R> {
        // t = 0, a point at distance R, where d/(R + t) = 1: outside.
        let relative = R::one();
        let printed = wyvill((relative / radius).square());
        let corrected = wyvill(relative.square());
        Sides::forms(printed, corrected, R::constant(1e-9))
    }
}
