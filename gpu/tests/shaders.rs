//! Every shader of the crate is parsed and validated, with or without an adapter.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::path::Path;
use terrain_gpu::tessellate::device::displace::DISPLACE;
use terrain_gpu::tessellate::device::refine::{ADVANCE, REFINE};
use terrain_gpu::{ceiling, diffusion, lattice_hash, program, trace};

fn validate(source: &str) -> Result<(), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).map(|_| ()).map_err(|error| error.emit_to_string(source))
}

/// Every kernel as the device gets it.
fn kernels() -> Vec<String> {
    let over_tiles = [trace::MARCH, trace::GROUND].map(|kernel| trace::source([8, 8], kernel));
    let alone = [lattice_hash::SOURCE, REFINE, ADVANCE, DISPLACE, ceiling::STREAM, ceiling::CHAIN].map(str::to_owned);
    let diffusing = diffusion::SOURCES.iter().map(|source| source.text.to_owned());
    [program::source([8, 8])].into_iter().chain(over_tiles).chain(alone).chain(diffusing).collect()
}

#[test]
fn every_kernel_is_valid_and_every_file_is_part_of_one() {
    let kernels = kernels();
    for kernel in &kernels {
        validate(kernel).unwrap_or_else(|error| panic!("{error}"));
    }
    let (mut folders, mut count) = (vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")], 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            assert_eq!(path.extension().and_then(|e| e.to_str()), Some("wgsl"), "{} is no shader", path.display());
            let part = std::fs::read_to_string(&path).unwrap();
            assert!(kernels.iter().any(|kernel| kernel.contains(&part)), "{} is part of no kernel", path.display());
            count += 1;
        }
    }
    assert!(count > 10, "{count}");
}

#[test]
fn a_shader_with_a_type_error_is_refused() {
    assert!(validate("fn f() -> u32 { return 1.0; }").is_err());
}
