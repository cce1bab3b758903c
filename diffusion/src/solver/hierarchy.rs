//! The operators below an operator, each with the interpolation that leads to it, and the coarsest one factored: all that a cycle
//! knows before it has a residual. An executor that is not the processor reads it as plain arrays.

use super::cycle::Singular;
use super::dense::Factors;
use super::equations::Equations;
use super::interpolation::Interpolation;
use super::rows::Rows;
use super::stencil::Stencil;

/// With no more nodes than this along the shorter side an operator is factored.
pub const SHORTEST: usize = 5;

/// See the module.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    /// From the finest operator to the first of `operators`, and from each of these to the next.
    pub(super) interpolations: Vec<Interpolation>,
    pub(super) operators: Vec<Stencil>,
    pub(super) coarsest: Factors,
}

/// The weights with which the nodes of a level take the coarse nodes around them; rows of coarse nodes from the south. Coarse nodes are
/// those with both indices even, and take themselves.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a> {
    /// For each coarse row four arrays of its nodes I: of (2I+1, 2J) for the coarse nodes to the west and to the east, of (2I, 2J+1) for
    /// those to the south and to the north.
    pub lines: &'a [f32],
    /// For each coarse row four arrays: of (2I+1, 2J+1) for those to the south-west, south-east, north-west and north-east.
    pub middles: &'a [f32],
}

/// An operator below the finest.
#[derive(Clone, Copy, Debug)]
pub struct Operator<'a> {
    /// Nodes from west to east.
    pub width: usize,
    /// Rows from south to north.
    pub height: usize,
    /// For each row nine arrays of coefficients, from that of the neighbour to the south-west, row by row; 0 where one points out of the
    /// raster.
    pub coefficients: &'a [f32],
    /// 1 / the coefficient of the node itself; 0 where the value is given.
    pub inverse: &'a [f32],
    /// Which nodes carry values along a direction.
    pub directed: &'a [bool],
}

impl Hierarchy {
    /// The hierarchy below `finest`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn new(finest: &Equations) -> Result<Hierarchy, Singular> {
        // Even a small raster has one coarser: only that can be factored.
        let interpolation = Interpolation::of(finest);
        let mut operators = vec![interpolation.coarse_operator(finest)];
        let mut interpolations = vec![interpolation];
        let mut last = &operators[0];
        while last.width().min(last.height()) > SHORTEST {
            let interpolation = Interpolation::of(last);
            let next = interpolation.coarse_operator(last);
            interpolations.push(interpolation);
            operators.push(next);
            last = &operators[operators.len() - 1];
        }
        let coarsest = Factors::of(last).ok_or(Singular)?;
        Ok(Hierarchy { interpolations, operators, coarsest })
    }
    /// From the finest level to the next, and so on: as many as there are operators.
    pub fn weights(&self) -> impl ExactSizeIterator<Item = Weights<'_>> {
        self.interpolations.iter().map(Interpolation::weights)
    }
    /// The operators below the finest, finer ones first.
    pub fn operators(&self) -> impl ExactSizeIterator<Item = Operator<'_>> {
        self.operators.iter().map(Stencil::arrays)
    }
    /// The inverse of the last operator, row by row; nodes are numbered row by row from the south.
    pub fn coarsest_inverse(&self) -> Vec<f32> {
        self.coarsest.inverse()
    }
}
