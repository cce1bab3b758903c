//! What several experiments ask of rasters: how far two differ, what they hold between nodes.

use glam::DVec2;
use terrain_diffusion::raster::Domain;

/// The largest |a − b| over the range of b.
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let [low, high] = range(b);
    let largest = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    if high > low { largest / (high - low) } else { largest }
}

/// √ of the mean of (a − b)² over the range of b.
pub fn rms_difference(a: &[f64], b: &[f64]) -> f64 {
    let [low, high] = range(b);
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (square / b.len() as f64).sqrt() / (high - low).max(f64::MIN_POSITIVE)
}

/// Bilinear value, at `q` in columns from the west and rows from the south.
pub fn value(values: &[f64], domain: &Domain, q: DVec2) -> f64 {
    let most = DVec2::new((domain.width - 2) as f64, (domain.height - 2) as f64);
    let cell = q.floor().clamp(DVec2::ZERO, most);
    let t = q - cell;
    let at = |x: usize, y: usize| values[(cell.y as usize + y) * domain.width + cell.x as usize + x];
    let row = |y: usize| at(0, y) + (at(1, y) - at(0, y)) * t.x;
    row(0) + (row(1) - row(0)) * t.y
}

/// Least and greatest.
pub fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_shares_of_the_range_and_values_between_nodes_are_bilinear() {
        let domain = Domain::square(2.0, 3);
        let b: Vec<f64> = (0..9).map(|k| f64::from(k % 3 + 10 * (k / 3))).collect();
        let mut a = b.clone();
        a[4] += 2.2;
        assert!((largest_difference(&a, &b) - 0.1).abs() < 1e-12 && largest_difference(&b, &b) == 0.0);
        assert!((rms_difference(&a, &b) - 0.1 / 3.0).abs() < 1e-12);
        let bilinear = |x: f64, y: f64| (value(&b, &domain, DVec2::new(x, y)) - (x + 10.0 * y)).abs() < 1e-12;
        assert!(bilinear(0.25, 1.75) && bilinear(2.0, 2.0) && bilinear(1.0, 0.0));
    }
}
