//! The largest of a bound over a box, by splitting the part where it is largest: a bound over a wide region is loose,
//! the largest of bounds over small ones is not.

use crate::interval::Interval;

/// At most the returned number is `bound` on every part of some cover of `root`, which is therefore a bound on all of
/// it. Parts narrower than `smallest` are not split; `budget` is the number of splits. `bound` answers `None` where
/// there is nothing to bound. Deterministic.
pub fn largest_over(
    root: [Interval; 2],
    smallest: f64,
    budget: usize,
    bound: impl FnMut([Interval; 2]) -> Option<f64>,
) -> f64 {
    largest_over_all([root], smallest, budget, ENOUGH, bound, |_| 0.0)
}

/// A bound is good enough when it is this many times what is attained.
pub const ENOUGH: f64 = 1.1;

/// [`largest_over`] the union of several boxes, which may overlap. `attained` is what is bounded, at one point: a part whose
/// bound is at most `enough` times what is attained somewhere is not split.
pub fn largest_over_all(
    roots: impl IntoIterator<Item = [Interval; 2]>,
    smallest: f64,
    budget: usize,
    enough: f64,
    mut bound: impl FnMut([Interval; 2]) -> Option<f64>,
    mut attained: impl FnMut([f64; 2]) -> f64,
) -> f64 {
    // Sorted by bound, the largest last.
    let mut parts: Vec<(f64, [Interval; 2])> =
        roots.into_iter().filter_map(|root| bound(root).map(|b| (b, root))).collect();
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut settled = 0.0f64;
    for _ in 0..budget {
        let Some((largest, part)) = parts.pop() else { return settled };
        settled = settled.max(enough * attained(part.map(Interval::middle)));
        if largest <= settled {
            return settled;
        }
        let axis = usize::from(part[1].width() > part[0].width());
        if part[axis].width() < smallest {
            settled = largest;
            continue;
        }
        let middle = part[axis].middle();
        for half in [Interval::new(part[axis].lo(), middle), Interval::new(middle, part[axis].hi())] {
            let mut piece = part;
            piece[axis] = half;
            if let Some(b) = bound(piece) {
                // A piece is bounded by its whole as well.
                let b = b.min(largest);
                if b > settled {
                    parts.insert(parts.partition_point(|part| part.0 < b), (b, piece));
                }
            }
        }
    }
    parts.last().map_or(settled, |part| part.0.max(settled))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_a_cover_closes_in_on_the_supremum() {
        // x·(1 − x) over [0, 1] as an interval product: 1 on the whole, 1/4 in truth.
        let product = |x: [Interval; 2]| Some((x[0] * (Interval::point(1.0) - x[0])).hi());
        let root = [Interval::UNIT, Interval::UNIT];
        assert!(product(root).unwrap() >= 1.0);
        let covered = largest_over(root, 1e-3, 100_000, product);
        assert!((0.25..0.26).contains(&covered), "{covered}");
        assert_eq!(largest_over(root, 1e-3, 10, |_| None), 0.0);
    }
}
