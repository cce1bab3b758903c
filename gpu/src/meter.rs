//! What a stretch of work cost: bytes and seconds of uploads and read-backs as the host sees them, and seconds of compute passes by the
//! device's own clock where it has one.

use crate::context::{Context, ContextError};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// What was spent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Bytes copied to the device.
    pub uploaded: u64,
    /// Seconds in which the host wrote them. A driver may copy them on while the device computes.
    pub upload_seconds: f64,
    /// Seconds of compute passes by the device's timestamps; `None` where the adapter has none.
    pub compute_seconds: Option<f64>,
    /// Seconds from the first to the last word of the work on the host, waits included.
    pub wall_seconds: f64,
    /// Bytes copied back.
    pub read: u64,
    /// Seconds in which the host mapped and read them, after the device was done.
    pub read_seconds: f64,
    /// Compute passes.
    pub passes: u64,
}

/// The meter of a device: off until [`Context::metered`] runs.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    running: Mutex<Option<Running>>,
}

#[derive(Debug, Default)]
struct Running {
    spent: Spent,
    /// Pairs of timestamps that the host has not read.
    pending: Vec<wgpu::Buffer>,
}

impl Meter {
    fn with<R>(&self, action: impl FnOnce(&mut Running) -> R) -> Option<R> {
        // A panic elsewhere leaves numbers and no broken invariant.
        let mut running = self.running.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        running.as_mut().map(action)
    }
    /// Whether a stretch of work is being measured.
    pub(crate) fn is_on(&self) -> bool {
        self.with(|_| ()).is_some()
    }
    /// Notes bytes written by the host since `start`.
    pub(crate) fn uploaded(&self, bytes: u64, start: Instant) {
        self.with(|running| {
            running.spent.uploaded += bytes;
            running.spent.upload_seconds += start.elapsed().as_secs_f64();
        });
    }
    /// Notes bytes read by the host in `time`.
    pub(crate) fn read(&self, bytes: u64, time: Duration) {
        self.with(|running| {
            running.spent.read += bytes;
            running.spent.read_seconds += time.as_secs_f64();
        });
    }
}

impl Context {
    /// Whether the device tells the time of compute passes.
    pub fn has_timestamps(&self) -> bool {
        self.device().features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Runs `work` and says what it cost. One stretch at a time: one within another takes its numbers away.
    ///
    /// # Errors
    /// When the device does not finish or its timestamps cannot be read.
    pub fn metered<R>(&self, work: impl FnOnce() -> R) -> Result<(R, Spent), ContextError> {
        let set = |to| *self.meter().running.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = to;
        set(Some(Running::default()));
        let start = Instant::now();
        let result = work();
        let wall = start.elapsed().as_secs_f64();
        let running = self.meter().with(std::mem::take).unwrap_or_default();
        set(None);
        let mut spent = Spent { wall_seconds: wall, ..running.spent };
        if self.has_timestamps() {
            let period = f64::from(self.queue().get_timestamp_period()) * 1e-9;
            let mut ticks = 0;
            for pair in &running.pending {
                let words = self.download(pair, 4)?;
                let stamp = |k: usize| u64::from(words[k]) | u64::from(words[k + 1]) << 32;
                ticks += stamp(2).saturating_sub(stamp(0));
            }
            spent.compute_seconds = Some(ticks as f64 * period);
        }
        Ok((result, spent))
    }

    /// Encodes a compute pass; it is timed where the meter is on and the adapter has a clock.
    pub(crate) fn pass<R>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        encode: impl FnOnce(&mut wgpu::ComputePass<'_>) -> R,
    ) -> R {
        let on = self.meter().with(|running| running.spent.passes += 1).is_some();
        if !on || !self.has_timestamps() {
            return encode(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()));
        }
        let stamps = self.device().create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let writes = wgpu::ComputePassTimestampWrites {
            query_set: &stamps,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        };
        let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes: Some(writes) };
        let result = encode(&mut encoder.begin_compute_pass(&descriptor));
        let pair = self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("timestamps"),
            size: 16,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        encoder.resolve_query_set(&stamps, 0..2, &pair, 0);
        self.meter().with(|running| running.pending.push(pair));
        result
    }
}

#[cfg(test)]
mod tests {
    use crate::context::device;
    use crate::lattice_hash::{Point, hashes};

    #[test]
    fn bytes_and_passes_are_those_of_the_work_and_nothing_is_metered_outside() {
        let Some(context) = device() else { return };
        let points: Vec<Point> = (0..1000).map(|k| Point { index: [k, -k, 7], seed: 1 }).collect();
        hashes(&context, &points).unwrap();
        let (found, spent) = context.metered(|| hashes(&context, &points).unwrap()).unwrap();
        assert_eq!((found.len(), spent.uploaded, spent.read, spent.passes), (1000, 16_000, 8_000, 1));
        assert!(spent.wall_seconds > 0.0 && spent.upload_seconds <= spent.wall_seconds);
        assert_eq!(spent.compute_seconds.is_some(), context.has_timestamps());
        assert!(spent.compute_seconds.is_none_or(|seconds| seconds <= spent.wall_seconds));
        let (_, idle) = context.metered(|| ()).unwrap();
        assert_eq!((idle.uploaded, idle.read, idle.passes), (0, 0, 0));
    }
}
