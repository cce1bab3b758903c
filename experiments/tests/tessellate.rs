//! `terrain tessellate` as a shell sees it.

mod shell;

use glam::DVec2;
use shell::{ok, one_line, text};
use std::path::Path;
use terrain_model::grid::{Crs, Grid};
use terrain_model::io;

/// A hill of 90 m on 33 × 25 samples, 20 m apart.
fn raster(path: &Path) {
    let height = |k: usize| {
        let [x, y] = [(k % 33) as f32 - 16.0, (k / 33) as f32 - 12.0];
        90.0 / (1.0 + 0.02 * (x * x + y * y))
    };
    let grid = Grid::new(DVec2::new(3000.0, 5000.0), DVec2::splat(20.0), 33, 25, (0..33 * 25).map(height).collect());
    io::write_grid(path, &grid.unwrap().with_crs(Some(Crs::local_metres()))).unwrap();
}

#[test]
fn a_raster_is_drawn_the_same_on_any_number_of_threads_and_otherwise_without_detail() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    raster(&at("a.tif"));
    let (input, one, two, bare) = (at("a.tif"), at("one.png"), at("two.png"), at("bare.png"));
    let camera = ["--camera", "3100,5020,+40,3300,5240,+5", "--size", "96x64"];
    let draw = |out: &Path, more: &[&str]| {
        let mut arguments = vec!["tessellate", text(&input), "--out", text(out)];
        arguments.extend(camera);
        arguments.extend(more);
        ok(&arguments)
    };
    let said = draw(&one, &["--threads", "1"]);
    assert!(said.contains("triangles in") && said.contains("sky in"), "{said}");
    draw(&two, &["--threads", "3"]);
    draw(&bare, &["--octaves", "0"]);
    let [one, two, bare] = [one, two, bare].map(|path| std::fs::read(path).unwrap());
    assert!(one == two, "pictures differ by threads");
    assert!(one != bare, "detail is not seen");
}

#[test]
fn a_mesh_lies_where_the_raster_does_and_no_farther_from_it_than_the_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    raster(&at("a.tif"));
    let (input, out) = (at("a.tif"), at("a.obj"));
    let flat = ["--phong", "0", "--amplitude", "3", "--edge-px", "5"];
    let mut arguments = vec!["tessellate", text(&input), "--out", text(&out)];
    arguments.extend(flat);
    let said = ok(&arguments);
    let written = std::fs::read_to_string(&out).unwrap();
    let vertices: Vec<Vec<f64>> = written
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect())
        .collect();
    assert!(said.contains(&format!("{} vertices", vertices.len())) && vertices.len() > 33 * 25, "{said}");
    let low = |axis: usize| vertices.iter().fold(f64::INFINITY, |low, v| low.min(v[axis]));
    let high = |axis: usize| vertices.iter().fold(f64::NEG_INFINITY, |high, v| high.max(v[axis]));
    for (axis, from, to) in [(0, 3000.0, 3640.0), (1, 5000.0, 5480.0), (2, 10.0, 90.0)] {
        assert!(low(axis) > from - 3.1 && low(axis) < from + 3.1, "axis {axis} from {}", low(axis));
        assert!(high(axis) < to + 3.1 && high(axis) > to - 3.1, "axis {axis} to {}", high(axis));
    }
}

#[test]
fn a_tree_is_ground_and_says_what_its_samples_miss() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let proved = |samples: &str, out: &Path| {
        let small = ["--size", "64x48", "--edge-px", "12", "--octaves", "2", "--samples", samples];
        let mut arguments = vec!["tessellate", "builtin:demo", "--out", text(out)];
        arguments.extend(small);
        let said = ok(&arguments);
        assert!(said.contains("triangles in") && said.contains("samples, "), "{said}");
        let share = said.split("proved of ").nth(1).and_then(|rest| rest.split(' ').next());
        share.map_or(0.0, |share| share.parse::<f64>().unwrap())
    };
    let [coarse, fine] = [("17", at("a.png")), ("257", at("b.png"))].map(|(samples, out)| proved(samples, &out));
    assert!(fine > coarse && fine > 15.0, "{coarse} {fine}");
    assert!(std::fs::read(at("a.png")).unwrap() != std::fs::read(at("b.png")).unwrap());
    let out = at("c.png");
    let mut arguments = vec!["tessellate", "builtin:demo", "--out", text(&out)];
    arguments.extend(["--region", "9e6,9e6,9.1e6,9.1e6"]);
    one_line(&arguments, &["builtin:demo", "--region"]);
    one_line(&["tessellate", "builtin:none", "--out", text(&out)], &["builtin:none"]);
    assert!(!out.exists());
}

#[test]
fn a_raster_in_pages_is_drawn_as_in_memory_and_one_that_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let height = |k: usize| (((k % 600) * 7 + (k / 600) * 13) % 97) as f32 + (k % 600) as f32;
    let grid = Grid::new(DVec2::ZERO, DVec2::splat(20.0), 600, 530, (0..600 * 530).map(height).collect()).unwrap();
    io::write_grid(&at("a.r32"), &grid.with_crs(Some(Crs::local_metres()))).unwrap();
    let (input, whole, paged) = (at("a.r32"), at("whole.png"), at("paged.png"));
    let camera = ["--camera", "3000,3000,+60,3400,3300,+0", "--size", "96x64"];
    let draw = |out: &Path, more: &[&str]| {
        let mut arguments = vec!["tessellate", text(&input), "--out", text(out)];
        arguments.extend(camera);
        arguments.extend(more);
        ok(&arguments)
    };
    let said = draw(&paged, &["--resident", "64"]);
    assert!(said.contains("of 16 pages in memory, at most 14"), "{said}");
    assert!(!draw(&whole, &[]).contains("pages"));
    // Fewer pages than the picture needs: they come and go.
    let few = at("few.png");
    draw(&few, &["--resident", "16"]);
    let [whole, paged, few] = [whole, paged, few].map(|path| std::fs::read(path).unwrap());
    assert!(whole == paged && whole == few);
    raster(&at("b.tif"));
    let out = at("none.png");
    let run = |input: &Path, parts: &[&str]| {
        one_line(&["tessellate", text(input), "--out", text(&out), "--resident", "64"], parts);
        assert!(!out.exists());
    };
    run(&at("b.tif"), &["b.tif", ".r32", "convert"]);
    run(&at("c.r32"), &["c.r32"]);
}

#[test]
fn a_flight_is_numbered_and_moves() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    raster(&at("a.tif"));
    let (input, out) = (at("a.tif"), at("f.png"));
    let camera = ["--camera", "3100,5020,+40,3300,5240,+5", "--to", "3200,5060,+40,3300,5240,+5"];
    let mut arguments = vec!["tessellate", text(&input), "--out", text(&out), "--frames", "3", "--size", "64x48"];
    arguments.extend(camera);
    ok(&arguments);
    assert!(!out.exists());
    let [a, b, c] = [0, 1, 2].map(|k| std::fs::read(at(&format!("f_0000{k}.png"))).unwrap());
    assert!(a != b && b != c && a != c);
    // Through the hill: no picture is written.
    let through = at("through.png");
    let camera = ["--camera", "3010,5240,20,3320,5240,+5", "--to", "3600,5240,20,3320,5240,+5", "--size", "64x48"];
    let mut arguments = vec!["tessellate", text(&input), "--out", text(&through), "--frames", "5", "--octaves", "0"];
    arguments.extend(camera);
    one_line(&arguments, &["--camera", "below the ground"]);
    assert!(!at("through_00000.png").exists());
}

#[test]
fn what_cannot_be_tessellated_is_said_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    raster(&at("a.tif"));
    let header = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";
    std::fs::write(at("hole.asc"), format!("{header}1 2 3\n4 -9999 6\n")).unwrap();
    let (good, hole, out, zip) = (at("a.tif"), at("hole.asc"), at("a.png"), at("a.zip"));
    let run = |input: &Path, out: &Path, more: &[&str], parts: &[&str]| {
        let mut arguments = vec!["tessellate", text(input), "--out", text(out), "--size", "64x48"];
        arguments.extend(more);
        one_line(&arguments, parts);
        assert!(!out.exists());
    };
    run(&hole, &out, &[], &["hole.asc"]);
    run(&good, &zip, &[], &["a.zip", ".png", ".glb"]);
    run(&good, &out, &["--camera", "3300,5240,-5,3400,5300,+5"], &["--camera", "below the ground", "+"]);
    run(&good, &out, &["--camera", "3300,5240,+500,3300,5240,+0"], &["--camera", "straight"]);
    run(&at("none.tif"), &out, &[], &["none.tif"]);
}
