//! A linear operator on a raster that couples each node to its eight neighbours: nine coefficients a node.

use crate::plane::{Float, Plane};
use rayon::prelude::*;

/// Where each coefficient points: (east, north) steps, the node itself in the middle.
pub const STEPS: [(isize, isize); 9] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
/// The index of the node itself.
pub const SELF: usize = 4;
/// The index of the coefficient that points along `step`.
pub const fn index_of((x, y): (isize, isize)) -> usize {
    (3 * (y + 1) + x + 1) as usize
}

/// See the module. A coefficient that points out of the raster is 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil<T> {
    width: usize,
    height: usize,
    coefficients: Vec<[T; 9]>,
}

impl<T: Float> Stencil<T> {
    /// The operator whose row at node (i, j) is `row(i, j)`. What points out of the raster is dropped.
    pub fn new(width: usize, height: usize, row: impl Fn(usize, usize) -> [f64; 9] + Sync) -> Stencil<T> {
        let mut coefficients = vec![[T::default(); 9]; width * height];
        coefficients.par_chunks_mut(width).enumerate().for_each(|(j, line)| {
            for (i, to) in line.iter_mut().enumerate() {
                let from = row(i, j);
                for (k, (x, y)) in STEPS.into_iter().enumerate() {
                    let inside = i.checked_add_signed(x).is_some_and(|i| i < width)
                        && j.checked_add_signed(y).is_some_and(|j| j < height);
                    to[k] = if inside { T::of(from[k]) } else { T::default() };
                }
            }
        });
        Stencil { width, height, coefficients }
    }
    /// Nodes from west to east.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows from south to north.
    pub fn height(&self) -> usize {
        self.height
    }
    /// The row of node (i, j).
    pub fn at(&self, i: usize, j: usize) -> &[T; 9] {
        &self.coefficients[j * self.width + i]
    }
    /// The rows of the nodes of line `j`.
    pub fn line(&self, j: usize) -> &[[T; 9]] {
        &self.coefficients[j * self.width..][..self.width]
    }
    /// The same operator in another number.
    pub fn convert<U: Float>(&self) -> Stencil<U> {
        let coefficients = self.coefficients.par_iter().map(|row| row.map(|value| U::of(value.wide()))).collect();
        Stencil { width: self.width, height: self.height, coefficients }
    }
    /// `result` = b − A·x; without `b`, A·x.
    pub fn residual<const K: usize>(&self, x: &Plane<T, K>, b: Option<&Plane<T, K>>, result: &mut Plane<T, K>) {
        result.update(|j, row| {
            let (south, middle, north) =
                (x.padded_row(j as isize - 1), x.padded_row(j as isize), x.padded_row(j as isize + 1));
            let b = b.map(|b| b.padded_row(j as isize));
            for (i, a) in self.line(j).iter().enumerate() {
                let product = dot(a, i, south, middle, north);
                row[i + 1] = match b {
                    Some(b) => std::array::from_fn(|k| b[i + 1][k] - product[k]),
                    None => product,
                };
            }
        });
    }
    /// Whether the operator is its own transpose, up to `tolerance` on a coefficient.
    pub fn is_symmetric(&self, tolerance: f64) -> bool {
        let differs = |i: usize, j: usize| {
            STEPS.into_iter().enumerate().any(|(k, (x, y))| {
                let Some((p, q)) = i.checked_add_signed(x).zip(j.checked_add_signed(y)) else { return false };
                let mirrored = |p, q| self.at(p, q)[index_of((-x, -y))].wide();
                p < self.width && q < self.height && (self.at(i, j)[k].wide() - mirrored(p, q)).abs() > tolerance
            })
        };
        (0..self.height).into_par_iter().all(|j| (0..self.width).all(|i| !differs(i, j)))
    }
}

/// Σ over the stencil of coefficient times value; rows are padded by one node, so the stencil of node i starts at i.
#[inline(always)]
pub fn dot<T: Float, const K: usize>(
    a: &[T; 9],
    i: usize,
    south: &[[T; K]],
    middle: &[[T; K]],
    north: &[[T; K]],
) -> [T; K] {
    std::array::from_fn(|k| {
        let line = |a: &[T], row: &[[T; K]]| a[0] * row[i][k] + a[1] * row[i + 1][k] + a[2] * row[i + 2][k];
        line(&a[..3], south) + line(&a[3..6], middle) + line(&a[6..], north)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_of_a_stencil_is_the_sum_over_neighbours() {
        let (w, h) = (5, 4);
        let row = |i: usize, j: usize| std::array::from_fn(|k| (i + 3 * j) as f64 * 0.25 + k as f64);
        let a = Stencil::<f64>::new(w, h, row);
        let mut x = Plane::<f64, 2>::new(w, h);
        for j in 0..h {
            for i in 0..w {
                x.set(i, j, [(i * i + j) as f64, 1.0]);
            }
        }
        let mut y = Plane::new(w, h);
        a.residual(&x, None, &mut y);
        let mut rest = Plane::new(w, h);
        a.residual(&x, Some(&y), &mut rest);
        for j in 0..h {
            for i in 0..w {
                let mut expected = [0.0; 2];
                for (k, (dx, dy)) in STEPS.into_iter().enumerate() {
                    let (p, q) = (i as isize + dx, j as isize + dy);
                    if (0..w as isize).contains(&p) && (0..h as isize).contains(&q) {
                        let value = x.at(p as usize, q as usize);
                        expected = [0, 1].map(|m| expected[m] + row(i, j)[k] * value[m]);
                    }
                }
                assert_eq!(y.at(i, j), expected);
                assert_eq!(rest.at(i, j), [0.0; 2]);
            }
        }
        assert!(!a.is_symmetric(1e-9));
        let laplace = |_, _| [0.0, -1.0, 0.0, -1.0, 4.0, -1.0, 0.0, -1.0, 0.0];
        assert!(Stencil::<f32>::new(w, h, laplace).is_symmetric(0.0));
    }
}
