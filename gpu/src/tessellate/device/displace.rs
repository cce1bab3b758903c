//! The vertices of all leaves on the device: one invocation a vertex, a pure function of its integers and the camera, so that
//! leaves which share a vertex get the same bits.

use super::TessellateError;
use super::refine::{ARGUMENTS, Refiner, bytes};
use crate::context::{Context, ContextError};
use crate::tessellate::displace::{Rule, Space};
use crate::tessellate::ground::{Ground, Sample};
use crate::tessellate::surface::Surface;
use crate::tessellate::triangle::{Triangle, Vertex};
use terrain_model::noise::{GRADIENT2_RANGE, GRADIENT3_RANGE, Octave, mix};
use wgpu::BufferUsages;

/// The kernel. Twin: [`Surface::point`].
pub const DISPLACE: &str = concat!(
    include_str!("../../../shaders/hash.wgsl"),
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

/// The surface and its octaves as the kernel reads them.
fn words(surface: &Surface<'_>) -> [Vec<u32>; 2] {
    let Surface { ground, detail, origin, eye, size } = surface;
    let bits = |x: f64| (x as f32).to_bits();
    let [low, high] = detail.elevation;
    let range: f64 = detail.octaves().iter().map(|octave| octave.amplitude).sum();
    let plan = detail.space() == Space::Plan;
    let offset = match detail.rule {
        Rule::Sum => None,
        Rule::Multifractal { offset } => Some(offset),
    };
    // Without concavity the share in hollows is all there is.
    let [hollow, sharp] = detail.concavity.unwrap_or([1.0, 1.0]);
    let mut words = origin.to_vec();
    words.extend(ground.unit().map(bits));
    words.extend(eye.map(bits));
    words.push(ground.cells() as u32);
    words.extend(ground.spacing().map(bits));
    words.extend([ground.alpha(), detail.amplitude()].map(bits));
    words.extend(detail.floor.map(bits));
    words.extend(detail.floor.map(|floor| bits(1.0 - floor)));
    words.extend([low, (high - low).max(f64::from(f32::MIN_POSITIVE)), *size].map(bits));
    words.push(detail.octaves().len() as u32);
    words.extend(ground.inside().map(|cells| cells as u32));
    words.extend([if plan { GRADIENT2_RANGE } else { GRADIENT3_RANGE }, range].map(bits));
    words.extend([u32::from(plan), u32::from(offset.is_some())]);
    let offset = offset.unwrap_or(0.0);
    let [neutral, reach] = detail.product(offset);
    words.extend([offset, neutral, reach, hollow, 1.0 - hollow].map(bits));
    words.push(bits((2.0 * sharp).max(f64::from(f32::MIN_POSITIVE))));
    let octave = |octave: &Octave<3>| {
        let Octave { lattice, offset: [x, y, z], frequency, amplitude } = *octave;
        let [i, j, k] = key(lattice.seed, lattice.base);
        let [x, y, z, frequency, amplitude] = [x, y, z, frequency, amplitude].map(bits);
        [i, j, k, frequency, x, y, z, amplitude]
    };
    let octave_of_plan = |octave: &Octave<2>| {
        let Octave { lattice, offset: [x, y], frequency, amplitude } = *octave;
        let [i, j] = key(lattice.seed, lattice.base);
        let [x, y, frequency, amplitude] = [x, y, frequency, amplitude].map(bits);
        [i, j, 0, frequency, x, y, 0, amplitude]
    };
    let octaves = if plan {
        detail.octaves_of_plan().iter().flat_map(octave_of_plan).collect()
    } else {
        detail.octaves().iter().flat_map(octave).collect()
    };
    [words, octaves]
}

/// What the kernel adds to a lattice point before it hashes it.
fn key<const N: usize>(seed: u32, base: [i32; N]) -> [u32; N] {
    std::array::from_fn(|axis| mix(seed, axis as u32 + 1).wrapping_add(base[axis] as u32))
}

/// Bytes of the parameters that the kernel reads of `surface`, and of those for its octaves: all that is stored of its detail.
pub fn parameter_bytes(surface: &Surface<'_>) -> [usize; 2] {
    words(surface).map(|words| size_of::<u32>() * words.len())
}

/// Displacement over one ground.
pub struct Displacer<'c> {
    context: &'c Context,
    kernel: wgpu::ComputePipeline,
    samples: wgpu::Buffer,
    curvatures: wgpu::Buffer,
    /// Room for the vertices of so many leaves.
    vertices: Option<(u32, wgpu::Buffer)>,
}

impl<'c> Displacer<'c> {
    /// Compiles the kernel and uploads the samples of `ground`.
    ///
    /// # Errors
    /// When the device refuses, a binding does not hold the samples, or the ground is in pages.
    pub fn new(context: &'c Context, ground: &Ground) -> Result<Displacer<'c>, TessellateError> {
        Displacer::compile(context, DISPLACE, ground)
    }

    pub(super) fn compile(
        context: &'c Context,
        source: &str,
        ground: &Ground,
    ) -> Result<Displacer<'c>, TessellateError> {
        let samples = ground.samples().ok_or(TessellateError::Paged)?;
        let bits = |x: f64| (x as f32).to_bits();
        let of = |s: &Sample| [bits(s.height), bits(s.normal[0]), bits(s.normal[1]), bits(s.normal[2])];
        let words: Vec<u32> = samples.iter().flat_map(of).collect();
        bytes(context, "samples of the ground", 4, words.len() as u64)?;
        let bends: Vec<u32> = samples.iter().map(|s| bits(s.curvature)).collect();
        let upload = || {
            let samples = context.buffer_of("samples", &words, BufferUsages::STORAGE);
            (samples, context.buffer_of("curvatures", &bends, BufferUsages::STORAGE))
        };
        let (samples, curvatures) = context.checked("samples of the ground", upload)?;
        let kernel = context.kernel("tessellate/displace.wgsl", source, "displace")?;
        Ok(Displacer { context, kernel, samples, curvatures, vertices: None })
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
    /// When a binding does not hold the vertices of as many leaves as the refiner has room for; when the device refuses.
    pub fn displace(&mut self, refiner: &Refiner<'_>, surface: &Surface<'_>) -> Result<&wgpu::Buffer, TessellateError> {
        let words = words(surface);
        let room = refiner.capacity().leaves;
        let vertices = match self.vertices.take() {
            Some((held, vertices)) if held == room => vertices,
            _ => self.allocate(room)?,
        };
        let (_, vertices) = self.vertices.insert((room, vertices));
        self.context.checked("tessellate/displace.wgsl", || {
            let [surface, octaves] =
                words.map(|words| self.context.buffer_of("surface", &words, BufferUsages::STORAGE));
            let [leaves, counters, arguments] = refiner.buffers();
            let buffers = [&surface, &self.samples, &octaves, leaves, counters, vertices, &self.curvatures];
            let bindings = self.context.bind(&self.kernel.get_bind_group_layout(0), &buffers);
            let mut encoder = self.context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.context.pass(&mut encoder, |pass| {
                pass.set_pipeline(&self.kernel);
                pass.set_bind_group(0, &bindings, &[]);
                pass.dispatch_workgroups_indirect(arguments, ARGUMENTS[1]);
            });
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
