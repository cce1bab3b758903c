//! K values at every node of a raster, with a border around it that stays zero. Rows of even and of odd number lie in storages of their
//! own, so that all rows of one parity can be relaxed in parallel while they read the rows of the other; a row holds its K fields one
//! after the other, so that each is a plain array.

use rayon::prelude::*;

/// A number that solvers compute in: `f64` for what is solved for, `f32` for corrections of it.
pub trait Float:
    Copy
    + Send
    + Sync
    + Default
    + PartialEq
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::AddAssign
    + 'static
{
    /// Rounded to nearest.
    fn of(value: f64) -> Self;
    /// Exact.
    fn of_single(value: f32) -> Self;
    /// Exact.
    fn wide(self) -> f64;
}

impl Float for f32 {
    fn of(value: f64) -> f32 {
        value as f32
    }
    fn of_single(value: f32) -> f32 {
        value
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Float for f64 {
    fn of(value: f64) -> f64 {
        value
    }
    fn of_single(value: f32) -> f64 {
        f64::from(value)
    }
    fn wide(self) -> f64 {
        self
    }
}

/// Runs a loop in the widest vectors that the processor has; the same operations in the same order, so the same bits.
#[inline(always)]
pub(crate) fn wide<R>(op: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(op)
}

/// See the module. Node (i, j) is the i-th from the west in the j-th row from the south.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane<T, const K: usize> {
    width: usize,
    height: usize,
    /// Stored row s holds row s − 1; parity is that of s.
    rows: [Vec<T>; 2],
}

/// The K fields of a stored row.
fn fields<T, const K: usize>(stored: &mut [T]) -> [&mut [T]; K] {
    let mut fields = stored.chunks_exact_mut(stored.len() / K);
    std::array::from_fn(|_| fields.next().unwrap_or_default())
}

impl<T: Float, const K: usize> Plane<T, K> {
    /// Zeros.
    pub fn new(width: usize, height: usize) -> Plane<T, K> {
        let stored = |parity: usize| vec![T::default(); K * (width + 2) * (height + 3 - parity).div_euclid(2)];
        Plane { width, height, rows: [stored(0), stored(1)] }
    }
    /// Nodes from west to east.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows from south to north.
    pub fn height(&self) -> usize {
        self.height
    }
    /// What it takes, bytes.
    pub fn bytes(&self) -> usize {
        size_of::<T>() * (self.rows[0].len() + self.rows[1].len())
    }
    fn all(&self) -> Neighbours<'_, T, K> {
        Neighbours { rows: [&self.rows[0], &self.rows[1]], stride: self.width + 2, s: 0 }
    }
    /// Field `k` of row `j` with one border node before and one after it; `j` from −1 to `height`.
    pub fn row(&self, j: isize, k: usize) -> &[T] {
        self.all().stored((j + 1) as usize, k)
    }
    /// Field `k` of the rows to the south of row `j`, itself, and to the north of it.
    pub fn beside(&self, j: usize, k: usize) -> [&[T]; 3] {
        [0, 1, 2].map(|s| self.all().stored(j + s, k))
    }
    /// The values at node (i, j).
    pub fn at(&self, i: usize, j: usize) -> [T; K] {
        std::array::from_fn(|k| self.row(j as isize, k)[i + 1])
    }
    /// Sets the values at node (i, j).
    pub fn set(&mut self, i: usize, j: usize, values: [T; K]) {
        let (s, stride) = (j + 1, self.width + 2);
        for (k, value) in values.into_iter().enumerate() {
            self.rows[s & 1][((s >> 1) * K + k) * stride + i + 1] = value;
        }
    }
    /// Field `k` of every node, row by row from the south.
    pub fn iter(&self, k: usize) -> impl Iterator<Item = T> {
        (0..self.height).flat_map(move |j| self.row(j as isize, k)[1..=self.width].iter().copied())
    }
    /// Field `k` of every node, row by row from the south.
    pub fn field(&self, k: usize) -> Vec<T> {
        let mut values = vec![T::default(); self.width * self.height];
        values.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(j, row)| {
            row.copy_from_slice(&self.row(j as isize, k)[1..=self.width]);
        });
        values
    }
    /// Calls `row(j, padded fields of row j, the rows of the other parity, scratch)` for every row of one parity, in parallel, and
    /// returns what it returned, by row. The border must stay zero; scratch is as it was left.
    pub fn update_parity<R: Send>(
        &mut self,
        odd: bool,
        row: impl Fn(usize, [&mut [T]; K], Neighbours<'_, T, K>, &mut Vec<T>) -> R + Sync,
    ) -> Vec<R> {
        let (stride, height) = (self.width + 2, self.height);
        // Row j is stored as j + 1.
        let parity = usize::from(!odd);
        let [even, odd] = &mut self.rows;
        let (written, rows) = if parity == 0 { (even, [&[][..], odd]) } else { (odd, [&even[..], &[]]) };
        let first = 1 - parity;
        written
            .par_chunks_mut(stride * K)
            .enumerate()
            .skip(first)
            .take((height + parity) / 2)
            .map_init(Vec::new, |scratch, (k, stored)| {
                let s = 2 * k + parity;
                row(s - 1, fields(stored), Neighbours { rows, stride, s }, scratch)
            })
            .collect()
    }
    /// Calls `band` for every band of `rows` rows, an even number, in parallel; each sees the rows beside its own as they were before.
    pub fn update_bands(&mut self, rows: usize, band: impl Fn(&mut Band<'_, T, K>) + Sync) {
        let (row, height) = (K * (self.width + 2), self.height);
        let bands = height.div_ceil(rows);
        // Row j is stored as j + 1: a band's rows are those from an odd one on, and the two beside it belong to others.
        let beside = |s: usize| self.rows[s & 1][(s >> 1) * row..][..row].to_vec();
        let ghosts: Vec<[Vec<T>; 2]> =
            (0..bands).map(|b| [beside(b * rows), beside(((b + 1) * rows).min(height) + 1)]).collect();
        let [even, odd] = &mut self.rows;
        let (even, odd) = (even[row..].par_chunks_mut(rows / 2 * row), odd.par_chunks_mut(rows / 2 * row));
        even.zip(odd).zip(ghosts).enumerate().for_each(|(b, ((even, odd), ghosts))| {
            let (first, end) = (b * rows, ((b + 1) * rows).min(height));
            band(&mut Band { stored: [odd, even], ghosts, first, end, row });
        });
    }
    /// Calls `row(j, padded fields of row j, scratch)` for every row, in parallel, and returns what it returned, by row.
    pub fn update<R: Send>(&mut self, row: impl Fn(usize, [&mut [T]; K], &mut Vec<T>) -> R + Sync) -> Vec<R> {
        let [even, odd] =
            [false, true].map(|odd| self.update_parity(odd, |j, fields, _, scratch| row(j, fields, scratch)));
        let (mut even, mut odd) = (even.into_iter(), odd.into_iter());
        (0..self.height).filter_map(|j| if j % 2 == 0 { even.next() } else { odd.next() }).collect()
    }
    /// Copies every value, rounded to this plane's number.
    pub fn assign<U: Float>(&mut self, from: &Plane<U, K>) {
        self.update(|j, fields, _| {
            for (k, to) in fields.into_iter().enumerate() {
                wide(
                    #[inline(always)]
                    || to.iter_mut().zip(from.row(j as isize, k)).for_each(|(to, from)| *to = T::of(from.wide())),
                );
            }
        });
    }
    /// The inner product with another plane, per field.
    pub fn dot(&self, other: &Plane<T, K>) -> [f64; K] {
        let rows: Vec<[f64; K]> = (0..self.height as isize)
            .into_par_iter()
            .map(|j| {
                std::array::from_fn(|k| {
                    wide(
                        #[inline(always)]
                        || dot(self.row(j, k), other.row(j, k)),
                    )
                })
            })
            .collect();
        sum(&rows)
    }
}

/// Σ of rows, in their order, so that threads do not matter.
pub fn sum<const K: usize>(rows: &[[f64; K]]) -> [f64; K] {
    rows.iter().fold([0.0; K], |a, b| std::array::from_fn(|k| a[k] + b[k]))
}

/// The inner product of two rows, in eight sums so that lanes can share them out.
#[inline(always)]
pub fn dot<T: Float>(a: &[T], b: &[T]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a.wide() * b.wide()).sum();
    for (a, b) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += a[k].wide() * b[k].wide();
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Some rows of a plane that are updated one after the other.
#[derive(Debug)]
pub struct Band<'a, T, const K: usize> {
    /// The rows of even distance from the first, and those of odd.
    stored: [&'a mut [T]; 2],
    /// The rows to the south and to the north, as they were.
    ghosts: [Vec<T>; 2],
    first: usize,
    end: usize,
    row: usize,
}

impl<T, const K: usize> Band<'_, T, K> {
    /// Its rows.
    pub fn rows(&self) -> std::ops::Range<usize> {
        self.first..self.end
    }
    /// Calls `row(padded fields of row j, those of the rows to the south and to the north)`.
    pub fn update(&mut self, j: usize, row: impl FnOnce([&mut [T]; K], [[&[T]; K]; 2])) {
        let (at, n) = (j - self.first, self.row);
        let [same, other] = &mut self.stored;
        let (own, beside) = if at % 2 == 0 { (same, &**other) } else { (other, &**same) };
        // Of the other kind the row before comes before the one after.
        let before = (at + at % 2) / 2;
        let south = if at == 0 { &self.ghosts[0][..] } else { &beside[(before - 1) * n..][..n] };
        let north = if j + 1 == self.end { &self.ghosts[1][..] } else { &beside[before * n..][..n] };
        let each = |stored| {
            let mut fields = <[T]>::chunks_exact(stored, n / K);
            std::array::from_fn(|_| fields.next().unwrap_or_default())
        };
        row(fields(&mut own[at / 2 * n..][..n]), [each(south), each(north)]);
    }
}

/// The rows beside one that is being updated.
#[derive(Clone, Copy, Debug)]
pub struct Neighbours<'a, T, const K: usize> {
    rows: [&'a [T]; 2],
    stride: usize,
    s: usize,
}

impl<'a, T, const K: usize> Neighbours<'a, T, K> {
    fn stored(&self, s: usize, k: usize) -> &'a [T] {
        &self.rows[s & 1][((s >> 1) * K + k) * self.stride..][..self.stride]
    }
    /// Field `k` of the padded row to the south.
    pub fn south(&self, k: usize) -> &'a [T] {
        self.stored(self.s - 1, k)
    }
    /// Field `k` of the padded row to the north.
    pub fn north(&self, k: usize) -> &'a [T] {
        self.stored(self.s + 1, k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_both_parities_see_their_neighbours_and_the_border_is_zero() {
        for (width, height) in [(3, 1), (4, 2), (5, 5), (2, 6)] {
            let mut plane = Plane::<f64, 2>::new(width, height);
            let value = |i: usize, j: usize| (10 * j + i + 1) as f64;
            for (i, j) in (0..height).flat_map(|j| (0..width).map(move |i| (i, j))) {
                plane.set(i, j, [value(i, j), -value(i, j)]);
            }
            let before = plane.clone();
            for odd in [false, true] {
                let mut copy = plane.clone();
                let rows = copy.update_parity(odd, |j, fields, beside, _| {
                    assert_eq!(j % 2 == 1, odd);
                    for k in 0..2 {
                        assert_eq!([beside.south(k), &*fields[k], beside.north(k)], before.beside(j, k));
                    }
                    fields.into_iter().for_each(|row| row[1] = -1.0);
                    j
                });
                assert!(rows.into_iter().eq((usize::from(odd)..height).step_by(2)));
                assert!((0..height).all(|j| (copy.at(0, j) == [-1.0; 2]) == ((j % 2 == 1) == odd)));
            }
            assert!((0..2).all(|k| [-1, height as isize].iter().all(|&j| before.row(j, k).iter().all(|v| *v == 0.0))));
            let total: f64 = before.iter(0).map(|value| value * value).sum();
            assert_eq!((before.dot(&before), before.field(1)[0]), ([total; 2], -1.0));
            for rows in [2, 4, 8] {
                let mut copy = before.clone();
                copy.update_bands(rows, |band| {
                    assert_eq!(band.rows().start % rows, 0);
                    for j in band.rows() {
                        band.update(j, |fields, [south, north]| {
                            for k in 0..2 {
                                assert_eq!([south[k], &*fields[k], north[k]], before.beside(j, k));
                            }
                        });
                    }
                    let last = band.rows().end - 1;
                    band.update(last, |fields, _| fields.into_iter().for_each(|row| row[1] = -1.0));
                });
                let written = |j: usize| copy.at(0, j) == [-1.0; 2];
                assert!((0..height).all(|j| written(j) == ((j + 1) % rows == 0 || j + 1 == height)));
            }
            assert!(plane.update(|j, _, _| j).into_iter().eq(0..height));
            let mut narrow = Plane::<f32, 2>::new(width, height);
            narrow.assign(&before);
            assert!(narrow.iter(1).eq(before.iter(1).map(|value| value as f32)));
        }
    }
}
