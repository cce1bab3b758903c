use super::*;
use crate::fields::{Fields, Settings, diffuse};
use crate::raster::rasterise;

/// Least and greatest elevation that a model may have at 129², metres. They leave room for what is not drawn between curves, and none
/// for a wall of slopes that contradict each other.
const RANGES: [(&str, f64, f64); 6] = [
    ("mountain", 700.0, 3300.0),
    ("lake", 370.0, 1900.0),
    ("canyon", 870.0, 1680.0),
    ("hills", 50.0, 320.0),
    ("island", -190.0, 1330.0),
    ("desert", 90.0, 315.0),
];

fn landscape(name: &str) -> Landscape {
    named(name).unwrap().landscape().unwrap()
}

fn solve(landscape: &Landscape, nodes: usize) -> Fields {
    let fields = diffuse(landscape.curves(), landscape.domain(nodes), &Settings::default()).unwrap();
    for report in &fields.reports {
        assert!(report.converged && report.iterations <= 25, "{}: {report:?}", landscape.frame().title);
    }
    fields
}

#[test]
fn every_model_is_read_and_has_the_title_and_the_count_of_table_1() {
    for model in ALL {
        let landscape = model.landscape().unwrap_or_else(|error| panic!("{}: {error}", model.name));
        assert_eq!((landscape.curves().len(), landscape.frame().title.as_str()), (model.curves, model.title));
        let mut names: Vec<&str> = landscape.features().iter().map(|feature| feature.name.as_str()).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{}: two curves of one name", model.name);
    }
    assert!(named("Atlantis").is_none());
}

#[test]
fn every_curve_leaves_a_mark_on_the_raster() {
    for model in ALL {
        let landscape = model.landscape().unwrap();
        let domain = landscape.domain(257);
        for (curve, feature) in landscape.curves().iter().zip(landscape.features()) {
            let nodes = rasterise(std::slice::from_ref(curve), &domain);
            let marked = nodes.nodes().any(|node| node.elevations + node.guides + node.noises > 0);
            assert!(marked, "{}: {}", model.name, feature.name);
        }
    }
}

#[test]
fn every_model_solves_to_elevations_that_its_landform_has() {
    for (name, least, greatest) in RANGES {
        let fields = solve(&landscape(name), 129);
        let (low, high) = fields.elevation.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
            assert!(h.is_finite());
            (low.min(*h), high.max(*h))
        });
        assert!(low >= least && high <= greatest, "{name}: {low} to {high}");
        // The bounds are no wider than they need be.
        assert!(high - low > 0.7 * (greatest - least), "{name}: {low} to {high}");
        assert!(fields.amplitude.iter().all(|a| (0.0..200.0).contains(a)));
        assert!(fields.roughness.iter().all(|r| (0.0..=1.0).contains(r)));
    }
}

#[test]
fn every_model_converges_within_25_iterations_at_257() {
    for (name, ..) in RANGES {
        solve(&landscape(name), 257);
    }
}

#[test]
fn the_canyon_is_one_from_its_first_15_curves_on() {
    let canyon = landscape("canyon");
    for count in CANYON_STAGES {
        let fields = solve(&canyon.first(count).unwrap(), 129);
        let middle = |j: usize| fields.elevation[j * 129 + 64];
        let floor = (40..90).map(middle).fold(f64::INFINITY, f64::min);
        assert!(floor < 960.0 && middle(5) > 1400.0 && middle(123) > 1400.0, "{count}: {floor}");
    }
}

#[test]
fn rivers_never_rise() {
    let mut rivers = 0;
    for model in ALL {
        let landscape = model.landscape().unwrap();
        for (curve, feature) in landscape.curves().iter().zip(landscape.features()) {
            let flows = ["river", "stream", "creek", "brook", "ravine", "wash", "wadi", "gully"];
            if flows.iter().any(|word| feature.name.starts_with(word)) {
                let heights: Vec<f64> =
                    (0..=400).map(|k| curve.wanted(f64::from(k) / 400.0).elevation.unwrap()).collect();
                assert!(heights.windows(2).all(|pair| pair[1] <= pair[0]), "{}: {}", model.name, feature.name);
                rivers += 1;
            }
        }
    }
    assert!(rivers > 70, "{rivers}");
}

/// How far two elevations of one raster are apart, in parts of their range: on average, at most, and the share of nodes that differ by
/// more than a thousandth.
fn difference(a: &[f64], b: &[f64]) -> [f64; 3] {
    let fold = |start: f64, pick: fn(f64, f64) -> f64| a.iter().copied().fold(start, pick);
    let range = fold(f64::NEG_INFINITY, f64::max) - fold(f64::INFINITY, f64::min);
    let parts: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b).abs() / range).collect();
    let share = parts.iter().filter(|part| **part > 1e-3).count();
    let count = parts.len() as f64;
    [parts.iter().sum::<f64>() / count, parts.iter().copied().fold(0.0, f64::max), share as f64 / count]
}

/// A node at the edge of a plateau may be inside before and outside after: single nodes on steep ground differ by what it falls within a
/// cell, here at most a twentieth of the range.
fn same(found: [f64; 3]) -> bool {
    found[0] < 1e-4 && found[1] < 0.05 && found[2] < 0.02
}

#[test]
fn the_compact_form_has_the_size_of_table_1_and_the_same_terrain() {
    for model in ALL {
        let landscape = model.landscape().unwrap();
        let bytes = landscape.to_compact().unwrap();
        let per_curve = bytes.len() as f64 / model.curves as f64;
        // Table 1: 41 to 62 bytes a curve.
        assert!((41.0..62.0).contains(&per_curve), "{}: {per_curve}", model.name);
        let read = Landscape::from_compact(&bytes).unwrap();
        let [before, after] = [&landscape, &read].map(|landscape| solve(landscape, 129).elevation);
        let found = difference(&before, &after);
        assert!(same(found), "{}: {found:?}", model.name);
    }
}

#[test]
fn a_river_that_is_five_metres_off_is_another_terrain() {
    let landscape = landscape("mountain");
    let mut features = landscape.features().to_vec();
    features[0].points.iter_mut().filter_map(|point| point.elevation.as_mut()).for_each(|e| e.height += 5.0);
    let other = Landscape::new(landscape.frame().clone(), features).unwrap();
    let [before, after] = [&landscape, &other].map(|landscape| solve(landscape, 129).elevation);
    assert!(!same(difference(&before, &after)), "{:?}", difference(&before, &after));
}
