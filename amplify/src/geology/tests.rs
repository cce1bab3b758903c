use super::rock::TAPER_REACH;
use super::*;
use proptest::prelude::*;
use terrain_model::falloff::wyvill;
use terrain_model::noise::hash::mix;
use terrain_model::noise::{Lattice, SIMPLEX3_RANGE, SIMPLEX3_SLOPE};

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from_array)
}
fn normal() -> impl Strategy<Value = DVec3> {
    vector(3.0).prop_filter("a direction", |n| n.length() > 0.1)
}
fn local() -> impl Strategy<Value = Local> {
    prop_oneof![
        (vector(60.0), 5.0..60.0, -1.0..1.0).prop_map(|(centre, radius, change)| Local::Sphere {
            centre,
            radius,
            change
        }),
        (prop::collection::vec(vector(60.0), 2..5), 5.0..60.0, -1.0..1.0)
            .prop_map(|(points, radius, change)| Local::Curve { points, radius, change }),
    ]
}
fn leaf() -> impl Strategy<Value = Node> {
    prop_oneof![
        (0.0..=1.0).prop_map(Node::Constant),
        (4.0..60.0, 1u32..5, 0u32..99).prop_map(|(wavelength, octaves, seed)| Node::Strata {
            wavelength,
            octaves,
            seed
        }),
        (4.0..60.0, 1u32..5, 0u32..99).prop_map(|(wavelength, octaves, seed)| Node::Turbulence {
            wavelength,
            octaves,
            seed
        }),
        (vector(50.0), normal(), 3.0..50.0, 0.0..=1.0, 0.0..=1.0, 4.0..60.0, 1u32..5, 0u32..99).prop_map(
            |(point, normal, radius, resistance, roughness, wavelength, octaves, seed)| Node::Plane {
                point,
                normal,
                radius,
                resistance,
                roughness,
                wavelength,
                octaves,
                seed
            }
        ),
    ]
}
/// Trees of every node, with folds below and above Lip(δ) = 1.
fn tree() -> impl Strategy<Value = Node> {
    leaf().prop_recursive(3, 10, 3, |inner| {
        let child = inner.clone().prop_map(Box::new);
        prop_oneof![
            prop::collection::vec((0.1..5.0, inner), 1..4).prop_map(Node::Blend),
            (child.clone(), prop::collection::vec(local(), 0..4)).prop_map(|(child, by)| Node::Change { child, by }),
            (child.clone(), 0.5..15.0, 20.0..200.0, 1u32..4, 0u32..99).prop_map(
                |(child, amplitude, wavelength, octaves, seed)| Node::Fold {
                    amplitude,
                    wavelength,
                    octaves,
                    seed,
                    allow_overturned: true,
                    child
                }
            ),
            (child.clone(), vector(40.0), 5.0..80.0, 5.0..80.0, -0.99..1.53).prop_map(
                |(child, centre, radius, height, compression)| Node::Taper {
                    centre,
                    radius,
                    height,
                    compression,
                    child
                }
            ),
            (child.clone(), vector(40.0), normal(), vector(20.0), prop::option::of(child)).prop_map(
                |(child, point, normal, translation, against)| {
                    Node::Fault { point, normal, translation, child, against }
                }
            ),
        ]
    })
}

/// `n` points of the box, the same at each call.
fn points(region: &Box3, n: u32) -> Vec<DVec3> {
    let unit = |k: u32| f64::from(mix(17, k)) / f64::from(u32::MAX);
    let at = |k| region.low + (region.high - region.low) * DVec3::new(unit(3 * k), unit(3 * k + 1), unit(3 * k + 2));
    (0..n).map(at).collect()
}

/// The largest difference quotient over `slope`, which the box's bound must hold at 1, between random points and along
/// the gradient of the steepest.
fn steepest(geology: &Geology, region: &Box3, slope: f64) -> f64 {
    let quotient = |a: DVec3, b: DVec3| (geology.value(a) - geology.value(b)).abs() / a.distance(b).max(1e-9);
    let mut all = points(region, 40);
    all.sort_by(|a, b| geology.sample(*b).1.length().total_cmp(&geology.sample(*a).1.length()));
    let mut worst: f64 = 0.0;
    for pair in all.windows(2) {
        worst = worst.max(quotient(pair[0], pair[1]));
    }
    for p in &all[..5] {
        let step = geology.sample(*p).1.normalize_or_zero() * 1e-4;
        let q = (*p + step).clamp(region.low, region.high);
        worst = worst.max(quotient(*p, q));
    }
    worst / slope.max(1e-9)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn any_tree_keeps_its_range_enclosure_and_slope(node in tree(), seed: u32, centre in vector(80.0), half in 0.01..15.0) {
        let geology = Geology::new(seed, node).unwrap();
        let region = Box3::around(centre, half);
        let bounds = geology.bounds(&region);
        prop_assert!(Interval::UNIT.encloses(bounds.range) && bounds.slope >= 0.0);
        for p in points(&region, 30) {
            let rho = geology.value(p);
            prop_assert!(bounds.range.contains(rho), "{rho} {bounds:?}");
            prop_assert!(geology.bounds(&Box3::new(p, p)).range.contains(rho));
            prop_assert_eq!(geology.sample(p).0, rho);
        }
        let ratio = steepest(&geology, &region, bounds.slope);
        prop_assert!(ratio <= 1.0 + 1e-6, "{ratio} {bounds:?}");
    }

    #[test]
    fn any_tree_reads_back_from_its_text(node in tree(), seed: u32) {
        let geology = Geology::new(seed, node).unwrap();
        let again = Geology::parse(&geology.to_ron()).unwrap();
        prop_assert_eq!(again.seed(), seed);
        prop_assert_eq!(again.node(), geology.node());
    }
}

#[test]
fn archetypes_keep_the_unit_range_and_vary() {
    for kind in Archetype::ALL {
        assert_eq!(archetype(kind.name()), Some(kind));
        let geology = kind.geology();
        let values: Vec<f64> =
            points(&Box3::around(DVec3::ZERO, 200.0), 5000).iter().map(|p| geology.value(*p)).collect();
        let (low, high) = values.iter().fold((1.0f64, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(low >= 0.0 && high <= 1.0 && high - low > 0.15, "{}: {low} to {high}", kind.name());
    }
    assert_eq!(archetype("basalt"), None);
}

#[test]
fn the_hunt_convicts_a_bound_that_is_too_small() {
    for kind in Archetype::ALL {
        let geology = kind.geology();
        let mut worst: f64 = 0.0;
        for centre in points(&Box3::around(DVec3::ZERO, 60.0), 100) {
            let region = Box3::around(centre, 0.02);
            let slope = geology.bounds(&region).slope;
            worst = worst.max(if slope.is_finite() { steepest(&geology, &region, slope) } else { 0.0 });
        }
        println!("{}: steepest quotient over its bound {worst:.4}", kind.name());
        assert!(worst <= 1.0 + 1e-6);
        assert!(worst / 0.8 > 1.0, "{}: four fifths of the bound would pass at {worst}", kind.name());
    }
}

#[test]
fn bounds_hold_on_boxes_of_any_size() {
    for kind in Archetype::ALL {
        let geology = kind.geology();
        for half in [1e3, 1e6, 1e12] {
            let region = Box3::around(DVec3::ZERO, half);
            let bounds = geology.bounds(&region);
            assert!(Interval::UNIT.encloses(bounds.range) && bounds.slope > 0.0, "{bounds:?}");
            assert_eq!(bounds.slope.is_finite(), kind != Archetype::Faulted, "{}: {bounds:?}", kind.name());
            for p in points(&region, 50) {
                assert!(bounds.range.contains(geology.value(p)), "{} at {p}", kind.name());
            }
        }
        let all = Box3::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        assert!(Interval::UNIT.encloses(geology.bounds(&all).range));
        assert!(!geology.bounds(&all).slope.is_nan());
    }
}

#[test]
fn the_gradient_is_the_finite_difference() {
    let error = |geology: &Geology, p: DVec3, scale: f64| {
        let h = 1e-5;
        let along = |e: DVec3| (geology.value(p + e * h) - geology.value(p - e * h)) / (2.0 * h);
        let finite = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
        (geology.sample(p).1 * scale - finite).length()
    };
    for kind in Archetype::ALL {
        let geology = kind.geology();
        let mut convicted = false;
        for p in points(&Box3::around(DVec3::ZERO, 100.0), 300) {
            // Creases and faults have one-sided gradients only.
            if geology.bounds(&Box3::around(p, 2e-5)).slope.is_finite() {
                assert!(error(&geology, p, 1.0) < 1e-6, "{} at {p}: {}", kind.name(), error(&geology, p, 1.0));
                convicted |= error(&geology, p, 1.01) > 1e-5;
            }
        }
        assert!(convicted, "{}: a gradient 1 % off passed", kind.name());
    }
}

fn strata() -> Node {
    Node::Strata { wavelength: 20.0, octaves: 3, seed: 5 }
}

#[test]
fn a_fault_is_exact_on_its_boundary() {
    let translation = DVec3::new(3.0, -1.0, 7.5);
    let fault = |normal| Node::Fault {
        point: DVec3::new(40.0, 8.0, -16.0),
        normal,
        translation,
        child: Box::new(Node::Turbulence { wavelength: 20.0, octaves: 3, seed: 5 }),
        against: None,
    };
    let child = Geology::new(9, Node::Turbulence { wavelength: 20.0, octaves: 3, seed: 5 }).unwrap();
    // Multiples of 1/4, so that (p − point)·normal is computed without rounding.
    for (normal, p) in [
        (DVec3::X, DVec3::new(40.0, 3.25, 5.5)),
        (DVec3::new(4.0, 1.0, 2.0), DVec3::new(40.0, 10.0, -17.0)),
        (DVec3::new(-1.0, 2.0, 2.0), DVec3::new(42.5, 9.25, -16.0)),
    ] {
        let geology = Geology::new(9, fault(normal)).unwrap();
        assert_eq!(geology.value(p), child.value(p), "on the boundary");
        let inside = p + normal * 0.015_625;
        assert_eq!(geology.value(inside), child.value(inside - translation));
        let outside = p - normal * 0.015_625;
        assert_eq!(geology.value(outside), child.value(outside));
        let jump = (geology.value(inside) - geology.value(p)).abs();
        assert!(jump > 0.01, "{jump}");
        let meets = geology.bounds(&Box3::new(p, inside));
        assert_eq!(meets.slope, f64::INFINITY);
        assert!(meets.range.contains(geology.value(p)) && meets.range.contains(geology.value(inside)));
        assert!(geology.bounds(&Box3::around(p + normal, 0.01)).slope.is_finite());
        assert!(geology.bounds(&Box3::around(p - normal, 0.01)).slope.is_finite());
    }
}

#[test]
fn a_fault_against_other_rock_has_each_on_its_side() {
    let node = Node::Fault {
        point: DVec3::ZERO,
        normal: DVec3::X,
        translation: DVec3::Z,
        child: Box::new(Node::Constant(0.25)),
        against: Some(Box::new(Node::Constant(0.75))),
    };
    let geology = Geology::new(9, node).unwrap();
    let at = |x: f64| geology.value(DVec3::new(x, 3.0, 1.0));
    assert_eq!([at(-1.0), at(0.0), at(0.25)], [0.75, 0.75, 0.25]);
    assert_eq!(geology.slope(), f64::INFINITY, "constant rock on both sides, and yet a jump");
}

#[test]
fn a_fold_that_may_overturn_is_refused_unless_asked_for() {
    let fold = |amplitude: f64, wavelength: f64, allow_overturned| Node::Fold {
        amplitude,
        wavelength,
        octaves: 1,
        seed: 2,
        allow_overturned,
        child: Box::new(strata()),
    };
    let limit = 100.0 * SIMPLEX3_RANGE / SIMPLEX3_SLOPE;
    assert!(Geology::new(1, fold(0.999 * limit, 100.0, false)).is_ok());
    let error = Geology::new(1, fold(1.001 * limit, 100.0, false)).unwrap_err().to_string();
    assert!(error.starts_with("geology, fold: may overturn") && !error.contains('\n'), "{error}");
    assert!(Geology::new(1, fold(1.001 * limit, 100.0, true)).is_ok());
    // The case of claims P5.
    assert!(Geology::new(1, fold(0.5, 0.25, false)).is_err());
}

#[test]
fn fold_channels_are_independent_and_do_not_drift() {
    let channels = noise::channels(50.0, 3, 8);
    let at = points(&Box3::around(DVec3::ZERO, 5000.0), 4000);
    let sample: Vec<[f64; 3]> = at.iter().map(|p| std::array::from_fn(|k| channels[k].signed(p.to_array()))).collect();
    let mean = |f: &dyn Fn(&[f64; 3]) -> f64| sample.iter().map(f).sum::<f64>() / sample.len() as f64;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let spread = mean(&|s| s[i] * s[i]);
        assert!(mean(&|s| s[i]).abs() < 0.1 * spread.sqrt());
        assert!(mean(&|s| s[i] * s[j]).abs() < 0.1 * spread);
    }
}

#[test]
fn a_taper_is_monotone_up_to_its_limit_and_reaches_no_further_than_stated() {
    let (mut least, mut reach) = (1.0f64, 0.0f64);
    for i in 0..=100_000 {
        let u = Dual::<f64, 1>::variable(f64::from(i) / 100_000.0, 0);
        let shift = u * wyvill(u.square());
        least = least.min(shift.slope[0]);
        reach = reach.max(shift.value);
    }
    assert!((least + 32.0 / 49.0).abs() < 1e-9, "{least}");
    assert!(reach <= TAPER_REACH && reach > 0.999 * TAPER_REACH, "{reach}");
}

#[test]
fn a_taper_compresses_strata_at_its_centre() {
    let centre = DVec3::new(10.0, 20.0, 30.0);
    let taper = Node::Taper { centre, radius: 100.0, height: 100.0, compression: 1.0, child: Box::new(strata()) };
    let (tapered, flat) = (Geology::new(1, taper).unwrap(), Geology::new(1, strata()).unwrap());
    let ratio = tapered.sample(centre).1.z / flat.sample(centre).1.z;
    assert!((ratio - 2.0).abs() < 1e-12, "{ratio}");
    let far = centre + DVec3::new(0.0, 101.0, 7.0);
    assert_eq!(tapered.value(far), flat.value(far));
}

#[test]
fn the_printed_sum_leaves_the_unit_range_and_ours_does_not() {
    // Claims P2: 0.9 + 0.9.
    let hard = || Node::Constant(0.9);
    let single = Geology::new(1, hard()).unwrap().value(DVec3::ZERO);
    assert!((single + single - 1.8).abs() < 1e-12);
    let blend = Geology::new(1, Node::Blend(vec![(1.0, hard()), (1.0, hard())])).unwrap();
    assert!((blend.value(DVec3::ZERO) - 0.9).abs() < 1e-15);
    let raise = Local::Sphere { centre: DVec3::ZERO, radius: 1.0, change: 0.9 };
    let change = Geology::new(1, Node::Change { child: Box::new(hard()), by: vec![raise] }).unwrap();
    assert_eq!(change.value(DVec3::ZERO), 1.0);
}

#[test]
fn the_printed_turbulence_exceeds_one_and_ours_does_not() {
    // Claims P1 with o = 4: Σ 2⁻ᵏ n(2ᵏp), n in [0, 1].
    let printed = |p: DVec3| -> f64 {
        let mut sum = 0.0;
        let mut scale = 1.0;
        for seed in 0..5 {
            let eta = f64::simplex3(Lattice { seed, base: [0; 3] }, (p * scale).to_array());
            sum += 0.5 * (1.0 + eta / SIMPLEX3_RANGE) / scale;
            scale *= 2.0;
        }
        sum
    };
    let ours = noise::Turbulence::new(1.0, 5, 1);
    let at = points(&Box3::around(DVec3::splat(50.0), 40.0), 20_000);
    let printed_max = at.iter().map(|p| printed(*p)).fold(0.0, f64::max);
    let (low, high) =
        at.iter().map(|p| ours.unit(p.to_array())).fold((1.0f64, 0.0f64), |(l, h), t| (l.min(t), h.max(t)));
    println!("printed t reaches {printed_max:.3}; normalised t spans {low:.3} to {high:.3}");
    assert!(printed_max > 1.3 && printed_max < 1.9375);
    assert!(low > 0.0 && low < 0.3 && high > 0.7 && high < 1.0, "{low} to {high}");
}

#[test]
fn noise_depends_on_the_scene_seed_and_the_node_seed_alone() {
    let p = DVec3::new(3.0, 4.0, 5.0);
    let at = |scene, node| Geology::new(scene, node).unwrap().value(p);
    let own = |seed| Node::Strata { wavelength: 20.0, octaves: 3, seed };
    assert_eq!(at(1, own(5)), at(1, Node::Blend(vec![(2.0, own(5))])));
    assert_ne!(at(1, own(5)), at(2, own(5)));
    assert_ne!(at(1, own(5)), at(1, own(6)));
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let file = |geology: &str| format!("(\n format: \"terrain-geology/1\",\n seed: 1,\n geology: {geology},\n)");
    let error = |text: &str| Geology::parse(text).unwrap_err().to_string();
    for (geology, expected) in [
        ("strata(wavelength: 9, octave: 3, seed: 1)", "line 4, column"),
        ("granite(3)", "line 4, column"),
        ("constant(1.5)", "geology, constant: expected 0 to 1, found 1.5"),
        ("constant(NaN)", "geology, constant: expected 0 to 1, found NaN"),
        ("blend([])", "geology, blend: expected at least one"),
        ("blend([(1, constant(0)), (1, strata(wavelength: 0, octaves: 3, seed: 1))])", "geology.blend[1], wavelength"),
        ("strata(wavelength: 9, octaves: 17, seed: 1)", "geology, octaves: expected 1 to 16, found 17"),
        (
            "fault(point: (0,0,0), normal: (0,0,0), translation: (0,0,1), child: constant(0))",
            "geology, length of normal",
        ),
        ("change(child: constant(2), by: [])", "geology.change.child, constant"),
        ("change(child: constant(0), by: [curve(points: [(0,0,0)], radius: 1, change: 1)])", "geology, curve"),
        (
            "taper(centre: (0,0,0), radius: 1, height: 1, compression: 1.6, child: constant(0))",
            "geology, compression: expected above -1 and below 49/32",
        ),
    ] {
        let said = error(&file(geology));
        assert!(said.starts_with(expected) && !said.contains('\n'), "{geology}: {said}");
    }
    assert!(error(&file("constant(0)").replace("/1", "/2")).starts_with("format: expected"));
    assert!(error("(format: \"terrain-geology/1\", seed: 1, geology: constant(0), sea: 1)").starts_with("line 1"));
}
