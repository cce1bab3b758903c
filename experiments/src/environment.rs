//! Where a report was made: revision, compiler, machine, threads, seeds and the hashes of its inputs. A fact that could not be
//! had is listed in `absent` with its reason.

use crate::memory::kibibytes;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const LOCK_FILE: &str = include_str!("../../Cargo.lock");

/// The machine and the revision a report was made with.
#[derive(Clone, Debug, Serialize)]
pub struct Environment {
    /// The commit checked out, or "unknown".
    pub commit: String,
    /// Whether tracked files differed from the commit; missing when the commit is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dirty: Option<bool>,
    /// SHA-256 of the lock file the binary was built with.
    pub lock_file_sha256: String,
    /// `rustc --version`.
    pub rustc: String,
    /// Target triple.
    pub target: String,
    /// Instruction sets the compiler was allowed to use everywhere.
    pub target_features: Vec<String>,
    /// Cargo profile: debug or release.
    pub build: String,
    /// Operating system and kernel.
    pub os: String,
    /// CPU model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu: Option<String>,
    /// Cores this process may use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cores: Option<usize>,
    /// Memory of the machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_bytes: Option<u64>,
    /// Threads of the rayon pool.
    pub threads: usize,
    /// The graphics adapter, when an experiment used one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gpu: Option<Gpu>,
    /// The run's seed as it was given, and the seed derived from it for each experiment, in hexadecimal.
    pub seeds: BTreeMap<String, String>,
    /// SHA-256 of each input.
    pub inputs: BTreeMap<String, String>,
    /// What could not be had, and why.
    pub absent: BTreeMap<String, String>,
}

/// A graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Gpu {
    /// The adapter's name.
    pub adapter: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan, Metal or DirectX.
    pub backend: String,
    /// Whether it is emulated on the CPU.
    pub software: bool,
}

impl From<terrain_gpu::adapter::Description> for Gpu {
    fn from(found: terrain_gpu::adapter::Description) -> Self {
        Self { adapter: found.name, driver: found.driver, backend: found.backend, software: found.software }
    }
}

impl Gpu {
    /// The adapter that experiments of this run would use, for [`crate::report::Outcome::gpu`]. Asking loads the drivers, so it is
    /// left to experiments that use one.
    pub fn here() -> Option<Self> {
        terrain_gpu::adapter::describe().map(Self::from)
    }
}

impl Environment {
    /// Gathers what can be known of this process. The caller adds the GPU, the seeds and the inputs of experiments.
    pub fn gather() -> Self {
        let mut absent =
            BTreeMap::from([("gpu".to_owned(), "no experiment of this run asked for an adapter".to_owned())]);
        let mut known = |name: &str, why: &str, found: bool| {
            if !found {
                absent.insert(name.to_owned(), why.to_owned());
            }
        };
        let commit = git(&["rev-parse", "HEAD"]);
        let dirty = git(&["status", "--porcelain", "--untracked-files=no"]).map(|text| !text.is_empty());
        known("dirty", "git did not answer", dirty.is_some());
        let cpu = cpu_model();
        known("cpu", "/proc/cpuinfo has no model name", cpu.is_some());
        let cores = std::thread::available_parallelism().ok().map(usize::from);
        known("cores", "the system does not tell", cores.is_some());
        let memory_bytes = std::fs::read_to_string("/proc/meminfo")
            .ok()
            .and_then(|text| kibibytes(&text, "MemTotal:"))
            .map(|kib| kib * 1024);
        known("memory_bytes", "/proc/meminfo has no MemTotal", memory_bytes.is_some());
        Self {
            commit: commit.unwrap_or_else(|| "unknown".into()),
            dirty,
            lock_file_sha256: sha256(LOCK_FILE.as_bytes()),
            rustc: env!("REPORT_RUSTC").into(),
            target: env!("REPORT_TARGET").into(),
            target_features: env!("REPORT_TARGET_FEATURES").split(',').map(str::to_owned).collect(),
            build: env!("REPORT_PROFILE").into(),
            os: operating_system(),
            cpu,
            cores,
            memory_bytes,
            threads: rayon::current_num_threads(),
            gpu: None,
            seeds: BTreeMap::new(),
            inputs: terrain_papers::INPUTS
                .iter()
                .map(|(path, text)| ((*path).to_owned(), sha256(text.as_bytes())))
                .collect(),
            absent,
        }
    }

    /// Records the adapter that experiments used.
    pub fn set_gpu(&mut self, gpu: Gpu) {
        self.absent.remove("gpu");
        self.gpu = Some(gpu);
    }

    /// One line for the column "our hardware" of a table.
    pub fn hardware(&self) -> String {
        let mut line = self.cpu.clone().unwrap_or_else(|| self.target.clone());
        if let Some(cores) = self.cores {
            line += &format!(", {cores} cores");
        }
        if let Some(bytes) = self.memory_bytes {
            line += &format!(", {:.0} GiB", bytes as f64 / f64::from(1 << 30));
        }
        if let Some(gpu) = &self.gpu {
            line += &format!(", {}", gpu.adapter);
        }
        line
    }
}

/// SHA-256 in hexadecimal, as `sha256sum` prints it.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The folder of the sources this binary was built from, when it is still there.
pub(crate) fn repository() -> Option<PathBuf> {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().and_then(|root| root.canonicalize().ok())
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(repository()?).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

fn cpu_model() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn operating_system() -> String {
    let kernel = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let name = std::fs::read_to_string("/etc/os-release").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        Some(line.trim_matches('"').to_owned())
    });
    let name = name.unwrap_or_else(|| std::env::consts::OS.to_owned());
    if kernel.is_empty() { name } else { format!("{name}, kernel {}", kernel.trim()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sha256_agrees_with_the_standard_example() {
        // FIPS 180-4, the message "abc".
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn a_fact_is_present_or_absent_with_a_reason() {
        let environment = serde_json::to_value(Environment::gather()).unwrap();
        for name in ["dirty", "cpu", "cores", "memory_bytes", "gpu"] {
            let present = environment.get(name).is_some_and(|value| !value.is_null());
            assert_ne!(present, environment["absent"].get(name).is_some(), "{name}");
        }
    }

    #[test]
    fn the_adapter_of_this_machine_is_described_or_absent() {
        match Gpu::here() {
            Some(gpu) => {
                assert!(!gpu.adapter.is_empty() && gpu.software == gpu.adapter.ends_with("(software)"), "{gpu:?}")
            }
            None => eprintln!("skipped: no adapter"),
        }
    }

    #[test]
    fn a_gpu_is_no_longer_absent_once_it_is_set() {
        let mut environment = Environment::gather();
        let gpu = Gpu { adapter: "A".into(), driver: "d 1".into(), backend: "Vulkan".into(), software: true };
        environment.set_gpu(gpu);
        assert!(!environment.absent.contains_key("gpu") && environment.hardware().ends_with(", A"));
    }
}
