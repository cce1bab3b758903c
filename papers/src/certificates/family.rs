//! Bounds of programs, certified: over each box of a cover of a terrain, everything that `bounds` promises is proved by splitting the
//! box and enclosing elevation, weight and both gradients with duals of intervals, which never ask `bounds` themselves.

use super::search::{Finding, Form};
use glam::DVec2;
use terrain_model::bounds::{Bounds, Region, THRESHOLD};
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::operator::BlendRule;
use terrain_model::program::{BoundsEvaluator, Evaluator, Program};
use terrain_model::real::Real;
use terrain_model::tree::{NodeId, Tree};

/// What an enclosure may exceed a bound by, as a share of it: natural enclosures near a maximum close in at first order only, and
/// many of these bounds are attained.
const TOLERANCE: f64 = 2e-2;
/// The slope of a weight reaches its bound along whole circles, which would need far smaller boxes; its constant is proved by itself
/// (`wyvill-slope`, `Wyvill.v`).
const WEIGHT_TOLERANCE: f64 = 0.03;
/// And in absolute terms, for the dust of outward rounding.
const DUST: f64 = 1e-9;
/// Elevations are judged where the weight is at least this: on the border of the support they end, and no box there can be split until
/// nothing of it lies outside.
const FAINT: f64 = 0.01;
/// Parts of one box of the cover that may be looked at.
const BUDGET: u64 = 60_000;

/// A terrain and where its bounds are judged.
pub struct Member {
    /// The terrain.
    pub program: Program,
    /// South-west and north-east corners.
    pub extent: (DVec2, DVec2),
    /// Boxes along each side of the cover.
    pub cover: u32,
    /// The weight has kinks (claims G21). At one an enclosure holds the hull of two gradients, however small the box, and is longer than
    /// either: the slope of the weight is then not judged here but by `weights-lipschitz`.
    pub kinked: bool,
}

impl Member {
    /// The terrain that `build` makes, over its support.
    pub fn of(build: impl FnOnce(&mut Tree) -> NodeId) -> Option<Member> {
        let mut tree = Tree::new();
        let root = build(&mut tree);
        let program = Program::compile(&tree, root).ok()?;
        let extent = program.support()?;
        Some(Member { program, extent, cover: 4, kinked: false })
    }
    /// Over a box of its own.
    #[must_use]
    pub fn over(self, lo: DVec2, hi: DVec2) -> Member {
        Member { extent: (lo, hi), ..self }
    }
}

/// What a bound is scaled by for a control.
#[derive(Clone, Copy)]
pub struct Shrunk(pub f64);

/// Are the bounds of every member proved on every box of its cover? Perturbed, the slope bounds are shrunk.
pub fn holds(
    members: impl IntoIterator<Item = Option<Member>>,
    rule: BlendRule,
    form: Form,
    shrunk: Shrunk,
) -> Finding {
    let scale = form.pick(1.0, shrunk.0);
    Finding::all(members.into_iter().map(|member| match member {
        Some(member) => judge(&member, rule, scale),
        None => Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 },
    }))
}

fn judge(member: &Member, rule: BlendRule, scale: f64) -> Finding {
    let mut bounds = BoundsEvaluator::with_rule(&member.program, rule);
    let mut judge = Judge {
        program: &member.program,
        over: Evaluator::new(&member.program),
        at: Evaluator::new(&member.program),
        kinked: member.kinked,
        boxes: 0,
        steepest: 0.0,
    };
    let (lo, hi) = member.extent;
    let n = f64::from(member.cover);
    let mut tightest: Option<(f64, f64)> = None;
    for k in 0..member.cover * member.cover {
        let cell = DVec2::new(f64::from(k % member.cover), f64::from(k / member.cover));
        let (a, b) = (lo + (hi - lo) * cell / n, lo + (hi - lo) * (cell + 1.0) / n);
        let mut promised = bounds.bounds(Region::rectangle(a, b));
        promised.slope *= scale;
        judge.steepest = 0.0;
        if let Some(failed) = judge.proves(&promised, a, b) {
            return failed;
        }
        let attained = judge.steepest;
        if promised.slope > 0.0
            && promised.slope.is_finite()
            && tightest.is_none_or(|(bound, best)| attained * bound > best * promised.slope)
        {
            tightest = Some((promised.slope, attained));
        }
    }
    let (bound, attained) = tightest.unwrap_or((f64::INFINITY, 0.0));
    Finding::Proved { bound, attained, boxes: judge.boxes }
}

struct Judge<'a> {
    program: &'a Program,
    over: Evaluator<Dual<Interval, 2>>,
    at: Evaluator<Dual<f64, 2>>,
    kinked: bool,
    boxes: u64,
    steepest: f64,
}

/// At most the bound, up to the tolerance.
fn within(value: f64, bound: f64) -> bool {
    value <= bound * (1.0 + TOLERANCE) + DUST
}
fn weighs_within(value: f64, bound: f64) -> bool {
    value <= bound * (1.0 + WEIGHT_TOLERANCE) + DUST
}

impl Judge<'_> {
    /// `None` when all that is promised is proved on the box.
    fn proves(&mut self, promised: &Bounds, a: DVec2, b: DVec2) -> Option<Finding> {
        let mut stack = vec![[Interval::new(a.x, b.x), Interval::new(a.y, b.y)]];
        let mut left = BUDGET;
        while let Some(part) = stack.pop() {
            left = left.saturating_sub(1);
            self.boxes += 1;
            let centre = DVec2::new(part[0].middle(), part[1].middle());
            let here = self.at.sample(self.program, centre);
            let slope = here.gradient.length();
            if here.weight >= THRESHOLD {
                self.steepest = self.steepest.max(slope);
                if !within(slope, promised.slope) {
                    return Some(Finding::Refuted { bound: promised.slope, value: slope, at: format!("{centre}") });
                }
            }
            let known = self.unproved(promised, part);
            let Some(known) = known else { continue };
            if left == 0 {
                return Some(Finding::Undecided { bound: promised.slope, known, boxes: self.boxes });
            }
            let axis = usize::from(part[1].width() > part[0].width());
            let middle = part[axis].middle();
            for half in [Interval::new(part[axis].lo(), middle), Interval::new(middle, part[axis].hi())] {
                let mut piece = part;
                piece[axis] = half;
                stack.push(piece);
            }
        }
        None
    }
    /// What is known where not everything is proved: of the slope if that is above its bound, infinity if it is something else.
    fn unproved(&mut self, promised: &Bounds, part: [Interval; 2]) -> Option<f64> {
        let x = [Dual::variable(part[0], 0), Dual::variable(part[1], 1)];
        let (f, alpha) = self.over.run(self.program, x);
        let slope = Interval::length(f.slope[0], f.slope[1]).hi();
        let weight_slope = Interval::length(alpha.slope[0], alpha.slope[1]).hi();
        let contains = |outer: Interval, inner: Interval| {
            let room = DUST + TOLERANCE * outer.width();
            outer.lo() - room <= inner.lo() && inner.hi() <= outer.hi() + room
        };
        let proved = (alpha.value.hi() < THRESHOLD || within(slope, promised.slope))
            && (alpha.value.hi() < FAINT || contains(promised.elevation, f.value))
            && contains(promised.weight, alpha.value)
            && (self.kinked || weighs_within(weight_slope, promised.weight_slope));
        let steep = !within(slope, promised.slope);
        (!proved).then_some(if steep { slope } else { f64::INFINITY })
    }
}
