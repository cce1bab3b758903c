//! Poisson spheres from candidates: taken in an order by chance, one stays that no earlier one which stays is nearer to than a
//! distance. Whether one stays is asked of its earlier neighbours alone, so all are decided side by side, with the result of one
//! after the other.

use crate::buckets::Buckets;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicU8, Ordering};
use terrain_model::noise::hash::mix;

/// A candidate: when it is taken, and where it is. No two have one rank.
#[derive(Clone, Copy, Debug, Default)]
struct Candidate {
    rank: (u32, u32),
    position: DVec3,
}
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.rank.cmp(&other.rank)
    }
}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.rank == other.rank
    }
}
impl Eq for Candidate {}

const STAYS: u8 = 1;
const GOES: u8 = 2;

struct Thinning {
    low: DVec2,
    inverse: f64,
    columns: [usize; 2],
    /// By square of the ground, each in the order in which they are taken.
    candidates: Buckets<Candidate>,
    /// 0 of those that are not yet decided. A decision depends on the candidates alone: who writes it does not matter.
    decided: Vec<AtomicU8>,
    squared: f64,
}

/// Of `points`, taken in an order by chance, those that no earlier one is nearer to than `spacing` metres, with their data, in that
/// order. The same on any number of threads.
pub fn thin<T: Copy + Send + Sync>(points: &[(DVec3, T)], spacing: f64, seed: u32) -> Vec<(DVec3, T)> {
    let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) = points.iter().map(|p| p.0.truncate()).fold(none, |(low, high), p| (low.min(p), high.max(p)));
    if points.is_empty() {
        return Vec::new();
    }
    // Squares at least as wide as the spacing, at most four to a candidate.
    let size = high - low;
    let least = (size.x * size.y / (4.0 * points.len() as f64)).sqrt().max(size.max_element() / 65_536.0);
    let inverse = 1.0 / (spacing.max(least) * (1.0 + 1e-9));
    let columns = (size * inverse).to_array().map(|cells| cells as usize + 1);
    let bucket = |p: DVec3| {
        let at = (p.truncate() - low) * inverse;
        (at.y as usize * columns[0] + at.x as usize) as u32
    };
    let candidate = |k: usize| {
        let position = points[k].0;
        (bucket(position), Candidate { rank: (mix(seed, k as u32), k as u32), position })
    };
    let mut candidates = Buckets::new(columns[0] * columns[1], || (0..points.len()).map(candidate));
    candidates.sort();
    let decided = (0..points.len()).map(|_| AtomicU8::new(0)).collect();
    let thinning = Thinning { low, inverse, columns, candidates, decided, squared: spacing * spacing };
    let all = thinning.candidates.items();
    let mut stay: Vec<(u32, u32)> =
        (0..all.len()).into_par_iter().filter(|&k| thinning.stays(k)).map(|k| all[k].rank).collect();
    stay.par_sort_unstable();
    stay.into_iter().map(|(_, k)| points[k as usize]).collect()
}

impl Thinning {
    /// Columns or rows of squares next to a coordinate.
    fn beside(&self, at: f64, axis: usize) -> RangeInclusive<usize> {
        let k = ((at - self.low[axis]) * self.inverse) as usize;
        k.saturating_sub(1)..=(k + 1).min(self.columns[axis] - 1)
    }
    fn stays(&self, k: usize) -> bool {
        match self.decided[k].load(Ordering::Relaxed) {
            STAYS => return true,
            GOES => return false,
            _ => {}
        }
        let goes = self.meets_one_that_stays(&self.candidates.items()[k]);
        self.decided[k].store(if goes { GOES } else { STAYS }, Ordering::Relaxed);
        !goes
    }
    /// Does an earlier one that stays lie nearer than the spacing?
    fn meets_one_that_stays(&self, own: &Candidate) -> bool {
        let all = self.candidates.items();
        let [columns, rows] = [self.beside(own.position.x, 0), self.beside(own.position.y, 1)];
        for y in rows {
            for x in columns.clone() {
                for other in self.candidates.range(y * self.columns[0] + x) {
                    if all[other].rank >= own.rank {
                        break;
                    }
                    if all[other].position.distance_squared(own.position) < self.squared && self.stays(other) {
                        return true;
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::super::exclusion::Exclusion;
    use super::*;
    use proptest::prelude::*;

    /// One after the other, as it is defined.
    fn in_order(points: &[(DVec3, usize)], spacing: f64, seed: u32) -> Vec<(DVec3, usize)> {
        let mut order: Vec<(u32, u32)> = (0..points.len() as u32).map(|k| (mix(seed, k), k)).collect();
        order.sort_unstable();
        let mut kept = Exclusion::new(2.0 * spacing);
        let mut stay = Vec::new();
        for (_, k) in order {
            let sample = points[k as usize];
            if !kept.any_within(sample.0, spacing) {
                kept.insert(sample.0);
                stay.push(sample);
            }
        }
        stay
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn those_stay_that_stay_one_after_the_other(
            places in prop::collection::vec(prop::array::uniform3(-20.0f64..20.0), 0..600),
            flat in prop::bool::ANY,
            spacing in 0.05f64..30.0,
            seed: u32,
            threads in 1usize..4,
        ) {
            let place = |(k, [x, y, z]): (usize, &[f64; 3])| (DVec3::new(*x, if flat { 3.0 } else { *y }, 0.3 * z), k);
            // Some twice, and some exactly a spacing apart.
            let mut points: Vec<(DVec3, usize)> = places.iter().enumerate().map(place).collect();
            let again: Vec<_> = points.iter().step_by(7).flat_map(|p| [*p, (p.0 + DVec3::X * spacing, p.1)]).collect();
            points.extend(again);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let made = pool.install(|| thin(&points, spacing, seed));
            prop_assert_eq!(made, in_order(&points, spacing, seed));
        }
    }

    #[test]
    fn many_at_one_place_leave_one() {
        let points = vec![(DVec3::ONE, ()); 50_000];
        assert_eq!(thin(&points, 2.0, 4), vec![(DVec3::ONE, ())]);
    }
}
