//! The same files seen by GDAL, where it is installed; elsewhere these tests say that they were skipped.

use std::path::Path;
use std::process::Command;

use glam::DVec2;

use super::super::read_grid;
use super::super::sidecar::example;
use super::{RasterType, write_f32};
use crate::grid::{Crs, Grid};

fn gdal(program: &str, arguments: &[&str]) -> Option<String> {
    match Command::new(program).args(arguments).output() {
        Ok(output) => {
            assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
            Some(String::from_utf8_lossy(&output.stdout).into_owned())
        }
        Err(_) => {
            println!("skipped: {program} not installed");
            None
        }
    }
}

#[test]
fn gdal_sees_the_same_place_size_and_elevations() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let name = path.to_str().unwrap();
    for raster_type in [RasterType::Area, RasterType::Point] {
        write_f32(&path, &example(), raster_type).unwrap();
        let Some(text) = gdal("gdalinfo", &["-json", "-mm", name]) else { return };
        let info: serde_json::Value = serde_json::from_str(&text).unwrap();
        // GDAL's corner is that of the north-west cell, whatever the raster type.
        assert_eq!(info["geoTransform"], serde_json::json!([-18.5, 30.0, 0.0, 1_000_030.0, 0.0, -20.0]));
        assert_eq!(info["size"], serde_json::json!([3, 2]));
        let band = &info["bands"][0];
        assert_eq!((band["computedMin"].as_f64(), band["computedMax"].as_f64()), (Some(236.0), Some(1076.0)));
        assert_eq!((band["noDataValue"].as_f64(), band["type"].as_str()), (Some(-9999.0), Some("Float32")));
        assert!(text.contains("UTM zone 11N"), "{text}");
    }
}

#[test]
fn what_gdal_makes_of_our_file_is_read_back_as_the_same_grid() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let values: Vec<f32> = (0..90 * 70).map(|k| (k % 90) as f32 * 1.25 - (k / 90) as f32 * 0.5).collect();
    let grid = Grid::new(DVec2::new(5e5, 4e6), DVec2::new(30.0, 20.0), 90, 70, values).unwrap();
    let grid = grid.with_no_data(Some(2.5)).with_crs(Some(Crs::projected(Some(32611))));
    let ours = at("ours.tif");
    write_f32(Path::new(&ours), &grid, RasterType::Point).unwrap();
    let options: &[&[&str]] = &[
        &[
            "-co",
            "COMPRESS=LZW",
            "-co",
            "PREDICTOR=3",
            "-co",
            "TILED=YES",
            "-co",
            "BLOCKXSIZE=32",
            "-co",
            "BLOCKYSIZE=16",
        ],
        &["-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=3", "-co", "BIGTIFF=YES"],
        &["-co", "COMPRESS=PACKBITS", "-co", "ENDIANNESS=BIG"],
        &["-ot", "Float64", "-co", "COMPRESS=LZW", "-co", "TILED=YES"],
        &["-co", "COMPRESS=LZW", "-co", "BLOCKYSIZE=7"],
        &["-mo", "AREA_OR_POINT=Area"],
        &["-of", "AAIGrid"],
    ];
    for (k, options) in options.iter().enumerate() {
        let theirs = at(&format!("{k}.{}", if options.contains(&"AAIGrid") { "asc" } else { "tif" }));
        let Some(_) = gdal("gdal_translate", &[options, &["-q", ours.as_str(), theirs.as_str()][..]].concat()) else {
            return;
        };
        let back = read_grid(Path::new(&theirs)).unwrap();
        assert_eq!(back.values(), grid.values(), "{options:?}");
        assert_eq!((back.origin(), back.spacing()), (grid.origin(), grid.spacing()), "{options:?}");
        assert_eq!(back.no_data_count(), grid.no_data_count(), "{options:?}");
        assert!(back.is_metric(), "{options:?}");
    }
}

#[test]
fn what_the_decoder_would_get_wrong_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (ours, theirs) = (at("ours.tif"), at("theirs.tif"));
    write_f32(Path::new(&ours), &example(), RasterType::Point).unwrap();
    let options = ["-q", "-co", "COMPRESS=LZW", "-co", "PREDICTOR=3", "-co", "ENDIANNESS=BIG", &ours, &theirs];
    let Some(_) = gdal("gdal_translate", &options) else { return };
    let error = read_grid(Path::new(&theirs)).unwrap_err();
    assert!(error.to_string().contains("predictor in a big-endian file"), "{error}");
}

#[test]
fn gdal_sees_the_system_of_every_format_that_has_one() {
    let folder = tempfile::tempdir().unwrap();
    // No code describes this one, so that its text itself has to come through.
    let by_hand = "PROJCS[\"mine\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",\
                   SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],PRIMEM[\"Greenwich\",0.0],\
                   UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",0.0],\
                   PARAMETER[\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",-115.5],\
                   PARAMETER[\"Scale_Factor\",1.0],PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\"Meter\",1.0]]";
    let by_hand = super::super::wkt::read(by_hand).unwrap();
    let systems = [
        (Crs::projected(Some(32611)), "UTM zone 11N"),
        (Crs::projected(Some(2154)), "Lambert-93"),
        (Crs::geographic(Some(4269)), "NAD83"),
        (by_hand, "-115.5"),
    ];
    for (crs, name) in systems {
        for extension in ["tif", "asc"] {
            let path = folder.path().join(format!("a.{extension}"));
            let grid = example().with_crs(Some(crs.clone()));
            super::super::write_grid(&path, &grid).unwrap();
            let Some(text) = gdal("gdalinfo", &[path.to_str().unwrap()]) else { return };
            assert!(text.contains(name), "{extension}: {text}");
            let back = read_grid(&path).unwrap();
            let (back, crs) = (back.crs().unwrap(), &crs);
            assert_eq!((back.kind, &back.wkt), (crs.kind, &crs.wkt), "{extension}");
        }
    }
}
