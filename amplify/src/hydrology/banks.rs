//! A field carried from a river's bed to its banks by "a small convolution" (Paris 2019 §6.1): a normalised, separable bump,
//! along rows and then along columns.

use super::HydrologyError;
use super::padded::Elevation;
use rayon::prelude::*;
use terrain_model::grid::Grid;

/// `values` convolved with k(x)·k(y), k(x) = (1 − x²/r²)² within the `radius` r, metres, weights summing to 1 over the samples.
///
/// Beside the border and no-data the weights that fall on known samples are scaled to sum to 1. So a constant stays, results
/// are within the range of the known values, and the sum of all is kept where those farther than 2r from borders and no-data alone
/// are not 0. k is C¹ and so
/// are results, as functions of where a source is. A radius of a spacing or less along an axis changes nothing along it.
/// No-data stays, as NaN, the marker.
///
/// # Errors
/// [`HydrologyError`] for a geographic grid, or a radius that is not positive and finite.
pub fn convolve<T: Elevation>(values: &Grid<T>, radius: f64) -> Result<Grid<f64>, HydrologyError> {
    if !(radius > 0.0 && radius.is_finite()) {
        let expected = "a positive number of metres";
        return Err(HydrologyError::Parameter { name: "the radius of the convolution", value: radius, expected });
    }
    if !values.is_metric() {
        return Err(HydrologyError::Geographic);
    }
    if let Some((i, j, _, bad)) =
        values.positions().find(|&(_, _, _, v)| !values.is_no_data(v) && !v.to_f64().is_finite())
    {
        return Err(HydrologyError::NotFinite { i, j, value: bad.to_f64() });
    }
    let known = |v: T| !values.is_no_data(v);
    let (width, height, spacing) = (values.width(), values.height(), values.spacing());
    let (across, along) = (kernel(radius, spacing.x, width), kernel(radius, spacing.y, height));
    // Sums of weight · value and of weight, beside each other: the two passes treat both alike.
    let start: Vec<[f64; 2]> =
        values.values().iter().map(|&v| if known(v) { [v.to_f64(), 1.0] } else { [0.0, 0.0] }).collect();
    let mut rows = vec![[0.0; 2]; start.len()];
    rows.par_chunks_mut(width).zip(start.par_chunks(width)).for_each(|(out, row)| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = gather(&across, i, width, |k| row[k]);
        }
    });
    let (low, high) = values.min_max().map_or((0.0, 0.0), |(low, high)| (low.to_f64(), high.to_f64()));
    let mut result = vec![f64::NAN; start.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(j, out)| {
        for (i, out) in out.iter_mut().enumerate() {
            if start[j * width + i][1] > 0.0 {
                let [sum, weight] = gather(&along, j, height, |k| rows[k * width + i]);
                // A mean lies in the range of what it is taken of; its rounding may not.
                *out = (sum / weight).clamp(low, high);
            }
        }
    });
    Ok(values.with_values(result, Some(f64::NAN)).expect("a value for each of the samples"))
}

/// Weights of the samples at 0, ±1, ±2 … spacings, the middle one first; with all mirror images they sum to 1.
fn kernel(radius: f64, spacing: f64, samples: usize) -> Vec<f64> {
    let reach = (radius / spacing).min(samples as f64) as usize;
    let bump = |k: usize| {
        let x = k as f64 * spacing / radius;
        let inside = (1.0 - x * x).max(0.0);
        inside * inside
    };
    let total = (1..=reach).map(bump).sum::<f64>() * 2.0 + 1.0;
    (0..=reach).map(|k| bump(k) / total).collect()
}

/// Σ kernel · at, over what there is.
fn gather(kernel: &[f64], middle: usize, end: usize, at: impl Fn(usize) -> [f64; 2]) -> [f64; 2] {
    let first = middle.saturating_sub(kernel.len() - 1);
    let mut sum = [0.0; 2];
    for k in first..(middle + kernel.len()).min(end) {
        let [value, weight] = at(k);
        let part = kernel[k.abs_diff(middle)];
        sum = [sum[0] + part * value, sum[1] + part * weight];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::testing::{grid, unit};
    use super::*;
    use glam::DVec2;

    const SPACING: DVec2 = DVec2::new(2.0, 3.0);

    fn range(grid: &Grid<f64>) -> (f64, f64) {
        grid.min_max().unwrap()
    }

    #[test]
    fn results_stay_in_zero_to_one_and_a_constant_stays_beside_borders_and_holes() {
        let holes = |v: f64, k: usize| if k.is_multiple_of(7) { f64::NAN } else { v };
        let sigma = grid(30, 20, SPACING, |i, j| holes(unit(1, i, j).round(), i + 5 * j)).with_no_data(Some(f64::NAN));
        for radius in [0.5, 5.0, 9.0, 1e4] {
            let (low, high) = range(&convolve(&sigma, radius).unwrap());
            assert!(low >= 0.0 && high <= 1.0);
            let ones = convolve(&sigma.map_known(|_| 0.7), radius).unwrap();
            assert_eq!(range(&ones), (0.7, 0.7));
            assert_eq!(ones.no_data_count(), sigma.no_data_count());
        }
        // Control: unlike the input, the result is not all zeros and ones.
        assert!(convolve(&sigma, 9.0).unwrap().values().iter().any(|&v| v > 0.1 && v < 0.9));
    }

    #[test]
    fn the_sum_is_kept_away_from_borders() {
        let total = |grid: &Grid<f64>| grid.values().iter().sum::<f64>();
        let inner = |i: usize, j: usize| (12..18).contains(&i) && (8..12).contains(&j);
        let sigma = grid(30, 20, SPACING, |i, j| if inner(i, j) { unit(2, i, j) } else { 0.0 });
        let spread = convolve(&sigma, 12.0).unwrap();
        assert!((total(&spread) / total(&sigma) - 1.0).abs() < 1e-13);
        // Control: at a border the scaled weights add to it.
        let beside = grid(30, 20, SPACING, |i, _| if i == 0 { 1.0 } else { 0.0 });
        assert!((total(&convolve(&beside, 12.0).unwrap()) / total(&beside) - 1.0).abs() > 0.01);
    }

    #[test]
    fn a_point_spreads_as_the_bump_and_reaches_the_radius() {
        let point = grid(31, 31, SPACING, |i, j| if (i, j) == (15, 15) { 1.0f32 } else { 0.0 });
        let spread = convolve(&point, 12.0).unwrap();
        let at = |i, j| spread.get(i, j).unwrap();
        // k(4)/k(0) = (1 − 1/9)², k(9)/k(0) = (1 − 9/16)².
        assert!((at(17, 15) / at(15, 15) - (8.0f64 / 9.0) * (8.0 / 9.0)).abs() < 1e-14);
        assert!((at(15, 18) / at(15, 15) - (7.0f64 / 16.0) * (7.0 / 16.0)).abs() < 1e-14);
        assert!(at(20, 15) > 0.0 && at(21, 15) == 0.0);
        assert_eq!(at(13, 14), at(17, 16));
    }

    #[test]
    fn a_radius_within_a_spacing_changes_nothing_and_a_bad_one_is_named() {
        let sigma = grid(9, 8, SPACING, unit_of);
        assert_eq!(convolve(&sigma, 1.5).unwrap().values(), sigma.values());
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(convolve(&sigma, radius), Err(HydrologyError::Parameter { .. })));
        }
    }

    fn unit_of(i: usize, j: usize) -> f64 {
        unit(3, i, j)
    }
}
