//! A plain shader: ground by elevation, slope and the densities of sand and plants, water at its own elevation, one sun with
//! cast shadows, sky light, haze with distance.

mod material;

use super::camera::Camera;
use super::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};
use crate::bounds::THRESHOLD;
use crate::program::{Evaluator, Program};
use crate::scene::Appearance;
use glam::{DVec2, DVec3};
use material::{Ground, Mottle, ground, light, mirror, section, sky, smooth, water};
use rayon::prelude::*;

/// What the sun, the air and the ground look like.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Unit vector towards the sun.
    pub sun: DVec3,
    /// Elevations of the lowest and highest ground, metres: colours are spread between them.
    pub elevations: [f64; 2],
    /// Diagonal of the scene, metres: the scale of what colours vary by.
    pub size: f64,
    /// Distance at which haze takes half of the colour, metres.
    pub haze: f64,
    /// Elevation of the underside, metres: a cut below it is not drawn, so that the terrain looks like a block. It is
    /// traced as any other.
    pub floor: f64,
    /// Whether the ground casts shadows: one more ray for each pixel that faces the sun.
    pub shadows: bool,
    /// Elevation above which snow lies, metres; infinite for none.
    pub snow: f64,
    /// Bare ochre ground instead of soil and grass.
    pub arid: bool,
}

impl Look {
    /// Light from the west over a terrain with opposite corners `low` and `high`, ground between `elevations`; snow on
    /// the upper sixth of a relief of more than 1500 m.
    pub fn over(low: DVec2, high: DVec2, elevations: [f64; 2]) -> Look {
        let size = (high - low).length();
        let sun = DVec3::new(-0.86, -0.24, 0.40).normalize();
        let relief = elevations[1] - elevations[0];
        let snow = if relief > 1500.0 { elevations[1] - relief / 6.0 } else { f64::INFINITY };
        let floor = elevations[0] - 0.02 * size;
        Look { sun, elevations, size, haze: 14.0 * size, floor, shadows: true, snow, arid: false }
    }
    /// What suits a picture: elevations and distances of 576 of its rays, the extremes left out.
    pub fn seen(ground: &Surface<'_>, camera: &Camera) -> Look {
        const RAYS: usize = 24;
        let side = ground.support().map_or(1.0, |(low, high)| (high - low).length());
        let settings =
            Settings { epsilon: 1e-6 * side, bracket: 1e-5 * side, edge: 1e-6 * side, ..Settings::default() };
        let mut field = HeightRay::new(ground);
        let (mut heights, mut distances) = (Vec::new(), Vec::new());
        for k in 0..RAYS * RAYS {
            let place = |k: usize, size: usize| (k as f64 + 0.5) / RAYS as f64 * size as f64;
            let ray = camera.ray(place(k % RAYS, camera.width()), place(k / RAYS, camera.height()));
            field.aim(ray);
            if let Answer::Hit { t } = Tracer::Segment.trace(ground, &mut field, &settings) {
                heights.push(ray.at(t).z);
                distances.push(t);
            }
        }
        let part = |values: &mut Vec<f64>, share: f64| {
            values.sort_by(f64::total_cmp);
            values.get((share * values.len() as f64) as usize).copied()
        };
        let elevations = [part(&mut heights, 0.01).unwrap_or(0.0), part(&mut heights, 0.99).unwrap_or(1.0)];
        let size = part(&mut distances, 0.5).unwrap_or(1.0);
        Look::over(DVec2::ZERO, DVec2::new(size, 0.0), elevations)
    }
    /// The same as a scene asks for.
    #[must_use]
    pub fn wished(mut self, wish: &Appearance) -> Look {
        self.sun = wish.sun.unwrap_or(self.sun);
        self.snow = wish.snow.unwrap_or(self.snow);
        self.arid = wish.arid;
        self
    }
}

/// What is drawn: the ground, and the layers that lie on it (Génevaux 2015 §8.4), each a tree of its own.
#[derive(Clone, Debug)]
pub struct Landscape<'a> {
    /// The terrain.
    pub ground: Surface<'a>,
    /// Surface of water, where its weight is that of terrain and it lies above the ground.
    pub water: Option<Surface<'a>>,
    /// Density of sand on the ground: elevation times weight, each cut to [0, 1].
    pub sand: Option<&'a Program>,
    /// Density of plants, likewise.
    pub vegetation: Option<&'a Program>,
}

impl<'a> From<Surface<'a>> for Landscape<'a> {
    fn from(ground: Surface<'a>) -> Landscape<'a> {
        Landscape { ground, water: None, sand: None, vegetation: None }
    }
}

/// One traced pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// What the tracer answered, of the ground.
    pub answer: Answer,
    /// Evaluations of the ground on the ray from the eye, the normal's included.
    pub evaluations: u64,
    /// All others: rays to the sun, reflections, layers.
    pub shadow_evaluations: u64,
    /// Unit normal of what was hit, the ground or the cut; else 0.
    pub normal: DVec3,
    /// Linear colour.
    pub colour: [f32; 3],
}

impl Pixel {
    /// A pixel that nobody has traced.
    pub const EMPTY: Pixel =
        Pixel { answer: Answer::Miss, evaluations: 0, shadow_evaluations: 0, normal: DVec3::ZERO, colour: [0.0; 3] };
}

/// How a landscape is looked at.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// What is seen.
    pub landscape: &'a Landscape<'a>,
    /// Angle between neighbouring pixels, radians: what is finer is not drawn.
    pub pixel: f64,
    /// Follows rays.
    pub tracer: Tracer,
    /// When it stops.
    pub settings: &'a Settings,
    /// Light and colours.
    pub look: &'a Look,
}

/// Draws the pixels of a [`View`], one after the other, reusing its stacks.
#[derive(Debug)]
pub struct Eye<'a> {
    view: &'a View<'a>,
    ground: HeightRay<'a>,
    water: Option<HeightRay<'a>>,
    level: Option<Evaluator<f64>>,
    sand: Option<(&'a Program, Evaluator<f64>)>,
    vegetation: Option<(&'a Program, Evaluator<f64>)>,
    mottle: Mottle,
}

/// Traces and shades a picture, row by row from the top; the result does not depend on the number of threads.
pub fn render(view: &View<'_>, camera: &Camera) -> Vec<Pixel> {
    let mut pixels = vec![Pixel::EMPTY; camera.width() * camera.height()];
    pixels
        .par_chunks_mut(camera.width().max(1))
        .enumerate()
        .for_each_init(|| Eye::new(view), |eye, (row, out)| eye.row(camera, row, out));
    pixels
}

impl<'a> Eye<'a> {
    /// An eye for this view.
    pub fn new(view: &'a View<'a>) -> Eye<'a> {
        let Landscape { ground, water, sand, vegetation } = view.landscape;
        let density = |program: &Option<&'a Program>| program.map(|program| (program, Evaluator::new(program)));
        Eye {
            view,
            ground: HeightRay::new(ground),
            water: water.as_ref().map(HeightRay::new),
            level: water.as_ref().map(|water| Evaluator::new(water.program())),
            sand: density(sand),
            vegetation: density(vegetation),
            mottle: Mottle::new(view.look),
        }
    }
    /// One row of a picture, 0 at the top.
    pub fn row(&mut self, camera: &Camera, row: usize, out: &mut [Pixel]) {
        for (column, pixel) in out.iter_mut().enumerate() {
            let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
            let (answer, evaluations) = self.follow(&ray);
            *pixel = self.shade(&ray, answer);
            pixel.evaluations += evaluations;
        }
    }
    /// Where a ray meets the ground, and what that took.
    fn follow(&mut self, ray: &Ray) -> (Answer, u64) {
        self.ground.aim(*ray);
        let answer = self.view.tracer.trace(&self.view.landscape.ground, &mut self.ground, self.view.settings);
        (answer, self.ground.evaluations())
    }
    /// The pixel of a ray whose answer of the ground is known. Its `evaluations` are those of the normal.
    pub fn shade(&mut self, ray: &Ray, answer: Answer) -> Pixel {
        let look = self.view.look;
        let below = matches!(answer, Answer::Wall { t } if ray.at(t).z < look.floor);
        let distance = answer.distance().filter(|_| !below);
        let mut pixel = Pixel { answer, ..Pixel::EMPTY };
        let water = self.water_before(ray, distance.unwrap_or(f64::INFINITY), &mut pixel);
        let sky = sky(ray.direction, look);
        let (colour, t) = match (distance, water) {
            (_, Some(t)) => (self.water(ray, t, distance, &mut pixel), t),
            (Some(t), None) => (self.solid(ray, t, &mut pixel), t),
            (None, None) => {
                let colour = if matches!(answer, Answer::GaveUp { .. }) { DVec3::new(1.0, 0.0, 1.0) } else { sky };
                return Pixel { colour: colour.as_vec3().to_array(), ..pixel };
            }
        };
        let clear = look.haze / (look.haze + t);
        pixel.colour = (colour * clear + sky * (1.0 - clear)).as_vec3().to_array();
        pixel
    }
    /// Where the ray meets water before `end`.
    fn water_before(&mut self, ray: &Ray, end: f64, pixel: &mut Pixel) -> Option<f64> {
        let (water, surface) = (self.water.as_mut()?, self.view.landscape.water.as_ref()?);
        water.aim(*ray);
        let answer = self.view.tracer.trace(surface, water, self.view.settings);
        pixel.shadow_evaluations += water.evaluations();
        answer.distance().filter(|t| *t < end && ray.at(*t).z >= self.view.look.floor)
    }
    /// The colour of ground, or of a cut, at `t`.
    fn solid(&mut self, ray: &Ray, t: f64, pixel: &mut Pixel) -> DVec3 {
        self.ground.aim(*ray);
        let sample = self.ground.sample(t);
        pixel.evaluations += self.ground.evaluations();
        let (at, look) = (ray.at(t), self.view.look);
        let lift = (4.0 * self.view.settings.epsilon).max(2e-4 * t);
        if !matches!(pixel.answer, Answer::Hit { .. }) {
            let out = -sample.weight_gradient;
            pixel.normal = DVec3::new(out.x, out.y, 0.0).normalize_or(-ray.direction);
            let sun = self.sun(at, pixel.normal, lift, pixel);
            return section(at.z, sample.elevation, look) * light(sun, pixel.normal);
        }
        pixel.normal = DVec3::new(-sample.gradient.x, -sample.gradient.y, 1.0).normalize();
        let ground = self.on(at.truncate(), sample.elevation, sample.gradient);
        let mottle = self.mottle.at(at.truncate(), t * self.view.pixel);
        let material = material::ground(&ground, mottle, look);
        let sun = self.sun(at, pixel.normal, lift, pixel);
        material.colour * material.shade * light(sun, pixel.normal)
    }
    /// The colour of water that the ray meets at `t`; it would meet the ground at `bed`.
    fn water(&mut self, ray: &Ray, t: f64, bed: Option<f64>, pixel: &mut Pixel) -> DVec3 {
        let (at, look) = (ray.at(t), self.view.look);
        // Ripples, as far as they can be seen; calm from afar.
        let [coarse, fine] = self.mottle.at(at.truncate() * 6.0, 6.0 * t * self.view.pixel);
        let [other, _] = self.mottle.at(at.truncate() * 6.0 + look.size, 6.0 * t * self.view.pixel);
        let normal = DVec3::new(0.02 * coarse + 0.012 * fine, 0.02 * other, 1.0).normalize();
        let lift = (4.0 * self.view.settings.epsilon).max(2e-4 * t);
        let sun = self.sun(at, DVec3::Z, lift, pixel);
        // Water bends a ray towards the vertical: what is seen lies about below, at the ground's elevation there.
        let (elevation, seen) = (self.ground_below(at.truncate()), at.z - bed.map_or(look.floor, |bed| ray.at(bed).z));
        let depth = (at.z - elevation).max(0.0).min(seen.max(0.0));
        let bottom = Ground { elevation, depth, sand: 0.0, ..Ground::default() };
        let bottom = ground(&bottom, [coarse, fine], look).colour;
        let body = water(bottom, depth, look) * light(sun * look.sun.z, DVec3::Z);
        let mirrored = ray.direction - normal * (2.0 * ray.direction.dot(normal));
        let mirrored = DVec3::new(mirrored.x, mirrored.y, mirrored.z.max(1e-3)).normalize();
        let mut reflection = sky(mirrored, look);
        if look.shadows {
            let back = Ray { origin: at + DVec3::Z * lift, direction: mirrored };
            let (answer, evaluations) = self.follow(&back);
            pixel.shadow_evaluations += evaluations;
            if let Answer::Hit { t: away } = answer {
                self.ground.aim(back);
                let sample = self.ground.sample(away);
                pixel.shadow_evaluations += 1;
                let p = back.at(away).truncate();
                let up = DVec3::new(-sample.gradient.x, -sample.gradient.y, 1.0).normalize();
                let shore = self.on(p, sample.elevation, sample.gradient);
                let mottle = self.mottle.at(p, (t + away) * self.view.pixel);
                let material = material::ground(&shore, mottle, look);
                reflection = material.colour * material.shade * light(up.dot(look.sun).max(0.0), up);
            }
        }
        let glint = mirrored.dot(look.sun).max(0.0);
        let glint = smooth(0.992, 0.9995, glint) * sun * 6.0;
        let share = mirror(-ray.direction.dot(normal));
        body * (1.0 - share) + (reflection + DVec3::splat(glint)) * share
    }
    /// The share of the sun's light that falls on a surface with this normal.
    fn sun(&mut self, at: DVec3, normal: DVec3, lift: f64, pixel: &mut Pixel) -> f64 {
        let look = self.view.look;
        let sun = normal.dot(look.sun).max(0.0);
        if !look.shadows || sun <= 0.0 {
            return sun;
        }
        // Lifted off the surface by a fraction of a pixel's footprint, else the ray would meet what it starts from.
        let (shadow, evaluations) = self.follow(&Ray { origin: at + (normal + DVec3::Z) * lift, direction: look.sun });
        pixel.shadow_evaluations += evaluations;
        if shadow.distance().is_some() { 0.0 } else { sun }
    }
    fn ground_below(&mut self, p: DVec2) -> f64 {
        self.ground.aim(Ray { origin: p.extend(0.0), direction: DVec3::NEG_Z });
        -self.ground.value(0.0).height
    }
    /// The layers at a point of the ground.
    fn on(&mut self, p: DVec2, elevation: f64, gradient: DVec2) -> Ground {
        let density = |layer: &mut Option<(&Program, Evaluator<f64>)>| {
            layer.as_mut().map_or(0.0, |(program, evaluator)| {
                let (density, weight) = evaluator.run(program, [p.x, p.y]);
                if weight > 0.0 { density.clamp(0.0, 1.0) * weight.min(1.0) } else { 0.0 }
            })
        };
        let (sand, vegetation) = (density(&mut self.sand), density(&mut self.vegetation));
        let depth = match (&mut self.level, &self.view.landscape.water) {
            (Some(level), Some(water)) => {
                let (surface, weight) = level.run(water.program(), [p.x, p.y]);
                if weight >= THRESHOLD { surface - elevation } else { f64::NEG_INFINITY }
            }
            _ => f64::NEG_INFINITY,
        };
        Ground { elevation, gradient, sand, vegetation, depth }
    }
}

/// Linear colour to 8-bit sRGB (IEC 61966-2-1), highlights above 0.8 rolled off towards 1.
pub fn to_srgb8(colour: [f32; 3]) -> [u8; 3] {
    const KNEE: f32 = 0.8;
    colour.map(|c| {
        let over = (c - KNEE).max(0.0);
        let c = c.clamp(0.0, KNEE) + over * (1.0 - KNEE) / (over + 1.0 - KNEE);
        let coded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * libm::powf(c, 1.0 / 2.4) - 0.055 };
        (coded * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_curve_meets_its_table_and_never_falls() {
        // 8-bit codes of linear 0, 0.0031308, 0.18 and 0.5 by the standard.
        let code = |c: f32| to_srgb8([c; 3])[0];
        assert_eq!([0.0, 0.003_130_8, 0.18, 0.5].map(code), [0, 10, 118, 188]);
        assert!((0..4000).map(|k| k as f32 / 1000.0).is_sorted_by_key(code));
        assert_eq!((code(1e6), code(-1.0)), (255, 0));
    }
}
