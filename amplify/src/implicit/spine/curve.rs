//! Smooth curves through points, flattened to a polyline within a tolerance.

use super::{MAX_SEGMENTS, SpineError, check_points};
use glam::DVec3;

/// Neighbouring points of a polyline are at least so far apart, metres.
pub(super) const LEAST_STEP: f64 = 1e-6;

/// The share of the tolerance that chords may use; what is left covers points that [`LEAST_STEP`] drops, and rounding.
const CHORDS: f64 = 0.99;

/// The smallest tolerance, metres.
const LEAST_TOLERANCE: f64 = 1e-4;

/// The centripetal Catmull–Rom spline through `control`, its ends continued straight, as a polyline: none of either is
/// farther than `tolerance` metres from the other. Among the splines of its kind this one has no cusps or loops between
/// two points.
///
/// # Errors
/// [`SpineError`] for points that are none, not finite or too close, for a tolerance below 0.1 mm, and for a curve of
/// more than [`MAX_SEGMENTS`] segments.
pub fn catmull_rom(control: &[DVec3], tolerance: f64) -> Result<Vec<DVec3>, SpineError> {
    check_points(control)?;
    if !(tolerance >= LEAST_TOLERANCE && tolerance.is_finite()) {
        return Err(SpineError::Tolerance { tolerance, least: LEAST_TOLERANCE });
    }
    let pieces: Vec<([DVec3; 4], f64)> = (1..control.len())
        .map(|k| {
            let cubic = piece(control, k);
            (cubic, chords(&cubic, CHORDS * tolerance))
        })
        .collect();
    let count: f64 = pieces.iter().map(|(_, chords)| chords).sum();
    if count > MAX_SEGMENTS as f64 {
        return Err(SpineError::Long { count });
    }
    let mut points = vec![control[0]];
    for (cubic, chords) in pieces {
        for j in 1..chords as u32 {
            let p = at(&cubic, f64::from(j) / chords);
            let apart = |other: &DVec3| p.distance(*other) >= LEAST_STEP;
            if points.last().is_some_and(apart) && apart(&cubic[3]) {
                points.push(p);
            }
        }
        points.push(cubic[3]);
    }
    Ok(points)
}

/// The `k`-th piece (from 1) as a Bézier cubic: its knots are √distance apart, its tangents those of the parabolas through
/// three neighbouring points.
fn piece(control: &[DVec3], k: usize) -> [DVec3; 4] {
    let (b, c) = (control[k - 1], control[k]);
    let a = if k >= 2 { control[k - 2] } else { 2.0 * b - c };
    let d = control.get(k + 1).copied().unwrap_or(2.0 * c - b);
    let [before, here, after] = [(a, b), (b, c), (c, d)].map(|(p, q)| p.distance(q).sqrt());
    // Of the parabola through p, q, r at q, knots s and t apart.
    let tangent = |p: DVec3, q: DVec3, r: DVec3, s: f64, t: f64| ((q - p) * (t / s) + (r - q) * (s / t)) / (s + t);
    let (leaving, arriving) = (tangent(a, b, c, before, here), tangent(b, c, d, here, after));
    [b, b + leaving * (here / 3.0), c - arriving * (here / 3.0), c]
}

/// How many chords of equal parameter length keep within `tolerance`: n of them deviate by at most max‖B″‖/(8n²), and B″
/// is 6 times a convex combination of the two second differences of the control points.
fn chords(&[a, b, c, d]: &[DVec3; 4], tolerance: f64) -> f64 {
    let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
    (0.75 * bend / tolerance).sqrt().ceil().max(1.0)
}

fn at(&[a, b, c, d]: &[DVec3; 4], t: f64) -> DVec3 {
    let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
    ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn distance(points: &[DVec3], p: DVec3) -> f64 {
        let segment = |ends: &[DVec3]| {
            let axis = ends[1] - ends[0];
            let s = ((p - ends[0]).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
            (p - ends[0] - s * axis).length()
        };
        points.windows(2).map(segment).fold(f64::INFINITY, f64::min)
    }

    /// The largest distance of the curve's points to the polyline.
    fn deviation(control: &[DVec3], points: &[DVec3]) -> f64 {
        let on = |k: usize| (0..=200).map(move |j| at(&piece(control, k), f64::from(j) / 200.0));
        (1..control.len()).flat_map(on).map(|p| distance(points, p)).fold(0.0, f64::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        #[test]
        fn a_flattened_curve_meets_its_points_and_keeps_its_tolerance(
            control in prop::collection::vec(prop::array::uniform3(-30.0f64..30.0), 2..6), tolerance in 0.001f64..2.0,
        ) {
            let control: Vec<DVec3> = control.into_iter().map(DVec3::from_array).collect();
            let points = catmull_rom(&control, tolerance).unwrap();
            prop_assert!(control.iter().all(|p| points.contains(p)));
            prop_assert!(points.windows(2).all(|ends| ends[0].distance(ends[1]) >= LEAST_STEP));
            let off = deviation(&control, &points);
            prop_assert!(off <= tolerance, "{off} of {tolerance}");
        }
    }

    /// The control of the property above: half as many chords leave the tolerance, so the bound is not idle.
    #[test]
    fn every_other_point_does_not_keep_the_tolerance() {
        let control =
            [DVec3::ZERO, DVec3::new(10.0, 0.0, 0.0), DVec3::new(10.0, 10.0, 5.0), DVec3::new(0.0, 10.0, 9.0)];
        let points = catmull_rom(&control, 0.01).unwrap();
        let coarse: Vec<DVec3> = points.iter().copied().step_by(2).collect();
        let (fine, coarse) = (deviation(&control, &points), deviation(&control, &coarse));
        assert!(fine <= 0.01 && fine > 0.005, "{fine}");
        assert!(coarse > 0.01, "{coarse}");
    }

    #[test]
    fn tangents_are_shared_by_neighbouring_pieces() {
        let control = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(5.0, 9.0, 5.0), DVec3::new(0.0, 10.0, 9.0)];
        for k in 1..3 {
            let (one, two) = (piece(&control, k), piece(&control, k + 1));
            let (arriving, leaving) = (one[3] - one[2], two[1] - two[0]);
            assert!(arriving.normalize().distance(leaving.normalize()) < 1e-12);
        }
        let straight = catmull_rom(&[DVec3::ZERO, DVec3::X, DVec3::X * 5.0], 0.01).unwrap();
        assert!(straight.iter().all(|p| p.y == 0.0 && p.z == 0.0));
    }

    #[test]
    fn curves_that_cannot_be_flattened_are_refused() {
        let bend = [DVec3::ZERO, DVec3::X * 1e8, DVec3::new(1e8, 1e8, 0.0)];
        assert!(matches!(catmull_rom(&bend, 1e-4), Err(SpineError::Long { .. })));
        assert!(matches!(catmull_rom(&bend, f64::NAN), Err(SpineError::Tolerance { .. })));
        assert!(matches!(catmull_rom(&[], 1.0), Err(SpineError::Empty)));
        assert_eq!(catmull_rom(&bend[..1], 1.0).unwrap(), bend[..1]);
    }
}
