//! Simplex noise in space (Perlin 2001) with kernel (1/2 − d²)⁴ scaled by 32 and the 12 edge gradients at unit length:
//! the formula inside one tetrahedron. With radius² 1/2 each kernel ends on the faces opposite its corner, so the
//! noise is continuous; the common 0.6 is not (claims G31).

use super::corner::{Corner, gradient};
use crate::real::Real;

/// 32/√2: the scale of the kernel times the length that turns (±1, ±1, 0) into a unit vector.
pub const SCALE: f64 = 22.627_416_997_969_522;
/// Squared radius of a kernel.
pub const RADIUS2: f64 = 0.5;

/// The corner at `offset` from the point: weight 32/√2 · max(0, 1/2 − d²)⁴ and its gradient.
#[inline(always)]
pub fn corner<R: Real>(offset: [R; 3]) -> Corner<R, 3> {
    let [x, y, z] = offset;
    let rest = (R::constant(RADIUS2) - (x.square() + y.square() + z.square())).max(R::zero());
    let square = rest.square();
    let weight = R::constant(SCALE) * square.square();
    let factor = R::constant(-8.0 * SCALE) * (square * rest);
    Corner { weight, slope: [factor * x, factor * y, factor * z], offset }
}

/// The four corners of the tetrahedron whose second and third corners are `first` and `second` steps (0 or 1 per
/// axis, in skewed coordinates) from its first; `offset` is the point minus the first corner.
#[inline(always)]
pub fn corners<R: Real>(offset: [R; 3], first: [R; 3], second: [R; 3]) -> [Corner<R, 3>; 4] {
    let c = R::constant;
    let (third, sixth, half) = (c(1.0 / 3.0), c(1.0 / 6.0), c(0.5));
    // A step along an axis in skewed coordinates is (1, 0, 0) − (1, 1, 1)/6 in space.
    [
        corner(offset),
        corner(shift(offset, first, sixth)),
        corner(shift(offset, second, third)),
        corner([offset[0] - half, offset[1] - half, offset[2] - half]),
    ]
}

#[inline(always)]
fn shift<R: Real>(offset: [R; 3], step: [R; 3], back: R) -> [R; 3] {
    [offset[0] - step[0] + back, offset[1] - step[1] + back, offset[2] - step[2] + back]
}

/// The noise with corner gradients `g` (±1, ±1, 0 in some order).
#[inline(always)]
pub fn cell<R: Real>(corners: &[Corner<R, 3>; 4], g: &[[R; 3]; 4]) -> R {
    super::corner::value(corners, g)
}

/// [`cell`] with its gradient.
#[inline(always)]
pub fn cell_jet<R: Real>(corners: &[Corner<R, 3>; 4], g: &[[R; 3]; 4]) -> [R; 4] {
    let [dx, dy, dz] = gradient(corners, g);
    [cell(corners, g), dx, dy, dz]
}
