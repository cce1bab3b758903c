use super::check::Census;
use super::*;
use crate::field::{Box3, DensityBounds};
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::volume::Volume;
use terrain_model::interval::Interval;
use terrain_model::noise::hash;

fn blobs(of: &[([f32; 3], f32, f32)]) -> Volume {
    let primitive = |&(at, radius, energy): &_| Primitive { skeleton: Skeleton::Point(at), radius, energy };
    Volume::terrain(Volume::AIR, of.iter().map(primitive).collect()).unwrap()
}

fn ball() -> Volume {
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
    assert!(few.corner_evaluations < all.corner_evaluations, "{few:?} {all:?}");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| polygonizer.sparse()).unwrap(), (mesh, few));
}

/// Random values at points, trilinear between: every configuration of a cube, and every ambiguous face.
#[derive(Clone)]
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
fn ground_with_primitives_is_the_same_mesh_whole_sparse_and_mended() {
    use crate::implicit::heightfield::tests::ground;
    use crate::implicit::sigmoid::Sigmoid;
    let random = |k: u32| hash::mix(5, k) as f32 / 4_294_967_296.0;
    let primitive = |k: u32| Primitive {
        skeleton: Skeleton::Point([
            105.0 + 25.0 * random(5 * k),
            -15.0 + 25.0 * random(5 * k + 1),
            12.0 * random(5 * k + 2) - 6.0,
        ]),
        radius: 2.0 + 3.0 * random(5 * k + 3),
        energy: if random(5 * k + 4) < 0.3 { 0.7 } else { -0.8 },
    };
    let all: Vec<Primitive> = (0..60).map(primitive).collect();
    let of = |few: &[Primitive]| Volume::terrain(ground(Sigmoid::UnitFree, 3.0), few.to_vec()).unwrap();
    let (before, after) = (of(&all[..59]), of(&all));
    let lattice = Lattice::over(&after.support(), 1.0).unwrap();
    let [old, new] = [&before, &after].map(|field| Polygonizer::new(field, lattice, 1e-2).unwrap());
    let (whole, all_of_it) = new.standard().unwrap();
    let (sparse, few) = new.sparse().unwrap();
    assert_eq!(whole, sparse);
    assert!(few.lookups > 0 && few.evaluations() * 5 < all_of_it.evaluations() * 4, "{few:?} {all_of_it:?}");
    let mut pieces = old.pieces();
    assert_ne!(pieces.mesh().unwrap(), sparse);
    let before = pieces.report();
    new.mend(&mut pieces, &all[59].support());
    assert_eq!(pieces.mesh().unwrap(), sparse);
    let cost = pieces.report().cells - before.cells;
    assert!(cost * 2 < before.cells, "{cost} of {} cubes", before.cells);
    // The control: an edit outside the box that was named is not seen.
    let mut pieces = old.pieces();
    new.mend(&mut pieces, &Box3::around(DVec3::new(160.0, 48.0, 0.0), 1.0));
    assert_ne!(pieces.mesh().ok(), Some(sparse));
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

#[test]
fn bare_ground_within_the_walls_costs_look_ups_alone() {
    use crate::implicit::heightfield::{Implicitisation, tests::waves};
    use crate::implicit::surface::Distance;
    let grid = waves();
    let lattice = Lattice::new(DVec3::new(110.0, -10.0, -16.0), 1.0, [40, 40, 30]).unwrap();
    let cost = |volume: &Volume| Polygonizer::new(volume, lattice, 0.01).unwrap().sparse().unwrap().1;
    for distance in [Distance::Vertical, Distance::Normalised] {
        let settings = Implicitisation { distance, ..Implicitisation::of(&grid, 4.0) };
        let ground = settings.volume(&grid).unwrap();
        let report = cost(&ground);
        assert_eq!(report.evaluations(), 0, "{distance:?} {report:?}");
        assert!(report.lookups > 0);
        // The lattice cuts through rock: walls and floor are those of the whole too, to the bit.
        let mesher = Polygonizer::new(&ground, lattice, 0.01).unwrap();
        assert_eq!(mesher.sparse().unwrap().0, mesher.standard().unwrap().0);
        // Control: what stands on it is no look-up.
        let on = Primitive { skeleton: Skeleton::Point([130.0, 10.0, 0.0]), radius: 6.0, energy: 1.0 };
        assert!(cost(&Volume::Blend(vec![ground, Volume::Few([on].into())])).evaluations() > 100);
    }
}
