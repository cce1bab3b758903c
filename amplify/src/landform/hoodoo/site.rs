//! Where hoodoos are likely (Paris 2019 §6.3): on medium slopes that drain little, within a mask.

use super::super::parameter::{Check, ParameterError};
use serde::{Deserialize, Serialize};
use terrain_model::falloff::wyvill;

/// The ground that hoodoos like, as it is written; what is left out has its default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Habitat {
    /// The likeliest slope, metres of height per metre; 0 to 10, by default 0.7, a talus of 35°.
    pub slope: f64,
    /// No hoodoo where the slope differs by this much or more; 0.01 to 10, by default 0.5.
    pub slope_width: f64,
    /// The drainage area that halves the probability, m²; 1 to 10¹², by default 2000.
    pub drainage_area: f64,
}

impl Default for Habitat {
    fn default() -> Habitat {
        Habitat { slope: 0.7, slope_width: 0.5, drainage_area: 2000.0 }
    }
}

impl Habitat {
    /// Are the parameters in their ranges?
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("habitat of hoodoos");
        check.within("slope", self.slope, [0.0, 10.0], "m/m")?;
        check.within("slope_width", self.slope_width, [0.01, 10.0], "m/m")?;
        check.within("drainage_area", self.drainage_area, [1.0, 1e12], "m²")
    }

    /// The probability in [0, 1] of a hoodoo where `drainage_area` m² drain through a point of this `slope`, both 0 or
    /// more, and the mask is `mask`, clamped to [0, 1]: mask · g((slope − s₀)/w) / (1 + A/A₀) with Wyvill's falloff g, 1
    /// on the likeliest slope. The paper gives the criteria and no formula. What is no number is no place.
    pub fn probability(&self, drainage_area: f64, slope: f64, mask: f64) -> f64 {
        let off = (slope - self.slope) / self.slope_width;
        let area = drainage_area.max(0.0) / self.drainage_area;
        let chance = mask.clamp(0.0, 1.0) * wyvill(off * off) / (1.0 + area);
        let sound = !(drainage_area.is_nan() || slope.is_nan() || chance.is_nan());
        if sound { chance } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_place_is_likelier_the_nearer_its_slope_is_to_the_best_and_the_less_it_drains(
            area in 0.0f64..1e6, slope in 0.0f64..3.0, mask in -0.5f64..1.5, other in 0.0f64..1.0,
        ) {
            let habitat = Habitat::default();
            let p = habitat.probability(area, slope, mask);
            prop_assert!((0.0..=1.0).contains(&p));
            prop_assert!(habitat.probability(area + 1e5 * other, slope, mask) <= p);
            let nearer = slope + (habitat.slope - slope) * other;
            prop_assert!(habitat.probability(area, nearer, mask) >= p * (1.0 - 1e-12));
            prop_assert!(habitat.probability(area, slope, mask - other) <= p);
        }
    }

    #[test]
    fn plains_cliffs_rivers_and_masked_ground_have_none_or_few() {
        let habitat = Habitat::default();
        assert_eq!(habitat.probability(0.0, habitat.slope, 1.0), 1.0);
        assert_eq!(habitat.probability(habitat.drainage_area, habitat.slope, 1.0), 0.5);
        assert_eq!(habitat.probability(0.0, 0.1, 1.0), 0.0);
        assert_eq!(habitat.probability(0.0, 1.5, 1.0), 0.0);
        assert_eq!(habitat.probability(0.0, habitat.slope, 0.0), 0.0);
        assert!(habitat.probability(1e7, habitat.slope, 1.0) < 1e-3);
        for [area, slope, mask] in [[f64::NAN, 0.7, 1.0], [0.0, f64::NAN, 1.0], [0.0, 0.7, f64::NAN]] {
            assert_eq!(habitat.probability(area, slope, mask), 0.0);
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_name() {
        let habitat = Habitat::default();
        assert_eq!(habitat.check(), Ok(()));
        for (bad, field) in [
            (Habitat { slope: -1.0, ..habitat }, "slope"),
            (Habitat { slope_width: 0.0, ..habitat }, "slope_width"),
            (Habitat { drainage_area: f64::NAN, ..habitat }, "drainage_area"),
        ] {
            assert_eq!(bad.check().unwrap_err().field, field);
        }
        let read: Habitat = ron::from_str("(slope: 0.9)").unwrap();
        assert_eq!(read, Habitat { slope: 0.9, ..habitat });
    }
}
