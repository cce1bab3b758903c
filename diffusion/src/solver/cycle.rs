//! One V(1,1) cycle of black-box multigrid in `f32`: the preconditioner of the Krylov methods. Sweeps before the coarse correction run
//! forward, those after it backward, so that the cycle of a symmetric operator is symmetric, as conjugate gradients need.

use super::dense::Factors;
use super::interpolation::Interpolation;
use crate::plane::Plane;
use crate::stencil::{SELF, Stencil};
use rayon::prelude::*;

/// How a level is relaxed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoother {
    /// Gauss–Seidel in four colours, red before black, rows in parallel: for symmetric operators.
    FourColours,
    /// Gauss–Seidel from each corner in turn, row by row: for operators that carry values along a direction.
    FourDirections,
}

/// Below this many nodes along the shorter side the operator is factored.
const COARSEST: usize = 5;

/// See the module. `K` fields are relaxed together, since they share the operator.
#[derive(Clone, Debug)]
pub struct Cycle<const K: usize> {
    smoother: Smoother,
    levels: Vec<Level<K>>,
    coarsest: Factors,
}

#[derive(Clone, Debug)]
struct Level<const K: usize> {
    operator: Stencil<f32>,
    /// 1 / the coefficient of the node itself.
    inverse: Vec<f32>,
    /// To the next coarser level; the coarsest has none.
    interpolation: Option<Interpolation>,
    x: Plane<f32, K>,
    b: Plane<f32, K>,
    rest: Plane<f32, K>,
}

impl<const K: usize> Level<K> {
    fn new(operator: Stencil<f32>, interpolation: Option<Interpolation>) -> Level<K> {
        let (width, height) = (operator.width(), operator.height());
        let inverse =
            (0..height).into_par_iter().flat_map_iter(|j| operator.line(j).iter().map(|a| 1.0 / a[SELF])).collect();
        let plane = || Plane::new(width, height);
        Level { inverse, interpolation, x: plane(), b: plane(), rest: plane(), operator }
    }

    fn relax(&mut self, smoother: Smoother, forward: bool) {
        let (width, height) = (self.operator.width(), self.operator.height());
        let Level { operator, inverse, x, b, .. } = self;
        let node = |i: usize, j: usize, south: &[[f32; K]], row: &mut [[f32; K]], north: &[[f32; K]]| {
            let a = operator.at(i, j);
            let (inverse, b) = (inverse[j * width + i], b.padded_row(j as isize)[i + 1]);
            // The node's own term is left out of the sum.
            let own = row[i + 1];
            let product = crate::stencil::dot(a, i, south, row, north);
            row[i + 1] = std::array::from_fn(|k| own[k] + (b[k] - product[k]) * inverse);
        };
        match smoother {
            Smoother::FourColours => {
                // (odd row, odd column): the red ones of a chessboard, then the black ones.
                let colours = [(false, 0), (true, 1), (false, 1), (true, 0)];
                for k in 0..colours.len() {
                    let (odd, first) = colours[if forward { k } else { colours.len() - 1 - k }];
                    x.update_parity(odd, |j, row, beside| {
                        for i in (first..width).step_by(2) {
                            node(i, j, beside.south(), row, beside.north());
                        }
                    });
                }
            }
            Smoother::FourDirections => {
                let corners = [(true, true), (false, false), (true, false), (false, true)];
                for k in 0..corners.len() {
                    let (east, north) = corners[if forward { k } else { corners.len() - 1 - k }];
                    for k in 0..height {
                        let j = if north { k } else { height - 1 - k };
                        x.update_row(j, |row, beside| {
                            let (south, north) = (beside.south(), beside.north());
                            if east {
                                (0..width).for_each(|i| node(i, j, south, row, north));
                            } else {
                                (0..width).rev().for_each(|i| node(i, j, south, row, north));
                            }
                        });
                    }
                }
            }
        }
    }
}

/// The coarsest operator cannot be inverted: nothing holds the field.
#[derive(Debug, thiserror::Error)]
#[error("the coarsest operator is singular: some part of the field is held by no value")]
pub struct Singular;

impl<const K: usize> Cycle<K> {
    /// The hierarchy below `finest`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn new(finest: Stencil<f32>, smoother: Smoother) -> Result<Cycle<K>, Singular> {
        let mut levels = Vec::new();
        let mut operator = finest;
        while operator.width().min(operator.height()) > COARSEST {
            let interpolation = Interpolation::of(&operator);
            let coarse = interpolation.coarse_operator(&operator);
            levels.push(Level::new(operator, Some(interpolation)));
            operator = coarse;
        }
        let coarsest = Factors::of(&operator).ok_or(Singular)?;
        levels.push(Level::new(operator, None));
        Ok(Cycle { smoother, levels, coarsest })
    }

    /// `correction` ≈ A⁻¹·`residual`.
    pub fn apply(&mut self, residual: &Plane<f64, K>, correction: &mut Plane<f64, K>) {
        self.levels[0].b.assign(residual);
        self.descend(0);
        correction.assign(&self.levels[0].x);
    }

    /// Solves level `l` for its `b`, from x = 0, by one cycle.
    fn descend(&mut self, l: usize) {
        let smoother = self.smoother;
        if l + 1 == self.levels.len() {
            let level = &mut self.levels[l];
            self.coarsest.solve(&level.b, &mut level.x);
            return;
        }
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &mut coarse[0]);
        level.x.clear();
        level.relax(smoother, true);
        level.operator.residual(&level.x, Some(&level.b), &mut level.rest);
        if let Some(interpolation) = &level.interpolation {
            interpolation.restrict(&level.rest, &mut next.b);
        }
        self.descend(l + 1);
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &coarse[0]);
        if let Some(interpolation) = &level.interpolation {
            interpolation.add_to(&next.x, &mut level.x);
        }
        level.relax(smoother, false);
    }
}
