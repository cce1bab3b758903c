//! A plain shader: colours by elevation and slope, one sun with cast shadows, sky light, haze with distance.

use super::camera::Camera;
use super::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// What the sun, the air and the ground look like.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Unit vector towards the sun.
    pub sun: DVec3,
    /// Elevations of the lowest and highest ground, metres: colours are spread between them.
    pub elevations: [f64; 2],
    /// Distance at which haze takes half of the colour, metres.
    pub haze: f64,
    /// Elevation of the underside, metres: a cut below it is not drawn, so that the terrain looks like a block. It is
    /// traced as any other.
    pub floor: f64,
    /// Whether the ground casts shadows: one more ray for each pixel that faces the sun.
    pub shadows: bool,
}

impl Look {
    /// Light from the south-west over a terrain with opposite corners `low` and `high`, ground between `elevations`.
    pub fn over(low: DVec2, high: DVec2, elevations: [f64; 2]) -> Look {
        let size = (high - low).length();
        let sun = DVec3::new(-0.86, -0.24, 0.40).normalize();
        Look { sun, elevations, haze: 14.0 * size, floor: elevations[0] - 0.02 * size, shadows: true }
    }
}

/// One traced pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// What the tracer answered.
    pub answer: Answer,
    /// Evaluations of the ray from the eye, the normal's included.
    pub evaluations: u64,
    /// Evaluations of the ray to the sun.
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

/// Traces and shades a picture, row by row from the top; the result does not depend on the number of threads.
pub fn render(surface: &Surface<'_>, camera: &Camera, tracer: Tracer, settings: &Settings, look: &Look) -> Vec<Pixel> {
    let mut pixels = vec![Pixel::EMPTY; camera.width() * camera.height()];
    pixels.par_chunks_mut(camera.width().max(1)).enumerate().for_each_init(
        || HeightRay::new(surface),
        |field, (row, out)| render_row(surface, field, camera, tracer, settings, look, row, out),
    );
    pixels
}

/// One row of [`render`], 0 at the top, for callers that split the picture themselves.
#[expect(clippy::too_many_arguments, reason = "the same as render, with the row and its pixels")]
pub fn render_row<'a>(
    surface: &'a Surface<'a>,
    field: &mut HeightRay<'a>,
    camera: &Camera,
    tracer: Tracer,
    settings: &Settings,
    look: &Look,
    row: usize,
    out: &mut [Pixel],
) {
    for (column, pixel) in out.iter_mut().enumerate() {
        let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
        field.aim(ray);
        let answer = tracer.trace(surface, field, settings);
        let evaluations = field.evaluations();
        *pixel = shade(surface, field, &ray, answer, tracer, settings, look);
        pixel.evaluations += evaluations;
    }
}

/// The pixel of a ray with a known answer. `evaluations` counts what shading itself took, and `tracer` follows the ray to
/// the sun.
pub fn shade<'a>(
    surface: &'a Surface<'a>,
    field: &mut HeightRay<'a>,
    ray: &Ray,
    answer: Answer,
    tracer: Tracer,
    settings: &Settings,
    look: &Look,
) -> Pixel {
    let sky = sky(ray.direction, look);
    let below = matches!(answer, Answer::Wall { t } if ray.at(t).z < look.floor);
    let Some(t) = answer.distance().filter(|_| !below) else {
        let colour = if matches!(answer, Answer::GaveUp { .. }) { DVec3::new(1.0, 0.0, 1.0) } else { sky };
        return Pixel { answer, colour: colour.as_vec3().to_array(), ..Pixel::EMPTY };
    };
    field.aim(*ray);
    let sample = field.sample(t);
    let evaluations = field.evaluations();
    let at = ray.at(t);
    let (normal, ground) = if matches!(answer, Answer::Hit { .. }) {
        let normal = DVec3::new(-sample.gradient.x, -sample.gradient.y, 1.0).normalize();
        (normal, ground(sample.elevation, sample.gradient, look))
    } else {
        let out = -sample.weight_gradient;
        (DVec3::new(out.x, out.y, 0.0).normalize_or(-ray.direction), section(at.z, sample.elevation, look))
    };
    let mut pixel = Pixel { answer, evaluations, normal, ..Pixel::EMPTY };
    let mut sun = normal.dot(look.sun).max(0.0);
    if look.shadows && sun > 0.0 {
        // Lifted off the surface by a fraction of a pixel's footprint, else the ray would meet what it starts from.
        let lift = (4.0 * settings.epsilon).max(2e-4 * t);
        field.aim(Ray { origin: at + (normal + DVec3::Z) * lift, direction: look.sun });
        let shadow = tracer.trace(surface, field, settings);
        pixel.shadow_evaluations = field.evaluations();
        if shadow.distance().is_some() {
            sun = 0.0;
        }
    }
    let clear = look.haze / (look.haze + t);
    pixel.colour = (ground * light(sun, normal) * clear + sky * (1.0 - clear)).as_vec3().to_array();
    pixel
}

fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Colours of level ground by relative elevation: river meadow, grass, heath, dry grass, scree, snow.
const SOILS: [(f64, DVec3); 6] = [
    (0.00, DVec3::new(0.150, 0.205, 0.070)),
    (0.18, DVec3::new(0.135, 0.175, 0.062)),
    (0.40, DVec3::new(0.200, 0.205, 0.085)),
    (0.62, DVec3::new(0.300, 0.265, 0.150)),
    (0.84, DVec3::new(0.360, 0.335, 0.285)),
    (1.00, DVec3::new(0.820, 0.840, 0.870)),
];

fn relative(elevation: f64, look: &Look) -> f64 {
    (elevation - look.elevations[0]) / (look.elevations[1] - look.elevations[0]).max(1e-9)
}

fn ground(elevation: f64, gradient: DVec2, look: &Look) -> DVec3 {
    let height = relative(elevation, look);
    let soil =
        SOILS.windows(2).fold(SOILS[0].1, |colour, pair| colour.lerp(pair[1].1, smooth(pair[0].0, pair[1].0, height)));
    let rock = DVec3::new(0.235, 0.205, 0.170).lerp(DVec3::new(0.400, 0.375, 0.345), smooth(0.1, 0.9, height));
    // Soil thins on slopes from 17° on, and bare rock stands from 40°.
    soil.lerp(rock, smooth(0.30, 0.85, gradient.length()))
}

/// The cut of the model, as a section is drawn: a thin soil over bands of rock.
fn section(z: f64, elevation: f64, look: &Look) -> DVec3 {
    let span = (look.elevations[1] - look.floor).max(1e-9);
    let bands = (z - look.floor) / (0.14 * span);
    let within = bands - bands.floor();
    let band = smooth(0.40, 0.50, within) - smooth(0.90, 1.0, within);
    let rock = DVec3::new(0.205, 0.165, 0.130).lerp(DVec3::new(0.275, 0.230, 0.185), band);
    DVec3::new(0.100, 0.075, 0.045).lerp(rock, smooth(0.015, 0.03, (elevation - z) / span))
}

fn light(sun: f64, normal: DVec3) -> DVec3 {
    let sunlight = DVec3::new(1.0, 0.90, 0.74) * (3.2 * sun);
    let sky = DVec3::new(0.36, 0.49, 0.70) * (0.20 + 0.30 * normal.z);
    // What the ground opposite sends back.
    sunlight + sky + DVec3::new(0.17, 0.14, 0.10) * (1.0 - normal.z)
}

fn sky(direction: DVec3, look: &Look) -> DVec3 {
    let zenith = DVec3::new(0.17, 0.34, 0.66);
    let horizon = DVec3::new(0.70, 0.78, 0.86);
    let below = DVec3::new(0.52, 0.58, 0.63);
    let glow = direction.dot(look.sun).max(0.0);
    let glow = glow * glow * glow * glow;
    let clear = if direction.z >= 0.0 {
        horizon.lerp(zenith, smooth(-0.1, 0.55, direction.z))
    } else {
        // Not ground: the colour that the picture stands on, even to the edges.
        horizon.lerp(zenith, smooth(-0.1, 0.55, 0.0)).lerp(below, smooth(0.0, 0.5, -direction.z))
    };
    clear + DVec3::new(0.20, 0.16, 0.10) * (glow * glow)
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
