//! Where compact primitives are: a grid of cells, stored only where primitives are, that lists for each cell those whose
//! support meets it. A point query reads one list.

use super::primitive::Primitive;
use super::recent::Recent;
use super::squares::Squares;
use crate::buckets::Buckets;
use crate::field::Box3;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The largest number of cells along an axis: positions in cells then err by less than 2⁻³⁰ of a cell, which
/// [`SLACK`] covers a thousand times.
const CELLS: f64 = (1u32 << 20) as f64;

/// A cell's box is widened by this share of its side before supports are tested against it.
const SLACK: f64 = 1e-6;

/// Cells of one column that are stored: from `bottom` up, beginning with list `first`.
#[derive(Clone, Copy, Debug, Default)]
struct Column {
    bottom: i32,
    count: u32,
    first: u32,
}

/// Compact primitives with their index.
#[derive(Clone, Debug)]
pub struct Index {
    primitives: Vec<Primitive>,
    origin: DVec3,
    cell: f64,
    inverse: f64,
    columns: [usize; 2],
    table: Vec<Column>,
    /// List k is `items[starts[k]..starts[k + 1]]`.
    starts: Vec<u32>,
    items: Vec<u32>,
    /// What was inserted after the lists were made.
    recent: Recent,
    support: Box3,
}

impl Default for Index {
    /// Of nothing.
    fn default() -> Index {
        Index {
            primitives: Vec::new(),
            origin: DVec3::ZERO,
            cell: 1.0,
            inverse: 1.0,
            columns: [0; 2],
            table: Vec::new(),
            starts: vec![0],
            items: Vec::new(),
            recent: Recent::default(),
            support: Box3::EMPTY,
        }
    }
}

impl Index {
    /// Sorts `primitives` by squares of the ground and into cells, in parallel; the result does not depend on the number of threads. A primitive that
    /// is not sound is refused by its position.
    ///
    /// # Errors
    /// The position of the first primitive that is not sound.
    pub fn new(mut primitives: Vec<Primitive>) -> Result<Index, usize> {
        if let Some(bad) = primitives.iter().position(|p| !p.is_sound()) {
            return Err(bad);
        }
        let support = primitives.iter().fold(Box3::EMPTY, |all, one| all.hull(&one.support()));
        let squares = Squares::new(&support, primitives.len());
        primitives.sort_by_cached_key(|one| {
            let support = one.support();
            squares.of((support.low + support.high) * 0.5)
        });
        let supports: Vec<Box3> = primitives.par_iter().map(Primitive::support).collect();
        if supports.is_empty() {
            return Ok(Index::default());
        }
        let mut index = Index { primitives, origin: support.low, support, ..Index::default() };
        index.choose_cells(&supports);
        index.fill(&supports);
        Ok(index)
    }

    /// Cells of three quarters of the mean radius of supports: smaller ones list fewer primitives that miss the query, but
    /// the index grows with the inverse cube and leaves the caches. The table of columns holds at most 64 per primitive.
    fn choose_cells(&mut self, supports: &[Box3]) {
        let size = self.support.high - self.support.low;
        let mean = supports.iter().map(|b| (b.high - b.low).max_element()).sum::<f64>() / supports.len() as f64;
        let area = size.x * size.y;
        let least = (area / (64.0 * supports.len() as f64)).sqrt().max(size.max_element() / CELLS);
        self.cell = (0.375 * mean).max(least);
        self.inverse = 1.0 / self.cell;
        self.columns = [size.x, size.y].map(|s| (s * self.inverse) as usize + 1);
        self.table = vec![Column::default(); self.columns[0] * self.columns[1]];
    }

    /// The cell that holds `p`; components may lie beyond the table. Monotone in every component. Truncation takes points
    /// up to a cell below the origin into the first cell: no support reaches them, so all that is listed there is 0.
    #[inline(always)]
    fn cell_of(&self, p: DVec3) -> [i32; 3] {
        let p = (p - self.origin) * self.inverse;
        [p.x as i32, p.y as i32, p.z as i32]
    }

    fn cell_box(&self, cell: [i32; 3]) -> Box3 {
        let low = DVec3::from_array(cell.map(f64::from));
        let at = |k: f64| self.origin + (low + k) * self.cell;
        Box3 { low: at(-SLACK), high: at(1.0 + SLACK) }
    }

    fn fill(&mut self, supports: &[Box3]) {
        // (column, z, primitive), primitives ascending.
        let entries: Vec<(u32, i32, u32)> = supports
            .par_iter()
            .enumerate()
            .flat_map_iter(|(k, support)| {
                let (low, high) = (self.cell_of(support.low), self.cell_of(support.high));
                let across = (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| (x, y)));
                let this = &*self;
                across.flat_map(move |(x, y)| {
                    (low[2]..=high[2]).filter_map(move |z| {
                        let region = this.cell_box([x, y, z]);
                        let (x, y) = (x.max(0) as usize, y.max(0) as usize);
                        let column = y.min(this.columns[1] - 1) * this.columns[0] + x.min(this.columns[0] - 1);
                        this.primitives[k].meets(&region).then_some((column as u32, z, k as u32))
                    })
                })
            })
            .collect();
        let mut columns = Buckets::new(self.table.len(), || entries.iter().map(|&(column, z, k)| (column, (z, k))));
        drop(entries);
        columns.sort();
        self.items.reserve_exact(columns.items().len());
        for (column, here) in columns.filled() {
            let (bottom, top) = (here[0].0, here[here.len() - 1].0);
            let first = self.starts.len() as u32 - 1;
            self.table[column] = Column { bottom, count: (top - bottom + 1) as u32, first };
            let mut rest = here;
            for z in bottom..=top {
                let list = rest.partition_point(|entry| entry.0 <= z);
                self.items.extend(rest[..list].iter().map(|entry| entry.1));
                self.starts.push(self.items.len() as u32);
                rest = &rest[list..];
            }
        }
    }

    /// Adds `more` behind the others and says where. The others' sums keep their order, so fields change within the new
    /// supports alone, to the bit. Costs what the new supports cover, not what is there.
    ///
    /// # Errors
    /// The position in `more` of the first primitive that is not sound; nothing is added then.
    pub fn insert(&mut self, more: &[Primitive]) -> Result<Range<usize>, usize> {
        if let Some(bad) = more.iter().position(|p| !p.is_sound()) {
            return Err(bad);
        }
        let first = self.primitives.len();
        self.primitives.extend_from_slice(more);
        for (k, one) in more.iter().enumerate() {
            self.recent.insert(&self.primitives, (first + k) as u32);
            self.support = self.support.hull(&one.support());
        }
        Ok(first..self.primitives.len())
    }

    /// Takes primitives away: their energy becomes 0, the others' sums keep their order, so fields change within the old
    /// supports alone, to the bit. [`Index::restore`] brings them back; [`Index::new`] over the rest frees their memory.
    pub fn remove(&mut self, which: Range<usize>) {
        self.primitives[which].iter_mut().for_each(|one| one.energy = 0.0);
    }

    /// Gives primitives their energy back, in their order.
    pub fn restore(&mut self, which: Range<usize>, energies: &[f32]) {
        self.primitives[which].iter_mut().zip(energies).for_each(|(one, energy)| one.energy = *energy);
    }

    /// `f` of each of `points`, computed square by square of the ground: the lists and primitives of a square stay in the
    /// cache while its points are served. The result is in the order of `points`.
    pub fn square_by_square(&self, points: &[DVec3], f: impl Fn(DVec3) -> f64) -> Vec<f64> {
        let squares = Squares::new(&self.support, self.primitives.len());
        let mut ends = vec![0u32; squares.count() + 1];
        points.iter().for_each(|p| ends[squares.of(*p) + 1] += 1);
        (1..ends.len()).for_each(|k| ends[k] += ends[k - 1]);
        // Points are copied with their place: reading them where they are would miss the cache for each.
        let mut sorted = vec![(DVec3::ZERO, 0u32); points.len()];
        for (k, p) in points.iter().enumerate() {
            let next = &mut ends[squares.of(*p)];
            sorted[*next as usize] = (*p, k as u32);
            *next += 1;
        }
        let mut values = vec![0.0; points.len()];
        sorted.iter().for_each(|&(p, k)| values[k as usize] = f(p));
        values
    }

    /// The primitives, in the order in which they are summed: by squares of the ground, within one as they were given.
    pub fn primitives(&self) -> &[Primitive] {
        &self.primitives
    }

    /// The box off which the sum is 0.
    pub fn support(&self) -> Box3 {
        self.support
    }

    /// Bytes of the primitives and of the index beside them.
    pub fn bytes(&self) -> [usize; 2] {
        let primitives = size_of_val(self.primitives.as_slice());
        let lists = size_of_val(self.starts.as_slice()) + size_of_val(self.items.as_slice());
        [primitives, lists + size_of_val(self.table.as_slice()) + self.recent.bytes()]
    }

    /// The primitives whose support may hold `p`, ascending.
    #[inline(always)]
    pub fn near(&self, p: DVec3) -> impl Iterator<Item = u32> {
        let recent: &[u32] = if self.recent.is_empty() { &[] } else { self.recent.near(p) };
        self.listed(p).iter().chain(recent).copied()
    }

    /// Of those in the lists.
    #[inline(always)]
    fn listed(&self, p: DVec3) -> &[u32] {
        let [x, y, z] = self.cell_of(p);
        // A negative number is a large one after the conversion.
        let (x, y) = (x as u32 as usize, y as u32 as usize);
        if x >= self.columns[0] || y >= self.columns[1] {
            return &[];
        }
        let column = self.table[y * self.columns[0] + x];
        let list = z.wrapping_sub(column.bottom) as u32;
        if list >= column.count {
            return &[];
        }
        let list = (column.first + list) as usize;
        &self.items[self.starts[list] as usize..self.starts[list + 1] as usize]
    }

    /// The primitives whose support may meet `region`, ascending.
    pub fn among(&self, region: &Box3) -> Vec<u32> {
        let region = region.meet(&self.support);
        let mut found = Vec::new();
        if region.is_empty() {
            return found;
        }
        if !self.recent.is_empty() {
            self.recent.among(&region, &mut found);
        }
        if self.table.is_empty() {
            found.sort_unstable();
            found.dedup();
            return found;
        }
        let (low, high) = (self.cell_of(region.low), self.cell_of(region.high));
        let within = |c: i32, k: usize| (c.max(0) as usize).min(self.columns[k] - 1);
        for y in within(low[1], 1)..=within(high[1], 1) {
            for x in within(low[0], 0)..=within(high[0], 0) {
                let column = self.table[y * self.columns[0] + x];
                let (from, to) = (low[2].max(column.bottom), high[2].min(column.bottom + column.count as i32 - 1));
                if column.count > 0 && from <= to {
                    let list = |z: i32| (column.first as i32 + z - column.bottom) as usize;
                    found.extend_from_slice(
                        &self.items[self.starts[list(from)] as usize..self.starts[list(to) + 1] as usize],
                    );
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Σ f over the primitives in their order: to the bit what a sum over all of them gives, as those that are left out
    /// are 0.
    #[inline(always)]
    pub fn value(&self, p: DVec3) -> f64 {
        let mut sum = 0.0;
        for &k in self.listed(p) {
            sum += self.primitives[k as usize].value(p);
        }
        if !self.recent.is_empty() {
            for &k in self.recent.near(p) {
                sum += self.primitives[k as usize].value(p);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::primitive::tests::any_primitive;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        #[test]
        fn the_index_leaves_out_nothing_to_the_bit(
            primitives in prop::collection::vec(any_primitive(), 0..700),
            points in prop::collection::vec(prop::array::uniform3(-40.0f64..40.0), 50),
        ) {
            let index = Index::new(primitives.clone()).unwrap();
            for at in points {
                let p = DVec3::from_array(at);
                let all = index.primitives().iter().fold(0.0, |sum, one| sum + one.value(p));
                prop_assert_eq!(index.value(p), all);
                let region = Box3::new(p, p + 3.0);
                let some = index.among(&region);
                for (k, one) in index.primitives().iter().enumerate() {
                    let listed = some.binary_search(&(k as u32)).is_ok();
                    for corner in 0..27 {
                        let q = p + 1.5 * DVec3::new(f64::from(corner % 3), f64::from(corner / 3 % 3), f64::from(corner / 9));
                        prop_assert!(listed || one.value(q) == 0.0, "{one:?} at {q}");
                    }
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn what_is_inserted_and_removed_changes_sums_to_the_bit(
            before in prop::collection::vec(any_primitive(), 0..40),
            more in prop::collection::vec(any_primitive(), 1..40),
            points in prop::collection::vec(prop::array::uniform3(-40.0f64..40.0), 30),
        ) {
            let mut index = Index::new(before).unwrap();
            let old = index.clone();
            let which = index.insert(&more).unwrap();
            let sum = |index: &Index, p: DVec3| index.primitives().iter().fold(0.0, |sum, one| sum + one.value(p));
            let check = |index: &Index| {
                for at in &points {
                    let p = DVec3::from_array(*at);
                    assert_eq!(index.value(p), sum(index, p));
                    let some = index.among(&Box3::around(p, 2.0));
                    for (k, one) in index.primitives().iter().enumerate() {
                        assert!(some.binary_search(&(k as u32)).is_ok() || one.value(p + 1.5) == 0.0);
                    }
                    assert!(index.support().contains(p) || index.value(p) == 0.0);
                }
            };
            check(&index);
            let energies: Vec<f32> = more.iter().map(|one| one.energy).collect();
            let made = index.clone();
            index.remove(which.clone());
            check(&index);
            for at in &points {
                prop_assert_eq!(index.value(DVec3::from_array(*at)), old.value(DVec3::from_array(*at)));
            }
            index.restore(which, &energies);
            for at in &points {
                prop_assert_eq!(index.value(DVec3::from_array(*at)), made.value(DVec3::from_array(*at)));
            }
        }
    }

    #[test]
    fn no_primitives_are_the_field_0_and_a_bad_one_is_named() {
        let none = Index::new(Vec::new()).unwrap();
        assert_eq!(none.value(DVec3::ZERO), 0.0);
        assert!(none.among(&Box3::new(DVec3::ZERO, DVec3::ONE)).is_empty());
        let point = |radius: f32| Primitive {
            skeleton: super::super::skeleton::Skeleton::Point([0.0; 3]),
            radius,
            energy: 1.0,
        };
        assert_eq!(Index::new(vec![point(1.0), point(-1.0)]).unwrap_err(), 1);
    }

    #[test]
    fn a_list_that_lost_a_primitive_is_noticed() {
        let point = |x: f32| Primitive {
            skeleton: super::super::skeleton::Skeleton::Point([x, 0.0, 0.0]),
            radius: 2.0,
            energy: 1.0,
        };
        let mut index = Index::new(vec![point(0.0), point(1.0)]).unwrap();
        let p = DVec3::X * 0.5;
        let before = index.value(p);
        index.items.iter_mut().for_each(|k| *k = 0);
        assert_eq!(before, index.value(p), "the two are alike at the middle");
        let p = DVec3::X * 0.9;
        assert_ne!(index.value(p), point(0.0).value(p) + point(1.0).value(p));
    }
}
