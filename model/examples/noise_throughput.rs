//! Prints how many noise evaluations a second one thread makes, per number type.

use std::hint::black_box;
use std::time::Instant;
use terrain_model::lanes::Lanes;
use terrain_model::noise::{Lattice, NoiseJet, NoiseValue, Octaves, fbm, ridged};

const COUNT: usize = 1 << 22;

/// A closure given to `dispatch` as it is goes through `FnOnce::call_once`, which is not inlined, and loses the wide
/// instructions. Called through `Fn` it keeps them.
struct Task<F>(F);

impl<T, F: Fn() -> T> pulp::NullaryFnOnce for Task<F> {
    type Output = T;
    #[inline(always)]
    fn call(self) -> T {
        (self.0)()
    }
}

fn report(name: &str, evaluations: usize, run: impl Fn() -> f64) {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        black_box(run());
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{name:28} {:8.1} M/s", evaluations as f64 / best * 1e-6);
}

macro_rules! scalar {
    ($number:ty, $name:expr) => {
        let plane = Lattice { seed: 1, base: [0, 0] };
        let space = Lattice { seed: 1, base: [0, 0, 0] };
        let step = 0.137 as $number;
        report(concat!($name, " gradient2"), COUNT, || {
            (0..COUNT).map(|i| f64::from(<$number>::gradient2(plane, [i as $number * step, 0.3]))).sum()
        });
        report(concat!($name, " gradient2 jet"), COUNT, || {
            (0..COUNT).map(|i| f64::from(<$number>::gradient2_jet(plane, [i as $number * step, 0.3])[1])).sum()
        });
        report(concat!($name, " gradient3"), COUNT, || {
            (0..COUNT).map(|i| f64::from(<$number>::gradient3(space, [i as $number * step, 0.3, 0.7]))).sum()
        });
        report(concat!($name, " simplex3"), COUNT, || {
            (0..COUNT).map(|i| f64::from(<$number>::simplex3(space, [i as $number * step, 0.3, 0.7]))).sum()
        });
    };
}

fn lanes<const N: usize>() {
    let arch = pulp::Arch::new();
    let plane = Lattice { seed: 1, base: [0, 0] };
    let space = Lattice { seed: 1, base: [0, 0, 0] };
    let mut start = [0.0f32; N];
    for (i, x) in start.iter_mut().enumerate() {
        *x = i as f32 * 0.137;
    }
    macro_rules! run {
        ($name:expr, |$x:ident| $value:expr) => {
            report(&format!("Lanes<{N}> {}", $name), COUNT * 4, || {
                arch.dispatch(Task(
                    #[inline(always)]
                    || {
                        let mut sum = Lanes::splat(0.0);
                        let mut $x = Lanes(start);
                        for _ in 0..COUNT * 4 / N {
                            sum = sum + $value;
                            $x = $x + Lanes::splat(0.0137);
                        }
                        sum.0.iter().map(|&v| f64::from(v)).sum()
                    },
                ))
            })
        };
    }
    let (y, z) = (Lanes::splat(0.3), Lanes::splat(0.7));
    run!("gradient2", |x| Lanes::gradient2(plane, [x, y]));
    run!("gradient2 jet", |x| Lanes::gradient2_jet(plane, [x, y])[1]);
    let octaves = Octaves { octaves: 6, frequency: 0.5, lacunarity: 2.0, gain: 0.5, amplitude: 1.0 };
    let placed = octaves.place(1, [0.0, 0.0]);
    run!("6 octaves, sum", |x| fbm(&placed, [x, y]));
    run!("6 octaves, ridged", |x| ridged(&placed, 1.0, 2.0, [x, y]));
    run!("gradient3", |x| Lanes::gradient3(space, [x, y, z]));
    run!("gradient3 jet", |x| Lanes::gradient3_jet(space, [x, y, z])[1]);
    run!("simplex3", |x| Lanes::simplex3(space, [x, y, z]));
    run!("simplex3 jet", |x| Lanes::simplex3_jet(space, [x, y, z])[1]);
}

fn main() {
    scalar!(f64, "f64");
    scalar!(f32, "f32");
    lanes::<8>();
    lanes::<16>();
    lanes::<32>();
}
