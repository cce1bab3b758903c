use super::super::sidecar::example;
use super::*;

const HEADER: &str = "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n";

fn parse(text: &str) -> Result<Grid<f32>, ReadError> {
    read_from(text.as_bytes(), None, "a.asc")
}

fn parse_after(header: &str) -> Result<Grid<f32>, ReadError> {
    parse(&format!("{header}\n1 2 3\n4 5 6\n"))
}

#[test]
fn corner_is_half_a_cell_from_the_sample_and_center_is_the_sample() {
    let corner = parse(&format!("{HEADER}1 2 3\n4 5 -9999\n")).unwrap();
    assert_eq!(corner.origin(), DVec2::new(105.0, 205.0));
    assert_eq!(corner.values(), [4.0, 5.0, -9999.0, 1.0, 2.0, 3.0], "the last line is the southern row");
    assert_eq!((corner.known(2, 0), corner.crs()), (None, None));
    let center = parse(&format!("{}1 2 3 4 5\r\n6\r\n", HEADER.replace("llcorner", "LLCENTER"))).unwrap();
    assert_eq!(center.origin(), DVec2::new(100.0, 200.0));
}

#[test]
fn dx_and_dy_may_differ() {
    let grid = parse_after("NCOLS 3\nNROWS 2\nXLLCORNER 0\nYLLCORNER 0\ndx 10\ndy 20").unwrap();
    assert_eq!((grid.spacing(), grid.origin()), (DVec2::new(10.0, 20.0), DVec2::new(5.0, 10.0)));
    assert_eq!(grid.no_data(), Some(-9999.0), "ESRI's default");
}

#[test]
fn written_grid_is_read_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.asc");
    let grid = example().map_known(|v| v / 3.0).with_crs(None);
    write(&path, &grid).unwrap();
    assert_eq!(read(&path).unwrap(), grid);
    assert!(!path.with_extension("prj").exists());
}

#[test]
fn a_system_survives_in_the_projection_file_and_a_stale_one_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.asc");
    let by_hand = "PROJCS[\"mine\",UNIT[\"Foot_US\",0.3048006096012192]]";
    let text = format!("{HEADER}1 2 3 4 5 6");
    let by_hand = read_from(text.as_bytes(), Some(by_hand.as_bytes()), "a.asc").unwrap().crs().cloned();
    let systems = [Crs::geographic(Some(4326)), Crs::local_metres(), Crs::projected(Some(32611)), by_hand.unwrap()];
    for crs in systems {
        let grid = example().with_crs(Some(crs));
        write(&path, &grid).unwrap();
        assert_eq!(read(&path).unwrap(), grid);
    }
    write(&path, &example().with_crs(None)).unwrap();
    assert_eq!(read(&path).unwrap().crs(), None);
}

#[test]
fn what_looks_like_degrees_is_taken_for_degrees_and_a_projection_file_has_the_last_word() {
    let text = HEADER.replace("xllcorner 100", "xllcorner -84.4").replace("200", "36.4").replace("10\n", "0.01\n");
    let text = format!("{text}1 2 3 4 5 6");
    assert!(!parse(&text).unwrap().is_metric());
    assert!(!read_from(text.as_bytes(), Some(b"?"), "a.asc").unwrap().is_metric());
    let projected = b"PROJCS[\"x\",GEOGCS[\"y\",UNIT[\"Degree\",0.017]],UNIT[\"Meter\",1.0]]";
    assert!(read_from(text.as_bytes(), Some(projected), "a.asc").unwrap().is_metric());
    let feet = b"PROJCS[\"x\",GEOGCS[\"y\",UNIT[\"Degree\",0.017]],UNIT[\"Foot_US\",0.3048006096012192]]";
    assert!(!read_from(text.as_bytes(), Some(feet), "a.asc").unwrap().is_metric());
}

#[test]
fn every_broken_file_is_one_line_with_its_place() {
    let h = HEADER;
    let cases: &[(String, ReadErrorKind, &str)] = &[
        (format!("{h}1 2 3\n4 x 6\n"), ReadErrorKind::Value, "line 8"),
        (format!("{h}1 2 3\n4 5,5 6\n"), ReadErrorKind::Value, "line 8"),
        (format!("{h}1 2 3\n4 nan 6\n"), ReadErrorKind::Value, "line 8"),
        (format!("{h}1 2 3\n4 1e99 6\n"), ReadErrorKind::Value, "line 8"),
        (format!("{h}1 2 3\n4 5\n"), ReadErrorKind::Truncated, "end of the file, line 9"),
        (format!("{h}1 2 3\n4 5 6 7\n"), ReadErrorKind::Truncated, "line 8"),
        (format!("{h}-9999 -9999 -9999 -9999 -9999 -9999"), ReadErrorKind::Value, "all samples"),
        (
            h.replace("ncols 3", "ncols 2147483648").replace("nrows 2", "nrows 2147483648"),
            ReadErrorKind::Truncated,
            "ncols, nrows",
        ),
        (h.replace("ncols 3", "ncols 1e300"), ReadErrorKind::Header, "ncols"),
        (h.replace("ncols 3", "ncols -3"), ReadErrorKind::Header, "ncols"),
        (h.replace("ncols 3", "ncols 0"), ReadErrorKind::Header, "ncols"),
        (h.replace("ncols 3", "ncols three"), ReadErrorKind::Value, "line 1"),
        (h.replace("ncols 3", "ncols 3\nNCOLS 3"), ReadErrorKind::Header, "line 2"),
        (h.replace("ncols 3", "columns 3"), ReadErrorKind::Magic, "line 1"),
        (h.replace("cellsize 10\n", ""), ReadErrorKind::Header, "header"),
        (h.replace("cellsize 10\n", "dx 10\n"), ReadErrorKind::Header, "header"),
        (h.replace("yllcorner 200\n", ""), ReadErrorKind::Header, "header"),
        (format!("{}1 2 3 4 5 6", h.replace("size 10", "size 0")), ReadErrorKind::Header, "header"),
        (format!("{}1 2 3 4 5 6", h.replace("size 10", "size -10")), ReadErrorKind::Header, "header"),
        (format!("{}1 2 3 4 5 6", h.replace("size 10", "size nan")), ReadErrorKind::Header, "header"),
        ("ncols".into(), ReadErrorKind::Value, "line 1"),
        ("\u{89}PNG\r\n".into(), ReadErrorKind::Header, "header"),
        (String::new(), ReadErrorKind::Header, "header"),
    ];
    for (text, kind, place) in cases {
        let error = parse(text).unwrap_err();
        assert_eq!((error.kind, &*error.place), (*kind, *place), "{text:?}: {error}");
        let line = error.to_string();
        assert!(line.starts_with("a.asc: ") && !line.contains('\n') && line.contains("; expected "), "{line}");
    }
}

#[test]
fn elevation_that_would_be_read_as_no_data_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 2, 1, vec![1.0, -9999.0]).unwrap();
    assert!(write(&folder.path().join("a.asc"), &grid).is_err());
}
