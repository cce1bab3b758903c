//! The same programs and points on every executor: `f64` of the tile program is the oracle, `Rounded` derives how far `f32`
//! may land from it.
//!
//! `Rounded` counts, for every operation, the half unit that IEEE arithmetic rounds by. A device keeps to that for + − ×,
//! and a contracted multiply-add only leaves a rounding out. It may be off by 2.5 ulp (5 half units) in a quotient and by
//! about 4.5 (9 half units) in a root, which Vulkan derives from 1/inverseSqrt. A bound is a sum of local errors times
//! factors that are common to both, so what the device may do is at most 9 times the bound to first order: [`DEVICE`] leaves
//! one more for what is of second order. Subnormal numbers may be flushed; that is `FLUSHED`.

use super::cases::cases;
use super::encode::{Encoded, OCTAVE_WORDS};
use super::{Interpreter, ProgramError, source};
use crate::context::Context;
use glam::DVec2;
use terrain_model::interval::Interval;
use terrain_model::program::{BatchEvaluator, Program, TileProgram};
use terrain_model::rounding::Rounded;

/// Device error over the derived error of IEEE arithmetic.
pub const DEVICE: f64 = 10.0;
/// What flushing subnormal numbers may add.
const FLUSHED: f64 = 1e-36;
/// An elevation whose derived error is wider than this, metres, is not compared: the weight nearly vanishes there.
const VACUOUS: f64 = 0.5;

/// What was compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Programs.
    pub programs: usize,
    /// Values of the device compared with the oracle: elevations and weights.
    pub cases: usize,
    /// Elevations that were not, because their derived error is too wide.
    pub vacuous: usize,
    /// Values of the device outside the tolerance.
    pub failures: usize,
    /// Values of the `f32` lanes outside the derived error itself.
    pub lane_failures: usize,
    /// Values of perturbed shaders outside the tolerance.
    pub control_failures: usize,
    /// Programs in which a perturbed shader went unnoticed, by perturbation: one in its weights, one in its noise, one in its rasters.
    pub blind_controls: usize,
    /// Largest distance of the device from the oracle, in units of the last place of an `f32` as large as the oracle, at
    /// least 1.
    pub max_ulp: f64,
    /// The same distance over the tolerance, at most 1 without failures.
    pub largest_share: f64,
}

/// A shader that is wrong: what is replaced by what, and the programs in which that must show.
type Perturbation = (&'static str, &'static str, fn(&Encoded) -> bool);

/// Every weight is off by a share of 10⁻⁴; every noise follows another fade; every raster is read off its place.
const PERTURBED: [Perturbation; 3] = [
    ("return v * v * v;", "return v * v * v * 1.0001;", |_| true),
    ("- 15.0)", "- 14.99)", |program| program.octaves.len() > OCTAVE_WORDS),
    ("return Within(cell, u - below);", "return Within(cell, 1.001 * (u - below));", Encoded::has_images),
];

/// Runs every case at about 1.5 · `count` points.
///
/// # Errors
/// When a case cannot be compiled or the device fails.
pub fn run(context: &Context, count: u32, seed: u32) -> Result<Outcome, ConformanceError> {
    let mut outcome = Outcome::default();
    let depth = [16; 2];
    let text = source(depth);
    let machine = Interpreter::compile(context, &text, depth)?;
    let mut controls = Vec::new();
    for (right, wrong, shows) in PERTURBED {
        controls.push((Interpreter::compile(context, &text.replace(right, wrong), depth)?, shows));
    }
    for case in cases().map_err(ConformanceError::Case)? {
        // Where a tile of a bake might start, not on the features.
        let origin = case.middle + DVec2::new(-401.7, -322.9);
        let tile = TileProgram::new(&case.program, origin);
        let points = case.points(&tile, count, seed);
        let encoded = Encoded::new(&tile);
        let device = machine.evaluate(context, &encoded, &points)?;
        let lanes = on_lanes(&case.program, &tile, &points);
        let (mut single, mut rounded) = (tile.evaluator::<f64>(), tile.evaluator::<Rounded>());
        let oracle: Vec<Derived> = points
            .iter()
            .map(|point| {
                let exact = tile.run(&mut single, point.map(f64::from));
                let fixed = point.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0));
                let derived = tile.run(&mut rounded, fixed);
                Derived { exact: [exact.0, exact.1], error: [derived.0.error, derived.1.error] }
            })
            .collect();
        outcome.programs += 1;
        for (k, derived) in oracle.iter().enumerate() {
            outcome.compare(derived, device[k], lanes[k]);
        }
        for (control, _) in controls.iter().filter(|(_, shows)| shows(&encoded)) {
            let wrong = control.evaluate(context, &encoded, &points)?;
            let outside = |(derived, wrong): (&Derived, &[f32; 2])| {
                let measured = [1, 0].into_iter().filter(|which| derived.tolerance(*which).is_some());
                measured.filter(|which| !derived.holds(*which, *wrong, DEVICE)).count()
            };
            let noticed: usize = oracle.iter().zip(&wrong).map(outside).sum();
            outcome.control_failures += noticed;
            outcome.blind_controls += usize::from(noticed == 0);
        }
    }
    Ok(outcome)
}

/// The lanes' answer.
fn on_lanes(program: &Program, tile: &TileProgram, points: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let [x, y] = [0, 1].map(|axis: usize| points.iter().map(|p| p[axis]).collect::<Vec<f32>>());
    let (mut f, mut a) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    BatchEvaluator::new(program).evaluate(tile, &x, &y, &mut f, &mut a);
    f.into_iter().zip(a).map(|(f, a)| [f, a]).collect()
}

/// What the oracle says of one point: elevation and weight, and how far `f32` may land from them.
struct Derived {
    exact: [f64; 2],
    error: [f64; 2],
}

impl Derived {
    /// The derived error, where it says something: off the support an elevation means nothing.
    fn tolerance(&self, which: usize) -> Option<f64> {
        let error = self.error[which];
        (which == 1 || self.exact[1] > 0.0).then_some(error).filter(|error| *error < VACUOUS)
    }
    /// How far a value lies from the oracle.
    fn off(&self, which: usize, values: [f32; 2]) -> f64 {
        // Where an executor rounds the weight to 0 its elevation means nothing; the weight itself is compared.
        let means = which == 1 || values[1] > 0.0;
        if means { (f64::from(values[which]) - self.exact[which]).abs() } else { 0.0 }
    }
    /// Whether it lies within `factor` times the derived error.
    fn holds(&self, which: usize, values: [f32; 2], factor: f64) -> bool {
        self.off(which, values) <= factor * self.error[which] + FLUSHED
    }
}

impl Outcome {
    fn compare(&mut self, derived: &Derived, device: [f32; 2], lanes: [f32; 2]) {
        for which in [1, 0] {
            let Some(error) = derived.tolerance(which) else {
                self.vacuous += usize::from(which == 1 || derived.exact[1] > 0.0);
                continue;
            };
            self.cases += 1;
            self.failures += usize::from(!derived.holds(which, device, DEVICE));
            self.lane_failures += usize::from(!derived.holds(which, lanes, 1.0));
            let off = derived.off(which, device);
            let size = derived.exact[which].abs().max(1.0) as f32;
            let ulp = f64::from(size.next_up()) - f64::from(size);
            self.max_ulp = self.max_ulp.max(off / ulp);
            self.largest_share = self.largest_share.max(off / (DEVICE * error + FLUSHED));
        }
    }
}

/// The suite could not be run.
#[derive(Debug, thiserror::Error)]
pub enum ConformanceError {
    /// A tree does not compile.
    #[error("{0}")]
    Case(String),
    /// The device failed.
    #[error(transparent)]
    Program(#[from] ProgramError),
}
