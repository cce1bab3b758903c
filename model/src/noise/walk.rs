//! The walker of plain numbers, `f64`, `f32` and lanes: it finds the cell of a point and the gradients at its corners,
//! and runs the in-cell formula there. Written once over [`Walk`]; lanes carry a cell and gradients each.

use super::hash::{Keys, LaneWords, Word};
use super::{Lattice, NoiseJet, NoiseValue, gradient2, gradient3, simplex3};
use crate::lanes::Lanes;
use crate::real::{Mask, Real};

/// A number that is one point, or one point per lane.
pub(super) trait Walk: Real {
    /// Its lattice indices and hashes.
    type Word: Word;
    /// The largest integer not above, wrapped to 32 bits, and the distance to it in [0, 1].
    fn cell(self) -> (Self::Word, Self);
    /// The integer of a word, as a number.
    fn integer(word: Self::Word) -> Self;
    /// The plane direction a hash chooses.
    fn direction(hash: Self::Word) -> [Self; 2];
    /// The edge gradient a hash chooses.
    fn edge(hash: Self::Word) -> [Self; 3];
}

macro_rules! walk_float {
    ($float:ty) => {
        impl Walk for $float {
            type Word = u32;
            #[inline(always)]
            fn cell(self) -> (u32, Self) {
                // + 0.0 makes ⌊−0⌋ a positive zero, as the lanes' floor has it.
                let below = self.floor() + 0.0;
                (below as i64 as u32, self - below)
            }
            #[inline(always)]
            fn integer(word: u32) -> Self {
                word as i32 as $float
            }
            #[inline(always)]
            fn direction(hash: u32) -> [Self; 2] {
                gradient2::direction(hash).map(|v| v as $float)
            }
            #[inline(always)]
            fn edge(hash: u32) -> [Self; 3] {
                gradient3::edge(hash).map(|v| v as $float)
            }
        }
    };
}
walk_float!(f64);
walk_float!(f32);

impl<const N: usize> Walk for Lanes<N> {
    type Word = LaneWords<N>;
    #[inline(always)]
    fn cell(self) -> (LaneWords<N>, Self) {
        let (integers, numbers) = self.floor();
        (LaneWords(integers.map(|i| i as u32)), self - numbers)
    }
    #[inline(always)]
    fn integer(word: LaneWords<N>) -> Self {
        Lanes(word.0.map(|w| w as i32 as f32))
    }
    #[inline(always)]
    fn direction(hash: LaneWords<N>) -> [Self; 2] {
        [Lanes(hash.0.map(gradient2::direction_x)), Lanes(hash.0.map(gradient2::direction_y))]
    }
    #[inline(always)]
    fn edge(hash: LaneWords<N>) -> [Self; 3] {
        [0, 1, 2].map(|axis| Lanes(hash.map(|h| gradient3::edge_bits(h, axis)).0.map(f32::from_bits)))
    }
}

/// The fractional position in the cell and the gradients at its corners.
#[inline(always)]
fn enter2<R: Walk>(lattice: Lattice<2>, x: [R; 2]) -> ([R; 2], [[R; 2]; 4]) {
    let (i, t) = x[0].cell();
    let (j, s) = x[1].cell();
    let base = lattice.base.map(|b| b as u32);
    let index = [i.map(|i| i.wrapping_add(base[0])), j.map(|j| j.wrapping_add(base[1]))];
    ([t, s], Keys::new(lattice.seed).cell2(index).map(R::direction))
}

/// The fractional position in the cell and the gradients at its corners.
#[inline(always)]
fn enter3<R: Walk>(lattice: Lattice<3>, x: [R; 3]) -> ([R; 3], [[R; 3]; 8]) {
    let [(i, t), (j, s), (k, r)] = x.map(R::cell);
    let base = lattice.base.map(|b| b as u32);
    let index =
        [i.map(|i| i.wrapping_add(base[0])), j.map(|j| j.wrapping_add(base[1])), k.map(|k| k.wrapping_add(base[2]))];
    ([t, s, r], Keys::new(lattice.seed).cell3(index).map(R::edge))
}

/// The corners of the tetrahedron around a point and the gradients there.
///
/// The skew (x + y + z)/3 is split into whole numbers and a small rest before any rounding: with ⌊x⌋ summing to
/// 3q + r, the skewed coordinates are whole numbers plus x − ⌊x⌋ + (r + Σ(x − ⌊x⌋))/3. So a point keeps its precision
/// whatever its cell and base, and any whole q serves as long as r is what it leaves.
#[inline(always)]
fn enter_simplex<R: Walk>(lattice: Lattice<3>, x: [R; 3]) -> ([crate::noise::corner::Corner<R, 3>; 4], [[R; 3]; 4]) {
    let c = R::constant;
    let (quotient, rest) = simplex_base(lattice.base);
    let cells = x.map(R::cell);
    let whole = cells.map(|(i, _)| i);
    let part = cells.map(|(_, t)| t);
    let sum = whole[0].zip(whole[1], u32::wrapping_add).zip(whole[2], u32::wrapping_add);
    let third = sum.map(|s| (s as i32).div_euclid(3) as u32);
    let left = sum.zip(third, |s, q| s.wrapping_sub(q.wrapping_mul(3)).wrapping_add(rest));
    let remainder = R::integer(left);
    let skew = (part[0] + part[1] + part[2] + remainder) * c(1.0 / 3.0);
    let skewed = part.map(|t| (t + skew).cell().0);
    let step = skewed.map(R::integer);
    let unskew = (remainder + (step[0] + step[1] + step[2])) * c(1.0 / 6.0);
    let offset = [part[0] - step[0] + unskew, part[1] - step[1] + unskew, part[2] - step[2] + unskew];

    // The order of the coordinates picks one of six tetrahedra: steps along the largest, then the second largest.
    let [px, py, pz] = offset;
    let (x_y, x_z, y_z) = (py.less(px), pz.less(px), pz.less(py));
    let bit = |mask: R::Mask| R::select(mask, R::one(), R::zero());
    let first = [bit(x_y.and(x_z)), bit(x_y.not().and(y_z)), bit(x_z.not().and(y_z.not()))];
    let second = [bit(x_y.or(x_z)), bit(x_y.not().or(y_z)), bit(x_z.not().or(y_z.not()))];

    let keys = Keys::new(lattice.seed);
    let mut index = skewed;
    for k in 0..3 {
        let base = (lattice.base[k] as u32).wrapping_add(quotient);
        index[k] = index[k].zip(whole[k], u32::wrapping_add).zip(third, |i, q| i.wrapping_add(q).wrapping_add(base));
    }
    let at = |step: [R; 3]| {
        let moved = |k: usize| index[k].zip(step[k].cell().0, u32::wrapping_add);
        R::edge(keys.point3(moved(0), moved(1), moved(2)))
    };
    let gradients = [at([R::zero(); 3]), at(first), at(second), at([R::one(); 3])];
    (simplex3::corners(offset, first, second), gradients)
}

/// ⌊Σ base / 3⌋ and what it leaves.
#[inline(always)]
pub(super) fn simplex_base(base: [i32; 3]) -> (u32, u32) {
    let sum = i64::from(base[0]) + i64::from(base[1]) + i64::from(base[2]);
    (sum.div_euclid(3) as u32, sum.rem_euclid(3) as u32)
}

macro_rules! noise_by_walking {
    ($number:ty $(, const $n:ident: usize)?) => {
        impl$(<const $n: usize>)? NoiseValue for $number {
            #[inline(always)]
            fn gradient2(lattice: Lattice<2>, x: [Self; 2]) -> Self {
                let (t, gradients) = enter2(lattice, x);
                gradient2::cell(t, &gradients)
            }
            #[inline(always)]
            fn gradient3(lattice: Lattice<3>, x: [Self; 3]) -> Self {
                let (t, gradients) = enter3(lattice, x);
                gradient3::cell(t, &gradients)
            }
            #[inline(always)]
            fn simplex3(lattice: Lattice<3>, x: [Self; 3]) -> Self {
                let (corners, gradients) = enter_simplex(lattice, x);
                simplex3::cell(&corners, &gradients)
            }
        }
        impl$(<const $n: usize>)? NoiseJet for $number {
            #[inline(always)]
            fn gradient2_jet(lattice: Lattice<2>, x: [Self; 2]) -> [Self; 3] {
                let (t, gradients) = enter2(lattice, x);
                gradient2::cell_jet(t, &gradients)
            }
            #[inline(always)]
            fn gradient3_jet(lattice: Lattice<3>, x: [Self; 3]) -> [Self; 4] {
                let (t, gradients) = enter3(lattice, x);
                gradient3::cell_jet(t, &gradients)
            }
            #[inline(always)]
            fn simplex3_jet(lattice: Lattice<3>, x: [Self; 3]) -> [Self; 4] {
                let (corners, gradients) = enter_simplex(lattice, x);
                simplex3::cell_jet(&corners, &gradients)
            }
        }
    };
}
noise_by_walking!(f64);
noise_by_walking!(f32);
noise_by_walking!(Lanes<N>, const N: usize);
