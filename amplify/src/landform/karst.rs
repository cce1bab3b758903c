//! Caves where water finds its way through the weakest rock (Paris 2019 §6.2): invasion percolation from sinks downward and
//! from resurgences upward, each invaded site of soluble rock carved by a sphere.

use super::energy::Attack;
use super::parameter::{Check, ParameterError};
use super::percolation::{Propagation, Rule, Site, Start, percolate};
use super::random::Random;
use crate::field::Box3;
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The largest coordinate, metres: positions in cells of the smallest spacing are then numbers of 32 bits.
const LARGEST: f64 = 1e7;

/// A karst as it is written; what is left out has its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Karst {
    /// No two sites are nearer than this, metres; 0.05 to 1000, by default 3.
    pub spacing: f64,
    /// From a site to the candidates around it, in spacings; 1.001 to 3, by default 1.2.
    pub stride: f64,
    /// Candidates tried around a site; 1 to 64, by default 8.
    pub directions: u32,
    /// ε: how far chance moves a candidate in the queue, in units of ρ; 0 to 1, by default 0.1. 0 is the deterministic
    /// original.
    pub perturbation: f64,
    /// Percolation stops when the first resistance in the queue, perturbed, is not below this; 0 to 2, by default 0.8.
    pub threshold: f64,
    /// ρ₀: invaded sites of this resistance or more are not carved; 0 to 1, by default 0.7.
    pub soluble: f64,
    /// σ: the stress of water; 0 to 1, by default 1.
    pub stress: f64,
    /// β: the effect that full stress has on the hardest rock; 0 to 1, by default 0.2.
    pub on_hardest: f64,
    /// Radii of spheres in the hardest and in the softest rock, between them in proportion, metres; 0.05 to 10000, by
    /// default 4 and 6.
    pub radius: [f64; 2],
    /// How much of the field a sphere takes where the effect is 1; 0.01 to 10, by default 1.5.
    pub strength: f64,
    /// The most sites; 1 to 10000000, by default 20000.
    pub sites: u32,
    /// Of directions and perturbation, by default 0.
    pub seed: u32,
    /// Where water enters, besides the pits of the terrain, metres.
    pub sinks: Vec<DVec3>,
    /// Where water comes out, metres. The network grows from there too, against the flow, and meets the others.
    pub resurgences: Vec<DVec3>,
}

impl Default for Karst {
    fn default() -> Karst {
        Karst {
            spacing: 3.0,
            stride: 1.2,
            directions: 8,
            perturbation: 0.1,
            threshold: 0.8,
            soluble: 0.7,
            stress: 1.0,
            on_hardest: 0.2,
            radius: [4.0, 6.0],
            strength: 1.5,
            sites: 20_000,
            seed: 0,
            sinks: Vec::new(),
            resurgences: Vec::new(),
        }
    }
}

/// A karst that cannot grow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KarstError {
    /// A parameter out of its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No domain.
    #[error("karst: the domain is {low} to {high}, expected a box with a volume within ±10000000 m")]
    Domain {
        /// Its low corner, metres.
        low: DVec3,
        /// Its high corner, metres.
        high: DVec3,
    },
    /// A start that is not in the domain.
    #[error("karst: {kind} {index} is at {position}, expected a point of the domain, {low} to {high}")]
    Start {
        /// Sink, pit or resurgence.
        kind: &'static str,
        /// From 0.
        index: usize,
        /// Where it is, metres.
        position: DVec3,
        /// The domain's low corner, metres.
        low: DVec3,
        /// The domain's high corner, metres.
        high: DVec3,
    },
    /// Nowhere to begin.
    #[error("karst: no sink, pit or resurgence, expected at least one")]
    Dry,
}

/// Directions on the lower hemisphere, on the upper one against the flow. They follow from the site alone.
#[derive(Clone, Copy, Debug)]
pub struct Hemisphere {
    /// From a site to its candidates, metres.
    pub reach: f64,
    /// How many.
    pub directions: u32,
    /// Of the directions.
    pub seed: u32,
}

impl Propagation for Hemisphere {
    fn candidates(&self, position: DVec3, upstream: bool, found: &mut Vec<DVec3>) {
        let random = Random::at(self.seed, position);
        found.extend((0..self.directions).map(|k| {
            let d = random.direction(k);
            position + self.reach * d.with_z(if upstream { d.z.abs() } else { -d.z.abs() })
        }));
    }
}

impl Karst {
    /// Are the parameters in their ranges?
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("karst");
        check.within("spacing", self.spacing, [0.05, 1000.0], "m")?;
        check.within("stride", self.stride, [1.001, 3.0], "spacings")?;
        check.within("directions", f64::from(self.directions), [1.0, 64.0], "around a site")?;
        check.within("perturbation", self.perturbation, [0.0, 1.0], "of resistance")?;
        check.within("threshold", self.threshold, [0.0, 2.0], "of resistance")?;
        check.within("soluble", self.soluble, [0.0, 1.0], "of resistance")?;
        check.within("stress", self.stress, [0.0, 1.0], "(no unit)")?;
        check.within("on_hardest", self.on_hardest, [0.0, 1.0], "(no unit)")?;
        check.pair("radius", self.radius, [0.05, 10_000.0], "m")?;
        check.within("strength", self.strength, [0.01, 10.0], "of the field")?;
        check.within("sites", f64::from(self.sites), [1.0, 1e7], "sites")
    }

    /// The starts in their order: sinks, `pits`, resurgences.
    fn starts(&self, domain: &Box3, pits: &[DVec3]) -> Result<Vec<Start>, KarstError> {
        let mut starts = Vec::with_capacity(self.sinks.len() + pits.len() + self.resurgences.len());
        for (kind, positions, upstream) in
            [("sink", &self.sinks[..], false), ("pit", pits, false), ("resurgence", &self.resurgences[..], true)]
        {
            for (index, &position) in positions.iter().enumerate() {
                if !domain.contains(position) {
                    let (low, high) = (domain.low, domain.high);
                    return Err(KarstError::Start { kind, index, position, low, high });
                }
                starts.push(Start { position, upstream });
            }
        }
        if starts.is_empty() { Err(KarstError::Dry) } else { Ok(starts) }
    }

    /// The sites in the order in which water invades them: the first s are the paper's state s (Fig. 14).
    ///
    /// `pits` are sinks found in the terrain; candidates are kept to `domain` and to where `inside` holds, so the number of
    /// sites has the bound [`Karst::most_sites`]. `resistance` is ρ, in [0, 1]. A start nearer than the spacing to an
    /// earlier one is left out. Directions and perturbation follow from each site's place and the seed: what grows
    /// elsewhere does not change a network.
    ///
    /// # Errors
    /// A [`KarstError`] names what is out of range.
    pub fn grow(
        &self,
        domain: &Box3,
        inside: impl Fn(DVec3) -> bool,
        pits: &[DVec3],
        resistance: impl Fn(DVec3) -> f64,
    ) -> Result<Vec<Site>, KarstError> {
        self.check()?;
        let (low, high) = (domain.low, domain.high);
        if !(low.cmplt(high).all() && low.min_element() >= -LARGEST && high.max_element() <= LARGEST) {
            return Err(KarstError::Domain { low, high });
        }
        let starts = self.starts(domain, pits)?;
        let &Karst { spacing, perturbation, threshold, seed, .. } = self;
        let rule = Rule { spacing, perturbation, threshold, limit: self.sites as usize, seed };
        let around = Hemisphere { reach: spacing * self.stride, directions: self.directions, seed: seed ^ 0x6b61_7273 };
        Ok(percolate(&starts, &rule, resistance, |p| domain.contains(p) && inside(p), &around))
    }

    /// A bound on the number of sites in `domain`, whatever `sites` says: balls of half the spacing about them do not
    /// overlap and fit into the domain grown by as much.
    pub fn most_sites(&self, domain: &Box3) -> f64 {
        let grown = domain.high - domain.low + self.spacing;
        let ball = std::f64::consts::PI / 6.0 * self.spacing * self.spacing * self.spacing;
        grown.x * grown.y * grown.z / ball
    }

    /// The sphere that carves a site, `None` in rock that is not soluble. Its energy is e(ρ, σ) of [`Attack::effect`] times
    /// the strength, and negative.
    pub fn sphere(&self, site: &Site) -> Option<Primitive> {
        let resistance = site.resistance;
        let [hard, soft] = self.radius;
        let radius = (soft + (hard - soft) * resistance) as f32;
        let effect = Attack { resistance, stress: self.stress }.effect(self.on_hardest);
        let energy = -(self.strength * effect) as f32;
        let skeleton = Skeleton::Point(site.position.as_vec3().to_array());
        (resistance < self.soluble && energy < 0.0).then_some(Primitive { skeleton, radius, energy })
    }

    /// The spheres of `sites`, to be blended with the terrain.
    pub fn primitives(&self, sites: &[Site]) -> Vec<Primitive> {
        sites.iter().filter_map(|site| self.sphere(site)).collect()
    }
}

#[cfg(test)]
mod tests;
