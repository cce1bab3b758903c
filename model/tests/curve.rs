//! What is claimed of curves: a slope bound that holds and is not far off, no jump on the medial axis, skeletons that fall,
//! sections that change slowly, and a cost that does not grow with length.

mod common;

use common::Random;
use glam::{DVec2, DVec3};
use terrain_model::bounds::Region;
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::river::{KINDS, Kind, River};
use terrain_model::primitive::road::Road;
use terrain_model::profile::{Knot, Section};
use terrain_model::program::{Evaluator, Program};
use terrain_model::spline::{Path, WayPoint};
use terrain_model::tree::Tree;

fn program(curve: Curve) -> Program {
    let mut tree = Tree::new();
    let root = tree.push(curve);
    Program::compile(&tree, root).expect("a valid curve")
}

fn knot(distance: f64, height: f64) -> Knot {
    Knot { distance, height, slope: 0.0 }
}

fn valley() -> Vec<Knot> {
    vec![knot(-40.0, 20.0), knot(-8.0, 0.0), knot(8.0, 0.0), knot(40.0, 20.0)]
}

fn points(list: &[(f64, f64, f64)]) -> Vec<DVec3> {
    list.iter().map(|p| DVec3::new(p.0, p.1, p.2)).collect()
}

/// A meander with bends far tighter than its support.
fn meander() -> Vec<DVec3> {
    points(&[(0., 0., 60.), (60., 50., 55.), (120., -50., 50.), (180., 60., 44.), (200., -40., 40.), (300., 0., 33.)])
}

/// The steepest difference quotient over steps of `step` metres that random points and a climb from the best of them find.
fn steepest(program: &Program, lo: DVec2, hi: DVec2, samples: usize) -> f64 {
    let mut random = Random(11);
    let mut evaluator = Evaluator::<f64>::new(program);
    let mut slope = |p: DVec2, angle: f64| {
        let d = DVec2::new(libm::cos(angle), libm::sin(angle)) * 1e-4;
        let (a, b) = (evaluator.height(program, p - d), evaluator.height(program, p + d));
        if a.1 > 1e-9 && b.1 > 1e-9 { (a.0 - b.0).abs() / 2e-4 } else { 0.0 }
    };
    let mut best = (0.0, lo, 0.0);
    for _ in 0..samples {
        let (p, angle) = (DVec2::new(random.range(lo.x, hi.x), random.range(lo.y, hi.y)), random.range(0.0, 3.2));
        let s = slope(p, angle);
        if s > best.0 {
            best = (s, p, angle);
        }
    }
    let mut reach = 10.0;
    for _ in 0..3000 {
        let (p, angle) = (best.1 + random.point(reach), best.2 + random.range(-0.1, 0.1) * reach);
        let s = slope(p, angle);
        if s > best.0 {
            best = (s, p, angle);
        } else {
            reach = f64::max(reach * 0.995, 1e-3);
        }
    }
    best.0
}

#[test]
fn hunted_slopes_stay_below_the_certified_bound_and_come_near_it() {
    // Loosest around bends tighter than the support, where many arcs are about as near.
    let hairpin = points(&[(0., 0., 30.), (100., 0., 25.), (100., 30., 20.), (0., 30., 15.)]);
    for (name, path, radius, looseness) in [
        ("straight", Path::Polyline(points(&[(0., 0., 30.), (200., 0., 10.)])), 60.0, 1.02),
        ("corner", Path::Polyline(points(&[(0., 0., 30.), (100., 0., 20.), (150., 80., 10.)])), 60.0, 1.3),
        ("hairpin", Path::Smooth(hairpin), 40.0, 1.8),
        ("meander", Path::Smooth(meander()), 60.0, 3.0),
    ] {
        let curve = Curve::new(path, radius, valley());
        let program = program(curve);
        let (lo, hi) = program.support().expect("a support");
        let bound = program.bounds(Region::rectangle(lo, hi)).support_slope;
        let found = steepest(&program, lo, hi, 20_000);
        println!("{name}: found {found:.4}, bound {bound:.4}");
        assert!(found <= bound * (1.0 + 1e-6), "{name}: {found} above {bound}");
        assert!(found * looseness > bound, "{name}: {found} far below {bound}");
    }
}

/// Claims G22: hairpin legs at z = 10 and 0 whose nearest-point elevation jumps by 10 between them.
#[test]
fn elevation_does_not_jump_between_the_legs_of_a_hairpin() {
    let legs = points(&[(0., 1., 10.), (40., 1., 10.), (40., -1., 0.), (0., -1., 0.)]);
    let joint = 1.0;
    let curve = Curve { joint, ..Curve::new(Path::Polyline(legs), 4.0, vec![]) };
    let program = program(curve);
    let largest_step = |h: f64| {
        (-1000..1000).fold(0.0f64, |s, k| {
            let y = f64::from(k) * 2.0 / 1000.0;
            s.max((program.height(DVec2::new(10.0, y)).0 - program.height(DVec2::new(10.0, y + h)).0).abs())
        })
    };
    // A jump would not shrink with the step.
    let (coarse, fine) = (largest_step(1e-2), largest_step(1e-5));
    assert!(fine < 2e-3 * coarse && coarse > 0.1, "{coarse} {fine}");
    assert!((program.height(DVec2::new(10.0, 0.0)).0 - 5.0).abs() < 1e-9);
    assert!((program.height(DVec2::new(10.0, 0.9)).0 - 10.0).abs() < 1e-9);
}

/// Claims G22: beside a bend of radius ρ the grade z′ becomes z′/(1 − d/ρ).
#[test]
fn slope_beside_a_bend_is_that_of_the_claims() {
    let (rho, d) = (100.0, 60.0);
    let angle = |k: i32| 0.15 * f64::from(k);
    let arc: Vec<DVec3> = (0..12)
        .map(|k| DVec3::new(rho * libm::cos(angle(k)), rho * libm::sin(angle(k)), -0.1 * rho * angle(k)))
        .collect();
    let curve = Curve { joint: 4.0, tolerance: 1e-3, ..Curve::new(Path::Smooth(arc), 70.0, vec![]) };
    let program = program(curve);
    let mut total = 0.0;
    for k in 0..100 {
        let at = angle(3) + 0.005 * f64::from(k);
        let p = (rho - d) * DVec2::new(libm::cos(at), libm::sin(at));
        total += program.sample(p).gradient.length() / 100.0;
    }
    assert!((total / (0.1 / (1.0 - d / rho)) - 1.0).abs() < 0.02, "{total}");
}

/// The same points with less than half of their turns.
fn gentle(mut list: Vec<DVec3>) -> Vec<DVec3> {
    list.iter_mut().for_each(|p| p.y *= 0.5);
    list
}

#[test]
fn a_river_that_falls_along_its_points_falls_along_its_bed() {
    let rise = |path: Path, joint: f64| {
        let stretches = path.stretches(0.3, joint).expect("a path");
        let profile = vec![knot(-30.0, 20.0), knot(-8.0, 0.0), knot(8.0, 0.0), knot(30.0, 20.0)];
        let program = program(Curve { joint, tolerance: 0.3, ..Curve::new(path, 40.0, profile) });
        let mut evaluator = Evaluator::<f64>::new(&program);
        let (mut lowest, mut rise, mut fall) = (f64::INFINITY, 0.0f64, 0.0);
        for stretch in &stretches {
            for k in 0..200 {
                let x = stretch.arc.at(stretch.arc.length * f64::from(k) / 200.0).0;
                let z = evaluator.height(&program, x).0;
                fall += (lowest - z).max(0.0);
                lowest = lowest.min(z);
                rise = rise.max(z - lowest);
            }
        }
        (rise, if fall.is_finite() { fall } else { 0.0 })
    };
    let mut worst = 0.0f64;
    for seed in 0..8 {
        let mut random = Random(seed);
        let (mut x, mut z) = (0.0, 80.0);
        let list: Vec<DVec3> = (0..9)
            .map(|_| {
                x += random.range(50.0, 120.0);
                z -= if random.below(4) == 0 { 0.0 } else { random.range(0.0, 6.0) };
                DVec3::new(x, random.range(-40.0, 40.0), z)
            })
            .collect();
        // Where a polyline turns by more than a right angle the mean reaches over to the next segment.
        for path in [Path::Smooth(list.clone()), Path::Quadratic(list.clone()), Path::Polyline(gentle(list))] {
            worst = worst.max(rise(path, 4.0).0);
        }
    }
    println!("greatest rise {worst:e} m");
    assert!(worst < 1e-9, "{worst}");
    // Control: a point that lies 1 cm too high is found.
    let mut wrong = meander();
    wrong[3].z = wrong[2].z + 0.01;
    assert!(rise(Path::Smooth(wrong), 4.0).0 > 0.005);
}

#[test]
fn sections_change_along_the_skeleton_without_a_step() {
    let path = Path::Polyline(points(&[(0., 0., 0.), (100., 0., 0.)]));
    let flat = |height: f64| vec![knot(-5.0, height), knot(5.0, height)];
    let section = |at: f64, height: f64| Section { at, profile: flat(height) };
    let sections = vec![section(20.0, 1.0), section(40.0, 11.0), section(80.0, 3.0)];
    let program = program(Curve { sections, ..Curve::new(path, 30.0, vec![]) });
    let z = |x: f64| program.height(DVec2::new(x, 2.0)).0;
    for (x, expected) in [(0.0, 1.0), (20.0, 1.0), (30.0, 6.0), (40.0, 11.0), (60.0, 7.0), (80.0, 3.0), (100.0, 3.0)] {
        assert!((z(x) - expected).abs() < 1e-12, "{x}: {}", z(x));
    }
    // C¹: slopes either side of a section agree. Steepest in the middle, 1.5 times the mean (claims G22).
    let slope = |x: f64| (z(x + 1e-6) - z(x - 1e-6)) / 2e-6;
    assert!(slope(40.0).abs() < 1e-5 && slope(20.0).abs() < 1e-5);
    assert!((slope(30.0) - 1.5 * 10.0 / 20.0).abs() < 1e-5);
}

#[test]
fn a_curve_of_hundreds_of_arcs_costs_little_more_than_a_short_one() {
    let wave = |count: u32| -> Vec<DVec3> {
        (0..count)
            .map(|k| DVec3::new(40.0 * f64::from(k), if k % 2 == 0 { 15.0 } else { -15.0 }, -f64::from(k)))
            .collect()
    };
    let cost = |count: u32| {
        let curve = Curve::new(Path::Smooth(wave(count)), 30.0, valley());
        let arcs = curve.path.stretches(curve.tolerance, curve.joint).expect("a path").len();
        let program = program(curve);
        let mut evaluator = Evaluator::<f64>::new(&program);
        let time = |evaluator: &mut Evaluator<f64>| {
            let start = std::time::Instant::now();
            let mut random = Random(5);
            let mut sum = 0.0;
            for _ in 0..20_000 {
                let p = DVec2::new(random.range(100.0, 40.0 * f64::from(count) - 100.0), random.range(-25.0, 25.0));
                sum += evaluator.height(&program, p).0;
            }
            assert!(sum < 0.0);
            start.elapsed().as_secs_f64() / 20_000.0
        };
        (arcs, (0..5).map(|_| time(&mut evaluator)).fold(f64::INFINITY, f64::min))
    };
    let (short, long) = (cost(12), cost(300));
    println!("{} arcs: {:.0} ns; {} arcs: {:.0} ns", short.0, short.1 * 1e9, long.0, long.1 * 1e9);
    assert!(long.0 > 20 * short.0, "{short:?} {long:?}");
    // Without runs it would be the ratio of the numbers of arcs.
    assert!(long.1 < 8.0 * short.1, "{short:?} {long:?}");
}

#[test]
fn rivers_of_every_kind_are_wider_than_deep_and_say_where_they_rise() {
    let course = points(&[(0., 0., 60.), (200., 90., 50.), (400., -60., 44.), (600., 0., 44.)]);
    for measures in KINDS {
        let river = River { kind: measures.kind, path: Path::Smooth(course.clone()), width: None, depth: None };
        let curve = river.curve().expect("a river");
        let program = program(Curve { path: Path::Polyline(points(&[(0., 0., 0.), (900., 0., 0.)])), ..curve });
        let z = |d: f64| program.height(DVec2::new(450.0, d));
        let edge = 0.5 * measures.width + measures.bank;
        assert!((z(edge).0 - measures.depth).abs() < 1e-9 && (z(-edge).0 - measures.depth).abs() < 1e-9);
        assert!(z(edge).1 > 1.0, "a replacement takes the river alone up to its banks");
        let bottom = (-100..=100).map(|k| z(0.5 * measures.width * f64::from(k) / 100.0).0);
        let bottom: Vec<f64> = bottom.collect();
        // Channels are the stretches below half of the depth.
        let low = |z: f64| z < 0.5 * measures.depth;
        let channels = 1 + bottom.windows(2).filter(|w| !low(w[0]) && low(w[1])).count();
        assert_eq!(channels, measures.channels.len(), "{:?}", measures.kind);
        assert!(bottom.iter().all(|z| *z >= -1e-9));
    }
    let mut wrong = course;
    wrong[2].z = 50.5;
    let error = River { kind: Kind::Stream, path: Path::Smooth(wrong), width: None, depth: None }.curve().unwrap_err();
    assert!(error.contains("point 2 (z = 50)") && error.contains("point 3 (z = 50.5)"), "{error}");
}

#[test]
fn a_road_keeps_its_grade_and_its_cross_fall() {
    let way =
        |x: f64, y: f64, z: f64, radius: f64| WayPoint { position: DVec3::new(x, y, z), radius, transition: 15.0 };
    let points =
        vec![way(0., 0., 10., 1.), way(150., 0., 17., 40.), (way(150., 140., 24., 30.)), way(20., 150., 27., 1.)];
    let road = Road::new(points.clone(), 6.0);
    let curve = road.curve().expect("a road");
    let stretches = curve.path.stretches(curve.tolerance, curve.joint).unwrap();
    let program = program(curve);
    let (mut grade, mut fall) = (0.0f64, 0.0f64);
    for stretch in &stretches {
        for k in 0..50 {
            let (p, along) = stretch.arc.at(stretch.arc.length * (f64::from(k) + 0.5) / 50.0);
            for d in [-2.9, -1.5, 1.0, 2.9] {
                let slope = program.sample(p + d * along.perp()).gradient;
                // Beside a bend of radius ρ grade grows by 1/(1 − d/ρ).
                grade = grade.max(slope.dot(along).abs() * (1.0 - d * stretch.arc.curvature));
                fall = fall.max((slope.dot(along.perp()) * d.signum() + 0.025).abs());
            }
        }
    }
    println!("grade {grade:.4}, cross-fall off by {fall:.5}");
    assert!(grade <= 1.05 * road.grade_limit && grade > 0.04, "{grade}");
    assert!(fall < 2e-3, "{fall}");
    let mut steep = points;
    steep[2].position.z = 40.0;
    let error = Road::new(steep, 6.0).curve().unwrap_err();
    assert!(error.contains("near way-point") && error.contains("at most 12.0 %"), "{error}");
}
