use super::write::write_frame;
use super::*;
use proptest::prelude::*;

fn example() -> Landscape {
    Landscape::parse(
        r#"(
        format: "terrain-curves/1",
        title: "Höhen",
        origin: (400000, 5200000),
        extent: (4000, 3000),
        water: 3.5,
        detail: (seed: 77, wavelength: 333.25, octaves: 6, lacunarity: 2.1, basis: gradient, scaling: printed,
            from_slope: (amplitude: (0.5, 12.5), roughness: (0.1, 0.9))),
        curves: [
            ("crest", ridge(points: [(400200, 5200500, 1200), (401400, 5201700, 1480), (403900, 5200600, 960.5)], radius: 12, left: (400, -30), right: (350, -27.5), taper: 0.4, noise: (14, 0.6))),
            ("hill", hill(points: [(401000, 5202500, 900), (401600, 5202700, 910)], radius: 40, reach: 200)),
            ("lake", lake(shore: [(402000, 5200500), (402300, 5200600), (402200, 5200800)], level: 3.5, bed: (60, 9), bank: (40, 15), noise: (0, 0))),
            ("crack", crack(points: [(403000, 5202000), (403700, 5202400)], width: 80, depth: 30)),
            ("bent", curve(path: bezier([(400100, 5200300), (400200, 5200400), (400300, 5200400), (400400, 5200300)]), points: [
                (u: 0, slopes: ((10, 5), (20, 6)), noise: (1, 0.25)),
                (u: 0.3, elevation: (500, 3)),
                (u: 0.300001, elevation: (500, 3)),
                (u: 0.300002, elevation: (500, 3), noise: (1, 0.25)),
                (u: 1, elevation: (510, 5), slopes: ((10, 5), (20, 6))),
            ])),
        ],
    )"#,
    )
    .unwrap()
}

/// Asserts that two values differ by no more than `error`, beyond what rounding to `f64` does, and answers by how much of it.
fn near(a: f64, b: f64, error: f64, what: &str) -> f64 {
    let difference = (a - b).abs();
    assert!(difference <= error * (1.0 + 1e-9) + 1e-9 * a.abs().max(1e-9), "{what}: {a} became {b}, error {error}");
    if error > 0.0 { difference / error } else { 0.0 }
}

/// Asserts that `after` is `before` within the stated precision, and answers the largest part of it that was used.
fn within_precision(before: &Landscape, after: &Landscape) -> f64 {
    let precision = before.compact_precision();
    assert_eq!(before.frame(), after.frame(), "the frame is exact");
    let mut most = 0.0f64;
    let mut near = |a, b, error, what| most = most.max(near(a, b, error, what));
    assert_eq!(before.features().len(), after.features().len());
    for (before, after) in before.features().iter().zip(after.features()) {
        assert_eq!(before.path.points().len(), after.path.points().len());
        assert_eq!(std::mem::discriminant(&before.path), std::mem::discriminant(&after.path));
        for (a, b) in before.path.points().iter().zip(after.path.points()) {
            near(a.x, b.x, precision.position[0], "x");
            near(a.y, b.y, precision.position[1], "y");
        }
        assert_eq!(before.points.len(), after.points.len());
        for (a, b) in before.points.iter().zip(&after.points) {
            // Places nearer than a step are pushed apart.
            near(a.place, b.place, 6.0 * precision.place, "u");
            assert_eq!(a.elevation.is_some(), b.elevation.is_some());
            if let (Some(a), Some(b)) = (a.elevation, b.elevation) {
                near(a.height, b.height, precision.height, "height");
                near(a.radius, b.radius, precision.radius, "radius");
            }
            assert_eq!(a.gradient.is_some(), b.gradient.is_some());
            if let (Some(a), Some(b)) = (a.gradient, b.gradient) {
                for (a, b) in [(a.left, b.left), (a.right, b.right)] {
                    near(a.extent, b.extent, precision.extent, "extent");
                    near(a.angle, b.angle, precision.angle, "angle");
                    assert!(a.angle != 0.0 || b.angle == 0.0, "level stays level");
                }
            }
            assert_eq!(a.noise.is_some(), b.noise.is_some());
            if let (Some(a), Some(b)) = (a.noise, b.noise) {
                near(a.amplitude, b.amplitude, precision.amplitude, "amplitude");
                near(a.roughness, b.roughness, precision.roughness, "roughness");
            }
        }
    }
    most
}

#[test]
fn every_number_stays_within_half_a_step() {
    let landscape = example();
    let bytes = landscape.to_compact().unwrap();
    let read = Landscape::from_compact(&bytes).unwrap();
    // Half a step is really used: the precision is no idle bound.
    assert!(within_precision(&landscape, &read) > 0.5);
    let precision = landscape.compact_precision();
    assert!((precision.height - (1480.0 - 3.5) / 131_070.0).abs() < 1e-6, "{precision:?}");
    assert!((precision.extent - 400.0 / 131_070.0).abs() < 1e-9 && (precision.place - 0.5 / 65_535.0).abs() < 1e-12);
    // What has been rounded once stays.
    assert_eq!(Landscape::from_compact(&read.to_compact().unwrap()).unwrap(), read);
}

#[test]
#[should_panic(expected = "height")]
fn a_height_off_by_two_steps_would_be_seen() {
    let landscape = example();
    let mut read = Landscape::from_compact(&landscape.to_compact().unwrap()).unwrap();
    read.features[0].points[1].elevation.as_mut().unwrap().height += 4.0 * landscape.compact_precision().height;
    within_precision(&landscape, &read);
}

#[test]
fn a_straight_ridge_takes_as_many_bytes_as_the_format_says() {
    let ridge = |count: usize| {
        let entry =
            r#"("name", ridge(points: [(1, 5, 10), (9, 5, 12)], left: (4, -30), right: (4, -30), noise: (1, 0.5))),"#;
        let text = format!("(format: \"terrain-curves/1\", extent: (10, 10), curves: [{}])", entry.repeat(count));
        Landscape::parse(&text).unwrap().to_compact().unwrap().len()
    };
    // 1 + 2·4 of path, 1 count; first point 1 + 2 + 4 + 4, last 1 + 2.
    assert_eq!(ridge(2) - ridge(1), 24);
}

#[test]
fn a_curve_that_16_bits_cannot_tell_from_a_point_is_refused() {
    let text = r#"(format: "terrain-curves/1", extent: (1000000, 1000000), curves: [
        ("long", hill(points: [(0, 0, 1), (1000000, 1000000, 1)], reach: 9)),
        ("short", hill(points: [(500, 500, 1), (501, 500, 1)], reach: 9)),
    ])"#;
    let error = Landscape::parse(text).unwrap().to_compact().unwrap_err().to_string();
    assert!(error.starts_with("curves[1]: way-point 0"), "{error}");
}

#[test]
fn every_truncation_and_every_wild_count_is_an_error() {
    let bytes = example().to_compact().unwrap();
    for length in 0..bytes.len() {
        assert!(matches!(Landscape::from_compact(&bytes[..length]), Err(LandscapeError::Bytes { .. })), "{length}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(Landscape::from_compact(&longer).unwrap_err().to_string().contains("expected the end"));
    // The count of curves stands after the frame and the ranges; there, and as the title's length, the largest count.
    let frame = {
        let mut frame = MAGIC.to_vec();
        write_frame(&mut frame, example().frame());
        frame.len() + 56
    };
    for at in [4, frame] {
        let wild = [&bytes[..at], &[255, 255, 255, 127], &bytes[at + 1..]].concat();
        assert!(matches!(Landscape::from_compact(&wild), Err(LandscapeError::Bytes { .. })));
    }
}

#[test]
fn every_flip_of_a_byte_is_an_error_or_a_landscape() {
    let bytes = example().to_compact().unwrap();
    let mut read = 0;
    for at in 0..bytes.len() {
        for flip in [1, 2, 4, 8, 16, 32, 64, 128, 255] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            if let Ok(landscape) = Landscape::from_compact(&changed) {
                // A landscape that was read can be rastered.
                assert!(landscape.curves().iter().all(|curve| curve.length() > 0.0));
                read += 1;
            }
        }
    }
    assert!(read > 100, "{read}");
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..400), magic in any::<bool>()) {
        if magic && bytes.len() > 4 {
            bytes[..4].copy_from_slice(MAGIC);
        }
        let _ = Landscape::from_compact(&bytes);
    }
}
