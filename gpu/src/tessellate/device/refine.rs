//! Level after level on the device: lists of triangles of one level, a kernel that splits them, and one thread between two
//! levels that says how many there are. Lists are bounded; what does not fit is an error with what was needed.

use super::TessellateError;
use crate::context::{Context, ContextError};
use crate::tessellate::decision::{Decision, Pyramid};
use crate::tessellate::triangle::{FINEST, LATTICE, Triangle};
use wgpu::BufferUsages;

/// The kernel that splits. Twin: [`Decision`].
pub const REFINE: &str = include_str!("../../../shaders/tessellate/refine.wgsl");
/// The kernel between two levels.
pub const ADVANCE: &str = include_str!("../../../shaders/tessellate/advance.wgsl");

/// Bits of a coordinate in a word; the level is above them.
const COORDINATE_BITS: u32 = 25;
/// Bytes from the start of the arguments to those of a level, of a kernel over leaves, of a draw.
pub(super) const ARGUMENTS: [u64; 3] = [0, 16, 28];

/// How many triangles fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Of one level: even.
    pub list: u32,
    /// Leaves.
    pub leaves: u32,
}

struct Lists {
    capacity: Capacity,
    levels: [wgpu::Buffer; 2],
    leaves: wgpu::Buffer,
}

/// Refinement of one ground.
pub struct Refiner<'c> {
    context: &'c Context,
    refine: wgpu::ComputePipeline,
    advance: wgpu::ComputePipeline,
    pyramid: wgpu::Buffer,
    counters: wgpu::Buffer,
    arguments: wgpu::Buffer,
    lists: Lists,
}

/// What a list of `capacity` triangles takes, if a binding holds it.
pub(super) fn bytes(context: &Context, what: &'static str, each: u64, count: u64) -> Result<u64, TessellateError> {
    let (bytes, limit) = (each * count, context.largest_binding());
    if bytes > limit { Err(TessellateError::TooLarge { what, bytes, limit }) } else { Ok(bytes) }
}

impl Lists {
    fn new(context: &Context, capacity: Capacity) -> Result<Lists, TessellateError> {
        let list = bytes(context, "triangles of a level", 16, capacity.list.into())?;
        let leaves = bytes(context, "leaves", 16, capacity.leaves.into())?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let buffer = |label, size| {
            let label = Some(label);
            context.device().create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
        };
        let made = context.checked("lists of triangles", || {
            (["even levels", "odd levels"].map(|label| buffer(label, list)), buffer("leaves", leaves))
        });
        let (levels, leaves) = made?;
        Ok(Lists { capacity, levels, leaves })
    }
}

impl<'c> Refiner<'c> {
    /// Compiles the kernels and uploads `pyramid`.
    ///
    /// # Errors
    /// When the device refuses, or the pyramid or lists of `capacity` do not fit a binding.
    pub fn new(context: &'c Context, pyramid: &Pyramid, capacity: Capacity) -> Result<Refiner<'c>, TessellateError> {
        Refiner::compile(context, [REFINE, ADVANCE], pyramid, capacity)
    }

    pub(super) fn compile(
        context: &'c Context,
        [refine, advance]: [&str; 2],
        pyramid: &Pyramid,
        capacity: Capacity,
    ) -> Result<Refiner<'c>, TessellateError> {
        let words = pyramid.words();
        bytes(context, "enclosures of the ground", 4, words.len() as u64)?;
        // One pair of roots must fit, and pairs stay whole.
        let capacity = Capacity { list: capacity.list.max(2) & !1, leaves: capacity.leaves.max(1) };
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffers = || {
            let pyramid = context.buffer_of("pyramid", &words, BufferUsages::STORAGE);
            let counters = context.buffer_of("counters", &[0; 4], storage);
            let arguments = context.buffer_of("arguments", &[0; 12], storage | BufferUsages::INDIRECT);
            (pyramid, counters, arguments)
        };
        let (pyramid, counters, arguments) = context.checked("enclosures of the ground", buffers)?;
        Ok(Refiner {
            context,
            refine: context.kernel("tessellate/refine.wgsl", refine, "refine")?,
            advance: context.kernel("tessellate/advance.wgsl", advance, "advance")?,
            pyramid,
            counters,
            arguments,
            lists: Lists::new(context, capacity)?,
        })
    }

    /// How many triangles fit now.
    pub fn capacity(&self) -> Capacity {
        self.lists.capacity
    }

    /// Leaves, counters and indirect arguments of what was refined last.
    pub(super) fn buffers(&self) -> [&wgpu::Buffer; 3] {
        [&self.lists.leaves, &self.counters, &self.arguments]
    }

    /// Refines once; the leaves stay on the device. Returns their number.
    ///
    /// # Errors
    /// [`TessellateError::Overflow`] when a list is too short: the leaves then do not cover the ground.
    pub fn refine(&self, decision: &Decision<'_>, cull: bool) -> Result<u32, TessellateError> {
        self.context.checked("tessellate/refine.wgsl", || self.submit(decision, cull))?;
        let counters = self.context.download(&self.counters, 4)?;
        let Capacity { list, leaves } = self.lists.capacity;
        for (what, needed, capacity) in [("triangles of a level", counters[3], list), ("leaves", counters[2], leaves)] {
            if needed > capacity {
                return Err(TessellateError::Overflow { what, needed, capacity });
            }
        }
        Ok(counters[2])
    }

    /// The same, with longer lists until they suffice.
    ///
    /// # Errors
    /// When lists that suffice do not fit a binding, or the device fails.
    pub fn refine_growing(&mut self, decision: &Decision<'_>, cull: bool) -> Result<u32, TessellateError> {
        loop {
            let (what, needed, capacity) = match self.refine(decision, cull) {
                Err(TessellateError::Overflow { what, needed, capacity }) => (what, needed, capacity),
                other => return other,
            };
            let longer = needed.max(capacity.saturating_mul(2)).saturating_add(1) & !1;
            let Capacity { list, leaves } = self.lists.capacity;
            let grown =
                if what == "leaves" { Capacity { list, leaves: longer } } else { Capacity { list: longer, leaves } };
            self.lists = Lists::new(self.context, grown)?;
        }
    }

    fn submit(&self, decision: &Decision<'_>, cull: bool) {
        let Lists { capacity, levels: [even, odd], leaves } = &self.lists;
        let words = decision.words(cull, capacity.list, capacity.leaves);
        let decision = self.context.buffer_of("decision", &words, BufferUsages::STORAGE);
        let drawn = 3 << LATTICE;
        let capacities =
            self.context.buffer_of("capacities", &[capacity.list, capacity.leaves, drawn], BufferUsages::STORAGE);
        let roots: Vec<u8> = Triangle::ROOTS.iter().flat_map(pack).flat_map(u32::to_le_bytes).collect();
        let queue = self.context.queue();
        queue.write_buffer(even, 0, &roots);
        queue.write_buffer(&self.counters, 0, &[0, 2, 0, 0].map(u32::to_le_bytes).concat());
        let layout = self.refine.get_bind_group_layout(0);
        let bind =
            |list, next| self.context.bind(&layout, &[&decision, &self.pyramid, list, next, leaves, &self.counters]);
        let bindings = [bind(even, odd), bind(odd, even)];
        let between = [&capacities, &self.counters, &self.arguments];
        let between = self.context.bind(&self.advance.get_bind_group_layout(0), &between);
        let mut encoder = self.context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.context.pass(&mut encoder, |pass| {
            for level in 0..=FINEST as usize + 1 {
                pass.set_pipeline(&self.advance);
                pass.set_bind_group(0, &between, &[]);
                pass.dispatch_workgroups(1, 1, 1);
                if level <= FINEST as usize {
                    pass.set_pipeline(&self.refine);
                    pass.set_bind_group(0, &bindings[level % 2], &[]);
                    pass.dispatch_workgroups_indirect(&self.arguments, ARGUMENTS[0]);
                }
            }
        });
        queue.submit([encoder.finish()]);
    }

    /// The first `count` leaves, in no order.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn leaves(&self, count: u32) -> Result<Vec<Triangle>, ContextError> {
        let words = self.context.download(&self.lists.leaves, 4 * count as usize)?;
        Ok(words.as_chunks::<4>().0.iter().map(|words| unpack(*words)).collect())
    }
}

fn pack(triangle: &Triangle) -> [u32; 4] {
    let ([x, y], [u, v]) = (triangle.apex, triangle.base);
    [x | (triangle.level << COORDINATE_BITS), y, u, v]
}

fn unpack([x, y, u, v]: [u32; 4]) -> Triangle {
    let mask = (1 << COORDINATE_BITS) - 1;
    Triangle { level: x >> COORDINATE_BITS, apex: [x & mask, y], base: [u, v] }
}
