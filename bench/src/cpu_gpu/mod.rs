//! The processor against an adapter: each workload at each size, timed on one thread, on all, and on the adapter, beside what the adapter
//! can do at the most.

pub mod record;
mod workloads;

use record::{Adapter, Ceilings, Cost, FORMAT, Processor, Record, Workload};
use std::time::Instant;
use terrain_gpu::ceiling;
use terrain_gpu::context::Context;
use terrain_gpu::meter::Spent;

/// Times that everything is run; the fastest counts.
const ROUNDS: usize = 3;

/// A failure in one line.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// How large workloads are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sizes {
    /// Seconds on two cores without an adapter of their own.
    Quick,
    /// What the papers and the project's aims name.
    Full,
}

/// A workload of one size, ready to run.
struct Task<'a> {
    workload: &'static str,
    size: String,
    /// What is counted: points, rays, nodes, leaves.
    items: u64,
    processor: Box<dyn Fn() -> Result<(), Failure> + Send + Sync + 'a>,
    adapter: Box<dyn Fn() -> Result<Work, Failure> + 'a>,
    note: &'static str,
}

/// What the adapter did in a run: counted, or not known.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    bytes: Option<f64>,
    operations: Option<f64>,
}

/// The fastest of some runs, seconds.
fn fastest(run: &(dyn Fn() -> Result<(), Failure> + Send + Sync)) -> Result<f64, Failure> {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        run()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}

fn measure(
    context: &Context,
    single: &rayon::ThreadPool,
    task: &Task<'_>,
    at_most: &Ceilings,
) -> Result<Workload, Failure> {
    let one_thread = single.install(|| fastest(&*task.processor))?;
    let all_threads = fastest(&*task.processor)?;
    let mut best: Option<(Spent, Work)> = None;
    for _ in 0..ROUNDS {
        let (work, spent) = context.metered(|| (task.adapter)())?;
        let work = work?;
        if best.as_ref().is_none_or(|(before, _)| spent.wall_seconds < before.wall_seconds) {
            best = Some((spent, work));
        }
    }
    let (spent, work) = best.ok_or("nothing was measured")?;
    let computing = spent.compute_seconds.unwrap_or(spent.wall_seconds);
    let share = |amount: Option<f64>, rate: f64| amount.map(|amount| amount / computing / rate);
    Ok(Workload {
        workload: task.workload.to_owned(),
        size: task.size.clone(),
        items: task.items,
        processor_seconds_on_one_thread: one_thread,
        processor_seconds_on_all_threads: all_threads,
        adapter: Cost {
            wall_seconds: spent.wall_seconds,
            upload_seconds: spent.upload_seconds,
            compute_seconds: spent.compute_seconds,
            read_back_seconds: spent.read_seconds,
            uploaded_bytes: spent.uploaded,
            read_back_bytes: spent.read,
            passes: spent.passes,
        },
        ratio: all_threads / spent.wall_seconds,
        bytes_moved: work.bytes,
        operations: work.operations,
        share_of_measured_bandwidth: share(work.bytes, at_most.bytes_per_second),
        share_of_measured_arithmetic: share(work.operations, at_most.operations_per_second),
        note: task.note.to_owned(),
    })
}

/// Measures everything on the adapter that `wanted` or the environment names; `say` hears of each workload when it is done.
///
/// # Errors
/// When there is no adapter, or a workload fails.
pub fn run(wanted: Option<&str>, sizes: Sizes, say: &dyn Fn(&Workload)) -> Result<Record, Failure> {
    let context = Context::new(wanted)?;
    let description = context.description().clone();
    let mebibytes = if sizes == Sizes::Quick { 4 } else { 64 };
    let found = ceiling::measure(&context, mebibytes)?;
    let ceilings =
        Ceilings { bytes_per_second: found.bytes_per_second, operations_per_second: found.operations_per_second };
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut entries = Vec::new();
    let mut each = |task: Task<'_>| -> Result<(), Failure> {
        let entry = measure(&context, &single, &task, &ceilings)?;
        say(&entry);
        entries.push(entry);
        Ok(())
    };
    workloads::heights(&context, sizes, &mut each)?;
    workloads::tracing(&context, sizes, &mut each)?;
    workloads::diffusion(&context, sizes, &mut each)?;
    workloads::refinement(&context, sizes, &mut each)?;
    let clock = if context.has_timestamps() { "timestamps of the adapter" } else { "wall clock of the host" };
    let claim = if description.software {
        "a software adapter, emulated on the processor: no claim of speed"
    } else {
        "measured on this adapter and this processor"
    };
    Ok(Record {
        format: FORMAT.to_owned(),
        adapter: Adapter {
            name: description.name,
            driver: description.driver,
            backend: description.backend,
            software: description.software,
        },
        processor: Processor::here(),
        claim: claim.to_owned(),
        clock: clock.to_owned(),
        ceilings,
        workloads: entries,
    })
}
