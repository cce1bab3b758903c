//! The coarsest operator, a few dozen nodes, solved directly by Gaussian elimination with row exchanges.

use super::rows::{Rows, STEPS};
use super::stencil::Stencil;
use crate::plane::Plane;

/// L and U of a row-permuted matrix, in one square.
#[derive(Clone, Debug)]
pub struct Factors {
    width: usize,
    n: usize,
    lu: Vec<f64>,
    /// Row of the matrix that stands in each row of `lu`.
    order: Vec<usize>,
}

impl Factors {
    /// Factors the operator; `None` where a pivot vanishes beside the largest coefficient.
    pub fn of(operator: &Stencil) -> Option<Factors> {
        let (width, height) = (operator.width(), operator.height());
        let n = width * height;
        let mut lu = vec![0.0; n * n];
        for j in 0..height {
            for i in 0..width {
                for (k, (x, y)) in STEPS.into_iter().enumerate() {
                    let a = f64::from(operator.at(i, j)[k]);
                    if a != 0.0 {
                        let other = (j as isize + y) as usize * width + (i as isize + x) as usize;
                        lu[(j * width + i) * n + other] = a;
                    }
                }
            }
        }
        let largest = lu.iter().fold(0.0f64, |most, a| most.max(a.abs()));
        let mut order: Vec<usize> = (0..n).collect();
        for c in 0..n {
            let pivot = (c..n).max_by(|&p, &q| lu[p * n + c].abs().total_cmp(&lu[q * n + c].abs()))?;
            // What f32 coefficients cannot tell from zero.
            if lu[pivot * n + c].abs() <= 1e-7 * largest {
                return None;
            }
            if pivot != c {
                order.swap(pivot, c);
                (0..n).for_each(|k| lu.swap(pivot * n + k, c * n + k));
            }
            for r in c + 1..n {
                let factor = lu[r * n + c] / lu[c * n + c];
                lu[r * n + c] = factor;
                if factor != 0.0 {
                    (c + 1..n).for_each(|k| lu[r * n + k] -= factor * lu[c * n + k]);
                }
            }
        }
        Some(Factors { width, n, lu, order })
    }

    /// A⁻¹·b, nodes numbered row by row.
    fn column(&self, b: impl Fn(usize) -> f64) -> Vec<f64> {
        let n = self.n;
        let mut y: Vec<f64> = self.order.iter().map(|&node| b(node)).collect();
        for r in 0..n {
            let known: f64 = (0..r).map(|c| self.lu[r * n + c] * y[c]).sum();
            y[r] -= known;
        }
        for r in (0..n).rev() {
            let known: f64 = (r + 1..n).map(|c| self.lu[r * n + c] * y[c]).sum();
            y[r] = (y[r] - known) / self.lu[r * n + r];
        }
        y
    }
    /// A⁻¹, row by row.
    pub fn inverse(&self) -> Vec<f32> {
        let n = self.n;
        let mut inverse = vec![0.0; n * n];
        for c in 0..n {
            let column = self.column(|node| if node == c { 1.0 } else { 0.0 });
            column.into_iter().enumerate().for_each(|(r, value)| inverse[r * n + c] = value as f32);
        }
        inverse
    }

    /// `x` = A⁻¹·`b`.
    pub fn solve<const K: usize>(&self, b: &Plane<f32, K>, x: &mut Plane<f32, K>) {
        let place = |node: usize| (node % self.width, node / self.width);
        for k in 0..K {
            let at = |node: usize| {
                let (i, j) = place(node);
                f64::from(b.at(i, j)[k])
            };
            for (node, value) in self.column(at).into_iter().enumerate() {
                let (i, j) = place(node);
                let mut values = x.at(i, j);
                values[k] = value as f32;
                x.set(i, j, values);
            }
        }
    }
}
