//! A terrain of any number of primitives: waves of rock, carved and accreted at random near the surface.

use crate::experiment::ExperimentError;
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_amplify::field::Density;
use terrain_amplify::implicit::heightfield::Implicitisation;
use terrain_amplify::implicit::index::Index;
use terrain_amplify::implicit::primitive::Primitive;
use terrain_amplify::implicit::sigmoid::Sigmoid;
use terrain_amplify::implicit::skeleton::Skeleton;
use terrain_amplify::implicit::surface::Distance;
use terrain_amplify::implicit::volume::{Volume, Warp};
use terrain_model::grid::Grid;
use terrain_model::noise::hash;

/// Falloff of the heightfield, metres.
const RADIUS: f64 = 4.0;
/// Metres between samples.
const SPACING: f64 = 2.0;
/// Square metres of ground for each primitive: supports then overlap about threefold near the surface.
const GROUND: f64 = 14.0;

/// Numbers in [0, 1), the `k`-th of `seed`.
pub fn uniform(seed: u32, k: u32) -> f64 {
    f64::from(hash::mix(seed, k)) / 4_294_967_296.0
}

/// Waves 8 m high.
pub fn waves([x, y]: [f64; 2]) -> f64 {
    5.0 * libm::sin(x * 0.05) + 3.0 * libm::cos(y * 0.07 + x * 0.02)
}

/// The side of the ground that `count` primitives need, metres.
pub fn side(count: usize) -> f64 {
    (count as f64 * GROUND).sqrt().max(64.0)
}

/// A terrain with `count` point primitives within 2 m of the surface, radii 2.5 to 5 m, one in four accreting.
pub fn scattered(count: usize, seed: u32) -> Result<Volume, ExperimentError> {
    deep(count, seed, -24.0)
}

/// The same over a floor elevation.
pub fn deep(count: usize, seed: u32, floor: f64) -> Result<Volume, ExperimentError> {
    let side = side(count);
    let samples = ((side + 4.0 * RADIUS) / SPACING).ceil() as usize + 1;
    let origin = DVec2::splat(-2.0 * RADIUS);
    let position = |k: usize| origin + SPACING * DVec2::new((k % samples) as f64, (k / samples) as f64);
    let values = (0..samples * samples).map(|k| waves(position(k).to_array()) as f32).collect();
    let grid = Grid::new(origin, DVec2::splat(SPACING), samples, samples, values).map_err(ExperimentError::failed)?;
    let settings = Implicitisation { sigmoid: Sigmoid::UnitFree, distance: Distance::Vertical, radius: RADIUS, floor };
    let ground = settings.volume(&grid).map_err(ExperimentError::failed)?;
    let primitive = |k: u32| {
        let random = |j: u32| uniform(seed, 5 * k + j);
        let [x, y] = [random(0) * side, random(1) * side];
        let z = waves([x, y]) + 4.0 * random(2) - 2.0;
        Primitive {
            skeleton: Skeleton::Point([x as f32, y as f32, z as f32]),
            radius: (2.5 + 2.5 * random(3)) as f32,
            energy: if random(4) < 0.25 { 0.4 } else { -0.6 },
        }
    };
    Volume::terrain(ground, (0..count as u32).map(primitive).collect())
        .map_err(|k| ExperimentError::failed(format!("primitive {k} is not sound")))
}

/// The waves warped in their middle, by up to 8 m.
pub fn warped(seed: u32) -> Result<Volume, ExperimentError> {
    let bare = scattered(400, seed)?;
    let (ground, _) = parts(&bare)?;
    let middle = (0.5 * side(400)) as f32;
    let region = Primitive { skeleton: Skeleton::Point([middle, middle, 0.0]), radius: 26.0, energy: 1.0 };
    let warp = Warp::new(ground.clone(), Volume::Few([region].into()), 8.0, 24.0, 2, seed);
    Ok(Volume::Warp(Arc::new(warp.map_err(ExperimentError::failed)?)))
}

/// Is `p` far enough from walls, floor and the lattice's border for the ground and what carves it alone to count?
pub fn within_walls(volume: &Volume, cell: f64, p: DVec3) -> bool {
    let support = volume.support();
    let margin = 12.0 + 2.0 * cell;
    (0..2).all(|k| support.low[k] + margin < p[k] && p[k] < support.high[k] - margin) && p.z > support.low.z + margin
}

/// The two parts of a scattered terrain.
pub fn parts(terrain: &Volume) -> Result<(&Volume, &Index), ExperimentError> {
    match terrain {
        Volume::Blend(parts) => match parts.as_slice() {
            [ground, Volume::Primitives(index)] => Ok((ground, index)),
            _ => Err(ExperimentError::failed("a terrain of other parts")),
        },
        _ => Err(ExperimentError::failed("a terrain of other parts")),
    }
}

/// `count` points within 2 m of the waves, in no order.
pub fn near_surface(count: u32, side: f64, seed: u32) -> Vec<DVec3> {
    let point = |k: u32| {
        let [x, y] = [0, 1].map(|j| uniform(seed, 3 * k + j) * side);
        DVec3::new(x, y, waves([x, y]) + 4.0 * uniform(seed, 3 * k + 2) - 2.0)
    };
    (0..count).map(point).collect()
}
