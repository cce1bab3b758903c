//! Wyvill's falloff and the quintic fade: the two polynomials that every weight and every lattice noise is made of.

use crate::interval::Interval;
use crate::real::Real;

/// Largest slope of the falloff g(x) = (1 − x²)³ for unit radius: 96·√5 / 125, at x = 1/√5, rounded up.
/// For radius r it is this over r (Génevaux 2015, appendix; claims G29 for the sign).
pub const WYVILL_SLOPE: f64 = 1.717_300_206_719_842;

/// Wyvill's falloff g = (1 − u)³ of the *squared* relative distance u = (d/r)², 0 from u = 1 on.
///
/// Working on the square needs no root, so weights are smooth at the centre. `u` must not be negative; a signed
/// distance is squared first (claims G28). Source: Génevaux 2015 §4.1.
#[inline(always)]
pub fn wyvill<R: Real>(u: R) -> R {
    let v = (R::one() - u).max(R::zero());
    v.square() * v
}

/// The largest |g′| over the squared relative distances `u`: 6·√u·(1 − u)² rises up to u = 1/5 and falls after it.
pub fn wyvill_steepness(u: Interval) -> f64 {
    let at = |u: f64| {
        let u = Interval::point(u);
        (Interval::point(6.0) * Real::sqrt(u) * Real::max(Interval::point(1.0) - u, Interval::ZERO).square()).hi()
    };
    if u.hi() < 0.2 {
        at(u.hi())
    } else if u.lo() > 0.2 {
        at(u.lo())
    } else {
        WYVILL_SLOPE
    }
}

/// The quintic fade 6t⁵ − 15t⁴ + 10t³ on [0, 1] and its derivative 30·t²(1−t)².
#[inline(always)]
pub fn fade<R: Real>(t: R) -> (R, R) {
    let c = R::constant;
    let value = t.square() * t * ((t * c(6.0) - c(15.0)) * t + c(10.0));
    // t(1 − t) = 1/4 − (t − 1/2)² uses t once: tight on intervals.
    let bump = c(0.25) - (t - c(0.5)).square();
    (value, c(30.0) * bump.square())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    #[test]
    fn wyvill_slope_is_attained_at_one_over_root_five() {
        let x = 1.0 / 5.0f64.sqrt();
        let slope = wyvill(Dual::<f64, 1>::variable(x, 0).square()).slope[0];
        assert!((slope.abs() - WYVILL_SLOPE).abs() < 1e-14);
    }

    #[test]
    fn wyvill_slope_is_certified_on_the_whole_interval() {
        // 4096 boxes over [0, 1.1]; each encloses g′ within its own width.
        let mut worst = 0.0f64;
        for i in 0..4096 {
            let x = Interval::new(1.1 * f64::from(i) / 4096.0, 1.1 * f64::from(i + 1) / 4096.0);
            worst = worst.max(wyvill(Dual::<Interval, 1>::variable(x, 0).square()).slope[0].magnitude());
        }
        assert!(worst < WYVILL_SLOPE * 1.002, "{worst}");
        assert!(worst >= WYVILL_SLOPE);
    }

    #[test]
    fn the_falloff_of_a_radius_ends_at_it() {
        assert_eq!(wyvill(1.0), 0.0);
        assert_eq!(wyvill(4.0), 0.0);
        assert_eq!(wyvill(0.0), 1.0);
    }

    #[test]
    fn fade_carries_its_own_derivative() {
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            let dual = fade(Dual::<f64, 1>::variable(t, 0)).0;
            assert!((dual.slope[0] - fade(t).1).abs() < 1e-13);
        }
    }
}
