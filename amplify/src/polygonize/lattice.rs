//! The lattice of cubes that a field is sampled on. Positions are computed here alone, so blocks and regions agree to the
//! bit.

use super::PolygonizeError;
use crate::field::Box3;
use glam::DVec3;

/// Cubes of side `spacing` metres from `origin` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    origin: DVec3,
    spacing: f64,
    cells: [usize; 3],
}

impl Lattice {
    /// A lattice of `cells` cubes along x, y and z.
    ///
    /// # Errors
    /// [`PolygonizeError::Lattice`] when it has no cube, more than 2²⁰ along an axis, or a side that is not positive.
    pub fn new(origin: DVec3, spacing: f64, cells: [usize; 3]) -> Result<Lattice, PolygonizeError> {
        let sound = origin.is_finite()
            && spacing > 0.0
            && spacing.is_finite()
            && cells.iter().all(|&n| (1..=1 << 20).contains(&n));
        if sound { Ok(Lattice { origin, spacing, cells }) } else { Err(PolygonizeError::Lattice { spacing, cells }) }
    }
    /// The lattice that covers `region` with a cell to spare on every side.
    ///
    /// # Errors
    /// As [`Lattice::new`].
    pub fn over(region: &Box3, spacing: f64) -> Result<Lattice, PolygonizeError> {
        let cells = ((region.high - region.low) / spacing).ceil() + 2.0;
        Lattice::new(region.low - spacing, spacing, cells.to_array().map(|n| n as usize))
    }
    /// The side of a cube, metres.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }
    /// Cubes along x, y and z.
    pub fn cells(&self) -> [usize; 3] {
        self.cells
    }
    /// The coordinate of corner `k` plus `share` of a side along `axis`.
    #[inline(always)]
    pub fn coordinate(&self, axis: usize, k: usize, share: f64) -> f64 {
        self.origin[axis] + self.spacing * (k as f64 + share)
    }
    /// A corner.
    #[inline(always)]
    pub fn corner(&self, at: [usize; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| self.coordinate(axis, at[axis], 0.0)))
    }
    /// The point at `share` of the edge from corner `at` along `axis`.
    #[inline(always)]
    pub fn on_edge(&self, at: [usize; 3], axis: usize, share: f64) -> DVec3 {
        let mut p = self.corner(at);
        p[axis] = self.coordinate(axis, at[axis], share);
        p
    }
    /// Is the corner on the lattice's border? Such corners count as air, so that every mesh is closed.
    #[inline(always)]
    pub fn on_border(&self, at: [usize; 3]) -> bool {
        (0..3).any(|axis| at[axis] == 0 || at[axis] >= self.cells[axis])
    }
    /// The box of the cubes from `low` up to, not including, `high`; holds all their corners.
    pub fn region(&self, low: [usize; 3], high: [usize; 3]) -> Box3 {
        Box3 { low: self.corner(low), high: self.corner(high) }
    }
    /// The cubes that share a point with `region`: from the first up to, not including, the second; `None` when there are
    /// none.
    pub fn cubes_meeting(&self, region: &Box3) -> Option<[[usize; 3]; 2]> {
        let whole = self.region([0; 3], self.cells);
        if region.is_empty() || !region.meets(&whole) {
            return None;
        }
        // A cube to spare on either side covers the rounding.
        let at = |p: DVec3, axis: usize| ((p[axis] - self.origin[axis]) / self.spacing).max(0.0) as usize;
        let low = std::array::from_fn(|k| at(region.low, k).saturating_sub(1).min(self.cells[k] - 1));
        let high = std::array::from_fn(|k| at(region.high, k).saturating_add(2).min(self.cells[k]));
        Some([low, high])
    }
}
