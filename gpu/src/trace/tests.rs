use super::compare::{compare, prove};
use super::*;
use crate::context::device;
use glam::{DVec2, DVec3, Vec2};
use terrain_model::noise::{Combination, Octaves, mix};
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::program::Program;
use terrain_model::trace::certified::Effort;
use terrain_model::tree::{Node, Tree};

/// Hills far from the origin, with holes between them.
fn hills() -> Program {
    let octaves = Octaves { octaves: 5, frequency: 0.003, lacunarity: 2.1, gain: 0.5, amplitude: 60.0 };
    let mut tree = Tree::new();
    let disc = |k: u32| {
        let at = DVec2::from_angle(0.9 * f64::from(k)) * 130.0 * f64::from(k);
        let noise = Some(DiscNoise { combination: Combination::Sum, octaves, seed: k });
        Disc { centre: at.extend(20.0 * f64::from(k % 5)) + FAR, radius: 420.0, weight: 1.0, noise }
    };
    let discs = (0..9).map(|k| tree.push(disc(k))).collect();
    let root = tree.push(Node::Blend(discs));
    Program::compile(&tree, root).unwrap()
}

const FAR: DVec3 = DVec3::new(3_000_000.0, -1_700_000.0, 0.0);

/// From above, along the ground and from outside, at every angle.
fn rays(count: u32) -> Vec<Ray> {
    let unit = |k: u32, salt: u32| f64::from(mix(salt, k)) / 4_294_967_296.0;
    let ray = |k: u32| {
        let from = DVec2::from_angle(std::f64::consts::TAU * unit(k, 1)) * 2500.0 * unit(k, 2);
        let to = DVec2::from_angle(std::f64::consts::TAU * unit(k, 3)) * 1200.0 * unit(k, 4);
        let origin = FAR + from.extend(60.0 + 1500.0 * unit(k, 5) * unit(k, 6));
        let target = FAR + to.extend(150.0 * unit(k, 7));
        Ray { origin, direction: (target - origin).normalize() }
    };
    let straight = [(0.0, 0.0), (70.0, -40.0), (9000.0, 0.0)]
        .map(|(x, y)| Ray { origin: FAR + DVec3::new(x, y, 900.0), direction: DVec3::NEG_Z });
    (0..count).map(ray).chain(straight).collect()
}

const EPSILON: f64 = 0.01;

#[test]
fn no_certified_hit_is_missed_and_a_third_of_the_bound_misses() {
    let Some(context) = device() else { return };
    let program = hills();
    let surface = Surface::new(&program);
    let tiles = Tiles::new(&surface, 16).unwrap();
    let rays = rays(300);
    let proved = prove(&surface, &rays, &Effort::default());
    let beams = beams(&surface, &tiles, &rays);
    let tracer = Tracer::new(&context, &tiles).unwrap();
    let mut steps = Vec::new();
    for bound in Bound::ALL {
        let settings = Settings { bound, epsilon: EPSILON, most_steps: 5000, share: 1.0 };
        let found = tracer.trace(&beams, &settings).unwrap();
        let compared = compare((&surface, &tiles), &settings, &rays, &proved, &found);
        assert_eq!((compared.missed, compared.false_hits, compared.gave_up), (0, 0, 0), "{bound:?} {compared:?}");
        assert!(compared.hits > 100 && compared.largest_slack < 0.1, "{compared:?}");
        steps.push(compared.steps);
    }
    assert!(steps.is_sorted_by(|a, b| a > b), "{steps:?}");
    let third = Settings { bound: Bound::Tile, epsilon: EPSILON, most_steps: 5000, share: 1.0 / 3.0 };
    let found = tracer.trace(&beams, &third).unwrap();
    let compared = compare((&surface, &tiles), &third, &rays, &proved, &found);
    assert!(compared.missed > 5, "{compared:?}");
}

/// However the work is split into dispatches, the answer is the same to the bit; where a driver cuts loops, they are cut here.
#[test]
fn no_answer_depends_on_how_far_a_dispatch_goes() {
    let Some(context) = device() else { return };
    let program = hills();
    let surface = Surface::new(&program);
    let tiles = Tiles::new(&surface, 12).unwrap();
    let rays = rays(64);
    let beams = beams(&surface, &tiles, &rays);
    let tracer = Tracer::new(&context, &tiles).unwrap();
    let settings = Settings { bound: Bound::Gradient, epsilon: EPSILON, most_steps: 400, share: 1.0 };
    let usual = tracer.trace(&beams, &settings).unwrap();
    for turns in [23, TURNS] {
        assert_eq!(tracer.trace_by(&beams, &settings, turns).unwrap(), usual, "{turns}");
    }
    let other = Settings { share: 0.9, ..settings };
    assert_ne!(tracer.trace(&beams, &other).unwrap(), usual);
}

#[test]
fn elevations_and_gradients_lie_within_the_margins_and_those_a_metre_aside_do_not() {
    let Some(context) = device() else { return };
    let program = hills();
    let surface = Surface::new(&program);
    let tiles = Tiles::new(&surface, 16).unwrap();
    let surveyor = Surveyor::new(&context, &tiles).unwrap();
    let unit = |k: u32, salt: u32| (f64::from(mix(salt, k)) / 4_294_967_296.0) as f32;
    let place = |k: u32| {
        let at = (Vec2::new(unit(k, 1), unit(k, 2)) * 2.0 - 1.0) * tiles.half() as f32;
        (Place { tile: mix(3, k) as usize % tiles.count(), at }, 10.0 * unit(k, 4))
    };
    let places: Vec<(Place, f32)> = (0..8000).map(place).collect();
    let (mut checked, mut worst, mut aside) = (0, 0.0f64, 0);
    for ((place, reach), found) in places.iter().zip(surveyor.look(&places).unwrap()) {
        let [margin, weight_margin] = tiles.margins(place.tile);
        let exact = |p: Vec2| program.height(tiles.world(&Place { at: p, ..*place }));
        let (elevation, weight) = exact(place.at);
        let [low, high] = line(&tiles, place, *reach);
        let ends = [low, high].map(|p| [exact(Vec2::new(p.x, place.at.y)), exact(Vec2::new(place.at.x, p.y))]);
        // Where a weight is near T the device may take the other side.
        let inside = |weight: f64| weight > THRESHOLD + weight_margin;
        if !inside(weight) || !ends.as_flattened().iter().all(|(_, weight)| inside(*weight)) {
            continue;
        }
        checked += 1;
        let off = (f64::from(found.elevation) - elevation).abs();
        worst = worst.max(off / margin).max((f64::from(found.weight) - weight).abs() / weight_margin);
        for axis in 0..2 {
            let length = f64::from(high[axis]) - f64::from(low[axis]);
            let gradient = (ends[1][axis].0 - ends[0][axis].0) / length;
            // Both ends; the differences and the quotient round by at most 7 half units.
            let tolerance = 2.0 * margin / length + 7.0 * f64::from(f32::EPSILON) * gradient.abs();
            worst = worst.max((f64::from(found.gradient[axis]) - gradient).abs() / tolerance);
        }
        aside += usize::from((f64::from(found.elevation) - exact(place.at + 1.0).0).abs() > margin);
    }
    assert!(checked > 1000 && worst <= 1.0, "{checked} {worst}");
    assert!(aside > checked / 2, "{aside} of {checked}");
}
