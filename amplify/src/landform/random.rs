//! Random numbers that belong to a place: they depend on a seed and the bits of a position, not on what was drawn
//! before, so a landform stays as it is when others are added.

use glam::DVec3;
use terrain_model::noise::hash;

/// Numbers of one place, told apart by a count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Random(u32);

impl Random {
    /// Those of `p` under `seed`.
    pub(super) fn at(seed: u32, p: DVec3) -> Random {
        // 0.0 and −0.0 are one place.
        let words = (p + 0.0).to_array().map(f64::to_bits);
        let all = words.iter().fold(seed, |key, &word| hash::mix(hash::mix(key, word as u32), (word >> 32) as u32));
        Random(all)
    }
    /// The `k`th number, uniform in [0, 1).
    pub(super) fn unit(self, k: u32) -> f64 {
        f64::from(hash::mix(self.0, k)) / 4_294_967_296.0
    }
    /// The `k`th number, uniform in [−1, 1).
    pub(super) fn signed(self, k: u32) -> f64 {
        2.0 * self.unit(k) - 1.0
    }
    /// A direction, uniform on the sphere. Rejection in the disk and the map of Marsaglia 1972 need no sine.
    pub(super) fn direction(self, k: u32) -> DVec3 {
        // Each draw fails with probability 1 − π/4: all of them once in 10²¹.
        const DRAWS: u32 = 32;
        for draw in 0..DRAWS {
            let bits = hash::mix(self.0 ^ 0xa511_e9b3, k * DRAWS + draw);
            let [x, y] = [bits & 0xffff, bits >> 16].map(|half| (f64::from(half) + 0.5) / 32_768.0 - 1.0);
            let s = x * x + y * y;
            if s < 1.0 {
                let r = 2.0 * (1.0 - s).sqrt();
                return DVec3::new(x * r, y * r, 1.0 - 2.0 * s);
            }
        }
        DVec3::NEG_Z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_units_and_as_many_in_every_octant() {
        let mut counts = [0u32; 8];
        let (places, each) = (1000, 8);
        for k in 0..places {
            let random = Random::at(5, DVec3::new(f64::from(k), 0.5, -2.0));
            for j in 0..each {
                let d = random.direction(j);
                assert!((d.length() - 1.0).abs() < 1e-12);
                counts[(usize::from(d.x > 0.0) << 2) | (usize::from(d.y > 0.0) << 1) | usize::from(d.z > 0.0)] += 1;
            }
        }
        let expected = f64::from(places * each) / 8.0;
        let chi = |counts: [u32; 8]| {
            counts
                .iter()
                .map(|&n| {
                    let d = f64::from(n) - expected;
                    d * d / expected
                })
                .sum::<f64>()
        };
        // χ² of 7 degrees of freedom exceeds 29.9 once in 10⁴.
        assert!(chi(counts) < 29.9, "{counts:?}");
        // Control: a tenth of one octant moved to another.
        let moved = counts[0] / 5;
        counts[0] -= moved;
        counts[7] += moved;
        assert!(chi(counts) > 29.9);
    }

    #[test]
    fn a_place_has_its_numbers_whatever_its_sign_of_zero_and_others_have_others() {
        let a = Random::at(1, DVec3::new(0.0, 2.0, 3.0)).unit(0);
        assert_eq!(a, Random::at(1, DVec3::new(-0.0, 2.0, 3.0)).unit(0));
        assert_ne!(a, Random::at(1, DVec3::new(0.0, 2.0f64.next_up(), 3.0)).unit(0));
        assert_ne!(a, Random::at(2, DVec3::new(0.0, 2.0, 3.0)).unit(0));
    }
}
