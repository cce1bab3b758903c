//! Scale, rotation and translation of a subtree, with a vertical scale and offset (Génevaux 2015 §5.4). Consecutive ones
//! are one.

use super::Frame;
use crate::bounds::{Bounds, Region, times_up};
use crate::detail::Focus;
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters, around};
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, Real};
use glam::DVec2;

/// Scale, rotation and translation of the plane, with a vertical scale and offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Horizontal factor, positive.
    pub scale: f64,
    /// Anticlockwise, radians.
    pub rotation: f64,
    /// Metres.
    pub translation: DVec2,
    /// Factor of elevations.
    pub elevation_scale: f64,
    /// Metres added to elevations.
    pub elevation_offset: f64,
}

impl Default for Similarity {
    fn default() -> Self {
        Similarity { scale: 1.0, rotation: 0.0, translation: DVec2::ZERO, elevation_scale: 1.0, elevation_offset: 0.0 }
    }
}

impl Similarity {
    /// This map applied after `first`: consecutive affines are one.
    pub fn after(&self, first: &Similarity) -> Similarity {
        let turned = DVec2::new(libm::cos(self.rotation), libm::sin(self.rotation)).rotate(first.translation);
        Similarity {
            scale: self.scale * first.scale,
            rotation: self.rotation + first.rotation,
            translation: self.translation + turned * self.scale,
            elevation_scale: self.elevation_scale * first.elevation_scale,
            elevation_offset: self.elevation_scale * first.elevation_offset + self.elevation_offset,
        }
    }
    pub(crate) fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let finite =
            [self.scale, self.rotation, self.elevation_scale, self.elevation_offset].iter().all(|v| v.is_finite());
        if !finite || self.scale <= 0.0 || !self.translation.is_finite() {
            return Err("an affine map needs a positive scale and finite values".to_owned());
        }
        let (c, s) = (libm::cos(self.rotation) / self.scale, libm::sin(self.rotation) / self.scale);
        let t = self.translation;
        let shift = [-(c * t.x + s * t.y), -(c * t.y - s * t.x)];
        let at = out.store([c, s, -s, c, shift[0], shift[1], self.elevation_scale, self.elevation_offset + 0.0]);
        Ok(Code { at })
    }
}

/// Parameters of a similarity: the inverse map's matrix (xx, xy, yx, yy) and translation, elevation scale and offset.
const WIDTH: usize = 8;

/// A compiled similarity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    at: u32,
}

impl Frame for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.push(self.at);
    }
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    #[inline(always)]
    fn enter<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2]) -> [R; 2] {
        enter(p, x)
    }
    #[inline(always)]
    fn leave<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, a: Operand<R>) -> Operand<R> {
        let (scale, offset) = (p.get::<R>(6), p.get::<R>(7));
        let product = if R::ENCLOSES { a.product * scale + a.weight * offset } else { R::zero() };
        Operand { elevation: a.elevation * scale + offset, weight: a.weight, product }
    }
    fn enter_region(&self, p: Parameters<f64>, region: &Region) -> Region {
        enter_region(p, region)
    }
    fn leave_bounds(&self, p: Parameters<f64>, _: &Region, b: Bounds) -> Bounds {
        leave_bounds(p, b)
    }
    fn support(&self, p: Parameters<f64>, (lo, hi): Extent) -> Option<Extent> {
        let m = p.0;
        let determinant = m[0] * m[3] - m[1] * m[2];
        let back = |q: DVec2| {
            let d = DVec2::new(q.x - m[4], q.y - m[5]);
            DVec2::new(m[3] * d.x - m[1] * d.y, m[0] * d.y - m[2] * d.x) / determinant
        };
        let corners = [lo, DVec2::new(hi.x, lo.y), DVec2::new(lo.x, hi.y), hi].map(back);
        let size = corners.iter().fold(0.0f64, |s, c| s.max(c.length()));
        around(corners, 1e-9 * size)
    }
    fn error(&self, p: Parameters<f64>, error: f64) -> f64 {
        times_up(error, p.0[6].abs())
    }
    /// Distances in the operand's frame are those of the world over the scale.
    fn focus(&self, p: Parameters<f64>, focus: Focus) -> Focus {
        let shrink = (p.0[0] * p.0[0] + p.0[2] * p.0[2]).sqrt();
        let position = DVec2::from_array(enter::<f64, f64>(p, focus.position.to_array()));
        Focus { position, near: focus.near * shrink, far: focus.far * shrink }
    }
    fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> (Code, DVec2) {
        let inner = enter::<f64, f64>(p, origin.to_array());
        // The operand's own origin moves along: no translation is left.
        let mut moved = p.0[..WIDTH].to_vec();
        (moved[4], moved[5]) = (0.0, 0.0);
        (Code { at: tile.store(moved) }, DVec2::from_array(inner))
    }
}

/// The point carried into the operand's frame.
#[inline(always)]
fn enter<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> [R; 2] {
    let row = |k: usize, shift: usize| p.get::<R>(k) * x[0] + p.get::<R>(k + 1) * x[1] + p.get::<R>(shift);
    [row(0, 4), row(2, 5)]
}

/// A region carried into the operand's frame.
fn enter_region(p: Parameters<f64>, region: &Region) -> Region {
    let map = |x: [Interval; 2]| enter::<Interval, f64>(p, x);
    match region.ends {
        None => Region { extent: map(region.extent), ends: None },
        Some(ends) => {
            let [a, b] = ends.map(map);
            Region { extent: [a[0].hull(b[0]), a[1].hull(b[1])], ends: Some([a, b]) }
        }
    }
}

/// Bounds of the operand carried back: slopes grow by the norm of the inverse map, elevations by the vertical scale.
fn leave_bounds(p: Parameters<f64>, b: Bounds) -> Bounds {
    if b.is_absent() {
        return Bounds::ABSENT;
    }
    let square = |k: usize| Interval::point(p.0[k]).square();
    // The Frobenius norm over √2 is the norm of a similarity; of any other matrix it is below, so take the larger column.
    let column = |k: usize| Real::sqrt(square(k) + square(k + 2)).hi();
    let norm = if p.0[0] == p.0[3] && p.0[1] == -p.0[2] {
        column(0)
    } else {
        Real::sqrt(square(0) + square(1) + square(2) + square(3)).hi()
    };
    let vertical = times_up(norm, p.0[6].abs());
    Bounds {
        elevation: b.elevation * Interval::point(p.0[6]) + Interval::point(p.0[7]),
        weight: b.weight,
        slope: times_up(b.slope, vertical),
        support_slope: times_up(b.support_slope, vertical),
        weight_slope: times_up(b.weight_slope, norm),
        weighted_slope: times_up(b.weighted_slope, vertical),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    #[test]
    fn a_gradient_is_carried_back_by_the_transposed_jacobian() {
        // The shear of claims G27, as a matrix of this frame: J = (1, −2; 0, 1), g = (0.6, −1.7) of a plane.
        let shear = [1.0, -2.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0];
        let x = enter::<Dual<f64, 2>, f64>(Parameters(&shear), [Dual::variable(3.0, 0), Dual::variable(5.0, 1)]);
        let g = [0.6, -1.7];
        let f = x[0] * Dual::fixed(g[0]) + x[1] * Dual::fixed(g[1]);
        let transposed = [g[0], -2.0 * g[0] + g[1]];
        assert!((0..2).all(|k| (f.slope[k] - transposed[k]).abs() < 1e-15));
        // Control: J·g is (4, −1.7).
        assert!((f.slope[0] - (g[0] - 2.0 * g[1])).abs() > 1.0);
    }
}
