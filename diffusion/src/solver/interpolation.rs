//! Interpolation that follows the operator, and the coarse operator it implies (Dendy 1982, black-box multigrid).
//!
//! Coarse nodes are the fine ones with both indices even. A fine node between two coarse ones takes them in proportion to the
//! coupling summed across the line that joins them; a node in the middle of four solves its own equation. Thus a node that is coupled
//! to nothing (one whose value is given) neither gives nor takes, and the correction that is interpolated bends where the coefficients
//! do. The coarse operator is the Galerkin product Pᵀ·A·P, nine coefficients again.

use super::hierarchy::Weights;
use super::rows::{Rows, SELF, STEPS, index_of};
use super::stencil::Stencil;
use crate::plane::{Plane, wide};
use rayon::prelude::*;

/// The weights with which the fine nodes (2I+1, 2J), (2I, 2J+1), (2I+1, 2J+1) take the coarse nodes around them, eight
/// arrays for each coarse row J.
#[derive(Clone, Debug)]
pub(super) struct Interpolation {
    width: usize,
    height: usize,
    coarse_width: usize,
    /// On lines of coarse nodes: west, east; south, north. A coarse node takes itself.
    lines: Vec<f32>,
    /// Between lines: south-west, south-east, north-west, north-east.
    middles: Vec<f32>,
}

const LINES: usize = 4;
const MIDDLES: usize = 4;

/// Number of coarse nodes along a side of `n` fine ones.
fn halved(n: usize) -> usize {
    n.div_ceil(2)
}

impl Interpolation {
    /// The interpolation that `fine` implies.
    pub(super) fn of(fine: &impl Rows) -> Interpolation {
        let (width, height) = (fine.width(), fine.height());
        let (coarse_width, coarse_height) = (halved(width), halved(height));
        let mut lines = vec![0.0; LINES * coarse_width * coarse_height];
        let buffer = || vec![[0.0f32; 9]; width];
        lines.par_chunks_mut(LINES * coarse_width).enumerate().for_each_init(buffer, |nodes, (cj, to)| {
            fine.coefficients(2 * cj, nodes);
            for ci in 0..coarse_width {
                if 2 * ci + 1 < width {
                    [to[ci], to[coarse_width + ci]] = between(&nodes[2 * ci + 1], |x, y| (x, y));
                }
            }
            if 2 * cj + 1 < height {
                fine.coefficients(2 * cj + 1, nodes);
                for ci in 0..coarse_width {
                    [to[2 * coarse_width + ci], to[3 * coarse_width + ci]] = between(&nodes[2 * ci], |x, y| (y, x));
                }
            }
        });
        let mut result = Interpolation { width, height, coarse_width, lines, middles: Vec::new() };
        let mut middles = vec![0.0; MIDDLES * coarse_width * coarse_height];
        middles.par_chunks_mut(MIDDLES * coarse_width).enumerate().for_each_init(buffer, |nodes, (cj, to)| {
            if 2 * cj + 1 < height {
                fine.coefficients(2 * cj + 1, nodes);
                for ci in 0..width / 2 {
                    let weights = result.middle(2 * ci + 1, 2 * cj + 1, &nodes[2 * ci + 1]);
                    (0..MIDDLES).for_each(|k| to[k * coarse_width + ci] = weights[k]);
                }
            }
        });
        result.middles = middles;
        result
    }

    /// The weights of a node in the middle of four, made of those on the lines around it.
    fn middle(&self, i: usize, j: usize, a: &[f32; 9]) -> [f32; 4] {
        let mut sums = [0.0f32; 4];
        for (k, (x, y)) in STEPS.into_iter().enumerate() {
            if k == SELF || a[k] == 0.0 {
                continue;
            }
            // A non-zero coefficient points into the raster.
            let (p, q) = ((i as isize + x) as usize, (j as isize + y) as usize);
            for (parent, weight) in self.on_lines(p, q).into_iter().enumerate() {
                if weight != 0.0 {
                    let (px, py) = (p / 2 + parent % 2 - i / 2, q / 2 + parent / 2 - j / 2);
                    sums[2 * py + px] -= a[k] * weight;
                }
            }
        }
        if a[SELF] > 0.0 { sums.map(|sum| sum / a[SELF]) } else { [0.0; 4] }
    }

    fn line(&self, cj: usize, k: usize) -> &[f32] {
        &self.lines[(LINES * cj + k) * self.coarse_width..][..self.coarse_width]
    }
    fn between_lines(&self, cj: usize, k: usize) -> &[f32] {
        &self.middles[(MIDDLES * cj + k) * self.coarse_width..][..self.coarse_width]
    }
    fn on_lines(&self, i: usize, j: usize) -> [f32; 4] {
        let at = |k: usize| self.line(j / 2, k)[i / 2];
        match (i % 2, j % 2) {
            (0, 0) => [1.0, 0.0, 0.0, 0.0],
            (1, 0) => [at(0), at(1), 0.0, 0.0],
            (0, _) => [at(2), 0.0, at(3), 0.0],
            _ => [0.0; 4],
        }
    }
    /// The weights of a fine node for the coarse nodes (I, J), (I+1, J), (I, J+1), (I+1, J+1), I = i/2, J = j/2.
    fn at(&self, i: usize, j: usize) -> [f32; 4] {
        if i % 2 == 1 && j % 2 == 1 {
            [0, 1, 2, 3].map(|k| self.between_lines(j / 2, k)[i / 2])
        } else {
            self.on_lines(i, j)
        }
    }
    pub(super) fn weights(&self) -> Weights<'_> {
        Weights { lines: &self.lines, middles: &self.middles }
    }
    /// What it takes, bytes.
    pub(super) fn bytes(&self) -> usize {
        4 * (self.lines.len() + self.middles.len())
    }

    /// The Galerkin operator Pᵀ·A·P. A coarse node carries values along a direction if a fine one does that it takes part in.
    pub(super) fn coarse_operator(&self, fine: &impl Rows) -> Stencil {
        Stencil::new(self.coarse_width, halved(self.height), |cj, out, directed| {
            let rows: Vec<usize> = ((2 * cj).saturating_sub(1)..=(2 * cj + 1).min(self.height - 1)).collect();
            let mut lines = vec![vec![[0.0; 9]; self.width]; rows.len()];
            let mut flags = vec![vec![false; self.width]; rows.len()];
            for ((line, flags), &j) in lines.iter_mut().zip(&mut flags).zip(&rows) {
                fine.coefficients(j, line);
                fine.follows(j, flags);
            }
            let uniform = self.uniform(fine, cj);
            for ci in 0..self.coarse_width {
                let columns = (2 * ci).saturating_sub(1)..=(2 * ci + 1).min(self.width - 1);
                directed[ci] = flags.iter().any(|flags| flags[columns.clone()].contains(&true));
                out[ci] = if uniform[ci] {
                    PLAIN
                } else {
                    self.triple(ci, cj, rows.iter().copied().zip(lines.iter().map(Vec::as_slice)))
                };
                if directed[ci] {
                    let inside = |(x, y): (isize, isize)| {
                        ci.checked_add_signed(x).is_some_and(|i| i < self.coarse_width)
                            && cj.checked_add_signed(y).is_some_and(|j| j < halved(self.height))
                    };
                    upwind(&mut out[ci], &inside);
                }
            }
        })
    }

    /// Which coarse nodes of row `cj` have only plain fine nodes within two steps.
    fn uniform(&self, fine: &impl Rows, cj: usize) -> Vec<bool> {
        let mut result = vec![cj > 0 && 2 * cj + 2 < self.height; self.coarse_width];
        if !result[0] {
            return result;
        }
        let mut all = vec![true; self.width];
        let mut row = vec![false; self.width];
        for j in 2 * cj - 2..=2 * cj + 2 {
            fine.uniform(j, &mut row);
            all.iter_mut().zip(&row).for_each(|(all, row)| *all &= row);
        }
        for (ci, uniform) in result.iter_mut().enumerate() {
            *uniform = ci > 0 && 2 * ci + 2 < self.width && all[2 * ci - 2..=2 * ci + 2].iter().all(|all| *all);
        }
        result
    }

    /// The row of coarse node (ci, cj), from the fine rows around it.
    fn triple<'a>(&self, ci: usize, cj: usize, rows: impl Iterator<Item = (usize, &'a [[f32; 9]])>) -> [f32; 9] {
        let mut total = [0.0f64; 9];
        for (j, line) in rows {
            for i in (2 * ci).saturating_sub(1)..=(2 * ci + 1).min(self.width - 1) {
                let mine = f64::from(self.at(i, j)[2 * (cj - j / 2) + (ci - i / 2)]);
                if mine == 0.0 {
                    continue;
                }
                for (k, (dx, dy)) in STEPS.into_iter().enumerate() {
                    let a = f64::from(line[i][k]);
                    if a == 0.0 {
                        continue;
                    }
                    let (p, q) = ((i as isize + dx) as usize, (j as isize + dy) as usize);
                    for (parent, weight) in self.at(p, q).into_iter().enumerate() {
                        if weight != 0.0 {
                            let (x, y) = (p / 2 + parent % 2, q / 2 + parent / 2);
                            let step = (x as isize - ci as isize, y as isize - cj as isize);
                            total[index_of(step)] += mine * a * f64::from(weight);
                        }
                    }
                }
            }
        }
        total.map(|a| a as f32)
    }

    /// `coarse` = Pᵀ·`fine`.
    pub(super) fn restrict<const K: usize>(&self, fine: &Plane<f32, K>, coarse: &mut Plane<f32, K>) {
        let n = self.coarse_width;
        coarse.update(|cj, fields, _| {
            for (k, to) in fields.into_iter().enumerate() {
                let to = &mut to[1..=n];
                // Past the end of an odd width stands the border's 0.
                let row = |j: usize| &fine.row(j as isize, k)[1..=2 * n];
                wide(
                    #[inline(always)]
                    || {
                        to.iter_mut().zip(row(2 * cj).chunks_exact(2)).for_each(|(to, pair)| *to = pair[0]);
                        gather(to, row(2 * cj), None, [0, 1].map(|k| self.line(cj, k)));
                        if 2 * cj + 1 < self.height {
                            let across = [0, 1].map(|k| self.between_lines(cj, k));
                            gather(to, row(2 * cj + 1), Some(self.line(cj, 2)), across);
                        }
                        if cj > 0 {
                            let across = [2, 3].map(|k| self.between_lines(cj - 1, k));
                            gather(to, row(2 * cj - 1), Some(self.line(cj - 1, 3)), across);
                        }
                    },
                );
            }
        });
    }

    /// Adds row `j` of P·`coarse` to a padded fine row.
    pub(super) fn add_row<const K: usize>(&self, coarse: &Plane<f32, K>, j: usize, k: usize, fine: &mut [f32]) {
        let (cj, n) = (j / 2, self.coarse_width);
        let [south, north] = [cj, cj + 1].map(|cj| &coarse.row(cj as isize, k)[1..]);
        // Past the end of an odd width stands the border, to which nothing is added since its weights are 0.
        let fine = &mut fine[1..=2 * n];
        let ([south, south_next], [north, north_next]) = ([&south[..n], &south[1..=n]], [&north[..n], &north[1..=n]]);
        wide(
            #[inline(always)]
            || {
                if j.is_multiple_of(2) {
                    let [west, east] = [0, 1].map(|k| &self.line(cj, k)[..n]);
                    for (i, pair) in fine.chunks_exact_mut(2).enumerate() {
                        pair[0] += south[i];
                        pair[1] += west[i] * south[i] + east[i] * south_next[i];
                    }
                } else {
                    let [down, up] = [2, 3].map(|k| &self.line(cj, k)[..n]);
                    let m: [&[f32]; MIDDLES] = std::array::from_fn(|k| &self.between_lines(cj, k)[..n]);
                    // In two passes: of more arrays the compiler does not prove that they are distinct.
                    for (i, pair) in fine.chunks_exact_mut(2).enumerate() {
                        pair[0] += down[i] * south[i];
                        pair[1] += m[0][i] * south[i] + m[1][i] * south_next[i];
                    }
                    for (i, pair) in fine.chunks_exact_mut(2).enumerate() {
                        pair[0] += up[i] * north[i];
                        pair[1] += m[2][i] * north[i] + m[3][i] * north_next[i];
                    }
                }
            },
        );
    }
}

/// Adds pairs (2I, 2I+1) of a fine row to coarse nodes: the first to I unless it has no weights, the
/// second to I and to I+1.
#[inline(always)]
fn gather(to: &mut [f32], row: &[f32], own: Option<&[f32]>, [here, next]: [&[f32]; 2]) {
    if let Some(own) = own {
        to.iter_mut().zip(row.chunks_exact(2)).zip(own).for_each(|((to, pair), own)| *to += own * pair[0]);
    }
    to.iter_mut().zip(row.chunks_exact(2)).zip(here).for_each(|((to, pair), here)| *to += here * pair[1]);
    let followers = to[1..].iter_mut();
    followers.zip(row.chunks_exact(2)).zip(next).for_each(|((to, pair), next)| *to += next * pair[1]);
}

/// Galerkin products of upwind differences lean to central ones, level by level, which no relaxation smooths. Where a coefficient has come
/// out positive, as much diffusion along its line is added as makes it 0: of (−¾, ½, ¼) along a line this makes (−1, 1, 0), the
/// upwind difference of the coarse raster. Row sums stay.
fn upwind(row: &mut [f32; 9], inside: &impl Fn((isize, isize)) -> bool) {
    for k in (0..9).filter(|k| *k != SELF) {
        if row[k] > 0.0 {
            let excess = std::mem::take(&mut row[k]);
            row[SELF] += excess;
            if inside(STEPS[8 - k]) {
                row[8 - k] -= excess;
                row[SELF] += excess;
            }
        }
    }
}

/// The Galerkin row of the plain Laplacian, far from anything else: ½(−1, 2, −1) ⊗ ¼(1, 6, 1) both ways.
const PLAIN: [f32; 9] = [-0.25, -0.5, -0.25, -0.5, 3.0, -0.5, -0.25, -0.5, -0.25];

/// The weights of a node on a coarse line for the coarse nodes before and after it; `turn` maps (along, across) to (east, north).
fn between(a: &[f32; 9], turn: impl Fn(isize, isize) -> (isize, isize)) -> [f32; 2] {
    let across = |along: isize| [-1, 0, 1].map(|y| a[index_of(turn(along, y))]).iter().sum::<f32>();
    let (before, here, after) = (across(-1), across(0), across(1));
    // Rows of Galerkin products may sum to less than they couple; then the couplings share the node between them.
    let whole = here.max(-(before + after));
    if whole > 0.0 { [-before / whole, -after / whole] } else { [0.0, 0.0] }
}

#[cfg(test)]
#[path = "interpolation_tests.rs"]
mod tests;
