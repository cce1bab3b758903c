//! Gradient noise in the plane (Perlin 1985, 2002) with 8 evenly spaced unit gradients and the quintic fade: the
//! formula inside one cell. 8 directions at odd multiples of π/8: none lies along an axis or a diagonal, the set is
//! symmetric under the symmetries of the cell, and two bits of sign and one of exchange pick one.

use super::corner::{Corner, dot, gradient, lerp};
use crate::falloff::fade;
use crate::real::Real;

/// cos(π/8), to the nearest `f64`: the long component of a direction.
pub const LONG: f64 = 0.923_879_532_511_286_7;
/// sin(π/8), to the nearest `f64`: the short component of a direction.
pub const SHORT: f64 = 0.382_683_432_365_089_8;

/// The direction that the top three bits of a hash choose.
#[inline(always)]
pub fn direction(hash: u32) -> [f64; 2] {
    let exchange = (hash >> 29) & 1 == 1;
    let (x, y) = if exchange { (SHORT, LONG) } else { (LONG, SHORT) };
    let sign = |value: f64, bit: u32| f64::from_bits(value.to_bits() ^ (u64::from(bit & 0x8000_0000) << 32));
    [sign(x, hash), sign(y, hash << 1)]
}

/// x component of [`direction`] in `f32`, by bit operations alone.
#[inline(always)]
pub fn direction_x(hash: u32) -> f32 {
    let (long, short) = ((LONG as f32).to_bits(), (SHORT as f32).to_bits());
    let exchange = ((hash << 2) as i32 >> 31) as u32;
    f32::from_bits(long ^ (exchange & (long ^ short)) ^ (hash & 0x8000_0000))
}

/// y component of [`direction`] in `f32`, by bit operations alone.
#[inline(always)]
pub fn direction_y(hash: u32) -> f32 {
    let (long, short) = ((LONG as f32).to_bits(), (SHORT as f32).to_bits());
    let exchange = ((hash << 2) as i32 >> 31) as u32;
    f32::from_bits(short ^ (exchange & (long ^ short)) ^ ((hash << 1) & 0x8000_0000))
}

/// The noise at `t` in [0, 1]² of a cell with corner gradients `g`; corner number x + 2y.
#[inline(always)]
pub fn cell<R: Real>([x, y]: [R; 2], g: &[[R; 2]; 4]) -> R {
    let (u, v) = (fade(x).0, fade(y).0);
    let (x1, y1) = (x - R::one(), y - R::one());
    let south = lerp(dot(g[0], [x, y]), dot(g[1], [x1, y]), u);
    let north = lerp(dot(g[2], [x, y1]), dot(g[3], [x1, y1]), u);
    lerp(south, north, v)
}

/// [`cell`] with its gradient.
#[inline(always)]
pub fn cell_jet<R: Real>(t: [R; 2], g: &[[R; 2]; 4]) -> [R; 3] {
    let [dx, dy] = gradient(&corners(t, [fade(t[0]), fade(t[1])]), g);
    [cell(t, g), dx, dy]
}

/// The corners of the cell, given `(fade, fade′)` of each coordinate.
#[inline(always)]
pub fn corners<R: Real>([x, y]: [R; 2], [(u, du), (v, dv)]: [(R, R); 2]) -> [Corner<R, 2>; 4] {
    let one = R::one();
    let (us, dus, xs) = ([one - u, u], [-du, du], [x, x - one]);
    let (vs, dvs, ys) = ([one - v, v], [-dv, dv], [y, y - one]);
    [
        Corner { weight: us[0] * vs[0], slope: [dus[0] * vs[0], us[0] * dvs[0]], offset: [xs[0], ys[0]] },
        Corner { weight: us[1] * vs[0], slope: [dus[1] * vs[0], us[1] * dvs[0]], offset: [xs[1], ys[0]] },
        Corner { weight: us[0] * vs[1], slope: [dus[0] * vs[1], us[0] * dvs[1]], offset: [xs[0], ys[1]] },
        Corner { weight: us[1] * vs[1], slope: [dus[1] * vs[1], us[1] * dvs[1]], offset: [xs[1], ys[1]] },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_eight_unit_vectors_and_single_precision_rounds_them() {
        let mut seen = Vec::new();
        for k in 0..8u32 {
            let [x, y] = direction(k << 29);
            assert!((x * x + y * y - 1.0).abs() < 4.0 * f64::EPSILON);
            assert_eq!((direction_x(k << 29), direction_y(k << 29)), (x as f32, y as f32));
            assert!(!seen.contains(&[x.to_bits(), y.to_bits()]));
            seen.push([x.to_bits(), y.to_bits()]);
        }
    }

    #[test]
    fn the_sum_over_corners_is_the_interpolation() {
        let g: Vec<[f64; 2]> = [0u32, 3, 5, 6].iter().map(|k| direction(k << 29)).collect();
        let g = [g[0], g[1], g[2], g[3]];
        for i in 0..=20 {
            for j in 0..=20 {
                let t = [f64::from(i) / 20.0, f64::from(j) / 20.0];
                let sum = crate::noise::corner::value(&corners(t, [fade(t[0]), fade(t[1])]), &g);
                assert!((sum - cell(t, &g)).abs() < 1e-15);
            }
        }
    }
}
