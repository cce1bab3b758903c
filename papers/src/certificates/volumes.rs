//! Bounds of the nodes of a construction tree (Paris 2019 §5–6), certified: over each box of a cover of space, the range and
//! the slope that `bounds` promises are proved by splitting the box and enclosing the field and its gradient with duals of
//! intervals, which never ask `bounds` themselves. Where a formula clamps or takes an extreme, a box that meets both cases has
//! the hull of both derivatives however small it is: surfaces, polygons, curves, unions and intersections cannot be closed so, and
//! are tested.

use super::search::{Finding, Form};
use super::{Certificate, Kind};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_amplify::field::{Box3, Density, DensityBounds};
use terrain_amplify::geology::{self, Geology};
use terrain_amplify::implicit::primitive::Primitive;
use terrain_amplify::implicit::prism::Prism;
use terrain_amplify::implicit::skeleton::Skeleton;
use terrain_amplify::implicit::volume::{Erosion, Instance, Placement, Volume, Warp};
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::real::Real;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "volume-prism",
        shows: "A prism over a rectangle keeps its bounds.",
        control: "eight tenths of the slope bound",
        certifies: &[],
        kind: Kind::Proof(|form| holds(prisms(), form, 0.8)),
    },
    Certificate {
        id: "volume-primitives",
        shows: "Point primitives, alone and blended, keep the bounds of range and slope.",
        control: "eight tenths of the slope bound",
        certifies: &[],
        kind: Kind::Proof(|form| holds(blended(), form, 0.8)),
    },
    Certificate {
        id: "volume-instance",
        shows: "Turned, scaled and moved copies keep their bounds.",
        control: "eight tenths of the slope bound",
        certifies: &[],
        kind: Kind::Proof(|form| holds(copies(), form, 0.8)),
    },
    Certificate {
        id: "volume-erosion",
        shows: "Rock eroded by weak strata within a region keeps its bounds.",
        control: "half of the slope bound",
        certifies: &[],
        kind: Kind::Proof(|form| holds(eroded(), form, 0.5)),
    },
    Certificate {
        id: "volume-warp",
        shows: "Space displaced within a region keeps the bounds of the field.",
        control: "half of the slope bound",
        certifies: &[],
        kind: Kind::Proof(|form| holds(warped(), form, 0.5)),
    },
];

/// What an enclosure may exceed a bound by, as a share of it: natural enclosures near a maximum close in at first order only, and
/// the bound of a single primitive is attained all around it.
const TOLERANCE: f64 = 0.05;
/// And in absolute terms, for the dust of outward rounding.
const DUST: f64 = 1e-9;
/// Parts of one box of the cover that may be looked at.
const BUDGET: u64 = 1_000_000;
/// What reaches farther than so many metres is judged within a cube of twice that side.
const FAR: f64 = 24.0;
/// Boxes along each side of the cover.
const COVER: u32 = 3;

fn point(at: [f32; 3], radius: f32, energy: f32) -> Primitive {
    Primitive { skeleton: Skeleton::Point(at), radius, energy }
}

fn few(of: &[Primitive]) -> Volume {
    Volume::Few(of.into())
}

fn prisms() -> Vec<Option<Volume>> {
    let prism = Prism::new(DVec2::new(1.0, 2.0), DVec2::new(12.0, 11.0), -3.0, 4.0);
    vec![prism.map(|prism| Volume::Prism(Arc::new(prism)))]
}

fn blended() -> Vec<Option<Volume>> {
    let two = [point([0.0, 0.0, 0.0], 8.0, 1.0), point([5.0, 2.0, 1.0], 6.0, -0.7)];
    vec![Some(few(&two[..1])), Some(few(&two)), Some(Volume::Blend(vec![few(&two[..1]), few(&two[1..])]))]
}

fn copies() -> Vec<Option<Volume>> {
    let child = few(&[point([1.0, 0.5, 0.0], 6.0, 1.0), point([4.0, -1.0, 2.0], 5.0, -0.6)]);
    let copy = |angle: f64, scale: f64| {
        let placement = Placement::new(DVec3::new(30.0, -7.0, 4.0), angle, scale)?;
        Some(Volume::Instance(Arc::new(Instance { child: child.clone(), placement })))
    };
    vec![copy(0.7, 1.0), copy(2.1, 0.5), copy(-1.3, 3.0)]
}

fn eroded() -> Vec<Option<Volume>> {
    let strata = geology::Node::Strata { wavelength: 9.0, octaves: 1, seed: 3 };
    let erode = |region: Primitive| {
        let child = few(&[point([0.0, 0.0, 0.0], 14.0, 1.0)]);
        let geology = Arc::new(Geology::new(5, strata.clone()).ok()?);
        Some(Volume::Erosion(Arc::new(Erosion { child, region: few(&[region]), geology })))
    };
    vec![erode(point([3.0, 0.0, 2.0], 9.0, 0.8)), erode(point([-4.0, 2.0, 0.0], 12.0, 0.5))]
}

fn warped() -> Vec<Option<Volume>> {
    let warp = |amplitude: f64, wavelength: f64| {
        let child = few(&[point([0.0, 0.0, 0.0], 10.0, 1.0)]);
        let region = few(&[point([2.0, 0.0, 0.0], 9.0, 0.9)]);
        Some(Volume::Warp(Arc::new(Warp::new(child, region, amplitude, wavelength, 1, 7).ok()?)))
    };
    vec![warp(1.0, 16.0), warp(2.0, 24.0)]
}

fn holds(members: Vec<Option<Volume>>, form: Form, shrunk: f64) -> Finding {
    let scale = form.pick(1.0, shrunk);
    Finding::all(members.into_iter().map(|member| match member {
        Some(volume) => judge(&volume, scale),
        None => Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 },
    }))
}

fn judge(volume: &Volume, scale: f64) -> Finding {
    let support = volume.support().meet(&Box3 { low: DVec3::splat(-FAR), high: DVec3::splat(FAR) });
    let step = (support.high - support.low) / f64::from(COVER);
    let (mut boxes, mut tightest) = (0, None::<(f64, f64)>);
    for k in 0..COVER * COVER * COVER {
        let cell = DVec3::new((k % COVER).into(), (k / COVER % COVER).into(), (k / (COVER * COVER)).into());
        let low = support.low + step * cell;
        let region = Box3 { low, high: low + step };
        let mut promised = volume.bounds(&region);
        promised.slope *= scale;
        let mut steepest = 0.0;
        if let Some(failed) = proves(volume, &promised, region, &mut boxes, &mut steepest) {
            return failed;
        }
        let closer = |(bound, best): (f64, f64)| steepest * bound > best * promised.slope;
        if promised.slope > 0.0 && tightest.is_none_or(closer) {
            tightest = Some((promised.slope, steepest));
        }
    }
    let (bound, attained) = tightest.unwrap_or((f64::INFINITY, 0.0));
    Finding::Proved { bound, attained, boxes }
}

fn within(value: f64, bound: f64) -> bool {
    value <= bound * (1.0 + TOLERANCE) + DUST
}

/// `None` when all that is promised is proved on the box.
fn proves(
    volume: &Volume,
    promised: &DensityBounds,
    region: Box3,
    boxes: &mut u64,
    steepest: &mut f64,
) -> Option<Finding> {
    let mut stack = vec![region];
    let mut left = BUDGET;
    while let Some(part) = stack.pop() {
        left = left.saturating_sub(1);
        *boxes += 1;
        let middle = part.low.midpoint(part.high);
        let slope = volume.sample(middle).1.length();
        *steepest = steepest.max(slope);
        if !within(slope, promised.slope) {
            return Some(Finding::Refuted { bound: promised.slope, value: slope, at: format!("{middle}") });
        }
        let sides = part.intervals();
        let f = volume.density::<Dual<Interval, 3>>(std::array::from_fn(|k| Dual::variable(sides[k], k)));
        let [x, y, z] = f.slope.map(Interval::square);
        let slope = Real::sqrt(x + y + z).hi();
        let room = DUST + TOLERANCE * promised.range.width();
        let ranges = promised.range.lo() - room <= f.value.lo() && f.value.hi() <= promised.range.hi() + room;
        if ranges && within(slope, promised.slope) {
            continue;
        }
        if left == 0 {
            let known = if ranges { slope } else { f64::INFINITY };
            return Some(Finding::Undecided { bound: promised.slope, known, boxes: *boxes });
        }
        let size = (part.high - part.low).to_array();
        let axis = (0..3).fold(0, |widest, k| if size[k] > size[widest] { k } else { widest });
        let (mut lower, mut upper) = (part, part);
        lower.high[axis] = middle[axis];
        upper.low[axis] = middle[axis];
        stack.extend([lower, upper]);
    }
    None
}
