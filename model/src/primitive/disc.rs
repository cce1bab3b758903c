//! Disc primitive (Génevaux 2015 §4.1, Fig. 5): a centre, a radius, and an elevation that is constant or a noise.

use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::dual::Dual;
use crate::falloff::{wyvill, wyvill_steepness};
use crate::interval::Interval;
use crate::noise::{Bounds as NoiseBounds, Combination, GRADIENT2_RANGE, GRADIENT2_SLOPE, NoiseValue, Octave, Octaves};
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Finite, Point, Positive, Scope, one};
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// A disc. Lengths in metres.
#[derive(Clone, Debug)]
pub struct Disc {
    /// Centre; z is the elevation before noise.
    pub centre: DVec3,
    /// Radius of the support.
    pub radius: f64,
    /// Weight at the centre.
    pub weight: f64,
    /// Noise, none for a constant disc.
    pub noise: Option<DiscNoise>,
}

/// The noise that shapes a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscNoise {
    /// How octaves combine.
    pub combination: Combination,
    /// The octaves, 1 to 16.
    pub octaves: Octaves,
    /// Selects the lattices.
    pub seed: u32,
}

/// A disc in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    #[serde(default)]
    name: Option<String>,
    centre: Point,
    #[serde(default)]
    elevation: Finite,
    radius: Positive,
    #[serde(default = "one")]
    weight: Positive,
    #[serde(default)]
    noise: Option<NoiseFile>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseFile {
    kind: Combination,
    /// Metres of the longest wave.
    wavelength: Positive,
    amplitude: Finite,
    octaves: u32,
    #[serde(default = "two")]
    lacunarity: Positive,
    #[serde(default = "half")]
    gain: Positive,
    #[serde(default)]
    seed: Option<u32>,
}

fn two() -> Positive {
    Positive::of(2.0)
}
fn half() -> Positive {
    Positive::of(0.5)
}

impl File {
    pub(crate) fn build(&self, scope: &mut Scope<'_>) -> Result<Disc, String> {
        let noise = match &self.noise {
            None => None,
            Some(noise) => {
                let octaves = Octaves {
                    octaves: noise.octaves,
                    frequency: 1.0 / f64::from(noise.wavelength),
                    lacunarity: noise.lacunarity.into(),
                    gain: noise.gain.into(),
                    amplitude: noise.amplitude.into(),
                };
                let seed = scope
                    .seed(self.name.as_deref(), noise.seed)
                    .ok_or("a disc with noise needs a `name` or a `seed` of its noise")?;
                Some(DiscNoise { combination: noise.kind, octaves, seed })
            }
        };
        let centre = DVec3::new(self.centre.0.into(), self.centre.1.into(), self.elevation.into());
        Ok(Disc { centre, radius: self.radius.into(), weight: self.weight.into(), noise })
    }
}

/// Parameters before those of the noise: centre x, centre y, 1/r², weight at the centre, elevation.
const WIDTH: usize = 5;

/// A compiled disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    noise: Option<Noise>,
}

/// Where the noise of a disc stands in the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Noise {
    combination: Combination,
    first: u32,
    octaves: u32,
    bounds: u32,
}

impl Noise {
    #[inline(always)]
    fn octaves<'a>(&self, tables: Tables<'a>) -> &'a [Octave<2>] {
        &tables.octaves[self.first as usize..(self.first + self.octaves) as usize]
    }
}

impl Authored for Disc {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let Disc { centre, radius, weight, noise } = self;
        if !(centre.is_finite() && *radius > 0.0 && radius.is_finite() && *weight > 0.0 && weight.is_finite()) {
            return Err("a disc needs a finite centre, a positive radius and a positive weight".to_owned());
        }
        let at = out.store([centre.x, centre.y, 1.0 / (radius * radius), *weight, centre.z + 0.0]);
        let Some(n) = noise else { return Ok(Code { at, noise: None }) };
        if !n.octaves.is_sound() {
            let expected = "noise needs 1 to 16 octaves, a positive frequency and lacunarity, a gain of at least 0";
            return Err(expected.to_owned());
        }
        // The compact form of the octaves; the tables below follow from it.
        let o = n.octaves;
        out.store([o.frequency, o.lacunarity, o.amplitude, o.gain, f64::from(n.seed)]);
        out.store(n.combination.constants());
        let placed = o.place(n.seed, [0.0; 2]);
        let bounds = out.noises.len() as u32;
        out.noises.push(n.combination.placed_bounds(&placed));
        let first = out.octaves.len() as u32;
        out.octaves.extend(placed);
        Ok(Code { at, noise: Some(Noise { combination: n.combination, first, octaves: o.octaves, bounds }) })
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        out.push(self.at);
        let Some(noise) = &self.noise else { return };
        let single = |value: f64| (value as f32).to_bits();
        let (kind, constants) = match noise.combination {
            Combination::Sum => (0, [0, 0]),
            Combination::Turbulence => (1, [0, 0]),
            Combination::Ridged { offset, sharpness } => (2, [single(offset), single(sharpness)]),
            Combination::Multifractal { offset } => (3, [single(offset), 0]),
            Combination::Hybrid { offset } => (4, [single(offset), 0]),
        };
        out.extend([noise.first, noise.octaves, kind, constants[0], constants[1]]);
    }
    fn words(&self) -> usize {
        if self.noise.is_some() { 2 } else { 1 }
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let weight: R = weight(p, x);
        let mut elevation: R = p.get(4);
        // Outside the support the elevation is never used: this is the tree as bounding volumes.
        if let Some(noise) = &self.noise
            && R::zero().less(weight).may_hold()
        {
            let c = p.pair::<R>(0);
            let at = if tables.tiled { x } else { [x[0] - c[0], x[1] - c[1]] };
            elevation = elevation + noise.combination.plane(noise.octaves(tables), at);
        }
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        weight_range(p, region)
    }
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
        let (weight, weight_slope) = weight_bounds(p, region);
        let elevation = Interval::point(p.0[4]);
        let Some(noise) = self.noise.filter(|_| weight.hi() > 0.0) else {
            return Bounds::primitive(elevation, weight, 0.0, weight_slope);
        };
        let certified = &tables.noises[noise.bounds as usize];
        let (mut range, mut slope) = (certified.range, certified.slope);
        let octaves = noise.octaves(tables);
        let width = region.extent[0].width().max(region.extent[1].width());
        if width * octaves[0].frequency < LOCAL {
            let along =
                |axis: usize| Dual::<Interval, 2>::variable(region.extent[axis] - Interval::point(p.0[axis]), axis);
            let local = local_noise(noise.combination, octaves, [along(0), along(1)], width);
            range = range.meet(local.value);
            slope = slope.min(Interval::length(local.slope[0], local.slope[1]).hi());
        }
        Bounds::primitive(elevation + range, weight, slope, weight_slope)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        around([DVec2::new(p.0[0], p.0[1])], 1.0 / p.0[2].sqrt())
    }
    fn weight_only(self) -> Code {
        Code { noise: None, ..self }
    }
    /// A term of a sum or of turbulence is at most a·sup|η| high and a·f·λ_η steep; products of octaves stay whole.
    fn simplified(
        self,
        _: Parameters<f64>,
        tables: Tables<'_>,
        _: &Region,
        slope: f64,
        noises: &mut Vec<NoiseBounds>,
    ) -> (Code, f64) {
        let sums = |noise: &Noise| matches!(noise.combination, Combination::Sum | Combination::Turbulence);
        let Some(noise) = self.noise.filter(sums) else { return (self, 0.0) };
        let octaves = noise.octaves(tables);
        let term = |k: usize| {
            let Octave { amplitude, frequency, .. } = octaves[k];
            let height = times_up(amplitude.abs(), GRADIENT2_RANGE);
            (height, times_up(times_up(amplitude.abs(), frequency), GRADIENT2_SLOPE))
        };
        let (left, error) = trailing(octaves.len(), slope, term);
        if left == octaves.len() {
            return (self, 0.0);
        }
        let bounds = noises.len() as u32;
        noises.push(noise.combination.placed_bounds(&octaves[..left]));
        let noise = (left > 0).then_some(Noise { octaves: left as u32, bounds, ..noise });
        (Code { noise, ..self }, error)
    }
    fn octaves(&self) -> usize {
        self.noise.map_or(0, |noise| noise.octaves as usize)
    }
    fn rebase(&self, p: Parameters<f64>, tables: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let [x, y] = [p.0[0] - origin.x, p.0[1] - origin.y];
        let at = tile.store([x, y].into_iter().chain(p.0[2..WIDTH].iter().copied()));
        let noise = self.noise.map(|noise| {
            let first = tile.octaves.len() as u32;
            // From the centre, which is the origin of the octaves, to the tile's.
            let moved = noise.octaves(tables).iter().map(|octave| octave.moved_to([-x, -y]).rounded());
            tile.octaves.extend(moved);
            Noise { first, ..noise }
        });
        Code { at, noise }
    }
}

/// An octave is run on a region narrower than this many of its cells; elsewhere its certified range and slope stand.
pub(super) const LOCAL: f64 = 0.35;

/// A noise over a region `width` metres wide: the octaves that are coarse enough are run on it.
fn local_noise(
    combination: Combination,
    octaves: &[Octave<2>],
    x: [Dual<Interval, 2>; 2],
    width: f64,
) -> Dual<Interval, 2> {
    combination.combine(octaves, |octave| local(octave, x, width))
}

/// How many of `count` octaves are left when the last leave while together they are no steeper than `slope`, and how high
/// those that leave are together; `term` gives height and slope of one, metres.
pub(super) fn trailing(count: usize, slope: f64, term: impl Fn(usize) -> (f64, f64)) -> (usize, f64) {
    let (mut left, mut height, mut steep) = (count, 0.0, 0.0);
    while left > 0 {
        let (h, s) = term(left - 1);
        steep = plus_up(steep, s);
        if steep > slope {
            break;
        }
        height = plus_up(height, h);
        left -= 1;
    }
    (left, height)
}

/// One octave over a region `width` metres wide.
pub(super) fn local(octave: &Octave<2>, x: [Dual<Interval, 2>; 2], width: f64) -> Dual<Interval, 2> {
    if width * octave.frequency < LOCAL {
        return Dual::gradient2(octave.lattice, octave.coordinates(x));
    }
    let slope = Interval::point(octave.frequency) * Interval::symmetric(GRADIENT2_SLOPE);
    Dual { value: Interval::symmetric(GRADIENT2_RANGE), slope: [slope; 2] }
}

/// α = w·g(d²/r²) with Wyvill's falloff; 0 from the radius on.
#[inline(always)]
pub(super) fn weight<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> R {
    let c = p.pair::<R>(0);
    let d2 = (x[0] - c[0]).square() + (x[1] - c[1]).square();
    p.get::<R>(3) * wyvill(d2 * p.get::<R>(2))
}

/// Range of the weight over a region, exactly 0 off the support.
pub(super) fn weight_range(p: Parameters<f64>, region: &Region) -> Interval {
    let u = region.distance_squared([p.0[0], p.0[1]]) * Interval::point(p.0[2]);
    if u.lo() >= 1.0 {
        return Interval::ZERO;
    }
    let range = Interval::point(p.0[3]) * wyvill(u);
    Interval::new(range.lo().max(0.0), range.hi())
}

/// Range and slope of the weight over a region: α from the formula on the distance's enclosure, λ_α = w·max |g′| over
/// the distances met, at most w·L/r.
pub(super) fn weight_bounds(p: Parameters<f64>, region: &Region) -> (Interval, f64) {
    let d2 = region.distance_squared([p.0[0], p.0[1]]);
    let u = d2 * Interval::point(p.0[2]);
    if u.lo() >= 1.0 {
        return (Interval::ZERO, 0.0);
    }
    let scale = Interval::point(p.0[3]);
    let inverse_radius = Real::sqrt(Interval::point(p.0[2]));
    let range = scale * wyvill(u);
    let slope = scale * inverse_radius * Interval::point(wyvill_steepness(u));
    (Interval::new(range.lo().max(0.0), range.hi()), slope.hi())
}
