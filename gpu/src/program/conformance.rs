//! The same programs and points on every executor: `f64` of the tile program is the oracle, `Rounded` derives how far `f32`
//! may land from it.
//!
//! `Rounded` counts, for every operation, the half unit that IEEE arithmetic rounds by. A device keeps to that for + − ×,
//! and a contracted multiply-add only leaves a rounding out. It may be off by 2.5 ulp (5 half units) in a quotient and by
//! about 4.5 (9 half units) in a root, which Vulkan derives from 1/inverseSqrt. A bound is a sum of local errors times
//! factors that are common to both, so what the device may do is at most 9 times the bound to first order: [`DEVICE`] leaves
//! one more for what is of second order. Subnormal numbers may be flushed; that is `FLUSHED`.

use super::encode::Encoded;
use super::{Interpreter, ProgramError, source};
use crate::context::Context;
use glam::{DVec2, DVec3};
use terrain_model::detail::Focus;
use terrain_model::interval::Interval;
use terrain_model::noise::{Combination, Octaves, mix};
use terrain_model::operator::WeightRule;
use terrain_model::operator::affine::Similarity;
use terrain_model::operator::lod::{Lod, Passage};
use terrain_model::operator::masked::{Joining, Mask, Ramp};
use terrain_model::operator::warp::{Control, Warp};
use terrain_model::primitive::contour::{Contour, Ray};
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::detail_disc::DetailDisc;
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::profile::{Knot, Section};
use terrain_model::program::{BatchEvaluator, Program, TileProgram};
use terrain_model::rounding::Rounded;
use terrain_model::spline::Path;
use terrain_model::tree::{Node, NodeId, Tree};

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
    /// Programs in which a perturbed shader went unnoticed: one in its weights, one in its noise.
    pub blind_controls: usize,
    /// Largest distance of the device from the oracle, in units of the last place of an `f32` as large as the oracle, at
    /// least 1.
    pub max_ulp: f64,
    /// The same distance over the tolerance, at most 1 without failures.
    pub largest_share: f64,
}

/// A tree over one neighbourhood, with the focus of its levels of detail.
#[derive(Debug)]
pub struct Case {
    /// What it exercises.
    pub name: String,
    program: Program,
    /// Middle and half width of where it is asked, metres.
    middle: DVec2,
    reach: f64,
}

/// Every node and operator that the shader runs, near the origin and far from it.
///
/// # Errors
/// Which tree does not compile.
pub fn cases() -> Result<Vec<Case>, String> {
    let mut out = Vec::new();
    for middle in [DVec2::new(13.0, -7.0), DVec2::new(3_141_592.65, -2_718_281.83)] {
        let mut push = |name: &str, make: &dyn Fn(&mut Tree) -> Result<NodeId, String>| {
            let mut tree = Tree::new();
            let root = make(&mut tree)?;
            let program = Program::compile(&tree, root).map_err(|error| format!("{name}: {error}"))?;
            let focus = Focus { position: middle + DVec2::new(-300.0, 50.0), near: 100.0, far: 900.0 };
            let program = program.with_focus(Some(&focus));
            out.push(Case { name: name.to_owned(), program, middle, reach: 550.0 });
            Ok::<(), String>(())
        };
        let disc = |x: f64, y: f64, radius: f64, noise: Option<DiscNoise>| Disc {
            centre: DVec3::new(middle.x + x, middle.y + y, 120.0 + 0.1 * x),
            radius,
            weight: 0.9,
            noise,
        };
        let noise = |combination: Combination, octaves: u32| {
            let octaves = Octaves { octaves, frequency: 0.004, lacunarity: 2.03, gain: 0.55, amplitude: 80.0 };
            Some(DiscNoise { combination, octaves, seed: 77 })
        };
        let sum = noise(Combination::Sum, 5);
        let kinds = [
            ("sum", Combination::Sum),
            ("turbulence", Combination::Turbulence),
            ("ridged", Combination::Ridged { offset: 1.0, sharpness: 2.0 }),
            ("multifractal", Combination::Multifractal { offset: 0.8 }),
            ("hybrid", Combination::Hybrid { offset: 0.7 }),
        ];
        push("disc", &|tree| Ok(tree.push(disc(0.0, 0.0, 500.0, None))))?;
        for (name, kind) in kinds {
            push(name, &|tree| Ok(tree.push(disc(0.0, 0.0, 500.0, noise(kind, 6)))))?;
        }
        push("detail disc", &|tree| {
            let disc = disc(0.0, 0.0, 500.0, sum);
            Ok(tree.push(DetailDisc { disc, filters: DetailDisc::even_filters(5) }))
        })?;
        push("blend", &|tree| {
            let parts = (0..12).map(|k| {
                let at = DVec2::from_angle(f64::from(k)) * 250.0;
                tree.push(disc(at.x, at.y, 300.0, sum.filter(|_| k % 2 == 0)))
            });
            let parts = parts.collect();
            Ok(tree.push(Node::Blend(parts)))
        })?;
        let knot = |distance: f64, height: f64, slope: f64| Knot { distance, height, slope };
        let bank = vec![knot(-60.0, 15.0, 0.0), knot(0.0, -8.0, 0.3), knot(40.0, 5.0, -0.1), knot(90.0, 25.0, 0.0)];
        let course = |closeness: f64| -> Vec<DVec3> {
            let at = |k: i32| {
                DVec3::new(
                    middle.x + closeness * f64::from(k),
                    middle.y + f64::from(k * k % 7) * 40.0,
                    3.0 * f64::from(k),
                )
            };
            (-5..=5).map(at).collect()
        };
        let paths = [("polyline", Path::Polyline(course(80.0))), ("smooth", Path::Smooth(course(90.0)))];
        for (name, path) in paths {
            push(&format!("curve {name}, sections"), &|tree| {
                let even = vec![knot(-50.0, 20.0, 0.0), knot(0.0, -5.0, 0.0), knot(50.0, 20.0, 0.0)];
                let sections = [(0.0, even), (300.0, bank.clone())];
                let sections = sections.map(|(at, profile)| Section { at, profile }).to_vec();
                Ok(tree.push(Curve { sections, ..Curve::new(path.clone(), 120.0, Vec::new()) }))
            })?;
        }
        push("curve segment", &|tree| {
            let path = Path::Polyline(course(80.0)[4..6].to_vec());
            Ok(tree.push(Curve::new(path, 120.0, bank.clone())))
        })?;
        push("contour", &|tree| {
            let rays = (0..5u32).map(|k| Ray {
                angle: None,
                radius: 250.0 + 30.0 * f64::from(k % 3),
                profile: vec![knot(-150.0, 0.0, 0.0), knot(0.0, 10.0 + f64::from(k), 0.2), knot(80.0, 30.0, 0.0)],
            });
            let centre = DVec3::new(middle.x, middle.y, 40.0);
            let (rays, orientation) = (rays.collect(), 0.3);
            Ok(tree.push(Contour { centre, orientation, rays, reach: 150.0, weight: 0.8 }))
        })?;
        for rule in [WeightRule::Keep, WeightRule::Combine, WeightRule::CombinePaper] {
            push(&format!("replace {rule:?}"), &|tree| {
                let (a, b) = (tree.push(disc(-100.0, 0.0, 400.0, sum)), tree.push(disc(150.0, 0.0, 300.0, None)));
                Ok(tree.push(Node::Replace { a, b, rule }))
            })?;
            push(&format!("add {rule:?}"), &|tree| {
                let (a, b) = (tree.push(disc(-100.0, 0.0, 400.0, sum)), tree.push(disc(150.0, 0.0, 300.0, None)));
                Ok(tree.push(Node::Add { a, b, rule }))
            })?;
        }
        for passage in [Passage::Blend, Passage::Paper] {
            push(&format!("lod {passage:?}"), &|tree| {
                let (a, b) = (tree.push(disc(0.0, 0.0, 500.0, None)), tree.push(disc(0.0, 0.0, 520.0, sum)));
                Ok(tree.push(Node::Lod { a, b, lod: Lod { from: 0.2, to: 0.9, passage } }))
            })?;
        }
        for joining in [Joining::Add, Joining::Replace] {
            push(&format!("masked {joining:?}"), &|tree| {
                let (a, b) = (tree.push(disc(0.0, 0.0, 600.0, sum)), tree.push(disc(50.0, 0.0, 500.0, None)));
                let elevation = Some(Ramp { full: 100.0, none: 170.0 });
                let mask = Mask { probe: 4.0, elevation, slope: Some(Ramp { full: 0.2, none: 0.9 }), joining };
                Ok(tree.push(Node::Masked { a, b, mask }))
            })?;
        }
        let turned = |about: DVec2, rotation: f64, scale: f64| {
            let translation = about - DVec2::from_angle(rotation).rotate(about) * scale;
            Similarity { scale, rotation, translation, elevation_scale: 1.5, elevation_offset: -20.0 }
        };
        push("affine", &|tree| {
            let node = tree.push(disc(0.0, 0.0, 400.0, sum));
            Ok(tree.push(Node::Affine { node, map: turned(middle, 0.7, 1.2) }))
        })?;
        push("warp", &|tree| {
            let node = tree.push(disc(0.0, 0.0, 450.0, sum));
            let control = |x: f64, y: f64| Control {
                centre: middle + DVec2::new(x, y),
                radius: 260.0,
                shift: DVec2::new(50.0, -30.0),
            };
            let warp = Warp::new(&[control(-200.0, 0.0), control(220.0, 60.0)])?;
            Ok(tree.push(Node::Warp { node, warp }))
        })?;
        push("nested", &|tree| {
            let leaves = [-1.0, 0.0, 1.0].map(|k| tree.push(disc(180.0 * k, 90.0, 350.0, sum)));
            let inner = tree.push(Node::Blend(leaves.to_vec()));
            let turned = tree.push(Node::Affine { node: inner, map: turned(middle, -1.1, 0.8) });
            let flat = tree.push(disc(0.0, -200.0, 300.0, None));
            let sum = tree.push(Node::Add { a: turned, b: flat, rule: WeightRule::Keep });
            let first = tree.push(Node::Blend(vec![inner, sum]));
            Ok(tree.push(Node::Blend(vec![first, flat, turned])))
        })?;
    }
    Ok(out)
}

impl Case {
    /// `count` random points of the case relative to `origin`, and adversarial ones: borders of the lattice cells of the
    /// first octave, the rims of supports of radius 400 and 500, and the middle itself, each with its neighbours.
    fn points(&self, tile: &TileProgram, count: u32, seed: u32) -> Vec<[f32; 2]> {
        let local = self.middle - tile.origin;
        let unit = |k: u32, salt: u32| f64::from(mix(mix(seed, salt), k)) / 4_294_967_296.0;
        let place = |x: f64, y: f64| [(local.x + x) as f32, (local.y + y) as f32];
        let spread = |k: u32, salt: u32| (2.0 * unit(k, salt) - 1.0) * self.reach;
        let mut out: Vec<[f32; 2]> = (0..count).map(|k| place(spread(k, 1), spread(k, 2))).collect();
        let mut near = vec![place(0.0, 0.0)];
        for k in 0..count / 16 {
            let rim = DVec2::from_angle(std::f64::consts::TAU * unit(k, 3)) * [400.0, 500.0][k as usize % 2];
            near.push(place(rim.x, rim.y));
            if let Some(octave) = tile.octaves().first() {
                let border = |axis: usize, from: f64| {
                    let cell = (from * octave.frequency + octave.offset[axis]).round();
                    ((cell - octave.offset[axis]) / octave.frequency) as f32
                };
                let (x, y) = (local.x + spread(k, 4), local.y + spread(k, 5));
                near.push([border(0, x), y as f32]);
                near.push([border(0, x), border(1, y)]);
            }
        }
        for [x, y] in near {
            out.extend([[x, y], [x.next_up(), y], [x, y.next_down()], [x.next_down(), y.next_up()]]);
        }
        out
    }
}

/// Runs every case at about 1.5 · `count` points.
///
/// # Errors
/// When a case cannot be compiled or the device fails.
pub fn run(context: &Context, count: u32, seed: u32) -> Result<Outcome, ConformanceError> {
    let mut outcome = Outcome::default();
    let depth = [16; 2];
    let text = source(depth);
    // Every weight is off by a share of 10⁻⁴; every noise follows another fade.
    let perturbed = [("return v * v * v;", "return v * v * v * 1.0001;"), ("- 15.0)", "- 14.99)")];
    let machine = Interpreter::compile(context, &text, depth)?;
    let [control, noise_control] =
        perturbed.map(|(right, wrong)| Interpreter::compile(context, &text.replace(right, wrong), depth));
    let (control, noise_control) = (control?, noise_control?);
    for case in cases().map_err(ConformanceError::Case)? {
        // Where a tile of a bake might start, not on the features.
        let origin = case.middle + DVec2::new(-401.7, -322.9);
        let tile = TileProgram::new(&case.program, origin);
        let points = case.points(&tile, count, seed);
        let encoded = Encoded::new(&tile)?;
        let device = machine.evaluate(context, &encoded, &points)?;
        let wrong_weight = control.evaluate(context, &encoded, &points)?;
        let wrong_noise = noise_control.evaluate(context, &encoded, &points)?;
        let lanes = on_lanes(&case.program, &tile, &points);
        outcome.programs += 1;
        let before = outcome.control_failures;
        let mut noise_control = Outcome::default();
        let (mut single, mut rounded) = (tile.evaluator::<f64>(), tile.evaluator::<Rounded>());
        for (k, point) in points.iter().enumerate() {
            let exact = tile.run(&mut single, point.map(f64::from));
            let fixed = point.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0));
            let derived = tile.run(&mut rounded, fixed);
            let (exact, error) = ([exact.0, exact.1], [derived.0.error, derived.1.error]);
            outcome.compare(exact, error, device[k], wrong_weight[k], lanes[k]);
            noise_control.compare(exact, error, device[k], wrong_noise[k], lanes[k]);
        }
        outcome.blind_controls += usize::from(outcome.control_failures == before);
        outcome.blind_controls += usize::from(!tile.octaves().is_empty() && noise_control.control_failures == 0);
        outcome.control_failures += noise_control.control_failures;
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

impl Outcome {
    fn compare(&mut self, exact: [f64; 2], error: [f64; 2], device: [f32; 2], perturbed: [f32; 2], lanes: [f32; 2]) {
        for which in [1, 0] {
            // Off the support an elevation means nothing.
            if which == 0 && exact[1] <= 0.0 {
                continue;
            }
            if error[which].is_nan() || error[which] >= VACUOUS {
                self.vacuous += 1;
                continue;
            }
            let tolerance = DEVICE * error[which] + FLUSHED;
            let off = |values: [f32; 2]| {
                // Where an executor rounds the weight to 0 its elevation means nothing; the weight itself was compared.
                let means = which == 1 || values[1] > 0.0;
                if means { (f64::from(values[which]) - exact[which]).abs() } else { 0.0 }
            };
            let outside =
                |values: [f32; 2], tolerance: f64| usize::from(off(values).is_nan() || off(values) > tolerance);
            self.cases += 1;
            self.failures += outside(device, tolerance);
            self.control_failures += outside(perturbed, tolerance);
            self.lane_failures += outside(lanes, error[which]);
            let size = exact[which].abs().max(1.0) as f32;
            let ulp = f64::from(size.next_up()) - f64::from(size);
            self.max_ulp = self.max_ulp.max(off(device) / ulp);
            self.largest_share = self.largest_share.max(off(device) / tolerance);
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
