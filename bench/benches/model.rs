//! Noises, the executors of a program and its bounds, the tracers, and a regular mesh, on the scenes of Fig. 3 and Fig. 19.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use std::hint::black_box;
use terrain_experiments::scenes;
use terrain_model::bounds::Region;
use terrain_model::lanes::Lanes;
use terrain_model::mesh::regular::regular;
use terrain_model::noise::{Lattice, NoiseValue};
use terrain_model::program::{Evaluator, Program, WIDTH};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::{CertifiedTracer, Effort};
use terrain_model::trace::{HeightRay, Ray, Settings, Surface, Tracer};

const SCENES: [&str; 2] = ["fig3", "fig19"];
/// Points or rays of one iteration.
const COUNT: usize = 256;

struct Case {
    program: Program,
    rays: Vec<Ray>,
    points: Vec<DVec2>,
    extent: [DVec2; 2],
}

impl Case {
    /// A scene with rays through its picture, and points of a Weyl sequence over its support.
    fn of(name: &str) -> Case {
        let scene = scenes::load(&format!("builtin:{name}")).expect("an embedded scene");
        let program = scene.program(scene.ground()).expect("a scene that compiles");
        let camera = Camera::new(&scene.cameras["main"], 16, 16);
        let rays = (0..COUNT).map(|k| camera.ray((k % 16) as f64 + 0.5, (k / 16) as f64 + 0.5)).collect();
        let extent = program.support().map(|(low, high)| [low, high]).expect("a scene with terrain");
        let weyl = |k: usize, step: f64| (k as f64 * step).fract();
        let points = (0..COUNT).map(|k| DVec2::new(weyl(k, 0.754_877_666), weyl(k, 0.569_840_291)));
        let points = points.map(|u| extent[0] + u * (extent[1] - extent[0])).collect();
        Case { program, rays, points, extent }
    }
}

/// The reference and 16 lanes of `f32` under the dispatch of the batch executor.
fn noises(c: &mut Criterion) {
    let mut group = c.benchmark_group("noise");
    group.throughput(Throughput::Elements(COUNT as u64));
    let plane = Lattice { seed: 1, base: [0, 0] };
    let space = Lattice { seed: 1, base: [0, 0, 0] };
    let along = |k: usize| 0.137 * k as f64;
    macro_rules! both {
        ($name:ident, $lattice:expr, |$x:ident, $other:ident| $point:expr) => {
            group.bench_function(concat!(stringify!($name), " f64"), |b| {
                let $other = |value: f64| value;
                b.iter(|| (0..COUNT).map(along).map(|$x| f64::$name($lattice, black_box($point))).sum::<f64>());
            });
            group.bench_function(concat!(stringify!($name), " lanes"), |b| {
                let $other = |value: f64| Lanes::<WIDTH>([value as f32; WIDTH]);
                let task = Task(|| {
                    let mut sum = Lanes::<WIDTH>([0.0; WIDTH]);
                    for k in 0..COUNT / WIDTH {
                        let $x = Lanes::<WIDTH>(std::array::from_fn(|lane| along(k * WIDTH + lane) as f32));
                        sum = sum + Lanes::<WIDTH>::$name($lattice, black_box($point));
                    }
                    sum
                });
                let arch = pulp::Arch::new();
                b.iter(|| arch.dispatch(&task));
            });
        };
    }
    both!(gradient2, plane, |x, at| [x, at(0.3)]);
    both!(gradient3, space, |x, at| [x, at(0.3), at(0.7)]);
    both!(simplex3, space, |x, at| [x, at(0.3), at(0.7)]);
    group.finish();
}

/// A closure given to `dispatch` as it is would be called through `FnOnce`, which is not inlined and so loses the wide instructions.
struct Task<F>(F);

impl<T, F: Fn() -> T> pulp::NullaryFnOnce for &Task<F> {
    type Output = T;
    #[inline(always)]
    fn call(self) -> T {
        (self.0)()
    }
}

fn executors(c: &mut Criterion) {
    for name in SCENES {
        let case = Case::of(name);
        let program = &case.program;
        let mut group = c.benchmark_group(format!("{name}/program"));
        group.throughput(Throughput::Elements(COUNT as u64));
        let mut evaluator = Evaluator::<f64>::new(program);
        group.bench_function("height", |b| {
            b.iter(|| case.points.iter().map(|&p| evaluator.height(program, black_box(p)).0).sum::<f64>());
        });
        group.bench_function("sample", |b| {
            b.iter(|| case.points.iter().map(|&p| program.sample(black_box(p)).elevation).sum::<f64>());
        });
        let boxes: Vec<Region> = case.points.iter().map(|&p| Region::rectangle(p, p + DVec2::ONE)).collect();
        group.bench_function("bounds of a metre", |b| {
            b.iter(|| boxes.iter().map(|&region| program.bounds(black_box(region)).slope).fold(0.0, f64::max));
        });
        group.bench_function("prune to a metre", |b| {
            b.iter(|| boxes.iter().map(|&region| program.prune(black_box(region)).code().len()).sum::<usize>());
        });
        group.finish();
        let mut group = c.benchmark_group(format!("{name}/mesh"));
        group.throughput(Throughput::Elements(512 * 512)).sample_size(10);
        let step = (case.extent[1] - case.extent[0]) / 512.0;
        group.bench_function("samples alone", |b| b.iter(|| program.bake(case.extent[0], step, 512, 512)));
        group.bench_function("regular", |b| b.iter(|| regular(program, case.extent, [512, 512]).expect("a mesh")));
        group.finish();
    }
}

fn tracers(c: &mut Criterion) {
    for name in SCENES {
        let case = Case::of(name);
        let side = (case.extent[1] - case.extent[0]).max_element();
        let settings = Settings { epsilon: 1e-4 * side, ..Settings::default() };
        let surface = Surface::new(&case.program);
        let mut group = c.benchmark_group(format!("{name}/trace"));
        group.throughput(Throughput::Elements(COUNT as u64)).sample_size(10);
        for tracer in Tracer::ALL {
            group.bench_function(BenchmarkId::from_parameter(tracer.name()), |b| {
                let mut along = HeightRay::new(&surface);
                b.iter(|| {
                    let distance = |ray: &Ray| {
                        along.aim(*ray);
                        tracer.trace(&surface, &mut along, &settings).distance().unwrap_or(0.0)
                    };
                    case.rays.iter().map(distance).sum::<f64>()
                });
            });
        }
        group.bench_function(BenchmarkId::from_parameter("certified"), |b| {
            let effort = Effort { bracket: 1e-6 * side, ..Effort::default() };
            let mut tracer = CertifiedTracer::new(&case.program);
            b.iter(|| case.rays.iter().map(|ray| tracer.trace(ray, &effort)).last());
        });
        group.finish();
    }
}

criterion_group!(benches, noises, executors, tracers);
criterion_main!(benches);
