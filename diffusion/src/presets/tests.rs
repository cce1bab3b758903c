//! Each preset shows the property that defines it, on terrain that is solved.

use super::*;
use crate::fields::{Fields, Settings, diffuse};
use crate::landscape::{Feature, Frame, Landscape};
use crate::raster::Domain;
use glam::DVec2;

/// `presets` in a square of 1 km whose border is held at 100 m.
fn solve(presets: &str, nodes: usize) -> Fields {
    let frame = r#"("border", curve(path: bezier([
        (0, 0), (300, 0), (700, 0), (1000, 0), (1000, 300), (1000, 700), (1000, 1000),
        (700, 1000), (300, 1000), (0, 1000), (0, 700), (0, 300), (0, 0),
    ]), points: [(u: 0, elevation: (100, 0)), (u: 1, elevation: (100, 0))])),"#;
    let text = format!(r#"(format: "terrain-curves/1", extent: (1000, 1000), curves: [{frame} {presets}])"#);
    solved(&Landscape::parse(&text).unwrap(), nodes)
}

fn solved(landscape: &Landscape, nodes: usize) -> Fields {
    let fields = diffuse(landscape.curves(), landscape.domain(nodes), &Settings::default()).unwrap();
    assert!(fields.reports.iter().all(|report| report.converged), "{:?}", fields.reports);
    fields
}

/// The elevation at the node nearest to a place.
fn at(fields: &Fields, x: f64, y: f64) -> f64 {
    let Domain { spacing, width, .. } = fields.domain;
    fields.elevation[(y / spacing).round() as usize * width + (x / spacing).round() as usize]
}

#[test]
fn a_ridge_keeps_its_crest_and_falls_to_both_sides() {
    let fields =
        solve(r#"("", ridge(points: [(250, 500, 300), (750, 500, 250)], left: (120, -45), right: (120, -45))),"#, 129);
    for x in [350.0, 500.0, 650.0] {
        let crest = at(&fields, x, 500.0);
        assert!((crest - (300.0 - 0.1 * (x - 250.0))).abs() < 1.0, "{crest} at {x}");
        for side in [-1.0, 1.0] {
            let profile = [0.0, 30.0, 60.0, 110.0].map(|d| at(&fields, x, 500.0 + side * d));
            assert!(profile.windows(2).all(|pair| pair[1] < pair[0]), "{profile:?}");
            // Half of tan 45° · 120 m, less the 1.5 h/a of the discrete ramp and what is left out at 110 m.
            assert!((profile[0] - profile[3] - 60.0).abs() < 10.0, "{profile:?}");
        }
    }
}

#[test]
fn ridges_of_a_peak_meet_at_its_summit_and_leave_hollows_between() {
    let fields = solve(
        r#"("", peak(summit: (500, 500, 400), arms: [
            (points: [(800, 500, 200)], left: (80, -40), right: (80, -40)),
            (points: [(350, 760, 200)], left: (80, -40), right: (80, -40)),
            (points: [(350, 240, 200)], left: (80, -40), right: (80, -40)),
        ])),"#,
        129,
    );
    assert!((at(&fields, 500.0, 500.0) - 400.0).abs() < 1e-6);
    assert!(fields.elevation.iter().all(|h| *h <= 400.0 + 1e-6));
    // At 200 m from the summit the middle between two arms lies lower than either.
    let around = |degrees: f64| {
        let angle = degrees.to_radians();
        at(&fields, 500.0 + 200.0 * libm::cos(angle), 500.0 + 200.0 * libm::sin(angle))
    };
    assert!(around(60.0) < around(0.0) - 20.0 && around(60.0) < around(120.0) - 20.0);
}

#[test]
fn a_riverbed_falls_along_its_course_between_rising_banks() {
    let fields = solve(
        r#"("", river(points: [(150, 500, 90), (350, 560, 82), (600, 450, 71), (850, 500, 60)], width: 30, bank: (60, 25))),"#,
        129,
    );
    let course =
        Path::Smooth([(150.0, 500.0), (350.0, 560.0), (600.0, 450.0), (850.0, 500.0)].map(DVec2::from).to_vec());
    let control = course.control().unwrap();
    let point = |place| ConstraintPoint {
        place,
        elevation: Some(Elevation { height: 0.0, radius: 0.0 }),
        ..Default::default()
    };
    let line = Curve::new(control, vec![point(0.0), point(1.0)]).unwrap().polyline(1.0);
    let mut before = f64::INFINITY;
    for pair in line.windows(2).step_by(4) {
        let (p, along) = (pair[0].0, (pair[1].0 - pair[0].0).normalize());
        let bed = at(&fields, p.x, p.y);
        // Two nodes may be nearest to neighbouring places: half a cell along the course is 0.2 m of fall.
        assert!(bed <= before + 0.2, "{bed} after {before}");
        before = bed;
        if (0.1..0.9).contains(&pair[0].1) {
            for side in [-1.0, 1.0] {
                let bank = p + along.perp() * (side * 65.0);
                assert!(at(&fields, bank.x, bank.y) > bed + 5.0, "no bank at {p}");
            }
        }
    }
    let rising = River {
        points: vec![DVec3::ZERO, DVec3::new(9.0, 0.0, 1.0)],
        width: 1.0,
        mouth: None,
        bank: Slope(5.0, 9.0),
        noise: None,
    };
    assert!(rising.draw().unwrap_err().contains("rises from 0 m at way-point 0 to 1 m"));
}

#[test]
fn a_cliff_drops_by_its_height_on_one_side_only() {
    let fields = solve(
        r#"("", cliff(points: [(200, 500, 200), (800, 500, 200)], wall: right, drop: 60, steepness: 60, back: (80, -5))),"#,
        129,
    );
    let [top, foot, back] = [0.0, -68.0, 68.0].map(|d| at(&fields, 500.0, 500.0 + d));
    // The wall is 69 m wide, 8.9 cells: 1.5 cells of it are lost (diffusion's upwind reading), 17 %.
    assert!((top - foot - 60.0).abs() < 60.0 * 0.18, "{top} to {foot}");
    assert!(top - back < 8.0 && top - foot > 5.0 * (top - back), "{back} behind");
}

#[test]
fn a_hill_is_level_around_its_curve_and_a_bare_curve_is_not() {
    let hill = r#"("", hill(points: [(400, 500, 180), (600, 500, 180)], reach: 100)),"#;
    let bare = r#"("", curve(path: smooth([(400, 500), (600, 500)]), points: [(u: 0, elevation: (180, 0)), (u: 1, elevation: (180, 0))])),"#;
    let [hill, bare] = [hill, bare].map(|preset| at(&solve(preset, 129), 500.0, 560.0));
    assert!(hill > 172.0 && bare < hill - 10.0, "{hill} and {bare}");
}

#[test]
fn a_crack_is_a_trough_of_about_its_depth_that_follows_the_ground() {
    let slope = r#"("", curve(path: smooth([(100, 60), (100, 940)]), points: [(u: 0, elevation: (300, 0)), (u: 1, elevation: (300, 0))])),"#;
    let crack = format!(r#"{slope} ("", crack(points: [(250, 500), (750, 520)], width: 120, depth: 20)),"#);
    // How far the rims lie below the ground without the crack.
    let drag = |nodes: usize| {
        let (with, without) = (solve(&crack, nodes), solve(slope, nodes));
        assert!(at(&with, 350.0, 504.0) > at(&with, 650.0, 516.0) + 20.0, "it falls with the ground");
        let below = [350.0, 500.0, 650.0].map(|x| {
            let y = 500.0 + 0.04 * (x - 250.0);
            let rims = 0.5 * (at(&with, x, y + 65.0) + at(&with, x, y - 65.0));
            let depth = rims - at(&with, x, y);
            assert!((depth - 20.0).abs() < 6.0, "{depth} m deep at {x}");
            at(&without, x, y) - rims
        });
        below.into_iter().fold(0.0, f64::max)
    };
    // The ramp's first step is not quite level, and the ground outside follows it: less so on a finer raster.
    let [coarse, fine] = [65, 257].map(drag);
    assert!(fine < 0.6 * coarse && fine < 20.0, "{coarse} m, then {fine} m");
}

#[test]
fn noise_alone_leaves_elevations_and_spreads_its_amplitude() {
    let noise = r#"("", noise(points: [(300, 300), (700, 700)], amplitude: 8, roughness: 0.3)),"#;
    let (with, without) = (solve(noise, 65), solve("", 65));
    assert_eq!(with.elevation, without.elevation);
    assert!(with.amplitude.iter().all(|a| (a - 8.0).abs() < 1e-6) && without.amplitude.iter().all(|a| *a == 0.0));
}

#[test]
fn a_lake_is_deep_inside_and_dry_outside_whichever_way_its_shore_runs() {
    let mut shore = ["(350, 350)", "(700, 400)", "(620, 680)", "(380, 650)"];
    for _ in 0..2 {
        let preset = format!(r#"("", lake(shore: [{}], level: 80, bed: (60, 12), bank: (50, 20))),"#, shore.join(", "));
        let fields = solve(&preset, 129);
        // The nearest node lies within half a cell's diagonal of the shore, on slopes of 0.8 at most.
        assert!((at(&fields, 350.0, 350.0) - 80.0).abs() < 0.8 * 5.6);
        // Of the bed's 7.7 cells 1.5 are lost.
        assert!((at(&fields, 520.0, 530.0) - 68.0).abs() < 12.0 * 0.2, "{}", at(&fields, 520.0, 530.0));
        assert!(at(&fields, 250.0, 500.0) > 82.0 && at(&fields, 800.0, 550.0) > 82.0);
        shore.reverse();
    }
}

#[test]
fn a_sea_shore_parts_water_from_land() {
    // The border is not held here: the sea is lower than it.
    let text = r#"(format: "terrain-curves/1", extent: (1000, 1000), curves: [
        ("shore", sea(shore: [(-50, 400), (300, 520), (650, 430), (1050, 560)], water: right, bed: (200, 25), beach: (80, 6))),
        ("hills", hill(points: [(100, 850, 60), (900, 900, 90)], reach: 60)),
    ])"#;
    let fields = solved(&Landscape::parse(text).unwrap(), 129);
    assert!((at(&fields, 300.0, 520.0)).abs() < 1.0);
    assert!((at(&fields, 400.0, 100.0) + 25.0).abs() < 2.0, "{}", at(&fields, 400.0, 100.0));
    assert!((0..=10).all(|k| at(&fields, 100.0 * f64::from(k), 650.0) > 2.0));
    assert!((0..=10).all(|k| at(&fields, 100.0 * f64::from(k), 300.0) < -5.0));
}

#[test]
fn an_island_rises_from_the_sea_to_a_rim_around_a_crater() {
    let island = Island {
        centre: DVec2::new(2000.0, 2000.0),
        shore: 1500.0,
        bed: (350.0, 90.0),
        rim: 350.0,
        height: 800.0,
        crater: 150.0,
        spurs: 7,
        noise: None,
    };
    let drawn = Preset::Island(island.clone()).draw().unwrap();
    assert_eq!(drawn.len(), 10);
    let features = drawn
        .into_iter()
        .map(|drawn| Feature { name: String::new(), path: drawn.path, points: drawn.points })
        .collect();
    let frame = Frame {
        title: String::new(),
        origin: DVec2::ZERO,
        extent: DVec2::splat(4000.0),
        water: Some(0.0),
        detail: Default::default(),
    };
    let fields = solved(&Landscape::new(frame, features).unwrap(), 129);
    let along = |degrees: f64, radius: f64| {
        let angle = degrees.to_radians();
        at(&fields, 2000.0 + radius * libm::cos(angle), 2000.0 + radius * libm::sin(angle))
    };
    for k in 0..14 {
        let degrees = f64::from(k) * 180.0 / 7.0;
        let rim = along(degrees, 350.0);
        assert!((rim - 800.0).abs() < 60.0, "the rim is at {rim}");
        assert!(rim > along(degrees, 100.0) + 80.0, "no crater at {degrees}°");
        let flank: Vec<f64> = (0..8).map(|k| along(degrees, 360.0 + 130.0 * f64::from(k))).collect();
        assert!(flank.windows(2).all(|pair| pair[1] < pair[0]), "{flank:?} at {degrees}°");
        assert!(flank[7] > -30.0 && along(degrees, 1750.0) < -30.0);
    }
    assert!(Island { spurs: 2, ..island.clone() }.draw().unwrap_err().contains("3 to 64"));
    assert!(Island { rim: 1400.0, ..island }.draw().unwrap_err().contains("0.8"));
}

#[test]
fn presets_that_cannot_be_are_refused_in_one_line() {
    let arm = Arm { points: vec![DVec3::X], left: Slope(1.0, -9.0), right: Slope(1.0, -9.0), taper: 1.0 };
    let peak = Peak { summit: DVec3::ZERO, radius: 0.0, arms: vec![arm], noise: None };
    assert!(peak.draw().unwrap_err().contains("at least 2"));
    let cliff = |drop| Cliff {
        points: vec![DVec3::ZERO, DVec3::X],
        radius: 0.0,
        wall: Hand::Left,
        drop,
        steepness: 60.0,
        back: Slope(1.0, 0.0),
        noise: None,
    };
    assert!(cliff(-4.0).draw().unwrap_err().contains("above 0") && cliff(f64::NAN).draw().is_err());
    let ridge = Ridge {
        points: vec![DVec3::ZERO, DVec3::Z],
        radius: 0.0,
        left: Slope(1.0, -9.0),
        right: Slope(1.0, -9.0),
        taper: 1.0,
        noise: None,
    };
    assert!(ridge.draw().unwrap_err().contains("way-point 0 lies where the next one does"));
}
