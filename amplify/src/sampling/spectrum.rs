//! The radially averaged periodogram of points in a rectangle: white noise has 1 at every frequency, blue noise next to nothing
//! below that of its distance.

use super::SamplingError;
use glam::DVec2;
use rayon::prelude::*;

/// A ring of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// The mean of its frequencies, periods a metre.
    pub frequency: f64,
    /// The mean of |Σ exp(−2πi f·p)|² / N over its frequencies.
    pub power: f64,
    /// How many frequencies, of the half plane, are in it.
    pub count: u32,
}

/// The periodogram of `points` (at least one) in the rectangle from `low` to `high` at frequencies (a/width, b/height), whole
/// a and b, so that the rectangle itself has none; averaged over rings `step` wide, periods a metre, the first around
/// `step` / 2, up to `highest`. Rings without a frequency are left out. The same bytes on any number of threads.
///
/// # Errors
/// [`SamplingError::Region`] for a rectangle without an inside; [`SamplingError::Frequencies`] unless 0 < `step` ≤ `highest`,
/// both finite; [`SamplingError::Waves`] for more than fit in 3 GB.
pub fn periodogram(
    points: &[DVec2],
    [low, high]: [DVec2; 2],
    step: f64,
    highest: f64,
) -> Result<Vec<Ring>, SamplingError> {
    let size = high - low;
    if !(low.is_finite() && high.is_finite() && size.min_element() > 0.0) {
        return Err(SamplingError::Region { low: low.to_array().to_vec(), high: high.to_array().to_vec() });
    }
    if !(step > 0.0 && step <= highest && highest.is_finite()) {
        return Err(SamplingError::Frequencies { step, highest });
    }
    let reach = [(highest * size.x) as usize, (highest * size.y) as usize];
    let terms = (points.len() * (reach[0] + reach[1] + 2)) as f64;
    if terms > 2e8 {
        return Err(SamplingError::Waves { terms });
    }
    // exp(−2πi·k·t) for all points, k by k: one angle a point, then products. Their error grows by an ulp or two with each k.
    let waves = |coordinate: &dyn Fn(DVec2) -> f64, count: usize| {
        let turn = |p: &DVec2| libm::sincos(-std::f64::consts::TAU * coordinate(*p));
        let first: Vec<DVec2> = points.iter().map(turn).map(|(sine, cosine)| DVec2::new(cosine, sine)).collect();
        let mut rows = vec![vec![DVec2::X; points.len()]];
        for k in 0..count {
            rows.push(rows[k].iter().zip(&first).map(|(&a, &b)| a.rotate(b)).collect());
        }
        rows
    };
    let along = waves(&|p| (p.x - low.x) / size.x, reach[0]);
    let across = waves(&|p| (p.y - low.y) / size.y, reach[1]);
    let rings = (highest / step).ceil() as usize;
    let conjugate = DVec2::new(1.0, -1.0);
    let rows: Vec<Vec<[f64; 3]>> = (0..=reach[1])
        .into_par_iter()
        .map(|b| {
            let mut sums = vec![[0.0; 3]; rings];
            for (a, wave) in along.iter().enumerate() {
                let frequency = DVec2::new(a as f64 / size.x, b as f64 / size.y).length();
                let ring = (frequency / step) as usize;
                if (a, b) == (0, 0) || ring >= rings || frequency > highest {
                    continue;
                }
                let (mut up, mut down) = (DVec2::ZERO, DVec2::ZERO);
                for (&x, &y) in wave.iter().zip(&across[b]) {
                    up += x.rotate(y);
                    down += x.rotate(y * conjugate);
                }
                // On the axes the mirror image is the same frequency or its opposite.
                let images = if a == 0 || b == 0 { 1.0 } else { 2.0 };
                let power = up.length_squared() + if images == 2.0 { down.length_squared() } else { 0.0 };
                let [sum, at, count] = &mut sums[ring];
                *sum += power / points.len() as f64;
                *at += images * frequency;
                *count += images;
            }
            sums
        })
        .collect();
    // Row by row, so that the sums do not depend on threads.
    let total = |ring: usize, part: usize| rows.iter().fold(0.0, |sum, row| sum + row[ring][part]);
    let all = (0..rings).map(|ring| [0, 1, 2].map(|part| total(ring, part))).filter(|[_, _, count]| *count > 0.0);
    Ok(all.map(|[sum, at, count]| Ring { frequency: at / count, power: sum / count, count: count as u32 }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_the_sum_of_the_definition() {
        let points = [DVec2::new(1.0, 2.0), DVec2::new(3.5, 0.25), DVec2::new(0.1, 2.9)];
        let corners = [DVec2::ZERO, DVec2::new(4.0, 3.0)];
        let rings = periodogram(&points, corners, 0.5, 1.0).unwrap();
        let (mut sums, mut counts) = ([0.0; 2], [0u32; 2]);
        for b in -3i32..=3 {
            for a in 0..=4 {
                let f = DVec2::new(f64::from(a) / 4.0, f64::from(b) / 3.0);
                if f.length() > 1.0 || (a == 0 && b <= 0) || (f.length() / 0.5) as usize >= 2 {
                    continue;
                }
                let sum: DVec2 = points
                    .iter()
                    .map(|&p| -std::f64::consts::TAU * f.dot(p))
                    .map(|angle| DVec2::new(libm::cos(angle), libm::sin(angle)))
                    .sum();
                let ring = (f.length() / 0.5) as usize;
                sums[ring] += sum.length_squared() / 3.0;
                counts[ring] += 1;
            }
        }
        assert_eq!(rings.len(), 2);
        for (ring, (sum, count)) in rings.iter().zip(sums.into_iter().zip(counts)) {
            assert_eq!(ring.count, count);
            assert!((ring.power - sum / f64::from(count)).abs() < 1e-12);
        }
        // Control: a point moved is another spectrum.
        let moved = [points[0], points[1], DVec2::new(0.2, 2.9)];
        assert!((periodogram(&moved, corners, 0.5, 1.0).unwrap()[0].power - rings[0].power).abs() > 1e-3);
    }

    #[test]
    fn a_rectangle_without_an_inside_and_frequencies_out_of_range_are_named() {
        let one = [DVec2::ONE];
        let unit = [DVec2::ZERO, DVec2::ONE];
        assert!(matches!(periodogram(&one, [DVec2::ZERO; 2], 1.0, 2.0), Err(SamplingError::Region { .. })));
        assert!(matches!(periodogram(&one, unit, 2.0, 1.0), Err(SamplingError::Frequencies { .. })));
        assert!(matches!(periodogram(&one, unit, 1e-3, 1e9), Err(SamplingError::Waves { .. })));
    }
}
