//! The vertices of all leaves on the device: one invocation a vertex, a pure function of its integers and the camera, so that
//! leaves which share a vertex get the same bits.

use super::TessellateError;
use super::refine::{ARGUMENTS, Refiner, bytes};
use crate::context::{Context, ContextError};
use crate::tessellate::ground::Ground;
use crate::tessellate::surface::Surface;
use crate::tessellate::triangle::{Triangle, Vertex};
use wgpu::BufferUsages;

/// The kernel. Twin: [`Surface::point`].
pub const DISPLACE: &str = concat!(
    include_str!("../../../shaders/tessellate/noise.wgsl"),
    include_str!("../../../shaders/tessellate/displace.wgsl")
);

/// Vertices of a leaf's lattice.
pub const VERTICES: usize = 15;
/// Words of a vertex: metres from the eye, unit normal.
pub(super) const WORDS: usize = 6;

/// The vertices of a leaf's lattice: rows along its first leg, five, four, three, two and one of them.
pub fn lattice_vertices(leaf: &Triangle) -> [Vertex; VERTICES] {
    let [apex, base, other] = leaf.corners().map(|corner| corner.map(i64::from));
    let mut vertices = [[0; 2]; VERTICES];
    let places = (0..5).flat_map(|row| (0..5 - row).map(move |column| [column, row]));
    for (vertex, [column, row]) in vertices.iter_mut().zip(places) {
        // Within the leaf, so within the domain.
        *vertex = [0, 1].map(|k| {
            let from = apex[k];
            (from + ((base[k] - from) * column + (other[k] - from) * row) / 4) as u32
        });
    }
    vertices
}

/// Displacement over one ground.
pub struct Displacer<'c> {
    context: &'c Context,
    kernel: wgpu::ComputePipeline,
    samples: wgpu::Buffer,
    /// Room for the vertices of so many leaves.
    vertices: Option<(u32, wgpu::Buffer)>,
}

impl<'c> Displacer<'c> {
    /// Compiles the kernel and uploads the samples of `ground`.
    ///
    /// # Errors
    /// When the device refuses, or a binding does not hold the samples.
    pub fn new(context: &'c Context, ground: &Ground) -> Result<Displacer<'c>, TessellateError> {
        Displacer::compile(context, DISPLACE, ground)
    }

    pub(super) fn compile(
        context: &'c Context,
        source: &str,
        ground: &Ground,
    ) -> Result<Displacer<'c>, TessellateError> {
        let words: Vec<u32> = ground
            .samples()
            .flat_map(|(height, [x, y, z])| [height, x, y, z].map(|value| (value as f32).to_bits()))
            .collect();
        bytes(context, "samples of the ground", 4, words.len() as u64)?;
        let upload = || context.upload("samples", &words, BufferUsages::STORAGE);
        let samples = context.checked("samples of the ground", upload)?;
        let kernel = context.kernel("tessellate/displace.wgsl", source, "displace")?;
        Ok(Displacer { context, kernel, samples, vertices: None })
    }

    fn allocate(&self, leaves: u32) -> Result<wgpu::Buffer, TessellateError> {
        let size = bytes(self.context, "vertices", 4 * (WORDS * VERTICES) as u64, leaves.into())?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let buffer = wgpu::BufferDescriptor { label: Some("vertices"), size, usage, mapped_at_creation: false };
        Ok(self.context.checked("vertices", || self.context.device().create_buffer(&buffer))?)
    }

    /// Displaces the leaves that `refiner` found last; the vertices stay on the device.
    ///
    /// # Errors
    /// When a binding does not hold the vertices of as many leaves as the refiner has room for, or the device refuses.
    pub fn displace(&mut self, refiner: &Refiner<'_>, surface: &Surface<'_>) -> Result<&wgpu::Buffer, TessellateError> {
        let room = refiner.capacity().leaves;
        let vertices = match self.vertices.take() {
            Some((held, vertices)) if held == room => vertices,
            _ => self.allocate(room)?,
        };
        let (_, vertices) = self.vertices.insert((room, vertices));
        self.context.checked("tessellate/displace.wgsl", || {
            let [surface, octaves] =
                surface.words().map(|words| self.context.upload("surface", &words, BufferUsages::STORAGE));
            let [leaves, counters, arguments] = refiner.buffers();
            let buffers = [&surface, &self.samples, &octaves, leaves, counters, vertices];
            let bindings = self.context.bind(&self.kernel.get_bind_group_layout(0), &buffers);
            let mut encoder = self.context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.kernel);
            pass.set_bind_group(0, &bindings, &[]);
            pass.dispatch_workgroups_indirect(arguments, ARGUMENTS[1]);
            drop(pass);
            self.context.queue().submit([encoder.finish()]);
        })?;
        Ok(vertices)
    }

    /// Position from the eye and normal of each vertex of the first `leaves` leaves, in the order of [`lattice_vertices`].
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(&self, leaves: u32) -> Result<Vec<[[f32; 3]; 2]>, ContextError> {
        let Some((_, vertices)) = &self.vertices else { return Ok(Vec::new()) };
        let words = self.context.download(vertices, WORDS * VERTICES * leaves as usize)?;
        let point = |words: &[u32; WORDS]| {
            let [a, b, c, d, e, f] = words.map(f32::from_bits);
            [[a, b, c], [d, e, f]]
        };
        Ok(words.as_chunks::<WORDS>().0.iter().map(point).collect())
    }
}
