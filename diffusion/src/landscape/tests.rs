use super::*;
use crate::fields::{Settings, diffuse};

/// A landscape of 1 km with these curves.
fn text(curves: &str) -> String {
    format!("(\n    format: \"terrain-curves/1\",\n    extent: (1000, 1000),\n    curves: [\n{curves}\n    ],\n)")
}

fn level(path: &str, height: &str) -> String {
    format!(
        r#"("level", curve(path: {path}, points: [(u: 0, elevation: ({height}, 10)), (u: 1, elevation: ({height}, 10))])),"#
    )
}

#[test]
fn what_is_written_is_read_again() {
    let landscape = Landscape::parse(
        r#"(
        format: "terrain-curves/1",
        title: "All \"forms\"",
        origin: (-100, 250.5),
        extent: (3000, 2000),
        water: 12.25,
        detail: (seed: 9, wavelength: 333, octaves: 5, basis: gradient, scaling: printed,
            from_slope: (amplitude: (0, 12.5), roughness: (0.1, 0.9))),
        curves: [
            ("crest", ridge(points: [(0, 500, 100), (400, 700, 180), (900, 600, 60.5)], left: (200, -30), right: (150, -27.5), taper: 0.4)),
            ("summit", peak(summit: (1500, 900, 300), arms: [
                (points: [(1800, 900, 100)], left: (90, -40), right: (80, -40)),
                (points: [(1300, 1300, 100), (1200, 1500, 90)], left: (90, -40), right: (80, -40), taper: 0.5),
            ])),
            ("lake", lake(shore: [(2000, 500), (2300, 600), (2200, 800)], level: 12.25, bed: (60, 9), bank: (40, 15))),
            ("bent", curve(path: bezier([(0, 300), (100, 400), (200, 400), (300, 300)]), points: [
                (u: 0, slopes: ((10, 5), (20, 6)), noise: (1, 0.25)),
                (u: 0.3),
                (u: 1, elevation: (5, 0)),
            ])),
        ],
    )"#,
    )
    .unwrap();
    assert_eq!(
        landscape.features().iter().map(|f| f.name.as_str()).collect::<Vec<_>>(),
        ["crest", "summit 1", "summit 2", "lake", "bent"]
    );
    let written = landscape.to_ron();
    let read = Landscape::parse(&written).unwrap();
    assert!(read.to_ron() == written && read.frame() == landscape.frame());
    for (before, after) in landscape.features().iter().zip(read.features()) {
        // The lake's bed has an angle that is computed: it is written to a billionth of a degree.
        assert!(before == after || before.name == "lake", "{before:?} became {after:?}");
        let angles = |feature: &Feature| feature.points[0].gradient.map(|g| g.left.angle);
        assert!(angles(before).zip(angles(after)).is_none_or(|(a, b)| (a - b).abs() < 1e-11));
    }
    assert_eq!(read.features().len(), 5);
}

#[test]
fn noise_from_slopes_reaches_the_curves_and_not_the_file() {
    let ridge = r#"("", ridge(points: [(100, 500, 100), (900, 700, 180)], left: (200, -30), right: (150, -20))),"#;
    let with = text(ridge)
        .replace("    curves", "    detail: (from_slope: (amplitude: (0, 10), roughness: (0, 1))),\n    curves");
    let [plain, derived] = [text(ridge), with].map(|text| Landscape::parse(&text).unwrap());
    assert_eq!(plain.curves()[0].wanted(0.5).noise, None);
    let [amplitude, roughness] = derived.curves()[0].wanted(0.5).noise.unwrap();
    assert!((amplitude - 5.0).abs() < 1e-12 && (roughness - 0.5).abs() < 1e-12);
    assert!(derived.features().iter().flat_map(|feature| &feature.points).all(|point| point.noise.is_none()));
}

#[test]
fn cells_are_square_whatever_the_extent() {
    let mut landscape = Landscape::parse(&text(&level("smooth([(100, 100), (900, 900)])", "5"))).unwrap();
    let domain = landscape.domain(257);
    assert_eq!((domain.width, domain.height, domain.spacing), (257, 257, 1000.0 / 256.0));
    landscape.frame.extent.y = 500.0;
    assert_eq!((landscape.domain(257).width, landscape.domain(257).height), (257, 129));
    landscape.frame.extent = DVec2::new(1e-3, 1e6);
    assert_eq!((landscape.domain(0).width, landscape.domain(0).height), (2, 2));
    assert_eq!((landscape.domain(65).width, landscape.domain(65).height), (2, 65));
}

#[test]
fn errors_name_the_place_and_the_mend() {
    let good = level("smooth([(100, 100), (900, 900)])", "5");
    let refused = |curves: &str| Landscape::parse(&text(curves)).unwrap_err().to_string();
    let points = |points: &str| {
        refused(&format!(r#"{good} ("bad", curve(path: smooth([(1, 1), (9, 9)]), points: [{points}])),"#))
    };
    let cases = [
        ("5:", refused("(\"x\", ridge(points: [(1, 2)])),")),
        ("5:", refused("(\"x\", rigde(points: [])),")),
        ("Unexpected field named `hieght`", refused("(\"x\", lake(hieght: 3)),")),
        (
            "curves[1] \"level\": the curve has length 0",
            refused(&format!("{good}{}", level("bezier([(5, 5), (5, 5), (5, 5), (5, 5)])", "5"))),
        ),
        (
            "curves[0] \"level\": way-point 0 lies where the next one does",
            refused(&level("smooth([(5, 5), (5, 5)])", "5")),
        ),
        ("curves[0] \"level\": 3 control points: expected 4", refused(&level("bezier([(5, 5), (6, 5), (5, 6)])", "5"))),
        (
            "curves[0] \"level\": x of control point 0 is NaN",
            refused(&level("bezier([(NaN, 5), (6, 5), (5, 6), (8, 8)])", "5")),
        ),
        ("constraint point 0: the height is inf", refused(&level("smooth([(5, 5), (6, 6)])", "inf"))),
        ("curves[1] \"bad\": 1 constraint points", points("(u: 0, elevation: (5, 0))")),
        (
            "the last at 1.5: expected at least two, at 0 and at 1",
            points("(u: 0, elevation: (5, 0)), (u: 1.5, elevation: (5, 0))"),
        ),
        (
            "constraint point 2 is at 0.2, after one at 0.4",
            points("(u: 0), (u: 0.4), (u: 0.2), (u: 1, elevation: (5, 0))"),
        ),
        ("no effect", points("(u: 0), (u: 1)")),
        ("0 to 1", points("(u: 0, noise: (1, 2)), (u: 1, noise: (1, 2))")),
        (
            "wholly outside of the landscape, from (1200, 0) to (1300, 0)",
            refused(&level("smooth([(1200, 0), (1300, 0)])", "5")),
        ),
        ("curves: there are none", refused("")),
        (
            "format: expected \"terrain-curves/1\", found \"terrain-curves/2\"",
            Landscape::parse(&text(&good).replace("/1", "/2")).unwrap_err().to_string(),
        ),
        (
            "extent: 0 × 1000 m",
            Landscape::parse(&text(&good).replace("extent: (1000", "extent: (0")).unwrap_err().to_string(),
        ),
        (
            "detail: expected 1 to 16 octaves",
            Landscape::parse(&text(&good).replace("    curves", "detail: (octaves: 0), curves"))
                .unwrap_err()
                .to_string(),
        ),
        (
            "water: expected a finite",
            Landscape::parse(&text(&good).replace("    curves", "water: NaN, curves")).unwrap_err().to_string(),
        ),
    ];
    for (expected, found) in cases {
        assert!(found.contains(expected) && !found.contains('\n'), "expected {expected:?}, found {found:?}");
    }
    assert!(Landscape::parse(&text(&good)).is_ok());
}

#[test]
fn a_curve_that_only_reaches_into_the_landscape_is_none_outside_of_it() {
    // 10 m of plateau: the curve at x = 1005 still counts, that at 1015 does not.
    assert!(Landscape::parse(&text(&level("smooth([(1005, 0), (1005, 900)])", "5"))).is_ok());
    assert!(Landscape::parse(&text(&level("smooth([(1015, 0), (1015, 900)])", "5"))).is_err());
}

#[test]
fn conflicting_heights_are_averaged_where_curves_cross() {
    let curves = [level("smooth([(100, 500), (900, 500)])", "0"), level("smooth([(500, 100), (500, 900)])", "80")];
    let landscape = Landscape::parse(&text(&curves.concat())).unwrap();
    let fields = diffuse(landscape.curves(), landscape.domain(101), &Settings::default()).unwrap();
    let at = |x: usize, y: usize| fields.elevation[y * 101 + x];
    assert_eq!((at(50, 50), at(30, 50), at(50, 30)), (40.0, 0.0, 80.0));
}

#[test]
fn a_shorter_landscape_has_the_first_curves() {
    let curves = ["1", "2", "3"].map(|height| level("smooth([(100, 500), (900, 500)])", height));
    let landscape = Landscape::parse(&text(&curves.concat())).unwrap();
    assert_eq!(landscape.first(2).unwrap().features(), &landscape.features()[..2]);
    assert!(landscape.first(0).is_err());
}
