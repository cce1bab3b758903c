//! What samples promise: distance, coverage, the same bytes on any number of threads, blue noise.

use super::regions::{Plane, Space, Spacing, Surface};
use super::spectrum::{Ring, periodogram};
use super::*;
use crate::field::Box3;
use glam::{DVec2, DVec3};
use terrain_model::grid::Grid;
use terrain_model::noise::hash::Keys;

fn unit(seed: u32, k: u32, axis: u32) -> f64 {
    f64::from(Keys::new(seed).point2(k, axis)) / 4_294_967_296.0
}

fn square(side: f64, r: f64) -> Plane<impl Fn(DVec3) -> Option<f64> + Sync> {
    Plane { low: DVec2::ZERO, high: DVec2::splat(side), spacing: Spacing::uniform(r) }
}

/// Denser in the middle, 1 m to 4 m.
fn varying() -> Plane<impl Fn(DVec3) -> Option<f64> + Sync> {
    let at = |p: DVec3| Some(1.0 + 0.1 * p.distance(DVec3::new(30.0, 20.0, 0.0)));
    let spacing = Spacing { at, least: 1.0, most: 4.0, slope: 0.1 };
    Plane { low: DVec2::ZERO, high: DVec2::new(60.0, 40.0), spacing }
}

fn hills() -> Surface<impl Fn(DVec3) -> Option<f64> + Sync> {
    let height = |k: usize| 12.0 * libm::sin((k % 40) as f64 / 4.0) * libm::cos((k / 40) as f64 / 5.0);
    let heights = Grid::new(DVec2::new(-10.0, 5.0), DVec2::new(2.0, 1.5), 40, 50, (0..2000).map(height).collect());
    Surface::new(&heights.unwrap(), [-6.0, 8.0], Spacing::uniform(2.0)).unwrap()
}

fn ball() -> Space<impl Fn(DVec3) -> Option<f64> + Sync> {
    let within = Box3::new(DVec3::splat(-5.0), DVec3::splat(5.0));
    Space { within, spacing: Spacing::masked(1.5, |p| p.length() < 4.8) }
}

/// Pairs that are closer than the larger of their distances.
fn too_close(found: &Poisson) -> usize {
    let points = &found.points;
    let close = |a: usize, b: usize| {
        let keep = found.distances[a].max(found.distances[b]);
        points[a].distance_squared(points[b]) < keep * keep
    };
    (0..points.len()).map(|a| (0..a).filter(|&b| close(a, b)).count()).sum()
}

/// Of random places where points are wanted, the share that could take another.
fn gaps<const D: usize>(region: &impl Region<D>, found: &Poisson) -> f64 {
    let [low, high] = region.domain();
    let (mut wanted, mut free) = (0, 0);
    for k in 0..20_000 {
        let p =
            region.place(std::array::from_fn(|axis| low[axis] + unit(77, k, axis as u32) * (high[axis] - low[axis])));
        if let Some(own) = region.distance(p) {
            wanted += 1;
            let taken = |(q, d): (&DVec3, &f64)| p.distance_squared(*q) < own.max(*d) * own.max(*d);
            free += u32::from(!found.points.iter().zip(&found.distances).any(taken));
        }
    }
    assert!(wanted > 2_000);
    f64::from(free) / f64::from(wanted)
}

/// Distance, place, coverage; controls: a point moved beside another, a point taken out.
fn check<const D: usize>(region: &impl Region<D>) -> Poisson {
    let found = sample(region, 5).unwrap();
    assert!(found.points.len() > 100, "{}", found.points.len());
    assert!(found.points.iter().all(|&p| region.distance(p).is_some()));
    assert_eq!(too_close(&found), 0);
    let share = gaps(region, &found);
    // No open cell is the proof that the set is maximal; the random places test the proof.
    assert_eq!((share, found.open), (0.0, 0.0));
    let mut moved = found.clone();
    moved.points[1] = moved.points[0] + DVec3::X * (0.999 * moved.distances[0]);
    assert!(too_close(&moved) > 0);
    let mut fewer = found.clone();
    fewer.points.drain(..10);
    fewer.distances.drain(..10);
    assert!(gaps(region, &fewer) > 1e-3);
    found
}

#[test]
fn disks_keep_their_distance_and_leave_no_gap() {
    let found = check(&square(30.0, 1.0));
    // Maximal disks cover between the densest packing's 2/√3 points a square metre and the thinnest's 2/(3√3); at random ≈ 0.7.
    let density = found.points.len() as f64 / 900.0;
    assert!((0.6..0.85).contains(&density), "{density}");
    assert!(found.points.iter().all(|p| p.z == 0.0));
}

#[test]
fn disks_of_varying_radius_keep_the_larger_distance_and_leave_no_gap() {
    let found = check(&varying());
    // Distances are those of the field, from the middle out.
    assert!(found.distances.iter().any(|&d| d < 1.2) && found.distances.iter().any(|&d| d > 3.0));
}

#[test]
fn spheres_on_a_surface_keep_their_distance_in_space_and_stay_in_the_band() {
    let region = hills();
    let found = check(&region);
    assert!(found.points.iter().all(|p| (-6.0..=8.0).contains(&p.z)));
    assert!(found.points.iter().any(|p| p.z < -4.0) && found.points.iter().any(|p| p.z > 6.0));
}

#[test]
fn spheres_in_a_volume_keep_their_distance_and_leave_no_gap() {
    let found = check(&ball());
    assert!(found.points.iter().all(|p| p.length() < 4.8));
}

#[test]
fn samples_are_the_same_bytes_on_one_thread_and_on_two_and_others_for_another_seed() {
    let on = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (sample(&varying(), seed).unwrap(), sample(&ball(), seed).unwrap()))
    };
    assert_eq!(on(1, 3), on(2, 3));
    assert_ne!(on(1, 3), on(1, 4));
}

/// Mean power over the frequencies below half of 1/r.
fn low_power(rings: &[Ring]) -> f64 {
    let low = rings.iter().filter(|ring| ring.frequency < 0.5);
    let (sum, count) = low.fold((0.0, 0), |(sum, n), ring| (sum + ring.power * f64::from(ring.count), n + ring.count));
    sum / f64::from(count)
}

#[test]
fn disks_are_blue_noise_and_random_points_are_not() {
    let side = 40.0;
    let corners = [DVec2::ZERO, DVec2::splat(side)];
    let points: Vec<DVec2> = sample(&square(side, 1.0), 9).unwrap().points.iter().map(|p| p.truncate()).collect();
    let rings = periodogram(&points, corners, 0.05, 2.5).unwrap();
    // Random darts have about a tenth of white noise's power there.
    assert!(low_power(&rings) < 0.2, "{}", low_power(&rings));
    // The peak is at about 1/r, and above it the spectrum levels out at that of white noise.
    let peak = rings.iter().max_by(|a, b| a.power.total_cmp(&b.power)).unwrap();
    assert!((0.8..1.2).contains(&peak.frequency) && peak.power > 1.3, "{peak:?}");
    // Control: as many independent points have power 1.
    let white: Vec<DVec2> = (0..points.len() as u32).map(|k| side * DVec2::new(unit(1, k, 0), unit(1, k, 1))).collect();
    let rings = periodogram(&white, corners, 0.05, 2.5).unwrap();
    assert!((low_power(&rings) - 1.0).abs() < 0.2, "{}", low_power(&rings));
}

#[test]
fn what_cannot_be_sampled_is_named() {
    assert!(matches!(sample(&square(-1.0, 1.0), 0), Err(SamplingError::Region { .. })));
    assert!(matches!(sample(&square(1.0, 0.0), 0), Err(SamplingError::Distances { .. })));
    assert!(matches!(sample(&square(1e6, 1e-3), 0), Err(SamplingError::Many { .. })));
    let flat = Grid::new(DVec2::ZERO, DVec2::ONE, 1, 2, vec![0.0f32; 2]).unwrap();
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    assert!(matches!(Surface::new(&flat, all, Spacing::uniform(1.0)), Err(SamplingError::Heightfield { .. })));
    let flat = Grid::new(DVec2::ZERO, DVec2::ONE, 2, 2, vec![0.0f32; 4]).unwrap();
    assert!(matches!(Surface::new(&flat, [1.0, 0.0], Spacing::uniform(1.0)), Err(SamplingError::Band { .. })));
}
