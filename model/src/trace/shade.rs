//! A plain shader: rock on steep slopes, grass to snow by elevation, one sun with sky light, haze with distance.

use super::camera::Camera;
use super::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// What the sun and the ground look like.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Unit vector towards the sun.
    pub sun: DVec3,
    /// Elevations of the lowest and highest ground, metres: colours are spread between them.
    pub elevations: [f64; 2],
    /// Distance at which haze takes half of the colour, metres.
    pub haze: f64,
}

/// One traced pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// What the tracer answered.
    pub answer: Answer,
    /// Evaluations, the normal's included.
    pub evaluations: u64,
    /// Unit normal of the ground where it was hit, else 0.
    pub normal: DVec3,
    /// Linear colour.
    pub colour: [f32; 3],
}

/// Traces and shades a picture, row by row from the top; the result does not depend on the number of threads.
pub fn render(surface: &Surface<'_>, camera: &Camera, tracer: Tracer, settings: &Settings, look: &Look) -> Vec<Pixel> {
    let mut pixels = vec![
        Pixel { answer: Answer::Miss, evaluations: 0, normal: DVec3::ZERO, colour: [0.0; 3] };
        camera.width() * camera.height()
    ];
    pixels.par_chunks_mut(camera.width().max(1)).enumerate().for_each_init(
        || HeightRay::new(surface),
        |field, (row, out)| {
            for (column, pixel) in out.iter_mut().enumerate() {
                let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
                field.aim(ray);
                let answer = tracer.trace(surface, field, settings);
                let (normal, colour) = shade(field, &ray, answer, look);
                *pixel = Pixel { answer, evaluations: field.evaluations(), normal, colour };
            }
        },
    );
    pixels
}

fn shade(field: &mut HeightRay<'_>, ray: &Ray, answer: Answer, look: &Look) -> (DVec3, [f32; 3]) {
    let sky = sky(ray.direction, look);
    match answer {
        Answer::Hit { t } => {
            let sample = field.sample(t);
            let normal = DVec3::new(-sample.gradient.x, -sample.gradient.y, 1.0).normalize();
            let lit = ground(sample.elevation, sample.gradient, look) * light(normal, look);
            let clear = look.haze / (look.haze + t);
            (normal, (lit * clear + sky * (1.0 - clear)).as_vec3().to_array())
        }
        // The cut of the model, as a section would be drawn.
        Answer::Wall { .. } => (DVec3::ZERO, (DVec3::new(0.24, 0.20, 0.17) * 0.8).as_vec3().to_array()),
        Answer::Miss => (DVec3::ZERO, sky.as_vec3().to_array()),
        Answer::GaveUp { .. } => (DVec3::ZERO, [1.0, 0.0, 1.0]),
    }
}

fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn ground(elevation: f64, gradient: DVec2, look: &Look) -> DVec3 {
    let height = (elevation - look.elevations[0]) / (look.elevations[1] - look.elevations[0]).max(1e-9);
    let slope = gradient.length();
    let meadow = DVec3::new(0.16, 0.21, 0.07).lerp(DVec3::new(0.30, 0.28, 0.15), smooth(0.15, 0.7, height));
    let rock = DVec3::new(0.29, 0.26, 0.23).lerp(DVec3::new(0.42, 0.40, 0.38), smooth(0.3, 0.9, height));
    let snow = DVec3::new(0.86, 0.88, 0.92);
    let soil = meadow.lerp(snow, smooth(0.72, 0.88, height));
    soil.lerp(rock, smooth(0.55, 1.0, slope))
}

fn light(normal: DVec3, look: &Look) -> DVec3 {
    let sun = DVec3::new(1.0, 0.93, 0.82) * (2.1 * normal.dot(look.sun).max(0.0));
    let sky = DVec3::new(0.42, 0.55, 0.75) * (0.35 + 0.35 * normal.z);
    sun + sky
}

fn sky(direction: DVec3, look: &Look) -> DVec3 {
    let up = direction.z.clamp(-0.2, 1.0);
    let zenith = DVec3::new(0.18, 0.34, 0.66);
    let horizon = DVec3::new(0.72, 0.80, 0.88);
    let glow = direction.dot(look.sun).max(0.0);
    let glow = glow * glow * glow * glow;
    horizon.lerp(zenith, smooth(-0.02, 0.6, up)) + DVec3::new(0.20, 0.16, 0.10) * (glow * glow)
}

/// Linear colour to 8-bit sRGB, by a square root in place of the exact curve's power (a stated approximation: at most
/// 0.03 off).
pub fn to_srgb8(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|c| (c.clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8)
}
