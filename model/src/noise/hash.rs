//! The hash that turns a lattice point into random bits: `u32` xor, shift, wrapping add and multiply only, so that a
//! shader computes the same bits. The multipliers are those of Chris Wellons' `lowbias32` and of the golden ratio.

/// One `u32` per lane: a word for a single number, an array of words for lanes.
pub trait Word: Copy {
    /// `f` of every lane.
    fn map(self, f: impl Fn(u32) -> u32) -> Self;
    /// `f` of every pair of lanes.
    fn zip(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self;
}

impl Word for u32 {
    #[inline(always)]
    fn map(self, f: impl Fn(u32) -> u32) -> u32 {
        f(self)
    }
    #[inline(always)]
    fn zip(self, other: u32, f: impl Fn(u32, u32) -> u32) -> u32 {
        f(self, other)
    }
}

/// The words of `N` lanes.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct LaneWords<const N: usize>(pub [u32; N]);

impl<const N: usize> Word for LaneWords<N> {
    #[inline(always)]
    fn map(self, f: impl Fn(u32) -> u32) -> Self {
        let mut out = [0; N];
        for i in 0..N {
            out[i] = f(self.0[i]);
        }
        LaneWords(out)
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        let mut out = [0; N];
        for i in 0..N {
            out[i] = f(self.0[i], other.0[i]);
        }
        LaneWords(out)
    }
}

const GOLDEN: u32 = 0x9e37_79b1;
const SECOND: u32 = 0x85eb_ca6b;
const THIRD: u32 = 0xc2b2_ae35;

/// A bijection of `u32` in which each input bit flips each output bit with probability near 1/2 (`lowbias32`).
#[inline(always)]
pub fn finish(word: u32) -> u32 {
    let mut h = word;
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// A seed for the part of `seed` that `word` names: octave, channel, child.
#[inline(always)]
pub fn mix(seed: u32, word: u32) -> u32 {
    finish(finish(seed ^ 0x5bd1_e995).wrapping_add(word.wrapping_mul(GOLDEN)))
}

/// What a seed contributes to the hash of a lattice point: one independent word per axis.
///
/// The axes are offset separately and a shift lies between them: no translation maps the lattice of a seed to itself
/// or to that of another seed, as it would if the coordinates entered as one linear form.
#[derive(Clone, Copy, Debug)]
pub struct Keys([u32; 3]);

impl Keys {
    /// The keys of a seed.
    #[inline(always)]
    pub fn new(seed: u32) -> Keys {
        Keys([mix(seed, 1), mix(seed, 2), mix(seed, 3)])
    }
    #[inline(always)]
    fn column<W: Word>(self, x: W) -> W {
        x.map(
            #[inline(always)]
            |x| {
                // Not 16: the finish begins with that shift, which would undo this one.
                let h = x.wrapping_add(self.0[0]).wrapping_mul(GOLDEN);
                h ^ (h >> 13)
            },
        )
    }
    #[inline(always)]
    fn pair<W: Word>(self, column: W, y: W) -> W {
        column.zip(
            y,
            #[inline(always)]
            |h, y| h ^ y.wrapping_add(self.0[1]).wrapping_mul(SECOND),
        )
    }
    /// The hash of a point of the plane lattice.
    #[inline(always)]
    pub fn point2<W: Word>(self, x: W, y: W) -> W {
        self.pair(self.column(x), y).map(finish)
    }
    /// The hash of a point of the space lattice.
    #[inline(always)]
    pub fn point3<W: Word>(self, x: W, y: W, z: W) -> W {
        let plane = self.pair(self.column(x), y).map(
            #[inline(always)]
            |h| {
                let h = h.wrapping_mul(THIRD);
                h ^ (h >> 15)
            },
        );
        plane.zip(
            z,
            #[inline(always)]
            |h, z| finish(h ^ z.wrapping_add(self.0[2]).wrapping_mul(SECOND)),
        )
    }
    /// The hashes of the corners of a cell, the x bit of the corner's number lowest.
    #[inline(always)]
    pub fn cell2<W: Word>(self, [x, y]: [W; 2]) -> [W; 4] {
        let (x1, y1) = (x.map(next), y.map(next));
        [self.point2(x, y), self.point2(x1, y), self.point2(x, y1), self.point2(x1, y1)]
    }
    /// The hashes of the corners of a cell, the x bit of the corner's number lowest.
    #[inline(always)]
    pub fn cell3<W: Word>(self, [x, y, z]: [W; 3]) -> [W; 8] {
        let (x1, y1, z1) = (x.map(next), y.map(next), z.map(next));
        [
            self.point3(x, y, z),
            self.point3(x1, y, z),
            self.point3(x, y1, z),
            self.point3(x1, y1, z),
            self.point3(x, y, z1),
            self.point3(x1, y, z1),
            self.point3(x, y1, z1),
            self.point3(x1, y1, z1),
        ]
    }
}

#[inline(always)]
fn next(index: u32) -> u32 {
    index.wrapping_add(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest |bias| over all (input bit, output bit) pairs of `hash`, and over output bits alone.
    fn worst_bias(hash: impl Fn(u32) -> u32, samples: u32) -> f64 {
        let mut flips = [[0u32; 32]; 32];
        for s in 0..samples {
            let x = s.wrapping_mul(2_654_435_769) ^ (s >> 3);
            let h = hash(x);
            for (input, row) in flips.iter_mut().enumerate() {
                let changed = h ^ hash(x ^ (1 << input));
                for (output, count) in row.iter_mut().enumerate() {
                    *count += (changed >> output) & 1;
                }
            }
        }
        flips.iter().flatten().map(|&n| (f64::from(n) / f64::from(samples) - 0.5).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_input_bit_flips_every_output_bit_half_the_time() {
        // 2¹⁴ samples: the deviation of a fair coin is 0.004; the worst of 1024 stays under 5 of them.
        let keys = Keys::new(7);
        assert!(worst_bias(|x| keys.point2(x, 12), 1 << 14) < 0.03);
        assert!(worst_bias(|y| keys.point2(12, y), 1 << 14) < 0.03);
        assert!(worst_bias(|z| keys.point3(5, 12, z), 1 << 14) < 0.03);
        assert!(worst_bias(|x| keys.point3(x, 12, 3), 1 << 14) < 0.03);
        assert!(worst_bias(|s| mix(s, 3), 1 << 14) < 0.03);
        // Control: a multiplication alone is far from it.
        assert!(worst_bias(|x| x.wrapping_mul(GOLDEN), 1 << 14) > 0.4);
    }

    #[test]
    fn neighbours_along_each_axis_are_uncorrelated() {
        // The 3 bits that choose a direction and the 2 low bits, on a 256 × 256 patch: correlation with the
        // neighbour at every small lag, against 5 deviations of 1/√65536.
        let keys = Keys::new(1);
        for bit in [0, 1, 29, 30, 31] {
            let sign = |x: u32, y: u32| f64::from((keys.point2(x, y) >> bit) & 1) * 2.0 - 1.0;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1), (1, 255), (2, 0), (0, 2), (3, 1), (16, 0), (0, 16)] {
                let mut sum = 0.0;
                for y in 0..256 {
                    for x in 0..256 {
                        sum += if (dx, dy) == (0, 0) { sign(x, y) } else { sign(x, y) * sign(x + dx, y + dy) };
                    }
                }
                assert!((sum / 65536.0f64).abs() < 5.0 / 256.0, "bit {bit} lag {dx},{dy}: {sum}");
            }
        }
    }

    #[test]
    fn seeds_are_not_translations_of_each_other() {
        let (a, b) = (Keys::new(0), Keys::new(1));
        let patch: Vec<u32> = (0..8).map(|x| b.point2(x, 0)).collect();
        let found = (0..20_000u32).any(|x0| (0..8).all(|x| a.point2(x0 + x, 0) >> 29 == patch[x as usize] >> 29));
        assert!(!found);
    }
}
