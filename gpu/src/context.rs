//! One place that opens a device, compiles kernels for it and moves words to and from it. A machine without an adapter gives an error
//! that says what to install.

use crate::adapter::{Description, choose};
use crate::meter::Meter;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use wgpu::util::DeviceExt;

/// Longest wait for the device. A kernel that takes longer is a bug or a hung driver.
pub const TIMEOUT: Duration = Duration::from_secs(60);

/// No kernel could run, or one did not finish.
#[derive(Debug, thiserror::Error)]
pub enum ContextError {
    /// The machine has no driver.
    #[error(
        "no {} adapter was found: install a driver (Debian: apt-get install mesa-vulkan-drivers libvulkan1 gives the software one)",
        if cfg!(target_os = "macos") { "Metal" } else if cfg!(windows) { "DirectX 12 or Vulkan" } else { "Vulkan" }
    )]
    NoAdapter,
    /// Adapters exist, none of that name.
    #[error("no adapter's name contains `{wanted}`; there are: {}", found.join(", "))]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// The names of the adapters.
        found: Vec<String>,
    },
    /// The adapter gave no device.
    #[error("{adapter} gave no device: {source}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// Why.
        source: wgpu::RequestDeviceError,
    },
    /// A shader or a pipeline was refused.
    #[error("{kernel}: {source}")]
    Kernel {
        /// Its name.
        kernel: &'static str,
        /// What is wrong with it.
        source: wgpu::Error,
    },
    /// The device did not finish.
    #[error("the device did not answer within {} s: {source}", TIMEOUT.as_secs())]
    Poll {
        /// What the wait returned.
        source: wgpu::PollError,
    },
    /// The results could not be read back.
    #[error("results could not be read back: {0}")]
    ReadBack(String),
}

/// A device of one adapter, with all the limits the adapter has.
#[derive(Debug)]
pub struct Context {
    description: Description,
    device: wgpu::Device,
    queue: wgpu::Queue,
    meter: Meter,
}

impl Context {
    /// Opens a device on the adapter that `wanted` or the environment names.
    ///
    /// # Errors
    /// When there is no such adapter, or it gives no device.
    pub fn new(wanted: Option<&str>) -> Result<Context, ContextError> {
        Context::on(&choose(wanted)?)
    }

    /// Opens a device on an adapter.
    ///
    /// # Errors
    /// When it gives none.
    pub fn on(adapter: &wgpu::Adapter) -> Result<Context, ContextError> {
        let info = adapter.get_info();
        // The one feature beyond the least: it only tells the time.
        let required_features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let request =
            wgpu::DeviceDescriptor { required_features, required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&request))
            .map_err(|source| ContextError::Device { adapter: info.name.clone(), source })?;
        Ok(Context { description: Description::new(&info), device, queue, meter: Meter::default() })
    }

    /// The adapter in words.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// A compute kernel from WGSL, with the bindings that the source declares.
    ///
    /// # Errors
    /// When the source or the pipeline is refused.
    pub fn kernel(&self, name: &'static str, source: &str, entry: &str) -> Result<wgpu::ComputePipeline, ContextError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        match pollster::block_on(scope.pop()) {
            Some(source) => Err(ContextError::Kernel { kernel: name, source }),
            None => Ok(pipeline),
        }
    }

    /// Runs `kernel` with `groups` workgroups on `input` (binding 0) and returns the `output_words` that it writes to
    /// binding 1.
    ///
    /// # Errors
    /// When the device does not finish in time or the result cannot be read.
    pub fn run(
        &self,
        kernel: &wgpu::ComputePipeline,
        groups: [u32; 2],
        input: &[u32],
        output_words: usize,
    ) -> Result<Vec<u32>, ContextError> {
        self.run_on(kernel, groups, &[input], output_words)
    }

    /// The most bytes that one storage binding of the device holds.
    pub fn largest_binding(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// Words that stay on the device, for many dispatches; not empty.
    ///
    /// # Errors
    /// When the device refuses the buffer.
    pub fn upload(&self, words: &[u32]) -> Result<wgpu::Buffer, ContextError> {
        self.checked("a buffer", || self.buffer_of("input", words, wgpu::BufferUsages::STORAGE))
    }

    /// The same on several inputs, none of them empty: bindings 0, 1, … in their order, and the output after them.
    ///
    /// # Errors
    /// When the device refuses a buffer or the dispatch, does not finish in time, or the result cannot be read.
    pub fn run_on(
        &self,
        kernel: &wgpu::ComputePipeline,
        groups: [u32; 2],
        inputs: &[&[u32]],
        output_words: usize,
    ) -> Result<Vec<u32>, ContextError> {
        self.run_after(kernel, groups, &[], inputs, output_words)
    }

    /// The same with buffers of [`Context::upload`] bound before the inputs.
    ///
    /// # Errors
    /// As [`Context::run_on`].
    pub fn run_after(
        &self,
        kernel: &wgpu::ComputePipeline,
        groups: [u32; 2],
        resident: &[wgpu::Buffer],
        inputs: &[&[u32]],
        output_words: usize,
    ) -> Result<Vec<u32>, ContextError> {
        let submitted = self.checked("a dispatch", || {
            let uploaded = inputs.iter().map(|words| self.buffer_of("input", words, wgpu::BufferUsages::STORAGE));
            self.submit(kernel, groups, resident.iter().cloned().chain(uploaded).collect(), output_words)
        })?;
        self.read_back(submitted)
    }

    /// The device.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Its meter.
    pub(crate) fn meter(&self) -> &Meter {
        &self.meter
    }

    /// Runs `action`; what the device refuses in it is an error of `kernel`.
    ///
    /// # Errors
    /// When the device refuses something.
    pub(crate) fn checked<T>(&self, kernel: &'static str, action: impl FnOnce() -> T) -> Result<T, ContextError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = action();
        let refused = [pollster::block_on(validation.pop()), pollster::block_on(memory.pop())];
        match refused.into_iter().flatten().next() {
            Some(source) => Err(ContextError::Kernel { kernel, source }),
            None => Ok(result),
        }
    }

    /// A buffer that holds `words`.
    pub(crate) fn buffer_of(&self, label: &'static str, words: &[u32], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let start = Instant::now();
        let contents: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let descriptor = wgpu::util::BufferInitDescriptor { label: Some(label), contents: &contents, usage };
        let buffer = self.device.create_buffer_init(&descriptor);
        self.meter.uploaded(contents.len() as u64, start);
        buffer
    }

    /// The first `count` words of a buffer that can be copied from.
    ///
    /// # Errors
    /// When the device refuses or does not finish in time, or the words cannot be read.
    pub(crate) fn download(&self, buffer: &wgpu::Buffer, count: usize) -> Result<Vec<u32>, ContextError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let size = 4 * count as u64;
        let submitted = self.checked("a read-back", || {
            let host = self.host(size);
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(buffer, 0, &host, 0, size);
            (host, self.queue.submit([encoder.finish()]))
        })?;
        self.read_back(submitted)
    }

    /// A buffer that the host can read.
    pub(crate) fn host(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("host"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Bindings 0, 1, … of group 0 of a pipeline.
    pub(crate) fn bind(&self, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Queues the dispatch and the copy of its output to a buffer that the host can read.
    fn submit(
        &self,
        kernel: &wgpu::ComputePipeline,
        groups: [u32; 2],
        mut buffers: Vec<wgpu::Buffer>,
        output_words: usize,
    ) -> (wgpu::Buffer, wgpu::SubmissionIndex) {
        let size = 4 * output_words as u64;
        let output = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("output"),
            size,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let host = self.host(size);
        buffers.push(output.clone());
        let bindings = self.bind(&kernel.get_bind_group_layout(0), &buffers.iter().collect::<Vec<_>>());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.pass(&mut encoder, |pass| {
            pass.set_pipeline(kernel);
            pass.set_bind_group(0, &bindings, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        });
        encoder.copy_buffer_to_buffer(&output, 0, &host, 0, size);
        let submission = self.queue.submit([encoder.finish()]);
        (host, submission)
    }

    /// Waits for a submission and reads its words.
    pub(crate) fn read_back(
        &self,
        (host, submission): (wgpu::Buffer, wgpu::SubmissionIndex),
    ) -> Result<Vec<u32>, ContextError> {
        let (sender, receiver) = mpsc::channel();
        if self.meter.is_on() {
            // So that what follows is the read-back alone.
            let wait = wgpu::PollType::Wait { submission_index: Some(submission.clone()), timeout: Some(TIMEOUT) };
            self.device.poll(wait).map_err(|source| ContextError::Poll { source })?;
        }
        let start = Instant::now();
        host.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver lives until the end of this function; without it nobody waits for the answer.
            let _ = sender.send(result);
        });
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(TIMEOUT) };
        self.device.poll(wait).map_err(|source| ContextError::Poll { source })?;
        let failed = |error: &dyn std::fmt::Display| ContextError::ReadBack(error.to_string());
        receiver.recv_timeout(TIMEOUT).map_err(|error| failed(&error))?.map_err(|error| failed(&error))?;
        let view = host.get_mapped_range(..).map_err(|error| failed(&error))?;
        let words = view.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        self.meter.read(view.len() as u64, start.elapsed());
        Ok(words)
    }
}

/// For tests: a fresh device on the one adapter that they share. Without an adapter the test prints why it is skipped and ends; where
/// TERRAIN_REQUIRE_GPU is 1 that is a failure.
#[cfg(test)]
pub(crate) fn device() -> Option<Context> {
    static ADAPTER: std::sync::OnceLock<Result<wgpu::Adapter, String>> = std::sync::OnceLock::new();
    let adapter = ADAPTER.get_or_init(|| choose(None).map_err(|error| error.to_string()));
    match adapter {
        Ok(adapter) => Some(Context::on(adapter).expect("the adapter gives a device")),
        Err(error) => {
            assert!(!crate::adapter::required(), "TERRAIN_REQUIRE_GPU=1: {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}
