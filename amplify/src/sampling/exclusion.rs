//! A spatial hash of points: is one of them closer than r to a place? Points are chained by the cube of space that they lie in;
//! answers depend neither on the order in which they came nor on the size of the table.

use glam::DVec3;
use terrain_model::noise::hash::finish;

/// Points, found by where they are.
#[derive(Clone, Debug)]
pub struct Exclusion {
    side: f64,
    points: Vec<DVec3>,
    /// First point of each chain, [`END`] where it is empty; as many as a power of two.
    heads: Vec<u32>,
    /// The point after each in its chain.
    next: Vec<u32>,
}

/// No further point.
const END: u32 = u32::MAX;

impl Exclusion {
    /// None yet. `side`, metres, is that of the cubes: about twice the distance that will be asked for is best. Any distance is
    /// answered rightly.
    ///
    /// # Panics
    /// Where `side` is not positive and finite.
    pub fn new(side: f64) -> Exclusion {
        assert!(side > 0.0 && side.is_finite(), "cubes {side} m wide: expected a positive number");
        Exclusion { side, points: Vec::new(), heads: vec![END; 64], next: Vec::new() }
    }
    /// All points in the order in which they were inserted.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }
    /// Adds `p`, whose coordinates are finite; its number is that of points before it.
    pub fn insert(&mut self, p: DVec3) {
        if self.points.len() >= self.heads.len() {
            self.heads = vec![END; 2 * self.heads.len()];
            for k in 0..self.points.len() {
                self.chain(k);
            }
        }
        self.points.push(p);
        self.next.push(END);
        self.chain(self.points.len() - 1);
    }
    fn chain(&mut self, k: usize) {
        let chain = self.chain_of(self.cube(self.points[k]));
        self.next[k] = self.heads[chain];
        self.heads[chain] = k as u32;
    }
    /// Is a point closer than `r`? A point at a distance of r, as its square is rounded, is not.
    pub fn any_within(&self, p: DVec3, r: f64) -> bool {
        let (low, high) = (self.cube(p - DVec3::splat(r)), self.cube(p + DVec3::splat(r)));
        if (0..3).any(|k| high[k] - low[k] > 1) {
            return self.find_within(p, r, |_| true).is_some();
        }
        let squared = r * r;
        // A close point that is met in another cube's chain is as close.
        (0..8).any(|corner| {
            let at = |k: usize| if corner >> k & 1 == 0 { low[k] } else { high[k] };
            let mut k = if (0..3).any(|k| corner >> k & 1 == 1 && low[k] == high[k]) {
                END
            } else {
                self.heads[self.chain_of([at(0), at(1), at(2)])]
            };
            while k != END {
                if self.points[k as usize].distance_squared(p) < squared {
                    return true;
                }
                k = self.next[k as usize];
            }
            false
        })
    }
    /// A point closer than `r` that `choose` takes, by number; which of several is not said.
    pub fn find_within(&self, p: DVec3, r: f64, mut choose: impl FnMut(usize) -> bool) -> Option<usize> {
        let (low, high) = (self.cube(p - DVec3::splat(r)), self.cube(p + DVec3::splat(r)));
        let count = (0..3).map(|k| high[k] as f64 - low[k] as f64 + 1.0).product::<f64>();
        let close = |k: usize| self.points[k].distance_squared(p) < r * r;
        // Fewer points than cubes: look at the points.
        if count > self.points.len() as f64 {
            return (0..self.points.len()).find(|&k| close(k) && choose(k));
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let mut k = self.heads[self.chain_of([x, y, z])];
                    while k != END {
                        // Cubes share chains; a point is met in its own alone. That test is the dearer one.
                        if close(k as usize) && self.cube(self.points[k as usize]) == [x, y, z] && choose(k as usize) {
                            return Some(k as usize);
                        }
                        k = self.next[k as usize];
                    }
                }
            }
        }
        None
    }
    /// Calls `visit` with the number of each point closer than `r`, once, in no particular order.
    pub fn each_within(&self, p: DVec3, r: f64, mut visit: impl FnMut(usize)) {
        self.find_within(p, r, |k| {
            visit(k);
            false
        });
    }
    fn cube(&self, p: DVec3) -> [i64; 3] {
        (p / self.side).floor().to_array().map(|c| c as i64)
    }
    fn chain_of(&self, cube: [i64; 3]) -> usize {
        let [x, y, z] = cube.map(|c| c as u32);
        let word = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b) ^ z.wrapping_mul(0xc2b2_ae35);
        finish(word) as usize & (self.heads.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain_model::noise::hash::Keys;

    fn random(count: u32, seed: u32) -> Vec<DVec3> {
        let unit = |k: u32, axis: u32| f64::from(Keys::new(seed).point2(k, axis)) / 4_294_967_296.0 * 10.0 - 5.0;
        (0..count).map(|k| DVec3::new(unit(k, 0), unit(k, 1), unit(k, 2))).collect()
    }

    #[test]
    fn answers_are_those_of_a_look_at_every_point() {
        for (count, side) in [(0, 1.0), (5, 0.3), (700, 0.3), (700, 2.0), (3000, 50.0)] {
            let points = random(count, 1);
            let mut exclusion = Exclusion::new(side);
            points.iter().for_each(|&p| exclusion.insert(p));
            for (n, p) in random(200, 2).into_iter().enumerate() {
                let r = 0.02 * n as f64;
                let mut expected: Vec<usize> = (0..points.len()).collect();
                expected.retain(|&k| points[k].distance_squared(p) < r * r);
                let mut found = Vec::new();
                exclusion.each_within(p, r, |k| found.push(k));
                found.sort_unstable();
                assert_eq!(found, expected);
                assert_eq!(exclusion.any_within(p, r), !expected.is_empty());
            }
        }
    }

    #[test]
    fn a_point_at_the_distance_itself_is_not_closer() {
        let mut exclusion = Exclusion::new(1.0);
        exclusion.insert(DVec3::new(3.0, 4.0, 0.0));
        assert!(!exclusion.any_within(DVec3::ZERO, 5.0));
        assert!(exclusion.any_within(DVec3::ZERO, 5.0f64.next_up()));
    }
}
