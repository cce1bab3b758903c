//! Contour primitive (Génevaux 2015 §4.1, Fig. 7): a closed curve around a centre, with a cross-section on each of several
//! rays; between two rays it changes with the angle. A lake is one whose profiles are 0 inside.
//!
//! Directions never become angles: with A and B the distances of a point from the two rays of its sector,
//! t = A / (A + B) runs from 0 to 1 between them, and the fade of t makes shore and heights C¹ in the angle. Near the centre,
//! where that ratio has no slope bound, all profiles must be the same constant (claims G23).

use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region};
use crate::certify::cover::{ENOUGH, largest_over_all};
use crate::dual::Dual;
use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::profile::{self, Knot, PIECE_WIDTH};
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Finite, Point, Positive, Scope, one};
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// A contour. Lengths in metres.
#[derive(Clone, Debug)]
pub struct Contour {
    /// The centre; z is the elevation that profiles are added to.
    pub centre: DVec3,
    /// Direction from which the angles of rays are counted, radians from east, anticlockwise (v in the paper).
    pub orientation: f64,
    /// The rays, by increasing angle; at least three.
    pub rays: Vec<Ray>,
    /// How far past the contour the support reaches.
    pub reach: f64,
    /// Weight inside.
    pub weight: f64,
}

/// The contour and its cross-section in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ray {
    /// Angle from the orientation, radians; `None` divides the turn evenly, for all rays at once.
    pub angle: Option<f64>,
    /// Distance of the contour from the centre.
    pub radius: f64,
    /// Heights over the distance past the contour, negative inside.
    pub profile: Vec<Knot>,
}

/// A contour in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    centre: Point,
    #[serde(default)]
    elevation: Finite,
    #[serde(default)]
    orientation_degrees: Finite,
    rays: Vec<RayFile>,
    reach: Positive,
    #[serde(default = "one")]
    weight: Positive,
    /// The profile of rays that have none of their own.
    #[serde(default)]
    profile: Vec<Knot>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RayFile {
    #[serde(default)]
    degrees: Option<Finite>,
    radius: Positive,
    #[serde(default)]
    profile: Vec<Knot>,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

impl File {
    pub(crate) fn build(&self, _: &mut Scope<'_>) -> Result<Contour, String> {
        let ray = |ray: &RayFile| Ray {
            angle: ray.degrees.map(|degrees| f64::from(degrees) * DEGREE),
            radius: ray.radius.into(),
            profile: if ray.profile.is_empty() { self.profile.clone() } else { ray.profile.clone() },
        };
        Ok(Contour {
            centre: DVec3::new(self.centre.0.into(), self.centre.1.into(), self.elevation.into()),
            orientation: f64::from(self.orientation_degrees) * DEGREE,
            rays: self.rays.iter().map(ray).collect(),
            reach: self.reach.into(),
            weight: self.weight.into(),
        })
    }
}

/// Parameters before those of the rays: centre, elevation, weight, 1/reach², support radius, slope bounds of elevation and
/// of weight over the whole support.
const WIDTH: usize = 8;
/// Parameters of a ray before its pieces: direction, radius, least A + B of its sector that is told from the centre.
const RAY_WIDTH: usize = 4;

/// A compiled contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    rays: u16,
    pieces: u16,
}

impl Contour {
    /// Angles of the rays from east, radians.
    fn angles(&self) -> Result<Vec<f64>, String> {
        let count = self.rays.len();
        if count < 3 {
            return Err(format!("a contour of {count} rays; expected at least 3"));
        }
        let given = self.rays.iter().filter(|ray| ray.angle.is_some()).count();
        if given != 0 && given != count {
            return Err("expected `degrees` for all rays of a contour, or for none".to_owned());
        }
        let even = |k: usize| k as f64 * std::f64::consts::TAU / count as f64;
        let angles: Vec<f64> =
            self.rays.iter().enumerate().map(|(k, ray)| ray.angle.unwrap_or_else(|| even(k))).collect();
        for k in 0..count {
            let next = if k + 1 < count { angles[k + 1] } else { angles[0] + std::f64::consts::TAU };
            let sector = next - angles[k];
            if !(0.01..=2.2).contains(&sector) {
                return Err(format!(
                    "the sector after ray {} of a contour spans {:.1}°; expected between 0.6° and 126°, rays by increasing angle",
                    k + 1,
                    sector / DEGREE
                ));
            }
        }
        Ok(angles.iter().map(|angle| angle + self.orientation).collect())
    }
    /// Around the centre, up to this distance, all profiles must be one constant.
    fn core(&self) -> Result<f64, String> {
        let mut core = f64::INFINITY;
        let mut height = None;
        for (k, ray) in self.rays.iter().enumerate() {
            profile::check(&ray.profile)?;
            let Some(first) = ray.profile.first() else {
                return Err(format!("ray {} of a contour has no profile; give it one, or the contour", k + 1));
            };
            if *height.get_or_insert(first.height) != first.height {
                return Err(format!(
                    "the profile of ray {} starts {} m high and that of ray 1 {} m; expected one height at the centre",
                    k + 1,
                    first.height,
                    height.unwrap_or_default()
                ));
            }
            core = core.min(first.distance);
        }
        let smallest = self.rays.iter().map(|ray| ray.radius).fold(f64::INFINITY, f64::min);
        if core + smallest < 0.05 * smallest {
            return Err(format!(
                "a profile of a contour starts {:.1} m inside a contour of radius {smallest:.1} m; expected at most {:.1} m, so \
                 that the centre is level",
                -core,
                0.95 * smallest
            ));
        }
        Ok((core + smallest).min(smallest))
    }
}

impl Authored for Contour {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let Contour { centre, rays, reach, weight, orientation } = self;
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let rays_sound = rays.iter().all(|ray| positive(ray.radius) && ray.angle.is_none_or(f64::is_finite));
        let finite = centre.is_finite() && orientation.is_finite();
        if !(finite && positive(*reach) && positive(*weight) && rays_sound) {
            return Err("a contour needs a finite centre and positive radii, reach and weight".to_owned());
        }
        let angles = self.angles()?;
        let core = self.core()?;
        let largest = rays.iter().map(|ray| ray.radius).fold(0.0, f64::max);
        let infinite = f64::INFINITY;
        let mut parameters = vec![
            centre.x,
            centre.y,
            centre.z + 0.0,
            *weight,
            1.0 / (reach * reach),
            largest + reach,
            infinite,
            infinite,
        ];
        let compiled: Vec<Vec<f64>> = rays.iter().map(|ray| profile::compile(&ray.profile)).collect();
        let width = compiled.iter().map(Vec::len).max().unwrap_or(0);
        for (k, mut pieces) in compiled.into_iter().enumerate() {
            let direction = |k: usize| DVec2::new(libm::cos(angles[k]), libm::sin(angles[k]));
            let (here, next) = (direction(k), direction((k + 1) % rays.len()));
            // At distance d from the centre A + B = d·2 sin(φ/2)·cos(θ − φ/2) is at least d·sin φ in a sector of angle φ.
            parameters.extend([here.x, here.y, rays[k].radius, 0.5 * core * here.perp_dot(next)]);
            let last = pieces[pieces.len() - PIECE_WIDTH..].to_vec();
            while pieces.len() < width {
                pieces.extend(&last);
            }
            parameters.extend(pieces);
        }
        let (Ok(count), Ok(pieces)) = (u16::try_from(rays.len()), u16::try_from(width / PIECE_WIDTH)) else {
            return Err("a contour holds at most 65535 rays, each of at most 32767 knots".to_owned());
        };
        let mut code = Code { at: 0, rays: count, pieces };
        let slopes = out.certified.slopes(&code, &parameters, || code.support_slopes(&parameters).to_vec());
        parameters[6..8].copy_from_slice(&slopes);
        code.at = out.store(parameters);
        Ok(code)
    }
}

/// Boxes that the compiler looks at to bound each slope of a contour.
const COMPILE_BUDGET: usize = 1_000;

impl Code {
    fn stride(self) -> usize {
        RAY_WIDTH + usize::from(self.pieces) * PIECE_WIDTH
    }
    /// Elevation, weight.
    #[inline(always)]
    fn both<R: Number, P: Copy + Into<f64>>(self, p: Parameters<P>, x: [R; 2]) -> (R, R) {
        let (zero, one) = (R::zero(), R::one());
        let centre = p.pair::<R>(0);
        let v = [x[0] - centre[0], x[1] - centre[1]];
        let distance = R::length(v[0], v[1]);
        let rays = usize::from(self.rays);
        let ray = |k: usize| p.from(WIDTH + k * self.stride());
        let beside = |k: usize| {
            let direction = ray(k).pair::<R>(0);
            direction[0] * v[1] - direction[1] * v[0]
        };
        // The centre itself lies in no sector; it is as high as the start of every profile.
        let (mut height, mut past) = (ray(0).get::<R>(RAY_WIDTH + 1), distance - ray(0).get(2));
        let first = beside(0);
        let mut after = first;
        let mut entered = false;
        for k in 0..rays {
            let (here, next) = (ray(k), ray((k + 1) % rays));
            let before = after;
            after = if k + 1 < rays { beside(k + 1) } else { first };
            let outside = before.less(zero).or(after.less(zero).not());
            if outside.must_hold() {
                continue;
            }
            let (a, b) = (before.max(zero), (-after).max(zero));
            let t = (a / (a + b).max(here.get(3))).min(one);
            let w = t.square() * (R::constant(3.0) - t - t);
            // From one side, not as a mean of both: equal heights stay equal to the last bit.
            let mix = |from: R, to: R| from + w * (to - from);
            let sector_past = distance - mix(here.get(2), next.get(2));
            let section =
                |q: Parameters<P>| profile::evaluate(q.from(RAY_WIDTH), usize::from(self.pieces), sector_past);
            let sector_height = mix(section(here), section(next));
            height = if entered { R::select(outside, height, sector_height) } else { sector_height };
            past = if entered { R::select(outside, past, sector_past) } else { sector_past };
            entered = true;
        }
        let weight = p.get::<R>(3) * wyvill(past.max(zero).square() * p.get::<R>(4));
        (p.get::<R>(2) + height, weight)
    }
    fn enclose(self, p: Parameters<f64>, extent: [Interval; 2]) -> [Dual<Interval, 2>; 2] {
        self.both(p, [Dual::variable(extent[0], 0), Dual::variable(extent[1], 1)]).into()
    }
    /// Slope bounds of elevation and weight over the whole support.
    fn support_slopes(self, p: &[f64]) -> [f64; 2] {
        let p = Parameters(p);
        let radius = p.0[5];
        let root = [0, 1].map(|axis| Interval::point(p.0[axis]) + Interval::symmetric(radius));
        let length = |d: Dual<Interval, 2>| Interval::length(d.slope[0], d.slope[1]).hi();
        [0, 1].map(|which| {
            let bound = |extent: [Interval; 2]| {
                let both = self.enclose(p, extent);
                (both[1].value.hi() > 0.0).then(|| length(both[which]))
            };
            let attained = |[x, y]: [f64; 2]| {
                let (f, a) = self.both(p, [Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1)]);
                if a.value > 0.0 { DVec2::from_array(if which == 0 { f.slope } else { a.slope }).length() } else { 0.0 }
            };
            largest_over_all([root], radius / 4096.0, COMPILE_BUDGET, ENOUGH, bound, attained)
        })
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, u32::from(self.rays), u32::from(self.pieces)]);
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, _: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let (elevation, weight) = self.both(p, x);
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        let range = self.both::<Interval, f64>(p, region.extent).1;
        if range.hi() <= 0.0 { Interval::ZERO } else { Interval::new(range.lo().max(0.0), range.hi()) }
    }
    fn bounds(&self, p: Parameters<f64>, _: Tables<'_>, region: &Region) -> Bounds {
        let [elevation, weight] = self.enclose(p, region.extent);
        if weight.value.hi() <= 0.0 {
            return Bounds::ABSENT;
        }
        let length = |d: Dual<Interval, 2>| Interval::length(d.slope[0], d.slope[1]).hi();
        let range = Interval::new(weight.value.lo().max(0.0), weight.value.hi());
        Bounds::primitive(elevation.value, range, length(elevation).min(p.0[6]), length(weight).min(p.0[7]))
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        around([DVec2::new(p.0[0], p.0[1])], p.0[5])
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let mut moved = p.0[..WIDTH + usize::from(self.rays) * self.stride()].to_vec();
        moved[0] -= origin.x;
        moved[1] -= origin.y;
        Code { at: tile.store(moved), ..*self }
    }
}
