//! One V(1,1) cycle of black-box multigrid in `f32`: the preconditioner of the Krylov methods. Sweeps before the coarse correction run
//! forward, those after it backward, so that the cycle of a symmetric operator is symmetric, as conjugate gradients need.

use super::dense::Factors;
use super::equations::Equations;
use super::hierarchy::Hierarchy;
use super::interpolation::Interpolation;
use super::rows::Rows;
use super::stencil::Stencil;
use crate::plane::{Plane, wide};

/// How a level is relaxed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoother {
    /// Gauss–Seidel in four colours, red before black, rows in parallel: for symmetric operators.
    FourColours,
    /// That twice, before and after: it smooths along directions too, if less, and needs no order of nodes within a colour. Adapters
    /// relax so.
    FourColoursTwice,
    /// Four colours, and Gauss–Seidel from each corner in turn over the nodes that carry values along a direction.
    FourDirections,
}

/// Bands of rows in which values are carried along a direction, each beside the others.
const BANDS: usize = 8;

/// See the module. `K` fields are relaxed together, since they share the operator.
#[derive(Clone, Debug)]
pub struct Cycle<'a, const K: usize> {
    smoother: Smoother,
    finest: &'a Equations,
    fine: Level<K>,
    coarse: Vec<(Stencil, Level<K>)>,
    coarsest: Factors,
}

/// What a level works on.
#[derive(Clone, Debug)]
struct Level<const K: usize> {
    /// To the next coarser level; the coarsest has none.
    interpolation: Option<Interpolation>,
    x: Plane<f32, K>,
    b: Plane<f32, K>,
    rest: Plane<f32, K>,
}

impl<const K: usize> Level<K> {
    fn new(operator: &impl Rows, interpolation: Option<Interpolation>) -> Level<K> {
        let plane = || Plane::new(operator.width(), operator.height());
        Level { interpolation, x: plane(), b: plane(), rest: plane() }
    }

    /// x ← x + (b − A·x) / diagonal over the nodes of row parity `odd` and column parity `first`.
    fn relax_colour(&mut self, operator: &impl Rows, odd: bool, first: usize) {
        let (width, b) = (operator.width(), &self.b);
        self.x.update_parity(odd, |j, fields, beside, product| {
            product.resize(width, 0.0);
            let (inverse, product) = (&operator.inverse(j)[..width], &mut product[..width]);
            for (k, row) in fields.into_iter().enumerate() {
                operator.product(j, [beside.south(k), &*row, beside.north(k)], product);
                let (x, b) = (&mut row[1..=width], &b.row(j as isize, k)[1..=width]);
                wide(
                    #[inline(always)]
                    || {
                        // All are computed and every other one is kept: that is wider than picking them out.
                        for i in 0..width {
                            let change = (b[i] - product[i]) * inverse[i];
                            x[i] += if i & 1 == first { change } else { 0.0 };
                        }
                    },
                );
            }
        });
    }
    /// The first colour from x = 0.
    fn start(&mut self, operator: &impl Rows) {
        let b = &self.b;
        self.x.update(|j, fields, _| {
            let inverse = operator.inverse(j);
            for (k, row) in fields.into_iter().enumerate() {
                row.fill(0.0);
                if j % 2 == 0 {
                    let nodes = row[1..].iter_mut().zip(&b.row(j as isize, k)[1..]).zip(inverse);
                    wide(
                        #[inline(always)]
                        || {
                            nodes
                                .enumerate()
                                .for_each(|(i, ((x, b), inverse))| *x = if i & 1 == 0 { b * inverse } else { 0.0 })
                        },
                    );
                }
            }
        });
    }
    /// Gauss–Seidel from one corner over the nodes that carry values along a direction.
    fn sweep(&mut self, operator: &impl Rows, from_east: bool, from_north: bool) {
        let b = &self.b;
        // Bands are of the raster and not of the threads.
        let rows = operator.height().div_ceil(2 * BANDS) * 2;
        self.x.update_bands(rows, |band| {
            for step in 0..band.rows().len() {
                let j = if from_north { band.rows().end - 1 - step } else { band.rows().start + step };
                band.update(j, |fields, [south, north]| {
                    for (k, row) in fields.into_iter().enumerate() {
                        operator.sweep(j, from_east, b.row(j as isize, k), [south[k], north[k]], row);
                    }
                });
            }
        });
    }
    fn relax(&mut self, operator: &impl Rows, smoother: Smoother, forward: bool) {
        // (odd row, odd column): the red ones of a chessboard, then the black ones.
        let colours = [(false, 0), (true, 1), (false, 1), (true, 0)];
        let corners = [(false, false), (true, true), (false, true), (true, false)];
        let colour = |level: &mut Level<K>, (odd, first)| level.relax_colour(operator, odd, first);
        let corner = |level: &mut Level<K>, (east, north)| level.sweep(operator, east, north);
        let directions = smoother == Smoother::FourDirections;
        let twice = smoother == Smoother::FourColoursTwice;
        if forward {
            // `start` did the first.
            colours.into_iter().skip(1).for_each(|at| colour(self, at));
            colours.into_iter().filter(|_| twice).for_each(|at| colour(self, at));
            // Before the coarse correction alone: after it as well they cost more than they save.
            corners.into_iter().filter(|_| directions).for_each(|at| corner(self, at));
        } else {
            colours.into_iter().rev().filter(|_| twice).for_each(|at| colour(self, at));
            colours.into_iter().rev().for_each(|at| colour(self, at));
        }
    }
    /// Relaxes from x = 0 and gives the coarse level what is left.
    fn before(&mut self, operator: &impl Rows, smoother: Smoother, coarse: &mut Plane<f32, K>) {
        self.start(operator);
        self.relax(operator, smoother, true);
        let Level { interpolation, x, b, rest } = self;
        let width = operator.width();
        rest.update(|j, fields, _| {
            for (k, row) in fields.into_iter().enumerate() {
                let row = &mut row[1..=width];
                operator.product(j, x.beside(j, k), row);
                wide(
                    #[inline(always)]
                    || row.iter_mut().zip(&b.row(j as isize, k)[1..]).for_each(|(rest, b)| *rest = b - *rest),
                );
            }
        });
        interpolation.iter().for_each(|interpolation| interpolation.restrict(rest, coarse));
    }
    /// Adds the coarse correction and relaxes.
    fn after(&mut self, operator: &impl Rows, smoother: Smoother, coarse: &Plane<f32, K>) {
        let Level { interpolation, x, .. } = self;
        if let Some(interpolation) = interpolation {
            x.update(|j, fields, _| {
                fields.into_iter().enumerate().for_each(|(k, row)| interpolation.add_row(coarse, j, k, row));
            });
        }
        self.relax(operator, smoother, false);
    }
    fn bytes(&self) -> usize {
        let interpolation = self.interpolation.as_ref().map_or(0, Interpolation::bytes);
        interpolation + self.x.bytes() + self.b.bytes() + self.rest.bytes()
    }
}

/// The coarsest operator cannot be inverted: nothing holds the field.
#[derive(Debug, thiserror::Error)]
#[error("the coarsest operator is singular: some part of the field is held by no value")]
pub struct Singular;

impl<'a, const K: usize> Cycle<'a, K> {
    /// The hierarchy below `finest`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn new(finest: &'a Equations, smoother: Smoother) -> Result<Cycle<'a, K>, Singular> {
        let Hierarchy { interpolations, operators, coarsest } = Hierarchy::new(finest)?;
        let mut interpolations = interpolations.into_iter();
        let fine = Level::new(finest, interpolations.next());
        let coarse = operators
            .into_iter()
            .map(|operator| {
                let level = Level::new(&operator, interpolations.next());
                (operator, level)
            })
            .collect();
        Ok(Cycle { smoother, finest, fine, coarse, coarsest })
    }
    /// What is to be corrected: the residual is written here.
    pub fn residual(&mut self) -> &mut Plane<f32, K> {
        &mut self.fine.b
    }
    /// The residual, and the correction A⁻¹·residual, nearly.
    pub fn correction(&self) -> (&Plane<f32, K>, &Plane<f32, K>) {
        (&self.fine.b, &self.fine.x)
    }
    /// What it takes, bytes.
    pub fn bytes(&self) -> usize {
        let coarse: usize = self.coarse.iter().map(|(operator, level)| operator.bytes() + level.bytes()).sum();
        self.fine.bytes() + coarse
    }

    /// Corrects for the residual by one cycle from 0.
    pub fn apply(&mut self) {
        let smoother = self.smoother;
        self.fine.before(self.finest, smoother, &mut self.coarse[0].1.b);
        let last = self.coarse.len() - 1;
        for l in 0..last {
            let (fine, coarse) = self.coarse.split_at_mut(l + 1);
            let (operator, level) = &mut fine[l];
            level.before(operator, smoother, &mut coarse[0].1.b);
        }
        let Level { x, b, .. } = &mut self.coarse[last].1;
        self.coarsest.solve(b, x);
        for l in (0..last).rev() {
            let (fine, coarse) = self.coarse.split_at_mut(l + 1);
            let (operator, level) = &mut fine[l];
            level.after(operator, smoother, &coarse[0].1.x);
        }
        self.fine.after(self.finest, smoother, &self.coarse[0].1.x);
    }
}
