//! σ: the vertical distance to the surface as a field in [0, 2T] (Paris 2019 §5.1).

use crate::field::THRESHOLD;
use serde::{Deserialize, Serialize};
use terrain_model::bounds::times_up;
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// Which σ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sigmoid {
    /// T + T·(3y − y³)/2 with y = x/R: its slope 3T/(2R) at the surface follows from R, its range is [0, 2T] for every R
    /// (claims P7).
    #[default]
    UnitFree,
    /// The cubic as printed, with slope 1 at the surface, mended where it is no function at all: odd about T, 0 above
    /// the surface (claims P6). It stays in [0, 2T] only for R ≤ 3T, so [`Sigmoid::fits`] refuses larger radii.
    Paper,
}

impl Sigmoid {
    /// Does σ stay within [0, 2T] for this radius?
    pub fn fits(self, radius: f64) -> bool {
        radius > 0.0 && radius.is_finite() && (self == Sigmoid::UnitFree || radius <= 3.0 * THRESHOLD)
    }

    /// σ(x) for x metres below the surface, R metres of influence: 0 from −R up, T at 0, 2T from R down.
    #[inline(always)]
    pub fn value<R: Real>(self, x: R, radius: R) -> R {
        let (t, one) = (R::constant(THRESHOLD), R::one());
        let y = (x / radius).max(-one).min(one);
        t + match self {
            // y(3 − y²)/2, T taken out.
            // Enclosures alone are ever outside [−T, T], by their rounding.
            Sigmoid::UnitFree => (t * y * (R::constant(1.5) - R::constant(0.5) * y.square())).max(-t).min(t),
            Sigmoid::Paper => {
                // R·|y| + (3T − 2R)·y² + (R − 2T)·|y|³, odd.
                let m = y.abs();
                let cubic = radius + m * (R::constant(3.0) * t - radius - radius + m * (radius - t - t));
                y * cubic
            }
        }
    }

    /// Encloses the computed σ over depths in metres. It is T plus a number that is kept within ±T, so that no rounding takes
    /// it out of [0, 2T]: the end is met exactly, and what is never above 2T is known to be.
    pub fn enclose(self, x: Interval, radius: f64) -> Interval {
        let range = self.value(x, Interval::point(radius));
        match self {
            Sigmoid::UnitFree => Interval::new(range.lo().max(0.0), range.hi().min(2.0 * THRESHOLD)),
            Sigmoid::Paper => range,
        }
    }

    /// The largest slope of σ over depths `y` in units of R, 1/metre: [`Sigmoid::slope`]·(1 − y²) at the least |y|, 0 where
    /// |y| ≥ 1.
    pub fn steepness(self, y: Interval, radius: f64) -> f64 {
        let least = Interval::point(y.mignitude());
        let share = match self {
            _ if least.lo() >= 1.0 => 0.0,
            Sigmoid::UnitFree => (Interval::point(1.0) - least.square()).hi(),
            Sigmoid::Paper => 1.0,
        };
        times_up(self.slope(radius), share)
    }

    /// The largest slope of σ, 1/metre: 3T/(2R) at the surface; for the printed cubic with R ≤ 3T the larger of 1 and
    /// the extremum of its parabola-shaped slope.
    pub fn slope(self, radius: f64) -> f64 {
        let t = THRESHOLD;
        let up = |x: f64| x.next_up().next_up();
        match self {
            Sigmoid::UnitFree => up(up(1.5 * t) / radius),
            Sigmoid::Paper => {
                // s′(y) = (1 − y)(1 − 3(1 − 2T/R)y): with q = 3(1 − 2T/R) its vertex y = (1 + q)/(2q) lies in (0, 1)
                // only for q < −1, where s′ = −(1 − q)²/(4q).
                let q = 3.0 * (1.0 - 2.0 * t / radius);
                if q < -1.0 { up(up((1.0 - q) * (1.0 - q)) / (-4.0 * q)) * (1.0 + 1e-14) } else { up(1.0) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [(Sigmoid, &[f64]); 2] =
        [(Sigmoid::UnitFree, &[0.1, 1.0, 10.0, 300.0]), (Sigmoid::Paper, &[0.1, 0.5, 1.0, 1.5])];

    fn each(mut check: impl FnMut(Sigmoid, f64, &dyn Fn(f64) -> f64)) {
        for (sigmoid, radii) in BOTH {
            for &radius in radii {
                assert!(sigmoid.fits(radius));
                check(sigmoid, radius, &|x| sigmoid.value(x, radius));
            }
        }
    }

    #[test]
    fn the_ends_are_0_and_2t_and_the_surface_is_at_t() {
        each(|_, radius, value| {
            assert_eq!(value(0.0), THRESHOLD);
            assert!(value(-radius).abs() < 1e-15 && value(-7.0 * radius).abs() < 1e-15);
            assert!((value(radius) - 2.0 * THRESHOLD).abs() < 1e-15);
        });
    }

    #[test]
    fn it_rises_no_faster_than_its_slope_and_never_falls() {
        each(|sigmoid, radius, value| {
            let step = radius / 512.0;
            let slope = sigmoid.slope(radius);
            let mut steepest: f64 = 0.0;
            for k in -600..600 {
                let x = f64::from(k) * step;
                let rise = (value(x + step) - value(x)) / step;
                assert!(
                    rise >= -1e-12 && rise <= slope * (1.0 + 1e-12),
                    "{sigmoid:?} {radius} at {x}: {rise} > {slope}"
                );
                steepest = steepest.max(rise);
                let here = sigmoid.steepness(Interval::new(x / radius, (x + step) / radius), radius);
                assert!(rise <= here * (1.0 + 1e-9) + 1e-12 / step, "{sigmoid:?} {radius} at {x}: {rise} > {here}");
            }
            assert!(steepest > 0.99 * slope, "{sigmoid:?} {radius}: bound {slope} is loose, steepest {steepest}");
        });
    }

    /// Claims P7: at R = 10 m the printed cubic reaches 2.1.
    #[test]
    fn the_printed_cubic_leaves_its_range_and_is_refused_there() {
        assert!(!Sigmoid::Paper.fits(10.0));
        let top = (0..=100).map(|k| Sigmoid::Paper.value(f64::from(k) * 0.1, 10.0)).fold(0.0, f64::max);
        assert!((top - 2.123).abs() < 1e-2, "{top}");
    }
}
