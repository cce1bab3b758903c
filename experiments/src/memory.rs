//! Peak memory of one experiment: the kernel's high-water mark of resident memory, reset before the experiment starts. What the
//! process already holds when the experiment starts is part of it.

/// A mark from which the peak is measured.
pub(crate) struct PeakMemory(Result<(), String>);

impl PeakMemory {
    /// Resets the high-water mark.
    pub fn start() -> Self {
        Self(reset())
    }

    /// The largest resident memory since `start`, in bytes, or why it could not be measured.
    pub fn bytes(self) -> Result<u64, String> {
        self.0.and_then(|()| high_water_mark())
    }
}

#[cfg(target_os = "linux")]
fn reset() -> Result<(), String> {
    std::fs::write("/proc/self/clear_refs", "5")
        .map_err(|error| format!("the high-water mark cannot be reset: {error}"))
}

#[cfg(target_os = "linux")]
fn high_water_mark() -> Result<u64, String> {
    let status = std::fs::read_to_string("/proc/self/status").map_err(|error| format!("/proc/self/status: {error}"))?;
    kibibytes(&status, "VmHWM:").map(|kib| kib * 1024).ok_or_else(|| "/proc/self/status has no VmHWM".into())
}

#[cfg(not(target_os = "linux"))]
fn reset() -> Result<(), String> {
    Err("measured on Linux only".into())
}

#[cfg(not(target_os = "linux"))]
fn high_water_mark() -> Result<u64, String> {
    Err("measured on Linux only".into())
}

/// The number of kB after `key` in a file of the form of `/proc/meminfo`.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
pub(crate) fn kibibytes(text: &str, key: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(key))?.trim().strip_suffix("kB")?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proc_line_is_read_in_kibibytes() {
        assert_eq!(kibibytes("VmPeak:\t 9 kB\nVmHWM:\t    1234 kB\n", "VmHWM:"), Some(1234));
        assert_eq!(kibibytes("VmHWM: 1234 pages\n", "VmHWM:"), None);
    }

    #[test]
    fn touching_memory_raises_the_peak_by_as_much() {
        const BYTES: usize = 64 << 20;
        let peak = PeakMemory::start();
        let touched = std::hint::black_box(vec![1u8; BYTES]);
        match peak.bytes() {
            Ok(bytes) => assert!(bytes >= touched.len() as u64, "{bytes}"),
            Err(why) => assert!(!why.is_empty()),
        }
    }
}
