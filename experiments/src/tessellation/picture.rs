//! A picture of tessellated ground, on the processor: leaves in the image, vertices shaded by slope and elevation (the tessellation
//! paper §5, with borders of materials that noise makes irregular, §8), one sun with cast shadows, sky light and haze.

use rayon::prelude::*;
use terrain_gpu::tessellate::coverage::{Corners, Image};
use terrain_gpu::tessellate::displace::Detail;
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::{LATTICE, Triangle, Vertex};
use terrain_gpu::tessellate::view::View;
use terrain_model::noise::{Combination, Octave, Octaves};
use terrain_model::trace::shade::to_srgb8;

/// A ground with its detail, seen.
pub struct Scene<'a> {
    /// The ground.
    pub ground: &'a Ground,
    /// What is added to it.
    pub detail: &'a Detail,
    /// From where.
    pub view: View,
    /// Which triangles.
    pub refinement: Refinement<'a>,
    /// Materials and light.
    pub look: Look,
}

/// Materials and light.
#[derive(Clone, Debug)]
pub struct Look {
    /// Unit vector towards the sun.
    pub sun: [f64; 3],
    /// Elevation above which snow lies where it is not steep, metres: the paper's user threshold.
    pub snow: f64,
    /// Distance at which haze takes half of the colour, metres.
    pub haze: f64,
    /// Range of elevations, metres: the scale by which the border of snow varies.
    pub relief: f64,
    /// Noise of the colours.
    mottle: Vec<Octave<2>>,
}

impl Look {
    /// Light from the west; snow on the upper third.
    pub fn over(ground: &Ground) -> Look {
        let ([low, high], [x, y]) = (ground.range(), ground.extent());
        let octaves = Octaves { octaves: 12, frequency: 12.0 / x.max(y), lacunarity: 2.0, gain: 0.75, amplitude: 0.4 };
        Look {
            sun: [-0.74, -0.37, 0.56],
            snow: high - (high - low) / 3.0,
            haze: 2.0 * x.max(y),
            relief: high - low,
            mottle: octaves.place(0x7e55, [0.0; 2]),
        }
    }

    /// Without snow: what is high is as bare or as green as the rest.
    pub fn without_snow(self) -> Look {
        Look { snow: f64::INFINITY, ..self }
    }
}

/// What was drawn.
pub struct Picture {
    /// sRGB, row 0 on top.
    pub pixels: Vec<u8>,
    /// Leaves in the image, culling done.
    pub leaves: usize,
    /// Triangles of their lattices.
    pub triangles: usize,
    /// Pixels that show no ground.
    pub background: usize,
}

fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

const ROCK: [[f64; 3]; 2] = [[0.16, 0.14, 0.125], [0.32, 0.29, 0.26]];
const GRASS: [[f64; 3]; 2] = [[0.065, 0.10, 0.035], [0.20, 0.19, 0.075]];
const SNOW: [f64; 3] = [0.86, 0.89, 0.94];
const SKY: [[f64; 3]; 2] = [[0.62, 0.72, 0.84], [0.20, 0.36, 0.66]];

impl Scene<'_> {
    /// Linear colour of a displaced vertex.
    fn colour(&self, p: [f64; 3], normal: [f64; 3], distance: f64) -> [f64; 3] {
        let look = &self.look;
        // Octaves finer than what the picture can show fade to their mean.
        let seen = look.mottle.iter().take_while(|o| o.frequency * distance < 0.4 * self.view.focal).count();
        let plane = |octaves: &[Octave<2>]| Combination::Sum.plane(octaves, [p[0], p[1]]);
        let coarse = seen.min(4);
        let [wide, fine] = [plane(&look.mottle[..coarse]), plane(&look.mottle[coarse..seen])];
        let steep = smooth(0.22, 0.38, 1.0 - normal[2] + 0.06 * fine);
        let snow = smooth(-0.04, 0.04, (p[2] - look.snow) / look.relief.max(1.0) + 0.12 * wide + 0.05 * fine);
        let snow = snow * (1.0 - smooth(0.30, 0.5, 1.0 - normal[2]));
        let vary = (0.5 + 0.8 * fine).clamp(0.0, 1.0);
        let ground = mix(GRASS[0], GRASS[1], (0.45 + 0.7 * wide + 0.5 * fine).clamp(0.0, 1.0));
        let bare = mix(mix(ground, SNOW, snow), mix(ROCK[0], ROCK[1], vary), steep * (1.0 - 0.55 * snow));
        let facing = dot(normal, look.sun).max(0.0);
        let sun = if facing > 0.0 { facing * self.lit(p) } else { 0.0 };
        let light: [f64; 3] =
            std::array::from_fn(|k| 1.9 * [1.0, 0.94, 0.84][k] * sun + 0.42 * SKY[0][k] * (0.55 + 0.45 * normal[2]));
        let shaded = std::array::from_fn(|k| bare[k] * light[k]);
        mix(shaded, SKY[0], 1.0 - libm::exp2(-distance / look.haze))
    }
    /// Share of the sun that the ground lets through at `p`: a march over the raster itself, with a soft border.
    fn lit(&self, p: [f64; 3]) -> f64 {
        let (sun, top) = (self.look.sun, self.ground.range()[1]);
        let [sx, sy] = self.ground.spacing();
        let (first, mut clear) = (0.6 * (sx + sy), 1.0f64);
        let mut t = first;
        while clear > 0.0 {
            let q: [f64; 3] = std::array::from_fn(|k| p[k] + t * sun[k]);
            if q[2] > top {
                break;
            }
            let above = q[2] - self.ground.elevation([q[0], q[1]]) + self.detail.amplitude() + 0.1 * first;
            clear = clear.min(smooth(-0.02 * t, 0.02 * t, above));
            t *= 1.06;
        }
        clear
    }
    /// Draws it with `size` columns and rows.
    pub fn picture(&self, size: [usize; 2]) -> Picture {
        let leaves = self.refinement.leaves(true);
        let image = Image { view: &self.view, size };
        let shaded: Vec<_> = leaves.par_iter().map(|leaf| self.shaded(leaf)).collect();
        let mut nearest = vec![f64::INFINITY; size[0] * size[1]];
        let mut colours = vec![[0.0; 3]; size[0] * size[1]];
        for [corners, colour] in shaded.iter().flatten() {
            image.each(corners, |pixel, fragment| {
                if fragment.depth < nearest[pixel] {
                    nearest[pixel] = fragment.depth;
                    colours[pixel] =
                        std::array::from_fn(|k| (0..3).map(|c| fragment.shares[c] * colour[c][k]).sum::<f64>());
                }
            });
        }
        let mut pixels = Vec::with_capacity(3 * size[0] * size[1]);
        for row in (0..size[1]).rev() {
            for pixel in row * size[0]..(row + 1) * size[0] {
                let sky = || mix(SKY[0], SKY[1], smooth(0.3, 1.1, row as f64 / size[1] as f64));
                let colour = if nearest[pixel] < f64::INFINITY { colours[pixel] } else { sky() };
                pixels.extend(to_srgb8(colour.map(|c| c as f32)));
            }
        }
        Picture {
            pixels,
            leaves: leaves.len(),
            triangles: leaves.len() << LATTICE,
            background: nearest.iter().filter(|depth| depth.is_infinite()).count(),
        }
    }
    /// Displaced triangles of a leaf with the colours of their corners, each vertex shaded once.
    fn shaded(&self, leaf: &Triangle) -> Vec<[Corners; 2]> {
        let mut known: Vec<(Vertex, [f64; 3], [f64; 3])> = Vec::with_capacity(15);
        let mut place = |vertex: Vertex| {
            if let Some((_, p, colour)) = known.iter().find(|(other, ..)| *other == vertex) {
                return (*p, *colour);
            }
            let p = self.refinement.position(vertex);
            let away: [f64; 3] = std::array::from_fn(|k| p[k] - self.view.eye[k]);
            let colour = self.colour(p, self.refinement.normal(vertex), dot(away, away).sqrt());
            known.push((vertex, p, colour));
            (p, colour)
        };
        let triangle = |triangle: &Triangle| {
            let [a, b, c] = triangle.corners().map(&mut place);
            [[a.0, b.0, c.0], [a.1, b.1, c.1]]
        };
        leaf.lattice(LATTICE).iter().filter(|triangle| self.ground.holds(triangle)).map(triangle).collect()
    }
}
