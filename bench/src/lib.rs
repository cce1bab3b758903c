//! Wall-clock benchmarks, one file a crate: `cargo bench -p terrain-bench`. They are for comparing two states of the code on a quiet
//! machine and are no gate; what is gated are the instruction counts and same-run ratios of the experiments.
//! `cargo run --release -p terrain-bench --bin cpu_gpu` compares the processor with an adapter and keeps what it finds.

pub mod cpu_gpu;
