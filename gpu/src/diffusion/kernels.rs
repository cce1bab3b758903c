//! The kernels, their bindings, and the buffers that they are bound to.

use super::DiffusionError;
use crate::context::{Context, ContextError};
use wgpu::{BufferBindingType, BufferUsages};

macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../../shaders/diffusion/", $name, ".wgsl"))
    };
    ($operator:literal, $name:literal) => {
        concat!(
            include_str!(concat!("../../shaders/diffusion/", $operator, ".wgsl")),
            include_str!(concat!("../../shaders/diffusion/", $name, ".wgsl"))
        )
    };
}

/// Every kernel as the device gets it: name, text, entry point, and what each binding is.
pub const SOURCES: [Source; 16] = [
    Source { name: "finest start", text: shader!("finest", "start"), entry: "start", bindings: "urrrwr" },
    Source { name: "finest relax", text: shader!("finest", "relax"), entry: "relax", bindings: "urrrwr" },
    Source { name: "finest residual", text: shader!("finest", "residual"), entry: "residual", bindings: "urrrwrw" },
    Source { name: "product", text: shader!("finest", "product"), entry: "multiply", bindings: "urrrrw" },
    Source { name: "coarse start", text: shader!("coarse", "start"), entry: "start", bindings: "urr-wr" },
    Source { name: "coarse relax", text: shader!("coarse", "relax"), entry: "relax", bindings: "urr-wr" },
    Source { name: "coarse residual", text: shader!("coarse", "residual"), entry: "residual", bindings: "urr-wrw" },
    Source { name: "restrict", text: shader!("restrict"), entry: "restricted", bindings: "urrrw" },
    Source { name: "prolong", text: shader!("prolong"), entry: "prolong", bindings: "urrwr" },
    Source { name: "coarsest", text: shader!("coarsest"), entry: "coarsest", bindings: "rrw" },
    Source { name: "dot", text: shader!("dot"), entry: "dot_parts", bindings: "rrw" },
    Source { name: "scalars", text: shader!("scalars"), entry: "advance_scalars", bindings: "urww" },
    Source { name: "direction", text: shader!("direction"), entry: "direction", bindings: "rrrw" },
    Source { name: "advance", text: shader!("advance"), entry: "advance", bindings: "urrrww" },
    Source { name: "jacobi", text: shader!("jacobi"), entry: "jacobi", bindings: "urrrw" },
    Source { name: "raise", text: shader!("raise"), entry: "raise", bindings: "urw" },
];

/// A kernel's text and its bindings in their order: `u` uniform, `r` read, `w` written, `-` none.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    /// What it is called in errors.
    pub name: &'static str,
    /// WGSL.
    pub text: &'static str,
    /// Its entry point.
    pub entry: &'static str,
    bindings: &'static str,
}

/// What becomes of a kernel's text, by its name: nothing, but in controls.
pub(super) type Edit<'a> = &'a dyn Fn(&str, &str) -> String;

/// A compiled kernel.
#[derive(Debug)]
pub(super) struct Kernel {
    pub(super) pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    numbers: Vec<u32>,
}

impl Kernel {
    /// Compiles the kernel of that name; `edit` may change its text, for controls.
    ///
    /// # Errors
    /// When there is none or the device refuses it.
    pub(super) fn named(context: &Context, name: &str, edit: Edit<'_>) -> Result<Kernel, DiffusionError> {
        let source = SOURCES.iter().find(|source| source.name == name).ok_or(DiffusionError::NoKernel)?;
        Ok(Kernel::new(context, source, &edit(name, source.text))?)
    }
    /// Compiles `source`, its text being `text`.
    ///
    /// # Errors
    /// When the device refuses it.
    fn new(context: &Context, source: &Source, text: &str) -> Result<Kernel, ContextError> {
        let bound = |kind: char| match kind {
            'u' => Some(BufferBindingType::Uniform),
            'r' => Some(BufferBindingType::Storage { read_only: true }),
            'w' => Some(BufferBindingType::Storage { read_only: false }),
            _ => None,
        };
        let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
            .zip(source.bindings.chars())
            .filter_map(|(binding, kind)| {
                let ty =
                    wgpu::BindingType::Buffer { ty: bound(kind)?, has_dynamic_offset: false, min_binding_size: None };
                let visibility = wgpu::ShaderStages::COMPUTE;
                Some(wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
            })
            .collect();
        context.checked(source.name, || {
            let device = context.device();
            let label = Some(source.name);
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label,
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(source.entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            Kernel { pipeline, layout, numbers: entries.iter().map(|entry| entry.binding).collect() }
        })
    }
    /// Buffers bound in the order of the bindings that there are.
    pub(super) fn bind(&self, context: &Context, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = self
            .numbers
            .iter()
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding: *binding, resource: buffer.as_entire_binding() })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &self.layout, entries: &entries };
        context.device().create_bind_group(&descriptor)
    }
    /// Adds a dispatch to a pass.
    pub(super) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, bound: &wgpu::BindGroup, groups: [u32; 3]) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bound, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
    }
}

/// Workgroups of 32 × 8 that cover so many nodes.
pub(super) fn over(width: usize, height: usize) -> [u32; 3] {
    [width.div_ceil(32).max(1) as u32, height.div_ceil(8).max(1) as u32, 1]
}

/// Workgroups of 256 that stride over so many numbers.
pub(super) fn along(count: usize) -> [u32; 3] {
    [count.div_ceil(256).clamp(1, STRIDES) as u32, 1, 1]
}
/// The most of them: enough to fill a device, few enough that one workgroup adds up what they leave.
const STRIDES: usize = 1024;

/// Whether a binding holds so many words.
///
/// # Errors
/// [`DiffusionError::TooLarge`].
pub(super) fn fits(context: &Context, what: &'static str, words: usize) -> Result<(), DiffusionError> {
    let (bytes, limit) = (4 * words as u64, context.largest_binding());
    if bytes > limit { Err(DiffusionError::TooLarge { what, bytes, limit }) } else { Ok(()) }
}

/// A buffer of `words` zeros that stays on the device, written and read by kernels, the host and copies.
///
/// # Errors
/// [`DiffusionError::TooLarge`]; when the device refuses.
pub(super) fn plane(context: &Context, what: &'static str, words: usize) -> Result<wgpu::Buffer, DiffusionError> {
    fits(context, what, words)?;
    let descriptor = wgpu::BufferDescriptor {
        label: Some(what),
        size: 4 * words.max(1) as u64,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    };
    Ok(context.checked(what, || context.device().create_buffer(&descriptor))?)
}

/// A buffer that holds `words` for kernels to read; at least one word.
///
/// # Errors
/// As [`plane`].
pub(super) fn table(context: &Context, what: &'static str, words: &[u32]) -> Result<wgpu::Buffer, DiffusionError> {
    fits(context, what, words.len())?;
    let words = if words.is_empty() { &[0] } else { words };
    Ok(context.checked(what, || context.buffer_of(what, words, BufferUsages::STORAGE | BufferUsages::COPY_SRC))?)
}

/// Four words, or eight, that kernels read as a uniform.
///
/// # Errors
/// When the device refuses.
pub(super) fn uniform(context: &Context, words: &[u32]) -> Result<wgpu::Buffer, DiffusionError> {
    Ok(context.checked("a uniform", || context.buffer_of("a uniform", words, BufferUsages::UNIFORM))?)
}

/// The bits of numbers.
pub(super) fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}
