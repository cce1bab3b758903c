//! The paper's own schedule (Hnaidi 2010 §5.2) on the device: from the coarsest raster to the finest, a few weighted Jacobi iterations on
//! each. Twin: `terrain_diffusion::solver::cascade`. Rasters are drawn by the processor; fields come back once, from the finest.

use super::DiffusionError;
use super::kernels::{Edit, Kernel, bits, over, plane, table, uniform};
use crate::context::Context;
use std::time::Instant;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::Fields;
use terrain_diffusion::raster::{Domain, Node, rasterise};
use terrain_diffusion::solver::SolveError;
use terrain_diffusion::solver::cascade::{
    ITERATIONS, Level, Spent, domains, given_elevation, given_gradient, given_noise, held,
};
use terrain_diffusion::solver::guided::Update;

/// Bits of a node: its elevation is given, its noise, its slope; its elevation follows a slope. Layout: jacobi.wgsl.
const ELEVATION: u32 = 1;
const NOISE: u32 = 2;
const SLOPE: u32 = 4;
const FOLLOWED: u32 = 8;
/// Bits of the flags of jacobi.wgsl.
const FIRST: u32 = 1;
const READ: u32 = 2;
const PRINTED: u32 = 4;

/// What is shown the nodes, the domain and the fields of each raster, coarsest first.
pub(super) type Watch<'a> = &'a mut dyn FnMut(&[Node], Domain, &Level);

/// The compiled kernels.
#[derive(Debug)]
pub(super) struct Kernels {
    jacobi: Kernel,
    raise: Kernel,
}

impl Kernels {
    /// Compiles them; `edit` may change their texts, for controls.
    ///
    /// # Errors
    /// When the device refuses one.
    pub(super) fn new(context: &Context, edit: Edit<'_>) -> Result<Kernels, DiffusionError> {
        Ok(Kernels { jacobi: Kernel::named(context, "jacobi", edit)?, raise: Kernel::named(context, "raise", edit)? })
    }
}

fn kind(node: &Node) -> u32 {
    let bit = |holds: bool, bit: u32| if holds { bit } else { 0 };
    bit(node.elevations > 0, ELEVATION)
        | bit(node.noises > 0, NOISE)
        | bit(node.guides == 1, SLOPE)
        | bit(node.guides > 0 && node.elevations == 0, FOLLOWED)
}

/// K fields one after the other.
fn split<const K: usize>(count: usize, value: impl Fn(usize) -> [f64; K]) -> Vec<f32> {
    let mut fields = vec![0.0; K * count];
    for node in 0..count {
        value(node).into_iter().enumerate().for_each(|(k, value)| fields[k * count + node] = value as f32);
    }
    fields
}

/// What one raster is to a field: its nodes' words, and how it is iterated.
struct Stage<'a> {
    run: &'a Run<'a>,
    domain: Domain,
    kinds: &'a wgpu::Buffer,
    /// Rise and direction at every node, once they are known.
    slopes: &'a wgpu::Buffer,
    count: usize,
    /// The raster below.
    below: Option<Domain>,
}

/// Fields that are given at the same nodes.
#[derive(Clone, Copy)]
struct Group {
    what: &'static str,
    fields: usize,
    given: u32,
    flags: u32,
}

const GRADIENT: Group = Group { what: "gradients", fields: 3, given: SLOPE, flags: 0 };
const AMPLITUDES: Group = Group { what: "noises", fields: 2, given: NOISE, flags: 0 };

struct Run<'a> {
    context: &'a Context,
    kernels: &'a Kernels,
}

impl Stage<'_> {
    /// The fields after the iterations of this raster: `given` where they are given, from the raster below or from `first`.
    fn iterate(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        group: Group,
        given: &[f32],
        first: impl Fn() -> Vec<f32>,
        below: Option<&wgpu::Buffer>,
    ) -> Result<wgpu::Buffer, DiffusionError> {
        let Run { context, kernels } = self.run;
        let Domain { width, height, spacing, .. } = self.domain;
        let groups = [over(width, height)[0], over(width, height)[1], group.fields as u32];
        let words = |flags: u32| {
            let [width, height] = [width, height].map(|n| n as u32);
            [width, height, group.given, group.flags | flags, (spacing as f32).to_bits(), 0, 0, 0]
        };
        let (begin, go_on) = (uniform(context, &words(FIRST))?, uniform(context, &words(0))?);
        let after = table(context, group.what, &bits(given))?;
        let before = match (below, self.below) {
            (Some(below), Some(from)) => {
                let before = plane(context, group.what, given.len())?;
                let ratio = ((spacing / from.spacing) as f32).to_bits();
                let [from_width, from_height, width, height] =
                    [from.width, from.height, width, height].map(|n| n as u32);
                let sizes = uniform(context, &[from_width, from_height, width, height, ratio, 0, 0, 0])?;
                let bound = context.checked("raise", || kernels.raise.bind(context, &[&sizes, below, &before]))?;
                context.pass(encoder, |pass| kernels.raise.dispatch(pass, &bound, groups));
                before
            }
            _ => table(context, group.what, &bits(&first()))?,
        };
        let bind = |uniform, from, to| kernels.jacobi.bind(context, &[uniform, self.kinds, self.slopes, from, to]);
        let [start, there, back] = context.checked("jacobi", || {
            [bind(&begin, &before, &after), bind(&go_on, &before, &after), bind(&go_on, &after, &before)]
        })?;
        context.pass(encoder, |pass| {
            for k in 0..self.count {
                let bound = if k == 0 { &start } else { [&there, &back][k % 2] };
                kernels.jacobi.dispatch(pass, bound, groups);
            }
        });
        Ok(if self.count.is_multiple_of(2) { before } else { after })
    }
}

/// Runs the cascade on the device; `watch` is shown the fields of each raster, if there is one.
///
/// # Errors
/// [`SolveError::Unheld`] when no curve gives an elevation on the finest raster; [`SolveError::Device`].
pub(super) fn run(
    context: &Context,
    kernels: &Kernels,
    curves: &[Curve],
    domain: Domain,
    update: Update,
    mut watch: Option<Watch<'_>>,
) -> Result<Fields, SolveError> {
    let device = |error: DiffusionError| SolveError::Device(Box::new(error));
    let start = Instant::now();
    let domains = domains(domain);
    let run = Run { context, kernels };
    let mut below: Option<(Domain, [wgpu::Buffer; 3])> = None;
    let (mut nodes, mut iterations) = (Vec::new(), 0);
    for (i, domain) in domains.iter().enumerate() {
        nodes = rasterise(curves, domain).dense();
        let count = ITERATIONS * (domains.len() - i);
        let fields = stage(&run, &nodes, *domain, count, update, below.as_ref()).map_err(device)?;
        iterations += count;
        if let Some(watch) = &mut watch {
            watch(&nodes, *domain, &read(context, &fields, nodes.len()).map_err(device)?);
        }
        below = Some((*domain, fields));
    }
    let Some((_, fields)) = below.filter(|_| held(&nodes)) else { return Err(SolveError::Unheld) };
    let n = nodes.len();
    let level = read(context, &fields, n).map_err(device)?;
    let seconds = start.elapsed().as_secs_f64();
    // Two of every field, kinds, and the nodes on the host.
    let bytes = n * (2 * 6 * 4 + 4 + size_of::<Node>());
    Ok(level.fields(&nodes, domain, update, Spent { iterations, seconds, bytes }))
}

/// Reads gradient, noise and elevation of `n` nodes back.
fn read(
    context: &Context,
    [gradient, noise, elevation]: &[wgpu::Buffer; 3],
    n: usize,
) -> Result<Level, DiffusionError> {
    let field = |buffer: &wgpu::Buffer, fields: usize| -> Result<Vec<f64>, DiffusionError> {
        let words = context.download(buffer, fields * n)?;
        Ok(words.into_iter().map(|word| f64::from(f32::from_bits(word))).collect())
    };
    let (gradient, noise) = (field(gradient, 3)?, field(noise, 2)?);
    Ok(Level {
        elevation: field(elevation, 1)?,
        noise: (0..n).map(|k| [noise[k], noise[n + k]]).collect(),
        gradient: (0..n).map(|k| [gradient[k], gradient[n + k], gradient[2 * n + k]]).collect(),
    })
}

/// Gradient, noise and elevation of one raster.
fn stage(
    run: &Run<'_>,
    nodes: &[Node],
    domain: Domain,
    count: usize,
    update: Update,
    below: Option<&(Domain, [wgpu::Buffer; 3])>,
) -> Result<[wgpu::Buffer; 3], DiffusionError> {
    let context = run.context;
    let n = nodes.len();
    let kinds = table(context, "kinds of nodes", &nodes.iter().map(kind).collect::<Vec<u32>>())?;
    let nothing = table(context, "nothing", &[])?;
    let first = Level::first(nodes);
    let fields_below = |k: usize| below.map(|(_, fields)| &fields[k]);
    let mut encoder = context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let stage = |slopes| Stage { run, domain, kinds: &kinds, slopes, count, below: below.map(|(domain, _)| *domain) };

    let given = split(n, |k| given_gradient(&nodes[k]).unwrap_or_default());
    let begin = || split(n, |k| first.gradient[k]);
    let gradient = stage(&nothing).iterate(&mut encoder, GRADIENT, &given, begin, fields_below(0))?;
    let given = split(n, |k| given_noise(&nodes[k]).unwrap_or_default());
    let begin = || split(n, |k| first.noise[k]);
    let noise = stage(&nothing).iterate(&mut encoder, AMPLITUDES, &given, begin, fields_below(1))?;
    let given = split(n, |k| given_elevation(&nodes[k]).unwrap_or_default());
    let begin = || split(n, |k| [first.elevation[k]]);
    let flags = READ | if update == Update::Printed { PRINTED } else { 0 };
    let group = Group { what: "elevations", fields: 1, given: ELEVATION, flags };
    let elevation = stage(&gradient).iterate(&mut encoder, group, &given, begin, fields_below(2))?;
    context.checked("a raster of the cascade", || context.queue().submit([encoder.finish()]))?;
    Ok([gradient, noise, elevation])
}
