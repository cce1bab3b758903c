use super::check::Census;
use super::*;
use crate::field::{Box3, DensityBounds};
use crate::implicit::index::Index;
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::terrain::Terrain;
use terrain_model::interval::Interval;
use terrain_model::noise::hash;

fn blobs(of: &[([f32; 3], f32, f32)]) -> Terrain {
    let primitive = |&(at, radius, energy): &_| Primitive { skeleton: Skeleton::Point(at), radius, energy };
    Terrain { base: None, primitives: Index::new(of.iter().map(primitive).collect()).unwrap() }
}

fn ball() -> Terrain {
    blobs(&[([0.0; 3], 10.0, 1.0)])
}

fn sound(field: &impl Density, lattice: Lattice, tolerance: f64) -> (Mesh, Report) {
    let polygonizer = Polygonizer::new(field, lattice, tolerance).unwrap();
    let (mesh, report) = polygonizer.sparse().unwrap();
    assert!(Census::of(&mesh).is_closed(), "{:?}", Census::of(&mesh));
    assert_eq!(polygonizer.unproved_vertices(&mesh), 0);
    mesh.check().unwrap();
    (mesh, report)
}

#[test]
fn a_ball_is_closed_has_its_volume_and_its_normals() {
    let field = ball();
    let (mesh, _) = sound(&field, Lattice::over(&field.support(), 0.5).unwrap(), 1e-6);
    // g = 1/2 at this distance.
    let radius = 10.0 * (1.0 - 0.5f64.cbrt_by_newton()).sqrt();
    let volume: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|k| DVec3::from(mesh.positions[k as usize]));
            a.cross(b).dot(c) / 6.0
        })
        .sum();
    let exact = 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius;
    assert!((volume / exact - 1.0).abs() < 0.01, "{volume} of {exact}");
    for (p, n) in mesh.positions.iter().zip(mesh.normals.as_ref().unwrap()) {
        let p = DVec3::from(*p);
        assert!((p.length() - radius).abs() < 1e-6 && p.normalize().dot(DVec3::from(*n)) > 0.999_999);
    }
}

trait CubeRoot {
    fn cbrt_by_newton(self) -> f64;
}
impl CubeRoot for f64 {
    fn cbrt_by_newton(self) -> f64 {
        (0..60).fold(1.0, |x: f64, _| x - (x * x * x - self) / (3.0 * x * x))
    }
}

#[test]
fn sparse_and_standard_meshes_are_the_same_to_the_bit() {
    let field = blobs(&[([0.0; 3], 9.0, 1.0), ([7.0, 2.0, 1.0], 6.0, 0.9), ([3.0, -3.0, 4.0], 5.0, -0.8)]);
    let lattice = Lattice::over(&field.support(), 0.6).unwrap();
    let polygonizer = Polygonizer::new(&field, lattice, 1e-4).unwrap();
    let (whole, all) = polygonizer.standard().unwrap();
    let (mesh, few) = polygonizer.sparse().unwrap();
    assert_eq!(whole, mesh);
    assert_eq!(all.root_evaluations, few.root_evaluations);
    assert!(few.corner_evaluations * 2 < all.corner_evaluations, "{few:?} {all:?}");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| polygonizer.sparse()).unwrap(), (mesh, few));
}

/// Random values at points, trilinear between: every configuration of a cube, and every ambiguous face.
struct Noise;

impl Noise {
    fn at(p: DVec3) -> f64 {
        let low = p.floor();
        let t = p - low;
        (0..8u32).fold(0.0, |sum, c| {
            let bits = [c & 1, c >> 1 & 1, c >> 2];
            let weight = (0..3).fold(1.0, |w, k| w * if bits[k] == 1 { t[k] } else { 1.0 - t[k] });
            let key = (0..3).fold(7, |key, k| hash::mix(key, (low[k] as i32 as u32).wrapping_add(bits[k])));
            sum + weight * f64::from(key) / 4_294_967_296.0
        })
    }
}

impl Density for Noise {
    fn value(&self, p: DVec3) -> f64 {
        Noise::at(p)
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        (Noise::at(p), DVec3::ZERO)
    }
    fn bounds(&self, _: &Box3) -> DensityBounds {
        DensityBounds { range: Interval::new(0.0, 1.0), slope: 2.0 }
    }
    fn support(&self) -> Box3 {
        Box3::new(DVec3::ZERO, DVec3::splat(24.0))
    }
}

#[test]
fn noise_with_every_ambiguous_face_and_rock_at_the_border_is_closed_and_manifold() {
    let lattice = Lattice::new(DVec3::ZERO, 1.0, [23, 21, 19]).unwrap();
    let (mesh, _) = sound(&Noise, lattice, 1e-3);
    assert!(mesh.triangles.len() > 10_000);
    let mut seen = [false; 256];
    for k in 0..22 * 20 * 18u32 {
        let at = [k % 22, k / 22 % 20, k / 440].map(f64::from);
        let rock = (0..8u32).fold(0, |all, c| {
            let corner = DVec3::from_array(at) + DVec3::new((c & 1).into(), (c >> 1 & 1).into(), (c >> 2).into());
            all | usize::from(Noise::at(corner) > THRESHOLD) << c
        });
        seen[rock] = true;
    }
    assert!(seen.iter().all(|s| *s), "a configuration does not occur");
}

#[test]
fn a_mesh_of_another_field_is_not_proved() {
    let field = ball();
    let lattice = Lattice::over(&field.support(), 1.0).unwrap();
    let (mut mesh, _) = Polygonizer::new(&field, lattice, 1e-4).unwrap().sparse().unwrap();
    mesh.positions[3][0] += 1e-2;
    assert_eq!(Polygonizer::new(&field, lattice, 1e-4).unwrap().unproved_vertices(&mesh), 1);
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    assert!(Lattice::new(DVec3::ZERO, 1.0, [0, 4, 4]).is_err() && Lattice::new(DVec3::ZERO, 0.0, [4; 3]).is_err());
    let lattice = Lattice::new(DVec3::ZERO, 1.0, [4; 3]).unwrap();
    assert!(Polygonizer::new(&ball(), lattice, 0.0).is_err() && Polygonizer::new(&ball(), lattice, f64::NAN).is_err());
}
