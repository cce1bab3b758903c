//! Plane noise over a box by its Taylor polynomial about the middle: one evaluation in `f64`, whatever cells the box meets.
//!
//! The quintic fade has no second derivative at its ends, so the noise is C² on the whole plane and its second derivatives
//! are Lipschitz. With r the half sizes of the box and H the second derivatives at its middle, a first derivative changes
//! by at most sup|H|·r and by at most |H|·r + ½·sup|η‴|·r²; the suprema are certified ([`crate::certify::noise`]).

use super::hash::Keys;
use super::{GRADIENT2_CURVATURE, GRADIENT2_THIRD, Lattice, gradient2};
use crate::interval::Interval;

/// The noise with its first and second derivatives at a point of a cell: [η, η_x, η_y, η_xx, η_xy, η_yy].
struct Jet([f64; 6]);

/// What rounding can do to the entries of a [`Jet`]: value and first derivatives take fewer than 60 operations whose results
/// are below 8, each passed on by a factor of at most 4, so less than 60·8·4·2⁻⁵³ < 3e-13; second derivatives take results
/// below 64 and factors of at most 12, less than 6e-12.
const DUST: f64 = 1e-12;
const DUST_OF_SECOND: f64 = 1e-11;

/// Offsets of the middle of a box and its half sizes are rounded too, and what follows adds up a few products of them: all
/// of it is covered by this factor.
const UP: f64 = 1.0 + 1e-14;

impl Jet {
    /// At `x`, relative to the lattice's base. The place in the cell is exact: subtracting its integer part loses no bit.
    #[inline(always)]
    fn at(lattice: Lattice<2>, [x, y]: [f64; 2]) -> Jet {
        let (i, j) = (x.floor(), y.floor());
        let (x, y) = (x - i, y - j);
        let cell = [(i as i64 as u32).wrapping_add(lattice.base[0] as u32), {
            (j as i64 as u32).wrapping_add(lattice.base[1] as u32)
        }];
        let hashes = Keys::new(lattice.seed).cell2(cell);
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| gradient2::direction(hashes[k]));
        let fade = |t: f64| {
            let s = t * (1.0 - t);
            (t * t * t * ((t * 6.0 - 15.0) * t + 10.0), 30.0 * s * s, 60.0 * s * (1.0 - 2.0 * t))
        };
        let ((u, u1, u2), (v, v1, v2)) = (fade(x), fade(y));
        // Along the southern and the northern side: value, and derivatives by x, y, xx and xy.
        let side = |west: [f64; 2], east: [f64; 2], y: f64| {
            let from = west[0] * x + west[1] * y;
            let rise = east[0] * (x - 1.0) + east[1] * y - from;
            let (rise_x, rise_y) = (east[0] - west[0], east[1] - west[1]);
            let by_x = west[0] + u * rise_x + u1 * rise;
            [from + u * rise, by_x, west[1] + u * rise_y, 2.0 * u1 * rise_x + u2 * rise, u1 * rise_y]
        };
        let (south, north) = (side(a, b, y), side(c, d, y - 1.0));
        let mut step = south;
        for k in 0..5 {
            step[k] = north[k] - south[k];
        }
        Jet([
            south[0] + v * step[0],
            south[1] + v * step[1],
            south[2] + v * step[2] + v1 * step[0],
            south[3] + v * step[3],
            south[4] + v * step[4] + v1 * step[1],
            2.0 * v1 * step[2] + v2 * step[0],
        ])
    }
}

/// Encloses [η, η_x, η_y] over a box of finite coordinates below 2⁵⁰.
#[inline(always)]
pub(super) fn enclose(lattice: Lattice<2>, x: [Interval; 2]) -> [Interval; 3] {
    let middle = [x[0].middle(), x[1].middle()];
    let half = |k: usize| (x[k].hi() - middle[k]).max(middle[k] - x[k].lo()) * UP;
    let (p, q) = (half(0), half(1));
    let Jet([value, dx, dy, xx, xy, yy]) = Jet::at(lattice, middle);
    let [straight, mixed] = GRADIENT2_CURVATURE;
    let [third, across] = GRADIENT2_THIRD;
    let (xx, xy, yy) = (xx.abs() + DUST_OF_SECOND, xy.abs() + DUST_OF_SECOND, yy.abs() + DUST_OF_SECOND);
    let (pp, pq, qq) = (0.5 * p * p, p * q, 0.5 * q * q);
    let along_x = (straight * p + mixed * q).min(xx * p + xy * q + (third * pp + across * (pq + qq))) * UP;
    let along_y = (mixed * p + straight * q).min(xy * p + yy * q + (across * (pp + pq) + third * qq)) * UP;
    // A first derivative has come to at most s of its change at the share s of the way to the border of the box.
    let rise = ((dx.abs() + DUST + 0.5 * along_x) * p + (dy.abs() + DUST + 0.5 * along_y) * q) * UP + DUST;
    let around = |at: f64, by: f64| Interval::new(at - by, at + by);
    [around(value, rise * UP), around(dx, (along_x + DUST) * UP), around(dy, (along_y + DUST) * UP)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{NoiseJet, mix};

    fn random(state: &mut u32, lo: f64, hi: f64) -> f64 {
        *state = mix(*state, 11);
        lo + (hi - lo) * f64::from(*state) / f64::from(u32::MAX)
    }

    #[test]
    fn boxes_across_cells_enclose_value_and_gradient_and_no_tighter_box_would() {
        let mut state = 3;
        let (mut fullest, mut control) = ([0.0f64; 3], 0);
        for k in 0..20_000u32 {
            let lattice = Lattice { seed: k / 50, base: [7, -3] };
            let size = [0.4, 0.05, 1e-3, 1e-6][k as usize % 4];
            let x = [0, 1].map(|_| {
                let from = random(&mut state, -4.0, 4.0);
                Interval::new(from, from + random(&mut state, 0.0, size))
            });
            let jet = enclose(lattice, x);
            for _ in 0..8 {
                let at = x.map(|x| random(&mut state, x.lo(), x.hi()).min(x.hi()));
                let exact = f64::gradient2_jet(lattice, at);
                for i in 0..3 {
                    assert!(jet[i].contains(exact[i]), "{x:?} {at:?}: {} not in {:?}", exact[i], jet[i]);
                    let half = 0.5 * jet[i].width();
                    let share = (exact[i] - jet[i].middle()).abs() / half;
                    fullest[i] = fullest[i].max(share);
                    // Control: three quarters of it would be wrong somewhere.
                    control += usize::from(share > 0.75);
                }
            }
        }
        assert!(fullest.iter().all(|share| *share > 0.7) && control > 100, "{fullest:?} {control}");
    }

    #[test]
    fn a_point_is_enclosed_within_dust() {
        let lattice = Lattice { seed: 5, base: [0; 2] };
        for at in [[0.0, 0.0], [1.0, -2.5], [-1e-17, 3.25], [1e14 + 0.5, 0.125]] {
            let jet = enclose(lattice, at.map(Interval::point));
            let exact = f64::gradient2_jet(lattice, at);
            for i in 0..3 {
                assert!(jet[i].contains(exact[i]) && jet[i].width() < 1e-11, "{at:?} {jet:?} {exact:?}");
            }
        }
    }
}
