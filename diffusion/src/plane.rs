//! K values at every node of a raster, with a border of zeros around it. Rows of even and of odd number lie in storages of their own,
//! so that all rows of one parity can be relaxed in parallel while they read the rows of the other.

use rayon::prelude::*;

/// A number that solvers compute in: `f64` outside, `f32` inside the preconditioner.
pub trait Float:
    Copy
    + Send
    + Sync
    + Default
    + PartialEq
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + 'static
{
    /// Rounded to nearest.
    fn of(value: f64) -> Self;
    /// Exact for `f32`.
    fn wide(self) -> f64;
}

impl Float for f32 {
    fn of(value: f64) -> f32 {
        value as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Float for f64 {
    fn of(value: f64) -> f64 {
        value
    }
    fn wide(self) -> f64 {
        self
    }
}

/// See the module. Node (i, j) is the i-th from the west in the j-th row from the south.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane<T, const K: usize> {
    width: usize,
    height: usize,
    /// Stored row s holds row s − 1; parity is that of s.
    rows: [Vec<[T; K]>; 2],
}

impl<T: Float, const K: usize> Plane<T, K> {
    /// Zeros.
    pub fn new(width: usize, height: usize) -> Plane<T, K> {
        let stride = width + 2;
        let stored = |parity: usize| vec![[T::default(); K]; stride * (height + 3 - parity).div_euclid(2)];
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
    /// The values of row `j` with one border node before and one after them; `j` from −1 to `height`.
    pub fn padded_row(&self, j: isize) -> &[[T; K]] {
        let (s, stride) = ((j + 1) as usize, self.width + 2);
        &self.rows[s & 1][(s >> 1) * stride..][..stride]
    }
    /// The values at node (i, j).
    pub fn at(&self, i: usize, j: usize) -> [T; K] {
        self.padded_row(j as isize)[i + 1]
    }
    /// Sets the values at node (i, j).
    pub fn set(&mut self, i: usize, j: usize, values: [T; K]) {
        let (s, stride) = (j + 1, self.width + 2);
        self.rows[s & 1][(s >> 1) * stride + i + 1] = values;
    }
    /// The values of every node, row by row from the south.
    pub fn iter(&self) -> impl Iterator<Item = &[T; K]> {
        (0..self.height).flat_map(|j| &self.padded_row(j as isize)[1..=self.width])
    }
    /// Sets every node to zero.
    pub fn clear(&mut self) {
        self.rows.par_iter_mut().for_each(|rows| rows.fill([T::default(); K]));
    }
    /// Calls `row(j, padded values of row j, the rows of the other parity)` for every row of one parity, in parallel. The border stays
    /// as `row` leaves it: it must leave zeros.
    pub fn update_parity(&mut self, odd: bool, row: impl Fn(usize, &mut [[T; K]], Neighbours<'_, T, K>) + Sync) {
        let (stride, height) = (self.width + 2, self.height);
        // Row j is stored as j + 1.
        let parity = usize::from(!odd);
        let [even, odd] = &mut self.rows;
        let (written, read) = if parity == 0 { (even, &*odd) } else { (odd, &*even) };
        written.par_chunks_mut(stride).enumerate().for_each(|(k, values)| {
            let s = 2 * k + parity;
            if (1..=height).contains(&s) {
                row(s - 1, values, Neighbours { rows: read, stride, s });
            }
        });
    }
    /// Calls `row(padded values of row j, the rows beside it)` for one row.
    pub fn update_row(&mut self, j: usize, row: impl FnOnce(&mut [[T; K]], Neighbours<'_, T, K>)) {
        let (stride, s) = (self.width + 2, j + 1);
        let [even, odd] = &mut self.rows;
        let (written, read) = if s & 1 == 0 { (even, &*odd) } else { (odd, &*even) };
        row(&mut written[(s >> 1) * stride..][..stride], Neighbours { rows: read, stride, s });
    }
    /// Copies every value, rounded to this plane's number.
    pub fn assign<U: Float>(&mut self, from: &Plane<U, K>) {
        self.update(|j, row| {
            for (to, from) in row.iter_mut().zip(from.padded_row(j as isize)) {
                *to = from.map(|value| T::of(value.wide()));
            }
        });
    }
    /// Calls `row(j, padded values of row j)` for every row, in parallel.
    pub fn update(&mut self, row: impl Fn(usize, &mut [[T; K]]) + Sync) {
        for odd in [false, true] {
            self.update_parity(odd, |j, values, _| row(j, values));
        }
    }
    /// The inner product with another plane, per value.
    pub fn dot(&self, other: &Plane<T, K>) -> [f64; K] {
        sum(self.height, |j| {
            let pairs = self.padded_row(j as isize).iter().zip(other.padded_row(j as isize));
            pairs.fold([0.0; K], |total, (a, b)| std::array::from_fn(|k| total[k] + a[k].wide() * b[k].wide()))
        })
    }
    /// Every value in another number.
    pub fn convert<U: Float>(&self) -> Plane<U, K> {
        let mut result = Plane::new(self.width, self.height);
        result.assign(self);
        result
    }
}

/// Σ over rows of `row(j)`, per value: rows in parallel, added in their order, so that threads do not matter.
pub fn sum<const K: usize>(height: usize, row: impl Fn(usize) -> [f64; K] + Sync) -> [f64; K] {
    let rows: Vec<[f64; K]> = (0..height).into_par_iter().map(&row).collect();
    rows.into_iter().fold([0.0; K], |a, b| std::array::from_fn(|k| a[k] + b[k]))
}

/// The rows beside one that is being updated.
#[derive(Clone, Copy, Debug)]
pub struct Neighbours<'a, T, const K: usize> {
    rows: &'a [[T; K]],
    stride: usize,
    s: usize,
}

impl<'a, T, const K: usize> Neighbours<'a, T, K> {
    /// The padded row to the south.
    pub fn south(&self) -> &'a [[T; K]] {
        &self.rows[((self.s - 1) >> 1) * self.stride..][..self.stride]
    }
    /// The padded row to the north.
    pub fn north(&self) -> &'a [[T; K]] {
        &self.rows[((self.s + 1) >> 1) * self.stride..][..self.stride]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_both_parities_see_their_neighbours_and_the_border_is_zero() {
        for (width, height) in [(3, 1), (4, 2), (5, 5), (2, 6)] {
            let mut plane = Plane::<f64, 1>::new(width, height);
            for j in 0..height {
                for i in 0..width {
                    plane.set(i, j, [(10 * j + i + 1) as f64]);
                }
            }
            let before = plane.clone();
            for odd in [false, true] {
                let mut copy = plane.clone();
                copy.update_parity(odd, |j, row, beside| {
                    assert_eq!(j % 2 == 1, odd);
                    assert_eq!(row, before.padded_row(j as isize));
                    assert_eq!(beside.south(), before.padded_row(j as isize - 1));
                    assert_eq!(beside.north(), before.padded_row(j as isize + 1));
                    row[1] = [-1.0];
                });
                assert!((0..height).all(|j| (copy.at(0, j) == [-1.0]) == ((j % 2 == 1) == odd)));
            }
            assert!(plane.padded_row(-1).iter().chain(plane.padded_row(height as isize)).all(|v| *v == [0.0]));
            let square = |i: usize, j: usize| ((10 * j + i + 1) * (10 * j + i + 1)) as f64;
            let total: f64 = (0..height).flat_map(|j| (0..width).map(move |i| square(i, j))).sum();
            assert_eq!(plane.dot(&plane), [total]);
            assert_eq!(plane.convert::<f32>().convert::<f64>(), plane);
        }
    }
}
