//! An implicit terrain along a ray, for the tracers of `model`: h(t) = T − f(p(t)), positive in the air, in units of f. Every
//! point is in the domain, so weights are 1.

use super::volume::Volume;
use crate::field::{Box3, Density, THRESHOLD};
use glam::DVec3;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::trace::{Answer, Ray, RayBounds, RayFunction, RayPoint, Settings, accelerated, segment, sphere};

/// When a tracer of densities stops: ε is in units of f.
pub const SETTINGS: Settings = Settings { epsilon: 1e-4, bracket: 1e-2, edge: 1e-7, max_steps: 200_000 };

/// A volume prepared for tracing.
#[derive(Debug)]
pub struct Traceable<'a> {
    volume: &'a Volume,
    support: Box3,
    slope: f64,
}

/// How finely the global slope bound is sought: boxes a side along the support's longest.
const PARTS: f64 = 64.0;

impl<'a> Traceable<'a> {
    /// Bounds |∇f| by the largest bound of the boxes that may hold the surface: the tight global bound.
    pub fn new(volume: &'a Volume) -> Traceable<'a> {
        let support = volume.support();
        let mut surface = Traceable { volume, support, slope: 0.0 };
        let size = support.high - support.low;
        let side = size.max_element() / PARTS;
        let counts = (size / side).ceil().max(DVec3::ONE);
        let [nx, ny, nz] = counts.to_array().map(|n| n as u64);
        for k in 0..nx * ny * nz {
            let at = DVec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / nx / ny) as f64);
            let [low, high] = [at - 1e-9, at + (1.0 + 1e-9)].map(|at| support.low + at * side);
            // Steps are taken in the air and end at the surface: what is all rock is never crossed.
            let bounds = volume.bounds(&Box3 { low, high });
            if bounds.range.lo() <= THRESHOLD {
                surface.slope = surface.slope.max(bounds.slope);
            }
        }
        surface
    }
    /// λ: f changes by no more than this a metre where there is air, 1/metre.
    pub fn slope(&self) -> f64 {
        self.slope
    }
}

/// Follows one ray.
#[derive(Debug)]
pub struct DensityRay<'a> {
    surface: &'a Traceable<'a>,
    ray: Ray,
    evaluations: u64,
}

/// The tracers of densities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracer {
    /// One slope bound for all of the terrain.
    Sphere,
    /// The slope bound of a box around a candidate segment.
    Accelerated,
    /// Bounds of f′ along the candidate segment (Galin 2020).
    Segment,
}

impl Tracer {
    /// All of them.
    pub const ALL: [Tracer; 3] = [Tracer::Sphere, Tracer::Accelerated, Tracer::Segment];
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Tracer::Sphere => "sphere",
            Tracer::Accelerated => "accelerated",
            Tracer::Segment => "segment",
        }
    }
    /// Traces one ray.
    pub fn trace(self, ray: &mut DensityRay<'_>, settings: &Settings) -> Answer {
        match self {
            Tracer::Sphere => sphere::trace(ray, ray.surface.slope, 0.0, settings),
            Tracer::Accelerated => accelerated::trace(ray, settings),
            Tracer::Segment => segment::trace(ray, settings),
        }
    }
}

impl<'a> DensityRay<'a> {
    /// A ray through `surface`.
    pub fn new(surface: &'a Traceable<'a>, ray: Ray) -> DensityRay<'a> {
        DensityRay { surface, ray, evaluations: 0 }
    }
    /// The points of the ray at `t`, with their derivatives by t.
    fn along(&self, t: Interval) -> [Dual<Interval, 1>; 3] {
        let t = Dual::<Interval, 1>::variable(t, 0);
        let fixed = |x: f64| Dual::fixed(Interval::point(x));
        std::array::from_fn(|k| fixed(self.ray.origin[k]) + fixed(self.ray.direction[k]) * t)
    }
    fn region(p: [Dual<Interval, 1>; 3]) -> Box3 {
        let p = p.map(|x| x.value);
        Box3 { low: DVec3::from_array(p.map(Interval::lo)), high: DVec3::from_array(p.map(Interval::hi)) }
    }
}

/// What enclosures prove about a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Certified {
    /// Air up to `t0`, rock at `t1`, the two no farther apart than asked.
    Hit {
        /// Metres along the ray.
        t0: f64,
        /// Metres along the ray.
        t1: f64,
    },
    /// Rock where the ray starts or enters the support.
    Inside,
    /// Air all along.
    Miss,
    /// Air up to here; the next piece withstood.
    Undecided {
        /// Metres along the ray.
        t: f64,
    },
}

impl DensityRay<'_> {
    /// The first hit within `bracket` metres, proved. Never asks for `bounds`, only for enclosures of f and f′ along the ray,
    /// so that it can convict a wrong bound.
    pub fn certify(&mut self, bracket: f64) -> Certified {
        let Some((start, end)) = self.span() else { return Certified::Miss };
        let at = |ray: &mut Self, t: f64| ray.enclose(t, t).height;
        if at(self, start).hi() < 0.0 {
            return Certified::Inside;
        }
        let (mut t, mut delta) = (start, 1.0);
        while t < end {
            let far = (t + delta).min(end).max(t.next_up());
            let over = self.enclose(t, far);
            let middle = 0.5 * (t + far);
            let reach = (far - t).next_up();
            // Mean value form: f is Lipschitz, its slope enclosed on both sides of every crease.
            let clear =
                over.height.lo() > 0.0 || (at(self, middle) + over.slope * Interval::symmetric(0.5 * reach)).lo() > 0.0;
            if clear {
                (t, delta) = (far, 2.0 * delta);
            } else if far - t > bracket {
                delta = 0.5 * (far - t);
            } else if at(self, far).hi() < 0.0 {
                return Certified::Hit { t0: t, t1: far };
            } else {
                return Certified::Undecided { t };
            }
        }
        Certified::Miss
    }
}

impl RayFunction for DensityRay<'_> {
    fn span(&self) -> Option<(f64, f64)> {
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (o, u) = (self.ray.origin[k], self.ray.direction[k]);
            let (low, high) = (self.surface.support.low[k], self.surface.support.high[k]);
            if u == 0.0 {
                if o < low || o > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - o) / u, (high - o) / u);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some((near, far))
    }
    fn value(&mut self, t: f64) -> RayPoint {
        self.evaluations += 1;
        RayPoint { height: THRESHOLD - self.surface.volume.value(self.ray.at(t)), weight: 1.0 }
    }
    fn slope(&mut self, t: f64) -> f64 {
        self.evaluations += 1;
        -self.surface.volume.sample(self.ray.at(t)).1.dot(self.ray.direction)
    }
    fn bounds(&mut self, t0: f64, t1: f64) -> RayBounds {
        self.evaluations += 1;
        let region = DensityRay::region(self.along(Interval::new(t0, t1)));
        let bounds = self.surface.volume.bounds(&region);
        RayBounds {
            height: Interval::point(THRESHOLD) - bounds.range,
            slope: Interval::symmetric(bounds.slope),
            weight: Interval::point(1.0),
            weight_slope: 0.0,
        }
    }
    fn enclose(&mut self, t0: f64, t1: f64) -> RayBounds {
        self.evaluations += 1;
        let p = self.along(Interval::new(t0, t1));
        let h = Dual::fixed(Interval::point(THRESHOLD)) - self.surface.volume.density(p);
        RayBounds { height: h.value, slope: h.slope[0], weight: Interval::point(1.0), weight_slope: 0.0 }
    }
    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

#[cfg(test)]
mod tests {
    use super::super::heightfield::tests::ground;
    use super::super::primitive::Primitive;
    use super::super::sigmoid::Sigmoid;
    use super::super::skeleton::Skeleton;
    use super::*;
    use terrain_model::noise::hash;

    fn random(k: u32) -> f64 {
        f64::from(hash::mix(11, k)) / 4_294_967_296.0
    }

    fn carved() -> Volume {
        let point = |k: u32| {
            let at = |j: u32, low: f64, size: f64| (low + size * random(4 * k + j)) as f32;
            let skeleton = Skeleton::Point([at(0, 100.0, 64.0), at(1, -20.0, 72.0), at(2, -10.0, 18.0)]);
            Primitive { skeleton, radius: 4.0, energy: if k.is_multiple_of(3) { 0.7 } else { -0.8 } }
        };
        Volume::terrain(ground(Sigmoid::UnitFree, 3.0), (0..120).map(point).collect()).unwrap()
    }

    fn ray(k: u32) -> Ray {
        let at = |j: u32| random(10_000 + 6 * k + j);
        let origin = DVec3::new(95.0 + 75.0 * at(0), -25.0 + 82.0 * at(1), 18.0);
        let towards = DVec3::new(95.0 + 75.0 * at(2), -25.0 + 82.0 * at(3), -15.0 * at(4));
        Ray { origin, direction: (towards - origin).normalize() }
    }

    /// Where f first reaches T, by values alone, 5 mm apart.
    fn walked(terrain: &Volume, ray: &Ray, end: f64) -> Option<f64> {
        (0..).map(|k| f64::from(k) * 5e-3).take_while(|&t| t <= end).find(|&t| terrain.value(ray.at(t)) >= THRESHOLD)
    }

    #[test]
    fn every_tracer_meets_the_surface_first_where_values_do() {
        let terrain = carved();
        let surface = Traceable::new(&terrain);
        let (mut hits, mut misses, mut proved) = (0, 0, 0);
        for k in 0..150 {
            let ray = ray(k);
            let first = walked(&terrain, &ray, 150.0);
            for tracer in Tracer::ALL {
                let answer = tracer.trace(&mut DensityRay::new(&surface, ray), &SETTINGS);
                match (answer, first) {
                    (Answer::Hit { t }, Some(first)) => {
                        // A walk may pass a sliver that the tracer finds; it cannot be earlier than the tracer but for ε.
                        assert!(t <= first + 1e-2, "{} ray {k}: {t} behind {first}", tracer.name());
                        let after = terrain.value(ray.at(t + SETTINGS.bracket));
                        assert!(
                            (terrain.value(ray.at(t)) - THRESHOLD).abs() < 2.0 * SETTINGS.epsilon || after > THRESHOLD
                        );
                        hits += 1;
                    }
                    (Answer::Miss, None) => misses += 1,
                    // Thinner than the walk's step.
                    (Answer::Hit { t }, None) => assert!((terrain.value(ray.at(t)) - THRESHOLD).abs() < 1e-3),
                    other => panic!("{} ray {k}: {other:?}", tracer.name()),
                }
                match DensityRay::new(&surface, ray).certify(1e-3) {
                    Certified::Hit { t0, t1 } => {
                        let t = answer.distance().expect("a hit is proved");
                        assert!(t0 - SETTINGS.bracket <= t && t <= t1 + 1e-9, "{} ray {k}: {t} {t0}", tracer.name());
                        proved += 1;
                    }
                    Certified::Miss => assert_eq!(answer, Answer::Miss),
                    Certified::Inside => panic!("ray {k} starts in the air"),
                    Certified::Undecided { .. } => {}
                }
            }
        }
        assert!(hits > 300 && misses > 3 && proved > 300, "{hits} hits, {misses} misses, {proved} proved");
    }

    /// The control: a slope bound that is too small makes the sphere tracer pass what values meet.
    #[test]
    fn a_tenth_of_the_slope_bound_misses_surfaces() {
        let terrain = carved();
        let mut surface = Traceable::new(&terrain);
        surface.slope *= 0.1;
        let late = (0..150).filter(|&k| {
            let Some(first) = walked(&terrain, &ray(k), 150.0) else { return false };
            let answer = Tracer::Sphere.trace(&mut DensityRay::new(&surface, ray(k)), &SETTINGS);
            answer.distance().is_none_or(|t| t > first + 0.1)
        });
        assert!(late.count() > 0);
    }

    #[test]
    fn bounds_along_a_ray_enclose_its_values() {
        let terrain = carved();
        let surface = Traceable::new(&terrain);
        for k in 0..300 {
            let mut ray = DensityRay::new(&surface, ray(k));
            let (t0, size) = (40.0 * random(3 * k + 1), 12.0 * random(3 * k + 2));
            let (boxed, exact) = (ray.bounds(t0, t0 + size), ray.enclose(t0, t0 + size));
            let values: Vec<f64> = (0..=20).map(|j| ray.value(t0 + size * f64::from(j) / 20.0).height).collect();
            for bounds in [boxed, exact] {
                assert!(values.iter().all(|h| bounds.height.contains(*h)), "{bounds:?}");
                for pair in values.windows(2) {
                    let slope = (pair[1] - pair[0]) / (size / 20.0);
                    assert!(
                        bounds.slope.lo() - 1e-9 <= slope && slope <= bounds.slope.hi() + 1e-9,
                        "{slope} {bounds:?}"
                    );
                }
            }
        }
    }
}
