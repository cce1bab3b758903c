//! What a landform's parameters may be, and how one that is out of range is refused.

use glam::DVec3;

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{landform}: {field} is {value}, expected {low} to {high} {unit}")]
pub struct ParameterError {
    /// Of which landform.
    pub landform: &'static str,
    /// Which parameter.
    pub field: &'static str,
    /// What it is.
    pub value: f64,
    /// The smallest it may be.
    pub low: f64,
    /// The largest it may be.
    pub high: f64,
    /// What it is measured in.
    pub unit: &'static str,
}

/// Checks the parameters of one landform.
pub(crate) struct Check(pub(crate) &'static str);

impl Check {
    /// Is `value` a number from `low` to `high`?
    pub(crate) fn within(
        &self,
        field: &'static str,
        value: f64,
        [low, high]: [f64; 2],
        unit: &'static str,
    ) -> Result<(), ParameterError> {
        let sound = (low..=high).contains(&value);
        sound.then_some(()).ok_or(ParameterError { landform: self.0, field, value, low, high, unit })
    }
    /// Is `p` a point within ±10⁷ m?
    pub(super) fn place(&self, field: &'static str, p: DVec3) -> Result<(), ParameterError> {
        p.to_array().into_iter().try_for_each(|x| self.within(field, x, [-1e7, 1e7], "m along each axis"))
    }
    /// Are both?
    pub(crate) fn pair(
        &self,
        field: &'static str,
        [a, b]: [f64; 2],
        range: [f64; 2],
        unit: &'static str,
    ) -> Result<(), ParameterError> {
        self.within(field, a, range, unit)?;
        self.within(field, b, range, unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_landform_field_value_and_range() {
        let check = Check("karst");
        assert!(check.within("spacing", 3.0, [0.1, 10.0], "m").is_ok());
        let error = check.within("spacing", 30.0, [0.1, 10.0], "m").unwrap_err();
        assert_eq!(error.to_string(), "karst: spacing is 30, expected 0.1 to 10 m");
        assert!(check.place("at", DVec3::ONE).is_ok());
        for bad in [f64::NAN, f64::INFINITY, -1e8] {
            assert!(check.place("at", DVec3::ONE.with_y(bad)).is_err());
        }
        assert!(check.pair("radius", [1.0, f64::NAN], [0.1, 10.0], "m").is_err());
    }
}
