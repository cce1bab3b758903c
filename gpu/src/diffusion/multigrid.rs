//! Fields solved on the device: BiCGStab in `f32` around the cycle, all of it without a word to the host, inside a refinement in `f64`
//! whose residual the processor computes. A round costs one upload and one read-back of a field, and two or three rounds do: what one
//! gained says how long the next must be.

use super::DiffusionError;
use super::kernels::{bits, plane, uniform};
use super::levels::{Kernels, Levels, coarsens};
use crate::context::Context;
use terrain_diffusion::plane::Plane;
use terrain_diffusion::solver::SolveError;
use terrain_diffusion::solver::engine::{Engine, Kind};
use terrain_diffusion::solver::equations::Equations;
use terrain_diffusion::solver::hierarchy::Hierarchy;
use terrain_diffusion::solver::krylov::{Progress, Stop};

/// Iterations of the first round.
const FIRST: usize = 4;
/// The most iterations of a round.
const LONGEST: usize = 32;
/// What a round is asked for at the most: less is lost in `f32`.
const GAIN: f64 = 1e-6;
/// A round, unless it was a short one, that leaves more than this of a residual is the last: rounding, or a cycle that does not fit, is
/// in the way.
const STALLED: f64 = 0.5;

/// The engine.
#[derive(Debug)]
pub(super) struct Multigrid<'c> {
    pub(super) context: &'c Context,
    pub(super) kernels: &'c Kernels,
}

impl Engine for Multigrid<'_> {
    /// One method serves both kinds: BiCGStab asks for no symmetry.
    fn solve<const K: usize>(
        &mut self,
        _: Kind,
        equations: &Equations,
        values: &mut Plane<f64, K>,
        stop: Stop,
    ) -> Result<Progress<K>, SolveError> {
        let device = |error: DiffusionError| SolveError::Device(Box::new(error));
        coarsens(equations.size()).map_err(device)?;
        let hierarchy = Hierarchy::new(equations)?;
        refine(self, equations, &hierarchy, values, stop).map_err(device)
    }
}

/// x ← x + e until the residual of x in `f64` is small enough, A·e = residual solved in `f32`.
fn refine<const K: usize>(
    engine: &Multigrid<'_>,
    equations: &Equations,
    hierarchy: &Hierarchy,
    values: &mut Plane<f64, K>,
    stop: Stop,
) -> Result<Progress<K>, DiffusionError> {
    let solver = Solver::new(engine.context, engine.kernels, equations, hierarchy)?;
    let scale = equations.known(values).map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
    let mut rest = Plane::<f32, K>::new(values.width(), values.height());
    let mut norms = equations.residual(values, &mut rest).map(f64::sqrt);
    let relative = |norms: [f64; K]| std::array::from_fn(|k| norms[k] * scale[k]);
    let mut residuals: Vec<[f64; K]> = vec![relative(norms)];
    let mut round = FIRST;
    // What is no number has not arrived.
    let arrived = |residual: f64| residual <= stop.relative_residual;
    loop {
        let last = residuals[residuals.len() - 1];
        let left = (stop.iterations + 1).saturating_sub(residuals.len());
        if last.into_iter().all(arrived) || left == 0 {
            break;
        }
        let count = round.min(left);
        let mut rows = vec![last; count];
        let mut whole = true;
        for k in (0..K).filter(|k| !arrived(last[*k])) {
            let scaled: Vec<f32> = rest.field(k).into_iter().map(|r| (f64::from(r) / norms[k]) as f32).collect();
            let (correction, squares) = solver.correct(&scaled, count)?;
            whole &= correction.iter().all(|e| e.is_finite());
            for (row, square) in rows.iter_mut().zip(&squares[1..]) {
                row[k] = last[k] * f64::from(*square).sqrt();
            }
            if whole {
                let width = values.width();
                values.update(|j, fields, _| {
                    for (x, e) in fields[k][1..].iter_mut().zip(&correction[j * width..][..width]) {
                        *x += f64::from(*e) * norms[k];
                    }
                });
            }
        }
        let before = norms;
        norms = equations.residual(values, &mut rest).map(f64::sqrt);
        rows[count - 1] = relative(norms);
        residuals.extend(rows);
        let gains = (0..K).filter(|k| !arrived(last[*k])).map(|k| norms[k] / before[k]);
        if !whole || count >= FIRST && gains.clone().all(|gain| gain > STALLED) {
            break;
        }
        let last = residuals[residuals.len() - 1];
        let wanted =
            last.into_iter().fold(1.0, |least: f64, residual| least.min(0.5 * stop.relative_residual / residual));
        round = iterations(gains.fold(0.0, f64::max), count, wanted);
    }
    let converged = residuals[residuals.len() - 1].into_iter().all(arrived);
    Ok(Progress { residuals, converged, bytes: equations.bytes() + solver.bytes as usize })
}

/// Iterations that leave `wanted` of a residual, if `count` of them left `gain`, the same share each.
fn iterations(gain: f64, count: usize, wanted: f64) -> usize {
    // The root of `gain`, by halving: a few digits do.
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..20 {
        let middle: f64 = 0.5 * (low + high);
        let power = (0..count).fold(1.0, |power, _| power * middle);
        if power < gain { low = middle } else { high = middle }
    }
    let (mut left, mut done) = (1.0, 0);
    while done < 1 || left > wanted.max(GAIN) && done < LONGEST {
        left *= high;
        done += 1;
    }
    done
}

/// BiCGStab for one operator, preconditioned from the right by the cycle.
pub(super) struct Solver<'k> {
    context: &'k Context,
    kernels: &'k Kernels,
    pub(super) levels: Levels<'k>,
    r: wgpu::Buffer,
    shadow: wgpu::Buffer,
    e: wgpu::Buffer,
    scalars: wgpu::Buffer,
    history: wgpu::Buffer,
    steps: Steps,
    nodes: usize,
    bytes: u64,
}

/// The steps of an iteration, bound.
struct Steps {
    /// The parts of shadow·r and r·r; of shadow·v; of r·t and t·t.
    dots: [wgpu::BindGroup; 3],
    /// What the scalars become of them.
    scalars: [wgpu::BindGroup; 3],
    direction: wgpu::BindGroup,
    /// v = A·z, t = A·z.
    products: [wgpu::BindGroup; 2],
    /// By α along v, by ω along t.
    advances: [wgpu::BindGroup; 2],
}

impl<'k> Solver<'k> {
    /// Uploads `equations` and the hierarchy below them.
    ///
    /// # Errors
    /// As [`Levels::new`].
    pub(super) fn new(
        context: &'k Context,
        kernels: &'k Kernels,
        equations: &Equations,
        hierarchy: &Hierarchy,
    ) -> Result<Solver<'k>, DiffusionError> {
        let levels = Levels::new(context, kernels, equations, hierarchy)?;
        let nodes = equations.size().into_iter().product();
        let vector = |what: &'static str| plane(context, what, nodes);
        let (shadow, e) = (vector("a shadow residual")?, vector("a correction")?);
        let (v, t) = (vector("a product")?, vector("a product")?);
        let parts = plane(context, "parts of sums", 2 * levels.strides()[0] as usize)?;
        let scalars = plane(context, "scalars", 5)?;
        let history = plane(context, "squares of residuals", LONGEST + 1)?;
        let [first, second, third] = [0, 1, 2].map(|step| uniform(context, &[step, 0, 0, 0]));
        let numbers = [first?, second?, third?];
        // A cycle is asked to correct p and then s, which BiCGStab stores where r was.
        let [p, s] = &levels.sides;
        let z = &levels.result;
        let steps = context.checked("steps of an iteration", || {
            let dot = |a, b| kernels.dot.bind(context, &[a, b, &parts]);
            let product = |to| {
                let [size, kinds, sides, corners] = &levels.finest;
                kernels.product.bind(context, &[size, kinds, sides, corners, z, to])
            };
            Steps {
                dots: [dot(&shadow, s), dot(&shadow, &v), dot(s, &t)],
                scalars: numbers
                    .each_ref()
                    .map(|number| kernels.scalars.bind(context, &[number, &parts, &scalars, &history])),
                direction: kernels.direction.bind(context, &[&scalars, s, &v, p]),
                products: [product(&v), product(&t)],
                advances: [(1, &v), (2, &t)]
                    .map(|(half, w)| kernels.advance.bind(context, &[&numbers[half], &scalars, z, w, &e, s])),
            }
        })?;
        let bytes = levels.bytes + 4 * 4 * nodes as u64;
        let r = s.clone();
        Ok(Solver { context, kernels, levels, r, shadow, e, scalars, history, steps, nodes, bytes })
    }

    /// `count` iterations for A·e = `residual` from e = 0: e, and the squares of the residual before each iteration, one more than
    /// there are. Rows of the residual from the south.
    ///
    /// # Errors
    /// When the device refuses or does not finish.
    pub(super) fn correct(&self, residual: &[f32], count: usize) -> Result<(Vec<f32>, Vec<f32>), DiffusionError> {
        let context = self.context;
        let size = 4 * self.nodes as u64;
        let submitted = context.checked("diffusion by multigrid", || {
            let uploaded = context.buffer_of("a residual", &bits(residual), wgpu::BufferUsages::COPY_SRC);
            let mut encoder = context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&uploaded, 0, &self.r, 0, size);
            encoder.copy_buffer_to_buffer(&uploaded, 0, &self.shadow, 0, size);
            encoder.clear_buffer(&self.e, 0, None);
            encoder.clear_buffer(&self.scalars, 0, None);
            context.pass(&mut encoder, |pass| {
                (0..count).for_each(|_| self.iterate(pass));
                self.sum(pass, 0);
            });
            let host = context.host(size + 4 * (count as u64 + 1));
            encoder.copy_buffer_to_buffer(&self.e, 0, &host, 0, size);
            encoder.copy_buffer_to_buffer(&self.history, 0, &host, size, 4 * (count as u64 + 1));
            (host, context.queue().submit([encoder.finish()]))
        })?;
        let mut words = context.read_back(submitted)?;
        let squares = words.split_off(self.nodes);
        let numbers = |words: Vec<u32>| words.into_iter().map(f32::from_bits).collect();
        Ok((numbers(words), numbers(squares)))
    }

    /// An inner product and the scalars that it decides.
    fn sum(&self, pass: &mut wgpu::ComputePass<'_>, step: usize) {
        self.kernels.dot.dispatch(pass, &self.steps.dots[step], self.levels.strides());
        self.kernels.scalars.dispatch(pass, &self.steps.scalars[step], [1, 1, 1]);
    }
    fn iterate(&self, pass: &mut wgpu::ComputePass<'_>) {
        self.sum(pass, 0);
        self.kernels.direction.dispatch(pass, &self.steps.direction, self.levels.strides());
        for half in 0..2 {
            self.levels.cycle(pass, half);
            self.kernels.product.dispatch(pass, &self.steps.products[half], self.levels.nodes());
            self.sum(pass, half + 1);
            self.kernels.advance.dispatch(pass, &self.steps.advances[half], self.levels.strides());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_is_as_long_as_the_last_one_says() {
        // A hundredth each: three more leave a millionth, and no more is asked of f32.
        assert_eq!([1e-2, 1e-3, 1e-6, 1e-12].map(|wanted| iterations(1e-8, 4, wanted * 1.001)), [1, 2, 3, 4]);
        assert_eq!(
            (iterations(0.0, 4, 1e-6), iterations(0.9, 1, 1e-12), iterations(1.0, 4, 0.5)),
            (1, LONGEST, LONGEST)
        );
    }
}
