//! The comparison runs at its quick size, and every record that is kept can be read.

use terrain_bench::cpu_gpu::record::{FORMAT, Record};
use terrain_bench::cpu_gpu::{Sizes, run};

#[test]
fn a_quick_comparison_is_whole_and_survives_its_file() {
    if let Err(error) = terrain_gpu::context::Context::new(None) {
        assert!(!terrain_gpu::adapter::required(), "TERRAIN_REQUIRE_GPU=1: {error}");
        eprintln!("skipped: {error}");
        return;
    }
    let record = run(None, Sizes::Quick, &|_| ()).unwrap();
    assert_eq!(record.claim.contains("no claim"), record.adapter.software);
    for name in ["heights", "tracing", "diffusion, converged", "diffusion, the paper's schedule", "refinement"] {
        let found: Vec<_> = record.workloads.iter().filter(|entry| entry.workload == name).collect();
        assert!(!found.is_empty(), "{name}");
        for entry in found {
            let cost = entry.adapter;
            assert!(
                entry.items > 0 && entry.processor_seconds_on_one_thread > 0.0 && cost.wall_seconds > 0.0,
                "{entry:?}"
            );
            assert!(cost.passes > 0 && cost.uploaded_bytes > 0 && cost.read_back_bytes > 0, "{entry:?}");
            assert!(cost.compute_seconds.is_none_or(|seconds| seconds <= cost.wall_seconds), "{entry:?}");
            assert_eq!(entry.ratio, entry.processor_seconds_on_all_threads / cost.wall_seconds);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = record.save(folder.path()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(Record::parse(&text).unwrap().workloads.len(), record.workloads.len());
    assert!(
        path.file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .bytes()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || b"-.".contains(&c))
    );
    let other = text.replace(FORMAT, "terrain-cpu-gpu/0");
    assert!(Record::parse(&other).unwrap_err().to_string().contains("expected"));
}

#[test]
fn every_record_that_is_kept_is_one_and_has_its_adapters_name() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/results");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "json") {
            let record = Record::parse(&std::fs::read_to_string(&path).unwrap())
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert_eq!(path.file_name().and_then(|name| name.to_str()), Some(record.file_name().as_str()));
            assert!(!record.workloads.is_empty());
            count += 1;
        }
    }
    assert!(count > 0, "no record is kept");
}
