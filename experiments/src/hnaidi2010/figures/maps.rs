//! Rasters seen from above: shaded relief, fields by colour, directions by hue.

use super::canvas::Canvas;
use crate::hnaidi2010::rasters::{range, value};
use glam::{DVec2, DVec3};
use terrain_diffusion::curve::Curve;
use terrain_diffusion::raster::Domain;

/// A field as a square of `side` pixels, read bilinearly.
fn panel(domain: &Domain, side: usize, colour: impl Fn(DVec2) -> DVec3 + Sync) -> Canvas {
    let cells = DVec2::new((domain.width - 1) as f64, (domain.height - 1) as f64);
    Canvas::new(side, side, |x, y| {
        let at = DVec2::new(x as f64 + 0.5, (side - y) as f64 - 0.5) / side as f64;
        colour(at * cells)
    })
}

fn between(stops: &[DVec3], t: f64) -> DVec3 {
    let x = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let k = (x as usize).min(stops.len() - 2);
    stops[k].lerp(stops[k + 1], x - k as f64)
}

const fn rgb(r: u8, g: u8, b: u8) -> DVec3 {
    DVec3::new(r as f64 / 255.0, g as f64 / 255.0, b as f64 / 255.0)
}

const GREEN: [DVec3; 6] = [
    rgb(104, 132, 84),
    rgb(139, 155, 98),
    rgb(178, 168, 122),
    rgb(164, 146, 124),
    rgb(206, 200, 192),
    rgb(250, 250, 250),
];
const ARID: [DVec3; 5] =
    [rgb(150, 112, 76), rgb(202, 152, 98), rgb(186, 116, 72), rgb(212, 158, 108), rgb(232, 198, 152)];
const GREY: [DVec3; 2] = [rgb(235, 232, 226), rgb(235, 232, 226)];
/// Dark to bright, even in lightness.
const RAMP: [DVec3; 6] =
    [rgb(68, 1, 84), rgb(65, 68, 135), rgb(42, 120, 142), rgb(34, 168, 132), rgb(122, 209, 81), rgb(253, 231, 37)];

/// What a relief is coloured like.
#[derive(Clone, Copy, PartialEq)]
pub enum Ground {
    Temperate,
    Arid,
    /// Of one colour, so that the shape alone shows.
    Plaster,
}

/// Shaded relief, lit from the north-west and softly from all around; water where the ground lies below `water`.
pub fn relief(height: &[f64], domain: &Domain, side: usize, ground: Ground, water: Option<f64>) -> Canvas {
    let [low, high] = range(height);
    let stops: &[DVec3] = match ground {
        Ground::Temperate => &GREEN,
        Ground::Arid => &ARID,
        Ground::Plaster => &GREY,
    };
    let base = water.unwrap_or(low).max(low);
    let lights = [(DVec3::new(-0.55, 0.55, 0.63), 0.72), (DVec3::new(0.5, 0.4, 0.77), 0.16), (DVec3::Z, 0.16)];
    panel(domain, side, |q| {
        let at = |x: f64, y: f64| value(height, domain, (q + DVec2::new(x, y)).max(DVec2::ZERO));
        let step = 0.75;
        let slope =
            DVec2::new(at(step, 0.0) - at(-step, 0.0), at(0.0, step) - at(0.0, -step)) / (2.0 * step * domain.spacing);
        let normal = DVec3::new(-slope.x, -slope.y, 1.0).normalize();
        let light: f64 = lights.iter().map(|(sun, share)| share * normal.dot(sun.normalize()).max(0.0)).sum();
        let z = at(0.0, 0.0);
        let colour = between(stops, (z - base) / (high - base).max(1e-9));
        let rock = DVec3::new(0.47, 0.43, 0.39);
        let bare = if ground == Ground::Temperate { ((slope.length() - 0.55) / 0.7).clamp(0.0, 0.5) } else { 0.0 };
        let lit = colour.lerp(rock, bare) * (0.18 + 1.02 * light);
        match water {
            Some(level) if z < level => {
                let depth = ((level - z) / (0.12 * (high - low))).clamp(0.0, 1.0);
                let body = rgb(118, 172, 190).lerp(rgb(30, 74, 116), depth.sqrt());
                body * (0.86 + 0.2 * light)
            }
            _ => lit,
        }
    })
}

/// A field by colour from `low` to `high`.
pub fn field(values: &[f64], domain: &Domain, side: usize, [low, high]: [f64; 2]) -> Canvas {
    panel(domain, side, |q| between(&RAMP, (value(values, domain, q) - low) / (high - low).max(1e-12)))
}

/// Directions by hue, strength by brightness; black where there is none.
pub fn directions(gradient: &[[f32; 3]], domain: &Domain, side: usize) -> Canvas {
    let most = gradient.iter().map(|g| g[0].abs()).fold(1e-6, f32::max);
    panel(domain, side, |q| {
        let node = q.round();
        let [rise, x, y] = gradient[node.y as usize * domain.width + node.x as usize].map(f64::from);
        let n = DVec2::new(x, y);
        if n.length() < 1e-6 {
            return DVec3::splat(0.08);
        }
        let strength = 0.35 + 0.65 * (rise.abs() / f64::from(most)).min(1.0).sqrt();
        let turn = libm::atan2(y, x) / std::f64::consts::TAU;
        let part = |shift: f64| {
            let phase = (turn + shift).rem_euclid(1.0);
            (6.0 * (phase - 0.5).abs() - 1.0).clamp(0.0, 1.0)
        };
        DVec3::new(part(0.0), part(2.0 / 3.0), part(1.0 / 3.0)).lerp(DVec3::ONE, 0.25) * strength * n.length().min(1.0)
    })
}

/// Draws curves on a panel of the whole domain: red with an elevation, blue with slopes or noise alone.
pub fn overlay(canvas: &mut Canvas, domain: &Domain, curves: &[Curve]) {
    let metres = domain.spacing * DVec2::new((domain.width - 1) as f64, (domain.height - 1) as f64);
    let scale = DVec2::new(canvas.width as f64, canvas.height as f64) / metres;
    for curve in curves {
        let place = |p: DVec2| {
            let q = (p - domain.origin) * scale;
            DVec2::new(q.x, canvas.height as f64 - q.y)
        };
        let line: Vec<DVec2> = curve.polyline(0.3 / scale.x).into_iter().map(|(p, _)| place(p)).collect();
        let held = curve.points().iter().any(|point| point.elevation.is_some());
        let colour = if held { rgb(206, 32, 38) } else { rgb(36, 62, 196) };
        canvas.line(&line, 1.1 * canvas.width as f64 / 400.0 + 0.9, DVec3::ONE);
        canvas.line(&line, 1.1 * canvas.width as f64 / 400.0, colour);
    }
}
