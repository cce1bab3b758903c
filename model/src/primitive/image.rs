//! Image primitive on a rectangle (Génevaux 2015 §4.2): bilinear elevation, and a C¹ weight that fades at the border,
//! fades around samples that are unknown, and may be an image itself.

pub use super::raster::{Image, ImageNumber};

use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::falloff::{WYVILL_SLOPE, wyvill};
use crate::interval::Interval;
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, Real};
use crate::scene::{Finite, Point, Positive, Scope, one};
use glam::DVec2;
use serde::Deserialize;
use std::num::NonZeroU32;
use std::sync::Arc;

/// An image on an axis-aligned rectangle. Lengths in metres.
#[derive(Clone, Debug)]
pub struct ImagePatch {
    /// The raster.
    pub image: Arc<Image>,
    /// Position of sample (0, 0).
    pub origin: DVec2,
    /// Distance between samples along x and y.
    pub spacing: DVec2,
    /// Width of the border over which the weight rises.
    pub margin: f64,
    /// Weight inside.
    pub weight: f64,
    /// Weights ≥ 0 as samples spread over the same rectangle, read by a C¹ spline; they multiply `weight`.
    pub weights: Option<Arc<Image>>,
    /// Factor of the samples.
    pub elevation_scale: f64,
    /// Added to the scaled samples.
    pub elevation_offset: f64,
}

/// An image in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    file: String,
    /// South-west corner; the file's own when absent.
    #[serde(default)]
    origin: Option<Point>,
    /// Metres between samples; the file's own when absent.
    #[serde(default)]
    spacing: Option<(Positive, Positive)>,
    /// Averages blocks of this many samples along each axis into one.
    #[serde(default)]
    reduce: Option<NonZeroU32>,
    margin: Positive,
    #[serde(default = "one")]
    weight: Positive,
    /// Weights as samples spread over the same rectangle.
    #[serde(default)]
    weight_file: Option<String>,
    #[serde(default = "unit")]
    elevation_scale: Finite,
    #[serde(default)]
    elevation_offset: Finite,
}

fn unit() -> Finite {
    Finite::of(1.0)
}

impl File {
    pub(crate) fn build(&self, scope: &mut Scope<'_>) -> Result<ImagePatch, String> {
        let placed = scope.image(&self.file, self.reduce)?;
        Ok(ImagePatch {
            image: placed.image.clone(),
            origin: self.origin.map_or(placed.origin, |p| DVec2::new(p.0.into(), p.1.into())),
            spacing: self.spacing.map_or(placed.spacing, |s| DVec2::new(s.0.into(), s.1.into())),
            margin: self.margin.into(),
            weight: self.weight.into(),
            weights: self.weight_file.as_deref().map(|file| scope.image(file, None)).transpose()?.map(|w| w.image),
            elevation_scale: self.elevation_scale.into(),
            elevation_offset: self.elevation_offset.into(),
        })
    }
}

/// Parameters: x and y of sample (0, 0), 1/dx, 1/dy, offset of the sample index in u and v (0 in world coordinates),
/// centre x and y, half extents, 1/margin, weight, elevation scale and offset; of the weights: samples per metre along x
/// and y, offset of the index in u and v, largest sample.
const WIDTH: usize = 19;

/// A compiled image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    image: u16,
    /// Added to the sample index.
    base: [i32; 2],
    weights: Option<u16>,
    weights_base: [i32; 2],
}

impl Authored for ImagePatch {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let ImagePatch { image, origin, spacing, margin, weight, weights, elevation_scale, elevation_offset } = self;
        let cells = DVec2::new(image.width() as f64 - 1.0, image.height() as f64 - 1.0);
        let half = cells * *spacing * 0.5;
        let placed = origin.is_finite() && spacing.is_finite() && spacing.min_element() > 0.0;
        let weighs = *weight > 0.0 && weight.is_finite();
        if !(placed && weighs && elevation_scale.is_finite() && elevation_offset.is_finite()) {
            return Err("an image needs a finite origin, positive spacing and weight".to_owned());
        }
        if !(*margin > 0.0 && *margin <= half.min_element()) {
            return Err("the margin of an image must be positive and at most half its smaller side".to_owned());
        }
        let index = out.image(image)?;
        let weights = weights_of(image, weights.as_ref(), (DVec2::splat(*margin) / *spacing).to_array())?;
        let (samples, largest) = weights.as_ref().map_or((DVec2::ZERO, 1.0), |w| {
            (DVec2::new(w.width() as f64 - 1.0, w.height() as f64 - 1.0) / (half * 2.0), w.range().hi())
        });
        let weights = weights.map(|weights| out.image(&weights)).transpose()?;
        let centre = *origin + half;
        let at = out.store([origin.x, origin.y, 1.0 / spacing.x, 1.0 / spacing.y, 0.0, 0.0, centre.x, centre.y]);
        out.store([half.x, half.y, 1.0 / margin, *weight, *elevation_scale, elevation_offset + 0.0]);
        out.store([samples.x, samples.y, 0.0, 0.0, largest]);
        Ok(Code { at, image: index, base: [0, 0], weights, weights_base: [0, 0] })
    }
}

/// The weights of a raster: those given, faded within `margin` samples of what is unknown.
///
/// # Errors
/// When a weight is negative, or nothing is far enough from what is unknown.
pub(super) fn weights_of(
    image: &Image,
    given: Option<&Arc<Image>>,
    margin: [f64; 2],
) -> Result<Option<Arc<Image>>, String> {
    if given.is_some_and(|given| given.range().lo() < 0.0 || given.hole_count() > 0) {
        return Err("a weight image needs weights of at least 0, each known".to_owned());
    }
    let factor = |i: usize, j: usize| {
        given.map_or(1.0, |given| {
            let along = |k: usize, of: usize, count: usize| k as f64 / (of as f64 - 1.0) * (count as f64 - 1.0);
            let at = [along(i, image.width(), given.width()), along(j, image.height(), given.height())];
            f64::spline(given, [0, 0], at)
        })
    };
    let weights = image.hole_weights(margin, factor).map(Arc::new).or_else(|| given.cloned());
    if weights.as_ref().is_some_and(|weights| weights.range().hi() <= 0.0) {
        return Err("an image has no weight anywhere: no sample lies 3 samples from what is unknown".to_owned());
    }
    Ok(weights)
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        let [i, j] = self.base;
        out.extend([self.at, u32::from(self.image), i as u32, j as u32]);
        let Some(weights) = self.weights else { return };
        let [i, j] = self.weights_base;
        out.extend([u32::from(weights), i as u32, j as u32]);
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let u = [
            (x[0] - p.get::<R>(0)) * p.get::<R>(2) + p.get::<R>(4),
            (x[1] - p.get::<R>(1)) * p.get::<R>(3) + p.get::<R>(5),
        ];
        let image = &tables.images[usize::from(self.image)];
        let elevation = R::lookup(image, self.base, u) * p.get::<R>(12) + p.get::<R>(13);
        let from_edge = |k: usize| p.get::<R>(8 + k) - (x[k] - p.get::<R>(6 + k)).abs();
        let mut weight = p.get::<R>(11) * edge(from_edge(0), p.get(10)) * edge(from_edge(1), p.get(10));
        if let Some(weights) = self.weights {
            let u = [
                (x[0] - p.get::<R>(0)) * p.get::<R>(14) + p.get::<R>(16),
                (x[1] - p.get::<R>(1)) * p.get::<R>(15) + p.get::<R>(17),
            ];
            weight = weight * R::spline(&tables.images[usize::from(weights)], self.weights_base, u);
        }
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        let edges = weight_range(p, region);
        match self.weights {
            None => edges,
            Some(_) => edges * Interval::new(0.0, p.0[18]),
        }
    }
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
        let weights = self.weights.map(|weights| &*tables.images[usize::from(weights)]);
        bounds(p, &tables.images[usize::from(self.image)], weights, region)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        let (centre, half) = (DVec2::new(p.0[6], p.0[7]), DVec2::new(p.0[8], p.0[9]));
        around([centre - half, centre + half], 1e-9 * (half.max_element() + centre.length()))
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let from = origin - DVec2::new(p.0[0], p.0[1]);
        // Whole samples become integers, the rest stays below 1.
        let split = |per_metre: &[f64]| {
            let at = from * DVec2::new(per_metre[0], per_metre[1]);
            let whole = at.floor();
            ([wrap(whole.x), wrap(whole.y)], at - whole)
        };
        let (base, rest) = split(&p.0[2..]);
        let (weights_base, weights_rest) = split(&p.0[14..]);
        let mut moved = p.0[..WIDTH].to_vec();
        (moved[0], moved[1], moved[4], moved[5]) = (0.0, 0.0, rest.x, rest.y);
        (moved[6], moved[7]) = (p.0[6] - origin.x, p.0[7] - origin.y);
        (moved[16], moved[17]) = (weights_rest.x, weights_rest.y);
        Code { at: tile.store(moved), base, weights_base, ..*self }
    }
}

/// A whole number of any size, modulo 2³².
fn wrap(whole: f64) -> i32 {
    const SPAN: f64 = 4_294_967_296.0;
    (whole - (whole / SPAN).floor() * SPAN) as u32 as i32
}

/// 1 inside, 0 from the border on, C¹ in between: Wyvill's falloff of what is left of the margin.
#[inline(always)]
pub(super) fn edge<R: Real>(distance: R, inverse_margin: R) -> R {
    let t = (distance * inverse_margin).clamp01();
    wyvill((R::one() - t).square())
}

/// Range of the weight alone: all that pruning asks.
fn weight_range(p: Parameters<f64>, region: &Region) -> Interval {
    let point = |k: usize| Interval::point(p.0[k]);
    let from_edge = |k: usize| point(8 + k) - Real::abs(region.extent[k] - point(6 + k));
    let weight = point(11) * edge(from_edge(0), point(10)) * edge(from_edge(1), point(10));
    if weight.hi() <= 0.0 || from_edge(0).hi() <= 0.0 || from_edge(1).hi() <= 0.0 {
        return Interval::ZERO;
    }
    Interval::new(weight.lo().max(0.0), weight.hi())
}

/// Range and slopes over a region, from the pyramid. λ = √((M_x/l_x)² + (M_y/l_y)²) (claims G19).
fn bounds(p: Parameters<f64>, image: &Image, weights: Option<&Image>, region: &Region) -> Bounds {
    let point = |k: usize| Interval::point(p.0[k]);
    let x = region.extent;
    let weight = weight_range(p, region);
    if weight.hi() <= 0.0 {
        return Bounds::ABSENT;
    }
    let from_edge = |k: usize| point(8 + k) - Real::abs(x[k] - point(6 + k));
    let (a, b) = (edge(from_edge(0), point(10)), edge(from_edge(1), point(10)));
    let u = [(x[0] - point(0)) * point(2) + point(4), (x[1] - point(1)) * point(3) + point(5)];
    let [value, du, dv] = Interval::lookup_jet(image, [0, 0], u);
    let slope_u = (du * point(2) * point(12)).magnitude();
    let slope_v = (dv * point(3) * point(12)).magnitude();
    let slope = Interval::length(Interval::point(slope_u), Interval::point(slope_v)).hi();
    // The edge's slope is at most L/margin, and 0 where the margin is passed; the product's gradient adds by axis.
    let steep = |distance: Interval| {
        let t = distance * point(10);
        if t.lo() >= 1.0 { 0.0 } else { times_up(WYVILL_SLOPE, p.0[10]) }
    };
    let (sa, sb) = (times_up(steep(from_edge(0)), b.hi()), times_up(steep(from_edge(1)), a.hi()));
    let mut weight_slope = (point(11) * Interval::length(Interval::point(sa), Interval::point(sb))).hi();
    let mut weight = weight;
    if let Some(weights) = weights {
        // α = edges · s: λ_α ≤ λ_edges·sup s + sup edges·λ_s, s and λ_s from the spline.
        let u = [(x[0] - point(0)) * point(14) + point(16), (x[1] - point(1)) * point(15) + point(17)];
        let [s, du, dv] = Interval::spline_jet(weights, [0, 0], u);
        let slope = Interval::length(du * point(14), dv * point(15)).hi();
        weight_slope = plus_up(times_up(weight_slope, s.hi().max(0.0)), times_up(weight.hi(), slope));
        weight = weight * s;
        if weight.hi() <= 0.0 {
            return Bounds::ABSENT;
        }
        weight = Interval::new(weight.lo().max(0.0), weight.hi());
    }
    Bounds::primitive(value * point(12) + point(13), weight, slope, weight_slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Program;
    use crate::tree::Tree;

    #[test]
    fn cells_wrap_as_32_bit_integers() {
        assert_eq!(wrap(-1.0), -1);
        assert_eq!(wrap(4_294_967_296.0 + 5.0), 5);
        assert_eq!(wrap(2_147_483_648.0), i32::MIN);
    }

    /// 40 × 30 samples 10 m apart with holes at (20, 15) and (21, 15).
    fn pierced(holes: bool, weights: Option<Arc<Image>>) -> Program {
        let (w, h) = (40, 30);
        let samples = (0..w * h).map(|k| ((k * 37) % 101) as f32).collect();
        let unknown = (0..w * h).map(|k| holes && k / w == 15 && (k % w) / 2 == 10).collect();
        let patch = ImagePatch {
            image: Arc::new(Image::with_holes(w, h, samples, unknown).expect("a valid image")),
            origin: DVec2::new(1000.0, -500.0),
            spacing: DVec2::splat(10.0),
            margin: 50.0,
            weight: 1.0,
            weights,
            elevation_scale: 1.0,
            elevation_offset: 0.0,
        };
        let mut tree = Tree::new();
        let root = tree.push(patch);
        Program::compile(&tree, root).expect("it compiles")
    }

    #[test]
    fn cells_that_touch_a_hole_have_weight_0_exactly() {
        let (pierced, whole) = (pierced(true, None), pierced(false, None));
        let (mut risen, mut control) = (0, 0);
        for k in 0..=300 {
            for l in 0..=200 {
                let at = DVec2::new(1190.0 + 0.1 * f64::from(k), -360.0 + 0.1 * f64::from(l));
                assert_eq!(pierced.height(at).1, 0.0, "{at}");
                control += usize::from(whole.height(at).1 > 0.0);
            }
            // From the hole's cells outward the weight rises to that of the whole image.
            let out = DVec2::new(1220.0 + 0.5 * f64::from(k), -350.0);
            let (here, bare) = (pierced.height(out).1, whole.height(out).1);
            assert!(here <= bare + 1e-12);
            risen += usize::from(here > 0.99 * bare && bare > 0.5);
        }
        assert!(control == 301 * 201 && risen > 20, "{control} {risen}");
    }

    #[test]
    fn the_weight_around_a_hole_is_c1_and_within_its_slope_bound() {
        let program = pierced(true, None);
        let mut steepest = 0.0f64;
        for k in 0..4000 {
            let at = DVec2::new(1150.0 + 0.03 * f64::from(k), -380.0 + 0.013 * f64::from(k));
            let (s, t) = (program.sample(at), program.sample(at + DVec2::new(1e-6, 0.0)));
            // The spline's second derivative is at most 2 · (largest difference 0.4) / (10 m)² and the edge is flat here.
            assert!((s.weight_gradient - t.weight_gradient).length() < 1e-6 * 0.02, "{at}");
            let bounds = program.bounds(Region::rectangle(at, at + DVec2::splat(3.0)));
            assert!(s.weight_gradient.length() <= bounds.weight_slope);
            steepest = steepest.max(s.weight_gradient.length());
        }
        // Wyvill's falloff over 50 m is at most 1.72 / 50 steep; a control that this path crosses the rise.
        assert!(steepest > 0.02 && steepest < 0.035, "{steepest}");
    }

    #[test]
    fn a_weight_image_multiplies_and_a_negative_one_is_refused() {
        let weights = |low: f32| Arc::new(Image::new(2, 2, vec![low, 1.0, low, 1.0]).expect("a valid image"));
        let program = pierced(false, Some(weights(0.0)));
        let (west, east) = (program.height(DVec2::new(1060.0, -360.0)).1, program.height(DVec2::new(1330.0, -360.0)).1);
        assert!(west < 0.3 && east > 0.7, "{west} {east}");
        let image = Image::new(3, 3, vec![0.0; 9]).expect("a valid image");
        let error = weights_of(&image, Some(&weights(-1.0)), [1.0; 2]).unwrap_err();
        assert!(error.contains("at least 0"), "{error}");
    }
}
