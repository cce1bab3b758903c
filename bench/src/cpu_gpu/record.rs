//! What a comparison leaves, as JSON: one file for each adapter.

use super::Failure;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use terrain_experiments::environment::Environment;

/// What `format` says.
pub const FORMAT: &str = "terrain-cpu-gpu/1";

/// The whole of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// [`FORMAT`].
    pub format: String,
    /// The adapter.
    pub adapter: Adapter,
    /// The processor beside it.
    pub processor: Processor,
    /// What the numbers may be taken for.
    pub claim: String,
    /// What `compute_seconds` and the ceilings were timed with.
    pub clock: String,
    /// What the adapter can do at the most.
    pub ceilings: Ceilings,
    /// Each workload at each size.
    pub workloads: Vec<Workload>,
}

/// The adapter in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// Driver and version.
    pub driver: String,
    /// Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// Whether it is emulated on the processor.
    pub software: bool,
}

/// The processor in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Processor {
    /// Model, or the target where the system does not tell.
    pub model: String,
    /// Threads of "all threads".
    pub threads: usize,
    /// The revision that was measured.
    pub commit: String,
}

impl Processor {
    /// Of this machine.
    pub fn here() -> Processor {
        let here = Environment::gather();
        Processor { model: here.cpu.unwrap_or(here.target), threads: here.threads, commit: here.commit }
    }
}

/// What two small kernels reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceilings {
    /// Of a copy, read and written together.
    pub bytes_per_second: f64,
    /// Of fused multiplications and additions in `f32`, each counted as two.
    pub operations_per_second: f64,
}

/// One workload of one size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Workload {
    /// Which.
    pub workload: String,
    /// How large, in words.
    pub size: String,
    /// Points, rays, nodes or leaves.
    pub items: u64,
    /// The fastest of three runs.
    pub processor_seconds_on_one_thread: f64,
    /// The fastest of three runs.
    pub processor_seconds_on_all_threads: f64,
    /// Of the run that took least by the wall.
    pub adapter: Cost,
    /// All threads over the adapter, by the wall: above 1 the adapter is faster.
    pub ratio: f64,
    /// Bytes that kernels read and write at the least; absent where they were not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes_moved: Option<f64>,
    /// Operations of kernels; absent where they were not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operations: Option<f64>,
    /// Bytes a second over the measured ceiling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share_of_measured_bandwidth: Option<f64>,
    /// Operations a second over the measured ceiling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share_of_measured_arithmetic: Option<f64>,
    /// What was counted and what was not.
    pub note: String,
}

/// What a run cost on the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cost {
    /// From the first word to the last, on the host.
    pub wall_seconds: f64,
    /// In which the host wrote.
    pub upload_seconds: f64,
    /// Of compute passes by the adapter's clock; absent where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compute_seconds: Option<f64>,
    /// In which the host read.
    pub read_back_seconds: f64,
    /// Written by the host.
    pub uploaded_bytes: u64,
    /// Read by the host.
    pub read_back_bytes: u64,
    /// Compute passes.
    pub passes: u64,
}

impl Record {
    /// Reads a record.
    ///
    /// # Errors
    /// When it is none, or of another format.
    pub fn parse(text: &str) -> Result<Record, Failure> {
        let record: Record = serde_json::from_str(text)?;
        if record.format != FORMAT {
            return Err(format!("format `{}`: expected `{FORMAT}`", record.format).into());
        }
        Ok(record)
    }
    /// The adapter's name as a file name.
    pub fn file_name(&self) -> String {
        let letters = self
            .adapter
            .name
            .to_lowercase()
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
            .collect::<String>();
        let words: Vec<&str> = letters.split('-').filter(|word| !word.is_empty()).collect();
        format!("{}.json", words.join("-"))
    }
    /// Writes it beside its place in `folder` and renames it; says where.
    ///
    /// # Errors
    /// When the folder cannot be written to.
    pub fn save(&self, folder: &Path) -> Result<PathBuf, Failure> {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let path = folder.join(self.file_name());
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        serde_json::to_writer_pretty(&mut file, self)?;
        std::io::Write::write_all(&mut file, b"\n")?;
        file.persist(&path)?;
        Ok(path)
    }
}
