//! What is compared: heights of a program, rays over a terrain, diffusion of a landscape, refinement of triangles. Each runs the same work on
//! both sides; that both give the same answers is what the tests and experiments of the crates hold.

use super::{Failure, Sizes, Task, Work};
use glam::DVec2;
use rayon::prelude::*;
use terrain_diffusion::fields::{Settings, Solver, diffuse};
use terrain_diffusion::landscapes;
use terrain_experiments::model::operations::operations_per_sample;
use terrain_experiments::scenes;
use terrain_gpu::context::Context;
use terrain_gpu::diffusion::{Diffuser, work};
use terrain_gpu::program::Interpreter;
use terrain_gpu::program::encode::Encoded;
use terrain_gpu::tessellate::decision::{Decision, Pyramid};
use terrain_gpu::tessellate::device::refine::{Capacity, Refiner};
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::view::View;
use terrain_gpu::trace::{self, Bound, Tiles, beams};
use terrain_model::bounds::Region;
use terrain_model::grid::Grid;
use terrain_model::noise::{Octaves, mix};
use terrain_model::program::{BatchEvaluator, TileProgram};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::{HeightRay, Ray, RayFunction, Surface, Tracer};

/// Takes a task when it is ready.
type Each<'a> = &'a mut dyn FnMut(Task<'_>) -> Result<(), Failure>;

/// The scene of heights and rays.
const SCENE: &str = "fig1";
/// Metres along the side of the tile on which heights are evaluated.
const TILE: f64 = 256.0;
/// Points that a thread takes at a time.
const POINTS: usize = 4096;
/// Nodes along the side of the ground that is refined.
const GROUND: usize = 257;

/// Heights of one tile's program in `f32`: lanes here, the interpreter there.
pub(super) fn heights(context: &Context, sizes: Sizes, each: Each<'_>) -> Result<(), Failure> {
    let scene = scenes::load(&format!("builtin:{SCENE}"))?;
    let program = scene.program(scene.ground())?;
    let (low, high) = program.support().ok_or("the scene is empty")?;
    let middle = 0.5 * (low + high);
    let reach = DVec2::splat(0.5 * TILE);
    let pruned = program.prune(Region::rectangle(middle - reach, middle + reach));
    let tile = TileProgram::new(&pruned, middle);
    let encoded = Encoded::new(&tile);
    let interpreter = Interpreter::new(context, &encoded)?;
    // The middle of the one tile of a plane twice as wide as the place is far.
    let per_point = operations_per_sample(&program, 2.0 * middle, DVec2::splat(TILE), 1);
    let counts: &[usize] = if sizes == Sizes::Quick { &[1 << 14] } else { &[1 << 16, 1 << 20, 1 << 23] };
    for &count in counts {
        let place = |k: usize| {
            let at = |step: f64| (((k as f64 * step).fract() - 0.5) * TILE) as f32;
            [at(0.754_877_666), at(0.569_840_291)]
        };
        let points: Vec<[f32; 2]> = (0..count).map(place).collect();
        let (x, y): (Vec<f32>, Vec<f32>) = points.iter().map(|[x, y]| (*x, *y)).unzip();
        each(Task {
            workload: "heights",
            size: format!("{count} points of {SCENE}"),
            items: count as u64,
            processor: Box::new(|| {
                let mut out = vec![[0.0f32; 2]; count];
                let parts = out.par_chunks_mut(POINTS).zip(x.par_chunks(POINTS).zip(y.par_chunks(POINTS)));
                parts.for_each_init(
                    || (BatchEvaluator::new(&pruned), vec![0.0; POINTS], vec![0.0; POINTS]),
                    |(batch, elevation, weight), (out, (x, y))| {
                        let n = out.len();
                        batch.evaluate(&tile, x, y, &mut elevation[..n], &mut weight[..n]);
                        let pairs = elevation.iter().zip(weight.iter());
                        out.iter_mut().zip(pairs).for_each(|(out, (h, a))| *out = [*h, *a]);
                    },
                );
                std::hint::black_box(out);
                Ok(())
            }),
            adapter: Box::new(|| {
                std::hint::black_box(interpreter.evaluate(context, &encoded, &points)?);
                let points = count as f64;
                Ok(Work { bytes: Some(16.0 * points), operations: Some(per_point * points) })
            }),
            note: "bytes: points and results; operations: of the tile's program at its middle, integers of hashes included",
        })?;
    }
    Ok(())
}

/// Rays of a picture by segment tracing: `f64` here, `f32` on tiles there.
pub(super) fn tracing(context: &Context, sizes: Sizes, each: Each<'_>) -> Result<(), Failure> {
    let scene = scenes::load(&format!("builtin:{SCENE}"))?;
    let program = scene.program(scene.ground())?;
    let surface = Surface::new(&program);
    let placement = scene.cameras.get("main").ok_or("the scene has no main camera")?;
    let (quick, tiles) = (sizes == Sizes::Quick, if sizes == Sizes::Quick { 24 } else { 128 });
    let tiles = Tiles::new(&surface, tiles).ok_or("the scene is empty")?;
    let tracer = trace::Tracer::new(context, &tiles)?;
    let stop = terrain_model::trace::Settings::default();
    let settings = trace::Settings { bound: Bound::Gradient, epsilon: stop.epsilon, most_steps: 200_000, share: 1.0 };
    let pictures: &[(usize, usize)] = if quick { &[(32, 18)] } else { &[(480, 270), (1920, 1080)] };
    let (low, high) = program.support().ok_or("the scene is empty")?;
    let width = DVec2::splat(2.0 * tiles.half());
    let per_evaluation = operations_per_sample(&program, high - low, width, 16);
    for &(width, height) in pictures {
        let camera = Camera::new(placement, width, height);
        let at = |k: usize| camera.ray((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        let rays: Vec<Ray> = (0..width * height).map(at).collect();
        each(Task {
            workload: "tracing",
            size: format!("{width} × {height} rays of {SCENE}"),
            items: rays.len() as u64,
            processor: Box::new(|| {
                let evaluations: Vec<u64> = rays
                    .par_iter()
                    .map_init(
                        || HeightRay::new(&surface),
                        |along, ray| {
                            along.aim(*ray);
                            std::hint::black_box(Tracer::Segment.trace(&surface, along, &stop));
                            along.evaluations()
                        },
                    )
                    .collect();
                std::hint::black_box(evaluations);
                Ok(())
            }),
            adapter: Box::new(|| {
                let found = tracer.trace(&beams(&surface, &tiles, &rays), &settings)?;
                let steps: u64 = found.iter().map(|found| u64::from(found.steps)).sum();
                Ok(Work { bytes: None, operations: Some(steps as f64 * per_evaluation) })
            }),
            note: "rays are brought to their tiles by the processor, which the wall clock holds; tiles are made once, before; operations: \
                   steps times the mean of tiles; bytes not counted, programs are read from caches",
        })?;
    }
    Ok(())
}

/// All fields of a landscape, curves drawn and hierarchies built by the processor on both sides.
pub(super) fn diffusion(context: &Context, sizes: Sizes, each: Each<'_>) -> Result<(), Failure> {
    let landscape =
        landscapes::named("canyon").and_then(|model| model.landscape().ok()).ok_or("no landscape of that name")?;
    let diffuser = Diffuser::new(context)?;
    let sides: &[usize] = if sizes == Sizes::Quick { &[65] } else { &[257, 513, 1025, 2048] };
    for &side in sides {
        let domain = landscape.domain(side);
        for solver in [Solver::Multigrid, Solver::Paper] {
            let settings = Settings { solver, ..Settings::default() };
            each(Task {
                workload: if solver == Solver::Paper {
                    "diffusion, the paper's schedule"
                } else {
                    "diffusion, converged"
                },
                size: format!("canyon, {} × {} nodes", domain.width, domain.height),
                items: (domain.width * domain.height) as u64,
                processor: Box::new(|| {
                    std::hint::black_box(diffuse(landscape.curves(), domain, &settings)?);
                    Ok(())
                }),
                adapter: Box::new(|| {
                    let fields = diffuser.diffuse(landscape.curves(), domain, &settings)?;
                    if solver == Solver::Paper {
                        return Ok(Work::default());
                    }
                    // Of each system as many solves as it has fields.
                    let fields_of = |name: &str| name.split(',').count().max(1);
                    let solves = fields.reports.iter().map(|report| report.iterations * fields_of(report.field)).sum();
                    let done = work::multigrid(domain.width, domain.height, solves);
                    Ok(Work { bytes: Some(done.bytes), operations: Some(done.operations) })
                }),
                note: "to a relative residual of 1e-8 where converged; bytes and operations: of the iterations, each array that a step \
                       names once, weights of nodes with slopes not counted; of the schedule neither is counted",
            })?;
        }
    }
    Ok(())
}

/// Leaves of a view over rough ground.
pub(super) fn refinement(context: &Context, sizes: Sizes, each: Each<'_>) -> Result<(), Failure> {
    let elevation = |at: usize| f64::from(mix(7, at as u32) >> 24) * 0.4;
    let heights = (0..GROUND * GROUND).map(elevation).collect();
    let ground = Ground::new(&Grid::new(DVec2::ZERO, DVec2::splat(30.0), GROUND, GROUND, heights)?, 0.6)?;
    let octaves = Octaves { octaves: 6, frequency: 0.02, lacunarity: 2.0, gain: 0.5, amplitude: 6.0 };
    let detail = Detail::new(&octaves, 3, Space::Volume).ok_or("octaves without an end")?;
    let view = View::new([1000.0, 1000.0, 300.0], [0.7, 0.7, -0.2], 900.0, [960.0, 540.0])
        .ok_or("a view without a direction")?;
    let pyramid = Pyramid::new(&ground);
    let targets: &[f64] = if sizes == Sizes::Quick { &[32.0] } else { &[32.0, 8.0, 2.0] };
    for &target in targets {
        let refinement = Refinement::new(&ground, &detail, view, target, 24);
        let decision = Decision::new(&pyramid, &refinement);
        let count = decision.leaves(true).len();
        let mut refiner = Refiner::new(context, &pyramid, Capacity { list: 1 << 14, leaves: 1 << 15 })?;
        refiner.refine_growing(&decision, true)?;
        let refiner = refiner;
        each(Task {
            workload: "refinement",
            size: format!("edges of {target} pixels, {count} leaves"),
            items: count as u64,
            processor: Box::new(|| {
                std::hint::black_box(decision.leaves(true));
                Ok(())
            }),
            adapter: Box::new(|| {
                refiner.refine(&decision, true)?;
                Ok(Work::default())
            }),
            note: "the processor's twin runs on one thread; leaves stay on the adapter; bytes and operations not counted",
        })?;
    }
    Ok(())
}
