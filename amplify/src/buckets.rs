//! Items put together by a number: counted, then each in its place, in linear time.

use rayon::prelude::*;
use std::ops::Range;

/// Items by bucket.
#[derive(Clone, Debug)]
pub(crate) struct Buckets<T> {
    /// Those of bucket k are `items[starts[k]..starts[k + 1]]`.
    starts: Vec<usize>,
    items: Vec<T>,
}

impl<T: Copy + Default> Buckets<T> {
    /// `count` buckets of items with their bucket's number; within one they keep their order. `items` is asked twice and has to
    /// answer the same.
    pub fn new<I: Iterator<Item = (u32, T)>>(count: usize, items: impl Fn() -> I) -> Buckets<T> {
        // While items are put in their places, starts[k + 1] is where the next one of bucket k goes.
        let mut starts = vec![0usize; count + 2];
        items().for_each(|(bucket, _)| starts[bucket as usize + 2] += 1);
        (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
        let mut places = vec![T::default(); starts[count + 1]];
        for (bucket, item) in items() {
            let next = &mut starts[bucket as usize + 1];
            places[*next] = item;
            *next += 1;
        }
        starts.pop();
        Buckets { starts, items: places }
    }
}

impl<T> Buckets<T> {
    /// Sorts each bucket, in parallel.
    pub fn sort(&mut self)
    where
        T: Ord + Send,
    {
        let mut buckets = Vec::new();
        let mut rest = self.items.as_mut_slice();
        for ends in self.starts.windows(2) {
            let (bucket, others) = rest.split_at_mut(ends[1] - ends[0]);
            rest = others;
            if bucket.len() > 1 {
                buckets.push(bucket);
            }
        }
        buckets.into_par_iter().for_each(<[T]>::sort_unstable);
    }
    /// Where the items of bucket `k` stand among all.
    pub fn range(&self, k: usize) -> Range<usize> {
        self.starts[k]..self.starts[k + 1]
    }
    /// All items, bucket after bucket.
    pub fn items(&self) -> &[T] {
        &self.items
    }
    /// The buckets that are not empty, with their numbers.
    pub fn filled(&self) -> impl Iterator<Item = (usize, &[T])> {
        let buckets = (0..self.starts.len() - 1).map(|k| (k, &self.items[self.range(k)]));
        buckets.filter(|(_, items)| !items.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order_within_a_bucket_and_are_sorted_when_asked() {
        let items = [(3, 'd'), (0, 'z'), (3, 'a'), (5, 'q'), (3, 'c')];
        let mut buckets = Buckets::new(6, || items.into_iter());
        assert_eq!(buckets.items(), ['z', 'd', 'a', 'c', 'q']);
        assert_eq!([buckets.range(0), buckets.range(1), buckets.range(3)], [0..1, 1..1, 1..4]);
        buckets.sort();
        let filled: Vec<(usize, &[char])> = buckets.filled().collect();
        assert_eq!(filled, [(0, &['z'][..]), (3, &['a', 'c', 'd']), (5, &['q'])]);
        assert!(Buckets::<u8>::new(0, std::iter::empty).items().is_empty());
    }
}
