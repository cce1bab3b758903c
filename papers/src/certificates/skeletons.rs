//! Curves and contours (Génevaux 2015 §3, §4.1, §7.3.1).

use super::family::{Member, Shrunk, holds};
use super::search::{Finding, Form, Number};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use glam::{DVec2, DVec3};
use terrain_model::bounds::Region;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill};
use terrain_model::operator::BlendRule;
use terrain_model::primitive::contour::{Contour, Ray};
use terrain_model::primitive::curve::Curve;
use terrain_model::profile::Knot;
use terrain_model::spline::Path;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "curve-family",
        shows: "A straight road, a bend and a hairpin with cross-sections keep their bounds.",
        control: "a tenth of the slope bound",
        certifies: &["primitive/curve.rs::bounds"],
        kind: Kind::Proof(curves),
    },
    Certificate {
        id: "curve-hairpin",
        shows: "The elevation of the nearest point jumps between the legs of a hairpin.",
        control: "legs about as near as the nearest, averaged",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["rise", "step"], root: [(0.1, 20.0), (1e-5, 0.1)], measure: Hairpin }),
    },
    Certificate {
        id: "curve-bend",
        shows: "Beside a bend a curve is steeper than it climbs.",
        control: "z′/(1 − d/ρ)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["grade", "distance", "bend"],
            root: [(0.01, 1.0), (0.1, 9.9), (10.0, 100.0)],
            measure: Bend,
        }),
    },
    Certificate {
        id: "curve-changing-profile",
        shows: "Profiles that change along a level curve make a slope that neither curve nor profile has.",
        control: "the term sup |∂c/∂s|",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["rise", "length"],
            root: [(0.1, 20.0), (1.0, 100.0)],
            measure: ChangingProfile,
        }),
    },
    Certificate {
        id: "contour-family",
        shows: "A lake keeps its bounds.",
        control: "a fifth of the slope bound",
        certifies: &["primitive/contour.rs::bounds"],
        kind: Kind::Proof(contours),
    },
    Certificate {
        id: "contour-centre",
        shows: "Profiles of different heights at the centre of a contour make a jump there.",
        control: "the bound c′ and (c_i − c_j)/(d·Δθ)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["difference", "distance", "sector"],
            root: [(0.1, 10.0), (0.001, 1.0), (0.1, 1.6)],
            measure: Centre,
        }),
    },
    Certificate {
        id: "weights-lipschitz",
        shows: "α = w·g∘d has the slope w·L/r for a point, a polyline, a bend and a hairpin.",
        control: "nine tenths of it",
        certifies: &[],
        kind: Kind::Proof(weights),
    },
    Certificate {
        id: "slit-annulus",
        shows: "Across a slit the angle changes more per metre than its gradient does anywhere.",
        control: "no bound on a domain that is not convex",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["half_slit"], root: [(1e-3, 1.0)], measure: Slit }),
    },
];

fn knot(distance: f64, height: f64) -> Knot {
    Knot { distance, height, slope: 0.0 }
}

fn valley() -> Vec<Knot> {
    vec![knot(-30.0, 6.0), knot(0.0, 0.0), knot(30.0, 8.0)]
}

fn road(points: &[(f64, f64, f64)], radius: f64, joint: f64, profile: Vec<Knot>) -> Curve {
    let path = Path::Polyline(points.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect());
    Curve { joint, ..Curve::new(path, radius, profile) }
}

fn skeletons() -> [Curve; 3] {
    [
        road(&[(-50.0, 0.0, 0.0), (50.0, 0.0, 10.0)], 40.0, 10.0, valley()),
        road(&[(-60.0, 0.0, 0.0), (0.0, 10.0, 4.0), (50.0, 50.0, 8.0)], 40.0, 20.0, valley()),
        road(&[(0.0, 20.0, 10.0), (60.0, 20.0, 8.0), (60.0, -20.0, 4.0), (0.0, -20.0, 0.0)], 50.0, 25.0, vec![]),
    ]
}

fn curves(form: Form) -> Finding {
    let [straight, bend, hairpin] = skeletons();
    let of = |curve: Curve, lo: (f64, f64), hi: (f64, f64)| {
        Member::of(move |tree| tree.push(curve)).map(|member| Member {
            cover: 2,
            kinked: true,
            ..member.over(DVec2::from(lo), DVec2::from(hi))
        })
    };
    let members = [
        of(straight, (-45.0, -25.0), (45.0, 25.0)),
        of(bend, (-20.0, -15.0), (15.0, 25.0)),
        of(hairpin, (10.0, -12.0), (40.0, 12.0)),
    ];
    holds(members, BlendRule::Corrected, form, Shrunk(0.1))
}

/// Half-width of the hairpin's legs at y = ±1, and the joint that averages them.
const JOINT: f64 = 1.0;

struct Hairpin;
impl Measure<2> for Hairpin {
    fn sides<R: Number>(&self, [rise, step]: [R; 2]) -> Sides<R> {
        // Legs at y = 1, `rise` high, and at y = −1, level 0; between y = −step and y = step.
        let excess = R::constant(4.0) * step / R::constant(JOINT * JOINT);
        // The nearer leg has weight 1, the other Wyvill's weight of the excess of its squared distance, 4·step.
        let other = wyvill(excess);
        let above = rise / (R::one() + other);
        let below = rise * other / (R::one() + other);
        let printed = rise / (step + step);
        let corrected = (above - below) / (step + step);
        // Level legs without a cross-section: the printed bound is 0; a thousandth of the rise per metre is granted. Ours: the weight
        // changes by 3·4/s² per metre, and f by no more than rise times that.
        Sides {
            printed: super::witness::Side { value: printed, limit: rise * R::constant(1e-3) },
            corrected: super::witness::Side { value: corrected, limit: rise * R::constant(12.0 / (JOINT * JOINT)) },
            domain: R::zero(),
        }
    }
}

struct Bend;
impl Measure<3> for Bend {
    fn sides<R: Number>(&self, [grade, distance, bend]: [R; 3]) -> Sides<R> {
        // Along the circle of radius ρ − d the curve's elevation changes by grade·ρ per radian.
        let slope = grade * bend / (bend - distance);
        let corrected = grade / (R::one() - distance / bend) * R::constant(1.0 + 1e-9);
        Sides::limits(slope, grade, corrected).where_positive(bend - distance - R::constant(0.05))
    }
}

struct ChangingProfile;
impl Measure<2> for ChangingProfile {
    fn sides<R: Number>(&self, [rise, length]: [R; 2]) -> Sides<R> {
        // Level curve, level profiles 0 and `rise` at its two ends, interpolated linearly: the printed parts z′ and c′ are 0.
        let slope = rise / length;
        Sides::limits(slope, R::constant(1e-6), slope * R::constant(1.0 + 1e-9))
    }
}

fn lake() -> Contour {
    let ray = |radius: f64, shore: f64| Ray {
        angle: None,
        radius,
        profile: vec![knot(0.0, 0.0), Knot { distance: 40.0, height: shore, slope: 0.1 }],
    };
    Contour {
        centre: DVec3::new(0.0, 0.0, 5.0),
        orientation: 0.3,
        rays: vec![ray(60.0, 4.0), ray(75.0, 6.0), ray(65.0, 3.0), ray(70.0, 8.0)],
        reach: 50.0,
        weight: 1.0,
    }
}

fn contours(form: Form) -> Finding {
    let whole = Member::of(|tree| tree.push(lake()));
    let member = whole.map(|member| Member { cover: 3, ..member.over(DVec2::new(20.0, 20.0), DVec2::new(80.0, 70.0)) });
    holds([member], BlendRule::Corrected, form, Shrunk(0.2))
}

struct Centre;
impl Measure<3> for Centre {
    fn sides<R: Number>(&self, [difference, distance, sector]: [R; 3]) -> Sides<R> {
        // Level profiles: the printed bound is 0, a metre per metre is granted. Between two of them, along the circle of radius d.
        let slope = difference / (distance * sector);
        Sides::limits(slope, R::one(), slope * R::constant(1.0 + 1e-9))
    }
}

/// The library's own λ_α, certified by the family, is not above w·L/r either.
fn weights(form: Form) -> Finding {
    let scale = form.pick(1.0 + 1e-9, 0.9);
    Finding::all(skeletons().map(|curve| {
        let (radius, weight) = (curve.radius, curve.weight);
        let Some(member) = Member::of(move |tree| tree.push(curve)) else {
            return Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 };
        };
        let bounds = member.program.bounds(Region::rectangle(member.extent.0, member.extent.1));
        let bound = weight * WYVILL_SLOPE / radius * scale;
        let attained = bounds.weight_slope;
        if attained <= bound {
            Finding::Proved { bound, attained, boxes: 1 }
        } else {
            Finding::Refuted { bound, value: attained, at: "the whole support".to_owned() }
        }
    }))
}

struct Slit;
impl Measure<1> for Slit {
    fn sides<R: Number>(&self, [half]: [R; 1]) -> Sides<R> {
        // f = angle on an annulus, ρ = 1, from the one bank of a slit to the other: 2π − 2·half over a chord shorter than 2·half.
        let turn = R::constant(std::f64::consts::TAU * (1.0 - 1e-15)) - half - half;
        Sides::limits(turn / (half + half), R::one(), R::constant(f64::INFINITY))
    }
}
