//! Where a vertex lies: Phong tessellation, then fBm of the tessellation paper's Algorithm 1 along the normal, modulated by
//! slope and elevation. A pure function of the integer vertex and a camera, so equal vertices are bit-equal.

use super::ground::{Block, Ground};
use super::triangle::Vertex;
use terrain_model::noise::{GRADIENT2_RANGE, GRADIENT3_RANGE, NoiseValue, Octave, Octaves};

/// Where the noise is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// At (x, y, z), as the paper settles on.
    Volume,
    /// At (x, y): the paper's first attempt, which stretches on cliffs.
    Plan,
}

/// Noise along the normal. Its amplitude is never exceeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    octaves: Vec<Octave<3>>,
    plan: Vec<Octave<2>>,
    space: Space,
    amplitude: f64,
    /// Share of the amplitude on level ground, and on the lowest; 1 is no modulation.
    pub floor: [f64; 2],
    /// Elevations between which the share rises from its floor to 1, metres.
    pub elevation: [f64; 2],
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
            floor: [1.0; 2],
            elevation: [0.0, 1.0],
        })
    }
    /// Algorithm 1: Σ gᵏ n(fᵏ p) ÷ Σ gᵏ, which lies within ± sup|n|, here divided by the certified sup|n|: in [−1, 1].
    ///
    /// Octaves whose wavelength is below 4 `size` (metres between vertices) fade, and are gone at 2 `size`. Weights of
    /// at most 1 keep the bound; the range stays that of all octaves, so that those which remain do not change.
    pub fn fbm(&self, p: [f64; 3], size: f64) -> f64 {
        let (mut sum, mut range) = (0.0, 0.0);
        for (octave, plan) in self.octaves.iter().zip(&self.plan) {
            range += octave.amplitude;
            let share = (1.0 / (2.0 * size * octave.frequency).max(f64::MIN_POSITIVE) - 1.0).clamp(0.0, 1.0);
            if share > 0.0 {
                let noise = match self.space {
                    Space::Volume => f64::gradient3(octave.lattice, octave.coordinates(p)) / GRADIENT3_RANGE,
                    Space::Plan => f64::gradient2(plan.lattice, plan.coordinates([p[0], p[1]])) / GRADIENT2_RANGE,
                };
                sum += share * octave.amplitude * noise;
            }
        }
        (sum / range).clamp(-1.0, 1.0)
    }
    fn share(&self, elevation: f64, normal: [f64; 3]) -> f64 {
        let [low, high] = self.elevation;
        let rise = ((elevation - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let mix = |floor: f64, t: f64| floor + (1.0 - floor) * t;
        (mix(self.floor[0], 1.0 - normal[2]) * mix(self.floor[1], rise)).clamp(0.0, 1.0)
    }
    /// Displaced position of `vertex`, metres from the south-west corner; `size` is the distance of vertices there.
    pub fn position(&self, ground: &Ground, vertex: Vertex, size: f64) -> [f64; 3] {
        let (p, normal) = ground.smooth(vertex);
        let along = self.amplitude * self.share(p[2], normal) * self.fbm(p, size);
        std::array::from_fn(|k| p[k] + along * normal[k])
    }
    /// `block` with room for the noise.
    pub fn widen(&self, block: Block) -> Block {
        let [low, high] = block.elevation;
        let a = self.amplitude;
        Block { elevation: [low - a, high + a], moved: block.moved + a }
    }
}
