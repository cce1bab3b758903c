//! Interpolation that follows the operator, and the coarse operator it implies (Dendy 1982, black-box multigrid).
//!
//! Coarse nodes are the fine ones with both indices even. A fine node between two coarse ones takes them in proportion to the
//! coupling summed across the line that joins them; a node in the middle of four solves its own equation. Thus a node that is coupled
//! to nothing (a constrained one) neither gives nor takes, and the correction that is interpolated bends where the coefficients do.
//! The coarse operator is the Galerkin product Pᵀ·A·P, nine coefficients again.

use crate::plane::{Float, Plane};
use crate::stencil::{SELF, STEPS, Stencil, index_of};
use rayon::prelude::*;

/// The weights with which each fine node takes its coarse nodes (I, J), (I+1, J), (I, J+1), (I+1, J+1), I = i/2, J = j/2.
#[derive(Clone, Debug)]
pub struct Interpolation {
    width: usize,
    height: usize,
    weights: Vec<[f32; 4]>,
}

/// Number of coarse nodes along a side of `n` fine ones.
fn halved(n: usize) -> usize {
    n.div_ceil(2)
}

impl Interpolation {
    /// The interpolation that `fine` implies.
    pub fn of(fine: &Stencil<f32>) -> Interpolation {
        let (width, height) = (fine.width(), fine.height());
        let mut weights = vec![[0.0; 4]; width * height];
        let row = |j: usize, line: &mut [[f32; 4]], of_lines: &dyn Fn(usize, usize) -> [f32; 4]| {
            for (i, to) in line.iter_mut().enumerate() {
                *to = of_lines(i, j);
            }
        };
        // Nodes on coarse lines first; nodes in the middle of four are made of them.
        let on_lines = |i: usize, j: usize| match (i % 2, j % 2) {
            (0, 0) => [1.0, 0.0, 0.0, 0.0],
            (1, 0) => {
                let [west, east] = between(fine.at(i, j), |x, y| (x, y));
                [west, east, 0.0, 0.0]
            }
            (0, _) => {
                let [south, north] = between(fine.at(i, j), |x, y| (y, x));
                [south, 0.0, north, 0.0]
            }
            _ => [0.0; 4],
        };
        weights.par_chunks_mut(width).enumerate().for_each(|(j, line)| row(j, line, &on_lines));
        let lines = weights.clone();
        let in_the_middle = |i: usize, j: usize| {
            let a = fine.at(i, j);
            let mut sums = [0.0f32; 4];
            for (k, (x, y)) in STEPS.into_iter().enumerate() {
                if k == SELF || a[k] == 0.0 {
                    continue;
                }
                // A non-zero coefficient points into the raster.
                let (p, q) = ((i as isize + x) as usize, (j as isize + y) as usize);
                for (parent, weight) in lines[q * width + p].into_iter().enumerate() {
                    if weight != 0.0 {
                        let (px, py) = (p / 2 + parent % 2 - i / 2, q / 2 + parent / 2 - j / 2);
                        sums[2 * py + px] -= a[k] * weight;
                    }
                }
            }
            if a[SELF] > 0.0 { sums.map(|sum| sum / a[SELF]) } else { [0.0; 4] }
        };
        weights.par_chunks_mut(width).enumerate().filter(|(j, _)| j % 2 == 1).for_each(|(j, line)| {
            for (i, to) in line.iter_mut().enumerate().skip(1).step_by(2) {
                *to = in_the_middle(i, j);
            }
        });
        Interpolation { width, height, weights }
    }

    fn at(&self, i: usize, j: usize) -> [f32; 4] {
        self.weights[j * self.width + i]
    }

    /// The Galerkin operator Pᵀ·A·P.
    pub fn coarse_operator(&self, fine: &Stencil<f32>) -> Stencil<f32> {
        Stencil::new(halved(self.width), halved(self.height), |ci, cj| {
            let mut row = [0.0f64; 9];
            for (x, y) in STEPS {
                let (Some(i), Some(j)) = ((2 * ci).checked_add_signed(x), (2 * cj).checked_add_signed(y)) else {
                    continue;
                };
                if i >= self.width || j >= self.height {
                    continue;
                }
                let mine = f64::from(self.at(i, j)[2 * (cj - j / 2) + (ci - i / 2)]);
                if mine == 0.0 {
                    continue;
                }
                for (k, (dx, dy)) in STEPS.into_iter().enumerate() {
                    let a = f64::from(fine.at(i, j)[k]);
                    if a == 0.0 {
                        continue;
                    }
                    let (p, q) = ((i as isize + dx) as usize, (j as isize + dy) as usize);
                    for (parent, weight) in self.at(p, q).into_iter().enumerate() {
                        if weight != 0.0 {
                            let step = (p / 2 + parent % 2, q / 2 + parent / 2);
                            let step = (step.0 as isize - ci as isize, step.1 as isize - cj as isize);
                            row[index_of(step)] += mine * a * f64::from(weight);
                        }
                    }
                }
            }
            row
        })
    }

    /// `coarse` = Pᵀ·`fine`.
    pub fn restrict<T: Float, const K: usize>(&self, fine: &Plane<T, K>, coarse: &mut Plane<T, K>) {
        let coarse_width = coarse.width();
        coarse.update(|cj, row| {
            for ci in 0..coarse_width {
                let mut total = [T::default(); K];
                for (x, y) in STEPS {
                    let (Some(i), Some(j)) = ((2 * ci).checked_add_signed(x), (2 * cj).checked_add_signed(y)) else {
                        continue;
                    };
                    if i < self.width && j < self.height {
                        let weight = T::of(f64::from(self.at(i, j)[2 * (cj - j / 2) + (ci - i / 2)]));
                        let value = fine.padded_row(j as isize)[i + 1];
                        total = std::array::from_fn(|k| total[k] + weight * value[k]);
                    }
                }
                row[ci + 1] = total;
            }
        });
    }

    /// `fine` += P·`coarse`.
    pub fn add_to<T: Float, const K: usize>(&self, coarse: &Plane<T, K>, fine: &mut Plane<T, K>) {
        fine.update(|j, row| {
            let cj = (j / 2) as isize;
            let (south, north) = (coarse.padded_row(cj), coarse.padded_row(cj + 1));
            for (i, weights) in self.weights[j * self.width..][..self.width].iter().enumerate() {
                let w = weights.map(|weight| T::of(f64::from(weight)));
                let ci = i / 2 + 1;
                row[i + 1] = std::array::from_fn(|k| {
                    let pairs = w[0] * south[ci][k] + w[1] * south[ci + 1][k];
                    row[i + 1][k] + pairs + (w[2] * north[ci][k] + w[3] * north[ci + 1][k])
                });
            }
        });
    }
}

/// The weights of a node on a coarse line for the coarse nodes before and after it; `turn` maps (along, across) to (east, north).
fn between(a: &[f32; 9], turn: impl Fn(isize, isize) -> (isize, isize)) -> [f32; 2] {
    let across = |along: isize| [-1, 0, 1].map(|y| a[index_of(turn(along, y))]).iter().sum::<f32>();
    let (before, here, after) = (across(-1), across(0), across(1));
    // Rows of Galerkin products may sum to less than they couple; then the couplings share the node between them.
    let whole = here.max(-(before + after));
    if whole > 0.0 { [-before / whole, -after / whole] } else { [0.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laplace(width: usize, height: usize, pinned: &[(usize, usize)]) -> Stencil<f32> {
        let free = |i: usize, j: usize| !pinned.contains(&(i, j));
        Stencil::new(width, height, |i, j| {
            let mut row = [0.0; 9];
            if !free(i, j) {
                row[SELF] = 1.0;
                return row;
            }
            for (x, y) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let Some((p, q)) = i.checked_add_signed(x).zip(j.checked_add_signed(y)) else { continue };
                if p < width && q < height {
                    row[SELF] += 1.0;
                    if free(p, q) {
                        row[index_of((x, y))] = -1.0;
                    }
                }
            }
            row
        })
    }

    #[test]
    fn constants_are_interpolated_away_from_constraints_and_constraints_take_nothing() {
        for (w, h) in [(9, 9), (8, 6), (7, 10)] {
            let p = Interpolation::of(&laplace(w, h, &[(3, 3)]));
            for j in 0..h {
                for i in 0..w {
                    let total: f32 = p.at(i, j).iter().sum();
                    let near = i.abs_diff(3) + j.abs_diff(3) <= 2;
                    if i == 3 && j == 3 {
                        assert_eq!(total, 0.0, "odd constrained node of {w} × {h}");
                    } else if !near {
                        assert!((total - 1.0).abs() < 1e-6, "({i}, {j}) of {w} × {h}: {total}");
                    }
                    assert!(p.at(i, j).iter().all(|weight| (0.0..=1.0).contains(weight)));
                }
            }
        }
    }

    #[test]
    fn coarse_operator_is_the_triple_product() {
        let fine = laplace(7, 6, &[(2, 2), (5, 1)]);
        let p = Interpolation::of(&fine);
        let coarse = p.coarse_operator(&fine);
        assert!(coarse.is_symmetric(1e-6));
        // Column by column: A_c·e = Pᵀ(A(P·e)).
        for cj in 0..coarse.height() {
            for ci in 0..coarse.width() {
                let mut unit = Plane::<f64, 1>::new(coarse.width(), coarse.height());
                unit.set(ci, cj, [1.0]);
                let mut up = Plane::new(7, 6);
                p.add_to(&unit, &mut up);
                let mut image = Plane::new(7, 6);
                fine.convert().residual(&up, None, &mut image);
                let mut down = Plane::new(coarse.width(), coarse.height());
                p.restrict(&image, &mut down);
                let mut direct = Plane::new(coarse.width(), coarse.height());
                coarse.convert().residual(&unit, None, &mut direct);
                for j in 0..coarse.height() {
                    for i in 0..coarse.width() {
                        assert!((down.at(i, j)[0] - direct.at(i, j)[0]).abs() < 1e-6);
                    }
                }
            }
        }
    }
}
