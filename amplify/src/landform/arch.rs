//! An arch as one stroke of the brush (Paris 2019 §8.2: procedural arches): primitives along a parabola between two feet,
//! sized so that the rod they blend to has the thickness that was asked.

use super::parameter::{Check, ParameterError};
use crate::brush::{Stroke, Tool};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// An arch as it is written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arch {
    /// Where it stands with one foot, metres; within ±10⁷.
    pub from: DVec3,
    /// With the other; 0.5 m to 2000 m away.
    pub to: DVec3,
    /// Height of the crown over the middle between the feet, to the axis of the rod, metres; 0 to 2000.
    pub rise: f64,
    /// Of the rod, metres; 0.1 to 500.
    pub thickness: f64,
    /// Adds a bridge of rock, or takes a tunnel away; adds by default.
    #[serde(default = "extrude")]
    pub tool: Tool,
    /// By how much chance moves each primitive along each axis, as a share of the thickness; 0 to 0.5, by default 0.
    #[serde(default)]
    pub roughness: f64,
    /// By default 0.
    #[serde(default)]
    pub seed: u32,
}

fn extrude() -> Tool {
    Tool::Extrude
}

/// Radius of the primitives in radii of the rod. A row of energies 1 half a radius R apart sums, at distance r from it, to
/// about 2 ∫ (1 − (r² + x²)/R²)³ dx / R = 64/35 · (1 − r²/R²)^{7/2}, which is T at r/R = √(1 − (35/128)^{2/7}) = 0.5565.
const SPREAD: f64 = 1.0 / 0.5565;

/// Straight pieces of the path: the parabola is off them by less than rise/4096.
const PIECES: u32 = 32;

impl Arch {
    /// Are the parameters in their ranges?
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("arch");
        check.place("from", self.from)?;
        check.place("to", self.to)?;
        check.within("span", self.from.distance(self.to), [0.5, 2000.0], "m")?;
        check.within("rise", self.rise, [0.0, 2000.0], "m")?;
        check.within("thickness", self.thickness, [0.1, 500.0], "m")?;
        check.within("roughness", self.roughness, [0.0, 0.5], "of the thickness")
    }

    /// The axis of the rod at t in [0, 1], metres.
    pub fn axis(&self, t: f64) -> DVec3 {
        self.from.lerp(self.to, t) + DVec3::Z * (4.0 * self.rise * t * (1.0 - t))
    }

    /// The stroke that draws it, for a [`Sculpture`](crate::brush::Sculpture), which can undo it.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn stroke(&self) -> Result<Stroke, ParameterError> {
        self.check()?;
        let corner = |k: u32| self.axis(f64::from(k) / f64::from(PIECES)).as_vec3().to_array();
        let radius = 0.5 * self.thickness * SPREAD;
        Ok(Stroke {
            tool: self.tool,
            path: (0..=PIECES).map(corner).collect(),
            radius: radius as f32,
            step: (0.5 * radius) as f32,
            strength: 1.0,
            scatter: (self.roughness * self.thickness) as f32,
            seed: self.seed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brush::Sculpture;
    use crate::field::{Density, THRESHOLD};
    use crate::implicit::primitive::Primitive;
    use crate::implicit::skeleton::Skeleton;
    use crate::implicit::volume::Volume;

    fn arch() -> Arch {
        let (from, to) = (DVec3::new(-20.0, 5.0, 1.0), DVec3::new(22.0, -3.0, 4.0));
        Arch { from, to, rise: 18.0, thickness: 4.0, tool: Tool::Extrude, roughness: 0.0, seed: 0 }
    }

    /// The radius of the rod at t across the arch's plane, in the direction in which it is straight.
    fn radius(volume: &Volume, arch: &Arch, t: f64, rock: bool) -> f64 {
        let across = (arch.to - arch.from).cross(DVec3::Z).normalize();
        let p = arch.axis(t);
        let steps = (0..400).take_while(|&k| (volume.value(p + across * f64::from(k) * 0.01) > THRESHOLD) == rock);
        steps.count() as f64 * 0.01
    }

    #[test]
    fn an_arch_is_as_thick_as_asked_and_open_below() {
        for thickness in [2.0, 4.0] {
            let arch = Arch { thickness, ..arch() };
            let mut sculpture = Sculpture::new(Volume::AIR);
            sculpture.draw(arch.stroke().unwrap()).unwrap();
            let volume = sculpture.volume();
            for t in [0.2, 0.35, 0.5, 0.8] {
                let found = radius(&volume, &arch, t, true);
                assert!((found / (0.5 * thickness) - 1.0).abs() < 0.05, "{found} at {t}");
            }
            let under = arch.axis(0.5) - DVec3::Z * (0.5 * thickness + 1.0);
            assert!(volume.value(under) < THRESHOLD && volume.value(arch.axis(0.5)) > THRESHOLD);
            // Control: half the primitives make a thinner rod.
            let stroke = arch.stroke().unwrap();
            let mut sparse = Sculpture::new(Volume::AIR);
            sparse.draw(Stroke { step: 2.0 * stroke.step, ..stroke }).unwrap();
            assert!(radius(&sparse.volume(), &arch, 0.5, true) < 0.9 * 0.5 * thickness);
        }
    }

    /// Solid rock of 2T, a box of it.
    #[test]
    fn a_tunnel_is_as_wide_as_asked() {
        let arch = Arch { tool: Tool::Intrude, ..arch() };
        let rock = Skeleton::Cuboid { centre: [0.0; 3], half: [60.0; 3] };
        let rock = Volume::Few([Primitive { skeleton: rock, radius: 5.0, energy: 1.0 }].into());
        let mut sculpture = Sculpture::new(rock);
        sculpture.draw(arch.stroke().unwrap()).unwrap();
        let found = radius(&sculpture.volume(), &arch, 0.5, false);
        assert!((found / 2.0 - 1.0).abs() < 0.05, "{found}");
        sculpture.undo();
        assert_eq!(radius(&sculpture.volume(), &arch, 0.5, false), 0.0);
    }

    #[test]
    fn text_has_defaults_and_what_makes_no_sense_is_refused_by_name() {
        let read: Arch = ron::from_str("(from: (0, 0, 0), to: (10, 0, 0), rise: 4, thickness: 1)").unwrap();
        assert!(read.tool == Tool::Extrude && read.roughness == 0.0);
        assert_eq!(read.check(), Ok(()));
        for (bad, field) in [
            (Arch { from: DVec3::NAN, ..read }, "from"),
            (Arch { to: DVec3::X * 1e8, ..read }, "to"),
            (Arch { to: read.from, ..read }, "span"),
            (Arch { rise: -1.0, ..read }, "rise"),
            (Arch { thickness: 0.0, ..read }, "thickness"),
            (Arch { roughness: 0.6, ..read }, "roughness"),
        ] {
            assert_eq!(bad.stroke().unwrap_err().field, field);
        }
        let rough = Arch { roughness: 0.2, ..read }.stroke().unwrap().primitives().unwrap();
        assert_ne!(rough, read.stroke().unwrap().primitives().unwrap());
    }
}
