//! Maps of the ground read between their samples.

use glam::DVec2;
use terrain_model::grid::Grid;

/// The bilinear value at `p`; off the grid that of its border.
pub fn bilinear(grid: &Grid<f32>, p: DVec2) -> f64 {
    let last = DVec2::new(grid.width() as f64 - 1.0, grid.height() as f64 - 1.0);
    let at = ((p - grid.origin()) / grid.spacing()).clamp(DVec2::ZERO, last);
    let (i, j) = (at.x as usize, at.y as usize);
    let (east, north) = ((i + 1).min(grid.width() - 1), (j + 1).min(grid.height() - 1));
    let value = |i: usize, j: usize| f64::from(grid.values()[j * grid.width() + i]);
    let t = at - DVec2::new(i as f64, j as f64);
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    mix(mix(value(i, j), value(east, j), t.x), mix(value(i, north), value(east, north), t.x), t.y)
}

/// The largest value that [`bilinear`] has over a rectangle that lies within one cell, or larger.
pub fn largest(grid: &Grid<f32>, low: DVec2, high: DVec2) -> f64 {
    let last = DVec2::new(grid.width() as f64 - 1.0, grid.height() as f64 - 1.0);
    let at = |p: DVec2| (p - grid.origin()) / grid.spacing();
    // A rectangle that is the cell may reach beyond it by its rounding.
    let from = (at(low) + 1e-6).floor().clamp(DVec2::ZERO, last);
    let to = (at(high) - 1e-6).ceil().clamp(from, last);
    let mut most = f32::NEG_INFINITY;
    for j in from.y as usize..=to.y as usize {
        for i in from.x as usize..=to.x as usize {
            most = most.max(grid.values()[j * grid.width() + i]);
        }
    }
    most.into()
}

/// Other values over the same ground.
///
/// # Panics
/// When there are not as many.
pub fn shaped<S, T>(like: &Grid<S>, values: Vec<T>) -> Grid<T> {
    let grid = Grid::new(like.origin(), like.spacing(), like.width(), like.height(), values);
    grid.expect("as many values over a place that exists")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_met_and_between_them_the_value_is_linear_along_each_axis() {
        let grid = Grid::new(DVec2::new(10.0, 20.0), DVec2::new(2.0, 4.0), 2, 2, vec![1.0f32, 3.0, 5.0, 9.0]).unwrap();
        let at = |x: f64, y: f64| bilinear(&grid, DVec2::new(x, y));
        assert_eq!([at(10.0, 20.0), at(12.0, 20.0), at(10.0, 24.0), at(12.0, 24.0)], [1.0, 3.0, 5.0, 9.0]);
        assert_eq!(at(11.0, 22.0), 4.5);
        assert_eq!([at(-5.0, 0.0), at(99.0, 99.0)], [1.0, 9.0]);
    }
}
