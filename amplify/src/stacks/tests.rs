use super::convert::class;
use super::*;
use crate::field::{Density, DensityBounds, THRESHOLD};
use crate::geology::{Archetype, Geology, Node};
use crate::implicit::heightfield::tests::ground;
use crate::implicit::primitive::Primitive;
use crate::implicit::primitive::tests::any_primitive;
use crate::implicit::sigmoid::Sigmoid;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::volume::Volume;
use proptest::prelude::*;
use terrain_model::interval::Interval;

const PRECISION: f64 = 0.1;

fn point(at: [f32; 3], radius: f32, energy: f32) -> Primitive {
    Primitive { skeleton: Skeleton::Point(at), radius, energy }
}

/// The waves with primitives; all of the rock between -24 and 24 m is above the floor.
fn carved(primitives: Vec<Primitive>) -> Volume {
    Volume::terrain(ground(Sigmoid::UnitFree, 4.0), primitives).unwrap()
}

fn region() -> Box3 {
    Box3::new(DVec3::new(110.0, -10.0, -24.0), DVec3::new(150.0, 30.0, 24.0))
}

/// A plane at 3.3 m under a ball about (0, 0, 20) whose surface is where r² = (1 − 1/2^⅓)·R².
#[derive(Clone)]
struct Ball;

const BALL: f64 = 0.206_299_474_015_900_26;

impl Density for Ball {
    fn value(&self, p: DVec3) -> f64 {
        let ball = point([0.0, 0.0, 20.0], 10.0, 1.0).value(p);
        ball + (THRESHOLD + 0.1 * (3.3 - p.z)).clamp(0.0, 1.0)
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        (self.value(p), DVec3::ZERO)
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        let ball = point([0.0, 0.0, 20.0], 10.0, 1.0).bounds(region);
        let [below, above] = [region.low.z, region.high.z].map(|z| (THRESHOLD + 0.1 * (3.3 - z)).clamp(0.0, 1.0));
        ball.plus(&DensityBounds { range: Interval::new(above.next_down(), below.next_up()), slope: 0.1 })
    }
    fn support(&self) -> Box3 {
        Box3::new(DVec3::splat(-40.0), DVec3::splat(40.0))
    }
}

#[test]
fn a_ball_over_a_plane_has_its_transitions() {
    let region = Box3::new(DVec3::new(-12.0, -12.0, -5.0), DVec3::new(12.0, 12.0, 35.0));
    for precision in [1.0, 0.1, 0.003] {
        let (stacks, report) = Stacks::convert(&Ball, &region, 0.75, precision, None).unwrap();
        stacks.check().unwrap();
        assert_eq!(stacks.columns(), [32, 32]);
        let (mut over, mut transitions) = (0, 0);
        for j in 0..32 {
            for i in 0..32 {
                let p = stacks.position(i, j);
                let half = (BALL * 100.0 - p.length_squared()).max(0.0).sqrt();
                let layers: Vec<Layer> = stacks.layers(i, j).collect();
                let near = |layer: &Layer, z: f64| (f64::from(layer.top) - z).abs() <= precision;
                assert!(layers[0].material == Material::Rock(0) && near(&layers[0], 3.3));
                if 2.0 * half > precision {
                    let [_, air, rock] = layers.as_slice() else { panic!("{layers:?} at {p}") };
                    assert!(air.material == Material::Air && rock.material == Material::Rock(0));
                    assert!(near(air, 20.0 - half) && near(rock, 20.0 + half), "{layers:?} at {p}, {half}");
                    assert_eq!(stacks.surface_elevation(p.x, p.y), Some(rock.top));
                } else if half == 0.0 {
                    assert_eq!(layers.len(), 1);
                }
                over += usize::from(layers.len() == 3);
                transitions += layers.len() as u64;
            }
        }
        assert_eq!((stacks.overhangs(), report.transitions), (over, transitions));
        assert!(over > 80, "{over}");
        assert_eq!(stacks.layer_count(), 1024 + 2 * over);
        assert_eq!(stacks.bytes(), 5 * stacks.layer_count() + 4 * 1025);
    }
}

#[test]
fn queries_answer_inside_the_region_alone() {
    let region = Box3::new(DVec3::new(-12.0, -12.0, -5.0), DVec3::new(12.0, 12.0, 35.0));
    let (stacks, _) = Stacks::convert(&Ball, &region, 1.0, PRECISION, None).unwrap();
    assert!(stacks.is_rock(0.5, 0.5, 3.0) && stacks.is_rock(0.5, 0.5, 20.0) && stacks.is_rock(-12.0, 12.0, -5.0));
    assert_eq!(stacks.material(0.5, 0.5, 10.0), Some(Material::Air));
    assert_eq!(stacks.material(0.5, 0.5, 35.0), Some(Material::Air));
    for [x, y, z] in [[12.1, 0.0, 0.0], [0.0, -12.1, 0.0], [0.0, 0.0, -5.1], [0.0, 0.0, 35.1], [f64::NAN, 0.0, 0.0]] {
        assert_eq!(stacks.material(x, y, z), None);
        assert!(!stacks.is_rock(x, y, z));
    }
    let grid = stacks.elevations().unwrap();
    assert_eq!((grid.width(), grid.height(), grid.no_data_count()), (24, 24, 0));
    assert_eq!(grid.position(3, 5), stacks.position(3, 5));
    for (_, _, p, z) in grid.positions() {
        assert_eq!(stacks.surface_elevation(p.x, p.y), Some(z));
    }
    // Above the plane only the ball is left.
    let above = Box3 { low: region.low.with_z(10.0), ..region };
    let (stacks, _) = Stacks::convert(&Ball, &above, 1.0, PRECISION, None).unwrap();
    stacks.check().unwrap();
    let grid = stacks.elevations().unwrap();
    assert_eq!(grid.no_data_count(), stacks.starts.windows(2).filter(|ends| ends[0] == ends[1]).count());
    assert!(grid.no_data_count() > 400 && stacks.overhangs() == 0);
    assert_eq!(stacks.surface_elevation(-11.0, -11.0), None);
}

/// Any primitives, moved into the region.
fn any_carving() -> impl Strategy<Value = Vec<Primitive>> {
    let moved = (any_primitive(), prop::array::uniform3(0.0f32..1.0)).prop_map(|(mut one, [x, y, z])| {
        let by = [130.0 + 30.0 * (x - 0.5), 10.0 + 30.0 * (y - 0.5), 20.0 * (z - 0.5)];
        let shift = |p: &mut [f32; 3]| (0..3).for_each(|k| p[k] = 0.2 * p[k] + by[k]);
        let at = |p: [f32; 3]| {
            let mut p = p;
            shift(&mut p);
            p
        };
        one.skeleton = match one.skeleton {
            Skeleton::Point(p) => Skeleton::Point(at(p)),
            Skeleton::Segment(p, q) => Skeleton::Segment(at(p), at(q)),
            Skeleton::Sphere { centre, radius } => Skeleton::Sphere { centre: at(centre), radius },
            Skeleton::Cuboid { centre, half } => Skeleton::Cuboid { centre: at(centre), half },
            Skeleton::Ellipsoid { centre, half } => Skeleton::Ellipsoid { centre: at(centre), half },
            Skeleton::Cone { base, height, low, high } => Skeleton::Cone { base: at(base), height, low, high },
        };
        one
    });
    prop::collection::vec(moved, 0..30)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn materials_are_those_of_the_field_farther_than_the_precision_from_a_transition(
        primitives in any_carving(),
        spacing in 2.0f64..9.0, precision in 0.05f64..0.6,
        at in prop::collection::vec(prop::array::uniform3(0.0f64..1.0), 200),
    ) {
        let field = carved(primitives);
        let (stacks, report) = Stacks::convert(&field, &region(), spacing, precision, None).unwrap();
        prop_assert_eq!(stacks.check(), Ok(()));
        let size = region().high - region().low;
        let points: Vec<DVec3> = at.iter().map(|t| region().low + size * DVec3::from_array(*t)).collect();
        let found = stacks.compare(&field, None, points.iter().copied());
        prop_assert_eq!(found.wrong, 0);
        prop_assert_eq!(found.compared + found.skipped, 200);
        prop_assert!(found.compared > 100, "{found:?}");
        // Without enclosures: a material that the field does not have is that of a point within the precision.
        for p in points {
            let [i, j] = stacks.column_at(p.x, p.y).unwrap();
            let at = stacks.position(i, j);
            let rock = |z: f64| field.value(at.extend(z)) > THRESHOLD;
            let ours = stacks.is_rock(at.x, at.y, p.z);
            let near = |k: i32| rock(p.z + precision * f64::from(k) / 400.0) == ours;
            prop_assert!(rock(p.z) == ours || (-400..=400).any(near), "{p}, {report:?}");
        }
    }

    #[test]
    fn layers_are_those_of_a_scan_where_they_are_thicker_than_the_precision(primitives in any_carving()) {
        let field = carved(primitives);
        let (stacks, report) = Stacks::convert(&field, &region(), 8.0, PRECISION, None).unwrap();
        let rock = |at: DVec2, z: f64| field.value(at.extend(z)) > THRESHOLD;
        let mut transitions = 0;
        for (i, j) in (0..25).map(|k| (k % 5, k / 5)) {
            let at = stacks.position(i, j);
            let steps = 480 * 5;
            let z = |k: usize| -24.0 + 48.0 * k as f64 / steps as f64;
            let scan: Vec<f64> = (0..steps).filter(|&k| rock(at, z(k)) != rock(at, z(k + 1))).map(|k| z(k) + 0.01).collect();
            let tops: Vec<f64> = stacks.layers(i, j).map(|layer| f64::from(layer.top)).filter(|&z| z < 24.0).collect();
            transitions += tops.len() as u64;
            for z in &tops {
                prop_assert!(scan.iter().any(|s| (s - z).abs() < PRECISION) || report.unresolved > 0, "{z} of {scan:?}");
            }
            let alone = |k: usize| {
                let far = |other: Option<&f64>| other.is_none_or(|s| (s - scan[k]).abs() > PRECISION + 0.02);
                far(k.checked_sub(1).map(|k| &scan[k])) && far(scan.get(k + 1))
            };
            for k in (0..scan.len()).filter(|&k| alone(k)) {
                prop_assert!(tops.iter().any(|z| (scan[k] - z).abs() < PRECISION + 0.01), "{} of {tops:?}", scan[k]);
            }
        }
        prop_assert_eq!(transitions, report.transitions);
    }
}

#[test]
fn stacks_do_not_depend_on_the_number_of_threads() {
    let primitives = (0..40).map(|k| point([112.0 + k as f32, -8.0 + k as f32, (k % 9) as f32], 6.0, -0.8)).collect();
    let field = carved(primitives);
    let geology = Archetype::Folded.geology();
    let convert = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Stacks::convert(&field, &region(), 2.0, 0.5, Some((&geology, 4))).unwrap())
    };
    let (stacks, report) = convert(1);
    stacks.check().unwrap();
    assert!(report.resistances > 0 && report.resistance_enclosures == 0);
    for threads in [2, 7] {
        assert_eq!(convert(threads), (stacks.clone(), report));
    }
}

#[test]
fn rock_is_told_apart_by_resistance() {
    let field = carved(vec![point([130.0, 10.0, 0.0], 9.0, -0.9)]);
    // Of these, rock jumps in the second alone.
    for (kind, classes) in [(Archetype::Folded, 1), (Archetype::Faulted, 4), (Archetype::Folded, 10)] {
        let geology = kind.geology();
        let (stacks, report) = Stacks::convert(&field, &region(), 4.0, PRECISION, Some((&geology, classes))).unwrap();
        stacks.check().unwrap();
        let points = (0..4000u32).map(|k| {
            let t = [k % 20, k / 20 % 20, k / 400].map(|k| f64::from(k) / 20.0);
            region().low + (region().high - region().low) * DVec3::from_array(t) + 0.013
        });
        let found = stacks.compare(&field, Some(&geology), points);
        assert!(found.wrong == 0 && found.compared > 2500, "{found:?} {report:?}");
        assert_eq!(report.resistance_enclosures > 0, kind == Archetype::Faulted);
        let (plain, _) = Stacks::convert(&field, &region(), 4.0, PRECISION, None).unwrap();
        assert_eq!(plain.overhangs(), stacks.overhangs());
        assert_eq!(plain.layer_count() == stacks.layer_count(), classes == 1);
    }
    assert_eq!([0.0, 0.24, 0.25, 0.999, 1.0].map(|rho| class(rho, 4)), [0, 0, 1, 3, 3].map(Material::Rock));
}

/// The control of the comparisons above.
#[test]
fn a_moved_layer_and_a_wrong_material_are_noticed() {
    let field = carved(vec![point([130.0, 10.0, 0.0], 9.0, -0.9)]);
    let (mut stacks, _) = Stacks::convert(&field, &region(), 2.0, PRECISION, None).unwrap();
    let p = stacks.position(7, 3);
    let top = stacks.surface_elevation(p.x, p.y).unwrap();
    let points = || [0.5, -0.5].map(|by| p.extend(f64::from(top) + by));
    assert_eq!(stacks.compare(&field, None, points()), Comparison { compared: 2, skipped: 0, wrong: 0 });
    let layer = stacks.range([7, 3]).end - 1;
    stacks.tops[layer] -= 0.7;
    assert_eq!(stacks.compare(&field, None, points()), Comparison { compared: 2, skipped: 0, wrong: 1 });
    stacks.tops[layer] += 0.7;
    stacks.materials[layer] = 0;
    assert_eq!(stacks.compare(&field, None, points()).wrong, 1);
}

#[test]
fn what_is_broken_is_found() {
    let (stacks, _) = Stacks::convert(&Ball, &Ball.support(), 4.0, PRECISION, None).unwrap();
    let broken = |change: &dyn Fn(&mut Stacks)| {
        let mut stacks = stacks.clone();
        change(&mut stacks);
        stacks.check().unwrap_err()
    };
    let k = stacks.materials.iter().position(|&code| code == 0).unwrap();
    assert!(matches!(broken(&|s| s.tops[k] = s.tops[k - 1]), StacksFault::Top { layer: 1, .. }));
    assert!(matches!(broken(&|s| s.tops[0] = f32::NAN), StacksFault::Top { column: 0, layer: 0, .. }));
    assert!(matches!(broken(&|s| s.tops[0] = 41.0), StacksFault::Top { .. }));
    assert!(matches!(broken(&|s| s.materials[k] = 1), StacksFault::Material { layer: 0, .. }));
    assert!(matches!(broken(&|s| s.materials[0] = 0), StacksFault::Material { column: 0, layer: 0 }));
    assert!(matches!(broken(&|s| s.materials[0] = 2), StacksFault::Material { .. }));
    assert!(matches!(broken(&|s| s.starts[3] = 1), StacksFault::Starts { column: 3, .. }));
    assert!(matches!(broken(&|s| s.starts[0] = 1), StacksFault::Starts { column: 0, .. }));
    assert!(matches!(broken(&|s| *s.starts.last_mut().unwrap() += 1), StacksFault::Starts { .. }));
}

/// A field that claims to be air where it is rock.
#[derive(Clone)]
struct Liar;

impl Density for Liar {
    fn value(&self, p: DVec3) -> f64 {
        f64::from(p.z < 0.05)
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        (self.value(p), DVec3::ZERO)
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        let range = if region.low.z < 0.0 { Interval::UNIT } else { Interval::ZERO };
        DensityBounds { range, slope: f64::INFINITY }
    }
    fn support(&self) -> Box3 {
        Box3::new(DVec3::ZERO, DVec3::ONE)
    }
}

#[test]
fn settings_that_make_no_sense_and_fields_that_lie_are_refused() {
    let unit = Box3::new(DVec3::ZERO, DVec3::ONE);
    let flat = Box3 { high: DVec3::new(1.0, 1.0, 0.0), ..unit };
    let convert =
        |region: &Box3, spacing, precision| Stacks::convert(&Ball, region, spacing, precision, None).unwrap_err();
    for region in [flat, Box3::EMPTY, Box3 { high: DVec3::splat(f64::INFINITY), ..unit }] {
        assert!(matches!(convert(&region, 0.5, 0.1), StacksError::Region { .. }));
    }
    for spacing in [0.0, -1.0, f64::NAN, 1e-9, 1.5e-5, 3.0] {
        assert!(matches!(convert(&unit, spacing, 0.1), StacksError::Columns { .. }), "{spacing}");
    }
    for precision in [0.0, -0.1, f64::NAN, 1e-7, 1.1, f64::INFINITY] {
        assert!(matches!(convert(&unit, 0.5, precision), StacksError::Precision { .. }), "{precision}");
    }
    let geology = Geology::new(1, Node::Constant(0.5)).unwrap();
    assert_eq!(Stacks::convert(&Ball, &unit, 0.5, 0.1, Some((&geology, 0))).unwrap_err(), StacksError::Classes);
    let region = Box3::new(DVec3::new(0.0, 0.0, -1.0), DVec3::ONE);
    assert!(matches!(
        Stacks::convert(&Liar, &region, 0.5, 0.1, None).unwrap_err(),
        StacksError::Contradiction { at } if at.z == 0.0
    ));
}
