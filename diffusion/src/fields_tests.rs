use super::*;
use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};
use glam::DVec2;

fn line(a: DVec2, b: DVec2, point: ConstraintPoint) -> Curve {
    let points = [0.0, 1.0].map(|place| ConstraintPoint { place, ..point }).to_vec();
    Curve::new(vec![a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], points).unwrap()
}
fn level(height: f64) -> ConstraintPoint {
    ConstraintPoint { elevation: Some(Elevation { height, radius: 0.0 }), ..ConstraintPoint::default() }
}
fn sloped(height: f64, extent: f64, degrees: f64) -> ConstraintPoint {
    let side = Side { extent, angle: degrees.to_radians() };
    ConstraintPoint { gradient: Some(Gradient { left: side, right: side }), ..level(height) }
}
fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

#[test]
fn between_two_levels_the_ground_is_a_plane() {
    let curves = [line(v(0.0, -1.0), v(0.0, 101.0), level(0.0)), line(v(100.0, -1.0), v(100.0, 101.0), level(50.0))];
    let domain = Domain::square(100.0, 101);
    let fields = diffuse(&curves, domain, &Settings::default()).unwrap();
    for (k, height) in fields.elevation.iter().enumerate() {
        assert!((height - (k % 101) as f64 / 2.0).abs() < 1e-4, "{k}: {height}");
    }
    assert!(fields.amplitude.iter().all(|a| *a == 0.0) && fields.reports.len() == 1);
}

#[test]
fn a_band_drops_by_its_ramp_in_any_direction() {
    // The slope ramps from tan 40° to 0 over 40 m: a drop of half of that.
    let ideal = -0.5 * 40.0 * libm::tan(40.0f64.to_radians());
    for degrees in [0.0f64, 15.0, 30.0, 45.0] {
        let (sin, cos) = (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
        let (centre, along) = (v(100.0, 100.0), v(cos, sin));
        let curves = [line(centre - along * 60.0, centre + along * 60.0, sloped(80.0, 40.0, -40.0))];
        // 80 cells across the band: within 1.5 h/a of it (diffusion.md), 2 %, and what the ends of the curve take.
        let domain = Domain::square(200.0, 401);
        let drop = |solver| {
            let fields = diffuse(&curves, domain, &Settings { solver, ..Settings::default() }).unwrap();
            assert!(fields.reports.iter().all(|report| report.converged), "{:?}", fields.reports);
            let foot = (centre + v(-sin, cos) * 39.0) / domain.spacing;
            fields.elevation[foot.y.round() as usize * 401 + foot.x.round() as usize] - 80.0
        };
        let error = drop(Solver::Multigrid) / ideal - 1.0;
        assert!(error.abs() < 0.03, "{degrees}°: {error}");
        let printed = drop(Solver::Printed) / ideal - 1.0;
        if degrees > 20.0 {
            assert!(printed > 0.2, "{degrees}°: the printed update is too steep, not by {printed}");
        }
    }
}

#[test]
fn a_crack_is_a_trough_and_not_a_wall() {
    let mut crack = sloped(0.0, 15.0, -45.0);
    crack.elevation = None;
    crack.gradient =
        crack.gradient.map(|g| Gradient { left: Side { angle: 0.6, ..g.left }, right: Side { angle: 0.6, ..g.right } });
    let frame = [
        line(v(0.0, 0.0), v(100.0, 0.0), level(20.0)),
        line(v(0.0, 100.0), v(100.0, 100.0), level(20.0)),
        line(v(0.0, 0.0), v(0.0, 100.0), level(20.0)),
        line(v(100.0, 0.0), v(100.0, 100.0), level(20.0)),
    ];
    let curves = [&frame[..], &[line(v(30.0, 50.0), v(70.0, 50.0), crack)]].concat();
    let fields = diffuse(&curves, Domain::square(100.0, 201), &Settings::default()).unwrap();
    let at = |x: usize, y: usize| fields.elevation[2 * y * 201 + 2 * x];
    assert!(at(50, 50) < at(50, 65) - 2.0 && at(50, 50) < 20.0, "{} in it, {} beside it", at(50, 50), at(50, 65));
}

#[test]
fn slopes_that_meet_are_diffused_and_noise_is_carried_along() {
    let mut ridge = sloped(60.0, 30.0, -30.0);
    ridge.noise = Some(Noise { amplitude: 4.0, roughness: 0.25 });
    let curves = [line(v(20.0, 50.0), v(80.0, 50.0), ridge), line(v(50.0, 20.0), v(50.0, 80.0), ridge)];
    let fields = diffuse(&curves, Domain::square(100.0, 129), &Settings::default()).unwrap();
    assert_eq!(fields.reports.len(), 3);
    assert!(fields.amplitude.iter().all(|a| (a - 4.0).abs() < 1e-6));
    assert!(fields.roughness.iter().all(|r| (r - 0.25).abs() < 1e-6));
    assert!(fields.elevation.iter().all(|h| h.is_finite() && *h < 60.0 + 1e-6));
}

#[test]
fn curves_without_any_elevation_are_refused() {
    let mut crack = sloped(0.0, 15.0, 30.0);
    crack.elevation = None;
    let refused =
        diffuse(&[line(v(30.0, 50.0), v(70.0, 50.0), crack)], Domain::square(100.0, 65), &Settings::default());
    assert!(matches!(refused, Err(SolveError::Unheld)));
}

#[test]
fn settings_out_of_range_are_refused() {
    let curves = [line(v(0.0, 30.0), v(100.0, 30.0), level(0.0))];
    let default = Settings::default();
    for smoothing in [-0.1, 1.0, f64::NAN] {
        let refused = diffuse(&curves, Domain::square(100.0, 17), &Settings { smoothing, ..default });
        assert!(matches!(refused, Err(SolveError::Setting { what: "smoothing", .. })), "{smoothing}");
    }
    for slope_weight in [0.9, f64::INFINITY, f64::NAN] {
        let refused = diffuse(&curves, Domain::square(100.0, 17), &Settings { slope_weight, ..default });
        assert!(matches!(refused, Err(SolveError::Setting { what: "slope_weight", .. })), "{slope_weight}");
    }
    assert!(diffuse(&curves, Domain::square(100.0, 17), &default).is_ok());
}

#[test]
fn approximated_elevations_are_smoother_than_interpolated_ones() {
    let curves = [line(v(0.0, 30.0), v(100.0, 30.0), level(0.0)), line(v(20.0, 70.0), v(80.0, 70.0), level(50.0))];
    let at = |smoothing: f64| {
        let settings = Settings { smoothing, ..Settings::default() };
        let fields = diffuse(&curves, Domain::square(100.0, 101), &settings).unwrap();
        fields.elevation[70 * 101 + 50]
    };
    assert!((at(0.0) - 50.0).abs() < 1e-6 && at(0.9) < 49.0 && at(0.99) < at(0.9));
}
