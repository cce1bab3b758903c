//! Marching tracers against the certified one, ray by ray: families of rays drawn from a seed, counted apart.

use super::scenes::TableScene;
use crate::experiment::ExperimentError;
use rayon::prelude::*;
use std::f64::consts::TAU;
use terrain_model::bounds::THRESHOLD;
use terrain_model::program::{Cells, Evidence, Program};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};

use glam::{DVec2, DVec3};

/// How rays are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Through a random point of the scene's picture.
    Camera,
    /// Close above the ground and nearly along it.
    Grazing,
    /// From under the ground or under the model.
    FromBelow,
    /// From outside the support, at any height.
    Outside,
    /// Along the border of the domain.
    DomainEdge,
}

impl Family {
    /// All of them.
    pub const ALL: [Family; 5] =
        [Family::Camera, Family::Grazing, Family::FromBelow, Family::Outside, Family::DomainEdge];
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Family::Camera => "camera",
            Family::Grazing => "grazing",
            Family::FromBelow => "from below",
            Family::Outside => "outside",
            Family::DomainEdge => "domain edge",
        }
    }
}

/// SplitMix64, one stream a ray: the rays do not depend on how they are shared out.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn for_ray(seed: u64, index: u64) -> Random {
        Random(seed ^ index.wrapping_mul(0xD6E8_FEB8_6659_FD93))
    }
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    pub(crate) fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
    fn heading(&mut self) -> DVec2 {
        let angle = self.range(0.0, TAU);
        DVec2::new(libm::cos(angle), libm::sin(angle))
    }
}

/// What rays are drawn over.
pub struct Ground<'a> {
    /// The terrain.
    pub program: &'a Program,
    /// The picture's camera.
    pub camera: Camera,
    /// Box of interest, metres: where the picture's ground lies.
    pub extent: (DVec2, DVec2),
    /// Lowest and highest ground, metres.
    pub elevations: [f64; 2],
}

impl Ground<'_> {
    /// Ray `index` of the sequence that `seed` starts, with its family.
    pub fn ray(&self, seed: u64, index: u64) -> (Family, Ray) {
        let family = Family::ALL[(index % 5) as usize];
        let mut random = Random::for_ray(seed, index);
        (family, self.draw(family, &mut random))
    }
    /// Ray `index` of those that climb past `focus`, the steepest place: where a slope bound that is too small is wrong.
    fn climbing(&self, focus: DVec2, seed: u64, index: u64) -> Ray {
        let mut random = Random::for_ray(seed, index);
        let size = (self.extent.1 - self.extent.0).max_element();
        let p = focus + random.heading() * size * 1e-3 * random.range(0.0, 1.0);
        let sample = self.program.sample(p);
        let uphill = if sample.gradient.length() > 0.0 { sample.gradient.normalize() } else { random.heading() };
        let toward = (uphill + random.heading() * 0.3).normalize();
        let back = size * random.range(0.001, 0.02);
        let start = p - toward * back;
        // Above the ground at its start and headed a little below the surface at p.
        let z = self.program.height(start).0 + back * random.range(0.02, 0.6);
        let target = sample.elevation - back * random.range(0.0, 0.1);
        Ray { origin: start.extend(z), direction: (p.extend(target) - start.extend(z)).normalize() }
    }
    fn point(&self, random: &mut Random) -> DVec2 {
        let (lo, hi) = self.extent;
        DVec2::new(random.range(lo.x, hi.x), random.range(lo.y, hi.y))
    }
    fn draw(&self, family: Family, random: &mut Random) -> Ray {
        let (lo, hi) = self.extent;
        let size = (hi - lo).max_element();
        let relief = (self.elevations[1] - self.elevations[0]).max(1e-3 * size);
        let aimed = |origin: DVec3, target: DVec3| {
            let d = target - origin;
            Ray { origin, direction: if d.length() > 0.0 { d.normalize() } else { DVec3::NEG_Z } }
        };
        match family {
            Family::Camera => {
                let x = random.range(0.0, self.camera.width() as f64);
                let y = random.range(0.0, self.camera.height() as f64);
                self.camera.ray(x, y)
            }
            Family::Grazing => {
                let p = self.point(random);
                let above = relief * 0.2 * random.range(0.0, 1.0);
                let origin = p.extend(self.program.height(p).0 + above * above / relief + 0.01);
                let heading = random.heading();
                Ray { origin, direction: heading.extend(random.range(-0.12, 0.06)).normalize() }
            }
            Family::FromBelow => {
                let p = self.point(random);
                let ground = if random.next() & 1 == 0 { self.program.height(p).0 } else { self.elevations[0] };
                let origin = p.extend(ground - relief * random.range(0.0, 0.5));
                let away = self.point(random);
                aimed(origin, away.extend(random.range(self.elevations[0], self.elevations[1] + relief)))
            }
            Family::Outside => {
                let centre = 0.5 * (lo + hi);
                let start = centre + random.heading() * size * random.range(1.5, 3.0);
                let origin = start.extend(random.range(self.elevations[0] - relief, self.elevations[1] + 0.5 * size));
                let target = self.point(random);
                aimed(origin, target.extend(random.range(self.elevations[0], self.elevations[1])))
            }
            Family::DomainEdge => {
                // A point of the border by bisection outward from inside, then along the level line of the weight.
                let heading = random.heading();
                let inside = self.point(random);
                let (mut near, mut far) = (0.0, 4.0 * size);
                for _ in 0..50 {
                    let middle = 0.5 * (near + far);
                    if self.program.height(inside + heading * middle).1 >= THRESHOLD {
                        near = middle
                    } else {
                        far = middle
                    }
                }
                let border = inside + heading * near;
                let gradient = self.program.sample(border).weight_gradient;
                let along = if gradient.length() > 0.0 { gradient.perp().normalize() } else { heading.perp() };
                let turned = (along + random.heading() * 0.02).normalize();
                let start = border - turned * size * random.range(0.1, 0.8);
                let z = random.range(self.elevations[0] - 0.1 * relief, self.elevations[1]);
                let target = self.program.height(border).0 + relief * random.range(-0.1, 0.1);
                aimed(start.extend(z), (border + random.heading() * 0.01 * size).extend(target))
            }
        }
    }
}

/// One scene's tracers and rays, as every comparison with the certified tracer has them.
pub struct Trial<'a> {
    /// When a marching tracer stops.
    pub settings: Settings,
    /// τ and the budget of the certified tracer.
    pub effort: Effort,
    /// Where the rays are drawn.
    pub ground: Ground<'a>,
}

impl<'a> Trial<'a> {
    /// ε is a thousandth of a millimetre per metre of the scene, at least a millimetre; τ = ε/√(1 + λ²), a piece of a ray
    /// over which h cannot change by ε. `extent` is the scene's size in metres.
    ///
    /// # Errors
    /// When the scene has no camera called `main`.
    pub fn new(scene: &'a TableScene, surface: &Surface<'_>, extent: DVec2) -> Result<Trial<'a>, ExperimentError> {
        let placement =
            scene.scene.cameras.get("main").ok_or_else(|| ExperimentError::failed("a scene needs a main camera"))?;
        let epsilon = (1e-6 * extent.max_element()).max(1e-3);
        // Of a million rays one runs so nearly along the ground that steps of the global slope bound need more than the
        // default's 200 000.
        let max_steps = 20_000_000;
        let settings = Settings { epsilon, bracket: 10.0 * epsilon, edge: 1e-4 * epsilon, max_steps };
        let steepest = (1.0 + surface.global().slope * surface.global().slope).sqrt();
        let effort = Effort { bracket: epsilon / steepest, budget: 20_000 };
        let camera = Camera::new(placement, 1920, 1080);
        let elevations = elevation_range(&scene.program, extent);
        let ground = Ground { program: &scene.program, camera, extent: (DVec2::ZERO, extent), elevations };
        Ok(Trial { settings, effort, ground })
    }
}

/// Lowest and highest ground of a raster of 256 × 256 samples, metres.
fn elevation_range(program: &Program, extent: DVec2) -> [f64; 2] {
    let baked = program.bake(DVec2::ZERO, extent / 255.0, 256, 256);
    let ground = baked
        .elevation
        .iter()
        .zip(&baked.weight)
        .filter(|(_, w)| f64::from(**w) >= THRESHOLD)
        .map(|(e, _)| f64::from(*e));
    ground.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], e| [lo.min(e), hi.max(e)])
}

/// What a comparison counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays compared.
    pub rays: u64,
    /// Rays on which the certified tracer found the surface.
    pub hits: u64,
    /// Rays on which it found a wall.
    pub walls: u64,
    /// Answers that lie beyond the certified bracket plus τ, or are none.
    pub missed_hits: u64,
    /// Answers where h ≥ ε is proved, or where a miss is certified.
    pub false_hits: u64,
    /// Rays that ran out of steps.
    pub gave_up: u64,
    /// Rays the certified tracer could not decide: never counted as agreement.
    pub undecided: u64,
    /// Largest distance by which a hit lies before the certified bracket, metres.
    pub max_early: f64,
    /// Evaluations of the marching tracer.
    pub evaluations: u64,
}

impl Tally {
    fn merge(self, o: Tally) -> Tally {
        Tally {
            rays: self.rays + o.rays,
            hits: self.hits + o.hits,
            walls: self.walls + o.walls,
            missed_hits: self.missed_hits + o.missed_hits,
            false_hits: self.false_hits + o.false_hits,
            gave_up: self.gave_up + o.gave_up,
            undecided: self.undecided + o.undecided,
            max_early: self.max_early.max(o.max_early),
            evaluations: self.evaluations + o.evaluations,
        }
    }
    /// Does every decided ray agree?
    pub fn clean(&self) -> bool {
        self.missed_hits == 0 && self.false_hits == 0 && self.gave_up == 0
    }
    /// One answer against the truth.
    fn count(&mut self, answer: Answer, truth: Certified, above: impl FnOnce(f64) -> bool, bracket: f64) {
        self.rays += 1;
        self.gave_up += u64::from(matches!(answer, Answer::GaveUp { .. }));
        match truth {
            Certified::Hit { t0, t1 } | Certified::Wall { t0, t1 } => {
                let is_hit = matches!(truth, Certified::Hit { .. });
                self.hits += u64::from(is_hit);
                self.walls += u64::from(!is_hit);
                match answer.distance() {
                    Some(t) if t <= t1 + bracket => {
                        if let Answer::Hit { t } = answer {
                            self.max_early = self.max_early.max(t0 - t);
                            self.false_hits += u64::from(above(t));
                        }
                    }
                    _ => self.missed_hits += 1,
                }
            }
            Certified::Miss => self.false_hits += u64::from(answer.distance().is_some()),
            Certified::Undecided { .. } => self.undecided += 1,
        }
    }
}

/// Compares tracers, each over its own surface of the same program, on rays `first..first + count` of the sequence.
/// Returns a tally for each tracer and family.
pub fn compare(
    ground: &Ground<'_>,
    tracers: &[(Tracer, &Surface<'_>)],
    settings: &Settings,
    effort: &Effort,
    seed: u64,
    rays: std::ops::Range<u64>,
    advance: &(dyn Fn(u64) + Sync),
) -> Vec<[Tally; 5]> {
    compare_rays(ground, tracers, settings, effort, rays, &|index| ground.ray(seed, index), advance)
}

/// [`compare`] on rays that climb past the steepest place; the tallies stand under one family.
pub fn compare_climbing(
    ground: &Ground<'_>,
    tracers: &[(Tracer, &Surface<'_>)],
    settings: &Settings,
    effort: &Effort,
    (seed, focus): (u64, DVec2),
    rays: std::ops::Range<u64>,
) -> Vec<[Tally; 5]> {
    let draw = |index| (Family::Grazing, ground.climbing(focus, seed, index));
    compare_rays(ground, tracers, settings, effort, rays, &draw, &|_| {})
}

fn compare_rays(
    ground: &Ground<'_>,
    tracers: &[(Tracer, &Surface<'_>)],
    settings: &Settings,
    effort: &Effort,
    rays: std::ops::Range<u64>,
    draw: &(dyn Fn(u64) -> (Family, Ray) + Sync),
    advance: &(dyn Fn(u64) + Sync),
) -> Vec<[Tally; 5]> {
    const CHUNK: u64 = 256;
    let cells = Cells::new(ground.program, Evidence::Enclosures);
    let chunks: Vec<u64> = (rays.start..rays.end).step_by(CHUNK as usize).collect();
    chunks
        .into_par_iter()
        .map(|start| {
            let mut fields: Vec<HeightRay<'_>> = tracers.iter().map(|(_, surface)| HeightRay::new(surface)).collect();
            let mut oracle = CertifiedTracer::over(&cells);
            let mut tallies = vec![[Tally::default(); 5]; tracers.len()];
            let end = (start + CHUNK).min(rays.end);
            for index in start..end {
                let (family, ray) = draw(index);
                let truth = oracle.trace(&ray, effort);
                for (k, (tracer, surface)) in tracers.iter().enumerate() {
                    let field = &mut fields[k];
                    field.aim(ray);
                    let answer = tracer.trace(surface, field, settings);
                    let tally = &mut tallies[k][family as usize];
                    tally.evaluations += field.evaluations();
                    tally.count(answer, truth, |t| oracle.above_at(&ray, t, settings.epsilon), effort.bracket);
                }
            }
            advance(end - start);
            tallies
        })
        .reduce(
            || vec![[Tally::default(); 5]; tracers.len()],
            |mut a, b| {
                for (x, y) in a.iter_mut().flatten().zip(b.into_iter().flatten()) {
                    *x = x.merge(y);
                }
                a
            },
        )
}

/// All families together.
pub fn total(tallies: &[Tally; 5]) -> Tally {
    tallies.iter().fold(Tally::default(), |sum, tally| sum.merge(*tally))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_counted_by_where_they_lie() {
        let truth = Certified::Hit { t0: 10.0, t1: 10.001 };
        let count = |answer, truth, above: bool| {
            let mut tally = Tally::default();
            tally.count(answer, truth, |_| above, 0.001);
            (tally.missed_hits, tally.false_hits, tally.undecided)
        };
        assert_eq!(count(Answer::Hit { t: 9.9995 }, truth, false), (0, 0, 0));
        assert_eq!(count(Answer::Hit { t: 10.0025 }, truth, false), (1, 0, 0));
        assert_eq!(count(Answer::Miss, truth, false), (1, 0, 0));
        assert_eq!(count(Answer::Hit { t: 5.0 }, truth, true), (0, 1, 0));
        assert_eq!(count(Answer::Hit { t: 5.0 }, Certified::Miss, false), (0, 1, 0));
        assert_eq!(count(Answer::Miss, Certified::Miss, false), (0, 0, 0));
        assert_eq!(count(Answer::Miss, Certified::Undecided { t0: 1.0, t1: 2.0 }, false), (0, 0, 1));
    }

    #[test]
    fn tallies_do_not_depend_on_threads_and_follow_the_seed() {
        let scene = crate::scenes::load("builtin:fig19").unwrap();
        let program = scene.program(scene.ground()).unwrap();
        let surface = Surface::new(&program);
        let ground = Ground {
            program: &program,
            camera: Camera::new(&scene.cameras["main"], 192, 108),
            extent: (DVec2::ZERO, DVec2::splat(200_000.0)),
            elevations: [-1500.0, 8000.0],
        };
        let settings = Settings { epsilon: 0.2, bracket: 2.0, edge: 2e-5, ..Settings::default() };
        let effort = Effort { bracket: 0.05, budget: 20_000 };
        let tally = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let tracers = [(Tracer::Accelerated, &surface)];
            pool.install(|| compare(&ground, &tracers, &settings, &effort, seed, 0..300, &|_| {}))
        };
        let one = tally(1, 7);
        assert_eq!(one, tally(3, 7));
        assert_ne!(one, tally(1, 8));
        let all = total(&one[0]);
        assert!(all.clean() && all.rays == 300 && all.hits > 50, "{all:?}");
    }
}
