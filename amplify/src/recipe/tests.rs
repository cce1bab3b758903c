//! Recipes: their text, their checks, and what they make of a small coast.

use super::*;
use crate::field::{Density, THRESHOLD};
use crate::landform::shallow::Shallow;
use glam::{DVec2, DVec3};
use terrain_model::grid::Grid;

/// 121 m of coast: a sea floor, a cliff of 30 m along y = 60 m, a plateau with a depression.
fn coast() -> Grid<f32> {
    let height = |k: usize| {
        let (x, y) = ((k % 121) as f64, (k / 121) as f64);
        let inland = y - 60.0 - 5.0 * libm::sin(x / 12.0);
        let t = ((inland + 3.0) / 6.0).clamp(0.0, 1.0);
        let off = DVec2::new(x - 40.0, y - 90.0).length();
        let land = 20.0 + 0.02 * x + 0.05 * inland.max(0.0) - 6.0 * libm::exp(-off * off / 60.0);
        (-10.0 + 0.01 * x + (land + 10.0) * t * t * (3.0 - 2.0 * t)) as f32
    };
    Grid::new(DVec2::ZERO, DVec2::ONE, 121, 121, (0..121 * 121).map(height).collect()).unwrap()
}

/// A ball in the cliff.
const BALL: &str = r#"(format: "terrain-volume/1", volume: primitives([
    (skeleton: sphere(centre: (60, 60, 0), radius: 18), radius: 2, energy: 1),
]))"#;

/// Files of one raster that paints the western half, and of one tree.
struct Half;

impl Pantry for Half {
    fn raster(&mut self, name: &str) -> Result<Grid<f32>, String> {
        if name != "west.asc" {
            return Err("no such file".to_owned());
        }
        let values = (0..121 * 121).map(|k| f32::from(u8::from(k % 121 < 60))).collect();
        Ok(Grid::new(DVec2::ZERO, DVec2::ONE, 121, 121, values).unwrap())
    }
    fn text(&mut self, name: &str) -> Result<String, String> {
        match name {
            "ball.ron" => Ok(BALL.to_owned()),
            "broken.ron" => Ok(BALL.replace("sphere", "spere")),
            _ => Err("no such file".to_owned()),
        }
    }
}

const TEXT: &str = r#"(
    format: "terrain-recipe/1",
    geology: "horizontal_strata",
    floor: -40,
    landforms: [
        (make: sea(reach: 5, openness: 12, erosion: (spacing: 2, radius: 4, steps: 2)), mask: "west.asc"),
        (make: karst(percolation: (sites: 300, spacing: 2, threshold: 2), pits: (depth: 2)), limit: 200),
        (make: canyon(full_power: 5, river: 0.2, banks: 6, erosion: (spacing: 3, threshold: 0.2))),
        (make: hoodoos(spacing: 6), within: ((70, 50, 0), (110, 100, 60))),
        (make: arch(from: (20, 20, -10), to: (40, 24, -10), rise: 9, thickness: 4)),
        (make: brush([(tool: intrude, path: [(60, 60, 4), (60, 70, 6)], radius: 3, step: 1, strength: 1, scatter: 0, seed: 1)])),
    ],
)"#;

fn cooked(text: &str, threads: usize, seed: u32) -> Result<Amplified, RecipeError> {
    let recipe = Recipe::parse(text).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| amplify(&coast(), &recipe, &mut Half, seed, |_, _| ()))
}

#[test]
fn a_recipe_reads_back_from_its_text_and_a_misspelt_one_is_placed() {
    let recipe = Recipe::parse(TEXT).unwrap();
    assert_eq!(Recipe::parse(&recipe.to_ron()).unwrap(), recipe);
    let wrong = Recipe::parse(&TEXT.replace("reach: 5", "raech: 5")).unwrap_err();
    assert!(wrong.line == 6 && wrong.problem.contains("raech"), "{wrong}");
    assert!(Recipe::parse(&TEXT.replace("recipe/1", "recipe/2")).unwrap_err().problem.contains("terrain-recipe/1"));
}

#[test]
fn one_seed_makes_one_terrain_on_any_number_of_threads() {
    let one = cooked(TEXT, 1, 5).unwrap();
    let two = cooked(TEXT, 2, 5).unwrap();
    assert_eq!(one.index.primitives(), two.index.primitives());
    assert_eq!((&one.made, &one.stress), (&two.made, &two.stress));
    assert_eq!(one.maps(&coast()), two.maps(&coast()));
    assert_ne!(one.index.primitives(), cooked(TEXT, 2, 6).unwrap().index.primitives());
    assert_eq!(
        one.made.iter().map(|made| made.landform).collect::<Vec<_>>(),
        ["sea", "karst", "canyon", "hoodoos", "arch", "brush"]
    );
    assert!(one.made.iter().all(|made| made.primitives > 0), "{:?}", one.made);
    assert_eq!(one.made.iter().map(|made| made.primitives).sum::<usize>(), one.index.primitives().len());
}

#[test]
fn landforms_stay_where_they_may_act_and_within_their_limit() {
    let only = |make: &str| TEXT.split("landforms").next().unwrap().to_owned() + "landforms: [" + make + "])";
    let centres = |text: &str| -> Vec<DVec3> {
        let made = cooked(text, 1, 5).unwrap();
        let middle = |support: crate::field::Box3| (support.low + support.high) * 0.5;
        made.index.primitives().iter().map(|one| middle(one.support())).collect()
    };
    let sea = "(make: sea(reach: 5, openness: 12, erosion: (spacing: 2, radius: 4, steps: 2))";
    let west = centres(&only(&format!("{sea}, mask: \"west.asc\")")));
    assert!(west.len() > 100 && west.iter().all(|p| p.x < 60.0 && p.z.abs() <= 5.0));
    assert!(centres(&only(&format!("{sea})"))).iter().any(|p| p.x > 60.0), "without the mask there are others");
    let some = centres(&only(&format!("{sea}, limit: 50)")));
    assert_eq!(some.len(), 50);
    let boxed = centres(&only("(make: hoodoos(spacing: 3), within: ((70, 50, 0), (110, 100, 60)))"));
    assert!(boxed.len() > 5 && boxed.iter().all(|p| (69.0..111.0).contains(&p.x) && (49.0..101.0).contains(&p.y)));
    let karst = centres(&only("(make: karst(percolation: (sites: 300, spacing: 2, threshold: 2), pits: (depth: 2)))"));
    let pit = DVec2::new(40.0, 90.0);
    assert!(karst.len() > 100 && karst.iter().all(|p| p.truncate().distance(pit) < 60.0 && p.z < 25.0 && p.z > -40.0));
}

#[test]
fn the_sea_undercuts_and_the_maps_say_so() {
    let text = TEXT.split("landforms").next().unwrap().to_owned()
        + "landforms: [(make: sea(reach: 5, openness: 12, erosion: (spacing: 2, radius: 4, strength: 2, steps: 3)))])";
    let made = cooked(&text, 2, 5).unwrap();
    let maps = made.maps(&coast());
    let roofed: Vec<usize> = (0..maps.effects.values().len()).filter(|&k| maps.effects.values()[k] >= 2.0).collect();
    assert!(roofed.len() > 50, "{}", roofed.len());
    for k in roofed {
        let p = coast().position(k % 121, k / 121);
        let column: Vec<bool> =
            (-200..250).map(|z| made.volume.value(p.extend(0.1 * f64::from(z))) >= THRESHOLD).collect();
        let roofs = column.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        assert!(roofs >= 1, "rock over air at {p}");
    }
    // Nothing is changed where no sphere reaches: the map is 0 there, and the field that of the ground.
    let bare = maps.effects.values().iter().position(|&e| e == 0.0).unwrap();
    let p = coast().position(bare % 121, bare / 121).extend(3.0);
    assert_eq!(made.volume.value(p), made.ground.value(p));
    let stress = |k: usize| maps.stress.values()[k];
    assert!((0..121 * 121).all(|k| (0.0..=1.0).contains(&stress(k))));
    assert!(maps.resistance.values().iter().all(|r| (0.0..=1.0).contains(r)));
    let covered = maps.effects.values().iter().filter(|e| **e > 0.0).count() as f64 / (121.0 * 121.0);
    assert!((made.coverage(&coast(), 1.0) - covered).abs() < 0.02, "{covered}");
}

#[test]
fn what_is_wrong_is_named_before_anything_is_made() {
    let fails = |from: &str, to: &str| cooked(&TEXT.replace(from, to), 1, 0).unwrap_err().to_string();
    assert_eq!(fails("reach: 5", "reach: -5"), "landform 1: sea: reach is -5, expected 0.01 to 10000 m");
    assert_eq!(fails("west.asc", "east.asc"), "east.asc: no such file");
    assert!(fails("horizontal_strata", "granite").starts_with("granite: no such file; expected a file or one of "));
    assert!(fails("(110, 100, 60)", "(10, 100, 60)").starts_with("landform 4, within: expected the lower corner"));
    assert!(fails("spacing: 6", "spacing: 0").starts_with("landform 4: hoodoos: spacing is 0"));
    assert!(fails("radius: 3, step", "radius: -3, step").starts_with("landform 6, stroke 1: "));
    assert!(fails("floor: -40", "floor: 40").contains("floor"));
    let sunk = Recipe::new(
        "horizontal_strata",
        vec![Entry::of(Landform::Sea(crate::landform::sea::Sea {
            erosion: Shallow { steps: 1000, ..Shallow::default() },
            ..Default::default()
        }))],
    );
    let error = amplify(&coast(), &sunk, &mut Half, 0, |_, _| ()).unwrap_err();
    assert_eq!(error.to_string(), "landform 1: sea: steps is 1000, expected 1 to 100 (no unit)");
}

#[test]
fn primitives_stay_in_the_rock_of_a_tree() {
    let text = |inside: &str| {
        let sea = r#"make: sea(reach: 5, openness: 12, erosion: (spacing: 2, radius: 4, steps: 2))"#;
        let karst = r#"make: karst(percolation: (sites: 300, spacing: 2, threshold: 2, sinks: [(60, 62, 2)]))"#;
        let head = r#"format: "terrain-recipe/1", geology: "horizontal_strata", floor: -40"#;
        format!("({head}, landforms: [({sea}{inside}), ({karst}{inside})])")
    };
    let off = |made: &Amplified| {
        let middle = |one: &crate::implicit::primitive::Primitive| {
            let support = one.support();
            (support.low + support.high) * 0.5
        };
        // The ball's rock ends less than its radius of influence outside it.
        made.index.primitives().iter().filter(|one| middle(one).distance(DVec3::new(60.0, 60.0, 0.0)) > 20.0).count()
    };
    let ball = cooked(&text(r#", inside: "ball.ron""#), 2, 5).unwrap();
    assert!(off(&ball) == 0 && ball.made.iter().all(|made| made.primitives > 10), "{:?}", ball.made);
    // Control: without the tree they are all over the coast.
    assert!(off(&cooked(&text(""), 2, 5).unwrap()) > 100);
    let wrong = |name: &str| cooked(&text(&format!(", inside: {name:?}")), 1, 5).unwrap_err().to_string();
    assert_eq!(wrong("none.ron"), "none.ron: no such file");
    let broken = wrong("broken.ron");
    assert!(broken.starts_with("broken.ron: line 2, column ") && broken.contains("spere"), "{broken}");
}
