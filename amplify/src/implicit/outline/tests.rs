use super::super::heightfield::{HeightfieldError, Implicitisation, tests::waves};
use super::super::primitive::Primitive;
use super::super::prism::Prism;
use super::super::sigmoid::Sigmoid;
use super::super::skeleton::Skeleton;
use super::super::surface::Distance;
use super::super::volume::{Volume, VolumeNumber};
use super::*;
use crate::field::{Box3, Density, THRESHOLD};
use crate::polygonize::{Lattice, Polygonizer, check::Census};
use glam::DVec3;
use proptest::prelude::*;
use terrain_model::dual::Dual;

fn ring(corners: &[[f64; 2]]) -> Vec<DVec2> {
    corners.iter().map(|&p| DVec2::from_array(p)).collect()
}
fn square(low: f64, high: f64) -> Vec<DVec2> {
    ring(&[[low, low], [high, low], [high, high], [low, high]])
}
/// One reflex corner, at (8, 8).
fn l_shape() -> Vec<DVec2> {
    ring(&[[0.0, 0.0], [20.0, 0.0], [20.0, 8.0], [8.0, 8.0], [8.0, 20.0], [0.0, 20.0]])
}
/// Two squares of 20 joined by a neck of a width.
fn dumbbell(width: f64) -> Vec<DVec2> {
    let w = 0.5 * width;
    let right = [[5.0, -10.0], [25.0, -10.0], [25.0, 10.0], [5.0, 10.0], [5.0, w]];
    let left = [[-5.0, w], [-5.0, 10.0], [-25.0, 10.0], [-25.0, -10.0], [-5.0, -10.0], [-5.0, -w]];
    ring(&[&[[5.0, -w]], &right[..], &left[..]].concat())
}

/// Stars with spikes, some with a hole, and tangles that cross themselves.
fn any_rings() -> impl Strategy<Value = Vec<Vec<DVec2>>> {
    let star = prop::collection::vec(6.0f64..30.0, 3..14).prop_map(|radii| {
        let n = radii.len() as f64;
        let corner = |(k, r): (usize, &f64)| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / n);
            DVec2::new(cos, sin) * *r
        };
        vec![radii.iter().enumerate().map(corner).collect::<Vec<_>>()]
    });
    let hole = (star.clone(), -8.0f64..4.0, 0.5f64..6.0).prop_map(|(mut rings, low, side)| {
        rings.push(square(low, low + side));
        rings
    });
    let corner = prop::array::uniform2(-25.0f64..25.0).prop_map(DVec2::from_array);
    let tangle = prop::collection::vec(corner, 3..9).prop_map(|corners| vec![corners]);
    // Corners on a lattice: necks of exactly 2R, touching rings, edges one on another.
    let even = prop::collection::vec(prop::array::uniform2(-5i32..=5), 4..9)
        .prop_map(|corners| vec![corners.iter().map(|p| DVec2::new(p[0].into(), p[1].into()) * 4.0).collect()]);
    prop_oneof![star, hole, tangle, even]
}
fn any_outline() -> impl Strategy<Value = (Vec<Vec<DVec2>>, Outline)> {
    (any_rings(), prop_oneof![Just(2.0), 0.8f64..5.0]).prop_filter_map("too thin", |(rings, radius)| {
        Outline::eroded(&rings, radius).ok().map(|outline| (rings, outline))
    })
}
fn place() -> impl Strategy<Value = DVec2> {
    prop::array::uniform2(-36.0f64..36.0).prop_map(DVec2::from_array)
}

/// The distance to the nearest edge, and the even-odd rule, from the rings themselves.
fn to_edges(rings: &[Vec<DVec2>], p: DVec2) -> (f64, bool) {
    let (mut least, mut odd) = (f64::INFINITY, false);
    for ring in rings {
        for (k, &a) in ring.iter().enumerate() {
            let b = ring[(k + 1) % ring.len()];
            let axis = b - a;
            let t = if a == b { 0.0 } else { ((p - a).dot(axis) / axis.dot(axis)).clamp(0.0, 1.0) };
            least = least.min(p.distance(a + t * axis));
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            odd ^= low.y <= p.y && p.y < high.y && (high - low).perp_dot(p - low) > 0.0;
        }
    }
    (least, odd)
}
/// The definition, without the tree.
fn brute(outline: &Outline, pieces: &[Piece], p: DVec2) -> f64 {
    let Outline { edges, radius, .. } = outline;
    if edges.holds(p) && edges.all.iter().all(|edge| edge.offset(p).length() >= *radius) {
        return 0.0;
    }
    nearest(pieces.iter(), p, *radius).length().min(*radius)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_tree_gives_the_distance_of_the_definition_to_the_bit(
        (_, outline) in any_outline(), points in prop::collection::vec(place(), 60),
    ) {
        for p in points {
            prop_assert_eq!(outline.distance(p), brute(&outline, &outline.pieces, p), "{}", p);
            let jet = outline.jet(p);
            prop_assert_eq!(jet[0], outline.distance(p));
        }
    }

    /// Upward: the nearest point is one of Ω ⊖ B(R). Downward: no point of it that is tried is nearer.
    #[test]
    fn distances_are_those_to_points_that_are_a_radius_from_every_edge(
        (rings, outline) in any_outline(), p in place(), others in prop::collection::vec(place(), 60), share in 0.0f64..1.0,
    ) {
        let radius = outline.radius();
        let on = |p: DVec2, slack: f64| { let (least, odd) = to_edges(&rings, p); odd && least >= radius - slack };
        let [d, dx, dy] = outline.jet(p);
        prop_assert!(d == 0.0 || !on(p, -1e-9));
        if d < radius {
            let q = p - d * DVec2::new(dx, dy);
            prop_assert!(on(q, 1e-9), "{q} is {:?} from the edges", to_edges(&rings, q));
        }
        // All over the plane, and near p.
        for other in others {
            for q in [other, p + (other - p) * (share * radius / 36.0)] {
                if on(q, 0.0) {
                    prop_assert!(d <= p.distance(q) + 1e-12, "{d} to {q}");
                }
            }
        }
    }

    #[test]
    fn rectangles_of_the_plane_enclose_their_distances(
        (_, outline) in any_outline(), a in place(), b in place(), size in 0.0f64..1.0, u in place(), v in place(),
    ) {
        let b = a.lerp(b, size * size * size);
        let (low, high) = (a.min(b), a.max(b));
        let inside = |t: DVec2| (low + (high - low) * (t / 72.0 + 0.5)).clamp(low, high);
        let (p, q) = (inside(u), inside(v));
        let sides = [Interval::new(low.x, high.x), Interval::new(low.y, high.y)];
        let range = outline.enclose(sides);
        let [d, e] = [p, q].map(|p| outline.distance(p));
        prop_assert!(range.contains(d) && range.contains(e), "{d} {e} in {range:?}");
        prop_assert!((d - e).abs() <= p.distance(q) + 1e-12, "{d} {e} over {}", p.distance(q));
        if let Some(same) = outline.constant(sides) {
            prop_assert!(d == same && e == same);
        }
        let dual = |x: Interval, k: usize| Dual::<Interval, 2>::variable(x, k);
        let slope = Dual::outline_distance(&outline, [dual(sides[0], 0), dual(sides[1], 1)]).slope;
        let jet = outline.jet(p);
        prop_assert!(slope[0].contains(jet[1]) && slope[1].contains(jet[2]));
        let [low, high] = outline.extent();
        let off = (low - p).max(p - high).max(DVec2::ZERO).length();
        prop_assert!(off <= outline.radius() || d == outline.radius());
    }

    #[test]
    fn slopes_are_those_of_the_distance((_, outline) in any_outline(), p in place()) {
        let e = 1e-6;
        let [d, dx, dy] = outline.jet(p);
        let along = |axis: DVec2| [p + axis * e, p - axis * e].map(|p| outline.distance(p));
        for (axis, slope) in [(DVec2::X, dx), (DVec2::Y, dy)] {
            let [after, before] = along(axis);
            // Where the distance bends, the two differences do not agree.
            let (right, left) = ((after - d) / e, (d - before) / e);
            prop_assert!((right - left).abs() > 1e-4 || (right - slope).abs() < 2e-4, "{right} {left} {slope}");
        }
    }
}

#[test]
fn a_square_polygon_is_the_rectangle() {
    let (low, high) = (DVec2::new(100.0, -20.0), DVec2::new(164.0, 52.0));
    let rings = [ring(&[[100.0, -20.0], [100.0, 52.0], [164.0, 52.0], [164.0, -20.0]])];
    let rectangle = Volume::Prism(Prism::new(low, high, -30.0, 4.0).unwrap().into());
    let polygon = Volume::Prism(Prism::over(&rings, -30.0, 4.0).unwrap().into());
    let mut between = 0;
    for k in 0..40 * 40 * 9 {
        let t = [k % 40, k / 40 % 40, k / 1600].map(f64::from);
        let p = DVec3::new(97.0 + t[0] * 1.8, -23.0 + t[1] * 2.0, -36.0 + t[2]);
        let (f, g) = (rectangle.value(p), polygon.value(p));
        between += u32::from(f > 0.0 && f < 2.0 * THRESHOLD);
        assert!((f - g).abs() < 1e-9, "{f} {g} at {p}");
        let [f, g] = [&rectangle, &polygon].map(|f| f.sample(p).1);
        assert!(f.distance(g) < 1e-8, "{f} {g} at {p}");
    }
    assert!(between > 1000);
    let [f, g] = [&rectangle, &polygon].map(|f| f.support());
    assert!(f.low.distance(g.low) < 1e-8 && f.high.truncate().distance(g.high.truncate()) < 1e-8);
}

#[test]
fn a_reflex_corner_is_rounded_and_a_convex_one_is_sharp() {
    let outline = Outline::eroded(&[l_shape()], 3.0).unwrap();
    let diagonal = DVec2::splat(std::f64::consts::FRAC_1_SQRT_2);
    for k in 0..=30 {
        let away = 0.1 * f64::from(k);
        let [d, dx, dy] = outline.jet(DVec2::splat(8.0) - diagonal * away);
        assert!((d - (3.0 - away)).abs() < 1e-12, "{d} at {away}");
        assert!(k == 0 || k == 30 || diagonal.distance(DVec2::new(dx, dy)) < 1e-12);
    }
    assert_eq!(outline.distance(DVec2::splat(8.0) - diagonal * 3.001), 0.0);
    // To (3, 3).
    assert!((outline.distance(DVec2::new(2.0, 1.5)) - 3.25f64.sqrt()).abs() < 1e-9);
    // The control: without its arcs the border is farther.
    let lines: Vec<Piece> = outline.pieces.iter().copied().filter(|piece| matches!(piece, Piece::Line(_))).collect();
    assert_eq!(outline.pieces.len() - lines.len(), 2);
    let p = DVec2::splat(8.0) - diagonal * 2.0;
    assert!((brute(&outline, &lines, p) - outline.distance(p)).abs() > 0.1);
}

#[test]
fn distances_agree_with_a_dense_sample_of_the_erosion() {
    let step = 0.1;
    for (rings, radius) in [
        (vec![l_shape()], 2.5),
        (vec![square(-2.0, 22.0), square(8.0, 11.0)], 3.0),
        (vec![ring(&[[0.0, 0.0], [22.0, 3.0], [12.0, 9.0], [19.0, 21.0], [1.0, 17.0], [6.0, 10.0]])], 2.0),
    ] {
        let outline = Outline::eroded(&rings, radius).unwrap();
        let lattice =
            |n: i32, step: f64| (0..n * n).map(move |k| DVec2::new((k % n).into(), (k / n).into()) * step - 3.0);
        let on = |p: &DVec2| {
            let (least, odd) = to_edges(&rings, *p);
            odd && least >= radius
        };
        let sample: Vec<DVec2> = lattice(280, step).filter(on).collect();
        for p in lattice(45, 0.62) {
            let nearest = sample.iter().fold(f64::INFINITY, |d, q| d.min(p.distance(*q))).min(radius);
            let d = outline.distance(p);
            // Ten degrees of a corner hold a lattice point within three steps.
            assert!(d <= nearest + 1e-12 && nearest <= d + 3.0 * step, "{d} {nearest} at {p}");
        }
    }
}

#[test]
fn a_hole_is_kept_clear_of() {
    let rings = [square(0.0, 30.0), square(10.0, 14.0)];
    let outline = Outline::eroded(&rings, 3.0).unwrap();
    assert_eq!(outline.distance(DVec2::splat(12.0)), 3.0);
    assert!((outline.distance(DVec2::new(9.0, 12.0)) - 2.0).abs() < 1e-12);
    assert_eq!(outline.distance(DVec2::new(6.9, 12.0)), 0.0);
    assert_eq!(outline.distance(DVec2::splat(22.0)), 0.0);
    let diagonal = DVec2::splat(14.0 + std::f64::consts::FRAC_1_SQRT_2);
    assert!((outline.distance(diagonal) - 2.0).abs() < 1e-12);
    // The order of corners does not matter.
    let turned = rings.map(|ring| ring.into_iter().rev().collect());
    assert!((Outline::eroded(&turned, 3.0).unwrap().distance(diagonal) - 2.0).abs() < 1e-12);
}

#[test]
fn a_neck_below_two_radii_parts_the_outline() {
    let across = |width: f64| {
        let outline = Outline::eroded(&[dumbbell(width)], 4.0).unwrap();
        assert_eq!([-15.0, 15.0].map(|x| outline.distance(DVec2::new(x, 0.0))), [0.0; 2]);
        (-500..=500).map(|k| outline.distance(DVec2::new(0.0, f64::from(k) * 0.02))).fold(f64::INFINITY, f64::min)
    };
    assert_eq!(across(8.2), 0.0);
    assert!(across(7.8) > 3.0);
    // Wide enough to the last bit: a line.
    assert_eq!(across(8.0), 0.0);
}

#[test]
fn what_has_no_outline_is_refused() {
    let refuse = |rings: &[Vec<DVec2>], radius: f64| Outline::eroded(rings, radius).unwrap_err();
    assert_eq!(refuse(&[l_shape()], 5.0), OutlineError::Thin { radius: 5.0 });
    assert_eq!(refuse(&[], 5.0), OutlineError::Thin { radius: 5.0 });
    assert_eq!(refuse(&[vec![DVec2::ZERO; 5]], 5.0), OutlineError::Thin { radius: 5.0 });
    assert_eq!(refuse(&[l_shape(), square(0.0, 1.0)[..2].to_vec()], 1.0), OutlineError::Ring { ring: 1, count: 2 });
    let bad = ring(&[[0.0, 0.0], [1.0, f64::NAN], [1.0, 1.0]]);
    assert!(matches!(refuse(&[bad], 1.0), OutlineError::Corner { ring: 0, corner: 1, .. }));
    for radius in [0.0, -1.0, 1e-9, f64::NAN, f64::INFINITY] {
        assert!(matches!(refuse(&[l_shape()], radius), OutlineError::Radius { .. }));
    }
    assert_eq!(
        Prism::over(&[l_shape()], f64::INFINITY, 1.0).unwrap_err(),
        OutlineError::Floor { floor: f64::INFINITY }
    );
    // A corner twice, and the first again at the end, change nothing.
    let mut doubled = l_shape();
    doubled.insert(2, doubled[2]);
    doubled.push(doubled[0]);
    assert_eq!(Outline::eroded(&[doubled], 3.0).unwrap().pieces, Outline::eroded(&[l_shape()], 3.0).unwrap().pieces);
}

/// An island in the shape of an L, with a lake, on the ground that the tests share.
fn island() -> Vec<Vec<DVec2>> {
    let shift = |p: DVec2| DVec2::new(104.0, -14.0) + p * DVec2::new(2.8, 3.0);
    let lake = ring(&[[3.5, 3.5], [4.0, 5.0], [5.0, 4.0]]);
    [l_shape(), lake].map(|ring| ring.into_iter().map(shift).collect()).to_vec()
}
pub(crate) fn island_ground(radius: f64) -> Volume {
    let how = Implicitisation { sigmoid: Sigmoid::UnitFree, distance: Distance::Vertical, radius, floor: -30.0 };
    how.volume_over(&waves(), &island()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn an_island_is_within_its_bounds_and_narrows(
        a in prop::array::uniform3(0.0f64..1.0), b in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..1.0,
        u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0), bare in any::<bool>(),
    ) {
        let ball = Primitive { skeleton: Skeleton::Point([106.0, -4.0, 3.0]), radius: 9.0, energy: 0.8 };
        let Volume::Ground(_, prism) = island_ground(4.0) else { panic!("a ground") };
        let f = if bare { Volume::Prism(prism) } else { Volume::terrain(island_ground(4.0), vec![ball]).unwrap() };
        let at = |t: [f64; 3]| DVec3::new(98.0, -20.0, -38.0) + DVec3::from_array(t) * DVec3::new(68.0, 72.0, 55.0);
        let region = Box3::new(at(a), at(a).lerp(at(b), size * size * size));
        let (bounds, rest) = f.narrow(&region);
        let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
            .clamp(region.low, region.high);
        let (p, q) = (inside(u), inside(v));
        let (value, other) = (f.value(p), f.value(q));
        prop_assert!(bounds.range.contains(value), "{value} in {bounds:?}");
        prop_assert!((value - other).abs() <= bounds.slope * p.distance(q) + 1e-13, "{bounds:?}");
        prop_assert!(f.density(region.intervals()).contains(value));
        prop_assert!(f.support().contains(p) || value <= 0.0, "{value} at {p}");
        prop_assert_eq!(rest.value(p), value);
        let (sampled, gradient) = f.sample(p);
        prop_assert_eq!(sampled, value);
        prop_assert!(gradient.length() <= bounds.slope * (1.0 + 1e-12) + 1e-13);
    }
}

#[test]
fn deep_inside_only_the_surface_is_left_and_outside_nothing() {
    let ground = island_ground(4.0);
    let at = |x: f64, y: f64| ground.narrow(&Box3::around(DVec3::new(x, y, -25.0), 1.5));
    assert!(matches!(at(115.0, 25.0).1, Volume::Surface(_)));
    assert_eq!(at(150.0, 40.0).0, crate::field::DensityBounds::ZERO);
    // The control: across the border both stay.
    assert!(matches!(at(111.0, -10.0).1, Volume::Ground(..)));
}

/// The control of the property: an enclosure of half the reach is left by the distances.
#[test]
fn half_the_reach_would_not_enclose() {
    let outline = Outline::eroded(&island(), 4.0).unwrap();
    let p = DVec2::new(118.0, -12.0);
    let [middle, below] = [p, p - DVec2::Y].map(|p| outline.distance(p));
    assert!(outline.enclose([p.x, p.y].map(|x| Interval::new(x - 1.0, x + 1.0))).contains(below));
    let half = 0.5 * std::f64::consts::SQRT_2;
    assert!(!Interval::new(middle - half, middle + half).contains(below));
}

#[test]
fn the_mesh_of_an_island_is_closed_and_its_walls_stand_0_4542_r_off_the_outline() {
    let ground = island_ground(4.0);
    let lattice = Lattice::over(&ground.support(), 1.0).unwrap();
    let polygonizer = Polygonizer::new(&ground, lattice, 1e-4).unwrap();
    let (mesh, _) = polygonizer.sparse().unwrap();
    assert!(Census::of(&mesh).is_closed(), "{:?}", Census::of(&mesh));
    assert_eq!(polygonizer.unproved_vertices(&mesh), 0);
    let outline = Outline::eroded(&island(), 4.0).unwrap();
    let mut wall = 0;
    for p in mesh.positions.iter().map(|p| DVec3::from(*p)) {
        let d = outline.distance(p.truncate());
        assert!(d <= 0.4543 * 4.0, "{d} at {p}");
        // Below all the ground and above the floor there is nothing else.
        if p.z > -30.0 && p.z < -14.0 {
            assert!((d - 0.4542 * 4.0).abs() < 1e-3, "{d} at {p}");
            wall += 1;
        }
    }
    assert!(wall > 1000, "{wall}");
}

#[test]
fn a_domain_off_the_grid_is_refused() {
    let how = Implicitisation::of(&waves(), 4.0);
    let mut rings = island();
    rings[1][2].x = 99.9;
    let error = how.volume_over(&waves(), &rings).unwrap_err();
    assert!(matches!(error, HeightfieldError::Outside { ring: 1, corner: 2, .. }));
    assert_eq!(
        how.volume_over(&waves(), &[]).unwrap_err(),
        HeightfieldError::Domain(OutlineError::Thin { radius: 4.0 })
    );
    let low = Implicitisation { floor: 0.0, ..how };
    assert!(matches!(low.volume_over(&waves(), &island()), Err(HeightfieldError::Floor { .. })));
}
