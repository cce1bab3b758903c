use super::*;
use proptest::prelude::*;
use terrain_model::bounds::times_up;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill_steepness};

fn any_noise() -> impl Strategy<Value = Option<Noise>> {
    let some = (-0.95f64..0.95, 0.3f64..20.0, 1u32..5, any::<u32>(), any::<bool>()).prop_map(
        |(amplitude, wavelength, octaves, seed, signed)| Some(Noise { amplitude, wavelength, octaves, seed, signed }),
    );
    prop_oneof![1 => Just(None), 3 => some]
}

/// Spines of up to `points` points, with amplitudes in proportion to their radius.
fn any_spine(points: usize) -> impl Strategy<Value = Spine> {
    let place = prop::array::uniform3(-20.0f64..20.0).prop_map(DVec3::from_array);
    let path = prop_oneof![
        1 => prop::collection::vec(place.clone(), 1..3),
        2 => prop::collection::vec(place.clone(), 1..points),
        1 => (prop::collection::vec(place, 3..5), 0.02f64..1.0).prop_map(|(control, tolerance)| {
            catmull_rom(&control, tolerance).unwrap()
        }),
    ];
    (path, 0.5f64..8.0, -1.5f64..1.5, any_noise()).prop_map(|(points, radius, energy, noise)| {
        let noise = noise.map(|noise| Noise { amplitude: noise.amplitude * radius, ..noise });
        Spine::new(points, radius, energy, noise).unwrap()
    })
}

/// Somewhere from the skeleton to a little beyond the support.
#[derive(Clone, Debug)]
struct Place {
    along: f64,
    direction: DVec3,
    away: f64,
}

fn any_place() -> impl Strategy<Value = Place> {
    (0.0f64..1.0, prop::array::uniform3(-1.0f64..1.0), prop_oneof![5 => 0.0f64..1.1, 1 => Just(0.0)])
        .prop_map(|(along, direction, away)| Place { along, direction: DVec3::from_array(direction), away })
}

impl Place {
    fn of(&self, spine: &Spine) -> DVec3 {
        let at = self.along * (spine.points.len() - 1) as f64;
        let (k, s) = (at.floor() as usize, at.fract());
        let next = spine.points[(k + 1).min(spine.points.len() - 1)];
        let q = spine.points[k].lerp(next, s);
        q + self.direction.normalize_or(DVec3::X) * (self.away * spine.thickness.hi())
    }
}

/// d̃² to segment `k` without any short cut.
fn apart<N: NoiseValue>(spine: &Spine, k: usize, p: [N; 3]) -> N {
    let (q, rest) = spine.nearest(k, p);
    let Some(relief) = &spine.relief else { return squared(rest) / N::constant(spine.radius).square() };
    let distance = N::length(N::length(rest[0], rest[1]), rest[2]);
    (distance / spine.thickness_at(relief, q, rest, distance)).square()
}

/// f by visiting every segment.
fn whole<N: NoiseValue>(spine: &Spine, p: [N; 3]) -> N {
    let segments = (spine.points.len() - 1).max(1);
    let least = (0..segments).fold(N::one(), |best, k| best.min(apart(spine, k, p)));
    N::constant(spine.energy) * wyvill(least)
}

fn variables<N: Real>(p: [N; 3]) -> [Dual<N, 3>; 3] {
    std::array::from_fn(|k| Dual::variable(p[k], k))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn a_spine_is_within_its_bounds_over_every_box(
        spine in any_spine(8), a in any_place(), b in any_place(), size in 0.0f64..1.0,
        u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0),
    ) {
        let corner = a.of(&spine);
        let region = Box3::new(corner, corner.lerp(b.of(&spine), size * size * size));
        let bounds = spine.bounds(&region);
        let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
            .clamp(region.low, region.high);
        let (p, q) = (inside(u), inside(v));
        let enclosure = spine.density(region.intervals());
        let slopes = spine.density(variables(region.intervals()));
        let (_, gradient) = spine.sample(p);
        let uphill = (p + gradient.normalize_or_zero() * 1e-4).clamp(region.low, region.high);
        for (p, q) in [(p, q), (p, uphill), (corner, p)] {
            let (f, g) = (spine.value(p), spine.value(q));
            prop_assert!(bounds.range.contains(f) && bounds.range.contains(g), "{f} and {g} in {bounds:?}");
            let change = (f - g).abs();
            prop_assert!(change <= bounds.slope * p.distance(q) + 1e-13, "{change} over {}: {bounds:?}", p.distance(q));
            prop_assert!(enclosure.contains(f) && slopes.value.contains(f), "{f} in {enclosure:?}");
            let (sampled, gradient) = spine.sample(p);
            prop_assert_eq!(sampled, f);
            prop_assert!(gradient.length() <= bounds.slope * (1.0 + 1e-9) + 1e-12, "{gradient} {bounds:?}");
        }
    }

    #[test]
    fn a_spine_ends_at_its_support(spine in any_spine(8), a in any_place(), size in 0.0f64..3.0) {
        let p = a.of(&spine);
        prop_assert!(spine.support().contains(p) || spine.value(p) == 0.0);
        let region = Box3::new(p, p + size);
        if !region.meets(&spine.support()) {
            prop_assert_eq!(spine.bounds(&region), DensityBounds::ZERO);
        }
    }

    #[test]
    fn the_gradient_is_the_slope_of_the_value(spine in any_spine(8), a in any_place(), k in 0usize..3) {
        let p = a.of(&spine);
        let gradient = spine.sample(p).1;
        const H: f64 = 1e-6;
        let step = DVec3::AXES[k] * H;
        let [low, high] = [p - step, p + step];
        let central = (spine.value(high) - spine.value(low)) / (2.0 * H);
        // Off creases the gradient's own change over the stencil bounds the error.
        let (g0, g1) = (spine.sample(low).1[k], spine.sample(high).1[k]);
        let error = (g0 - gradient[k]).abs().max((g1 - gradient[k]).abs());
        prop_assert!((central - gradient[k]).abs() <= error + 1e-8, "{central} against {}", gradient[k]);
    }

    /// No floating parts: from p the straight way to the skeleton never leaves what p belongs to.
    #[test]
    fn from_every_point_the_field_only_grows_towards_the_skeleton(spine in any_spine(8), a in any_place()) {
        let p = a.of(&spine);
        let segments = 0..(spine.points.len() - 1).max(1);
        let k = segments.min_by(|i, j| {
            apart(&spine, *i, p.to_array()).total_cmp(&apart(&spine, *j, p.to_array()))
        }).unwrap();
        let q = DVec3::from_array(spine.nearest(k, p.to_array()).0);
        for step in 0..=50 {
            let between = spine.value(q.lerp(p, f64::from(step) / 50.0));
            prop_assert!(between.abs() >= spine.value(p).abs() - 1e-9);
        }
        prop_assert!((spine.value(q) - spine.energy).abs() < 1e-12 * spine.energy.abs());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn leaving_out_far_segments_changes_no_bit(
        spine in any_spine(120), places in prop::collection::vec(any_place(), 20), size in 0.0f64..4.0,
    ) {
        for place in places {
            let p = place.of(&spine);
            prop_assert_eq!(spine.value(p).to_bits(), whole(&spine, p.to_array()).to_bits());
            let all = whole(&spine, variables(p.to_array()));
            let (value, gradient) = spine.sample(p);
            prop_assert_eq!(value.to_bits(), all.value.to_bits());
            prop_assert_eq!(gradient.to_array().map(f64::to_bits), all.slope.map(f64::to_bits));
            let region = Box3::new(p, p + size).intervals();
            prop_assert!(whole(&spine, region).encloses(spine.density(region)));
        }
    }
}

/// The control of the property above: groups left out at half their reach are missed.
#[test]
fn leaving_out_nearer_segments_is_noticed() {
    let points = (0..40).map(|k| DVec3::X * f64::from(k)).collect();
    let mut spine = Spine::new(points, 2.0, 1.0, None).unwrap();
    let p = DVec3::new(20.0, 1.5, 0.0);
    assert_eq!(spine.value(p), whole(&spine, p.to_array()));
    spine.factor *= 0.25;
    assert_ne!(spine.value(p), whole(&spine, p.to_array()));
}

fn noise(amplitude: f64, wavelength: f64, signed: bool) -> Option<Noise> {
    Some(Noise { amplitude, wavelength, octaves: 2, seed: 5, signed })
}

/// Two branches, 1.2 m apart, of one line.
fn fork(radius: f64, noise: Option<Noise>) -> Spine {
    let points = [(-0.6, 0.0), (-0.6, 20.0), (0.6, 20.0), (0.6, 0.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    Spine::new(points.to_vec(), radius, 1.0, noise).unwrap()
}

/// Claims P12: at the medial axis of two branches the paper's formula, with the nearest point of the whole skeleton,
/// jumps from rock to air.
#[test]
fn the_nearest_point_of_the_whole_curve_jumps_between_branches_and_ours_does_not() {
    let printed = |d: f64, t: f64| wyvill((d / (1.0 + t)).square());
    assert!((printed(0.6, 0.0) - 0.262).abs() < 5e-4 && (printed(0.6, 0.5) - 0.593).abs() < 5e-4);
    let spine = fork(1.0, noise(0.9, 1.0, true));
    let nearest_point = |p: DVec3| {
        let distance = |k: &usize| squared(spine.nearest(*k, p.to_array()).1);
        let k = (0..3).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap();
        wyvill(apart(&spine, k, p.to_array()).min(1.0))
    };
    const STEP: f64 = 1e-7;
    let (mut jumps, mut changes) = (0, 0.0f64);
    for k in 0..2000 {
        let p = DVec3::new(0.0, 18.0 * f64::from(k) / 2000.0, 0.0);
        let [left, right] = [p - DVec3::X * STEP, p + DVec3::X * STEP];
        let (a, b) = (nearest_point(left), nearest_point(right));
        jumps += usize::from((a - b).abs() > 0.2 && (a > 0.5) != (b > 0.5));
        let change = (spine.value(left) - spine.value(right)).abs();
        changes = changes.max(change);
        assert!(change <= 2.0 * STEP * spine.bounds(&Box3::new(left, right)).slope + 1e-13);
    }
    assert!(jumps > 50 && changes < 1e-5, "{jumps} jumps; ours changes by {changes}");
}

/// Claims P11: the direction is undefined on the skeleton, and g of radius R on d̃, which has no unit, does not end.
#[test]
fn the_field_is_its_energy_on_the_skeleton_and_ends_where_the_thickness_does() {
    for points in [vec![DVec3::ONE], vec![DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0), DVec3::new(3.0, 4.0, 9.0)]] {
        let spine = Spine::new(points, 5.0, -0.75, noise(4.0, 3.0, true)).unwrap();
        for &p in spine.points() {
            assert_eq!(spine.sample(p), (-0.75, DVec3::ZERO));
            let around = Box3::around(p, 1e-3);
            let bounds = spine.bounds(&around);
            assert!(bounds.range.contains(-0.75) && bounds.range.width() < 1e-5 && bounds.slope < 0.5, "{bounds:?}");
            let enclosure = spine.density(variables(around.intervals())).value;
            assert!(enclosure.contains(-0.75) && enclosure.width() < 1e-4, "{enclosure:?}");
        }
    }
    // R = d = 5 and t = 0: g with radius R on d̃ = 1 gives 0.885.
    assert!((wyvill(1.0f64 / 25.0) - 0.885).abs() < 5e-4);
    let plain = Spine::new(vec![DVec3::ZERO], 5.0, 1.0, noise(0.0, 3.0, false)).unwrap();
    assert_eq!(plain.value(DVec3::X * 5.0), 0.0);
    assert!((plain.value(DVec3::X * 2.5) - 0.421875).abs() < 1e-12);
}

#[test]
fn a_noise_that_leaves_no_thickness_is_refused() {
    let around = |radius, noise| Spine::new(vec![DVec3::ZERO], radius, 1.0, noise);
    for (amplitude, signed) in [(1.0, true), (-1.0, true), (-1.0, false), (2.0, true)] {
        let error = around(1.0, noise(amplitude, 3.0, signed)).unwrap_err();
        assert!(matches!(error, SpineError::Thin { .. }));
        let said = error.to_string();
        assert!(said.contains("expected above -1 m") && !said.contains('\n'), "{said}");
    }
    assert!(around(1.0, noise(0.99, 3.0, true)).is_ok());
    // The paper's t, in [0, amplitude], may be of any size.
    assert!(around(1.0, noise(9.0, 3.0, false)).is_ok());
}

#[test]
fn the_relative_distance_is_linear_along_rays() {
    let spine = Spine::new(vec![DVec3::ZERO, DVec3::new(6.0, 0.0, 0.0)], 2.0, 1.0, noise(1.5, 1.0, true)).unwrap();
    for k in 0..500 {
        let turn = f64::from(k) * 0.37;
        let u = DVec3::new(0.0, libm::cos(turn), libm::sin(turn));
        let q = DVec3::X * (f64::from(k % 60) * 0.1);
        let at = |d: f64| apart(&spine, 0, (q + u * d).to_array()).sqrt();
        let unit = at(1.0);
        for d in [0.01, 0.3, 0.5, 2.0, 3.0] {
            assert!((at(d) - d * unit).abs() < 1e-9 * d, "{} {}", at(d), d * unit);
        }
    }
}

/// The radial part alone would be the bound without noise.
#[test]
fn a_slope_bound_without_the_part_across_the_rays_is_exceeded() {
    let spine = Spine::new(vec![DVec3::ZERO, DVec3::X * 9.0], 2.0, 1.0, noise(1.0, 1.0, true)).unwrap();
    let (mut above, mut tightest) = (0, f64::INFINITY);
    for k in 0..2000 {
        let turn = f64::from(k) * 0.37;
        let p = DVec3::new(f64::from(k) * 0.004, libm::cos(turn), libm::sin(turn));
        let region = Box3::around(p, 1e-4);
        let steepest = spine.sample(p).1.length();
        let thickness = Interval::new(apart(&spine, 0, p.to_array()), apart(&spine, 0, p.to_array()));
        let thinnest = (Interval::point(1.0) / Real::sqrt(thickness)).lo() * 0.99;
        let radial = times_up(wyvill_steepness(Interval::new(0.0, 1.0)), 1.0 / thinnest);
        assert!(radial <= WYVILL_SLOPE / thinnest * (1.0 + 1e-12));
        above += usize::from(steepest > radial);
        let bound = spine.bounds(&region).slope;
        assert!(steepest <= bound);
        tightest = tightest.min(bound / steepest);
    }
    assert!(above > 200 && tightest < 1.2, "{above} above the radial part, bound at best {tightest} times the slope");
}

#[test]
fn what_is_not_sound_is_said_in_one_line() {
    let bad = DVec3::new(f64::NAN, 0.0, 0.0);
    let error = |points: Vec<DVec3>, radius: f64, noise: Option<Noise>| {
        Spine::new(points, radius, 1.0, noise).unwrap_err().to_string()
    };
    let line = || vec![DVec3::ZERO, DVec3::X];
    for (said, expected) in [
        (error(vec![], 1.0, None), "a spine without points"),
        (error(vec![DVec3::ZERO, bad], 1.0, None), "point 1 of a spine"),
        (error(vec![DVec3::X, DVec3::X], 1.0, None), "points 0 and 1 of a spine"),
        (error(line(), 0.0, None), "radius of a spine: expected 0.000001"),
        (error(line(), 1.0, noise(f64::NAN, 1.0, true)), "amplitude of a spine"),
        (error(line(), 1.0, noise(0.5, 0.0, true)), "wavelength of a spine"),
        (error(vec![DVec3::X * 1e9], 1.0, noise(0.5, 0.1, true)), "wavelength of a spine: expected 0.93"),
    ] {
        assert!(said.starts_with(expected) && !said.contains('\n'), "{said}");
    }
    assert!(Spine::new(line(), 1.0, f64::INFINITY, None).is_err());
}

#[test]
fn over_all_of_space_the_bounds_are_those_of_the_whole() {
    let all = Box3 { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
    for noise in [None, noise(1.0, 1.0, true)] {
        let bounds = fork(2.0, noise).bounds(&all);
        assert!(bounds.range.lo() >= -1e-12 && bounds.range.contains(1.0) && bounds.range.hi() < 1.0 + 1e-12);
        assert!(bounds.slope >= WYVILL_SLOPE / 2.0 && bounds.slope < 200.0, "{bounds:?}");
    }
}

#[test]
fn a_curve_costs_its_points_and_boxes() {
    let control = [DVec3::ZERO, DVec3::X * 10.0, DVec3::new(10.0, 10.0, 0.0), DVec3::new(0.0, 10.0, 5.0)];
    let spine = Spine::curve(&control, 0.01, 1.0, 1.0, noise(0.5, 1.0, true)).unwrap();
    let segments = spine.points().len() - 1;
    assert!(segments > 40 && spine.bytes() < 1000 + 48 * segments, "{} for {segments}", spine.bytes());
}
