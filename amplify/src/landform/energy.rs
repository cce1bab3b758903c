//! How strongly an agent erodes rock (Paris 2019 §6.1): bilinear in the resistance of the rock and in the stress on it.
//! The printed pipeline swaps the two arguments in places (claims P15), so here they have names.

use super::parameter::{Check, ParameterError};

/// Rock under attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attack {
    /// ρ in [0, 1]: 0 is the least resistant rock.
    pub resistance: f64,
    /// σ in [0, 1]: 0 is no stress.
    pub stress: f64,
}

impl Attack {
    /// e(ρ, σ) = σ(1 − ρ)(1 − β) + σβ in [0, 1], with β = `on_hardest` the effect that full stress has on the hardest
    /// rock (§6.1; claims P14).
    ///
    /// e(ρ, 0) = 0, e(1, 1) = β and e(0, 1) = 1 exactly; e falls with ρ and rises with σ.
    ///
    /// Every argument is clamped to [0, 1] first: σ = √A·s of a river, or a resistance that is a sum, leaves it (claims P2
    /// and P14). What is no number counts as what erodes least: ρ = 1, σ = 0 or β = 0.
    #[must_use]
    pub fn effect(self, on_hardest: f64) -> f64 {
        let unit = |x: f64, absent: f64| if x.is_nan() { absent } else { x.clamp(0.0, 1.0) };
        let (resistance, stress, beta) = (unit(self.resistance, 1.0), unit(self.stress, 0.0), unit(on_hardest, 0.0));
        // Each operation rounds monotonically and 1 − β + β rounds to 1: the laws hold for the rounded e too.
        stress * (1.0 - resistance) * (1.0 - beta) + stress * beta
    }

    /// Are both in [0, 1]?
    ///
    /// # Errors
    /// The one that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("attack");
        check.within("resistance", self.resistance, [0.0, 1.0], "(no unit)")?;
        check.within("stress", self.stress, [0.0, 1.0], "(no unit)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn e(resistance: f64, stress: f64, beta: f64) -> f64 {
        Attack { resistance, stress }.effect(beta)
    }

    /// The laws, of any function of resistance, stress and β.
    fn laws(e: impl Fn(f64, f64, f64) -> f64, [resistance, stress, beta, more]: [f64; 4]) -> Result<(), &'static str> {
        let value = e(resistance, stress, beta);
        let law = |holds: bool, name| holds.then_some(()).ok_or(name);
        law((0.0..=1.0).contains(&value), "range")?;
        law(e(resistance, 0.0, beta) == 0.0, "no stress, no erosion")?;
        law(e(1.0, 1.0, beta) == beta, "hardest rock")?;
        law(e(0.0, 1.0, beta) == 1.0, "softest rock")?;
        law(e(resistance + (1.0 - resistance) * more, stress, beta) <= value, "falls with resistance")?;
        law(e(resistance, stress + (1.0 - stress) * more, beta) >= value, "rises with stress")
    }

    proptest! {
        #[test]
        fn the_effect_keeps_its_laws_to_the_bit(at in prop::array::uniform4(0.0f64..=1.0)) {
            prop_assert_eq!(laws(e, at), Ok(()));
            // Controls: swapped arguments, and a β that is added to the whole.
            prop_assert!(laws(|r, s, b| e(s, r, b), at).is_err());
            prop_assert!(at[2] < 1e-3 || laws(|r, s, b| s * (1.0 - r) + s * b, at).is_err());
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped_and_what_is_no_number_erodes_least() {
        assert_eq!(e(0.5, 250.0, 0.1), e(0.5, 1.0, 0.1));
        assert_eq!(e(1.8, 1.0, 0.1), 0.1);
        assert_eq!(e(-3.0, 1.0, 0.1), 1.0);
        assert_eq!(e(0.0, f64::NAN, 0.1), 0.0);
        assert_eq!(e(f64::NAN, 1.0, 0.3), 0.3);
        let bad = Attack { resistance: 0.5, stress: 250.0 };
        assert_eq!(bad.check().unwrap_err().to_string(), "attack: stress is 250, expected 0 to 1 (no unit)");
        assert!(Attack { resistance: 0.5, stress: 1.0 }.check().is_ok());
        assert!(Attack { resistance: f64::NAN, stress: 1.0 }.check().is_err());
    }
}
