//! The `terrain` command as a shell sees it: every verb on the embedded scene, and what each says when it cannot.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use terrain_model::io;

const DEMO: &str = "builtin:demo";

fn terrain(arguments: &[&str]) -> Output {
    // Drivers of adapters complain on standard error where no session has set this.
    let session = std::env::temp_dir();
    Command::new(env!("CARGO_BIN_EXE_terrain")).args(arguments).env("XDG_RUNTIME_DIR", session).output().unwrap()
}

/// Standard output of a run that must succeed.
fn ok(arguments: &[&str]) -> String {
    let output = terrain(arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    assert_eq!(error, "", "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Standard error of a run that must end with `status`.
fn fails(status: i32, arguments: &[&str]) -> String {
    let output = terrain(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {error}");
    error
}

/// One line that names everything in `parts`.
fn one_line(error: &str, parts: &[&str]) {
    assert_eq!(error.lines().count(), 1, "{error}");
    for part in parts {
        assert!(error.contains(part), "no `{part}` in: {error}");
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A scene of one disc of radius 100 m at elevation 50, with `more` in its layer's blend.
fn disc(more: &str) -> String {
    format!(
        "(\n  format: \"terrain-scene/1\",\n  layers: {{\n    \"ground\": blend([\n      disc(centre: (0, 0), \
         elevation: 50, radius: 100),\n      {more}\n    ]),\n  }},\n)\n"
    )
}

#[test]
fn eval_gives_a_json_line_a_point_with_a_true_slope_bound() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    std::fs::write(&file, "x,y\n15000, 15000\n\n-1e6,0\n").unwrap();
    let out = ok(&["eval", DEMO, "--at", "10000,12000", "--at=-5,3", "--points", text(&file)]);
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    let (on, off) = (&lines[2], &lines[3]);
    assert_eq!((on["x"].as_f64(), on["in_domain"].as_bool()), (Some(15000.0), Some(true)));
    let gradient = glam::DVec2::new(on["gradient"][0].as_f64().unwrap(), on["gradient"][1].as_f64().unwrap());
    assert!(gradient.length() <= on["slope_bound"].as_f64().unwrap());
    assert!(off["elevation"].is_null() && off["gradient"].is_null() && off["slope_bound"].is_null());
    assert_eq!((off["weight"].as_f64(), off["in_domain"].as_bool()), (Some(0.0), Some(false)));
}

#[test]
fn eval_of_a_disc_is_its_formula() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("disc.ron");
    std::fs::write(&scene, disc("")).unwrap();
    let line: Value = serde_json::from_str(&ok(&["eval", text(&scene), "--at", "50,0", "--layer", "ground"])).unwrap();
    // (1 − 1/4)³.
    assert_eq!((line["elevation"].as_f64(), line["weight"].as_f64()), (Some(50.0), Some(0.421875)));
    assert_eq!(line["in_domain"].as_bool(), Some(false));
}

#[test]
fn info_of_a_scene_and_of_a_raster_is_json_or_text() {
    let facts: Value = serde_json::from_str(&ok(&["info", DEMO, "--json"])).unwrap();
    let layer = &facts["layers"]["bedrock"];
    assert_eq!((layer["primitives"].as_u64(), layer["operators"].as_u64()), (Some(4), Some(2)));
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&layer["bounds"]["elevation"][0]) <= number(&layer["elevation_sampled"][0]));
    assert!(number(&layer["bounds"]["elevation"][1]) >= number(&layer["elevation_sampled"][1]));
    assert!(ok(&["info", DEMO]).contains("bytes acceleration: "));

    let dem = concat!(env!("CARGO_MANIFEST_DIR"), "/data/jacksboro/jacksboro.tif");
    let facts: Value = serde_json::from_str(&ok(&["info", dem, "--json"])).unwrap();
    assert_eq!(facts["size"], serde_json::json!([403, 344]));
    assert_eq!(facts["sha256"], "8030881727786ba826be1bb110a64c4ff0ec457658b1586a06a5137fd5e36fd8");
    assert_eq!(facts["metric"].as_bool(), Some(true));
}

#[test]
fn bake_writes_what_eval_says_and_no_data_off_the_terrain() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo.tif");
    ok(&["bake", DEMO, "--size", "11x6", "--region", "-9000,10000,11000,20000", "--out", text(&out)]);
    let grid = io::read_grid(&out).unwrap();
    assert_eq!((grid.width(), grid.height(), grid.position(10, 5)), (11, 6, glam::DVec2::new(11000.0, 20000.0)));
    assert_eq!(grid.known(0, 0), None);
    let line: Value = serde_json::from_str(&ok(&["eval", DEMO, "--at", "11000,20000"])).unwrap();
    let (baked, exact) = (f64::from(grid.known(10, 5).unwrap()), line["elevation"].as_f64().unwrap());
    // `f32` arithmetic on elevations of 1000 m: far below a centimetre.
    assert!((baked - exact).abs() < 0.01, "{baked} {exact}");
}

#[test]
fn bake_writes_every_format_and_the_weight_beside_the_elevation_in_exr() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["asc", "png", "raw", "r16", "exr", "ply", "obj", "glb"] {
        let out = folder.path().join("demo").with_extension(extension);
        ok(&["bake", DEMO, "--size", "8", "--region", "5000,5000,12000,12000", "--out", text(&out)]);
        assert!(std::fs::metadata(&out).unwrap().len() > 100, "{extension}");
    }
    let exr = folder.path().join("demo.exr");
    let names: Vec<String> = io::exr::read_layers(&exr).unwrap().layers.into_iter().map(|layer| layer.0).collect();
    assert_eq!(names, ["elevation", "weight"]);
    assert_eq!(io::read_grid(&exr).unwrap().origin(), glam::DVec2::splat(5000.0));
}

#[test]
fn mesh_writes_each_kind_and_says_what_is_proved() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo.glb");
    let extent = ["--extent", "15000,15000,16000,15800", "--out", text(&out)];
    let line = ok(&[&["mesh", DEMO, "--kind", "regular", "--size", "6x5"], &extent[..]].concat());
    assert!(line.contains("30 vertices, 40 triangles"), "{line}");
    for kind in ["adaptive", "tin"] {
        let line = ok(&[&["mesh", DEMO, "--kind", kind, "--error", "60"], &extent[..]].concat());
        assert!(line.contains("proved to lie within") && line.lines().count() == 1, "{line}");
        assert_eq!(&std::fs::read(&out).unwrap()[..4], b"glTF");
    }
    for extension in ["ply", "obj"] {
        let out = folder.path().join("demo").with_extension(extension);
        ok(&["mesh", DEMO, "--size", "4", "--extent", "15000,15000,16000,15800", "--out", text(&out)]);
        assert!(std::fs::metadata(&out).unwrap().len() > 100, "{extension}");
    }
}

#[test]
fn mesh_refuses_what_it_cannot_do_in_one_line() {
    let run = |more: &[&str]| fails(1, &[&["mesh", DEMO, "--extent", "1e6,1e6,2e6,2e6"], more].concat());
    one_line(&run(&["--size", "4", "--out", "a.glb"]), &["no triangle lies on the terrain", "--extent"]);
    one_line(&run(&["--error", "5", "--out", "a.glb"]), &["no triangle lies on the terrain", "--extent"]);
    one_line(&run(&["--size", "4", "--out", "a.tif"]), &["a.tif", ".glb"]);
    one_line(&run(&["--kind", "regular", "--error", "5", "--out", "a.glb"]), &["--size"]);
    one_line(&run(&["--kind", "tin", "--size", "5", "--out", "a.glb"]), &["--error"]);
    for bad in [&["--error", "0"][..], &["--error", "nan"], &["--size", "1"], &["--size", "4", "--error", "5"], &[]] {
        assert!(!fails(2, &[&["mesh", DEMO, "--out", "a.glb"], bad].concat()).is_empty());
    }
}

#[test]
fn every_tracer_draws_the_same_picture_of_the_demo() {
    let folder = tempfile::tempdir().unwrap();
    let mut colours: Vec<Vec<f32>> = Vec::new();
    for tracer in ["sphere", "accelerated", "certified"] {
        let (out, stats) = (folder.path().join(format!("{tracer}.exr")), folder.path().join("stats.json"));
        ok(&["render", DEMO, "--size", "24x14", "--tracer", tracer, "--out", text(&out), "--stats", text(&stats)]);
        let stats: Value = serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
        let count = |key: &str| stats[key].as_u64().unwrap();
        let open = count("gave_up") + count("undecided");
        assert_eq!(count("hits") + count("walls") + count("misses") + open, count("pixels"), "{tracer}: {stats}");
        // One slope bound for the whole scene may creep past a ray's budget; the others adapt.
        assert!(open == 0 || (tracer == "sphere" && open < 20), "{tracer}: {stats}");
        assert!(count("hits") > 50 && count("misses") > 50, "{tracer}: {stats}");
        let layers = io::exr::read_layers(&out).unwrap().layers;
        let names: Vec<&str> = layers.iter().map(|layer| layer.0.as_str()).collect();
        assert_eq!(names, ["B", "G", "R", "depth", "normal.x", "normal.y", "normal.z", "steps"]);
        // Green: 0 only where a ray was given up.
        colours.push(layers[1].1.clone());
    }
    for other in &colours[..2] {
        // A pixel on a ridge or at a shadow's edge may fall on either side.
        let pairs = colours[2].iter().zip(other).filter(|(_, green)| **green > 0.0);
        let different = pairs.filter(|(a, b)| (*a - *b).abs() > 0.02).count();
        assert!(different <= 6, "{different} of {} pixels differ", other.len());
    }
}

/// Depths and colours of a small picture of the demo, and its statistics.
fn drawn(more: &[&str]) -> (Vec<f32>, Vec<f32>, Value) {
    let folder = tempfile::tempdir().unwrap();
    let (out, stats) = (folder.path().join("a.exr"), folder.path().join("a.json"));
    let common = ["render", DEMO, "--size", "32x18", "--out", text(&out), "--stats", text(&stats)];
    ok(&[&common[..], more].concat());
    let stats = serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    let layer = |name: &str| {
        let layers = io::exr::read_layers(&out).unwrap().layers;
        layers.into_iter().find(|layer| layer.0 == name).unwrap().1
    };
    (layer("depth"), layer("G"), stats)
}

#[test]
fn an_adapter_draws_the_picture_of_the_processor_or_says_what_is_missing() {
    let on_adapter = ["--backend", "gpu", "--tracer", "segment"];
    let (depth, green, stats) = drawn(&["--tracer", "segment"]);
    assert!(stats["adapter"].is_null());
    let proof = fails(1, &["render", DEMO, "--backend", "gpu", "--tracer", "certified", "--out", "a.png"]);
    one_line(&proof, &["certified", "--backend"]);
    let Some(adapter) = terrain_gpu::adapter::describe() else {
        assert!(!terrain_gpu::adapter::required(), "an adapter is required");
        eprintln!("skipped: no adapter");
        one_line(&fails(1, &[&["render", DEMO, "--out", "a.png"], &on_adapter[..]].concat()), &["install a driver"]);
        return;
    };
    let (other_depth, other_green, other) = drawn(&on_adapter);
    assert_eq!(other["adapter"].as_str(), Some(adapter.name.as_str()));
    // Rays that pass a crest within ε are met there on an adapter.
    let near = |a: f32, b: f32| a == b || (a - b).abs() < 1e-3 * a;
    let far = depth.iter().zip(&other_depth).filter(|(a, b)| !near(**a, **b));
    assert!(far.count() <= 6);
    let coloured = green.iter().zip(&other_green).filter(|(a, b)| (*a - *b).abs() > 0.02);
    assert!(coloured.count() <= 8);
    let none = ["render", DEMO, "--backend", "gpu", "--adapter", "no such", "--out", "a.png"];
    one_line(&fails(1, &none), &["no such", &adapter.name.replace(" (software)", "")]);
}

#[test]
fn outputs_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let mut seen: Vec<Vec<Vec<u8>>> = Vec::new();
    for threads in ["1", "2"] {
        let path = |name: &str| folder.path().join(format!("{threads}-{name}"));
        let (picture, map, raster) = (path("a.png"), path("b.png"), path("c.tif"));
        let render = ["render", DEMO, "--size", "48x27", "--threads", threads, "--out", text(&picture)];
        ok(&[&render[..], &["--step-map", text(&map)]].concat());
        ok(&["bake", DEMO, "--size", "70", "--out", text(&raster), "--threads", threads]);
        seen.push([picture, map, raster].iter().map(|file| std::fs::read(file).unwrap()).collect());
    }
    assert!(seen[0] == seen[1]);
    // The comparison can tell: another picture has other bytes.
    assert!(seen[0][0] != seen[0][1]);
}

#[test]
fn a_scene_without_a_camera_is_framed_from_the_south_west() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out, stats) =
        (folder.path().join("disc.ron"), folder.path().join("a.png"), folder.path().join("a.json"));
    std::fs::write(&scene, disc("")).unwrap();
    let arguments = ["render", text(&scene), "--size", "40x30", "--out", text(&out), "--stats", text(&stats)];
    ok(&arguments);
    let stats: Value = serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    let share = stats["hits"].as_f64().unwrap() / stats["pixels"].as_f64().unwrap();
    assert!((0.05..0.8).contains(&share), "{stats}");
}

#[test]
fn convert_makes_degrees_metric_and_a_scene_refuses_degrees_until_then() {
    let folder = tempfile::tempdir().unwrap();
    let degrees = folder.path().join("degrees.asc");
    let header = "ncols 3\nnrows 2\nxllcenter -84.4\nyllcenter 36.4\ncellsize 0.01\nNODATA_value -9999\n";
    std::fs::write(&degrees, format!("{header}1 2 3\n4 5 6\n")).unwrap();
    std::fs::write(folder.path().join("degrees.prj"), "GEOGCS[\"WGS 84\"]").unwrap();
    let scene = folder.path().join("scene.ron");
    std::fs::write(&scene, disc("image(file: \"degrees.asc\", margin: 100),")).unwrap();
    let error = fails(1, &["info", text(&scene)]);
    one_line(&error, &["scene.ron: layers.ground.blend[1]", "degrees.asc", "terrain convert --local-metres"]);

    let metres = folder.path().join("metres.tif");
    let report = ok(&["convert", "--local-metres", text(&degrees), text(&metres)]);
    assert!(report.contains("wrong by at most"), "{report}");
    assert!(io::read_grid(&metres).unwrap().is_metric());
    std::fs::write(&scene, disc("image(file: \"metres.tif\", margin: 100),")).unwrap();
    ok(&["info", text(&scene)]);
    let error = fails(1, &["convert", "--local-metres", text(&metres), text(&degrees)]);
    one_line(&error, &["metres.tif", "not in degrees"]);
}

#[test]
fn an_image_with_holes_has_no_weight_there_and_one_that_says_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let header = "ncols 12\nnrows 12\nxllcenter 1000\nyllcenter 2000\ncellsize 10\nNODATA_value -9999\n";
    let raster = |hole: &str| {
        let row = |first: &str| format!("{first} {}\n", ["7"; 11].join(" "));
        format!("{header}{}{}", row("7").repeat(11), row(hole))
    };
    let scene = folder.path().join("scene.ron");
    let alone = "(format: \"terrain-scene/1\", layers: { \"ground\": image(file: \"holes.asc\", margin: 20) })";
    std::fs::write(&scene, alone).unwrap();
    let weight_at = |place: &str| {
        let line: Value = serde_json::from_str(&ok(&["eval", text(&scene), "--at", place])).unwrap();
        line["weight"].as_f64().unwrap()
    };
    std::fs::write(folder.path().join("holes.asc"), raster("7")).unwrap();
    assert!(weight_at("1015,2015") > 0.5 && weight_at("1060,2060") > 0.99);
    // The sample at (1000, 2000) becomes unknown: the cells that touch it have no weight, those far off keep theirs.
    std::fs::write(folder.path().join("holes.asc"), raster("-9999")).unwrap();
    assert!(weight_at("1015,2015") == 0.0 && weight_at("1060,2060") > 0.99);
    let nothing = format!(
        "ncols 3\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 10\nNODATA_value -9999\n{}",
        "-9999 -9999 -9999\n".repeat(2)
    );
    std::fs::write(folder.path().join("holes.asc"), nothing).unwrap();
    let error = fails(1, &["eval", text(&scene), "--at", "0,0"]);
    one_line(&error, &["holes.asc", "no-data everywhere"]);
}

#[test]
fn a_missing_file_is_one_line_whichever_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let none = folder.path().join("none.ron");
    one_line(&fails(1, &["info", text(&none)]), &["none.ron", "builtin:demo"]);
    one_line(&fails(1, &["info", "builtin:none"]), &["builtin:none", "builtin:demo"]);
    one_line(&fails(1, &["info", "none.tif"]), &["none.tif", "check the path"]);
    one_line(&fails(1, &["convert", "none.tif", "out.asc"]), &["none.tif", "check the path"]);
    one_line(&fails(1, &["eval", DEMO, "--points", "none.csv"]), &["none.csv"]);
    let scene = folder.path().join("scene.ron");
    std::fs::write(&scene, disc("image(file: \"none.tif\", margin: 5),")).unwrap();
    one_line(&fails(1, &["info", text(&scene)]), &["scene.ron: layers.ground.blend[1]", "none.tif"]);
}

#[test]
fn a_wrong_scene_shows_the_line_the_column_and_the_source() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.ron");
    for (more, problem) in [
        ("disc(centre: (0 0), radius: 5),", "comma"),
        ("disc(centre: (0, 0), radios: 5),", "radios"),
        ("disc(centre: (0, 0), radius: -5),", "above 0"),
        ("disk(centre: (0, 0), radius: 5),", "disk"),
    ] {
        std::fs::write(&scene, disc(more)).unwrap();
        let error = fails(1, &["info", text(&scene)]);
        let first = error.lines().next().unwrap();
        assert!(first.contains("scene.ron:6:") && first.to_lowercase().contains(problem), "{error}");
        assert!(error.lines().skip(1).any(|line| line.contains(more)), "{error}");
    }
}

#[test]
fn an_unknown_layer_or_camera_lists_the_known_ones() {
    one_line(&fails(1, &["eval", DEMO, "--layer", "sand", "--at", "0,0"]), &[DEMO, "layers.sand", "bedrock"]);
    let error = fails(1, &["render", DEMO, "--camera", "moon", "--out", "a.png"]);
    one_line(&error, &[DEMO, "cameras.moon", "south-east"]);
}

#[test]
fn a_command_line_that_cannot_be_understood_ends_with_2() {
    for arguments in [
        &["eval", DEMO, "--at", "1;2"][..],
        &["eval", DEMO, "--at", "nan,0"],
        &["eval", DEMO],
        &["bake", DEMO, "--size", "0", "--out", "a.tif"],
        &["bake", DEMO, "--size", "9", "--region", "1,1,0,0", "--out", "a.tif"],
        &["render", DEMO, "--tracer", "magic", "--out", "a.png"],
        &["info", DEMO, "--threads", "0"],
        &[],
    ] {
        assert!(!fails(2, arguments).is_empty());
    }
    assert!(fails(2, &["eval", DEMO, "--at", "1;2"]).contains("2 finite numbers"));
}

#[test]
fn an_output_that_cannot_be_written_is_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let inside = |name: &str| folder.path().join("none").join(name);
    for arguments in [
        ["bake", DEMO, "--size", "4", "--region", "5e3,5e3,9e3,9e3", "--out", text(&inside("a.tif"))],
        ["render", DEMO, "--size", "4", "--tracer", "accelerated", "--out", text(&inside("a.png"))],
    ] {
        one_line(&fails(1, &arguments), &["none", "check that the folder exists"]);
    }
    one_line(&fails(1, &["render", DEMO, "--out", "a.gif"]), &["a.gif", ".png"]);
    one_line(&fails(1, &["bake", DEMO, "--size", "4", "--out", "a.gif"]), &["a.gif", ".asc"]);
    one_line(&fails(1, &["bake", DEMO, "--size", "1", "--out", "a.tif"]), &["at least 2"]);
    let out = inside("a.tif");
    let nowhere = ["bake", DEMO, "--size", "4", "--region", "1e6,1e6,2e6,2e6", "--out", text(&out)];
    one_line(&fails(1, &nowhere), &["no sample lies on the terrain"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
