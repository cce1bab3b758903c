//! Erosion that reaches a limited depth (Paris 2019 §6.1): Poisson spheres on the surface, each a primitive that carves as
//! far as stress and weak rock let it. A further step starts from the walls of what the last one carved.

use super::energy::Attack;
use super::ground::sprinkle;
use super::parameter::{Check, ParameterError};
use super::random::Random;
use super::raster::largest;
use crate::field::{Box3, Density, THRESHOLD};
use crate::geology::Geology;
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::surface::Surface;
use crate::implicit::volume::Volume;
use crate::sampling::thin::thin;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use terrain_model::grid::Grid;
use terrain_model::noise::hash::mix;

/// How surfaces are eroded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shallow {
    /// No two centres of one step are nearer to each other, metres; 0.01 to 10⁴.
    pub spacing: f64,
    /// Radius of the primitives, metres; 0.01 to 10⁴.
    pub radius: f64,
    /// How much of the field a primitive takes at its centre where the effect is 1; 0 to 100.
    pub strength: f64,
    /// β: the effect of full stress on the hardest rock; 0 to 1.
    pub hardest: f64,
    /// Samples of less effect are left out; 0 to 1.
    pub threshold: f64,
    /// How often the sea or the river comes back; 1 to 100.
    pub steps: u32,
}

impl Default for Shallow {
    fn default() -> Shallow {
        Shallow { spacing: 4.0, radius: 6.0, strength: 1.2, hardest: 0.1, threshold: 0.05, steps: 1 }
    }
}

/// What a shallow erosion acts on.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// The heightfield as a solid.
    pub ground: &'a Volume,
    /// What stands on it and was carved from it before.
    pub before: &'a [Primitive],
    /// The surface of its heightfield, on which the first samples lie.
    pub surface: &'a Surface,
    /// The rock.
    pub geology: &'a Geology,
    /// Nothing is carved around centres outside it.
    pub region: Box3,
    /// A map with the samples of the surface, σ nowhere above it: cells of less than the threshold at all corners are passed
    /// over.
    pub most: &'a Grid<f32>,
    /// The most primitives.
    pub limit: usize,
}

/// Rays from a centre that look for the walls of what it carved.
const RAYS: u32 = 6;
/// The radius, in radii of the spheres that erode, above which a carver sends no more rays.
const MOST_WIDER: f64 = 16.0;
/// They reach so many radii, in so many steps, and the wall is then bracketed by so many halvings.
const REACH: f64 = 1.25;
const STEPS: u32 = 7;
const HALVINGS: u32 = 6;

impl Shallow {
    /// # Errors
    /// The first parameter out of its range.
    pub fn check(&self, landform: &'static str) -> Result<(), ParameterError> {
        let check = Check(landform);
        check.within("spacing", self.spacing, [0.01, 1e4], "m")?;
        check.within("radius", self.radius, [0.01, 1e4], "m")?;
        check.within("strength", self.strength, [0.0, 100.0], "(no unit)")?;
        check.within("hardest", self.hardest, [0.0, 1.0], "(no unit)")?;
        check.within("threshold", self.threshold, [0.0, 1.0], "(no unit)")?;
        check.within("steps", self.steps.into(), [1.0, 100.0], "(no unit)")
    }

    /// The primitives of all steps, in order, where `stress` σ is in [0, 1] and `allowed` holds. The first step acts on what is
    /// left of the heightfield and on the walls of what was carved before, a further one on the walls that the last ones left.
    /// The same on any number of threads.
    pub fn erode(
        &self,
        site: &Site<'_>,
        stress: impl Fn(DVec3) -> f64 + Sync,
        allowed: impl Fn(DVec3) -> bool + Sync,
        seed: u32,
    ) -> Vec<Primitive> {
        let mut all: Vec<Primitive> = Vec::new();
        let enough = |low: DVec2, high: DVec2| largest(site.most, low, high) >= self.threshold;
        let mut candidates = sprinkle(site.surface, &site.region, self.spacing, enough, mix(seed, 0));
        for step in 0..self.steps {
            let seed = mix(seed, step + 1);
            let from = if step == 0 { site.before } else { &all };
            if !from.is_empty() {
                let so_far = if step == 0 { from.to_vec() } else { site.before.iter().chain(&all).copied().collect() };
                let Ok(solid) = Volume::terrain(site.ground.clone(), so_far) else { break };
                // Of the heightfield only what nothing has changed is still surface.
                candidates.retain(|p| step == 0 && solid.value(*p) == site.ground.value(*p));
                candidates.extend(on_walls(&solid, from, self.radius, seed));
            }
            let within: Vec<(DVec3, f64)> = candidates
                .par_iter()
                .filter(|p| site.region.contains(**p) && allowed(**p))
                .map(|&p| (p, stress(p)))
                // No rock raises the effect above σ.
                .filter(|&(_, sigma)| sigma >= self.threshold && sigma > 0.0)
                .collect();
            let made: Vec<Primitive> = thin(&within, self.spacing, seed)
                .into_par_iter()
                .filter_map(|(p, sigma)| self.sphere(p, Attack { resistance: site.geology.value(p), stress: sigma }))
                .collect();
            let done = made.is_empty();
            all.extend(made);
            if done || all.len() >= site.limit {
                break;
            }
        }
        all.truncate(site.limit);
        all
    }

    /// What carves at `p`; `None` below the threshold.
    fn sphere(&self, p: DVec3, attack: Attack) -> Option<Primitive> {
        let effect = attack.effect(self.hardest);
        let skeleton = Skeleton::Point(p.to_array().map(|c| c as f32));
        let energy = (-self.strength * effect) as f32;
        (effect >= self.threshold && energy < 0.0).then_some(Primitive { skeleton, radius: self.radius as f32, energy })
    }
}

/// Points where rays from the centres of `carvers` that are in the air meet rock. Those wider than `radius` send as many more as
/// their surface is larger.
fn on_walls(solid: &Volume, carvers: &[Primitive], radius: f64, seed: u32) -> Vec<DVec3> {
    let rays = |one: &Primitive| {
        let from = centre(one);
        let (random, reach) = (Random::at(seed, from), REACH * f64::from(one.radius));
        let wider = (f64::from(one.radius) / radius).clamp(1.0, MOST_WIDER);
        let rays = (f64::from(RAYS) * wider * wider) as u32;
        let open = solid.value(from) < THRESHOLD;
        (0..if open { rays } else { 0 }).filter_map(move |ray| wall(solid, from, random.direction(ray), reach))
    };
    carvers.par_iter().flat_map_iter(rays).collect()
}

/// The first rock along a ray from air.
fn wall(carved: &Volume, from: DVec3, direction: DVec3, reach: f64) -> Option<DVec3> {
    let step = reach / f64::from(STEPS);
    let rock = |t: f64| carved.value(from + direction * t) >= THRESHOLD;
    let hit = (1..=STEPS).map(|k| step * f64::from(k)).find(|&t| rock(t))?;
    let (mut air, mut stone) = (hit - step, hit);
    for _ in 0..HALVINGS {
        let middle = air.midpoint(stone);
        *(if rock(middle) { &mut stone } else { &mut air }) = middle;
    }
    Some(from + direction * stone)
}

fn centre(primitive: &Primitive) -> DVec3 {
    match primitive.skeleton {
        Skeleton::Point(at) => DVec3::from_array(at.map(f64::from)),
        _ => {
            let support = primitive.support();
            support.low.midpoint(support.high)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geology::Archetype;
    use crate::implicit::heightfield::Implicitisation;

    /// A cliff along x = 30 m from −10 to 20 m, in 60 m of ground.
    fn cliff() -> Volume {
        let height = |k: usize| if k % 61 < 30 { -10.0 } else { 20.0 };
        let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 61, 61, (0..61 * 61).map(height).collect()).unwrap();
        Implicitisation::of(&grid, 3.0).volume(&grid).unwrap()
    }

    fn eroded(volume: &Volume, threads: usize, seed: u32, erosion: &Shallow) -> Vec<Primitive> {
        on(volume, &[], threads, seed, erosion)
    }

    fn on(volume: &Volume, before: &[Primitive], threads: usize, seed: u32, erosion: &Shallow) -> Vec<Primitive> {
        let Volume::Ground(surface, _) = volume else { panic!("a ground") };
        let geology = Archetype::HorizontalStrata.geology();
        let region = Box3::new(DVec3::new(5.0, 5.0, -6.0), DVec3::new(55.0, 55.0, 6.0));
        let most = Grid::new(DVec2::ZERO, DVec2::ONE, 61, 61, vec![1.0f32; 61 * 61]).unwrap();
        let site = Site { ground: volume, before, surface, geology: &geology, region, most: &most, limit: usize::MAX };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| erosion.erode(&site, |p| (1.0 - p.z.abs() / 6.0).max(0.0), |p| p.y < 40.0, seed))
    }

    #[test]
    fn samples_lie_on_the_surface_apart_from_each_other_where_they_are_allowed() {
        let volume = cliff();
        let erosion = Shallow { spacing: 3.0, radius: 5.0, ..Shallow::default() };
        let made = eroded(&volume, 1, 4, &erosion);
        assert!(made.len() > 25, "{}", made.len());
        let nearest = |all: &[Primitive]| {
            let pairs = (0..all.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            pairs.map(|(i, j)| centre(&all[i]).distance(centre(&all[j]))).fold(f64::INFINITY, f64::min)
        };
        // Centres are rounded to f32.
        assert!(nearest(&made) >= 3.0 * (1.0 - 1e-6), "{}", nearest(&made));
        for one in &made {
            let p = centre(one);
            assert!((volume.value(p) - THRESHOLD).abs() < 1e-4 && p.z.abs() <= 6.0 && p.y < 40.0, "{p}");
            assert!(one.energy < 0.0 && one.energy >= -1.2);
        }
        // The other way round, a dense set leaves no place free: any point of the wall has a sample near.
        let far = (0..200).filter(|k| {
            let p = DVec3::new(29.5, 8.0 + 0.15 * f64::from(*k), 0.0);
            !made.iter().any(|one| centre(one).distance(p) < 2.0 * 3.0)
        });
        assert_eq!(far.count(), 0);
        // Control: the samples of a smaller spacing are too near.
        let close = eroded(&volume, 1, 4, &Shallow { spacing: 2.0, ..erosion });
        assert!(nearest(&close) < 3.0 && close.len() > made.len());
    }

    #[test]
    fn what_was_carved_before_is_eroded_and_what_it_took_is_not() {
        let volume = cliff();
        // A cave whose mouth is in the wall.
        let cave = |x: f32| Primitive { skeleton: Skeleton::Point([x, 20.0, 0.0]), radius: 8.0, energy: -3.0 };
        let before = [cave(29.0), cave(33.0), cave(37.0)];
        let erosion = Shallow { spacing: 2.0, radius: 3.0, ..Shallow::default() };
        let solid = Volume::terrain(volume.clone(), before.to_vec()).unwrap();
        let off =
            |made: &[Primitive]| made.iter().filter(|one| (solid.value(centre(one)) - THRESHOLD).abs() > 0.05).count();
        let made = on(&volume, &before, 1, 4, &erosion);
        assert_eq!(made, on(&volume, &before, 2, 4, &erosion));
        assert_eq!(off(&made), 0);
        assert!(made.iter().filter(|one| centre(one).x > 33.0).count() > 5, "the cave's own walls");
        // Control: samples of the heightfield alone hang in the mouth.
        assert!(off(&on(&volume, &[], 1, 4, &erosion)) > 0);
    }

    #[test]
    fn steps_go_deeper_and_threads_do_not_matter() {
        let volume = cliff();
        let once = Shallow { spacing: 3.0, radius: 5.0, ..Shallow::default() };
        let thrice = Shallow { steps: 3, ..once };
        let all = eroded(&volume, 1, 4, &thrice);
        assert_eq!(all, eroded(&volume, 2, 4, &thrice));
        assert_ne!(all, eroded(&volume, 1, 5, &thrice), "another seed, other samples");
        let first = eroded(&volume, 1, 4, &once);
        assert_eq!(all[..first.len()], first);
        let depth = |all: &[Primitive]| all.iter().map(|one| centre(one).x).fold(0.0, f64::max);
        assert!(depth(&all) > depth(&first) + 1.0, "{} {}", depth(&all), depth(&first));
        // What was rock behind the wall is air.
        let carved = Volume::terrain(volume.clone(), all).unwrap();
        let behind = DVec3::new(31.5, 20.0, 0.0);
        assert!(volume.value(behind) > THRESHOLD && carved.value(behind) < THRESHOLD);
    }
}
