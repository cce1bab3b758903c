//! `terrain amplify` as a shell sees it.

mod shell;

use glam::DVec2;
use shell::{ok, one_line, text};
use std::path::Path;
use terrain_model::grid::{Crs, Grid};
use terrain_model::io;

/// A cliff of 24 m along x = 540 m over 80 m of ground.
fn raster(path: &Path) {
    let values = (0..41 * 41).map(|k| if k % 41 < 20 { -8.0 } else { 16.0 + ((k / 41) % 5) as f32 }).collect();
    let grid = Grid::new(DVec2::new(500.0, 700.0), DVec2::splat(2.0), 41, 41, values).unwrap();
    io::write_grid(path, &grid.with_crs(Some(Crs::local_metres()))).unwrap();
}

/// White in the southern half: rows of the file run from north to south.
fn mask(path: &Path) {
    let values = (0..20 * 20).map(|k| if k / 20 < 10 { 1.0 } else { 0.0 }).collect();
    let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 20, 20, values).unwrap();
    io::write_grid(path, &grid).unwrap();
}

const RECIPE: &str = "(format: \"terrain-recipe/1\", geology: \"horizontal_strata\", floor: -30, landforms: [
    (make: sea(reach: 6, openness: 15, erosion: (spacing: 2.5, radius: 5, strength: 1.6, steps: 2)), mask: \"south.png\"),
    (make: arch(from: (520, 760, -10), to: (536, 770, -10), rise: 9, thickness: 4)),
])";

#[test]
fn a_raster_gets_its_landforms_and_the_report_and_the_maps_say_which() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (dem, recipe, out, report, maps) = (at("a.tif"), at("r.ron"), at("a.glb"), at("a.json"), at("maps"));
    raster(&dem);
    mask(&at("south.png"));
    std::fs::write(&recipe, RECIPE).unwrap();
    let arguments = ["amplify", text(&dem), "--recipe", text(&recipe), "--out"];
    let rest = ["--seed", "4", "--report", text(&report), "--maps", text(&maps)];
    let said = ok(&[&arguments[..], &[text(&out)], &rest].concat());
    assert!(said.contains("closed") && said.contains(" sea, ") && said.contains(" arch;"), "{said}");
    let glb = std::fs::read(&out).unwrap();
    let head = String::from_utf8_lossy(&glb[..4000]).into_owned();
    assert!(head.contains("_RESISTANCE") && head.contains("_STRESS"));
    let account: serde_json::Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
    let number = |name: &str| account[name].as_u64().unwrap();
    assert_eq!((number("seed"), number("holes"), number("non_manifold_edges")), (4, 0, 0));
    let each: u64 = account["landforms"].as_array().unwrap().iter().map(|l| l["primitives"].as_u64().unwrap()).sum();
    assert!(each > 20 && each == number("primitives"));
    // The mask keeps waves in the south, where the cliff is.
    let stress = io::read_grid(&maps.join("stress.tif")).unwrap();
    let most = |rows: std::ops::Range<usize>| {
        stress.values()[rows.start * 41..rows.end * 41].iter().copied().fold(0.0f32, f32::max)
    };
    assert!(most(0..18) >= 0.0 && most(24..41) == 0.0);
    let effects = io::read_grid(&maps.join("effects.tif")).unwrap();
    assert!(effects.values().iter().any(|e| *e >= 2.0), "something is roofed");
    assert!(io::read_grid(&maps.join("resistance.tif")).unwrap().values().iter().all(|r| (0.0..=1.0).contains(r)));
    // Threads change nothing, the seed does.
    let again = at("b.glb");
    ok(&[&arguments[..], &[text(&again)], &["--seed", "4", "--threads", "1"]].concat());
    assert_eq!(glb, std::fs::read(&again).unwrap());
    ok(&[&arguments[..], &[text(&again)], &["--seed", "5"]].concat());
    assert_ne!(glb, std::fs::read(&again).unwrap());
}

#[test]
fn what_is_wrong_is_said_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (dem, recipe, out) = (at("a.tif"), at("r.ron"), at("a.glb"));
    raster(&dem);
    mask(&at("south.png"));
    let arguments = ["amplify", text(&dem), "--recipe", text(&recipe), "--out", text(&out)];
    one_line(&arguments, &["r.ron"]);
    let with = |from: &str, to: &str, parts: &[&str]| {
        std::fs::write(&recipe, RECIPE.replace(from, to)).unwrap();
        one_line(&arguments, parts);
    };
    with("openness", "opennes", &["r.ron", "line 2", "opennes"]);
    with("radius: 5", "radius: -5", &["r.ron", "landform 1", "sea: radius is -5", "0.01 to 10000"]);
    with("south.png", "east.png", &["r.ron", "east.png"]);
    with("horizontal_strata", "granite", &["r.ron", "granite", "sandstone"]);
    with("recipe/1", "recipe/9", &["r.ron", "terrain-recipe/1"]);
    std::fs::write(&recipe, RECIPE).unwrap();
    one_line(&["amplify", text(&dem), "--recipe", text(&recipe), "--out", text(&at("a.stl"))], &["a.stl"]);
    one_line(&["amplify", text(&at("none.tif")), "--recipe", text(&recipe), "--out", text(&out)], &["none.tif"]);
    assert!(!out.exists());
}
