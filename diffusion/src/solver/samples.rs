//! Small systems that several tests solve.

use super::guided::{Constraint, Slope};

/// What is wanted of nodes, by row, with their columns.
pub(super) type Wanted = Vec<Vec<(u32, Constraint)>>;

/// What is wanted of `n` × `n` nodes.
pub(super) fn rows(n: usize, constraint: impl Fn(usize, usize) -> Constraint) -> Wanted {
    (0..n).map(|j| (0..n).map(|i| (i as u32, constraint(i, j))).collect()).collect()
}

/// A plane over `n` × `n` nodes 2 m apart that rises by `rise` along a direction: given on the border, asked for as a slope inside; and
/// the plane.
pub(super) fn plane(n: usize, degrees: f64, rise: f64) -> (Wanted, impl Fn(usize, usize) -> f64) {
    let radians = degrees.to_radians();
    let along = [libm::cos(radians), libm::sin(radians)];
    let plane = move |i: usize, j: usize| rise * (along[0] * i as f64 + along[1] * j as f64) * 2.0 + 50.0;
    let border = |i: usize, j: usize| i == 0 || j == 0 || i == n - 1 || j == n - 1;
    let constraint = |i: usize, j: usize| {
        if border(i, j) {
            Constraint::Elevation(plane(i, j))
        } else {
            Constraint::Slope(Slope::along(along, rise).unwrap())
        }
    };
    (rows(n, constraint), plane)
}
