//! Position and normal of a vertex relative to the eye, written once over the number: on `f64` it is what
//! [`super::displace`] computes and more, on `f32` the twin of `shaders/tessellate/displace.wgsl`, and on `Rounded` it
//! derives how far a device may land from `f64`.
//!
//! The normal is that of the displaced surface: everything is a dual number in the coordinates (u, v) of its cell of the
//! ground, and ∂P/∂u × ∂P/∂v points up. Only the band limit is held fixed. Noise is read relative to the eye, on lattices
//! moved there: an octave that has not faded has waves of no less than twice the wanted edge, so its coordinates are at most
//! focal ÷ (2 · target), however far the vertex is, and `f32` keeps them.

use super::displace::{Detail, Space};
use super::ground::Ground;
use super::refine::Refinement;
use super::triangle::{SIDE, Vertex};
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::noise::{GRADIENT3_RANGE, NoiseJet, NoiseValue, Octave, Octaves, mix};
use terrain_model::real::{Mask, Real};

/// What a [`Detail`] in space is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// Octaves; the amplitude is that of the whole, metres.
    pub octaves: Octaves,
    /// Of their lattices.
    pub seed: u32,
    /// See [`Detail::floor`].
    pub floor: [f64; 2],
    /// See [`Detail::elevation`].
    pub elevation: [f64; 2],
}

impl Relief {
    /// The detail; `None` if not sound.
    pub fn detail(&self) -> Option<Detail> {
        let mut detail = Detail::new(&self.octaves, self.seed, Space::Volume)?;
        (detail.floor, detail.elevation) = (self.floor, self.elevation);
        Some(detail)
    }
}

/// The displaced surface that one camera sees.
pub struct Surface<'a> {
    ground: &'a Ground,
    origin: Vertex,
    /// x and y from the origin, elevation.
    eye: [f64; 3],
    /// Wanted edge over distance.
    size: f64,
    relief: Relief,
    octaves: Vec<Octave<3>>,
}

/// Metres from the eye, and the unit normal.
pub type Point<R> = [[R; 3]; 2];

fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<'a> Surface<'a> {
    /// Of `refinement`, displaced by `relief`; positions are computed from the grid vertex `origin`.
    pub fn new(refinement: &Refinement<'a>, relief: Relief, origin: Vertex) -> Surface<'a> {
        let (ground, view) = (refinement.ground(), refinement.view());
        let from = ground.metres(origin);
        let shape = Octaves { amplitude: 1.0, ..relief.octaves };
        let mut octaves: Vec<Octave<3>> =
            shape.place(relief.seed, [0.0; 3]).iter().map(|octave| octave.moved_to(view.eye)).collect();
        let range: f64 = octaves.iter().map(|octave| octave.amplitude).sum();
        octaves.iter_mut().for_each(|octave| octave.amplitude /= range * GRADIENT3_RANGE);
        let eye = [view.eye[0] - from[0], view.eye[1] - from[1], view.eye[2]];
        Surface { ground, origin, eye, size: refinement.target() / view.focal, relief, octaves }
    }
    /// As the device reads it: the surface, and its octaves.
    pub fn words(&self) -> [Vec<u32>; 2] {
        let bits = |x: f64| (x as f32).to_bits();
        let [low, high] = self.relief.elevation;
        let mut words = self.origin.to_vec();
        words.extend(self.ground.unit().map(bits));
        words.extend(self.eye.map(bits));
        words.push(self.ground.cells() as u32);
        words.extend(self.ground.spacing().map(bits));
        words.extend([self.ground.alpha(), self.relief.octaves.amplitude].map(bits));
        words.extend(self.relief.floor.map(bits));
        words.extend(self.relief.floor.map(|floor| bits(1.0 - floor)));
        words.extend([low - self.eye[2], 1.0 / (high - low).max(f64::MIN_POSITIVE), self.size].map(bits));
        words.push(self.octaves.len() as u32);
        let octave = |octave: &Octave<3>| {
            let key =
                |axis: u32| mix(octave.lattice.seed, axis + 1).wrapping_add(octave.lattice.base[axis as usize] as u32);
            let [x, y, z] = octave.offset.map(bits);
            [key(0), key(1), key(2), bits(octave.frequency), x, y, z, bits(octave.amplitude)]
        };
        [words, self.octaves.iter().flat_map(octave).collect()]
    }
    /// Position and normal of `vertex`.
    pub fn point<R: Differentiable + NoiseJet>(&self, vertex: Vertex) -> Point<R> {
        let c = R::constant;
        let fixed = |x: f64| Dual::<R, 2>::fixed(c(x));
        let jets = |x: [f64; 3]| x.map(fixed);
        let per_cell = SIDE / self.ground.cells() as u32;
        let cell = vertex.map(|x| (x / per_cell).min(self.ground.cells() as u32 - 1));
        let [u, v] = [0, 1].map(|k| {
            let along = f64::from(vertex[k] - cell[k] * per_cell) / f64::from(per_cell);
            Dual::<R, 2>::variable(c(along), k)
        });
        let one = fixed(1.0);
        let weights = [(one - u) * (one - v), u * (one - v), (one - u) * v, u * v];
        let samples = self.ground.samples_about(cell);
        let [sx, sy] = self.ground.spacing();
        let unit = self.ground.unit();
        let flat = [0, 1].map(|k| {
            let steps = f64::from(vertex[k] as i32 - self.origin[k] as i32);
            c(steps) * c(unit[k]) - c(self.eye[k])
        });
        let heights = samples.map(|sample| Dual::<R, 2>::fixed(c(sample.0) - c(self.eye[2])));
        let zero = fixed(0.0);
        let z = (0..4).fold(zero, |z, k| z + weights[k] * heights[k]);
        let (mut shift, mut normal) = ([zero; 3], [zero; 3]);
        for k in 0..4 {
            let n = jets(samples[k].1);
            let east = (if k % 2 == 0 { u } else { u - one }) * fixed(sx);
            let north = (if k / 2 == 0 { v } else { v - one }) * fixed(sy);
            let pulled = weights[k] * dot([east, north, z - heights[k]], n);
            for axis in 0..3 {
                shift[axis] = shift[axis] - pulled * n[axis];
                normal[axis] = normal[axis] + weights[k] * n[axis];
            }
        }
        let zeroes = R::zero();
        let x = Dual { value: flat[0], slope: [c(sx), zeroes] };
        let y = Dual { value: flat[1], slope: [zeroes, c(sy)] };
        let alpha = fixed(self.ground.alpha());
        let s = [x + alpha * shift[0], y + alpha * shift[1], z + alpha * shift[2]];
        let length = dot(normal, normal).sqrt();
        let n = normal.map(|x| x / length);
        let by = fixed(self.relief.octaves.amplitude) * self.share(s[2], n[2]) * self.fbm(s);
        let p: [Dual<R, 2>; 3] = std::array::from_fn(|k| s[k] + by * n[k]);
        let [a, b] = [0, 1].map(|k| p.map(|x| x.slope[k]));
        let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let length = dot(across, across).sqrt();
        [p.map(|x| x.value), across.map(|x| x / length)]
    }
    /// Share of the amplitude at an elevation above the eye and the upward component of a normal.
    fn share<R: Differentiable>(&self, z: Dual<R, 2>, up: Dual<R, 2>) -> Dual<R, 2> {
        let fixed = |x: f64| Dual::<R, 2>::constant(x);
        let [low, high] = self.relief.elevation;
        let rise = ((z - fixed(low - self.eye[2])) * fixed(1.0 / (high - low).max(f64::MIN_POSITIVE))).clamp01();
        let mix = |floor: f64, t: Dual<R, 2>| fixed(floor) + fixed(1.0 - floor) * t;
        mix(self.relief.floor[0], fixed(1.0) - up) * mix(self.relief.floor[1], rise)
    }
    /// [`Detail::fbm`] as a dual; the band limit does not vary.
    fn fbm<R: Differentiable + NoiseJet>(&self, s: [Dual<R, 2>; 3]) -> Dual<R, 2> {
        let c = R::constant;
        let at = s.map(|x| x.value);
        let size = c(self.size) * dot(at, at).sqrt();
        let mut sum = Dual::fixed(c(0.0));
        for octave in &self.octaves {
            let band = (c(1.0) / (c(2.0) * size * c(octave.frequency)).max(c(1e-30)) - c(1.0)).clamp01();
            if c(0.0).less(band).may_hold() {
                let noise = Dual::<R, 2>::gradient3(octave.lattice, octave.coordinates(s));
                sum = sum + noise * Dual::fixed(c(octave.amplitude) * band);
            }
        }
        sum
    }
}
