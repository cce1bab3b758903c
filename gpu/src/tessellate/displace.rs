//! Where a vertex lies: Phong tessellation, then fBm of the tessellation paper's Algorithm 1 along the normal, modulated by
//! slope, elevation and concavity. A pure function of the integer vertex and a camera, so equal vertices are bit-equal. It is
//! written over any number: on duals the same formula gives the tangents, and from them the normal.

use super::ground::{Block, Ground, Smooth, dot3};
use super::triangle::{SIDE, Vertex};
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::noise::{GRADIENT2_RANGE, GRADIENT3_RANGE, NoiseValue, Octave, Octaves};
use terrain_model::real::{Mask, Real};

/// Steps towards a place from above; each takes 0.7 of what is left.
const APPROACHES: usize = 24;

/// Where the noise is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// At (x, y, z), as the paper settles on.
    Volume,
    /// At (x, y): the paper's first attempt, which stretches on cliffs.
    Plan,
}

/// How octaves combine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// Algorithm 1: the sum over its range.
    Sum,
    /// Musgrave's product Π (offset + gᵏ n(fᵏ p)) about its value where the noise is 0, over its range; rough where it is high.
    /// The paper names it without a formula (§5).
    Multifractal {
        /// Added to each octave, at least 0; usually about 1.
        offset: f64,
    },
}

/// Noise along the normal. Its amplitude is never exceeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    octaves: Vec<Octave<3>>,
    plan: Vec<Octave<2>>,
    space: Space,
    amplitude: f64,
    /// How octaves combine.
    pub rule: Rule,
    /// Share of the amplitude on level ground, and on the lowest; 1 is no modulation.
    pub floor: [f64; 2],
    /// Elevations between which the share rises from its floor to 1, metres.
    pub elevation: [f64; 2],
    /// Share of the amplitude that is left in valleys whose Laplacian is above the second number, 1/m; ridges as sharp keep all, and
    /// between them it changes linearly (the paper's future work, §8).
    pub concavity: Option<[f64; 2]>,
}

impl Detail {
    /// fBm of `octaves`, whose `amplitude` is the largest displacement of the whole, metres; `None` if not sound.
    pub fn new(octaves: &Octaves, seed: u32, space: Space) -> Option<Detail> {
        let sound = octaves.is_sound() && octaves.amplitude >= 0.0;
        let shape = Octaves { amplitude: 1.0, ..*octaves };
        sound.then(|| Detail {
            octaves: shape.place(seed, [0.0; 3]),
            plan: shape.place(seed, [0.0; 2]),
            space,
            amplitude: octaves.amplitude,
            rule: Rule::Sum,
            floor: [1.0; 2],
            elevation: [0.0, 1.0],
            concavity: None,
        })
    }
    /// The largest displacement, metres.
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }
    /// Where the noise is read.
    pub fn space(&self) -> Space {
        self.space
    }
    /// The octaves of noise in space; their amplitudes are relative to each other.
    pub fn octaves(&self) -> &[Octave<3>] {
        &self.octaves
    }
    /// The octaves of noise in the plane.
    pub fn octaves_of_plan(&self) -> &[Octave<2>] {
        &self.plan
    }
    /// Musgrave's product where the noise is 0, and the most that it is off that: noise is within ± 1, and a product of intervals has
    /// its extremes at their ends.
    pub(super) fn product(&self, offset: f64) -> [f64; 2] {
        let (mut neutral, mut extremes) = (1.0, [1.0f64; 2]);
        for octave in &self.octaves {
            neutral *= offset;
            let ends = [offset - octave.amplitude, offset + octave.amplitude];
            let all = extremes.map(|e| ends.map(|end| e * end));
            let flat = all.as_flattened().iter();
            extremes = flat.fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(*x), high.max(*x)]);
        }
        [neutral, (extremes[1] - neutral).max(neutral - extremes[0]).max(f64::MIN_POSITIVE)]
    }
    /// The same noise for places relative to `eye`, on lattices moved there.
    pub fn seen_from(&self, eye: [f64; 3]) -> Detail {
        let mut seen = self.clone();
        seen.octaves.iter_mut().for_each(|octave| *octave = octave.moved_to(eye));
        seen.plan.iter_mut().for_each(|octave| *octave = octave.moved_to([eye[0], eye[1]]));
        seen.elevation = self.elevation.map(|z| z - eye[2]);
        seen
    }
    /// The noise at `p`, in [−1, 1]; 0 at its neutral value, so that the ground is moved neither up nor down on the whole.
    ///
    /// Algorithm 1 is Σ gᵏ n(fᵏ p) ÷ Σ gᵏ, which lies within ± sup|n|, here divided by the certified sup|n|. Octaves whose
    /// wavelength is below 4 `size` (metres between vertices) fade, and are gone at 2 `size`. Weights of at most 1 keep the
    /// bound; the range stays that of all octaves, so that those which remain do not change.
    pub fn fbm<R: NoiseValue>(&self, p: [R; 3], size: R) -> R {
        let offset = match self.rule {
            Rule::Sum => 0.0,
            Rule::Multifractal { offset } => offset,
        };
        let (mut sum, mut range, mut product) = (R::zero(), 0.0, R::one());
        for (octave, plan) in self.octaves.iter().zip(&self.plan) {
            let share = band(octave.frequency, size);
            let part = if R::zero().less(share).may_hold() {
                let noise = match self.space {
                    Space::Volume => R::gradient3(octave.lattice, octave.coordinates(p)) / R::constant(GRADIENT3_RANGE),
                    Space::Plan => {
                        R::gradient2(plan.lattice, plan.coordinates([p[0], p[1]])) / R::constant(GRADIENT2_RANGE)
                    }
                };
                share * R::constant(octave.amplitude) * noise
            } else {
                R::zero()
            };
            range += octave.amplitude;
            sum = sum + part;
            product = product * (R::constant(offset) + part);
        }
        let value = match self.rule {
            Rule::Sum => sum / R::constant(range),
            Rule::Multifractal { offset } => {
                let [neutral, reach] = self.product(offset);
                (product - R::constant(neutral)) / R::constant(reach)
            }
        };
        value.max(R::constant(-1.0)).min(R::one())
    }
    /// Is an octave left where vertices are `size` metres apart?
    pub fn alive(&self, size: f64) -> bool {
        self.octaves.iter().any(|octave| band(octave.frequency, size) > 0.0)
    }
    /// How far the displacement changes at most where the distance of vertices goes from one of `sizes` to the other, metres. Noise is
    /// within ± 1, so a sum over its range changes by the mean of what its bands do; of a product no more is said than its range.
    pub fn change(&self, sizes: [f64; 2]) -> f64 {
        let (mut sum, mut range) = (0.0, 0.0);
        for octave in &self.octaves {
            let [a, b] = sizes.map(|size| band(octave.frequency, size));
            sum += octave.amplitude * (a - b).abs();
            range += octave.amplitude;
        }
        let share = match self.rule {
            Rule::Sum => sum / range,
            Rule::Multifractal { .. } => {
                if sum == 0.0 {
                    0.0
                } else {
                    2.0
                }
            }
        };
        self.amplitude * share
    }
    /// Share of the amplitude, in [0, 1].
    fn share<R: Real>(&self, on: &Smooth<R>) -> R {
        let [low, high] = self.elevation;
        let rise = (on.position[2] - R::constant(low)) / R::constant((high - low).max(f64::MIN_POSITIVE));
        let mix = |floor: f64, t: R| R::constant(floor) + R::constant(1.0 - floor) * t;
        let hollow = match self.concavity {
            None => R::one(),
            Some([floor, sharp]) => {
                let t = R::constant(0.5) - on.curvature / R::constant(2.0 * sharp.max(f64::MIN_POSITIVE));
                mix(floor, t.clamp01())
            }
        };
        (mix(self.floor[0], R::one() - on.normal[2]) * mix(self.floor[1], rise.clamp01()) * hollow).clamp01()
    }
    /// The smooth surface, displaced.
    pub(super) fn moved<R: NoiseValue>(&self, on: &Smooth<R>, size: R) -> [R; 3] {
        let along = R::constant(self.amplitude) * self.share(on) * self.fbm(on.position, size);
        std::array::from_fn(|k| on.position[k] + along * on.normal[k])
    }
    /// Displaced position of `vertex`, metres from the south-west corner; `size` is the distance of vertices there.
    pub fn position(&self, ground: &Ground, vertex: Vertex, size: f64) -> [f64; 3] {
        let (cell, share) = ground.cell(vertex);
        self.moved(&ground.smooth_at(&ground.place(cell, share)), size)
    }
    /// Elevation of the displaced surface over a place, metres, without octaves that fade with distance: what a camera must stay
    /// above. The place is approached from its own vertex; where displacement folds the surface it is one of its sheets.
    pub fn elevation_over(&self, ground: &Ground, at: [f64; 2]) -> f64 {
        let sides = ground.sides();
        let vertex =
            |p: [f64; 2]| [0, 1].map(|k| (p[k] / sides[k] * f64::from(SIDE)).clamp(0.0, f64::from(SIDE)) as u32);
        let (mut from, mut z) = (at, 0.0);
        for _ in 0..APPROACHES {
            let p = self.position(ground, vertex(from), 0.0);
            from = [0, 1].map(|k| from[k] + 0.7 * (at[k] - p[k]));
            z = p[2];
        }
        z
    }
    /// Unit normal of the displaced surface at `vertex`: the cross product of its tangents, with `size` held. On the border of a
    /// cell it is that of the cell to the north or east; the surface itself is continuous there, its slope is not.
    pub fn normal(&self, ground: &Ground, vertex: Vertex, size: f64) -> [f64; 3] {
        let (cell, [u, v]) = ground.cell(vertex);
        let on = ground.smooth_at(&ground.place(cell, [Dual::<f64, 2>::variable(u, 0), Dual::variable(v, 1)]));
        upright(self.moved(&on, Dual::fixed(size)), &on)
    }
    /// `block` with room for the noise.
    pub fn widen(&self, block: Block) -> Block {
        let [low, high] = block.elevation;
        let a = self.amplitude;
        Block { elevation: [low - a, high + a], moved: block.moved + a }
    }
}

/// What is left of an octave where vertices are `size` metres apart: all below a quarter of its wavelength, nothing above half of it.
fn band<R: Real>(frequency: f64, size: R) -> R {
    let length = R::constant(2.0) * size * R::constant(frequency);
    (R::one() / length.max(R::constant(f64::MIN_POSITIVE)) - R::one()).clamp01()
}

/// Unit normal of a surface with its tangents. Where displacement folds it there may be none: that of the smooth one, `on`, then.
pub(super) fn upright<R: Differentiable>(surface: [Dual<R, 2>; 3], on: &Smooth<Dual<R, 2>>) -> [R; 3] {
    let [east, north] = [0, 1].map(|k| surface.map(|x| x.slope[k]));
    let normal = [
        east[1] * north[2] - east[2] * north[1],
        east[2] * north[0] - east[0] * north[2],
        east[0] * north[1] - east[1] * north[0],
    ];
    let length = dot3(normal, normal).sqrt();
    let there = R::zero().less(length);
    std::array::from_fn(|k| R::select(there, normal[k] / length, on.normal[k].value))
}
