//! Where points may be: a rectangle of the plane, the surface of a heightfield between two elevations, and a box of space; the
//! distance that points keep is a function of the place, and where it says `None` there are none.

use super::SamplingError;
use super::darts::Region;
use crate::field::Box3;
use glam::{DVec2, DVec3};
use terrain_model::grid::{Grid, Sample};

/// How far points keep from one another, place by place.
#[derive(Clone, Copy, Debug)]
pub struct Spacing<F> {
    /// The distance at a place, metres, or `None` where no point is wanted. What is outside of `least` … `most` is held there.
    ///
    /// A part of a region where it answers `None` on a lattice of three samples along each side of a cell is taken for empty;
    /// cells begin `most`/√2 wide on the plane and on surfaces, `most`/√3 in space.
    pub at: F,
    /// The smallest distance, metres.
    pub least: f64,
    /// The largest distance, metres.
    pub most: f64,
    /// By how much the distance changes a metre, at most. Too small a number can leave gaps, never points too close.
    pub slope: f64,
}

impl Spacing<fn(DVec3) -> Option<f64>> {
    /// One `distance`, metres, where `wanted`.
    pub fn masked(
        distance: f64,
        wanted: impl Fn(DVec3) -> bool + Sync,
    ) -> Spacing<impl Fn(DVec3) -> Option<f64> + Sync> {
        Spacing { at: move |p| wanted(p).then_some(distance), least: distance, most: distance, slope: 0.0 }
    }
    /// One `distance`, metres, everywhere.
    pub fn uniform(distance: f64) -> Spacing<impl Fn(DVec3) -> Option<f64> + Sync> {
        Spacing::masked(distance, |_| true)
    }
}

impl<F: Fn(DVec3) -> Option<f64> + Sync> Spacing<F> {
    fn lower_bound(&self, within: &Box3) -> f64 {
        let half = 0.5 * (within.high - within.low);
        let middle = (self.at)(within.low + half).unwrap_or(self.least);
        // NaN fails the comparison and is the least.
        let bound = middle - self.slope * half.length();
        if bound > self.least { bound.min(self.most) } else { self.least }
    }
    /// Is a point wanted at one of 3^D parameters of a box, by their places?
    fn wanted<const D: usize>(&self, low: [f64; D], high: [f64; D], place: impl Fn([f64; D]) -> Option<DVec3>) -> bool {
        (0..3usize.pow(D as u32)).any(|mut n| {
            let u = std::array::from_fn(|k| {
                let part = 0.5 * (n % 3) as f64;
                n /= 3;
                low[k] + part * (high[k] - low[k])
            });
            place(u).is_some_and(|p| (self.at)(p).is_some())
        })
    }
}

/// A rectangle of the plane z = 0: Poisson disks.
#[derive(Clone, Copy, Debug)]
pub struct Plane<F> {
    /// South-west corner, metres.
    pub low: DVec2,
    /// North-east corner, metres.
    pub high: DVec2,
    /// Of the points.
    pub spacing: Spacing<F>,
}

impl<F: Fn(DVec3) -> Option<f64> + Sync> Region<2> for Plane<F> {
    fn domain(&self) -> [[f64; 2]; 2] {
        [self.low.to_array(), self.high.to_array()]
    }
    fn place(&self, u: [f64; 2]) -> DVec3 {
        DVec2::from_array(u).extend(0.0)
    }
    fn enclose(&self, low: [f64; 2], high: [f64; 2]) -> Option<Box3> {
        let wanted = self.spacing.wanted(low, high, |u| Some(self.place(u)));
        wanted.then(|| Box3 { low: self.place(low), high: self.place(high) })
    }
    fn distance(&self, p: DVec3) -> Option<f64> {
        (self.spacing.at)(p)
    }
    fn distances(&self) -> [f64; 2] {
        [self.spacing.least, self.spacing.most]
    }
    fn least_distance(&self, within: &Box3) -> f64 {
        self.spacing.lower_bound(within)
    }
}

/// A box of space: Poisson spheres in a volume.
#[derive(Clone, Copy, Debug)]
pub struct Space<F> {
    /// The box.
    pub within: Box3,
    /// Of the points.
    pub spacing: Spacing<F>,
}

impl<F: Fn(DVec3) -> Option<f64> + Sync> Region<3> for Space<F> {
    fn domain(&self) -> [[f64; 3]; 2] {
        [self.within.low.to_array(), self.within.high.to_array()]
    }
    fn place(&self, u: [f64; 3]) -> DVec3 {
        DVec3::from_array(u)
    }
    fn enclose(&self, low: [f64; 3], high: [f64; 3]) -> Option<Box3> {
        let wanted = self.spacing.wanted(low, high, |u| Some(self.place(u)));
        wanted.then(|| Box3 { low: self.place(low), high: self.place(high) })
    }
    fn distance(&self, p: DVec3) -> Option<f64> {
        (self.spacing.at)(p)
    }
    fn distances(&self) -> [f64; 2] {
        [self.spacing.least, self.spacing.most]
    }
    fn least_distance(&self, within: &Box3) -> f64 {
        self.spacing.lower_bound(within)
    }
}

/// The surface of a heightfield between two elevations: Poisson spheres whose centres are on it, at distances in space. The
/// surface is bilinear between samples.
#[derive(Clone, Debug)]
pub struct Surface<F> {
    heights: Grid<f64>,
    band: [f64; 2],
    spacing: Spacing<F>,
}

impl<F: Fn(DVec3) -> Option<f64> + Sync> Surface<F> {
    /// The part of `heights` from elevation `low` to `high`, metres; infinities leave a side open.
    ///
    /// # Errors
    /// [`SamplingError::Heightfield`], [`SamplingError::Band`].
    pub fn new<T: Sample>(
        heights: &Grid<T>,
        [low, high]: [f64; 2],
        spacing: Spacing<F>,
    ) -> Result<Surface<F>, SamplingError> {
        let (width, height) = (heights.width(), heights.height());
        let heights = heights.map(None, |z| z.map_or(f64::NAN, T::to_f64));
        let unknown = heights.values().iter().filter(|z| !z.is_finite()).count();
        if width < 2 || height < 2 || unknown > 0 {
            return Err(SamplingError::Heightfield { width, height, unknown });
        }
        // Also refuses NaN.
        if low.partial_cmp(&high).is_none_or(|order| order.is_gt()) {
            return Err(SamplingError::Band { low, high });
        }
        Ok(Surface { heights, band: [low, high], spacing })
    }
    /// The surface at (x, y) as the bilinear patch whose south-west sample is (i, j) continues it.
    fn patch(&self, i: usize, j: usize, p: DVec2) -> f64 {
        let t = (p - self.heights.position(i, j)) / self.heights.spacing();
        let z = |a: usize, b: usize| self.heights.values()[(j + b) * self.heights.width() + i + a];
        let south = z(0, 0) + t.x * (z(1, 0) - z(0, 0));
        let north = z(0, 1) + t.x * (z(1, 1) - z(0, 1));
        south + t.y * (north - south)
    }
    /// South-west sample of the patch that holds `p`.
    fn patch_at(&self, p: DVec2) -> [usize; 2] {
        let t = (p - self.heights.origin()) / self.heights.spacing();
        [(t.x as usize).min(self.heights.width() - 2), (t.y as usize).min(self.heights.height() - 2)]
    }
    fn in_band(&self, p: DVec3) -> bool {
        self.band[0] <= p.z && p.z <= self.band[1]
    }
}

impl<F: Fn(DVec3) -> Option<f64> + Sync> Region<2> for Surface<F> {
    fn domain(&self) -> [[f64; 2]; 2] {
        let (low, high) = self.heights.bounds();
        [low.to_array(), high.to_array()]
    }
    fn place(&self, u: [f64; 2]) -> DVec3 {
        let p = DVec2::from_array(u);
        let [i, j] = self.patch_at(p);
        p.extend(self.patch(i, j, p))
    }
    fn enclose(&self, low: [f64; 2], high: [f64; 2]) -> Option<Box3> {
        let (low, high) = (DVec2::from_array(low), DVec2::from_array(high));
        let (first, last) = (self.patch_at(low), self.patch_at(high));
        let (mut bottom, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in first[1]..=last[1] {
            for i in first[0]..=last[0] {
                // A bilinear patch is extreme at corners of a rectangle; here, of what the box and the patch share.
                let a = low.max(self.heights.position(i, j));
                let b = high.min(self.heights.position(i + 1, j + 1));
                for corner in [a, b, DVec2::new(a.x, b.y), DVec2::new(b.x, a.y)] {
                    let z = self.patch(i, j, corner);
                    (bottom, top) = (bottom.min(z), top.max(z));
                }
            }
        }
        // The rounding of a patch is some ulps of its elevations.
        let slack = 1e-12 * bottom.abs().max(top.abs());
        let (bottom, top) = ((bottom - slack).max(self.band[0]), (top + slack).min(self.band[1]));
        let (low, high) = (low.to_array(), high.to_array());
        let wanted = || {
            let within =
                |u| Some(self.place(u)).map(|p: DVec3| p.clamp(DVec3::MIN.with_z(bottom), DVec3::MAX.with_z(top)));
            self.spacing.wanted(low, high, within)
        };
        let corner = |u: [f64; 2], z: f64| DVec2::from_array(u).extend(z);
        (bottom <= top && wanted()).then(|| Box3 { low: corner(low, bottom), high: corner(high, top) })
    }
    fn distance(&self, p: DVec3) -> Option<f64> {
        if self.in_band(p) { (self.spacing.at)(p) } else { None }
    }
    fn distances(&self) -> [f64; 2] {
        [self.spacing.least, self.spacing.most]
    }
    fn least_distance(&self, within: &Box3) -> f64 {
        self.spacing.lower_bound(within)
    }
}
