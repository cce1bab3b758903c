use glam::DVec3;
use terrain_model::bounds::Region;
use terrain_model::primitive::curve::Curve;
use terrain_model::profile::Knot;
use terrain_model::program::Program;
use terrain_model::spline::Path;
use terrain_model::tree::Tree;
fn program(curve: Curve) -> Program {
    let mut tree = Tree::new();
    let root = tree.push(curve);
    Program::compile(&tree, root).expect("a valid curve")
}
fn knot(distance: f64, height: f64) -> Knot {
    Knot { distance, height, slope: 0.0 }
}
fn points(list: &[(f64, f64, f64)]) -> Vec<DVec3> {
    list.iter().map(|p| DVec3::new(p.0, p.1, p.2)).collect()
}
fn main() {
    let meander = points(&[
        (0., 0., 60.),
        (60., 50., 55.),
        (120., -50., 50.),
        (180., 60., 44.),
        (200., -40., 40.),
        (300., 0., 33.),
    ]);
    let hairpin = points(&[(0., 0., 30.), (100., 0., 25.), (100., 30., 20.), (0., 30., 15.)]);
    for (name, path, radius) in [
        ("straight", Path::Polyline(points(&[(0., 0., 30.), (200., 0., 10.)])), 60.0),
        ("corner", Path::Polyline(points(&[(0., 0., 30.), (100., 0., 20.), (150., 80., 10.)])), 60.0),
        ("hairpin", Path::Smooth(hairpin), 40.0),
        ("meander", Path::Smooth(meander), 60.0),
    ] {
        let profile = vec![knot(-40.0, 20.0), knot(-8.0, 0.0), knot(8.0, 0.0), knot(40.0, 20.0)];
        let t = std::time::Instant::now();
        let curve = Curve::new(path, radius, profile);
        let n = curve.path.stretches(curve.tolerance, curve.joint).unwrap().len();
        let program = program(curve);
        let el = t.elapsed().as_secs_f64();
        let (lo, hi) = program.support().unwrap();
        println!("{name} {n} arcs compile {el:.3} s bound {}", program.bounds(Region::rectangle(lo, hi)).support_slope);
    }
}
