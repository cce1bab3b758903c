//! Benchmarks: instruction counts, throughput, CPU against GPU.
