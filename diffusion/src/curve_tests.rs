use super::*;

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn ridge(places: &[(f64, f64)]) -> Vec<ConstraintPoint> {
    let point = |&(place, height)| ConstraintPoint {
        place,
        elevation: Some(Elevation { height, radius: 5.0 }),
        ..ConstraintPoint::default()
    };
    places.iter().map(point).collect()
}

fn straight() -> Vec<DVec2> {
    vec![v(0.0, 0.0), v(10.0, 0.0), v(20.0, 0.0), v(90.0, 0.0)]
}

#[test]
fn place_is_length_whatever_the_parameter() {
    let curve = Curve::new(straight(), ridge(&[(0.0, 0.0), (1.0, 9.0)])).unwrap();
    assert!((curve.length() - 90.0).abs() < 1e-9);
    for k in 0..=100 {
        let t = k as f64 / 100.0;
        // Exact at ends of parts, where t is a multiple of 1/64; between them the length is taken for linear in t, which is off by
        // ⅛·sup|x″|·(1/64)² at most, and x″ is at most 6·|10 − 40 + 90| = 360.
        let error = (curve.place(0, t) - curve.at(0, t).x / 90.0).abs();
        assert!(error <= 360.0 / (8.0 * 64.0 * 64.0 * 90.0), "{t}: {error}");
    }
}

#[test]
fn length_of_a_quarter_circle_is_within_a_part_in_a_thousand() {
    let k = 0.552_284_75;
    let control = vec![v(1.0, 0.0), v(1.0, k), v(k, 1.0), v(0.0, 1.0)];
    let curve = Curve::new(control, ridge(&[(0.0, 0.0), (1.0, 0.0)])).unwrap();
    assert!((curve.length() / std::f64::consts::FRAC_PI_2 - 1.0).abs() < 1e-3, "{}", curve.length());
}

#[test]
fn polyline_stays_within_its_tolerance_and_a_coarser_one_does_not() {
    let control = vec![
        v(0.0, 0.0),
        v(300.0, 200.0),
        v(-200.0, 250.0),
        v(100.0, 20.0),
        v(400.0, -210.0),
        v(90.0, 90.0),
        v(0.0, 500.0),
    ];
    let curve = Curve::new(control, ridge(&[(0.0, 0.0), (1.0, 0.0)])).unwrap();
    let farthest = |tolerance: f64| {
        let line = curve.polyline(tolerance);
        let distance = |p: DVec2| {
            let to = |pair: &[(DVec2, f64)]| {
                let (a, d) = (pair[0].0, pair[1].0 - pair[0].0);
                p.distance(a + d * ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0))
            };
            line.windows(2).map(to).fold(f64::INFINITY, f64::min)
        };
        let samples = (0..=1000).flat_map(|k| [0, 1].map(|piece| curve.at(piece, k as f64 / 1000.0)));
        samples.map(distance).fold(0.0, f64::max)
    };
    for tolerance in [5.0, 0.5, 0.05] {
        let found = farthest(tolerance);
        assert!(found <= tolerance && found > 0.02 * tolerance, "{tolerance}: {found}");
    }
    assert!(farthest(5.0) > 0.05);
}

#[test]
fn elevations_follow_a_cubic_and_the_rest_is_linear() {
    // A natural spline reproduces straight lines, and is smooth through its knots.
    let line = Spline::through(vec![[0.0, 1.0], [0.3, 1.9], [0.5, 2.5], [1.0, 4.0]]);
    assert!((0..=20).all(|k| (line.at(k as f64 / 20.0).unwrap() - (1.0 + 3.0 * k as f64 / 20.0)).abs() < 1e-12));
    let spline = Spline::through(vec![[0.0, 0.0], [0.25, 3.0], [0.6, -1.0], [1.0, 2.0]]);
    for (u, value) in [(0.0, 0.0), (0.25, 3.0), (0.6, -1.0), (1.0, 2.0)] {
        assert!((spline.at(u).unwrap() - value).abs() < 1e-12);
    }
    let slope = |u: f64, side: f64| (spline.at(u + side * 1e-6).unwrap() - spline.at(u).unwrap()) / (side * 1e-6);
    for u in [0.25, 0.6] {
        assert!((slope(u, 1.0) - slope(u, -1.0)).abs() < 1e-3, "a kink at {u}");
    }
    assert_eq!((spline.at(-1.0), spline.at(2.0)), (Some(0.0), Some(2.0)));
    let linear = Linear(vec![[0.2, 1.0], [0.6, 3.0]]);
    assert_eq!([0.0, 0.4, 0.9].map(|u| linear.at(u)), [Some(1.0), Some(2.0), Some(3.0)]);
    assert_eq!(Linear::default().at(0.5), None);
}

#[test]
fn categories_are_optional_at_each_point() {
    let mut points = ridge(&[(0.0, 10.0), (0.5, 20.0), (1.0, 30.0)]);
    points[1].noise = Some(Noise { amplitude: 4.0, roughness: 0.5 });
    points[2].elevation = None;
    let curve = Curve::new(straight(), points).unwrap();
    let wanted = curve.wanted(0.75);
    assert_eq!(
        (wanted.elevation, wanted.radius, wanted.noise, wanted.sides),
        (Some(20.0), 5.0, Some([4.0, 0.5]), None)
    );
    assert_eq!(curve.reach(), 5.0);
}

#[test]
fn bad_curves_are_refused_with_the_place_and_the_mend() {
    let good = || ridge(&[(0.0, 1.0), (1.0, 2.0)]);
    let refused =
        |control: Vec<DVec2>, points: Vec<ConstraintPoint>| Curve::new(control, points).unwrap_err().to_string();
    let with = |change: &dyn Fn(&mut Vec<ConstraintPoint>)| {
        let mut points = good();
        change(&mut points);
        refused(straight(), points)
    };
    let cases = [
        (refused(vec![v(0.0, 0.0); 4], good()), "length 0"),
        (refused(straight()[..3].to_vec(), good()), "expected 4, 7"),
        (refused(vec![v(0.0, f64::NAN); 4], good()), "y of control point 0 is NaN"),
        (refused(straight(), good()[..1].to_vec()), "at least two"),
        (refused(straight(), ridge(&[(0.0, 1.0), (1.5, 2.0)])), "at 0 and at 1"),
        (refused(straight(), ridge(&[(0.0, 1.0), (f64::NAN, 2.0), (1.0, 2.0)])), "ascend"),
        (refused(straight(), ridge(&[(0.0, 1.0), (0.5, 1.0), (0.5, 2.0), (1.0, 2.0)])), "constraint point 2"),
        (with(&|points| points[1].elevation.as_mut().unwrap().height = f64::INFINITY), "the height is inf"),
        (with(&|points| points[0].elevation.as_mut().unwrap().radius = -1.0), "the radius is -1"),
        (with(&|points| points[1].noise = Some(Noise { amplitude: 1.0, roughness: 1.5 })), "0 to 1"),
        (
            with(&|points| {
                let side = Side { extent: 5.0, angle: 1.6 };
                points[1].gradient = Some(Gradient { left: side, right: side });
            }),
            "89°",
        ),
        (with(&|points| points.iter_mut().for_each(|point| point.elevation = None)), "no effect"),
    ];
    for (message, expected) in cases {
        assert!(message.contains(expected) && !message.contains('\n'), "{message}");
    }
}
