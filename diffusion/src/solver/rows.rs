//! What the cycle asks of the operator of a level.

use crate::plane::Float;

/// Where each coefficient points: (east, north) steps, the node itself in the middle.
pub const STEPS: [(isize, isize); 9] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
/// The index of the node itself.
pub const SELF: usize = 4;
/// The index of the coefficient that points along `step`.
pub const fn index_of((x, y): (isize, isize)) -> usize {
    (3 * (y + 1) + x + 1) as usize
}

/// An operator A, read row by row. Rows of values are padded by one node to each side; of nodes whose value is given A·x is 0.
pub trait Rows: Sync {
    /// Nodes from west to east.
    fn width(&self) -> usize;
    /// Rows from south to north.
    fn height(&self) -> usize;
    /// 1 / the coefficient of each node itself in row `j`; 0 where the value is given.
    fn inverse(&self, j: usize) -> &[f32];
    /// A·x on row `j`, from the row to the south, itself and the row to the north.
    fn product<T: Float>(&self, j: usize, beside: [&[T]; 3], out: &mut [T]);
    /// Gauss–Seidel for A·x = b over the nodes of row `j` that carry values along a direction, from one end or the other.
    fn sweep(&self, j: usize, from_east: bool, b: &[f32], beside: [&[f32]; 2], row: &mut [f32]);
    /// The coefficients of row `j` between nodes whose value is not given; nodes whose value is given have 1 for themselves alone.
    fn coefficients(&self, j: usize, out: &mut [[f32; 9]]);
    /// Which nodes of row `j` carry values along a direction.
    fn follows(&self, j: usize, out: &mut [bool]);
    /// Which nodes of row `j` have the plain Laplacian of four neighbours, none of which is given or outside.
    fn uniform(&self, j: usize, out: &mut [bool]);
}
