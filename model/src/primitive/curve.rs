//! Curve primitive (Génevaux 2015 §4.1, Fig. 6): elevation along a skeleton plus a cross-section of the signed distance.
//!
//! The paper takes the elevation of the nearest point, which jumps on the medial axis (claims G22). Here arcs of the skeleton
//! that are about as near are averaged: with D = √(d² + q²), an arc whose D exceeds the smallest by e has weight (1 − e/E)³,
//! so that their sum is at least 1 and elevation is Lipschitz. On the skeleton arcs within s metres take part, s being the
//! *joint*; off it, distances that differ by more than E < s do not. Near a joint each arc carries its neighbour's elevation
//! on, so that the mean of the two is the elevation of the skeleton. Sections are read at a distance that all share.
//!
//! A section has an even and an odd part, c(±d) = e(d) ± o(d). The sign of d jumps past an open end. There the even part stays
//! the paper's, and the odd part is read at a side that passes through 0: e(d) + o(side), side within ±d.

use super::{Authored, Extent, Leaf, Number, Parameters, Tables};
use crate::bounds::{Bounds, Region, times_up};
use crate::certify::cover::largest_over_all;
use crate::dual::Dual;
use crate::falloff::{wyvill, wyvill_steepness};
use crate::interval::Interval;
use crate::profile::{self, Knot, Section, Sections};
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Point3, Positive, Scope, one};
use crate::skeleton::{self, Chain};
use crate::spline::Path;
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// A curve with cross-sections. Lengths in metres.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The skeleton, with elevations.
    pub path: Path,
    /// Radius of the support.
    pub radius: f64,
    /// Weight on the skeleton.
    pub weight: f64,
    /// How far a joint is smoothed.
    pub joint: f64,
    /// How far the arcs of the skeleton may lie from the path.
    pub tolerance: f64,
    /// Cross-sections along the skeleton; none is flat.
    pub sections: Vec<Section>,
}

/// The part of the radius within which arcs follow a path, if nothing else is asked for.
pub const TOLERANCE: f64 = 0.01;
/// The part of the radius over which joints are averaged, if nothing else is asked for.
pub const JOINT: f64 = 0.25;

impl Curve {
    /// A path with one cross-section, weight 1, and the joint and tolerance that go with `radius`.
    pub fn new(path: Path, radius: f64, profile: Vec<Knot>) -> Curve {
        let sections = vec![Section { at: 0.0, profile }];
        Curve { path, radius, weight: 1.0, joint: JOINT * radius, tolerance: TOLERANCE * radius, sections }
    }
}

/// A curve in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// A polyline; anything else is a `path`.
    #[serde(default)]
    points: Vec<Point3>,
    #[serde(default)]
    path: Option<PathFile>,
    radius: Positive,
    #[serde(default = "one")]
    weight: Positive,
    #[serde(default)]
    joint: Option<Positive>,
    #[serde(default)]
    tolerance: Option<Positive>,
    #[serde(default)]
    profile: Vec<Knot>,
    #[serde(default)]
    sections: Vec<Section>,
}

/// A path in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PathFile {
    Polyline(Vec<Point3>),
    Quadratic(Vec<Point3>),
    Cubic(Vec<Point3>),
    Smooth(Vec<Point3>),
}

pub(super) fn points(points: &[Point3]) -> Vec<DVec3> {
    points.iter().map(|p| DVec3::new(p.0.into(), p.1.into(), p.2.into())).collect()
}

impl PathFile {
    pub(super) fn path(&self) -> Path {
        match self {
            PathFile::Polyline(p) => Path::Polyline(points(p)),
            PathFile::Quadratic(p) => Path::Quadratic(points(p)),
            PathFile::Cubic(p) => Path::Cubic(points(p)),
            PathFile::Smooth(p) => Path::Smooth(points(p)),
        }
    }
}

/// What a scene file says in one of two ways: the path.
pub(super) fn path_of(polyline: &[Point3], path: Option<&PathFile>) -> Result<Path, String> {
    match (polyline.is_empty(), path) {
        (true, Some(path)) => Ok(path.path()),
        (false, None) => Ok(Path::Polyline(points(polyline))),
        _ => Err("expected either `points` of a polyline or a `path`".to_owned()),
    }
}

impl File {
    pub(crate) fn build(&self, _: &mut Scope<'_>) -> Result<Curve, String> {
        let path = path_of(&self.points, self.path.as_ref())?;
        let mut curve = Curve::new(path, self.radius.into(), self.profile.clone());
        if !self.sections.is_empty() {
            if !self.profile.is_empty() {
                return Err("expected either a `profile` or `sections`".to_owned());
            }
            curve.sections.clone_from(&self.sections);
        }
        curve.weight = self.weight.into();
        curve.joint = self.joint.map_or(curve.joint, f64::from);
        curve.tolerance = self.tolerance.map_or(curve.tolerance, f64::from);
        Ok(curve)
    }
}

/// Parameters before those of the chain: 1/r², weight, 1/r.
const WIDTH: usize = 3;

/// A compiled curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    arcs: u16,
    sections: Sections,
}

impl Authored for Curve {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let Curve { path, radius, weight, joint, tolerance, sections } = self;
        if ![radius, weight, joint, tolerance].into_iter().all(|v| *v > 0.0 && v.is_finite()) {
            return Err("a curve needs a positive radius, weight, joint and tolerance".to_owned());
        }
        let stretches = path.stretches(*tolerance, *joint)?;
        let (sections, section_parameters) = profile::compile_sections(sections)?;
        let mut parameters = vec![1.0 / (radius * radius), *weight, 1.0 / radius];
        parameters.extend(skeleton::parameters(&stretches, *radius, *joint));
        parameters.extend(section_parameters);
        let mut code = Code { at: 0, arcs: stretches.len() as u16, sections };
        let slopes = out.certified.slopes(&code, &parameters, || code.slopes(&parameters, *joint));
        for (run, slope) in slopes.into_iter().enumerate() {
            parameters[WIDTH + skeleton::slope_of_run(run)] = slope;
        }
        code.at = out.store(parameters);
        Ok(code)
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, u32::from(self.arcs)]);
        self.sections.fields(out);
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, _: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let chain = self.chain(p);
        let nearest = chain.nearest(x);
        let weight = p.get::<R>(1) * wyvill(nearest.square() * p.get::<R>(0));
        if !R::zero().less(weight).may_hold() {
            return Operand::new(R::zero(), weight);
        }
        let section = self.section(p);
        let elevation =
            chain.elevation(x, nearest, |place, s| self.sections.beside(section, nearest, place.inside, place.side, s));
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        let nearest = self.chain(p).nearest(region.extent);
        let range = Interval::point(p.0[1]) * wyvill(nearest.square() * Interval::point(p.0[0]));
        if range.hi() <= 0.0 { Interval::ZERO } else { Interval::new(range.lo().max(0.0), range.hi()) }
    }
    /// Ranges by the formula on intervals, λ_α ≤ w·max |g′|/r over the distances met (distance is 1-Lipschitz), and of two
    /// slopes the smaller: of the region alone, and the one certified around the runs that the region comes near.
    fn bounds(&self, p: Parameters<f64>, _: Tables<'_>, region: &Region) -> Bounds {
        let nearest = self.chain(p).nearest(region.extent);
        let u = nearest.square() * Interval::point(p.0[0]);
        if u.lo() >= 1.0 {
            return Bounds::ABSENT;
        }
        let weight = Interval::point(p.0[1]) * wyvill(u);
        let range = Interval::new(weight.lo().max(0.0), weight.hi());
        let weight_slope = times_up(p.0[1], times_up(wyvill_steepness(u), p.0[2].next_up()));
        let (elevation, slope) = self.enclose(p, region.extent, nearest);
        Bounds::primitive(elevation, range, slope.min(self.slope_near(p, region.extent)), weight_slope)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        let radius = DVec2::splat(1.0 / p.0[0].sqrt());
        let around = |[x, y, w, h]: [f64; 4]| {
            let (middle, half) = (DVec2::new(x, y), DVec2::new(w, h) + radius);
            (middle - half, middle + half)
        };
        self.chain(p).boxes().map(around).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
    fn grain(&self, p: Parameters<f64>) -> f64 {
        2.0 / p.0[0].sqrt()
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let chain = WIDTH + skeleton::width(usize::from(self.arcs));
        let mut moved = p.0[..chain + self.sections.width()].to_vec();
        skeleton::rebase(&mut moved[WIDTH..chain], usize::from(self.arcs), origin);
        Code { at: tile.store(moved), ..*self }
    }
}

/// Boxes that the compiler splits to bound the slope around all runs of arcs, and at least around each.
const COMPILE_BUDGET: [usize; 2] = [6_000, 100];
/// A slope bound is good enough when it is this many times what is attained.
const ENOUGH: f64 = 1.3;

impl Code {
    #[inline(always)]
    fn chain<'a, P: Copy + Into<f64>>(&self, p: Parameters<'a, P>) -> Chain<'a, P> {
        Chain::new(p.from(WIDTH), usize::from(self.arcs))
    }
    #[inline(always)]
    fn section<'a, P: Copy + Into<f64>>(&self, p: Parameters<'a, P>) -> Parameters<'a, P> {
        p.from(WIDTH + skeleton::width(usize::from(self.arcs)))
    }
    /// Elevation over a box and a bound of its slope.
    fn enclose(&self, p: Parameters<f64>, extent: [Interval; 2], nearest: Interval) -> (Interval, f64) {
        self.chain(p).enclose(extent, nearest, self.sections, self.section(p))
    }
    /// Boxes around the runs, as wide as the support.
    fn around(&self, p: Parameters<f64>) -> impl Iterator<Item = [Interval; 2]> {
        let reach = Interval::symmetric((1.0 / p.0[0].sqrt()) * (1.0 + 1e-12));
        self.chain(p).boxes().map(move |[x, y, w, h]| {
            [(x, w), (y, h)].map(|(middle, half)| Interval::point(middle) + Interval::symmetric(half) + reach)
        })
    }
    /// The largest of the slope bounds around the runs whose support may reach a box.
    fn slope_near(&self, p: Parameters<f64>, extent: [Interval; 2]) -> f64 {
        let meets = |a: Interval, b: Interval| a.lo() <= b.hi() && b.lo() <= a.hi();
        let near = |around: &[Interval; 2]| meets(around[0], extent[0]) && meets(around[1], extent[1]);
        let slopes = self.around(p).enumerate().filter(|(_, around)| near(around));
        slopes.fold(0.0, |slope, (run, _)| slope.max(p.0[WIDTH + skeleton::slope_of_run(run)]))
    }
    /// A slope bound around each run, over its support.
    fn slopes(&self, p: &[f64], joint: f64) -> Vec<f64> {
        let p = Parameters(p);
        let bound = |extent: [Interval; 2]| {
            let nearest = self.chain(p).nearest(extent);
            let u = nearest.square() * Interval::point(p.0[0]);
            (u.lo() < 1.0).then(|| self.enclose(p, extent, nearest).1)
        };
        let attained = |[x, y]: [f64; 2]| {
            let Operand { elevation, weight, .. } =
                self.sample(p, Tables::NONE, [Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1)]);
            if weight.value > 0.0 { DVec2::from_array(elevation.slope).length() } else { 0.0 }
        };
        let [all, each] = COMPILE_BUDGET;
        let budget = (all / self.around(p).count().max(1)).max(each);
        let over = |root| largest_over_all([root], joint / 256.0, budget, ENOUGH, bound, attained);
        self.around(p).map(over).collect()
    }
}
