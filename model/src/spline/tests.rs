use super::*;
use crate::primitive::Parameters;
use crate::skeleton::arc::{elevation, place};
use proptest::prelude::*;

fn arcs(path: &Path, tolerance: f64) -> Vec<Arc> {
    path.stretches(tolerance, 1.0).expect("a valid path").into_iter().map(|s| s.arc).collect()
}

/// Largest distance of a sampled curve from the arcs, and of sampled arcs from the curve's samples.
fn apart(curve: &[DVec2], arcs: &[Arc]) -> (f64, f64) {
    let off = |x: DVec2| arcs.iter().fold(f64::INFINITY, |d: f64, arc| d.min(arc.distance(x)));
    let there = curve.iter().fold(0.0f64, |d, x| d.max(off(*x)));
    let to_curve = |x: DVec2| {
        curve.windows(2).fold(f64::INFINITY, |d: f64, s| {
            d.min(Arc::segment(s[0], s[1]).map_or(f64::INFINITY, |segment| segment.distance(x)))
        })
    };
    let back = arcs.iter().flat_map(|arc| (0..=8).map(move |k| arc.at(arc.length * f64::from(k) / 8.0).0));
    (there, back.fold(0.0, |d, x| d.max(to_curve(x))))
}

/// The largest angle between tangents that should be equal, radians.
fn kink(arcs: &[Arc]) -> f64 {
    arcs.windows(2).fold(0.0, |k, pair| {
        let (end, leaving) = pair[0].at(pair[0].length);
        assert!(end.distance(pair[1].start) < 1e-9 * (1.0 + end.length()));
        k.max(leaving.perp_dot(pair[1].tangent).abs())
    })
}

fn bezier_points(p: &[DVec3], degree: usize, n: u32) -> Vec<DVec2> {
    let de_casteljau = |points: &[DVec3], t: f64| {
        let mut points = points.to_vec();
        while points.len() > 1 {
            points = points.windows(2).map(|w| w[0].lerp(w[1], t)).collect();
        }
        points[0].truncate()
    };
    let pieces: Vec<&[DVec3]> = p.windows(degree + 1).step_by(degree).collect();
    pieces.iter().flat_map(|piece| (0..=n).map(move |k| de_casteljau(piece, f64::from(k) / f64::from(n)))).collect()
}

#[test]
fn arcs_keep_within_the_tolerance_of_bezier_chains_and_meet_smoothly() {
    let cubic = [(0., 0.), (60., 120.), (140., -80.), (200., 20.), (260., 120.), (300., 160.), (420., 90.)];
    let cubic: Vec<DVec3> = cubic.iter().map(|p| DVec3::new(p.0, p.1, 5.0)).collect();
    let quadratic = [(0., 0.), (50., 80.), (120., 40.), (190., 0.), (210., 90.)];
    let quadratic: Vec<DVec3> = quadratic.iter().map(|p| DVec3::new(p.0, p.1, 5.0)).collect();
    let mut before = usize::MAX;
    for tolerance in [0.01, 0.1, 1.0] {
        let mut count = 0;
        for (path, samples) in [
            (Path::Cubic(cubic.clone()), bezier_points(&cubic, 3, 2000)),
            (Path::Quadratic(quadratic.clone()), bezier_points(&quadratic, 2, 2000)),
        ] {
            let arcs = arcs(&path, tolerance);
            let (there, back) = apart(&samples, &arcs);
            assert!(there <= tolerance && back <= tolerance, "{tolerance}: {there} {back}");
            assert!(there > 0.01 * tolerance, "control: exact arcs would mean that the wrong thing is measured");
            assert!(kink(&arcs) < 1e-9);
            count += arcs.len();
        }
        assert!(count < before, "a larger tolerance needs fewer arcs: {count} {before}");
        before = count;
    }
}

#[test]
fn a_smooth_path_goes_through_its_points_and_falls_where_they_fall() {
    let points: Vec<DVec3> = [(0., 0., 90.), (50., 30., 80.), (60., 90., 79.), (10., 120., 79.), (20., 180., 40.)]
        .iter()
        .map(|p| DVec3::new(p.0, p.1, p.2))
        .collect();
    let stretches = Path::Smooth(points.clone()).stretches(0.05, 3.0).unwrap();
    let arcs: Vec<Arc> = stretches.iter().map(|s| s.arc).collect();
    assert!(kink(&arcs) < 1e-9);
    for p in &points {
        let joint =
            stretches.iter().any(|s| s.arc.start.distance(p.truncate()) < 1e-9 && (s.elevation[0] - p.z).abs() < 1e-9);
        assert!(joint || *p == points[4], "{p}");
    }
    assert!(stretches.windows(2).all(|s| s[0].elevation[1] == s[1].elevation[0] && s[0].grade[1] == s[1].grade[0]));
    assert!(greatest_rise(&stretches) <= 1e-12, "{}", greatest_rise(&stretches));
    // Control: one point that rises shows.
    let mut risen = points;
    risen[3].z = 79.5;
    assert!(greatest_rise(&Path::Smooth(risen).stretches(0.05, 3.0).unwrap()) > 0.4);
}

/// How far elevation along the arcs rises above its lowest so far, metres.
fn greatest_rise(stretches: &[Stretch]) -> f64 {
    let (mut lowest, mut rise) = (f64::INFINITY, 0.0f64);
    for stretch in stretches {
        let parameters = stretch.parameters();
        let p = Parameters(&parameters[..]);
        for k in 0..=100 {
            let x = stretch.arc.at(stretch.arc.length * f64::from(k) / 100.0).0;
            let z = elevation::<f64, f64>(p, &place(p, [x.x, x.y]), 0.0).0;
            lowest = lowest.min(z);
            rise = rise.max(z - lowest);
        }
    }
    rise
}

#[test]
fn a_road_is_straight_between_bends_and_no_tighter_than_its_radii() {
    let way =
        |x: f64, y: f64, z: f64, radius: f64| WayPoint { position: DVec3::new(x, y, z), radius, transition: 20.0 };
    let points =
        vec![way(0., 0., 10., 1.), way(150., 0., 14., 40.), way(150., 140., 20., 30.), way(20., 150., 21., 1.)];
    let path = Path::Road(points);
    let stretches = path.stretches(0.01, 2.0).unwrap();
    let arcs: Vec<Arc> = stretches.iter().map(|s| s.arc).collect();
    assert!(kink(&arcs) < 1e-6, "{}", kink(&arcs));
    let tightest = arcs.iter().fold(0.0f64, |k, arc| k.max(arc.curvature.abs()));
    assert!((1.0 / 30.0..1.06 / 30.0).contains(&tightest), "{}", 1.0 / tightest);
    assert!(arcs.iter().filter(|arc| arc.curvature == 0.0).count() == 3);
    assert!(arcs.last().unwrap().end().distance(DVec2::new(20.0, 150.0)) < 1e-9);
    // Curvature goes in steps instead of jumping: that is what a clothoid is for.
    let steps: Vec<f64> = arcs.windows(2).map(|w| (w[1].curvature - w[0].curvature).abs()).collect();
    assert!(steps.iter().all(|step| *step < 0.75 * tightest), "{steps:?}");

    let tight = |radius: f64| vec![way(0., 0., 0., 1.), way(30., 0., 0., radius), way(30., 40., 0., 1.)];
    assert!(Path::Road(tight(10.0)).stretches(0.01, 2.0).is_ok());
    let error = Path::Road(tight(60.0)).stretches(0.01, 2.0).unwrap_err();
    assert!(error.contains("way-points 1 and 2") && error.contains("smaller radii"), "{error}");
}

#[test]
fn malformed_paths_are_refused_with_the_place() {
    let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let fails = |path: Path, words: &str| {
        let error = path.stretches(0.1, 1.0).unwrap_err();
        assert!(error.contains(words), "{error}");
    };
    fails(Path::Polyline(vec![p(0., 0.)]), "expected at least 2");
    fails(Path::Smooth(vec![p(0., 0.), p(1., 0.), p(1., 0.)]), "points 2 and 3");
    fails(Path::Quadratic(vec![p(0., 0.), p(1., 0.), p(2., 1.), p(3., 1.)]), "2 for each piece");
    fails(Path::Polyline(vec![p(0., 0.), p(f64::NAN, 0.)]), "point 2");
    // A cubic that stops and turns back.
    fails(Path::Cubic(vec![p(0., 0.), p(2., 0.), p(-1., 0.), p(1., 0.)]), "cusp");
}

proptest! {
    #[test]
    fn the_generic_distance_is_that_of_the_arc(
        k in -0.05f64..0.05, turn in 0.01f64..0.78, x in -90.0f64..90.0, y in -90.0f64..90.0, heading in -3.1f64..3.1,
    ) {
        let length = if k == 0.0 { 20.0 } else { (turn / k.abs()).min(60.0) };
        let tangent = DVec2::new(libm::cos(heading), libm::sin(heading));
        let arc = Arc { start: DVec2::new(3.0, -4.0), tangent, curvature: k, length };
        let stretch = Stretch { arc, abscissa: 0.0, elevation: [0.0, length], grade: [1.0, 1.0], beyond: [0.0; 2] };
        let parameters = stretch.parameters();
        let p = Parameters(&parameters[..]);
        let here = place::<f64, f64>(p, [x, y]);
        let nearest = (0..=4000).map(|i| length * f64::from(i) / 4000.0).min_by(|a, b| {
            arc.at(*a).0.distance_squared(DVec2::new(x, y)).total_cmp(&arc.at(*b).0.distance_squared(DVec2::new(x, y)))
        }).unwrap();
        let distance = arc.at(nearest).0.distance(DVec2::new(x, y));
        prop_assert!((here.distance - distance).abs() < 1e-4 * length, "{here:?} {distance}");
        prop_assert!((arc.distance(DVec2::new(x, y)) - distance).abs() < 1e-4 * length);
        // Elevation grows by 1 a metre here, and the cubic is within a percent of arc length.
        if distance * k.abs() < 0.7 {
            let (z, s) = elevation::<f64, f64>(p, &here, 0.0);
            prop_assert!((s - nearest).abs() < 0.01 * length && (z - nearest).abs() < 0.01 * length, "{s} {z} {nearest}");
        }
    }
}
