//! What tessellation promises, on cameras over a rough synthetic ground, each with a rule broken beside it.

use super::census::Census;
use super::coverage::Image;
use super::displace::{Detail, Rule, Space};
use super::ground::Ground;
use super::refine::Refinement;
use super::surface::Surface;
use super::triangle::{FINEST, SIDE, Triangle};
use super::view::View;
use std::collections::HashSet;
use terrain_model::grid::Grid;
use terrain_model::noise::{Octaves, mix};

const PEAK: [usize; 2] = [37, 60];

/// Rough ground, and the same beyond column 100 and row 89 as on them.
fn samples(width: usize, height: usize) -> Ground {
    let elevation = |at: usize| {
        let (i, j) = ((at % width).min(100), (at / width).min(89));
        let far = (i as f64 - PEAK[0] as f64).abs() + (j as f64 - PEAK[1] as f64).abs();
        f64::from(mix(7, (j * 101 + i) as u32) >> 24) * 0.2 + (900.0 - 25.0 * far).max(0.0)
    };
    let heights = (0..width * height).map(elevation).collect();
    let grid = Grid::new([0.0, 0.0].into(), [30.0, 36.0].into(), width, height, heights).unwrap();
    Ground::new(&grid, 0.6).unwrap()
}

pub(super) fn ground() -> Ground {
    samples(129, 129)
}

/// A raster that ends within its square.
pub(super) fn partial() -> Ground {
    samples(101, 90)
}

pub(super) fn detail_of(amplitude: f64) -> Detail {
    let octaves = Octaves { octaves: 6, frequency: 0.02, lacunarity: 2.0, gain: 0.5, amplitude };
    let mut detail = Detail::new(&octaves, 3, Space::Volume).unwrap();
    (detail.floor, detail.elevation) = ([0.3, 0.5], [0.0, 900.0]);
    detail
}

pub(super) fn detail() -> Detail {
    detail_of(6.0)
}

fn unit_random(k: u32, use_of: u32) -> f64 {
    f64::from(mix(mix(11, k), use_of)) / 4_294_967_296.0
}

pub(super) fn camera(ground: &Ground, k: u32) -> View {
    let random = |use_of| unit_random(k, use_of);
    let at = [0, 1].map(|axis| (random(axis) * f64::from(SIDE)) as u32);
    let (p, _) = ground.smooth(at);
    let eye = [p[0], p[1], p[2] + 2.0 + 400.0 * random(2) * random(3)];
    View::new(eye, [random(4) - 0.5, random(5) - 0.5, 0.6 * (random(6) - 0.8)], 500.0, [480.0, 270.0]).unwrap()
}

#[test]
fn every_inner_edge_has_two_triangles_and_a_broken_rule_shows() {
    let (ground, detail) = (ground(), detail());
    let mut broken = 0;
    for k in 0..24 {
        let mut refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
        let leaves = refinement.leaves(false);
        assert!(leaves.len() > 100, "camera {k}: {} leaves", leaves.len());
        assert_eq!(Census::of(&leaves, ground.end()), Census::default(), "camera {k}");
        refinement.radii_mut().iter_mut().skip(1).step_by(2).for_each(|radius| *radius *= 0.6);
        let census = Census::of(&refinement.leaves(false), ground.end());
        broken += census.cracks.min(census.t_junctions);
    }
    assert!(broken > 1000, "{broken}");
}

#[test]
fn enclosures_nest_and_hold_displaced_heights() {
    let (ground, detail) = (ground(), detail());
    for k in 0..2000u32 {
        let mut triangle = Triangle::ROOTS[(k & 1) as usize];
        while triangle.level < FINEST.min(6 + k % 20) {
            let block = detail.widen(ground.enclosure(triangle.middle(), triangle.reach()));
            let child = triangle.children()[(mix(k, triangle.level) >> 31) as usize];
            let inner = detail.widen(ground.enclosure(child.middle(), child.reach()));
            assert!(block.elevation[0] <= inner.elevation[0] && inner.elevation[1] <= block.elevation[1]);
            for vertex in triangle.corners() {
                let p = detail.position(&ground, vertex, 0.0);
                let [x, y] = ground.metres(vertex);
                assert!(block.elevation[0] <= p[2] && p[2] <= block.elevation[1], "{vertex:?}");
                assert!((p[0] - x).abs().max((p[1] - y).abs()) <= block.moved);
            }
            triangle = child;
        }
    }
}

/// Each way of displacing: the sum and the product, in space and in the plane, alone and less in hollows.
pub(super) fn kinds(octaves: &Octaves) -> Vec<Detail> {
    let mut kinds = Vec::new();
    for space in [Space::Volume, Space::Plan] {
        for rule in [Rule::Sum, Rule::Multifractal { offset: 0.9 }] {
            for concavity in [None, Some([0.2, 0.05])] {
                let mut detail = Detail::new(octaves, 3, space).unwrap();
                (detail.rule, detail.concavity) = (rule, concavity);
                kinds.push(detail);
            }
        }
    }
    kinds
}

#[test]
fn displacement_keeps_within_its_amplitude_and_comes_near_it() {
    let ground = ground();
    for (octaves, near) in [(1, 0.45), (4, 0.15)] {
        let shape = Octaves { octaves, frequency: 0.02, lacunarity: 2.0, gain: 0.5, amplitude: 6.0 };
        for detail in kinds(&shape) {
            let mut most = 0.0f64;
            for k in 0..8000 {
                let vertex = [0, 1].map(|axis| (unit_random(k, axis) * f64::from(SIDE)) as u32);
                let (p, q) = (ground.smooth(vertex).0, detail.position(&ground, vertex, 0.0));
                most = most.max((0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>().sqrt());
                // No octave is left where vertices are half a wavelength apart.
                assert_eq!(detail.position(&ground, vertex, 25.0), p);
            }
            // A sum in space of one octave, alone, comes nearest.
            let alone =
                octaves == 1 && (detail.rule, detail.space(), detail.concavity) == (Rule::Sum, Space::Volume, None);
            let near = if alone { 0.667 } else { near };
            assert!(most <= 6.0 * (1.0 + 1e-12) && most > near * 6.0, "{octaves} {detail:?}: {most}");
        }
    }
    // Control: without the division by its range a product of four leaves ± 1.
    let shape = Octaves { octaves: 4, frequency: 0.02, lacunarity: 2.0, gain: 1.0, amplitude: 1.0 };
    let [neutral, reach] = Detail::new(&shape, 3, Space::Volume).unwrap().product(0.9);
    assert!(reach > 5.0 && (neutral - 0.6561).abs() < 1e-12);
}

#[test]
fn culling_drops_nothing_in_the_image_and_boxes_of_flat_triangles_do() {
    let (ground, detail) = (ground(), detail());
    let (mut dropped, mut kept, mut lost_by_flat_boxes) = (0, 0, 0);
    for k in 0..24 {
        let view = camera(&ground, k);
        let refinement = Refinement::new(&ground, &detail, view, 24.0, 22);
        let image = Image { view: &view, size: [480, 270] };
        let seen: HashSet<Triangle> = refinement.leaves(true).into_iter().collect();
        for leaf in refinement.leaves(false) {
            let corners = leaf.corners().map(|c| ground.smooth(c).0);
            let flat =
                |pick: fn(f64, f64) -> f64| [0, 1, 2].map(|k| corners.map(|c| c[k]).into_iter().reduce(pick).unwrap());
            let visible = || refinement.patch(&leaf).iter().any(|corners| image.shows(corners));
            lost_by_flat_boxes += usize::from(view.misses(flat(f64::min), flat(f64::max)) && visible());
            if seen.contains(&leaf) {
                kept += 1;
                continue;
            }
            dropped += 1;
            assert!(!visible(), "camera {k} lost {leaf:?}");
        }
    }
    assert!(dropped > 1000 && kept > 1000, "{dropped} dropped, {kept} kept");
    assert!(lost_by_flat_boxes > 0);
}

#[test]
fn someone_on_a_peak_has_the_finest_level_at_their_feet() {
    let (ground, detail) = (ground(), detail());
    let unit = SIDE / 128;
    let at = PEAK.map(|i| i as u32 * unit);
    let p = detail.position(&ground, at, 0.0);
    let view = View::new([p[0], p[1], p[2] + 1.8], [1.0, 0.2, -0.3], 500.0, [480.0, 270.0]).unwrap();
    let leaves = Refinement::new(&ground, &detail, view, 24.0, 20).leaves(false);
    let feet: Vec<u32> = leaves.iter().filter(|leaf| leaf.corners().contains(&at)).map(|leaf| leaf.level).collect();
    assert!(!feet.is_empty() && feet.iter().all(|level| *level == 20), "{feet:?}");
}

#[test]
// Over 1,000 such cameras the share is below 95 %: these 24 are a regression test, `tessellation/edges` is the measurement.
fn edges_not_stopped_lie_within_a_factor_two_of_the_target() {
    let (ground, detail) = (ground(), detail());
    let (mut all, mut within) = (0usize, 0usize);
    for k in 0..24 {
        let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 24);
        for leaf in refinement.leaves(true).iter().filter(|leaf| leaf.level < refinement.finest()) {
            let ratios = refinement.edge_ratios(leaf);
            all += ratios.len();
            within += ratios.iter().filter(|ratio| (0.5..=2.0).contains(*ratio)).count();
        }
    }
    assert!(within * 100 >= all * 95, "{within} of {all}");
}

#[test]
fn the_normal_is_that_of_the_displaced_surface_and_not_of_the_smooth_one() {
    let ground = ground();
    let octaves = Octaves { octaves: 6, frequency: 0.02, lacunarity: 2.0, gain: 0.5, amplitude: 6.0 };
    let mut smooth_off = 0.0f64;
    for mut detail in kinds(&octaves) {
        (detail.floor, detail.elevation) = ([0.3, 0.5], [0.0, 900.0]);
        for k in 0..200 {
            // Odd coordinates lie in the inside of a cell, and so do their neighbours: 2 × 59 units, a hundredth of a metre.
            let [x, y] = [0, 1].map(|axis| ((0.75 * unit_random(k, axis) * f64::from(SIDE)) as u32 | 63) & !4);
            let at = |dx: i32, dy: i32| {
                detail.position(&ground, [x.wrapping_add_signed(dx), y.wrapping_add_signed(dy)], 0.0)
            };
            let ([west, east], [south, north]) = ([at(-59, 0), at(59, 0)], [at(0, -59), at(0, 59)]);
            let along = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| b[k] - a[k]);
            let (u, v) = (along(west, east), along(south, north));
            let normal = detail.normal(&ground, [x, y], 0.0);
            for tangent in [u, v] {
                let length = (0..3).map(|k| tangent[k] * tangent[k]).sum::<f64>().sqrt();
                let off = |n: [f64; 3]| ((0..3).map(|k| n[k] * tangent[k]).sum::<f64>() / length).abs();
                assert!(off(normal) < 2e-3, "{detail:?} {x} {y}: {}", off(normal));
                smooth_off = smooth_off.max(off(ground.smooth([x, y]).1));
            }
        }
    }
    assert!(smooth_off > 0.05, "{smooth_off}");
}

#[test]
fn a_raster_that_is_no_square_ends_at_its_borders() {
    let values = (0..21 * 13).map(|k| f64::from(k % 21) * 2.0 + f64::from(k / 21)).collect();
    let grid = Grid::new(glam::DVec2::ZERO, glam::DVec2::splat(10.0), 21, 13, values).unwrap();
    let (ground, detail) = (Ground::new(&grid, 0.5).unwrap(), detail());
    assert_eq!((ground.extent(), ground.sides()), ([200.0, 120.0], [320.0; 2]));
    for k in 0..400 {
        let vertex = [0, 1].map(|axis| (unit_random(k, axis) * f64::from(SIDE)) as u32);
        let ([x, y, _], _) = ground.smooth(vertex);
        // Of a plane Phong tessellation makes the same plane, borders included.
        let [u, v] = [0, 1].map(|axis| ground.metres(vertex)[axis].min(ground.extent()[axis]));
        assert!((x - u).abs() < 1e-9 && (y - v).abs() < 1e-9, "{vertex:?}: {x} {y}");
        let [a, b] = [vertex, ground.within(vertex)].map(|vertex| detail.position(&ground, vertex, 0.0));
        assert_eq!(a, b);
    }
    // Control: the square's other corner is none of the raster's.
    assert_ne!(ground.within([SIDE; 2]), [SIDE; 2]);
}

#[test]
fn nothing_beyond_a_raster_is_refined_and_what_is_over_it_is_as_before() {
    let (ground, detail) = (partial(), detail());
    let (mut dropped, mut kept, mut corner) = (0, 0, 0);
    for k in 0..8 {
        let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
        let leaves: HashSet<Triangle> = refinement.leaves(false).into_iter().collect();
        // Without the rule, in the square that holds the raster.
        let (mut all, mut list) = (Vec::new(), Triangle::ROOTS.to_vec());
        while let Some(triangle) = list.pop() {
            if refinement.splits(&triangle) { list.extend(triangle.children()) } else { all.push(triangle) }
        }
        for leaf in &all {
            let over = leaf.lattice(4).iter().any(|triangle| ground.holds(triangle));
            assert!(leaves.contains(leaf) || !over, "camera {k}: {leaf:?}");
            // Across the corner of the raster, beyond both borders and neither.
            corner += usize::from(leaves.contains(leaf) && !over);
        }
        assert_eq!(Census::of(refinement.leaves(false).as_slice(), ground.end()), Census::default());
        (dropped, kept) = (dropped + all.len() - leaves.len(), kept + leaves.len());
    }
    assert!(dropped > 1000 && kept > 1000 && corner <= 8, "{dropped} dropped, {kept} kept, {corner} at the corner");
}

#[test]
fn a_place_is_found_again_below_the_elevation_over_it() {
    let (ground, detail) = (ground(), detail());
    let (mut near, mut bare) = (0, 0);
    for k in 0..400 {
        let at = [0, 1].map(|axis| (0.1 + 0.6 * unit_random(k, axis)) * ground.sides()[axis as usize]);
        let z = detail.elevation_over(&ground, at);
        // The raster's own elevation (control) is off by the displacement, up to the amplitude.
        let off = |z: f64| {
            let vertex = |d: [f64; 2]| [0, 1].map(|i| ((at[i] + d[i]) / ground.sides()[i] * f64::from(SIDE)) as u32);
            // The nearest of the displaced points about it.
            let reach = 2.0 * detail.amplitude();
            (0..41 * 41)
                .map(|k| {
                    let d = [k % 41, k / 41].map(|i| reach * (f64::from(i) / 20.0 - 1.0));
                    let p = detail.position(&ground, vertex(d), 0.0);
                    [p[0] - at[0], p[1] - at[1], p[2] - z].iter().map(|d| d * d).sum::<f64>().sqrt()
                })
                .fold(f64::INFINITY, f64::min)
        };
        near += usize::from(off(z) < 0.15 * detail.amplitude());
        bare += usize::from(off(ground.elevation(at)) < 0.15 * detail.amplitude());
    }
    assert!(near > 390 && bare < 350, "{near} {bare}");
}

#[test]
fn modulation_leaves_less_on_flats_in_lows_and_in_hollows() {
    // A valley along y and level ground east of it; steep walls.
    let height = |at: usize| ((at % 33) as f64 - 8.0).abs().min(8.0) * 20.0;
    let grid = Grid::new([0.0, 0.0].into(), [10.0, 10.0].into(), 33, 33, (0..33 * 33).map(height).collect()).unwrap();
    let ground = Ground::new(&grid, 0.0).unwrap();
    let octaves = Octaves { octaves: 3, frequency: 0.07, lacunarity: 2.0, gain: 0.5, amplitude: 4.0 };
    let plain = Detail::new(&octaves, 3, Space::Volume).unwrap();
    let unit = SIDE / 32;
    let most = |detail: &Detail, column: u32| {
        let moved = |k: u32| {
            let vertex = [column * unit, 3 * unit + k * unit / 40];
            let (p, q) = (ground.smooth(vertex).0, detail.position(&ground, vertex, 0.0));
            (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>().sqrt()
        };
        (0..1000).map(moved).fold(0.0f64, f64::max)
    };
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b;
    let (flat, wall, bottom) = (25, 4, 8);
    let mut sloped = plain.clone();
    sloped.floor = [0.25, 1.0];
    assert!(near(most(&sloped, flat), 0.25 * most(&plain, flat)) && most(&sloped, wall) > 0.5 * most(&plain, wall));
    let mut raised = plain.clone();
    (raised.floor, raised.elevation) = ([1.0, 0.1], [0.0, 160.0]);
    assert!(near(most(&raised, bottom), 0.1 * most(&plain, bottom)));
    assert!(near(most(&raised, flat), most(&plain, flat)));
    let mut hollow = plain.clone();
    hollow.concavity = Some([0.3, 0.4]);
    assert!(near(most(&hollow, bottom), 0.3 * most(&plain, bottom)));
    assert!(near(most(&hollow, flat), 0.65 * most(&plain, flat)));
}

#[test]
fn the_multifractal_keeps_its_bound_and_its_neutral_value() {
    let octaves = Octaves { octaves: 5, frequency: 0.3, lacunarity: 2.0, gain: 0.6, amplitude: 1.0 };
    for offset in [0.0, 0.7, 1.5] {
        let mut detail = Detail::new(&octaves, 9, Space::Volume).unwrap();
        detail.rule = Rule::Multifractal { offset };
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for k in 0..20_000 {
            let value: f64 = detail.fbm([0, 1, 2].map(|axis| 1e3 * unit_random(k, axis)), 0.0);
            (low, high) = (low.min(value), high.max(value));
        }
        assert!(-1.0 <= low && high <= 1.0 && high - low > 0.05, "{offset}: {low} {high}");
        assert_eq!(detail.fbm([5.0, 6.0, 7.0], 1e9), 0.0, "no octave is left");
    }
}

#[test]
fn the_surface_seen_from_the_eye_is_the_displaced_one_and_not_that_of_another_amplitude() {
    let ground = partial();
    let [mut detail, mut other] = [6.0, 6.001].map(detail_of);
    let equal = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6);
    let mut seen_in_control = 0;
    for k in 0..1200 {
        let rule = [Rule::Sum, Rule::Multifractal { offset: 0.9 }][k as usize % 2];
        (detail.rule, other.rule) = (rule, rule);
        (detail.concavity, other.concavity) = (Some([0.2, 0.05]), Some([0.2, 0.05]));
        let view = camera(&ground, k % 20);
        let [refinement, control] = [&detail, &other].map(|detail| Refinement::new(&ground, detail, view, 24.0, 22));
        // Up to 200 m away, where octaves are left; some beyond the raster.
        let vertex = [0, 1].map(|axis| {
            let at = view.eye[axis as usize] + 400.0 * (unit_random(k, 20 + axis) - 0.5);
            (at / ground.unit()[axis as usize]).clamp(0.0, f64::from(SIDE)) as u32
        });
        let [p, n] = Surface::new(&refinement, [SIDE / 3, SIDE / 5]).point::<f64>(vertex);
        let p = [0, 1, 2].map(|axis| p[axis] + view.eye[axis]);
        assert!(equal(p, refinement.position(vertex)) && equal(n, refinement.normal(vertex)), "{rule:?} {vertex:?}");
        seen_in_control += usize::from(!equal(p, control.position(vertex)));
    }
    assert!(seen_in_control > 600, "{seen_in_control}");
}
