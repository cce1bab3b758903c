//! `terrain implicit` as a shell sees it.

mod shell;

use glam::DVec2;
use shell::{ok, one_line, text};
use std::path::Path;
use terrain_model::grid::{Crs, Grid};
use terrain_model::io;

fn raster(path: &Path) {
    let values = (0..41 * 41).map(|k| (k % 41) as f32 * 0.3 + ((k / 41) % 7) as f32).collect();
    let grid = Grid::new(DVec2::new(500.0, 700.0), DVec2::splat(2.0), 41, 41, values).unwrap();
    io::write_grid(path, &grid.with_crs(Some(Crs::local_metres()))).unwrap();
}

#[test]
fn a_raster_becomes_a_closed_solid_with_its_resistance() {
    let folder = tempfile::tempdir().unwrap();
    let (dem, out, strokes) = (folder.path().join("a.tif"), folder.path().join("a.glb"), folder.path().join("s.ron"));
    raster(&dem);
    let said = ok(&["implicit", text(&dem), "--geology", "sandstone", "--out", text(&out)]);
    let values = |line: &str| -> u64 {
        let before = line.split(" values of the field").next().unwrap();
        before.rsplit(' ').next().unwrap().parse().unwrap()
    };
    assert!(said.contains("closed") && !said.contains(" 0 of bare ground"), "{said}");
    let bytes = std::fs::read(&out).unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    assert!(String::from_utf8_lossy(&bytes[..4000]).contains("_RESISTANCE"));
    // A stroke below the surface makes a cave: more triangles, values of the field, still closed.
    let stroke = "[(tool: Intrude, path: [(520, 720, 4), (560, 760, 6)], radius: 9, step: 3, strength: 0.8)]";
    std::fs::write(&strokes, stroke).unwrap();
    let carved = ok(&["implicit", text(&dem), "--strokes", text(&strokes), "--out", text(&out)]);
    assert!(carved.contains("closed") && values(&carved) > values(&said), "{carved}");
    // Threads change nothing.
    let other = folder.path().join("b.glb");
    ok(&["implicit", text(&dem), "--strokes", text(&strokes), "--out", text(&other), "--threads", "1"]);
    assert_eq!(std::fs::read(&out).unwrap(), std::fs::read(&other).unwrap());
}

#[test]
fn a_tree_is_meshed_and_so_is_a_part_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let (dem, file, out) = (folder.path().join("a.tif"), folder.path().join("a.ron"), folder.path().join("a.ply"));
    raster(&dem);
    let tree = |radius: &str| {
        format!(
            "(format: \"terrain-volume/1\", volume: carve(from: ground(file: \"a.tif\", radius: {radius}),\n by: primitives([(skeleton: \
             point(540, 740, 6), radius: 14, energy: 1)])))"
        )
    };
    std::fs::write(&file, tree("4")).unwrap();
    assert!(ok(&["implicit", text(&file), "--cell", "2", "--out", text(&out)]).contains("closed"));
    let part = ["implicit", text(&file), "--cell", "1", "--box", "530,730,-5,550,750,25", "--out", text(&out)];
    assert!(ok(&part).contains("closed"));
    one_line(&["implicit", text(&file), "--out", text(&out)], &["a.ron", "--cell"]);
    std::fs::write(&file, tree("-4")).unwrap();
    one_line(
        &["implicit", text(&file), "--cell", "2", "--out", text(&out)],
        &["volume.carve.from", "falloff radius -4"],
    );
    std::fs::write(&file, tree("4, deep: 3")).unwrap();
    one_line(&["implicit", text(&file), "--cell", "2", "--out", text(&out)], &["a.ron", "line 1, column", "deep"]);
    one_line(&["implicit", text(&dem), "--geology", "granite", "--out", text(&out)], &["granite", "sandstone"]);
    one_line(&["implicit", text(&dem), "--out", text(&folder.path().join("a.stl"))], &["a.stl"]);
    let far = ["implicit", text(&dem), "--box", "0,0,0,9,9,9", "--out", text(&out)];
    one_line(&far, &["a.tif", "--box"]);
}
