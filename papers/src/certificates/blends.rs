//! Blends of two and more, and blends among the operands of others (Génevaux 2015 §5.1, §7.3.2, appendix).

use super::authored::{at_corner, blend, flat, pair, ring, steepness, tilted};
use super::family::{Member, Shrunk, holds};
use super::search::{Finding, Form, Formula, Number, below};
use super::terrain::{Said, Terrain};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use glam::DVec2;
use terrain_model::bounds::{Region, THRESHOLD};
use terrain_model::dual::Dual;
use terrain_model::falloff::WYVILL_SLOPE;
use terrain_model::interval::Interval;
use terrain_model::operator::{BlendRule, WeightRule};
use terrain_model::program::{Evaluator, Program};
use terrain_model::real::Real;
use terrain_model::tree::{Node, Tree};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "blend-pair",
        shows: "Any two equal unit discs, elevations 0 and 1, of weight 1/2 to 1: on the terrain the slope is at most 2·L.",
        control: "the printed bound, 1·L",
        certifies: &[],
        kind: Kind::Proof(blend_pair),
    },
    Certificate {
        id: "blend-printed",
        shows: "Two equal discs are steeper on the terrain than max λ_α·M.",
        control: "the same with the factor 1/T",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["half", "x", "y"],
            root: [(0.05, 0.9), (-0.5, 0.5), (-0.6, 0.6)],
            measure: EqualPair,
        }),
    },
    Certificate {
        id: "blend-family",
        shows: "Blends of two to five discs, tilted and level, keep their bounds on a cover of their support.",
        control: "nine tenths of the slope bound",
        certifies: &[
            "operator/blend.rs::bounds",
            "operator/blend.rs::blend_bounds",
            "program/bounds.rs::bounds",
            "program/bounds.rs::bounds_of",
            "bounds.rs::primitive",
        ],
        kind: Kind::Proof(blend_family),
    },
    Certificate {
        id: "blend-rule-printed",
        shows: "The library's own printed rule is exceeded by the same discs.",
        control: "the corrected rule",
        certifies: &[],
        kind: Kind::Proof(printed_rule_fails),
    },
    Certificate {
        id: "blend-nested",
        shows: "Blends among the operands of blends and replacements keep their bounds.",
        control: "six tenths of the slope bound",
        certifies: &["operator/blend.rs::blend_bounds", "operator/mod.rs::clean"],
        kind: Kind::Proof(nested),
    },
    Certificate {
        id: "blend-off-terrain",
        shows: "Near the corner of the lens of two discs the slope is at least 0.8 over the distance, down to a millionth.",
        control: "1.2 over the distance",
        certifies: &[],
        kind: Kind::Proof(off_terrain),
    },
    Certificate {
        id: "blend-not-lipschitz",
        shows: "Where both weights fade out, the slope passes any constant.",
        control: "the bound of the domain {α ≥ t}, M·L·2/t",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["distance", "constant"],
            root: [(1e-3, 0.1), (1.0, 8.0)],
            measure: LensCorner,
        }),
    },
    Certificate {
        id: "blend-jump",
        shows: "Between two discs whose supports do not meet f jumps, though sup |f_A − f_B| over the overlap is 0.",
        control: "M over pairs of values, with 1/T",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["gap"], root: [(0.01, 2.0)], measure: Disjoint }),
    },
    Certificate {
        id: "blend-spread",
        shows: "M as the width of f_B − f_A, 0 for two constants, bounds nothing.",
        control: "M as the spread between values",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["half", "x", "y"],
            root: [(0.05, 0.9), (-0.5, 0.5), (-0.6, 0.6)],
            measure: Spread,
        }),
    },
    Certificate {
        id: "nesting-max-rule",
        shows: "A blend among the operands of a blend exceeds max λ + max λ_α·M/T made of its own local numbers.",
        control: "μ/T from weighted slopes",
        certifies: &[],
        kind: Kind::Witness(&NESTING),
    },
];

/// Half the distance, the weight of both discs, and a point of the quadrant that symmetry leaves.
struct PairSlope;
impl Formula<4> for PairSlope {
    fn value<R: Number>(&self, [half, w, x, y]: [R; 4]) -> (R, R) {
        let mean = pair(half, w, 1.0, [x, y]);
        (steepness(mean.elevation), mean.weight.value - R::constant(THRESHOLD))
    }
}

fn blend_pair(form: Form) -> Finding {
    let bound = WYVILL_SLOPE * form.pick(2.0 * 1.05, 1.0);
    below(&PairSlope, [(0.0, 1.0), (0.5, 1.0), (0.0, 1.0), (0.0, 1.0)], bound)
}

/// Two equal unit discs with elevations 0 and 1, their weights chosen so that the point just lies on the terrain: f depends on the
/// ratio of the weights alone, and the printed bound on their size.
struct EqualPair;
impl Measure<3> for EqualPair {
    fn sides<R: Number>(&self, [half, x, y]: [R; 3]) -> Sides<R> {
        let mean = pair(half, R::one(), 1.0, [x, y]);
        let weight = R::constant(THRESHOLD) / mean.weight.value;
        let steepest = weight * R::constant(WYVILL_SLOPE);
        let corrected = steepest / R::constant(THRESHOLD) * R::constant(1.0 + 1e-12);
        Sides::limits(steepness(mean.elevation), steepest, corrected)
            .where_positive(mean.weight.value - R::constant(0.1))
    }
}

/// M taken as the width of the difference of two constants, which is 0; a hundredth of a metre is granted.
struct Spread;
impl Measure<3> for Spread {
    fn sides<R: Number>(&self, [half, x, y]: [R; 3]) -> Sides<R> {
        let mean = pair(half, R::one(), 100.0, [x, y]);
        let corrected = R::constant(WYVILL_SLOPE / THRESHOLD * 100.0);
        Sides::limits(steepness(mean.elevation), R::constant(0.01), corrected)
            .where_positive(mean.weight.value - R::constant(THRESHOLD))
    }
}

/// Slope times distance, on the line to the corner (0, √3/2) of the lens of unit discs at ±1/2, from below.
struct Corner;
impl Formula<1> for Corner {
    fn value<R: Number>(&self, [distance]: [R; 1]) -> (R, R) {
        (-(distance * steepness(at_corner(distance).elevation)), R::zero())
    }
}

fn off_terrain(form: Form) -> Finding {
    // On decades, so that the enclosure of a wide range of distances is not asked to be sharp.
    let decades = [(1e-6, 1e-5), (1e-5, 1e-4), (1e-4, 1e-3), (1e-3, 1e-2), (1e-2, 0.1)];
    Finding::all(decades.map(|decade| below(&Corner, [decade], -form.pick(0.8, 1.2))))
}

/// Any constant that one may claim for the support.
struct LensCorner;
impl Measure<2> for LensCorner {
    fn sides<R: Number>(&self, [distance, constant]: [R; 2]) -> Sides<R> {
        let mean = at_corner(distance);
        let corrected = R::constant(2.0 * WYVILL_SLOPE) / mean.weight.value;
        Sides::limits(steepness(mean.elevation), constant, corrected)
    }
}

/// Unit discs whose supports are `gap` apart, elevations 0 and 1: nearest points of the two terrains.
struct Disjoint;
impl Measure<1> for Disjoint {
    fn sides<R: Number>(&self, [gap]: [R; 1]) -> Sides<R> {
        // α = 1/2 at √(1 − 2^(−1/3)) = 0.45421 from a centre; rounded up, so that the points are on the terrain or nearer.
        let apart = R::constant(2.0 - 2.0 * 0.4543) + gap;
        Sides::limits(R::one() / apart, R::constant(1e-6), R::constant(2.0 * WYVILL_SLOPE))
    }
}

/// Weight of the tilted operand, with which the origin lies on the terrain.
const TILTED_WEIGHT: f64 = 0.393;
const GRADE: f64 = 3.4346;

static NESTING: Terrain = Terrain::new(nested_blend, [(-0.05, 0.05), (-0.05, 0.05)]);

fn nested_blend() -> Option<Said> {
    let mut tree = Tree::new();
    let inner = blend(&mut tree, [flat(-0.789, 0.0, 1.0, 1.0, 0.0), flat(0.789, 0.0, 1.0, 1.0, 1.0)]);
    let plane = tree.push(tilted(10.0, GRADE, 20.0, TILTED_WEIGHT));
    let alone = [inner, plane].map(|node| Program::compile(&tree, node));
    let [Ok(inner_alone), Ok(plane_alone)] = alone else { return None };
    let own = terrain_model::certify::slope::slope_supremum(
        &inner_alone,
        DVec2::splat(-2.0),
        DVec2::splat(2.0),
        0.05,
        50_000,
    );
    // Over a box about the origin: the certified slope of each operand on its own terrain, its local λ_α and the spread, all enclosed.
    let (lo, hi) = (DVec2::splat(-1e-3), DVec2::splat(1e-3));
    let region = Region::rectangle(lo, hi);
    let x = [Dual::variable(Interval::new(lo.x, hi.x), 0), Dual::variable(Interval::new(lo.y, hi.y), 1)];
    let over = |program: &Program| {
        let (f, alpha) = Evaluator::<Dual<Interval, 2>>::new(program).run(program, x);
        (f.value, Interval::length(f.slope[0], f.slope[1]).hi(), Interval::length(alpha.slope[0], alpha.slope[1]).hi())
    };
    let ((f_a, _, weight_a), (f_b, slope_b, weight_b)) = (over(&inner_alone), over(&plane_alone));
    let spread = terrain_model::bounds::Bounds::spread(f_a, f_b);
    let max_rule = own.at_most.max(slope_b) + weight_a.max(weight_b) * spread / THRESHOLD;
    let root = tree.push(Node::Blend(vec![inner, plane]));
    let program = Program::compile(&tree, root).ok()?;
    let corrected = program.bounds(region).slope;
    Some(Said { program, printed: max_rule, corrected })
}

pub(super) fn blends() -> Vec<Option<Member>> {
    let two = |half: f64, weight: f64, z: f64| {
        Member::of(move |tree| blend(tree, [flat(-half, 0.0, 1.0, weight, 0.0), flat(half, 0.1, 1.0, weight, z)]))
    };
    // The first attains its bound; on parts of its support the library's bound is no smaller, so the whole is one box.
    let tight = Member::of(|tree| {
        blend(tree, [flat(-0.447_213_6, 0.0, 1.0, 0.4883, 0.0), flat(0.447_213_6, 0.0, 1.0, 0.4883, 1.0)])
    });
    let tight = tight.map(|member| Member { cover: 1, ..member });
    let mut members = vec![tight, two(0.3, 1.0, 1.0), two(0.608_309, 1.0, -250.0), two(0.7, 1.6, 3.0)];
    members.extend([3, 4, 5].map(|count| Member::of(move |tree| blend(tree, ring(count, 0.6)))));
    members.push(Member::of(|tree| {
        let (a, b) = (tree.push(tilted(5.0, 0.7, 6.0, 0.8)), tree.push(flat(2.0, 1.0, 4.0, 0.9, 1.0)));
        tree.push(Node::Blend(vec![a, b]))
    }));
    members
}

fn blend_family(form: Form) -> Finding {
    holds(blends(), BlendRule::Corrected, form, Shrunk(0.9))
}

/// The printed rule is exceeded: "proved" here is that its slope bound is refuted by a member.
fn printed_rule_fails(form: Form) -> Finding {
    let rule = form.pick(BlendRule::Paper, BlendRule::Corrected);
    match holds(blends(), rule, Form::Stated, Shrunk(1.0)) {
        Finding::Refuted { bound, value, .. } => Finding::Exceeds { value, limit: bound },
        Finding::Proved { bound, attained, .. } => Finding::Refuted {
            bound: attained,
            value: bound,
            at: "every blend of the family keeps the rule".to_owned(),
        },
        undecided => undecided,
    }
}

fn nested(form: Form) -> Finding {
    let discs = || [flat(-0.789, 0.0, 1.0, 1.0, 0.0), flat(0.789, 0.0, 1.0, 1.0, 1.0)];
    let near = |member: Option<Member>| member.map(|m| m.over(DVec2::splat(-1.2), DVec2::splat(1.2)));
    let of_plane = Member::of(|tree| {
        let (inner, plane) = (blend(tree, discs()), tree.push(tilted(10.0, GRADE, 20.0, TILTED_WEIGHT)));
        tree.push(Node::Blend(vec![inner, plane]))
    });
    let of_discs = Member::of(|tree| {
        let inner = blend(tree, discs());
        let other = blend(tree, ring(3, 0.5));
        tree.push(Node::Blend(vec![inner, other]))
    });
    let replaced = Member::of(|tree| {
        let (base, inner) = (tree.push(flat(0.0, 0.0, 20.0, 1.0, 0.5)), blend(tree, discs()));
        tree.push(Node::Replace { a: base, b: inner, rule: WeightRule::Keep })
    });
    holds([near(of_plane), near(of_discs), near(replaced)], BlendRule::Corrected, form, Shrunk(0.6))
}
