//! What ground and water look like: colours that follow from elevation and gradient (Génevaux 2015 §8), and from the
//! densities of sand and of plants. A mottle, noise that leaves octaves finer than a pixel out, keeps borders of colours
//! from following contour lines (§6: textures are filtered with the level of detail).

use super::Look;
use crate::noise::{Combination, Octave, Octaves};
use glam::{DVec2, DVec3};

/// What a point of the ground is shaded by.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ground {
    /// Metres.
    pub elevation: f64,
    /// Metres per metre.
    pub gradient: DVec2,
    /// 0 to 1.
    pub sand: f64,
    /// 0 to 1.
    pub vegetation: f64,
    /// Metres below the surface of water; negative above it, −∞ where there is none.
    pub depth: f64,
}

/// The noise of the colours, its longest wave a part of the scene.
#[derive(Clone, Debug)]
pub(super) struct Mottle {
    octaves: Vec<Octave<2>>,
}

/// Longest waves of the mottle in the size of the scene.
const WAVES: f64 = 30.0;

impl Mottle {
    pub fn new(look: &Look) -> Mottle {
        let octaves = Octaves { octaves: 9, frequency: WAVES / look.size, lacunarity: 2.0, gain: 0.72, amplitude: 0.5 };
        Mottle { octaves: octaves.place(0x0A17, [0.0; 2]) }
    }
    /// Coarse and fine: the first three octaves, and those after them, as far as they are longer than two footprints.
    pub fn at(&self, p: DVec2, footprint: f64) -> [f64; 2] {
        let seen = self.octaves.iter().take_while(|octave| octave.frequency * footprint < 0.5).count();
        let sum = |octaves: &[Octave<2>]| Combination::Sum.plane(octaves, [p.x, p.y]);
        let coarse = seen.min(3);
        [sum(&self.octaves[..coarse]), sum(&self.octaves[coarse..seen])]
    }
}

/// A colour and how much of the light that falls on it the small shadows within it swallow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    pub colour: DVec3,
    pub shade: f64,
}

pub(super) fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Colours of level ground by relative elevation: meadow, grass, heath, dry grass, scree.
const TEMPERATE: [(f64, DVec3); 5] = [
    (0.00, DVec3::new(0.120, 0.165, 0.052)),
    (0.20, DVec3::new(0.128, 0.158, 0.055)),
    (0.45, DVec3::new(0.175, 0.170, 0.075)),
    (0.70, DVec3::new(0.235, 0.205, 0.120)),
    (1.00, DVec3::new(0.290, 0.265, 0.220)),
];
/// The same where little grows: silt, gravel, ochre, pale rock.
const ARID: [(f64, DVec3); 4] = [
    (0.00, DVec3::new(0.370, 0.280, 0.175)),
    (0.30, DVec3::new(0.330, 0.225, 0.130)),
    (0.65, DVec3::new(0.270, 0.165, 0.095)),
    (1.00, DVec3::new(0.330, 0.240, 0.170)),
];

fn graded(colours: &[(f64, DVec3)], height: f64) -> DVec3 {
    colours.windows(2).fold(colours[0].1, |colour, pair| colour.lerp(pair[1].1, smooth(pair[0].0, pair[1].0, height)))
}

fn relative(elevation: f64, look: &Look) -> f64 {
    (elevation - look.elevations[0]) / (look.elevations[1] - look.elevations[0]).max(1e-9)
}

pub(super) fn ground(at: &Ground, mottle: [f64; 2], look: &Look) -> Material {
    let [coarse, fine] = mottle;
    let height = relative(at.elevation, look) + 0.10 * coarse + 0.04 * fine;
    let slope = at.gradient.length();
    let (soil, rocks) = if look.arid {
        (graded(&ARID, height), [DVec3::new(0.270, 0.150, 0.085), DVec3::new(0.300, 0.215, 0.155)])
    } else {
        (graded(&TEMPERATE, height), [DVec3::new(0.195, 0.170, 0.140), DVec3::new(0.330, 0.310, 0.285)])
    };
    let soil = soil * (1.0 + 0.30 * coarse + 0.30 * fine);
    // Rock shows its strata: bands of elevation, bent by the mottle.
    let bands = 0.5 + 0.5 * triangle(40.0 * height + 1.5 * fine);
    let rock = rocks[0].lerp(rocks[1], smooth(0.1, 0.9, height)) * (0.80 + 0.24 * bands + 0.30 * fine);
    // Soil thins on slopes from 22° on, and bare rock stands from 43°.
    let bare = smooth(0.42, 0.92, slope + 0.22 * fine + 0.10 * coarse);
    let mut colour = soil.lerp(rock, bare);
    let mut shade = 1.0;

    let sand = at.sand * (1.0 - smooth(0.55, 0.95, slope));
    if sand > 0.0 {
        let grains = DVec3::new(0.560, 0.410, 0.225) * (1.0 + 0.10 * coarse + 0.08 * fine);
        colour = colour.lerp(grains, smooth(0.25, 0.6, sand + 0.25 * fine));
    }
    if look.snow.is_finite() {
        let span = (look.elevations[1] - look.elevations[0]).max(1e-9);
        let above = (at.elevation - look.snow) / span + 0.10 * coarse + 0.05 * fine;
        // Snow slides off what is steeper than about 45°.
        let lies = smooth(-0.04, 0.08, above) * (1.0 - smooth(0.75, 1.35, slope + 0.25 * fine));
        colour = colour.lerp(DVec3::new(0.80, 0.83, 0.88), lies);
    }
    if at.vegetation > 0.0 {
        // The finest octaves are crowns: where they are high enough for the density stands a tree.
        let cover = smooth(0.42, 0.58, at.vegetation + 0.75 * fine + 0.15 * coarse) * (1.0 - smooth(0.85, 1.3, slope));
        let leaves = DVec3::new(0.034, 0.062, 0.018).lerp(DVec3::new(0.085, 0.110, 0.030), 0.5 + 0.9 * fine);
        colour = colour.lerp(leaves.max(DVec3::splat(0.01)), cover);
        shade = 1.0 - cover * (0.30 - 0.5 * fine).clamp(0.0, 0.6);
    }
    // Damp ground at the shore, and what lies below the water.
    let span = (look.elevations[1] - look.elevations[0]).max(1e-9);
    let damp = smooth(-0.012, -0.002, at.depth / span);
    let silt = if look.arid { DVec3::new(0.24, 0.185, 0.115) } else { DVec3::new(0.185, 0.160, 0.110) };
    colour = colour.lerp(silt, 0.75 * damp);
    Material { colour, shade }
}

/// 1 at even, −1 at odd integers, straight between.
fn triangle(x: f64) -> f64 {
    let t = 0.5 * x;
    4.0 * (t - t.floor() - 0.5).abs() - 1.0
}

/// The cut of the model, as a section is drawn: a thin soil over bands of rock.
pub(super) fn section(z: f64, elevation: f64, look: &Look) -> DVec3 {
    let span = (look.elevations[1] - look.floor).max(1e-9);
    let bands = (z - look.floor) / (0.14 * span);
    let within = bands - bands.floor();
    let band = smooth(0.40, 0.50, within) - smooth(0.90, 1.0, within);
    let rock = DVec3::new(0.205, 0.165, 0.130).lerp(DVec3::new(0.275, 0.230, 0.185), band);
    DVec3::new(0.100, 0.075, 0.045).lerp(rock, smooth(0.015, 0.03, (elevation - z) / span))
}

/// Light on a surface that `sun` of the sun's light reaches.
pub(super) fn light(sun: f64, normal: DVec3) -> DVec3 {
    let sunlight = DVec3::new(1.0, 0.90, 0.74) * (3.5 * sun);
    let sky = DVec3::new(0.36, 0.49, 0.70) * (0.22 + 0.34 * normal.z);
    // What the ground opposite sends back.
    sunlight + sky + DVec3::new(0.17, 0.14, 0.10) * (1.0 - normal.z)
}

pub(super) fn sky(direction: DVec3, look: &Look) -> DVec3 {
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

/// Water over a bed of colour `bed`, seen through `path` metres of it: what comes back from below.
pub(super) fn water(bed: DVec3, path: f64, look: &Look) -> DVec3 {
    // 1/(1 + x)² stands for the exponential of absorption. Clear water of the scene's scale: a hundredth of its relief
    // takes half of the green.
    let span = (look.elevations[1] - look.elevations[0]).max(1e-9);
    let x = path.max(0.0) / (0.03 * span);
    let passed = (DVec3::ONE + DVec3::new(2.4, 0.9, 0.8) * x).recip();
    let body = DVec3::new(0.012, 0.060, 0.085);
    bed * passed * passed + body * (DVec3::ONE - passed * passed)
}

/// Reflection of water at an angle with this cosine (Schlick's approximation with 2 % at the vertical).
pub(super) fn mirror(cosine: f64) -> f64 {
    let grazing = 1.0 - cosine.clamp(0.0, 1.0);
    let square = grazing * grazing;
    0.02 + 0.98 * square * square * grazing
}
