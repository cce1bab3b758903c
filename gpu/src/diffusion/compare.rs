//! The device held to the processor: each system solved by both, with a bound of how far two answers of such residuals can lie apart; and
//! each raster of the cascade iterated in `f64` from the device's own raster below, with a bound of what `f32` can lose on it.

use super::multigrid::Multigrid;
use super::{Diffuser, cascade};
use std::time::Instant;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Fields, Settings, diffuse_on};
use terrain_diffusion::plane::Plane;
use terrain_diffusion::raster::{Domain, Node};
use terrain_diffusion::solver::SolveError;
use terrain_diffusion::solver::cascade::{ITERATIONS, Level, domains, given_elevation, given_gradient, given_noise};
use terrain_diffusion::solver::engine::{Engine, Kind, Processor};
use terrain_diffusion::solver::equations::{Equation, Equations, Other};
use terrain_diffusion::solver::guided::Update;
use terrain_diffusion::solver::krylov::{Progress, Stop};

/// One system solved by both.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Whether both met the tolerance.
    pub converged: bool,
    /// Iterations of the device, and of the processor.
    pub iterations: [usize; 2],
    /// The largest relative residual of each.
    pub residual: [f64; 2],
    /// Wall seconds of each, set-up included.
    pub seconds: [f64; 2],
    /// The largest difference between the two in the units of the field, and what it can be.
    pub difference: f64,
    /// With A·x = c + r and A·x′ = c + r′, |x − x′| ≤ ‖A⁻¹‖·(‖r‖ + ‖r′‖): see [`sensitivity`].
    pub bound: f64,
    /// The range of the processor's values.
    pub range: f64,
}

/// Solves by both and answers with the device's.
struct Comparing<'a, 'c> {
    device: Multigrid<'c>,
    found: &'a mut Vec<Compared>,
}

/// A bound of ‖A⁻¹‖ in the largest norm, and in the Euclidean norm if A is symmetric: the largest w of A·w = 1. A row of the systems that
/// are directed, and of Laplace, has no positive coefficient beside its own and no negative sum, so A⁻¹ has no negative entry and its
/// largest row sum is that of A⁻¹·1. A symmetric system here is that of Laplace and a sum of squares: its least eigenvalue is no less, so w is of
/// Laplace on the same given nodes. w is solved to a residual ρ < 1, so that A⁻¹·1 ≤ w / (1 − ρ).
///
/// # Errors
/// As [`Processor`].
pub fn sensitivity(kind: Kind, equations: &Equations) -> Result<f64, SolveError> {
    let [width, height] = equations.size();
    let plain = |i: usize, j: usize| {
        let mut other = Other { constant: 1.0, ..Other::default() };
        for (step, there) in [((-1, 0), i > 0), ((1, 0), i + 1 < width), ((0, -1), j > 0), ((0, 1), j + 1 < height)] {
            other.add(step, f64::from(u8::from(there)));
        }
        other
    };
    let ones = Equations::new(width, height, |j, row| {
        for (i, to) in row.iter_mut().enumerate() {
            *to = if equations.is_given(i, j) { Equation::Given } else { Equation::Other(plain(i, j)) };
        }
        for (i, other) in equations.others(j).iter().filter(|_| kind == Kind::Directed) {
            row[*i as usize] = Equation::Other(Other { constant: 1.0, ..*other });
        }
    });
    let ones = if kind == Kind::Directed { ones.directed() } else { ones };
    let mut w = Plane::<f64, 1>::new(width, height);
    Processor.solve(kind, &ones, &mut w, Stop { relative_residual: 1e-8, iterations: 100 })?;
    let mut rest = Plane::<f64, 1>::new(width, height);
    ones.residual(&w, &mut rest);
    let largest = |plane: &Plane<f64, 1>| plane.iter(0).fold(0.0, |most: f64, value| most.max(value.abs()));
    let left = largest(&rest);
    Ok(if left < 1.0 { largest(&w) / (1.0 - left) } else { f64::INFINITY })
}

impl Engine for Comparing<'_, '_> {
    fn solve<const K: usize>(
        &mut self,
        kind: Kind,
        equations: &Equations,
        values: &mut Plane<f64, K>,
        stop: Stop,
    ) -> Result<Progress<K>, SolveError> {
        let mut reference = values.clone();
        let start = Instant::now();
        let of_processor = Processor.solve(kind, equations, &mut reference, stop)?;
        let middle = Instant::now();
        let of_device = self.device.solve(kind, equations, values, stop)?;
        let seconds = [middle.elapsed().as_secs_f64(), (middle - start).as_secs_f64()];
        let mut rest = Plane::<f64, K>::new(values.width(), values.height());
        let norms = [&*values, &reference].map(|x| equations.residual(x, &mut rest).map(f64::sqrt));
        let norm = sensitivity(kind, equations)?;
        // Each field by itself: what comes closest to its bound is told.
        let fields = (0..K).map(|k| {
            let pairs = values.iter(k).zip(reference.iter(k));
            let difference = pairs.map(|(a, b)| if a == b { 0.0 } else { (a - b).abs() }).fold(0.0, nan_max);
            let [low, high] =
                reference.iter(k).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
            // And what adding a correction may round in f64: two ulps of the largest value each.
            let rounding = 4.0 * f64::EPSILON * low.abs().max(high.abs());
            (difference, norm * (norms[0][k] + norms[1][k]) + rounding, high - low)
        });
        let share = |(difference, bound, _): &(f64, f64, f64)| if *bound > 0.0 { difference / bound } else { 0.0 };
        let worst = fields.reduce(|a, b| if share(&a) >= share(&b) { a } else { b }).unwrap_or_default();
        let (difference, bound, range) = worst;
        let last = |residuals: [f64; K]| residuals.into_iter().fold(0.0, nan_max);
        self.found.push(Compared {
            converged: of_device.converged && of_processor.converged,
            iterations: [of_device.iterations(), of_processor.iterations()],
            residual: [last(of_device.last()), last(of_processor.last())],
            seconds,
            difference,
            bound,
            range,
        });
        Ok(of_device)
    }
}

/// The greater; what is no number is greatest.
fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// One raster of the cascade, or several: how far the device is from `f64` at the most, in shares of what it may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Of the gradient, its direction included.
    pub gradient: f64,
    /// Of amplitude and roughness.
    pub noise: f64,
    /// Of the elevation, metres.
    pub elevation: f64,
}

impl Share {
    /// The largest of the three.
    pub fn largest(&self) -> f64 {
        [self.gradient, self.noise, self.elevation].into_iter().fold(0.0, nan_max)
    }
}

impl Diffuser<'_> {
    /// Solves every system of `curves` by the device and by the processor: the device's fields, and how they compare.
    ///
    /// # Errors
    /// As [`Diffuser::diffuse`].
    pub fn compare(
        &self,
        curves: &[Curve],
        domain: Domain,
        settings: &Settings,
    ) -> Result<(Fields, Vec<Compared>), SolveError> {
        let mut found = Vec::new();
        let device = Multigrid { context: self.context, kernels: &self.multigrid };
        let fields = diffuse_on(curves, domain, settings, &mut Comparing { device, found: &mut found })?;
        Ok((fields, found))
    }

    /// Runs the cascade on the device and each of its rasters in `f64` too, from the fields that the device had on the raster below and,
    /// for the elevation, guided by the device's gradient: the device's fields, and the shares of the bound of [`lost`].
    ///
    /// # Errors
    /// As [`Diffuser::diffuse`].
    pub fn compare_cascade(
        &self,
        curves: &[Curve],
        domain: Domain,
        update: Update,
    ) -> Result<(Fields, Share), SolveError> {
        let rasters = domains(domain).len();
        let (mut below, mut index) = (None::<(Domain, Level)>, 0);
        let mut share = Share::default();
        let mut watch = |nodes: &[Node], domain: Domain, device: &Level| {
            let count = ITERATIONS * (rasters - index);
            let mut exact =
                below.as_ref().map_or_else(|| Level::first(nodes), |(from, level)| level.raised(from, &domain));
            let raised = exact.clone();
            exact.iterate_slopes_and_noise(nodes, &domain, count);
            let gradient = exact.gradient.clone();
            exact.gradient.clone_from(&device.gradient);
            exact.iterate_elevation(nodes, &domain, update, count);
            let wide = below.as_ref().map_or(0, |(from, _)| {
                if from.spacing == 2.0 * domain.spacing { 0 } else { domain.width.max(domain.height) }
            });
            let bound = |magnitude: f64| lost(count, wide, magnitude);
            let of = |name: &dyn Fn(&Node) -> f64| nodes.iter().map(name).fold(0.0, f64::max);
            // What the iterations began with and what is given bound all that follows; a slope adds its rise over a cell.
            let gradients = largest(raised.gradient.as_flattened())
                .max(of(&|node| given_gradient(node).map_or(0.0, |given| largest(&given))));
            let noises = largest(raised.noise.as_flattened())
                .max(of(&|node| given_noise(node).map_or(0.0, |given| largest(&given))));
            let elevations = largest(&raised.elevation)
                .max(of(&|node| given_elevation(node).map_or(0.0, |given| largest(&given))))
                .max(largest(&exact.elevation));
            let step = largest(&device.gradient.iter().map(|[rise, ..]| *rise).collect::<Vec<f64>>()) * domain.spacing;
            let ratio = |difference: f64, bound: f64| if difference == 0.0 { 0.0 } else { difference / bound };
            let found = [
                ratio(furthest(gradient.as_flattened(), device.gradient.as_flattened()), bound(gradients)),
                ratio(furthest(exact.noise.as_flattened(), device.noise.as_flattened()), bound(noises)),
                ratio(furthest(&exact.elevation, &device.elevation), bound(elevations + step)),
            ];
            share.gradient = nan_max(share.gradient, found[0]);
            share.noise = nan_max(share.noise, found[1]);
            share.elevation = nan_max(share.elevation, found[2]);
            below = Some((domain, device.clone()));
            index += 1;
        };
        let fields = cascade::run(self.context, &self.cascade, curves, domain, update, Some(&mut watch))?;
        Ok((fields, share))
    }
}

/// What `f32` may lose in `count` iterations on a raster of fields no larger than `magnitude`, and in raising them to it. A value of an
/// iteration is a mean, with weights that are not negative and sum to 1 at most, so errors are carried on and not enlarged. It adds what
/// its own operations round: at most 32 of them by 2⁻²⁴ of the largest term, of which divisions and the root count for three ulps each, as
/// Vulkan allows. Raising rounds eight times; where the rasters' spacings are not as 2 to 1, a place among `wide` cells is off by
/// 2·2⁻²⁴ of itself, over a difference of twice the largest value, on both axes.
pub fn lost(count: usize, wide: usize, magnitude: f64) -> f64 {
    const ROUNDED: f64 = 1.0 / 16_777_216.0;
    (32 * count + 8 + 8 * wide) as f64 * ROUNDED * magnitude
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}
fn furthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, nan_max)
}
