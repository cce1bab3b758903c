//! Stream power A^{1/2}·s, the stress of a river on its bed (Paris 2019 §6.1), and the same in [0, 1].
//!
//! The paper feeds A^{1/2}·s to an erosion response that expects [0, 1] (claim P14): √250000 m² times a slope of 1/2 is 250. A
//! reference power at which the stress is full makes it a share.

use super::HydrologyError;
use terrain_model::grid::Grid;

/// A^{1/2}·s, metres: `area` in m², `slope` in metres a metre; NaN, the marker, where one of them is unknown.
///
/// # Errors
/// [`HydrologyError::Different`] unless both rasters have one size and place.
pub fn stream_power(area: &Grid<f64>, slope: &Grid<f64>) -> Result<Grid<f64>, HydrologyError> {
    let size = |grid: &Grid<f64>| [grid.width(), grid.height()];
    if size(area) != size(slope) || area.origin() != slope.origin() || area.spacing() != slope.spacing() {
        return Err(HydrologyError::Different { first: size(area), second: size(slope) });
    }
    let pairs = area.values().iter().zip(slope.values());
    let power = |(&a, &s): (&f64, &f64)| {
        if area.is_no_data(a) || slope.is_no_data(s) { f64::NAN } else { a.sqrt() * s }
    };
    Ok(area.with_values(pairs.map(power).collect(), Some(f64::NAN)).expect("a value for each sample of the area"))
}

/// σ = min(A^{1/2}·s / `reference`, 1) in [0, 1]: the stress is full where the power reaches `reference`, metres. Unknown stays
/// NaN, the marker. A reference can be had from [`quantile`].
///
/// # Errors
/// [`HydrologyError::Parameter`] unless the reference is positive and finite.
pub fn stress(power: &Grid<f64>, reference: f64) -> Result<Grid<f64>, HydrologyError> {
    if !(reference > 0.0 && reference.is_finite()) {
        let expected = "a positive number of metres";
        return Err(HydrologyError::Parameter { name: "the power of full stress", value: reference, expected });
    }
    Ok(power.map(Some(f64::NAN), |power| power.map_or(f64::NAN, |power| (power / reference).clamp(0.0, 1.0))))
}

/// The smallest known value that at least `share` of the known ones do not exceed; `None` where nothing is known.
///
/// # Errors
/// [`HydrologyError::Parameter`] unless the share is in [0, 1].
pub fn quantile(values: &Grid<f64>, share: f64) -> Result<Option<f64>, HydrologyError> {
    if !(0.0..=1.0).contains(&share) {
        return Err(HydrologyError::Parameter { name: "the share", value: share, expected: "a number in [0, 1]" });
    }
    let mut known: Vec<f64> = values.values().iter().copied().filter(|&v| !values.is_no_data(v)).collect();
    if known.is_empty() {
        return Ok(None);
    }
    let rank = ((share * known.len() as f64).ceil() as usize).clamp(1, known.len()) - 1;
    Ok(Some(*known.select_nth_unstable_by(rank, f64::total_cmp).1))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{grid, unit};
    use super::*;
    use glam::DVec2;

    #[test]
    fn power_is_the_formula_and_stress_its_share_of_the_reference() {
        let one = |v: f64| grid(1, 1, DVec2::ONE, |_, _| v);
        let power = stream_power(&one(250_000.0), &one(0.5)).unwrap();
        assert_eq!(power.get(0, 0), Some(250.0));
        assert_eq!(stress(&power, 1000.0).unwrap().get(0, 0), Some(0.25));
        assert_eq!(stress(&power, 100.0).unwrap().get(0, 0), Some(1.0));
    }

    #[test]
    fn stress_stays_in_zero_to_one_where_power_does_not() {
        let random = |seed| grid(20, 20, DVec2::ONE, |i, j| unit(seed, i, j) * 50.0);
        let power = stream_power(&random(1), &random(2)).unwrap();
        let inside = |grid: &Grid<f64>| grid.values().iter().all(|v| (0.0..=1.0).contains(v));
        assert!(inside(&stress(&power, 30.0).unwrap()));
        // Control: the paper's power itself is not.
        assert!(!inside(&power));
    }

    #[test]
    fn a_quantile_is_the_value_of_its_rank_and_ignores_the_unknown() {
        let values = grid(5, 1, DVec2::ONE, |i, _| [3.0, f64::NAN, 1.0, 2.0, 4.0][i]).with_no_data(Some(f64::NAN));
        let at = |share| quantile(&values, share).unwrap();
        assert_eq!([at(0.0), at(0.25), at(0.5), at(0.51), at(1.0)], [1.0, 1.0, 2.0, 3.0, 4.0].map(Some));
        assert_eq!(quantile(&values.map_known(|_| f64::NAN), 0.5).unwrap(), None);
        assert!(quantile(&values, 1.5).is_err());
    }

    #[test]
    fn unknown_stays_unknown_and_other_places_are_refused() {
        let hole = grid(2, 1, DVec2::ONE, |i, _| if i == 0 { f64::NAN } else { 4.0 }).with_no_data(Some(f64::NAN));
        let slope = grid(2, 1, DVec2::ONE, |_, _| 3.0);
        let power = stream_power(&hole, &slope).unwrap();
        assert_eq!((power.known(0, 0), power.known(1, 0)), (None, Some(6.0)));
        assert_eq!(stress(&power, 10.0).unwrap().known(0, 0), None);
        let wide = grid(2, 1, DVec2::splat(2.0), |_, _| 3.0);
        assert!(matches!(stream_power(&hole, &wide), Err(HydrologyError::Different { .. })));
        assert!(matches!(stress(&power, f64::NAN), Err(HydrologyError::Parameter { .. })));
    }
}
