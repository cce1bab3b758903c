//! ΔF = 0 between fixed values, the five fields of Hnaidi 2010 §5.2 that are diffused alone: A, R, the gradient's norm, and its
//! direction's two components. Fields that are fixed at the same nodes are solved together.
//!
//! At a free node F is the mean of the neighbours that exist, which makes the raster's border a natural one (no flow across it). The
//! fixed values go to the right-hand side, so the operator on the free nodes is symmetric.

use super::SolveError;
use super::cycle::{Cycle, Smoother};
use super::krylov::{Operator, Progress, Stop, conjugate_gradients};
use crate::plane::Plane;
use crate::stencil::{SELF, Stencil, index_of};

const BESIDE: [(isize, isize); 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];

/// The operator: which nodes are fixed.
#[derive(Clone, Debug)]
pub struct Laplace {
    width: usize,
    height: usize,
    fixed: Vec<bool>,
}

impl Laplace {
    /// The operator of a raster whose nodes are fixed where `fixed(i, j)` says so.
    pub fn new(width: usize, height: usize, fixed: impl Fn(usize, usize) -> bool) -> Laplace {
        let fixed = (0..height).flat_map(|j| (0..width).map(move |i| (i, j))).map(|(i, j)| fixed(i, j)).collect();
        Laplace { width, height, fixed }
    }
    fn is_fixed(&self, i: usize, j: usize) -> bool {
        self.fixed[j * self.width + i]
    }
    /// The neighbours of a node that exist.
    fn beside(&self, i: usize, j: usize) -> impl Iterator<Item = ((isize, isize), usize, usize)> {
        let (width, height) = (self.width, self.height);
        BESIDE.into_iter().filter_map(move |(x, y)| {
            let (p, q) = (i.checked_add_signed(x)?, j.checked_add_signed(y)?);
            (p < width && q < height).then_some(((x, y), p, q))
        })
    }
    /// Its coefficients, for the hierarchy of coarser ones.
    pub fn stencil(&self) -> Stencil<f32> {
        Stencil::new(self.width, self.height, |i, j| {
            let mut row = [0.0; 9];
            if self.is_fixed(i, j) {
                row[SELF] = 1.0;
                return row;
            }
            for (step, p, q) in self.beside(i, j) {
                row[SELF] += 1.0;
                if !self.is_fixed(p, q) {
                    row[index_of(step)] = -1.0;
                }
            }
            row
        })
    }
    /// The right-hand side: a fixed node's own value, and at a free one the sum of the fixed values beside it.
    fn right_hand_side<const K: usize>(&self, values: &Plane<f64, K>) -> Plane<f64, K> {
        let mut b = Plane::new(self.width, self.height);
        b.update(|j, row| {
            for i in 0..self.width {
                row[i + 1] = if self.is_fixed(i, j) {
                    values.at(i, j)
                } else {
                    let fixed = self.beside(i, j).filter(|&(_, p, q)| self.is_fixed(p, q));
                    fixed.fold([0.0; K], |total, (_, p, q)| {
                        let value = values.at(p, q);
                        std::array::from_fn(|k| total[k] + value[k])
                    })
                };
            }
        });
        b
    }
}

impl<const K: usize> Operator<K> for Laplace {
    fn residual(&self, x: &Plane<f64, K>, b: Option<&Plane<f64, K>>, result: &mut Plane<f64, K>) {
        result.update(|j, row| {
            let (south, middle, north) =
                (x.padded_row(j as isize - 1), x.padded_row(j as isize), x.padded_row(j as isize + 1));
            let b = b.map(|b| b.padded_row(j as isize));
            let vertical = f64::from(u8::from(j > 0)) + f64::from(u8::from(j + 1 < self.height));
            let fixed = &self.fixed[j * self.width..][..self.width];
            // Free neighbours count with their value, fixed ones are on the right-hand side: `x` is masked where it is read.
            let free = |line: &[bool], i: usize| if line[i] { 0.0 } else { 1.0 };
            let line = |q: usize| &self.fixed[q * self.width..][..self.width];
            let below = (j > 0).then(|| line(j - 1));
            let above = (j + 1 < self.height).then(|| line(j + 1));
            for i in 0..self.width {
                let product: [f64; K] = if fixed[i] {
                    middle[i + 1]
                } else {
                    let west = if i > 0 { free(fixed, i - 1) } else { 0.0 };
                    let east = if i + 1 < self.width { free(fixed, i + 1) } else { 0.0 };
                    let down = below.map_or(0.0, |line| free(line, i));
                    let up = above.map_or(0.0, |line| free(line, i));
                    let own = vertical + f64::from(u8::from(i > 0)) + f64::from(u8::from(i + 1 < self.width));
                    std::array::from_fn(|k| {
                        let beside = west * middle[i][k]
                            + east * middle[i + 2][k]
                            + down * south[i + 1][k]
                            + up * north[i + 1][k];
                        own * middle[i + 1][k] - beside
                    })
                };
                row[i + 1] = match b {
                    Some(b) => std::array::from_fn(|k| b[i + 1][k] - product[k]),
                    None => product,
                };
            }
        });
    }
}

/// Diffuses K fields from the values at the fixed nodes; `values` elsewhere is the first guess. Returns how the solve went.
///
/// # Errors
/// [`SolveError::Unheld`] when no node is fixed.
pub fn diffuse<const K: usize>(
    operator: &Laplace,
    values: &mut Plane<f64, K>,
    stop: Stop,
) -> Result<Progress<K>, SolveError> {
    if !operator.fixed.contains(&true) {
        return Err(SolveError::Unheld);
    }
    let mut cycle = Cycle::<K>::new(operator.stencil(), Smoother::FourColours)?;
    let b = operator.right_hand_side(values);
    Ok(conjugate_gradients(operator, &mut cycle, &b, values, stop))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some scattered values and a fixed polyline, the same for every size.
    fn example(n: usize) -> (Laplace, Plane<f64, 2>) {
        let at = |t: f64| ((t * (n - 1) as f64).round()) as usize;
        let mut fixed = vec![None; n * n];
        for k in 0..=4 * n {
            let t = k as f64 / (4 * n) as f64;
            let (x, y) = (0.15 + 0.6 * t, 0.3 + 0.4 * t * t);
            fixed[at(y) * n + at(x)] = Some([100.0 * t, 1.0 - t]);
            let (x, y) = (0.8 - 0.1 * t, 0.1 + 0.8 * t);
            fixed[at(y) * n + at(x)] = Some([40.0, t]);
        }
        fixed[0] = Some([-30.0, 0.5]);
        let operator = Laplace::new(n, n, |i, j| fixed[j * n + i].is_some());
        let mut values = Plane::new(n, n);
        for j in 0..n {
            for i in 0..n {
                if let Some(pair) = fixed[j * n + i] {
                    values.set(i, j, pair);
                }
            }
        }
        (operator, values)
    }

    #[test]
    fn eight_iterations_do_at_every_size() {
        for n in [65, 129, 257, 400] {
            let (operator, mut values) = example(n);
            let progress = diffuse(&operator, &mut values, Stop::default()).unwrap();
            assert!(progress.converged, "{n}: {progress:?}");
            assert!(progress.iterations() <= 8, "{n}: {:?}", progress.residuals);
        }
    }

    #[test]
    fn diffused_values_obey_the_maximum_principle_and_fixed_ones_stay() {
        let (operator, mut values) = example(129);
        let before = values.clone();
        diffuse(&operator, &mut values, Stop { relative_residual: 1e-12, ..Stop::default() }).unwrap();
        for j in 0..129 {
            for i in 0..129 {
                let [height, share] = values.at(i, j);
                assert!((-30.0 - 1e-6..=100.0 + 1e-6).contains(&height) && (-1e-6..=1.0 + 1e-6).contains(&share));
                if operator.is_fixed(i, j) {
                    let [fixed_height, fixed_share] = before.at(i, j);
                    assert!((height - fixed_height).abs() < 1e-9 && (share - fixed_share).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_plane_between_its_borders_is_the_plane() {
        let n = 65;
        let border = |i: usize, j: usize| i == 0 || j == 0 || i == n - 1 || j == n - 1;
        let plane = |i: usize, j: usize| 3.0 * i as f64 - 2.0 * j as f64 + 7.0;
        let operator = Laplace::new(n, n, border);
        let mut values = Plane::<f64, 1>::new(n, n);
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|&(i, j)| border(i, j)) {
            values.set(i, j, [plane(i, j)]);
        }
        diffuse(&operator, &mut values, Stop { relative_residual: 1e-13, ..Stop::default() }).unwrap();
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            assert!((values.at(i, j)[0] - plane(i, j)).abs() < 1e-8);
        }
    }

    #[test]
    fn matrix_free_operator_is_its_stencil() {
        let (operator, _) = example(33);
        let mut x = Plane::<f64, 1>::new(33, 33);
        for j in 0..33 {
            for i in 0..33 {
                x.set(i, j, [((7 * i + 13 * j) % 11) as f64]);
            }
        }
        let (mut free, mut stored) = (x.clone(), x.clone());
        operator.residual(&x, None, &mut free);
        operator.stencil().convert::<f64>().residual(&x, None, &mut stored);
        assert_eq!(free, stored);
        assert!(operator.stencil().is_symmetric(0.0));
    }

    #[test]
    fn a_field_that_nothing_holds_is_refused() {
        let operator = Laplace::new(20, 20, |_, _| false);
        let refused = diffuse(&operator, &mut Plane::<f64, 1>::new(20, 20), Stop::default());
        assert!(matches!(refused, Err(SolveError::Unheld)));
    }

    #[test]
    fn threads_do_not_matter() {
        let solve = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let (operator, mut values) = example(100);
                diffuse(&operator, &mut values, Stop::default()).unwrap();
                values
            })
        };
        assert_eq!(solve(1), solve(3));
    }
}
