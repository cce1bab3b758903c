//! Slopes of a heightfield, metres a metre: of steepest descent, and the magnitude of the gradient by Horn (1981) or by Evans
//! (1980).

use super::HydrologyError;
use super::flow::distances;
use super::padded::{Elevation, Padded, go, steps};
use glam::DVec2;
use rayon::prelude::*;
use terrain_model::grid::Grid;

/// Which weighted mean of the differences in three rows is a derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gradient {
    /// 1, 2, 1 (Horn 1981): least sensitive to noise that is independent from sample to sample with nearer rows heavier.
    Horn,
    /// 1, 1, 1 (Evans 1980): the least-squares quadric through 3 × 3 samples.
    Evans,
}

impl Gradient {
    fn middle(self) -> f64 {
        match self {
            Gradient::Horn => 2.0,
            Gradient::Evans => 1.0,
        }
    }
}

/// The largest drop a metre towards one of the eight neighbours, 0 where none is lower; NaN, the marker, at no-data.
///
/// # Errors
/// [`HydrologyError`] for a geographic grid, a value that is not finite, or too many samples.
pub fn steepest_descent<T: Elevation>(surface: &Grid<T>) -> Result<Grid<f64>, HydrologyError> {
    let per_metre = distances(surface.spacing()).map(|d| 1.0 / d);
    each(surface, |raster, cell| {
        let own = raster.values[cell];
        let slopes = steps(raster.stride).into_iter().zip(per_metre);
        slopes.map(|(step, per)| (own - raster.values[go(cell, step)]) * per).fold(0.0, f64::max)
    })
}

/// ‖∇z‖; NaN, the marker, at no-data. Exact on planes (up to rounding) wherever a sample has a neighbour along both axes: beside
/// the border and no-data differences are one-sided, and rows of three without one do not count.
///
/// # Errors
/// As [`steepest_descent`].
pub fn gradient_magnitude<T: Elevation>(surface: &Grid<T>, method: Gradient) -> Result<Grid<f64>, HydrologyError> {
    let spacing = surface.spacing();
    each(surface, |raster, cell| gradient(raster, cell, spacing, method).length())
}

/// ∇z at a known cell: along each axis the weighted mean of the differences in the three rows beside it, central where both
/// ends are known, one-sided where one is; rows without a difference do not count, and without any the derivative is 0.
pub(super) fn gradient(raster: &Padded<f64>, cell: usize, spacing: DVec2, method: Gradient) -> DVec2 {
    let along = |step: isize, across: isize, spacing: f64| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (row, weight) in [(-across, 1.0), (0, method.middle()), (across, 1.0)] {
            let middle = go(cell, row);
            if let Some(difference) = difference(raster, middle, step) {
                sum += weight * difference;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / (weights * spacing) } else { 0.0 }
    };
    let across = raster.stride as isize;
    DVec2::new(along(1, across, spacing.x), along(across, 1, spacing.y))
}

/// Change a step, from both ends or from one and the middle.
fn difference(raster: &Padded<f64>, middle: usize, step: isize) -> Option<f64> {
    // A margin cell has no neighbours of its own on the outside.
    if !raster.known[middle] {
        let inside = middle >= step.unsigned_abs() && middle + step.unsigned_abs() < raster.values.len();
        return inside
            .then(|| (go(middle, -step), go(middle, step)))
            .filter(|&(a, b)| raster.known[a] && raster.known[b])
            .map(|(a, b)| 0.5 * (raster.values[b] - raster.values[a]));
    }
    let (before, after) = (go(middle, -step), go(middle, step));
    match (raster.known[before], raster.known[after]) {
        (true, true) => Some(0.5 * (raster.values[after] - raster.values[before])),
        (true, false) => Some(raster.values[middle] - raster.values[before]),
        (false, true) => Some(raster.values[after] - raster.values[middle]),
        (false, false) => None,
    }
}

/// `value` at each known sample, rows in parallel.
pub(super) fn each<T: Elevation>(
    surface: &Grid<T>,
    value: impl Fn(&Padded<f64>, usize) -> f64 + Sync,
) -> Result<Grid<f64>, HydrologyError> {
    let raster = Padded::new(surface, f64::NAN, T::to_f64)?;
    let width = surface.width();
    let mut values = vec![f64::NAN; width * surface.height()];
    values.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
        let start = (j + 1) * raster.stride + 1;
        for (i, out) in row.iter_mut().enumerate() {
            if raster.known[start + i] {
                *out = value(&raster, start + i);
            }
        }
    });
    Ok(surface.with_values(values, Some(f64::NAN)).expect("a value for each sample of the surface"))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{grid, unit};
    use super::*;

    const SPACING: DVec2 = DVec2::new(2.0, 5.0);

    fn worst(values: &Grid<f64>, exact: f64) -> f64 {
        values.values().iter().filter(|v| !v.is_nan()).map(|v| (v - exact).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn gradients_of_a_plane_are_exact_to_the_border_and_beside_holes() {
        let plane = grid(8, 7, SPACING, |i, j| 0.3 * 2.0 * i as f64 - 0.4 * 5.0 * j as f64);
        let mut holes = plane.clone().with_no_data(Some(-999.0));
        holes.values_mut()[3 * 8 + 4] = -999.0;
        for method in [Gradient::Horn, Gradient::Evans] {
            for surface in [&plane, &holes] {
                assert!(worst(&gradient_magnitude(surface, method).unwrap(), 0.5) < 1e-14);
            }
            // Control: a bump is no plane.
            let mut bump = plane.clone();
            bump.values_mut()[20] += 0.1;
            assert!(worst(&gradient_magnitude(&bump, method).unwrap(), 0.5) > 1e-3);
        }
    }

    #[test]
    fn inside_the_two_gradients_are_the_printed_formulas() {
        let rough = grid(3, 3, SPACING, |i, j| unit(4, i, j));
        let z = |i: usize, j: usize| unit(4, i, j);
        let printed = |m: f64| {
            let x = (z(2, 0) + m * z(2, 1) + z(2, 2) - z(0, 0) - m * z(0, 1) - z(0, 2)) / ((4.0 + 2.0 * m) * 2.0);
            let y = (z(0, 2) + m * z(1, 2) + z(2, 2) - z(0, 0) - m * z(1, 0) - z(2, 0)) / ((4.0 + 2.0 * m) * 5.0);
            DVec2::new(x, y).length()
        };
        let at = |method| gradient_magnitude(&rough, method).unwrap().get(1, 1).unwrap();
        assert!((at(Gradient::Horn) - printed(2.0)).abs() < 1e-15);
        assert!((at(Gradient::Evans) - printed(1.0)).abs() < 1e-15);
        assert!((at(Gradient::Evans) - printed(2.0)).abs() > 1e-4);
    }

    #[test]
    fn steepest_descent_divides_by_the_distance_of_each_neighbour() {
        let drop = |to: (usize, usize)| {
            let pit = grid(3, 3, SPACING, |i, j| if (i, j) == to { -1.0f32 } else { 0.0 });
            steepest_descent(&pit).unwrap().get(1, 1).unwrap()
        };
        assert_eq!(drop((0, 1)), 0.5);
        assert_eq!(drop((1, 2)), 0.2);
        assert!((drop((2, 2)) - 1.0 / 29f64.sqrt()).abs() < 1e-16);
        assert_eq!(drop((1, 1)), 0.0);
    }
}
