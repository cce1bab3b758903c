//! Gradient noise in space ("improved noise", Perlin 2002) with the 12 edge gradients of length √2, each equally
//! likely, and the quintic fade: the formula inside one cell.

use super::corner::{Corner, dot, gradient, lerp};
use crate::falloff::fade;
use crate::real::Real;

/// Which component of the edge gradient is zero: 0, 1 or 2, equally likely up to 2⁻¹⁶, from the top half of a hash.
#[inline(always)]
fn missing(hash: u32) -> u32 {
    ((hash >> 16) * 3) >> 16
}

/// Component `axis` of the edge gradient that a hash chooses, as the bits of an `f32`: ±1 or 0. The two lowest bits
/// are the signs of the two components that are not zero, in order.
#[inline(always)]
pub fn edge_bits(hash: u32, axis: u32) -> u32 {
    let none = missing(hash);
    // x carries the first sign, z the second; y the first where x is missing.
    let second = axis == 2 || (axis == 1 && none != 0);
    let sign = if second { (hash << 30) & 0x8000_0000 } else { hash << 31 };
    if none == axis { 0 } else { 0x3f80_0000 | sign }
}

/// The edge gradient that a hash chooses.
#[inline(always)]
pub fn edge(hash: u32) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(f32::from_bits(edge_bits(hash, axis))))
}

/// The noise at `t` in [0, 1]³ of a cell with corner gradients `g`; corner number x + 2y + 4z.
#[inline(always)]
pub fn cell<R: Real>(t: [R; 3], g: &[[R; 3]; 8]) -> R {
    let f = [fade(t[0]).0, fade(t[1]).0, fade(t[2]).0];
    let far = [t[0] - R::one(), t[1] - R::one(), t[2] - R::one()];
    let (x, y) = ([t[0], far[0]], [t[1], far[1]]);
    let low = lerp(row(g, 0, x, y[0], t[2], f[0]), row(g, 2, x, y[1], t[2], f[0]), f[1]);
    let high = lerp(row(g, 4, x, y[0], far[2], f[0]), row(g, 6, x, y[1], far[2], f[0]), f[1]);
    lerp(low, high, f[2])
}

/// Along the edge from corner `c` in direction x.
#[inline(always)]
fn row<R: Real>(g: &[[R; 3]; 8], c: usize, x: [R; 2], y: R, z: R, f: R) -> R {
    lerp(dot(g[c], [x[0], y, z]), dot(g[c + 1], [x[1], y, z]), f)
}

/// [`cell`] with its gradient.
#[inline(always)]
pub fn cell_jet<R: Real>(t: [R; 3], g: &[[R; 3]; 8]) -> [R; 4] {
    let [dx, dy, dz] = gradient(&corners(t, [fade(t[0]), fade(t[1]), fade(t[2])]), g);
    [cell(t, g), dx, dy, dz]
}

/// The corners of the cell, given `(fade, fade′)` of each coordinate.
#[inline(always)]
pub fn corners<R: Real>(t: [R; 3], fades: [(R, R); 3]) -> [Corner<R, 3>; 8] {
    let one = R::one();
    let [(u, du), (v, dv), (w, dw)] = fades;
    let weights = [[one - u, u], [one - v, v], [one - w, w]];
    let slopes = [[-du, du], [-dv, dv], [-dw, dw]];
    let offsets = [[t[0], t[0] - one], [t[1], t[1] - one], [t[2], t[2] - one]];
    let (low, high) = (Layer { weights, slopes, offsets, k: 0 }, Layer { weights, slopes, offsets, k: 1 });
    [
        low.corner(0, 0),
        low.corner(1, 0),
        low.corner(0, 1),
        low.corner(1, 1),
        high.corner(0, 0),
        high.corner(1, 0),
        high.corner(0, 1),
        high.corner(1, 1),
    ]
}

/// The four corners at one z.
struct Layer<R> {
    weights: [[R; 2]; 3],
    slopes: [[R; 2]; 3],
    offsets: [[R; 2]; 3],
    k: usize,
}

impl<R: Real> Layer<R> {
    #[inline(always)]
    fn corner(&self, i: usize, j: usize) -> Corner<R, 3> {
        let Layer { weights, slopes, offsets, k } = self;
        let (a, b, e) = (weights[0][i], weights[1][j], weights[2][*k]);
        let be = b * e;
        Corner {
            weight: a * be,
            slope: [slopes[0][i] * be, slopes[1][j] * (a * e), slopes[2][*k] * (a * b)],
            offset: [offsets[0][i], offsets[1][j], offsets[2][*k]],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::hash::Keys;

    #[test]
    fn the_twelve_edges_are_equally_likely() {
        let keys = Keys::new(3);
        let mut counts = std::collections::BTreeMap::new();
        for x in 0..240u32 {
            for y in 0..500 {
                *counts.entry(edge(keys.point3(x, y, 5)).map(|v| v as i32)).or_insert(0u32) += 1;
            }
        }
        assert_eq!(counts.len(), 12);
        // 10 000 expected; five deviations are 5·√(120000·11)/12 = 479.
        assert!(counts.values().all(|&n| n.abs_diff(10_000) < 479), "{counts:?}");
        assert!(counts.keys().all(|g| g.iter().map(|v| v * v).sum::<i32>() == 2));
    }

    #[test]
    fn the_sum_over_corners_is_the_interpolation() {
        let keys = Keys::new(9);
        let g = keys.cell3([0u32, 0, 0]).map(edge);
        for i in 0..125u32 {
            let t = [i % 5, i / 5 % 5, i / 25].map(|v| f64::from(v) / 4.0);
            let sum = crate::noise::corner::value(&corners(t, t.map(fade)), &g);
            assert!((sum - cell(t, &g)).abs() < 1e-15);
        }
    }
}
