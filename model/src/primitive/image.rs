//! Image primitive on a rectangle (Génevaux 2015 §4.2): bilinear elevation, C¹ weight that fades at the border, and a
//! pyramid of ranges and differences so that a local bound does not visit the whole raster.

use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, times_up};
use crate::dual::{Differentiable, Dual};
use crate::falloff::{WYVILL_SLOPE, wyvill};
use crate::interval::Interval;
use crate::lanes::Lanes;
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, Real};
use crate::rounding::{Rounded, UNIT};
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
            elevation_scale: self.elevation_scale.into(),
            elevation_offset: self.elevation_offset.into(),
        })
    }
}

/// Parameters: x and y of sample (0, 0), 1/dx, 1/dy, offset of the sample index in u and v (0 in world coordinates),
/// centre x and y, half extents, 1/margin, weight, elevation scale and offset.
const WIDTH: usize = 14;

/// A compiled image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    image: u16,
    /// Added to the sample index.
    base: [i32; 2],
}

impl Authored for ImagePatch {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let ImagePatch { image, origin, spacing, margin, weight, elevation_scale, elevation_offset } = self;
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
        let centre = *origin + half;
        let at = out.store([origin.x, origin.y, 1.0 / spacing.x, 1.0 / spacing.y, 0.0, 0.0, centre.x, centre.y]);
        out.store([half.x, half.y, 1.0 / margin, *weight, *elevation_scale, elevation_offset + 0.0]);
        Ok(Code { at, image: index, base: [0, 0] })
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
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
        let weight = p.get::<R>(11) * edge(from_edge(0), p.get(10)) * edge(from_edge(1), p.get(10));
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        weight_range(p, region)
    }
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
        bounds(p, &tables.images[usize::from(self.image)], region)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        let (centre, half) = (DVec2::new(p.0[6], p.0[7]), DVec2::new(p.0[8], p.0[9]));
        around([centre - half, centre + half], 1e-9 * (half.max_element() + centre.length()))
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let cells = (origin - DVec2::new(p.0[0], p.0[1])) * DVec2::new(p.0[2], p.0[3]);
        let whole = cells.floor();
        let rest = cells - whole;
        let mut moved = p.0[..WIDTH].to_vec();
        (moved[0], moved[1], moved[4], moved[5]) = (0.0, 0.0, rest.x, rest.y);
        (moved[6], moved[7]) = (p.0[6] - origin.x, p.0[7] - origin.y);
        Code { at: tile.store(moved), image: self.image, base: [wrap(whole.x), wrap(whole.y)] }
    }
}

/// A whole number of any size, modulo 2³².
fn wrap(whole: f64) -> i32 {
    const SPAN: f64 = 4_294_967_296.0;
    (whole - (whole / SPAN).floor() * SPAN) as u32 as i32
}

/// A raster of elevations, row 0 in the south, with its pyramid.
#[derive(Debug)]
pub struct Image {
    width: usize,
    height: usize,
    samples: Vec<f32>,
    levels: Vec<Level>,
}

/// Enclosures of value and of neighbour differences over blocks of 2ᵏ × 2ᵏ cells.
#[derive(Debug)]
struct Level {
    columns: usize,
    blocks: Vec<Block>,
}

/// min, max of the samples; min, max of the differences along u; the same along v.
#[derive(Clone, Copy, Debug)]
struct Block([f32; 6]);

impl Block {
    fn hull(self, o: Block) -> Block {
        let (a, b) = (self.0, o.0);
        Block([a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3]), a[4].min(b[4]), a[5].max(b[5])])
    }
    fn jet(self) -> [Interval; 3] {
        let interval = |k: usize| Interval::new(f64::from(self.0[k]), f64::from(self.0[k + 1]));
        [interval(0), interval(2), interval(4)]
    }
}

impl Image {
    /// `width` × `height` samples, row by row from the south. `None` unless both are at least 2, the count fits and
    /// every sample is finite.
    pub fn new(width: usize, height: usize, samples: Vec<f32>) -> Option<Image> {
        if width < 2
            || height < 2
            || width.checked_mul(height)? != samples.len()
            || !samples.iter().all(|s| s.is_finite())
        {
            return None;
        }
        let mut image = Image { width, height, samples, levels: Vec::new() };
        let (mut columns, mut rows) = (width - 1, height - 1);
        let mut blocks = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                blocks.push(image.cell_block(i, j));
            }
        }
        image.levels.push(Level { columns, blocks });
        while columns > 1 || rows > 1 {
            let below = &image.levels[image.levels.len() - 1];
            let (c, r) = (columns.div_ceil(2), rows.div_ceil(2));
            let mut blocks = Vec::with_capacity(c * r);
            for j in 0..r {
                for i in 0..c {
                    let mut hull = below.blocks[2 * j * columns + 2 * i];
                    for (p, q) in [(1, 0), (0, 1), (1, 1)] {
                        if 2 * i + p < columns && 2 * j + q < rows {
                            hull = hull.hull(below.blocks[(2 * j + q) * columns + 2 * i + p]);
                        }
                    }
                    blocks.push(hull);
                }
            }
            (columns, rows) = (c, r);
            image.levels.push(Level { columns, blocks });
        }
        Some(image)
    }
    /// Means over blocks of `factor` × `factor` samples; what does not fill a block is left out.
    pub fn reduced(&self, factor: usize) -> Option<Image> {
        let (width, height) = (self.width / factor.max(1), self.height / factor.max(1));
        let mut samples = Vec::with_capacity(width * height);
        for j in 0..height {
            for i in 0..width {
                let block = (0..factor * factor).map(|k| {
                    let at = (j * factor + k / factor) * self.width + i * factor + k % factor;
                    f64::from(self.samples[at])
                });
                samples.push((block.sum::<f64>() / (factor * factor) as f64) as f32);
            }
        }
        Image::new(width, height, samples)
    }
    /// Samples along u.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Samples along v.
    pub fn height(&self) -> usize {
        self.height
    }
    /// Bytes of the samples as stored.
    pub fn bytes(&self) -> usize {
        4 * self.samples.len()
    }
    /// Bytes of the pyramid.
    pub fn acceleration_bytes(&self) -> usize {
        self.levels.iter().map(|level| level.blocks.len() * size_of::<Block>()).sum()
    }
    /// Smallest and largest sample.
    pub fn range(&self) -> Interval {
        self.levels[self.levels.len() - 1].blocks[0].jet()[0]
    }

    fn corners(&self, i: usize, j: usize) -> [f32; 4] {
        let k = j * self.width + i;
        [self.samples[k], self.samples[k + 1], self.samples[k + self.width], self.samples[k + self.width + 1]]
    }
    fn cell_block(&self, i: usize, j: usize) -> Block {
        let s = self.corners(i, j);
        let difference = |a: f32, b: f32| {
            let d = f64::from(b) - f64::from(a);
            ((d as f32).next_down(), (d as f32).next_up())
        };
        let (u0, u1, v0, v1) =
            (difference(s[0], s[1]), difference(s[2], s[3]), difference(s[0], s[2]), difference(s[1], s[3]));
        let (low, high) =
            (s.iter().copied().fold(f32::INFINITY, f32::min), s.iter().copied().fold(f32::NEG_INFINITY, f32::max));
        Block([low, high, u0.0.min(u1.0), u0.1.max(u1.1), v0.0.min(v1.0), v0.1.max(v1.1)])
    }
    /// Cell and position inside it along one axis of `cells` cells; positions outside are clamped to the border.
    fn locate(cells: usize, base: i32, u: f64) -> (usize, f64) {
        let u = (u + f64::from(base)).clamp(0.0, cells as f64);
        let cell = (u as usize).min(cells - 1);
        (cell, u - cell as f64)
    }
    /// Enclosures of value and differences per cell over a rectangle of index space.
    pub fn enclose(&self, u: Interval, v: Interval) -> [Interval; 3] {
        let cells = [self.width - 1, self.height - 1];
        let first = [Image::locate(cells[0], 0, u.lo()).0, Image::locate(cells[1], 0, v.lo()).0];
        let last = [Image::locate(cells[0], 0, u.hi()).0, Image::locate(cells[1], 0, v.hi()).0];
        let span = (last[0] - first[0]).max(last[1] - first[1]) + 1;
        if span <= 3 {
            let mut hull: Option<[Interval; 3]> = None;
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    let local = |x: Interval, cell: usize| {
                        let x = x - Interval::point(cell as f64);
                        Interval::new(x.lo().clamp(0.0, 1.0), x.hi().clamp(0.0, 1.0))
                    };
                    let s = self.corners(i, j).map(|s| Interval::point(f64::from(s)));
                    let [value, du, dv] = bilinear_jet(s, [local(u, i), local(v, j)]);
                    let block = self.levels[0].blocks[j * cells[0] + i].jet();
                    let jet = [value.meet(block[0]), du.meet(block[1]), dv.meet(block[2])];
                    hull = Some(hull.map_or(jet, |h| [h[0].hull(jet[0]), h[1].hull(jet[1]), h[2].hull(jet[2])]));
                }
            }
            return hull.unwrap_or([Interval::ENTIRE; 3]);
        }
        // The level on which the rectangle meets at most 4 × 4 blocks.
        let mut k = 0;
        while (span - 1) >> k >= 3 && k + 1 < self.levels.len() {
            k += 1;
        }
        let level = &self.levels[k];
        let mut hull = level.blocks[(first[1] >> k) * level.columns + (first[0] >> k)];
        for j in first[1] >> k..=last[1] >> k {
            for i in first[0] >> k..=last[0] >> k {
                hull = hull.hull(level.blocks[j * level.columns + i]);
            }
        }
        hull.jet()
    }
}

/// The bilinear patch over one cell, from its corners in the order (0,0), (1,0), (0,1), (1,1).
#[inline(always)]
fn bilinear<R: Real>(s: [R; 4], [u, v]: [R; 2]) -> R {
    let low = s[0] + u * (s[1] - s[0]);
    let high = s[2] + u * (s[3] - s[2]);
    low + v * (high - low)
}

/// The patch with its derivatives along u and v.
#[inline(always)]
fn bilinear_jet<R: Real>(s: [R; 4], [u, v]: [R; 2]) -> [R; 3] {
    let (du0, du1) = (s[1] - s[0], s[3] - s[2]);
    let (dv0, dv1) = (s[2] - s[0], s[3] - s[1]);
    [bilinear(s, [u, v]), du0 + v * (du1 - du0), dv0 + u * (dv1 - dv0)]
}

/// A number on which an image can be looked up, at a position in samples; `base` is added to the index.
pub trait ImageNumber: Real {
    /// The elevation sample, before scale and offset.
    fn lookup(image: &Image, base: [i32; 2], u: [Self; 2]) -> Self;
    /// The lookup with its derivatives per sample step.
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3];
}

impl ImageNumber for f64 {
    #[inline(always)]
    fn lookup(image: &Image, base: [i32; 2], u: [f64; 2]) -> f64 {
        let (i, s) = Image::locate(image.width - 1, base[0], u[0]);
        let (j, t) = Image::locate(image.height - 1, base[1], u[1]);
        bilinear(image.corners(i, j).map(f64::from), [s, t])
    }
    #[inline(always)]
    fn lookup_jet(image: &Image, base: [i32; 2], u: [f64; 2]) -> [f64; 3] {
        let (i, s) = Image::locate(image.width - 1, base[0], u[0]);
        let (j, t) = Image::locate(image.height - 1, base[1], u[1]);
        bilinear_jet(image.corners(i, j).map(f64::from), [s, t])
    }
}

impl ImageNumber for f32 {
    #[inline(always)]
    fn lookup(image: &Image, base: [i32; 2], u: [f32; 2]) -> f32 {
        Lanes::<1>::lookup(image, base, [Lanes([u[0]]), Lanes([u[1]])]).0[0]
    }
    #[inline(always)]
    fn lookup_jet(image: &Image, base: [i32; 2], u: [f32; 2]) -> [f32; 3] {
        Lanes::<1>::lookup_jet(image, base, [Lanes([u[0]]), Lanes([u[1]])]).map(|lane| lane.0[0])
    }
}

impl<const N: usize> Lanes<N> {
    /// Corners and in-cell positions of every lane; positions outside are clamped to the border.
    #[inline(always)]
    fn gather(image: &Image, base: [i32; 2], u: [Self; 2]) -> ([Self; 4], [Self; 2]) {
        let mut corners = [Lanes::splat(0.0); 4];
        let (iu, fu) = u[0].floor();
        let (iv, fv) = u[1].floor();
        let mut s = u[0] - fu;
        let mut t = u[1] - fv;
        let (columns, rows) = (image.width as i32 - 1, image.height as i32 - 1);
        for lane in 0..N {
            let clamp = |cell: i32, cells: i32, at: &mut f32| {
                if cell < 0 {
                    *at = 0.0;
                    0
                } else if cell >= cells {
                    *at = 1.0;
                    cells - 1
                } else {
                    cell
                }
            };
            let i = clamp(iu[lane].wrapping_add(base[0]), columns, &mut s.0[lane]);
            let j = clamp(iv[lane].wrapping_add(base[1]), rows, &mut t.0[lane]);
            let four = image.corners(i as usize, j as usize);
            for k in 0..4 {
                corners[k].0[lane] = four[k];
            }
        }
        (corners, [s, t])
    }
}

impl<const N: usize> ImageNumber for Lanes<N> {
    #[inline(always)]
    fn lookup(image: &Image, base: [i32; 2], u: [Self; 2]) -> Self {
        let (corners, at) = Lanes::gather(image, base, u);
        bilinear(corners, at)
    }
    #[inline(always)]
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3] {
        let (corners, at) = Lanes::gather(image, base, u);
        bilinear_jet(corners, at)
    }
}

impl ImageNumber for Interval {
    fn lookup(image: &Image, base: [i32; 2], u: [Interval; 2]) -> Interval {
        Interval::lookup_jet(image, base, u)[0]
    }
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Interval; 2]) -> [Interval; 3] {
        let shift = |x: Interval, base: i32| if base == 0 { x } else { x + Interval::point(f64::from(base)) };
        let at = [shift(u[0], base[0]), shift(u[1], base[1])];
        let mut jet = image.enclose(at[0], at[1]);
        // Outside the raster the border value is continued: the derivative across the border is 0 there.
        for (k, cells) in [image.width - 1, image.height - 1].into_iter().enumerate() {
            if at[k].lo() < 0.0 || at[k].hi() > cells as f64 {
                jet[k + 1] = jet[k + 1].hull(Interval::ZERO);
            }
        }
        jet
    }
}

impl ImageNumber for Rounded {
    fn lookup(image: &Image, base: [i32; 2], u: [Rounded; 2]) -> Rounded {
        let exact = Interval::lookup(image, base, [u[0].exact, u[1].exact]);
        let near = Interval::lookup_jet(image, base, [u[0].reach(), u[1].reach()]);
        // The patch is continuous, so the position's error enters by the differences over what it can reach, cell
        // borders included; u − ⌊u⌋ rounds once (at most half an ulp of 1) and three interpolations round by at most
        // 4 units of the largest corner each.
        let position = [u[0].error + UNIT, u[1].error + UNIT];
        let cells = Interval::lookup_jet(
            image,
            base,
            [u[0].reach() + Interval::symmetric(1.0), u[1].reach() + Interval::symmetric(1.0)],
        );
        let propagated = near[1].magnitude().max(cells[1].magnitude()) * position[0]
            + near[2].magnitude().max(cells[2].magnitude()) * position[1];
        Rounded::new(exact, (propagated + 12.0 * UNIT * cells[0].magnitude()) * (1.0 + 1e-12) + 1e-40)
    }
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Rounded; 2]) -> [Rounded; 3] {
        // The derivative jumps between cells: its f32 value lies anywhere in the hull over the cells within reach.
        let exact = Interval::lookup_jet(image, base, [u[0].exact, u[1].exact]);
        let cells = Interval::lookup_jet(
            image,
            base,
            [u[0].reach() + Interval::symmetric(1.0), u[1].reach() + Interval::symmetric(1.0)],
        );
        let widest = |k: usize| Rounded::new(exact[k], cells[k].width() + 12.0 * UNIT * cells[k].magnitude() + 1e-40);
        [Rounded::lookup(image, base, u), widest(1), widest(2)]
    }
}

impl<R: ImageNumber + Differentiable, const K: usize> ImageNumber for Dual<R, K> {
    #[inline(always)]
    fn lookup(image: &Image, base: [i32; 2], u: [Self; 2]) -> Self {
        let [value, du, dv] = R::lookup_jet(image, base, [u[0].value, u[1].value]);
        Dual::chain(value, [du, dv], u)
    }
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3] {
        // Second derivatives of a bilinear patch are not used: only values are differentiated.
        let [_, du, dv] = R::lookup_jet(image, base, [u[0].value, u[1].value]);
        [Self::lookup(image, base, u), Dual::fixed(du), Dual::fixed(dv)]
    }
}

/// 1 inside, 0 from the border on, C¹ in between: Wyvill's falloff of what is left of the margin.
#[inline(always)]
fn edge<R: Real>(distance: R, inverse_margin: R) -> R {
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
fn bounds(p: Parameters<f64>, image: &Image, region: &Region) -> Bounds {
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
    let weight_slope = (point(11) * Interval::length(Interval::point(sa), Interval::point(sb))).hi();
    Bounds::primitive(value * point(12) + point(13), weight, slope, weight_slope)
}

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn cells_wrap_as_32_bit_integers() {
        assert_eq!(wrap(-1.0), -1);
        assert_eq!(wrap(4_294_967_296.0 + 5.0), 5);
        assert_eq!(wrap(2_147_483_648.0), i32::MIN);
    }
}
