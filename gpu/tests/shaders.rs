//! Every shader of the crate is parsed and validated, with or without an adapter.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use terrain_gpu::tessellate::device::displace::DISPLACE;

fn validate(source: &str) -> Result<(), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).map(|_| ()).map_err(|error| error.emit_to_string(source))
}

#[test]
fn every_shader_is_valid() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders");
    let mut count = 0;
    // `program` holds parts of one shader, which the next test joins, and `displace.wgsl` stands behind `noise.wgsl`.
    validate(DISPLACE).unwrap();
    for entry in ["", "/tessellate"].iter().flat_map(|sub| std::fs::read_dir(format!("{folder}{sub}")).unwrap()) {
        let path = entry.unwrap().path();
        if path.is_dir() || path.ends_with("displace.wgsl") {
            continue;
        }
        assert_eq!(path.extension().and_then(|e| e.to_str()), Some("wgsl"), "{} is no shader", path.display());
        let source = std::fs::read_to_string(&path).unwrap();
        validate(&source).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        count += 1;
    }
    assert!(count >= 3);
}

#[test]
fn the_kernels_that_run_programs_are_valid_and_hold_every_part_in_their_folders() {
    use terrain_gpu::{program, trace};
    let over_tiles = [trace::MARCH, trace::GROUND].map(|kernel| trace::source([8, 8], kernel));
    let kernels = [("program", vec![program::source([8, 8])]), ("trace", over_tiles.to_vec())];
    for (folder, joined) in kernels {
        for text in &joined {
            validate(text).unwrap_or_else(|error| panic!("{folder}: {error}"));
        }
        for entry in std::fs::read_dir(format!("{}/shaders/{folder}", env!("CARGO_MANIFEST_DIR"))).unwrap() {
            let part = std::fs::read_to_string(entry.unwrap().path()).unwrap();
            assert!(joined.iter().any(|text| text.contains(&part)));
        }
    }
}

#[test]
fn a_shader_with_a_type_error_is_refused() {
    assert!(validate("fn f() -> u32 { return 1.0; }").is_err());
}
