use glam::DVec2;
use std::time::Instant;
use terrain_diffusion::curve::*;
use terrain_diffusion::fields::*;
use terrain_diffusion::raster::*;
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let count: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let mut curves = vec![];
    for k in 0..count {
        let p = DVec2::new(random(), random()) * 4000.0;
        let mut control = vec![p];
        for _ in 0..3 {
            let q = *control.last().unwrap();
            control.push(q + (DVec2::new(random(), random()) - 0.5) * 800.0);
        }
        let crack = std::env::var("CRACK").is_ok() && k % 5 == 4;
        let h = random() * 800.0;
        let mut point = |place, h| ConstraintPoint {
            place,
            elevation: (!crack).then_some(Elevation { height: h, radius: 10.0 }),
            gradient: Some(Gradient {
                left: Side { extent: 150.0, angle: -0.3 },
                right: Side { extent: 100.0, angle: -0.5 },
            }),
            noise: Some(Noise { amplitude: 10.0 * random(), roughness: random() }),
        };
        let points = vec![point(0.0, h), point(1.0, h + 50.0)];
        if let Ok(c) = Curve::new(control, points) {
            curves.push(c);
        }
    }
    let domain = Domain::square(4000.0, n);
    let t = Instant::now();
    let nodes = rasterise(&curves, &domain);
    println!("raster {:.3}", t.elapsed().as_secs_f64());
    println!("raster bytes {}", nodes.bytes());
    drop(nodes);
    let solver = match std::env::args().nth(3).as_deref() {
        Some("paper") => Solver::Paper,
        _ => Solver::Multigrid,
    };
    let t = Instant::now();
    let fields = diffuse(&curves, domain, &Settings { solver, whole_gradient: true, ..Settings::default() }).unwrap();
    println!("all {:.3}", t.elapsed().as_secs_f64());
    let (a, b) = fields.elevation.iter().fold((f64::MAX, f64::MIN), |(a, b), h| (a.min(*h), b.max(*h)));
    println!("range {a} {b}");
    for r in &fields.reports {
        println!("{r:?}");
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    println!("{}", status.lines().find(|l| l.starts_with("VmHWM")).unwrap());
}
