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
        let mut words = [0; N];
        for i in 0..N {
            words[i] = integers[i] as u32;
        }
        (LaneWords(words), self - numbers)
    }
    #[inline(always)]
    fn integer(word: LaneWords<N>) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = word.0[i] as i32 as f32;
        }
        Lanes(out)
    }
    #[inline(always)]
    fn direction(hash: LaneWords<N>) -> [Self; 2] {
        let (mut x, mut y) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            x[i] = gradient2::direction_x(hash.0[i]);
            y[i] = gradient2::direction_y(hash.0[i]);
        }
        [Lanes(x), Lanes(y)]
    }
    #[inline(always)]
    fn edge(hash: LaneWords<N>) -> [Self; 3] {
        let mut out = [Lanes([0.0; N]); 3];
        for (axis, out) in out.iter_mut().enumerate() {
            for i in 0..N {
                out.0[i] = f32::from_bits(gradient3::edge_bits(hash.0[i], axis as u32));
            }
        }
        out
    }
}

/// The fractional position in the cell and the gradients at its corners.
#[inline(always)]
fn enter2<R: Walk>(lattice: Lattice<2>, x: [R; 2]) -> ([R; 2], [[R; 2]; 4]) {
    let (i, t) = x[0].cell();
    let (j, s) = x[1].cell();
    let index = [shifted(i, lattice.base[0] as u32), shifted(j, lattice.base[1] as u32)];
    let [a, b, c, d] = Keys::new(lattice.seed).cell2(index);
    ([t, s], [R::direction(a), R::direction(b), R::direction(c), R::direction(d)])
}

/// The fractional position in the cell and the gradients at its corners.
#[inline(always)]
fn enter3<R: Walk>(lattice: Lattice<3>, x: [R; 3]) -> ([R; 3], [[R; 3]; 8]) {
    let [(i, t), (j, s), (k, r)] = [x[0].cell(), x[1].cell(), x[2].cell()];
    let base = lattice.base;
    let index = [shifted(i, base[0] as u32), shifted(j, base[1] as u32), shifted(k, base[2] as u32)];
    let h = Keys::new(lattice.seed).cell3(index);
    let low = [R::edge(h[0]), R::edge(h[1]), R::edge(h[2]), R::edge(h[3])];
    let high = [R::edge(h[4]), R::edge(h[5]), R::edge(h[6]), R::edge(h[7])];
    ([t, s, r], [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]])
}

#[inline(always)]
fn shifted<W: Word>(word: W, by: u32) -> W {
    word.map(
        #[inline(always)]
        |w| w.wrapping_add(by),
    )
}
#[inline(always)]
fn plus<W: Word>(a: W, b: W) -> W {
    a.zip(
        b,
        #[inline(always)]
        |a, b| a.wrapping_add(b),
    )
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
    let [(i, t), (j, s), (k, r)] = [x[0].cell(), x[1].cell(), x[2].cell()];
    let (whole, part) = ([i, j, k], [t, s, r]);
    let sum = plus(plus(i, j), k);
    let third = sum.map(
        #[inline(always)]
        |s| third(s as i32) as u32,
    );
    let left = sum.zip(
        third,
        #[inline(always)]
        |s, q| s.wrapping_sub(q.wrapping_mul(3)).wrapping_add(rest),
    );
    let remainder = R::integer(left);
    let skew = (t + s + r + remainder) * c(1.0 / 3.0);
    let skewed = [(t + skew).cell().0, (s + skew).cell().0, (r + skew).cell().0];
    let step = [R::integer(skewed[0]), R::integer(skewed[1]), R::integer(skewed[2])];
    let unskew = (remainder + (step[0] + step[1] + step[2])) * c(1.0 / 6.0);
    let offset = [part[0] - step[0] + unskew, part[1] - step[1] + unskew, part[2] - step[2] + unskew];

    // The order of the coordinates picks one of six tetrahedra: steps along the largest, then the second largest.
    let [px, py, pz] = offset;
    let (x_y, x_z, y_z) = (py.less(px), pz.less(px), pz.less(py));
    let first = [bit::<R>(x_y.and(x_z)), bit::<R>(x_y.not().and(y_z)), bit::<R>(x_z.not().and(y_z.not()))];
    let second = [bit::<R>(x_y.or(x_z)), bit::<R>(x_y.not().or(y_z)), bit::<R>(x_z.not().or(y_z.not()))];

    let keys = Keys::new(lattice.seed);
    let mut index = skewed;
    for k in 0..3 {
        let base = (lattice.base[k] as u32).wrapping_add(quotient);
        index[k] = shifted(plus(plus(index[k], whole[k]), third), base);
    }
    let gradients = [
        at(keys, index, [R::zero(); 3]),
        at(keys, index, first),
        at(keys, index, second),
        at(keys, index, [R::one(); 3]),
    ];
    (simplex3::corners(offset, first, second), gradients)
}

/// 1 where the mask holds, else 0.
#[inline(always)]
fn bit<R: Real>(mask: R::Mask) -> R {
    R::select(mask, R::one(), R::zero())
}

/// The gradient at the corner that lies `step` from `index`.
#[inline(always)]
fn at<R: Walk>(keys: Keys, index: [R::Word; 3], step: [R; 3]) -> [R; 3] {
    let [i, j, k] = [step[0].cell().0, step[1].cell().0, step[2].cell().0];
    R::edge(keys.point3(plus(index[0], i), plus(index[1], j), plus(index[2], k)))
}

/// ⌊sum / 3⌋.
#[inline(always)]
fn third(sum: i32) -> i32 {
    sum.div_euclid(3)
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
