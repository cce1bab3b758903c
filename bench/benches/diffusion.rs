//! The solvers of Hnaidi 2010: Laplace on thirty lines of given values (`bench/compare/amg.py` solves the same system with PyAMG), and every
//! field of the canyon.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use terrain_diffusion::fields::{Settings, Solver, diffuse};
use terrain_diffusion::landscapes;
use terrain_diffusion::plane::Plane;
use terrain_diffusion::raster::rasterise;
use terrain_diffusion::solver::krylov::Stop;
use terrain_diffusion::solver::laplace;

/// Thirty lines of one node's width on `n` × `n` nodes, ends by a Weyl sequence, value 10·k on the k-th.
fn lines(n: usize) -> Vec<Option<f64>> {
    let weyl = |k: usize, step: f64| (k as f64 * step).fract() * (n - 1) as f64;
    let mut given = vec![None; n * n];
    for k in 1..=30 {
        let a = [weyl(k, 0.754_877_666), weyl(k, 0.569_840_291)];
        let b = [weyl(k, 0.819_172_513), weyl(k, 0.671_043_606)];
        for step in 0..=2 * n {
            let t = step as f64 / (2 * n) as f64;
            let [i, j] = [0, 1].map(|c| (a[c] + t * (b[c] - a[c]) + 0.5).floor() as usize);
            given[j * n + i] = Some(10.0 * k as f64);
        }
    }
    given
}

fn laplace_on_lines(c: &mut Criterion) {
    let mut group = c.benchmark_group("laplace on thirty lines to 1e-8");
    group.sample_size(10);
    for n in [1025usize, 2049] {
        let given = lines(n);
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| {
                let equations = laplace::equations(n, n, |i, j| given[j * n + i].is_some());
                let mut values = Plane::<f64, 1>::new(n, n);
                values.update(|j, [row], _| (0..n).for_each(|i| row[i + 1] = given[j * n + i].unwrap_or(0.0)));
                let progress = laplace::diffuse(&equations, &mut values, Stop::default()).expect("values are given");
                assert!(progress.converged);
                values
            });
        });
    }
    group.finish();
}

fn canyon(c: &mut Criterion) {
    let landscape =
        landscapes::named("canyon").and_then(|model| model.landscape().ok()).expect("an embedded landscape");
    let domain = landscape.domain(1025);
    let mut group = c.benchmark_group("canyon at 1025 nodes a side");
    group.sample_size(10);
    group.bench_function("raster", |b| b.iter(|| rasterise(landscape.curves(), &domain)));
    for solver in Solver::ALL {
        let settings = Settings { solver, whole_gradient: true, ..Settings::default() };
        group.bench_function(solver.name(), |b| b.iter(|| diffuse(landscape.curves(), domain, &settings)));
    }
    group.finish();
}

criterion_group!(benches, laplace_on_lines, canyon);
criterion_main!(benches);
