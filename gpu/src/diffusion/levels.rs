//! One V(2,2) cycle on the device: the processor's hierarchy, uploaded once, and the same steps in the same order as
//! `terrain_diffusion::solver::cycle` with four colours twice.

use super::DiffusionError;
use super::kernels::{Edit, Kernel, along, bits, over, plane, table, uniform};
use crate::context::Context;
use terrain_diffusion::solver::equations::Equations;
use terrain_diffusion::solver::hierarchy::{Hierarchy, SHORTEST};

/// The most nodes that the last level may have, whose inverse is stored: it has many only if the raster is very long.
const COARSEST: usize = 4096;
/// Parities of column and row: the red nodes of a chessboard, then the black ones.
const COLOURS: [[u32; 2]; 4] = [[0, 0], [1, 1], [1, 0], [0, 1]];

/// What relaxes with one operator.
#[derive(Debug)]
struct Smoother {
    start: Kernel,
    relax: Kernel,
    residual: Kernel,
}

/// The compiled kernels.
#[derive(Debug)]
pub(super) struct Kernels {
    finest: Smoother,
    coarse: Smoother,
    pub(super) product: Kernel,
    restrict: Kernel,
    prolong: Kernel,
    coarsest: Kernel,
    pub(super) dot: Kernel,
    pub(super) scalars: Kernel,
    pub(super) direction: Kernel,
    pub(super) advance: Kernel,
}

impl Kernels {
    /// Compiles them; `edit` may change their texts, for controls.
    ///
    /// # Errors
    /// When the device refuses one.
    pub(super) fn new(context: &Context, edit: Edit<'_>) -> Result<Kernels, DiffusionError> {
        let kernel = |name: &str| Kernel::named(context, name, edit);
        Ok(Kernels {
            finest: Smoother {
                start: kernel("finest start")?,
                relax: kernel("finest relax")?,
                residual: kernel("finest residual")?,
            },
            coarse: Smoother {
                start: kernel("coarse start")?,
                relax: kernel("coarse relax")?,
                residual: kernel("coarse residual")?,
            },
            product: kernel("product")?,
            restrict: kernel("restrict")?,
            prolong: kernel("prolong")?,
            coarsest: kernel("coarsest")?,
            dot: kernel("dot")?,
            scalars: kernel("scalars")?,
            direction: kernel("direction")?,
            advance: kernel("advance")?,
        })
    }
}

/// A level above the coarsest, with its steps bound.
#[derive(Debug)]
struct Level {
    size: [usize; 2],
    /// Colours in the order of [`COLOURS`], for each right-hand side.
    relax: Vec<[wgpu::BindGroup; 4]>,
    /// For each right-hand side.
    residual: Vec<wgpu::BindGroup>,
    restrict: wgpu::BindGroup,
    prolong: wgpu::BindGroup,
}

/// A hierarchy on the device.
#[derive(Debug)]
pub(super) struct Levels<'k> {
    kernels: &'k Kernels,
    /// Finest first.
    levels: Vec<Level>,
    coarsest: wgpu::BindGroup,
    coarsest_nodes: usize,
    /// What the finest operator is read from: the first four bindings of a kernel that it stands before.
    pub(super) finest: [wgpu::Buffer; 4],
    /// The right-hand sides of the finest level that a cycle may be asked for.
    pub(super) sides: [wgpu::Buffer; 2],
    /// The result of a cycle.
    pub(super) result: wgpu::Buffer,
    /// Of all buffers.
    pub(super) bytes: u64,
}

/// Whether the last level of such a raster is small enough: to be asked before a hierarchy is built.
///
/// # Errors
/// [`DiffusionError::Narrow`].
pub(super) fn coarsens([width, height]: [usize; 2]) -> Result<(), DiffusionError> {
    let (mut w, mut h) = (width.div_ceil(2), height.div_ceil(2));
    while w.min(h) > SHORTEST {
        (w, h) = (w.div_ceil(2), h.div_ceil(2));
    }
    if w * h > COARSEST { Err(DiffusionError::Narrow { width, height }) } else { Ok(()) }
}

/// The finest operator as its kernels read it: kinds, sides, corners.
fn finest_words(equations: &Equations) -> [Vec<u32>; 3] {
    let [width, height] = equations.size();
    let mut kinds = vec![0; width * height];
    for (k, kind) in kinds.iter_mut().enumerate() {
        *kind = u32::from(equations.is_given(k % width, k / width));
    }
    let others =
        || (0..height).flat_map(|j| equations.others(j).iter().map(move |(i, other)| (j * width + *i as usize, other)));
    let across = others().any(|(_, other)| [0, 2, 6, 8].iter().any(|k| other.weights[*k] != 0.0));
    let (mut sides, mut corners) = (Vec::new(), Vec::new());
    for (number, (node, other)) in others().enumerate() {
        kinds[node] = number as u32 + 2;
        let w = other.weights;
        sides.extend([w[1], w[3], w[5], w[7], w[4], 1.0 / other.own()].map(f32::to_bits));
        if across {
            corners.extend([w[0], w[2], w[6], w[8]].map(f32::to_bits));
        }
    }
    [kinds, sides, corners]
}

impl<'k> Levels<'k> {
    /// Uploads `equations` and the hierarchy below them.
    ///
    /// # Errors
    /// [`DiffusionError::TooLarge`]; when the device refuses.
    pub(super) fn new(
        context: &Context,
        kernels: &'k Kernels,
        equations: &Equations,
        hierarchy: &Hierarchy,
    ) -> Result<Levels<'k>, DiffusionError> {
        let size = equations.size();
        let mut sizes = vec![size];
        sizes.extend(hierarchy.operators().map(|operator| [operator.width, operator.height]));
        let coarsest_nodes = sizes[sizes.len() - 1].iter().product();
        let mut bytes = 0u64;
        let mut store = |what: &'static str, words: &[u32]| {
            bytes += 4 * words.len() as u64;
            table(context, what, words)
        };
        let [kinds, sides, corners] = finest_words(equations);
        let mut operators = vec![[
            store("kinds of nodes", &kinds)?,
            store("weights of nodes", &sides)?,
            store("weights across corners", &corners)?,
        ]];
        for operator in hierarchy.operators().take(sizes.len() - 2) {
            let nothing = table(context, "nothing", &[])?;
            operators.push([
                store("coefficients of a level", &bits(operator.coefficients))?,
                store("diagonals of a level", &bits(operator.inverse))?,
                nothing,
            ]);
        }
        let weights = hierarchy
            .weights()
            .map(|weights| {
                Ok([
                    store("weights of lines", &bits(weights.lines))?,
                    store("weights of middles", &bits(weights.middles))?,
                ])
            })
            .collect::<Result<Vec<_>, DiffusionError>>()?;
        let inverse = store("the coarsest inverse", &bits(&hierarchy.coarsest_inverse()))?;
        let mut vectors = |what: &'static str| {
            let planes = sizes.iter().map(|[width, height]| {
                bytes += 4 * (width * height) as u64;
                plane(context, what, width * height)
            });
            planes.collect::<Result<Vec<wgpu::Buffer>, DiffusionError>>()
        };
        let (x, b, rest) = (vectors("corrections")?, vectors("right-hand sides")?, vectors("what is left")?);
        let other_side = plane(context, "a right-hand side", size[0] * size[1])?;
        bytes += 4 * (size[0] * size[1]) as u64;
        let finest_size = uniform(context, &[size[0] as u32, size[1] as u32, 0, 0])?;

        let mut levels = Vec::new();
        for l in 0..sizes.len() - 1 {
            let ([width, height], [coarse_width, coarse_height]) = (sizes[l], sizes[l + 1]);
            let smoother = if l == 0 { &kernels.finest } else { &kernels.coarse };
            let words = |first: u32, second: u32| [width as u32, height as u32, first, second];
            let uniforms = COLOURS.map(|[first, second]| uniform(context, &words(first, second)));
            let [red, red_too, black, black_too] = uniforms;
            let uniforms = [red?, red_too?, black?, black_too?];
            let count = if l == 0 { 3 } else { 2 };
            let bound = |kernel: &Kernel, uniform: &wgpu::Buffer, rest: &[&wgpu::Buffer]| {
                let operator = operators[l].iter().take(count);
                let buffers: Vec<&wgpu::Buffer> =
                    std::iter::once(uniform).chain(operator).chain(rest.iter().copied()).collect();
                kernel.bind(context, &buffers)
            };
            let right: Vec<&wgpu::Buffer> = if l == 0 { vec![&b[0], &other_side] } else { vec![&b[l]] };
            let level = context.checked("a level", || {
                let steps = |b: &&wgpu::Buffer| {
                    let colours = uniforms.each_ref().map(|uniform| bound(&smoother.relax, uniform, &[&x[l], b]));
                    (colours, bound(&smoother.residual, &uniforms[0], &[&x[l], b, &rest[l]]))
                };
                let (relax, residual) = right.iter().map(steps).unzip();
                let sizes = [width, height, coarse_width, coarse_height].map(|n| n as u32);
                let sizes = context.buffer_of("sizes", &sizes, wgpu::BufferUsages::UNIFORM);
                let [lines, middles] = &weights[l];
                let restrict = kernels.restrict.bind(context, &[&sizes, lines, middles, &rest[l], &b[l + 1]]);
                let prolong = kernels.prolong.bind(context, &[&sizes, lines, middles, &x[l], &x[l + 1]]);
                Level { size: [width, height], relax, residual, restrict, prolong }
            })?;
            levels.push(level);
        }
        let last = sizes.len() - 1;
        let coarsest = context
            .checked("the coarsest level", || kernels.coarsest.bind(context, &[&inverse, &b[last], &x[last]]))?;
        let [kinds, sides, corners] = operators.swap_remove(0);
        Ok(Levels {
            kernels,
            levels,
            coarsest,
            coarsest_nodes,
            finest: [finest_size, kinds, sides, corners],
            sides: [b[0].clone(), other_side],
            result: x[0].clone(),
            bytes,
        })
    }

    fn smoother(&self, l: usize) -> &Smoother {
        if l == 0 { &self.kernels.finest } else { &self.kernels.coarse }
    }
    fn colour(&self, pass: &mut wgpu::ComputePass<'_>, l: usize, side: usize, colour: usize) {
        let Level { size: [width, height], relax, .. } = &self.levels[l];
        let groups = over(width.div_ceil(2), height.div_ceil(2));
        self.smoother(l).relax.dispatch(pass, &relax[side][colour], groups);
    }
    /// Adds a cycle from 0 for right-hand side `side` to a pass.
    pub(super) fn cycle(&self, pass: &mut wgpu::ComputePass<'_>, side: usize) {
        let side_of = |l: usize| if l == 0 { side } else { 0 };
        for (l, level) in self.levels.iter().enumerate() {
            let ([width, height], side) = (level.size, side_of(l));
            self.smoother(l).start.dispatch(pass, &level.relax[side][0], over(width, height));
            (1..4).chain(0..4).for_each(|colour| self.colour(pass, l, side, colour));
            self.smoother(l).residual.dispatch(pass, &level.residual[side], over(width, height));
            let coarse = over(width.div_ceil(2), height.div_ceil(2));
            self.kernels.restrict.dispatch(pass, &level.restrict, coarse);
        }
        let rows = [self.coarsest_nodes.div_ceil(64) as u32, 1, 1];
        self.kernels.coarsest.dispatch(pass, &self.coarsest, rows);
        for (l, level) in self.levels.iter().enumerate().rev() {
            let [width, height] = level.size;
            self.kernels.prolong.dispatch(pass, &level.prolong, over(width, height));
            (0..4).rev().chain((0..4).rev()).for_each(|colour| self.colour(pass, l, side_of(l), colour));
        }
    }
    /// Workgroups that stride over the finest nodes.
    pub(super) fn strides(&self) -> [u32; 3] {
        let [width, height] = self.levels[0].size;
        along(width * height)
    }
    /// Workgroups over the finest nodes.
    pub(super) fn nodes(&self) -> [u32; 3] {
        let [width, height] = self.levels[0].size;
        over(width, height)
    }
}
