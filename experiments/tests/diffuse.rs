//! `terrain diffuse` as a shell sees it, and what it writes as the other commands read it.

mod shell;

use serde_json::Value;
use shell::{ok, one_line, terrain, text};
use terrain_model::io;

/// A ridge with noise on a plain of 1000 × 1000 m; `more` follows the last curve.
fn curves(more: &str) -> String {
    format!(
        "(\n  format: \"terrain-curves/1\",\n  extent: (1000, 1000),\n  curves: [\n    (\"crest\", ridge(points: [(200, 500, 180), \
         (800, 550, 120)], left: (250, -35), right: (250, -30), noise: (6, 0.5))),\n    (\"plain\", hill(points: [(0, 10, 20), (990, 0, \
         20)], reach: 10, noise: (1, 0))),\n    {more}\n  ],\n)\n"
    )
}

#[test]
fn what_is_written_is_an_image_whose_nodes_have_its_elevations() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("a.ron"), folder.path().join("a.tif"));
    std::fs::write(&file, curves("")).unwrap();
    let said = ok(&["diffuse", text(&file), "--size", "65", "--out", text(&out), "--layers"]);
    assert!(said.contains("elevation: ") && said.contains("iterations, relative residual") && said.contains("65 × 65"));
    let grid = io::read_grid(&out).unwrap();
    assert!(grid.is_metric() && (grid.width(), grid.height()) == (65, 65));

    let scene = folder.path().join("scene.ron");
    let layer = "image(file: \"a.tif\", margin: 20)";
    std::fs::write(&scene, format!("(format: \"terrain-scene/1\", layers: {{ \"ground\": {layer} }})")).unwrap();
    let nodes: [(u32, u32); 5] = [(7, 9), (20, 32), (32, 33), (50, 20), (60, 50)];
    let places: Vec<String> =
        nodes.iter().map(|(i, j)| format!("{},{}", f64::from(*i) * 15.625, f64::from(*j) * 15.625)).collect();
    let arguments: Vec<&str> =
        ["eval", text(&scene)].into_iter().chain(places.iter().flat_map(|place| ["--at", place.as_str()])).collect();
    for (line, (i, j)) in ok(&arguments).lines().zip(nodes) {
        let found: Value = serde_json::from_str(line).unwrap();
        let (elevation, node) =
            (found["elevation"].as_f64().unwrap(), f64::from(grid.known(i as usize, j as usize).unwrap()));
        assert!((elevation - node).abs() < 1e-9 * node.abs().max(1.0), "({i}, {j}): {elevation}, not {node}");
        // Another node has another elevation: the comparison can tell.
        assert!((elevation - f64::from(grid.known(j as usize, i as usize).unwrap())).abs() > 1e-3);
    }

    let layer = |name: &str| io::read_grid(&folder.path().join(format!("a-{name}.tif"))).unwrap();
    let (smooth, detail) = (layer("smooth"), layer("detail"));
    let sums = grid.values().iter().zip(smooth.values()).zip(detail.values());
    assert!(sums.clone().all(|((whole, smooth), detail)| (whole - smooth - detail).abs() < 1e-4));
    assert!(detail.values().iter().any(|detail| detail.abs() > 0.5));
    for name in ["amplitude", "roughness", "gradient", "direction-x", "direction-y"] {
        assert!(layer(name).values().iter().any(|value| *value != 0.0), "{name}");
    }
}

#[test]
fn every_solver_and_format_writes_and_compact_curves_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let compact = folder.path().join("a.curves");
    let landscape = terrain_experiments::landscapes::builtin("fig5_ridge").unwrap();
    std::fs::write(&compact, landscape.to_compact().unwrap()).unwrap();
    for solver in ["paper", "corrected", "printed", "multigrid", "variational"] {
        let out = folder.path().join(format!("{solver}.asc"));
        ok(&["diffuse", text(&compact), "--size", "33", "--solver", solver, "--out", text(&out)]);
    }
    for extension in ["png", "raw", "r16", "exr", "glb"] {
        let out = folder.path().join("a").with_extension(extension);
        ok(&["diffuse", "builtin:fig7_crack", "--size", "33", "--out", text(&out)]);
        assert!(std::fs::metadata(&out).unwrap().len() > 100, "{extension}");
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("paper.asc") != read("multigrid.asc"));
}

#[test]
fn a_tolerance_that_is_not_met_is_said_after_the_file_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.tif");
    let run = ["diffuse", "builtin:fig5_peak", "--size", "65", "--out", text(&out)];
    let parts = ["a.tif: written", "relative residual", "iterations", "1e-6"];
    one_line(&[&run[..], &["--solver", "paper", "--tolerance", "1e-6"]].concat(), &parts);
    assert!(io::read_grid(&out).is_ok());
    ok(&[&run[..], &["--solver", "paper"]].concat());
    ok(&[&run[..], &["--tolerance", "1e-6"]].concat());
}

#[test]
fn bad_curves_are_one_line_with_file_place_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.ron");
    let out = folder.path().join("a.tif");
    let fails = |more: &str, parts: &[&str]| {
        std::fs::write(&file, curves(more)).unwrap();
        one_line(&["diffuse", text(&file), "--size", "33", "--out", text(&out)], parts);
    };
    fails("(\"x\", ridge(points: [(1, 2, 3)", &["a.ron:", ":"]);
    fails("(\"x\", hill(points: [(5, 5, 1), (5, 5, 1)], reach: 5)),", &["a.ron: curves[2] \"x\"", "expected"]);
    fails(
        "(\"x\", noise(points: [(5, 5), (90, 50)], amplitude: NaN, roughness: 0)),",
        &["a.ron: curves[2] \"x\"", "amplitude"],
    );
    fails("(\"x\", noise(points: [(9e5, 5), (9e5, 50)], amplitude: 1, roughness: 0)),", &["outside"]);
    let noise = "(format: \"terrain-curves/1\", extent: (9, 9), curves: [(\"n\", noise(points: [(1, 1), (8, 8)], amplitude: 1, \
                 roughness: 0))])";
    std::fs::write(&file, noise).unwrap();
    one_line(&["diffuse", text(&file), "--size", "33", "--out", text(&out)], &["a.ron", "no curve gives"]);
    std::fs::write(&file, b"TCC1 and nothing more").unwrap();
    one_line(&["diffuse", text(&file), "--size", "33", "--out", text(&out)], &["a.ron: byte "]);
    std::fs::write(&file, b"\xFF\xFE").unwrap();
    one_line(&["diffuse", text(&file), "--size", "33", "--out", text(&out)], &["byte 0", "UTF-8"]);
    one_line(&["diffuse", "none.ron", "--size", "33", "--out", text(&out)], &["none.ron", "builtin:canyon"]);
    one_line(&["diffuse", "builtin:none", "--size", "33", "--out", text(&out)], &["builtin:canyon"]);
    one_line(&["diffuse", "builtin:fig7_hill", "--size", "33", "--out", "a.gif"], &["a.gif", ".asc"]);
    assert!(!out.exists());
    for bad in [["--size", "1"], ["--solver", "magic"], ["--tolerance", "0"]] {
        let all = ["diffuse", "builtin:fig7_hill", "--size", "33", "--out", "a.tif"];
        let arguments: Vec<&str> = all.into_iter().chain(bad).collect();
        assert_eq!(terrain(&arguments).status.code(), Some(2), "{bad:?}");
    }
}

#[test]
fn the_raster_does_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, threads: &str, scene: &str| {
        let out = folder.path().join(name);
        ok(&["diffuse", scene, "--size", "130", "--threads", threads, "--out", text(&out)]);
        std::fs::read(out).unwrap()
    };
    let one = run("1.tif", "1", "builtin:fig5_peak");
    assert!(one == run("2.tif", "2", "builtin:fig5_peak"));
    assert!(one != run("3.tif", "2", "builtin:fig5_ridge"));
}

#[test]
fn an_adapter_writes_the_raster_of_the_processor_or_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let (cpu, gpu) = (folder.path().join("cpu.tif"), folder.path().join("gpu.tif"));
    let run = ["diffuse", "builtin:fig5_ridge", "--size", "65", "--out"];
    let on_adapter = [&run[..], &[text(&gpu), "--backend", "gpu"]].concat();
    let Some(adapter) = terrain_gpu::adapter::describe() else {
        assert!(!terrain_gpu::adapter::required(), "an adapter is required");
        eprintln!("skipped: no adapter");
        one_line(&on_adapter, &["install a driver"]);
        return;
    };
    ok(&[&run[..], &[text(&cpu)]].concat());
    assert!(ok(&on_adapter).contains(&format!("on {}", adapter.name)));
    let read = |file: &std::path::Path| io::read_grid(file).unwrap().values().to_vec();
    let (expected, found) = (read(&cpu), read(&gpu));
    let [low, high] =
        expected.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], h| [low.min(*h), high.max(*h)]);
    let furthest = |other: &[f32]| expected.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Both leave 1e-8 of the field, of which the system makes 10⁴ times as much at the most on so few nodes.
    assert!(furthest(&found) <= 1e-4 * (high - low), "{}", furthest(&found));
    // Another solver is further away, so the comparison can tell.
    ok(&[&on_adapter[..], &["--solver", "paper"]].concat());
    assert!(furthest(&read(&gpu)) > 1e-3 * (high - low));
    one_line(
        &[&on_adapter[..], &["--adapter", "no such"]].concat(),
        &["no such", &adapter.name.replace(" (software)", "")],
    );
}
