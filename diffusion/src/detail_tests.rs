use super::*;
use crate::curve::Side;

const BOTH: [Basis; 2] = [Basis::Bilinear, Basis::Gradient];

/// The largest |N| found for A = 1 by random positions, each improved by steps that shrink.
fn hunt(detail: &Detail, roughness: f64) -> f64 {
    let unit = |word: u32| f64::from(word) / 4_294_967_296.0;
    let mut most = 0.0f64;
    for start in 0..300u32 {
        let mut best = DVec2::new(unit(mix(1, start)), unit(mix(2, start))) * 4000.0;
        let mut value = detail.at(best, 1.0, roughness).abs();
        let mut step = 0.5 * detail.wavelength;
        for k in 0..160u32 {
            let word = mix(start, k);
            let next = best + step * DVec2::new(unit(mix(word, 3)) - 0.5, unit(mix(word, 4)) - 0.5);
            let found = detail.at(next, 1.0, roughness).abs();
            if found > value {
                (best, value) = (next, found);
            }
            step *= 0.96;
        }
        most = most.max(value);
    }
    most
}

#[test]
fn normalised_noise_stays_within_its_amplitude_and_printed_noise_does_not() {
    for basis in BOTH {
        for roughness in [0.0, 0.5, 1.0] {
            let detail = Detail { basis, ..Detail::default() };
            let found = hunt(&detail, roughness);
            assert!(found <= 1.0 && found > 0.6, "{basis:?} at R = {roughness}: {found} of 1");
            let printed = Detail { scaling: Scaling::Printed, ..detail };
            let found = hunt(&printed, roughness);
            assert!(found <= printed.range(roughness) && found > 1.1, "{basis:?} at R = {roughness}: {found}");
        }
    }
}

#[test]
fn the_printed_sum_has_the_range_of_claim_h7() {
    let printed = Detail { scaling: Scaling::Printed, ..Detail::default() };
    assert_eq!([0.0, 1.0].map(|r| printed.range(r)), [1.875, 4.0]);
    assert_eq!(Detail::default().range(1.0), 1.0);
}

#[test]
fn one_octave_takes_its_lattice_values_and_is_bilinear_between_them() {
    let basis = |x: f64, y: f64| {
        // Undo the shift, so that whole coordinates are lattice points.
        let shift = |axis: u32| f64::from(mix(9, axis)) / 4_294_967_296.0;
        Basis::Bilinear.at(9, DVec2::new(x - shift(0), y - shift(1)))
    };
    let corner = |x: u32, y: u32| f64::from(Keys::new(9).point2(x, y)) / 2_147_483_647.5 - 1.0;
    assert!((basis(3.0, 5.0) - corner(3, 5)).abs() < 1e-9);
    let middle = 0.25 * (corner(3, 5) + corner(4, 5) + corner(3, 6) + corner(4, 6));
    assert!((basis(3.5, 5.5) - middle).abs() < 1e-9);
    assert!((basis(-1.0, 2.0) - corner(u32::MAX, 2)).abs() < 1e-9, "west of the origin");
}

#[test]
fn noise_belongs_to_places_and_not_to_nodes() {
    let settings = Detail { seed: 5, ..Detail::default() };
    let on = |nodes: usize| {
        let domain = Domain::square(1000.0, nodes);
        let fields = [vec![3.0; nodes * nodes], vec![0.7; nodes * nodes]];
        detail(&domain, &fields[0], &fields[1], |p, a, r| settings.at(p, a, r))
    };
    let (coarse, fine) = (on(33), on(65));
    for j in 0..33 {
        for i in 0..33 {
            assert_eq!(coarse[j * 33 + i], fine[2 * j * 65 + 2 * i]);
        }
    }
    assert!(coarse.iter().any(|n| n.abs() > 0.5) && coarse.iter().all(|n| n.abs() <= 3.0));
    let other = Detail { seed: 6, ..settings };
    assert!((other.at(DVec2::ZERO, 1.0, 0.5) - settings.at(DVec2::ZERO, 1.0, 0.5)).abs() > 1e-3);
}

#[test]
fn roughness_weighs_octaves_and_amplitude_scales() {
    for basis in BOTH {
        let settings = Detail { basis, ..Detail::default() };
        // Mean |N(x + 1 m) − N(x)|: the finer octaves are the steeper ones.
        let steepness = |roughness: f64| {
            let value = |k: u32| settings.at(DVec2::new(f64::from(k), 17.3), 1.0, roughness);
            (0..3000).map(|k| (value(k + 1) - value(k)).abs()).sum::<f64>() / 3000.0
        };
        assert!(steepness(1.0) > 1.3 * steepness(0.5) && steepness(0.5) > 1.2 * steepness(0.0), "{basis:?}");
    }
    let p = DVec2::new(123.4, 567.8);
    let settings = Detail::default();
    assert!((settings.at(p, 7.0, 0.4) - 7.0 * settings.at(p, 1.0, 0.4)).abs() < 1e-12);
}

#[test]
fn any_generator_can_be_driven() {
    let domain = Domain::square(10.0, 11);
    let amplitude: Vec<f64> = (0..121).map(|k| f64::from(k % 2)).collect();
    let made = detail(&domain, &amplitude, &[0.25; 121], |p, a, r| a * p.x + r);
    assert_eq!((made[7], made[8]), (7.25, 0.0));
}

#[test]
fn noise_follows_slopes_only_where_none_is_given() {
    let from = FromSlope { amplitude: [1.0, 21.0], roughness: [0.2, 0.8] };
    let side = |degrees: f64, extent| Side { extent, angle: degrees.to_radians() };
    let gradient = Gradient { left: side(-30.0, 50.0), right: side(80.0, 0.0) };
    let noise = from.noise(&gradient);
    assert!((noise.amplitude - 11.0).abs() < 1e-12 && (noise.roughness - 0.5).abs() < 1e-12, "{noise:?}");
    let level = from.noise(&Gradient { left: side(0.0, 50.0), right: side(0.0, 50.0) });
    assert_eq!(level, Noise { amplitude: 1.0, roughness: 0.2 });
    let point = |place, given: Option<Noise>| ConstraintPoint {
        place,
        gradient: Some(gradient),
        noise: given,
        ..ConstraintPoint::default()
    };
    assert_eq!(from.complete(&[point(0.0, None), point(1.0, None)])[1].noise, Some(noise));
    let own = [point(0.0, Some(level)), point(1.0, None)];
    assert_eq!(from.complete(&own), own);
}

#[test]
fn unsound_settings_are_named() {
    let good = Detail::default();
    assert_eq!(good.problem(), None);
    let bad = [
        (Detail { wavelength: f64::NAN, ..good }, "wavelength"),
        (Detail { octaves: 0, ..good }, "octaves"),
        (Detail { octaves: 4_000_000_000, ..good }, "octaves"),
        (Detail { lacunarity: f64::INFINITY, ..good }, "lacunarity"),
        (Detail { from_slope: Some(FromSlope { amplitude: [0.0, -1.0], roughness: [0.0; 2] }), ..good }, "from slopes"),
        (Detail { from_slope: Some(FromSlope { amplitude: [0.0; 2], roughness: [0.0, 1.1] }), ..good }, "from slopes"),
    ];
    for (detail, word) in bad {
        assert!(detail.problem().is_some_and(|problem| problem.contains(word)), "{detail:?}");
    }
}
