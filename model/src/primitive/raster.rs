//! Rasters as fields: bilinear lookups on every number, and a pyramid of ranges and differences so that a local bound
//! does not visit every sample. Lookups that are C¹ stand in `spline.rs`.

use super::spline;
use crate::dual::{Differentiable, Dual};
use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::lanes::Lanes;
use crate::real::Real;
use crate::rounding::{Rounded, UNIT};
use std::collections::VecDeque;

/// A raster of elevations, row 0 in the south, with its pyramid.
#[derive(Debug)]
pub struct Image {
    width: usize,
    height: usize,
    samples: Vec<f32>,
    levels: Vec<Level>,
    /// Which samples are unknown; empty when none is.
    holes: Vec<bool>,
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
        let mut image = Image { width, height, samples, levels: Vec::new(), holes: Vec::new() };
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
    /// A raster of which some samples are unknown. An unknown one takes the value of a known one nearby, so that ranges
    /// and differences stay those of the terrain; a primitive has weight 0 in every cell that touches it. `None` as for
    /// [`Image::new`], or when nothing is known.
    pub fn with_holes(width: usize, height: usize, mut samples: Vec<f32>, holes: Vec<bool>) -> Option<Image> {
        if width.checked_mul(height)? != samples.len() || holes.len() != samples.len() {
            return None;
        }
        // Breadth first from the known samples in their order: the same neighbour is taken on every run.
        let mut open = holes.clone();
        let mut queue: VecDeque<usize> = (0..samples.len()).filter(|k| !holes[*k]).collect();
        if queue.is_empty() {
            return None;
        }
        while let Some(k) = queue.pop_front() {
            let (i, j) = (k % width, k / width);
            let near = [
                (i > 0, k.wrapping_sub(1)),
                (i + 1 < width, k + 1),
                (j > 0, k.wrapping_sub(width)),
                (j + 1 < height, k + width),
            ];
            for (_, next) in near.into_iter().filter(|(inside, _)| *inside) {
                if std::mem::replace(&mut open[next], false) {
                    samples[next] = samples[k];
                    queue.push_back(next);
                }
            }
        }
        let image = Image::new(width, height, samples)?;
        let holes = if holes.contains(&true) { holes } else { Vec::new() };
        Some(Image { holes, ..image })
    }
    /// How many samples are unknown.
    pub fn hole_count(&self) -> usize {
        self.holes.iter().filter(|hole| **hole).count()
    }
    /// Weights that are 0 around unknown samples and rise, Wyvill-shaped, to 1 at `margin` samples along u and v from
    /// there; `factor` of each sample multiplies. `None` when nothing is unknown.
    ///
    /// The zeros reach two samples beyond a hole. A cell that touches the hole lies within one sample of it, and the
    /// spline reads samples up to one beyond the nearest: it is exactly 0 on the cell and half a sample further.
    pub(crate) fn hole_weights(&self, margin: [f64; 2], factor: impl Fn(usize, usize) -> f64) -> Option<Image> {
        if self.holes.is_empty() {
            return None;
        }
        let (width, height) = (self.width, self.height);
        let mut zero = vec![false; self.holes.len()];
        for (k, _) in self.holes.iter().enumerate().filter(|(_, hole)| **hole) {
            let (i, j) = (k % width, k / width);
            for row in j.saturating_sub(spline::REACH)..(j + spline::REACH + 1).min(height) {
                let first = row * width;
                zero[first + i.saturating_sub(spline::REACH)..first + (i + spline::REACH + 1).min(width)].fill(true);
            }
        }
        // Samples along the row to the nearest zero, by a sweep in each direction.
        let mut along = vec![f64::INFINITY; zero.len()];
        for j in 0..height {
            let row = &mut along[j * width..(j + 1) * width];
            let mut last = f64::INFINITY;
            for (i, distance) in row.iter_mut().enumerate() {
                last = if zero[j * width + i] { 0.0 } else { last + 1.0 };
                *distance = last;
            }
            for distance in row.iter_mut().rev() {
                last = distance.min(last + 1.0);
                *distance = last;
            }
        }
        let mut weights = vec![0.0f32; zero.len()];
        for j in 0..height {
            for i in 0..width {
                let mut squared = 1.0f64;
                for up in 0..height {
                    let rise = (up as f64 / margin[1]) * (up as f64 / margin[1]);
                    if rise >= squared {
                        break;
                    }
                    for row in [j.checked_sub(up), Some(j + up).filter(|row| *row < height)].into_iter().flatten() {
                        let run = along[row * width + i] / margin[0];
                        squared = squared.min(run * run + rise);
                    }
                }
                let left = 1.0 - squared.sqrt();
                weights[j * width + i] = (wyvill(left * left) * factor(i, j)) as f32;
            }
        }
        Image::new(width, height, weights)
    }
    /// Means over blocks of `factor` × `factor` samples; what does not fill a block is left out, and a block with an
    /// unknown sample is unknown.
    pub fn reduced(&self, factor: usize) -> Option<Image> {
        let (width, height) = (self.width / factor.max(1), self.height / factor.max(1));
        let mut samples = Vec::with_capacity(width * height);
        let mut holes = Vec::with_capacity(width * height);
        for j in 0..height {
            for i in 0..width {
                let block =
                    || (0..factor * factor).map(|k| (j * factor + k / factor) * self.width + i * factor + k % factor);
                let sum: f64 = block().map(|at| f64::from(self.samples[at])).sum();
                samples.push((sum / (factor * factor) as f64) as f32);
                holes.push(block().any(|at| self.holes.get(at).copied().unwrap_or(false)));
            }
        }
        Image::with_holes(width, height, samples, holes)
    }
    /// Samples along u.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Samples along v.
    pub fn height(&self) -> usize {
        self.height
    }
    /// The samples, row by row from the south.
    pub fn samples(&self) -> &[f32] {
        &self.samples
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

    /// Sample (i, j).
    #[inline(always)]
    pub(super) fn sample(&self, i: usize, j: usize) -> f32 {
        self.samples[j * self.width + i]
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
    #[inline]
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
        self.hull(first, last)
    }
    /// As [`Image::enclose`], by whole cells: looser in small rectangles, and several times as fast.
    pub fn enclose_cells(&self, u: Interval, v: Interval) -> [Interval; 3] {
        let cells = [self.width - 1, self.height - 1];
        let first = [Image::locate(cells[0], 0, u.lo()).0, Image::locate(cells[1], 0, v.lo()).0];
        let last = [Image::locate(cells[0], 0, u.hi()).0, Image::locate(cells[1], 0, v.hi()).0];
        self.hull(first, last)
    }
    /// Of the cells from `first` to `last`.
    fn hull(&self, first: [usize; 2], last: [usize; 2]) -> [Interval; 3] {
        let span = (last[0] - first[0]).max(last[1] - first[1]) + 1;
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
    /// The C¹ lookup: the biquadratic B-spline over the samples.
    #[inline(always)]
    fn spline(image: &Image, base: [i32; 2], u: [Self; 2]) -> Self {
        Self::spline_jet(image, base, u)[0]
    }
    /// The C¹ lookup with its derivatives per sample step.
    fn spline_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3];
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
    #[inline(always)]
    fn spline_jet(image: &Image, base: [i32; 2], u: [f64; 2]) -> [f64; 3] {
        spline::double(image, base, u)
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
    #[inline(always)]
    fn spline_jet(image: &Image, base: [i32; 2], u: [f32; 2]) -> [f32; 3] {
        spline::lanes(image, base, [Lanes::<1>([u[0]]), Lanes([u[1]])]).map(|lane| lane.0[0])
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
    #[inline(always)]
    fn spline_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3] {
        spline::lanes(image, base, u)
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
    fn spline_jet(image: &Image, base: [i32; 2], u: [Interval; 2]) -> [Interval; 3] {
        spline::interval(image, base, u)
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
    fn spline_jet(image: &Image, base: [i32; 2], u: [Rounded; 2]) -> [Rounded; 3] {
        spline::rounded(image, base, u)
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
    #[inline(always)]
    fn spline(image: &Image, base: [i32; 2], u: [Self; 2]) -> Self {
        let [value, du, dv] = R::spline_jet(image, base, [u[0].value, u[1].value]);
        Dual::chain(value, [du, dv], u)
    }
    fn spline_jet(image: &Image, base: [i32; 2], u: [Self; 2]) -> [Self; 3] {
        // Second derivatives are not used: only values are differentiated.
        let [_, du, dv] = R::spline_jet(image, base, [u[0].value, u[1].value]);
        [Self::spline(image, base, u), Dual::fixed(du), Dual::fixed(dv)]
    }
}
