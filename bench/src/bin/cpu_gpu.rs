//! Times the processor against an adapter and saves the record: `cargo run --release -p terrain-bench --bin cpu_gpu -- --out bench/results`.

use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use terrain_bench::cpu_gpu::{Failure, Sizes, record::Workload, run};

/// Times the processor, on one thread and on all, against a graphics adapter, and saves what it found as FOLDER/ADAPTER.json.
///
/// Work of each size is timed three times and the fastest counts. Keep the machine quiet.
#[derive(Parser, Debug)]
#[command(name = "cpu_gpu")]
struct Arguments {
    /// The folder of the record
    #[arg(long, value_name = "FOLDER", default_value = "bench/results")]
    out: PathBuf,
    /// The adapter, by any part of its name [default: TERRAIN_ADAPTER, or the fastest kind there is]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Small sizes: seconds on two cores
    #[arg(long)]
    quick: bool,
}

fn say(entry: &Workload) {
    let Workload { workload, size, adapter, .. } = entry;
    let [one, all, wall, upload, read] = [
        entry.processor_seconds_on_one_thread,
        entry.processor_seconds_on_all_threads,
        adapter.wall_seconds,
        adapter.upload_seconds,
        adapter.read_back_seconds,
    ]
    .map(|seconds| 1e3 * seconds);
    let compute = adapter.compute_seconds.map_or("no clock".to_owned(), |seconds| format!("{:.2} ms", 1e3 * seconds));
    println!(
        "{workload}, {size}: one thread {one:.2} ms, all {all:.2} ms; adapter {wall:.2} ms (written in {upload:.2}, computed in {compute}, read in {read:.2}), ratio {:.2}",
        entry.ratio
    );
}

fn measured(arguments: &Arguments) -> Result<(), Failure> {
    let sizes = if arguments.quick { Sizes::Quick } else { Sizes::Full };
    let record = run(arguments.adapter.as_deref(), sizes, &say)?;
    let path = record.save(&arguments.out)?;
    println!("{}: {}; {}", path.display(), record.adapter.name, record.claim);
    Ok(())
}

fn main() -> ExitCode {
    match measured(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cpu_gpu: {error}");
            ExitCode::from(2)
        }
    }
}
