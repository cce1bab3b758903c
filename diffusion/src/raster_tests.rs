use super::*;
use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn side(extent: f64, degrees: f64) -> Side {
    Side { extent, angle: degrees.to_radians() }
}

/// A ridge from 100 m to 200 m with a plateau of 6 m, 20 m of slopes to the left and 10 m to the right.
fn points(elevation: bool) -> Vec<ConstraintPoint> {
    let at = |place: f64, height: f64| ConstraintPoint {
        place,
        elevation: elevation.then_some(Elevation { height, radius: 6.0 }),
        gradient: Some(Gradient { left: side(20.0, -45.0), right: side(10.0, -45.0) }),
        noise: Some(Noise { amplitude: 3.0, roughness: 0.5 }),
    };
    vec![at(0.0, 100.0), at(1.0, 200.0)]
}

fn straight(a: DVec2, b: DVec2, points: Vec<ConstraintPoint>) -> Curve {
    Curve::new(vec![a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], points).unwrap()
}

fn hairpin() -> Curve {
    Curve::new(vec![v(30.0, 40.0), v(90.0, 40.0), v(90.0, 62.0), v(30.0, 60.0)], points(true)).unwrap()
}

#[test]
fn a_straight_ridge_has_a_plateau_and_ramped_slopes_cut_square_at_its_ends() {
    let domain = Domain::square(100.0, 101);
    let curve = straight(v(20.0, 50.0), v(80.0, 50.0), points(true));
    let nodes = rasterise(&[curve], &domain).dense();
    let at = |i: usize, j: usize| nodes[j * 101 + i];
    assert_eq!((at(20, 50).elevation, at(80, 56).elevation, at(50, 44).elevation), (100.0, 200.0, 150.0));
    assert_eq!((at(50, 56).elevations, at(50, 57).elevations, at(50, 57).noises, at(50, 56).guides), (1, 0, 0, 0));
    // 26 m to the left, 16 to the right.
    assert_eq!((at(50, 76).guides, at(50, 77).guides, at(50, 34).guides, at(50, 33).guides), (1, 0, 1, 0));
    let Guide { direction, rise, .. } = at(50, 66).guide;
    assert!((direction - v(0.0, 1.0)).length() < 1e-12 && (rise + 0.5).abs() < 1e-12, "half of −1 half way out");
    assert!((at(50, 39).guide.rise + 0.5).abs() < 1e-12 && at(50, 39).guide.direction.y < 0.0);
    assert_eq!((at(19, 50), at(81, 50)), (Node::default(), Node::default()), "square ends");
}

#[test]
fn slopes_of_a_curve_without_elevation_are_inverted() {
    let domain = Domain::square(100.0, 101);
    let nodes = rasterise(&[straight(v(20.0, 50.0), v(80.0, 50.0), points(false))], &domain).dense();
    let node = nodes[60 * 101 + 50];
    assert_eq!((node.elevations, node.guides), (0, 1));
    assert!(node.guide.direction.y < -0.99 && (node.guide.rise - 0.5).abs() < 1e-12, "{node:?}");
    assert_eq!(nodes[50 * 101 + 50].guides, 1, "the curve itself is guided too");
}

#[test]
fn the_nearest_point_rules_at_bends_and_no_node_in_reach_is_left_out() {
    let domain = Domain::square(100.0, 201);
    let curve = hairpin();
    let nodes = rasterise(std::slice::from_ref(&curve), &domain).dense();
    // Brute force over a much finer polyline: nodes whose nearest point is not an end.
    let fine = curve.polyline(1e-5);
    let (mut covered, mut bends) = (0, 0);
    for (k, node) in nodes.iter().enumerate() {
        let p = domain.at(k % 201, k / 201);
        let nearest = fine.iter().min_by(|a, b| a.0.distance(p).total_cmp(&b.0.distance(p))).unwrap();
        let (distance, place) = (nearest.0.distance(p), nearest.1);
        if !(0.002..=0.998).contains(&place) {
            continue;
        }
        let expected = curve.wanted(place).elevation.unwrap();
        // On the symmetry line inside the bend two places are equally near: compare away from ties and borders.
        let second =
            fine.iter().filter(|q| (q.1 - place).abs() > 0.2).map(|q| q.0.distance(p)).fold(f64::INFINITY, f64::min);
        if second - distance < 0.1 || (distance - 6.0).abs() < 0.05 {
            continue;
        }
        assert_eq!(node.elevations, u16::from(distance < 6.0), "{p} at {distance}");
        if distance < 6.0 {
            assert!((node.elevation - expected).abs() < 0.2, "{p}: {} for {expected}", node.elevation);
            covered += 1;
            bends += usize::from(p.x > 70.0);
        } else if distance < 15.9 {
            assert_eq!(node.guides, 1, "{p} at {distance}");
            let away = (p - nearest.0).normalize();
            assert!(node.guide.direction.dot(away) > 0.99, "{p}");
        }
    }
    assert!(covered > 3000 && bends > 500, "{covered} {bends}");
}

#[test]
fn a_crossing_averages_elevations_and_leaves_slopes_to_diffusion() {
    let domain = Domain::square(100.0, 101);
    let constant = |height: f64| {
        points(true)
            .into_iter()
            .map(|mut point| {
                point.elevation = Some(Elevation { height, radius: 6.0 });
                point
            })
            .collect::<Vec<_>>()
    };
    let across = straight(v(50.0, 20.0), v(50.0, 80.0), constant(300.0));
    let nodes = rasterise(&[straight(v(20.0, 50.0), v(80.0, 50.0), constant(100.0)), across], &domain).dense();
    let at = |i: usize, j: usize| nodes[j * 101 + i];
    assert_eq!((at(52, 48).elevations, at(52, 48).elevation), (2, 200.0));
    assert_eq!((at(50, 62).elevations, at(50, 62).elevation, at(50, 62).guides), (1, 300.0, 1));
    assert_eq!(at(58, 58).guides, 2);
}

#[test]
fn bands_and_threads_do_not_matter() {
    let domain = Domain::square(100.0, 150);
    let curves = [hairpin(), straight(v(5.0, 5.0), v(95.0, 90.0), points(true))];
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rasterise(&curves, &domain).dense())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn thin_curves_and_curves_outside_are_no_trouble() {
    let thin = |a, b| {
        let at = |place| ConstraintPoint {
            place,
            elevation: Some(Elevation { height: 7.0, radius: 0.0 }),
            ..ConstraintPoint::default()
        };
        straight(a, b, vec![at(0.0), at(1.0)])
    };
    let domain = Domain::square(100.0, 41);
    let nodes = rasterise(&[thin(v(10.0, 13.0), v(90.0, 71.0))], &domain).dense();
    // No gap: every column between the ends has a node.
    for i in 4..=36 {
        assert!((0..41).any(|j| nodes[j * 41 + i].elevations == 1), "column {i}");
    }
    assert_eq!(rasterise(&[thin(v(-500.0, 0.0), v(-400.0, 900.0))], &domain).nodes().count(), 0);
}

#[test]
fn a_closed_curve_has_no_gap_where_it_closes() {
    // A drop whose tip, where it starts and ends, bends by a right angle.
    let control =
        vec![v(30.0, 50.0), v(50.0, 70.0), v(80.0, 65.0), v(80.0, 50.0), v(80.0, 35.0), v(50.0, 30.0), v(30.0, 50.0)];
    let nodes = rasterise(&[Curve::new(control, points(true)).unwrap()], &Domain::square(100.0, 101)).dense();
    let around_the_tip = |radius: f64| {
        (0..=32).map(move |k| {
            let angle = (135.0 + 90.0 * f64::from(k) / 32.0).to_radians();
            v(30.0, 50.0) + radius * v(libm::cos(angle), libm::sin(angle))
        })
    };
    for p in around_the_tip(4.0).chain(around_the_tip(14.0)) {
        let node = nodes[p.y.round() as usize * 101 + p.x.round() as usize];
        assert!(node.elevations + node.guides > 0, "nothing at {p}");
    }
}
