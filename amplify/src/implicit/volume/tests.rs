use super::super::heightfield::tests::ground;
use super::super::outline::tests::island_ground;
use super::super::primitive::tests::any_primitive;
use super::super::sigmoid::Sigmoid;
use super::super::skeleton::Skeleton;
use super::super::spine::Noise;
use super::*;
use crate::geology::{Archetype, Geology};
use proptest::prelude::*;

/// Around the middle of the ground that the tests share.
fn near(at: [f64; 3]) -> DVec3 {
    DVec3::new(100.0, -20.0, -20.0) + DVec3::from_array(at) * DVec3::new(70.0, 75.0, 40.0)
}

fn point(at: DVec3, radius: f32, energy: f32) -> Primitive {
    Primitive { skeleton: Skeleton::Point(at.as_vec3().to_array()), radius, energy }
}

fn few(of: &[Primitive]) -> Volume {
    Volume::Few(of.into())
}

/// Points all over the ground, other skeletons where they are.
fn scattered() -> impl Strategy<Value = Vec<Primitive>> {
    let moved = (any_primitive(), prop::array::uniform3(0.0f64..1.0)).prop_map(|(mut one, at)| {
        if let Skeleton::Point(centre) = &mut one.skeleton {
            *centre = near(at).as_vec3().to_array();
        }
        one
    });
    prop::collection::vec(moved, 0..40)
}

fn geology() -> Arc<Geology> {
    Arc::new(Archetype::Faulted.geology())
}

/// A tree with every node.
fn any_volume() -> impl Strategy<Value = Volume> {
    let leaf = prop_oneof![
        Just(ground(Sigmoid::UnitFree, 4.0)),
        Just(island_ground(4.0)),
        scattered().prop_map(|all| Volume::Primitives(Arc::new(Index::new(all).unwrap()))),
        (prop::array::uniform3(0.0f64..1.0), 4.0f32..30.0, -1.0f32..1.5)
            .prop_map(|(at, radius, energy)| few(&[point(near(at), radius, energy)])),
        (prop::array::uniform3(0.0f64..1.0), prop::array::uniform3(0.0f64..1.0), 2.0f64..9.0, any::<bool>()).prop_map(
            |(a, b, radius, rough)| {
                let noise = Noise { amplitude: 0.4 * radius, wavelength: 6.0, octaves: 2, seed: 5, signed: true };
                let spine = Spine::new(vec![near(a), near(b)], radius, -0.9, rough.then_some(noise)).unwrap();
                Volume::Spine(Arc::new(spine))
            }
        ),
        Just(Volume::AIR),
    ];
    leaf.prop_recursive(4, 24, 4, |below| {
        let parts = prop::collection::vec(below.clone(), 1..4);
        let region = (prop::array::uniform3(0.0f64..1.0), 5.0f32..40.0)
            .prop_map(|(at, radius)| few(&[point(near(at), radius, 1.2)]));
        let spot = (-30.0f64..30.0, -3.0f64..3.0, 0.5f64..2.0);
        prop_oneof![
            parts.clone().prop_map(Volume::Blend),
            parts.clone().prop_map(Volume::Union),
            parts.prop_map(Volume::Intersection),
            (below.clone(), below.clone()).prop_map(|(a, b)| a.carve(b)),
            (below.clone(), region.clone(), 0.1f64..8.0, 3.0f64..40.0).prop_map(|(child, region, amplitude, wave)| {
                Volume::Warp(Arc::new(Warp::new(child, region, amplitude, wave, 2, 3).unwrap()))
            }),
            (below.clone(), region).prop_map(|(child, region)| {
                Volume::Erosion(Arc::new(Erosion { child, region, geology: geology() }))
            }),
            (below, spot).prop_map(|(child, (shift, angle, scale))| {
                let placement = Placement::new(DVec3::new(130.0 + shift, shift, 1.0), angle, scale).unwrap();
                Volume::Instance(Arc::new(Instance { child, placement }))
            }),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn every_tree_is_within_its_bounds_and_what_is_left_of_it_has_its_values(
        volume in any_volume(),
        corner in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..1.0,
        points in prop::collection::vec(prop::array::uniform3(0.0f64..1.0), 12),
    ) {
        let low = near(corner);
        let region = Box3::new(low, low + 0.01 + 25.0 * size * size);
        let (bounds, rest) = volume.narrow(&region);
        prop_assert_eq!(volume.bounds(&region), bounds);
        let inner = Box3::new(low, low.lerp(region.high, 0.4));
        let (nested, left) = rest.narrow(&inner);
        let enclosed = volume.density(region.intervals());
        let points: Vec<DVec3> = points
            .iter()
            .map(|t| (region.low + (region.high - region.low) * DVec3::from_array(*t)).clamp(region.low, region.high))
            .collect();
        let values: Vec<f64> = points.iter().map(|&p| volume.value(p)).collect();
        prop_assert_eq!(&volume.values(&points), &values);
        for (k, (&p, &f)) in points.iter().zip(&values).enumerate() {
            prop_assert!(bounds.range.contains(f), "{f} in {bounds:?}");
            prop_assert!(enclosed.contains(f), "{f} in {enclosed:?}");
            prop_assert_eq!(rest.value(p), f);
            if inner.contains(p) {
                prop_assert_eq!(left.value(p), f);
                prop_assert!(nested.range.contains(f));
            }
            let (sampled, gradient) = volume.sample(p);
            prop_assert!((sampled - f).abs() <= 1e-12 * (1.0 + f.abs()), "{sampled} {f}");
            prop_assert!(gradient.length() <= bounds.slope * (1.0 + 1e-9) + 1e-9, "{gradient} {bounds:?}");
            let (q, g) = (points[k / 2], values[k / 2]);
            prop_assert!((f - g).abs() <= bounds.slope * p.distance(q) + 1e-12, "{bounds:?}");
            prop_assert!(volume.support().contains(p) || f <= 0.0, "{f} at {p}");
        }
    }

    #[test]
    fn blocks_are_filled_with_the_values(
        volume in any_volume(), corner in prop::array::uniform3(0.0f64..1.0), step in 0.1f64..2.0,
    ) {
        let low = near(corner);
        let axis = |k: usize, n: usize| (0..n).map(|j| low[k] + step * j as f64).collect::<Vec<f64>>();
        let axes = [axis(0, 5), axis(1, 4), axis(2, 3)];
        let [xs, ys, zs] = [&axes[0][..], &axes[1][..], &axes[2][..]];
        let high = DVec3::new(xs[4], ys[3], zs[2]);
        let (_, rest) = volume.narrow(&Box3 { low, high });
        for field in [&volume, &rest] {
            let mut out = vec![f64::NAN; 60];
            field.fill([xs, ys, zs], &mut out);
            for (k, f) in out.iter().enumerate() {
                let p = DVec3::new(xs[k % 5], ys[k / 5 % 4], zs[k / 20]);
                prop_assert_eq!(*f, volume.value(p));
            }
        }
    }
}

/// Claims P9: with minimum for union, two balls apart are nothing.
#[test]
fn union_is_the_largest_and_intersection_the_smallest() {
    let [a, b] = [-10.0, 10.0].map(|x| few(&[point(DVec3::X * x, 5.0, 0.9)]));
    let at = DVec3::X * 10.0;
    let union = Volume::Union(vec![a.clone(), b.clone()]);
    assert!((union.value(at) - 0.9).abs() < 1e-7);
    assert_eq!(Volume::Intersection(vec![a.clone(), b.clone()]).value(at), 0.0);
    // Where only one of them is, the other goes.
    let (_, rest) = union.narrow(&Box3::around(at, 2.0));
    assert!(matches!(rest, Volume::Few(one) if one.len() == 1));
    let both = few(&[point(DVec3::X * -10.0, 5.0, 0.9)]).carve(a);
    assert!((both.value(DVec3::X * -10.0) - 0.1).abs() < 1e-7);
}

/// Claims P2: with a resistance of 1.8, erosion adds rock. Ours stays in [0, 1], so it never does.
#[test]
fn erosion_takes_rock_away_by_weakness_alone() {
    let child = few(&[point(DVec3::ZERO, 40.0, 1.0)]);
    let region = few(&[point(DVec3::ZERO, 30.0, 1.0)]);
    let erosion = |value: f64| {
        let geology = Geology::new(1, crate::geology::Node::Constant(value)).unwrap();
        Volume::Erosion(Arc::new(Erosion { child: child.clone(), region: region.clone(), geology: Arc::new(geology) }))
    };
    let p = DVec3::new(3.0, 2.0, 1.0);
    assert_eq!(erosion(1.0).value(p), child.value(p));
    assert!((erosion(0.0).value(p) - (child.value(p) - region.value(p))).abs() < 1e-15);
    assert_eq!(erosion(0.0).value(DVec3::X * 35.0), child.value(DVec3::X * 35.0));
}

/// Claims P5: a displacement steeper than space folds it.
#[test]
fn a_warp_says_whether_it_may_fold() {
    let warp =
        |amplitude: f64| Warp::new(Volume::AIR, few(&[point(DVec3::ZERO, 50.0, 1.0)]), amplitude, 10.0, 1, 1).unwrap();
    assert!(warp(8.0).folds() && !warp(0.2).folds());
    assert!(Warp::new(Volume::AIR, Volume::AIR, f64::NAN, 1.0, 1, 1).is_err());
}

#[test]
fn a_scaled_copy_is_turned_and_stands_where_it_was_put() {
    let one = few(&[point(DVec3::X * 3.0, 2.0, 1.0)]);
    let placement = Placement::new(DVec3::new(100.0, 50.0, 7.0), std::f64::consts::FRAC_PI_2, 2.0).unwrap();
    let copy = Volume::Instance(Arc::new(Instance { child: one, placement }));
    assert!((copy.value(DVec3::new(100.0, 56.0, 7.0)) - 1.0).abs() < 1e-12);
    assert!(copy.value(DVec3::new(100.0, 59.9, 7.0)) > 0.0 && copy.value(DVec3::new(100.0, 60.1, 7.0)) == 0.0);
    assert!(Placement::new(DVec3::ZERO, 0.0, 0.0).is_none());
}

/// The control of the property: a bound that forgets the displacement is left by the values.
#[test]
fn a_warp_without_its_reach_would_leave_the_bounds() {
    let child = few(&[point(DVec3::ZERO, 5.0, 1.0)]);
    let warp = Warp::new(child.clone(), few(&[point(DVec3::ZERO, 60.0, 1.0)]), 6.0, 15.0, 1, 4).unwrap();
    let warped = Volume::Warp(Arc::new(warp));
    let outside = (0..20_000u32).any(|k| {
        let at = [k % 27, k / 27 % 27, k / 729].map(|c| f64::from(c) - 13.0);
        let region = Box3::around(DVec3::from_array(at), 0.1);
        !child.bounds(&region).range.contains(warped.value(DVec3::from_array(at)))
    });
    assert!(outside);
}
