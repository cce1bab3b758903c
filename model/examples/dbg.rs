use glam::{DVec2, DVec3};
use terrain_model::bounds::Region;
use terrain_model::primitive::curve::Curve;
use terrain_model::profile::{Knot};
use terrain_model::program::{Evaluator, Program};
use terrain_model::spline::Path;
use terrain_model::tree::Tree;
#[path = "../tests/common/mod.rs"]
mod common;
use common::Random;
fn program(curve: Curve) -> Program {
    let mut tree = Tree::new();
    let root = tree.push(curve);
    Program::compile(&tree, root).expect("a valid curve")
}
fn knot(distance: f64, height: f64) -> Knot {
    Knot { distance, height, slope: 0.0 }
}
fn main() {
    let mut best = 0.0; let mut where_ = String::new();
    for seed in 0..30 {
        let mut random = Random(seed);
        let (mut x, mut z) = (0.0, 80.0);
        let list: Vec<DVec3> = (0..9)
            .map(|_| {
                x += random.range(50.0, 120.0);
                z -= if random.below(4) == 0 { 0.0 } else { random.range(0.0, 6.0) };
                DVec3::new(x, random.range(-40.0, 40.0), z)
            })
            .collect();
        for (name, path) in [("smooth", Path::Smooth(list.clone())), ("quad", Path::Quadratic(list.clone())), ("poly", Path::Polyline(list.clone()))] {
            let stretches = path.stretches(0.3, 4.0).expect("a path");
            let profile = vec![knot(-30.0, 20.0), knot(-8.0, 0.0), knot(8.0, 0.0), knot(30.0, 20.0)];
            let t = std::time::Instant::now();
            let program = program(Curve { joint: 4.0, tolerance: 0.3, ..Curve::new(path, 40.0, profile) });
            let el = t.elapsed().as_secs_f64();
            let mut evaluator = Evaluator::<f64>::new(&program);
            let (mut lowest, mut rise) = (f64::INFINITY, 0.0f64);
            for (i, stretch) in stretches.iter().enumerate() {
                for k in 0..200 {
                    let x = stretch.arc.at(stretch.arc.length * f64::from(k) / 200.0).0;
                    let z = evaluator.height(&program, x).0;
                    lowest = lowest.min(z);
                    let r: f64 = z - lowest;
                    if r > rise { rise = r; if r > best { best = r; where_ = format!("{seed} {name} arc {i} k {k} of {} at {x} rise {r} {:?} {:?}", stretches.len(), stretch, stretches.get(i+1)); } }
                }
            }
            if seed < 3 {
                let (lo, hi) = program.support().unwrap();
                println!("{name} {} arcs compile {el:.3} s bound {}", stretches.len(), program.bounds(Region::rectangle(lo, hi)).support_slope);
            }
        }
    }
    println!("{where_}");
    let _ = DVec2::ZERO;
}
