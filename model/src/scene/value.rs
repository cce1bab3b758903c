//! Values that are checked while a scene is read, so that an error carries line and column.

use serde::{Deserialize, Serialize};

/// A number above 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub(crate) struct Positive(f64);

impl TryFrom<f64> for Positive {
    type Error = String;
    fn try_from(value: f64) -> Result<Positive, String> {
        if value > 0.0 && value.is_finite() {
            Ok(Positive(value))
        } else {
            Err(format!("expected a number above 0, found {value}"))
        }
    }
}
impl Positive {
    pub(crate) const fn of(value: f64) -> Positive {
        Positive(value)
    }
}
impl From<Positive> for f64 {
    fn from(value: Positive) -> f64 {
        value.0
    }
}

/// Any finite number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub(crate) struct Finite(f64);

impl TryFrom<f64> for Finite {
    type Error = String;
    fn try_from(value: f64) -> Result<Finite, String> {
        if value.is_finite() {
            Ok(Finite(value + 0.0))
        } else {
            Err(format!("expected a finite number, found {value}"))
        }
    }
}
impl Finite {
    pub(crate) const fn of(value: f64) -> Finite {
        Finite(value)
    }
}
impl From<Finite> for f64 {
    fn from(value: Finite) -> f64 {
        value.0
    }
}

pub(crate) type Point = (Finite, Finite);
pub(crate) type Point3 = (Finite, Finite, Finite);

pub(crate) fn one() -> Positive {
    Positive(1.0)
}
