//! Formulas of Hnaidi 2010 that need no solver: the gradient step, the noise, the interpolation along curves.

use super::search::Number;
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "gradient-step-linear",
        shows: "The printed gradient step misses a linear field of exactly the slope that is asked for.",
        control: "weights |n_x|, |n_y| that sum to 1",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["tilt"], root: [(0.0, 1.0)], measure: LinearField }),
    },
    Certificate {
        id: "gradient-step-normal",
        shows: "A normal diffused by components pulls a level field down.",
        control: "weights that sum to 1",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["nx", "ny", "level"],
            root: [(0.0, 1.0), (0.0, 1.0), (0.0, 1000.0)],
            measure: DiffusedNormal,
        }),
    },
    Certificate {
        id: "gradient-step-spacing",
        shows: "The same gradient on a coarser level makes another slope.",
        control: "the gradient times the spacing of the level",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["spacing", "gradient"],
            root: [(1.0, 64.0), (0.1, 2.0)],
            measure: Spacing,
        }),
    },
    Certificate {
        id: "gradient-norm-ascends",
        shows: "A norm added along n can only ascend: a slope down along n is missed by twice its size.",
        control: "a signed slope",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["descent"], root: [(0.1, 2.0)], measure: Descent }),
    },
    Certificate {
        id: "identification-iterate",
        shows: "An identification term that reads the iterate forgets its datum.",
        control: "the datum",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["alpha", "datum"],
            root: [(0.1, 0.9), (1.0, 100.0)],
            measure: Identification,
        }),
    },
    Certificate {
        id: "multifractal-amplitude",
        shows: "The noise of amplitude A reaches A times the sum of its octaves.",
        control: "divided by that sum",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["blending"], root: [(0.5, 1.0)], measure: Amplitude }),
    },
    Certificate {
        id: "cubic-overshoot",
        shows: "Cubic interpolation leaves the range of its data.",
        control: "level where the data turn",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["before", "first", "second", "after", "t"],
            root: [(0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0)],
            measure: Cubic,
        }),
    },
];

/// A direction from the tangent of half its angle from the x axis.
fn direction<R: Number>(half: R) -> [R; 2] {
    let one = R::one();
    let square = half.square();
    [(one - square) / (one + square), (half + half) / (one + square)]
}

struct LinearField;
impl Measure<1> for LinearField {
    fn sides<R: Number>(&self, [tilt]: [R; 1]) -> Sides<R> {
        // F(i, j) = n·(i, j), of slope G = 1 along n, both components positive; F(0, 0) = 0.
        let [nx, ny] = direction(tilt);
        let (west, south) = (-nx, -ny);
        let printed = nx.square() * west + ny.square() * south + R::one();
        let corrected = (nx * west + ny * south + R::one()) / (nx + ny);
        Sides::forms(printed.abs(), corrected.abs(), R::constant(1e-9))
    }
}

struct DiffusedNormal;
impl Measure<3> for DiffusedNormal {
    fn sides<R: Number>(&self, [nx, ny, level]: [R; 3]) -> Sides<R> {
        let printed = nx.square() * level + ny.square() * level;
        let sum = nx.square() + ny.square();
        let corrected = printed / R::select(R::zero().less(sum), sum, R::one());
        Sides::forms((printed - level).abs(), (corrected - level).abs(), R::constant(1e-6))
            .where_positive(sum - R::constant(1e-3))
    }
}

struct Spacing;
impl Measure<2> for Spacing {
    fn sides<R: Number>(&self, [spacing, gradient]: [R; 2]) -> Sides<R> {
        // The neighbour's value and G, over the distance to it.
        let slope = |rise: R| (rise / spacing - gradient).abs();
        Sides::forms(slope(gradient), slope(gradient * spacing), R::constant(1e-6))
    }
}

struct Descent;
impl Measure<1> for Descent {
    fn sides<R: Number>(&self, [descent]: [R; 1]) -> Sides<R> {
        // Level ground behind, a slope of −descent wanted: F = F_N + G.
        let off = |g: R| (g + descent).abs();
        Sides::forms(off(descent.abs()), off(-descent), R::constant(1e-6))
    }
}

struct Identification;
impl Measure<2> for Identification {
    fn sides<R: Number>(&self, [alpha, datum]: [R; 2]) -> Sides<R> {
        // One cell among neighbours held at 0. F = α·0 + (1 − α)·F has the fixed point 0, F = α·0 + (1 − α)·datum that mean.
        let wanted = (R::one() - alpha) * datum;
        let held = alpha * R::zero() + (R::one() - alpha) * datum;
        Sides::forms(wanted.abs(), (held - wanted).abs(), R::constant(1e-6))
    }
}

struct Amplitude;
impl Measure<1> for Amplitude {
    fn sides<R: Number>(&self, [blending]: [R; 1]) -> Sides<R> {
        // n = 3, r = 2, A = 1, |S| ≤ 1, and blending = 2^(R−1): 1 at R = 1, 1/2 at R = 0.
        let q = blending;
        let sum = R::one() + q + q.square() + q.square() * q;
        // Divided by the sum of its octaves, as in our correction, it reaches what one octave does.
        Sides::forms(sum, R::one(), R::constant(1.0 + 1e-9))
    }
}

struct Cubic;
impl Measure<5> for Cubic {
    fn sides<R: Number>(&self, [before, a, b, after, t]: [R; 5]) -> Sides<R> {
        let hermite = |ma: R, mb: R| {
            let (t2, one) = (t.square(), R::one());
            let t3 = t2 * t;
            let h01 = R::constant(3.0) * t2 - R::constant(2.0) * t3;
            (one - h01) * a + (t3 - t2 - t2 + t) * ma + h01 * b + (t3 - t2) * mb
        };
        let half = R::constant(0.5);
        let printed = hermite((b - before) * half, (after - a) * half);
        // With level tangents the cubic rises or falls all along.
        let corrected = hermite(R::zero(), R::zero());
        let over = |v: R| v - a.max(b);
        Sides::forms(over(printed), over(corrected), R::constant(1e-9))
    }
}
