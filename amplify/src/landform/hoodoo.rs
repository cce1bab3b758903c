//! Hoodoos and goblins, spires that a grammar stacks (Paris 2019 §6.3, Fig. 20): blocks and cones on one another, a box as
//! cap. Rock decides which rule is taken and how wide a symbol is.

mod site;
#[cfg(test)]
mod tests;

pub use site::Habitat;

use super::parameter::{Check, ParameterError};
use super::random::Random;
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::volume::{Instance, Placement, Volume};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

/// What a terminal symbol is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminal {
    /// b.
    Block,
    /// c, narrower at its top.
    Cone,
    /// d, a wide low cap that ends a spire.
    Cap,
}

/// A terminal symbol with its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symbol {
    /// What it is.
    pub terminal: Terminal,
    /// The middle of its lower face, metres.
    pub foot: DVec3,
    /// s: its height, and the way up to the next, metres.
    pub size: f64,
    /// Half widths along its own two axes, metres.
    pub half: DVec2,
    /// Its turn about z, radians.
    pub turn: f64,
}

/// The grammar as it is written; what is left out has its default. Pairs are the value in rock of resistance 0 and in rock
/// of resistance 1; between them it changes in proportion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hoodoo {
    /// Size of the axiom, between these two at random, metres; 0.05 to 200, by default 2 and 4.
    pub size: [f64; 2],
    /// λ: size of the next symbol, in sizes of this; 0.1 to 1.5, by default 0.92.
    pub ratio: f64,
    /// p_B: probability that another block follows a block; 0 to 1, by default 0.5 and 0.8.
    pub block: [f64; 2],
    /// p_C: probability that no cap ends the spire at a cone's place; half of it goes on; 0 to 1, by default 0.9 and 0.6.
    pub cone: [f64; 2],
    /// Half width of a symbol, in sizes; 0.05 to 5, by default 0.35 and 0.7.
    pub width: [f64; 2],
    /// By how much chance changes a half width, as a share of it; 0 to 0.9, by default 0.15.
    pub variation: f64,
    /// How far chance moves a symbol aside, in half widths; 0 to 1, by default 0.15.
    pub offset: f64,
    /// Radius of edges and of the blend of neighbours, in half widths; 0.05 to 1, by default 0.4.
    pub roundness: f64,
    /// How deep the first symbol stands in the ground, in sizes; 0 to 1, by default 0.25.
    pub root: f64,
    /// A spire ends where the next symbol would be smaller than this, metres; 0.01 to 100, by default 0.5.
    pub least_size: f64,
    /// The most symbols of a spire; 1 to 10000, by default 40.
    pub symbols: u32,
    /// By default 0.
    pub seed: u32,
}

impl Default for Hoodoo {
    fn default() -> Hoodoo {
        Hoodoo {
            size: [2.0, 4.0],
            ratio: 0.92,
            block: [0.5, 0.8],
            cone: [0.9, 0.6],
            width: [0.35, 0.7],
            variation: 0.15,
            offset: 0.15,
            roundness: 0.4,
            root: 0.25,
            least_size: 0.5,
            symbols: 40,
            seed: 0,
        }
    }
}

/// Where Wyvill's falloff is T: (1 − u²)³ = 1/2 at u = √(1 − ∛½), the distance of the surface from a skeleton of energy
/// 2T in radii.
const SURFACE: f64 = 0.454_202_017;

/// Height of a cap in sizes.
const CAP_HEIGHT: f64 = 0.5;

/// Width of a cap in widths of other symbols.
const CAP_WIDTH: f64 = 1.3;

/// Width of the top of a cone in widths of its foot.
const CONE_TOP: f64 = 0.55;

/// The non-terminals.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    B,
    C,
    End,
}

impl Hoodoo {
    /// Goblins: small and squat, two or three symbols wider than high (Fig. 23).
    pub fn goblin() -> Hoodoo {
        Hoodoo {
            size: [0.8, 1.6],
            ratio: 0.95,
            block: [0.1, 0.35],
            cone: [0.5, 0.3],
            width: [0.7, 1.1],
            roundness: 0.8,
            least_size: 0.3,
            symbols: 4,
            ..Hoodoo::default()
        }
    }

    /// Are the parameters in their ranges?
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = Check("hoodoo");
        check.pair("size", self.size, [0.05, 200.0], "m")?;
        check.within("ratio", self.ratio, [0.1, 1.5], "sizes")?;
        check.pair("block", self.block, [0.0, 1.0], "(probability)")?;
        check.pair("cone", self.cone, [0.0, 1.0], "(probability)")?;
        check.pair("width", self.width, [0.05, 5.0], "sizes")?;
        check.within("variation", self.variation, [0.0, 0.9], "of the half width")?;
        check.within("offset", self.offset, [0.0, 1.0], "half widths")?;
        check.within("roundness", self.roundness, [0.05, 1.0], "half widths")?;
        check.within("root", self.root, [0.0, 1.0], "sizes")?;
        check.within("least_size", self.least_size, [0.01, 100.0], "m")?;
        check.within("symbols", f64::from(self.symbols), [1.0, 10_000.0], "symbols")
    }

    /// The spire that stands at `at`, its symbols from the ground up.
    ///
    /// A → B (1); B → b B (p_B); B → b C (1 − p_B); C → c B (p_C/2); C → c (p_C/2); C → d (1 − p_C); the next symbol stands
    /// at p + s·z with size λs. The figure's p depends on the rock at p, once for B and once for C. Without an end by size
    /// or count a spire is finite almost surely exactly if p_B < 1, and has (1/(1 − p_B) + 1)/(1 − p_C/2) symbols in the
    /// mean (claims P18); the count ends those of p_B = 1.
    ///
    /// `at` is within ±10⁷ m. `resistance` is ρ, clamped to [0, 1], 0 where it is no number. Chance follows from the seed and
    /// the place: a spire does not depend on others.
    ///
    /// # Errors
    /// The first parameter out of its range, or `at`.
    pub fn derive(&self, at: DVec3, resistance: impl Fn(DVec3) -> f64) -> Result<Vec<Symbol>, ParameterError> {
        self.check()?;
        Check("hoodoo").place("at", at)?;
        let random = Random::at(self.seed, at);
        let mix = |[soft, hard]: [f64; 2], rho: f64| soft + (hard - soft) * rho;
        let mut size = mix(self.size, random.unit(0));
        let mut p = at - DVec3::Z * self.root * size;
        let (mut next, mut symbols) = (Next::B, Vec::new());
        while next != Next::End && size >= self.least_size && symbols.len() < self.symbols as usize {
            // Six numbers of each symbol, the first of the place being the axiom's size.
            let chance = |j: u32| random.unit(1 + 6 * symbols.len() as u32 + j);
            let rho = resistance(p);
            let rho = if rho.is_nan() { 0.0 } else { rho.clamp(0.0, 1.0) };
            let (block, cone) = (mix(self.block, rho), mix(self.cone, rho));
            let draw = chance(0);
            let (terminal, follows) = match next {
                Next::B => (Terminal::Block, if draw < block { Next::B } else { Next::C }),
                _ if draw < 0.5 * cone => (Terminal::Cone, Next::B),
                _ if draw < cone => (Terminal::Cone, Next::End),
                _ => (Terminal::Cap, Next::End),
            };
            let width = mix(self.width, rho) * size * if terminal == Terminal::Cap { CAP_WIDTH } else { 1.0 };
            let vary = |j: u32| width * (1.0 + self.variation * (2.0 * chance(j) - 1.0));
            let half = DVec2::new(vary(1), vary(2));
            // The first symbol stands where it was put.
            let share = if symbols.is_empty() { 0.0 } else { self.offset * width };
            let aside = DVec2::new(2.0 * chance(3) - 1.0, 2.0 * chance(4) - 1.0) * share;
            symbols.push(Symbol { terminal, foot: p + aside.extend(0.0), size, half, turn: TAU * chance(5) });
            p.z += size;
            size *= self.ratio;
            next = follows;
        }
        Ok(symbols)
    }

    /// The primitive of a symbol that is not turned: solids of energy 2T whose surface alone, without neighbours, has the
    /// symbol's size.
    fn solid(&self, symbol: &Symbol, foot: DVec3) -> Primitive {
        let least = symbol.half.min_element();
        let radius = self.roundness * least.min(0.5 * symbol.size) / SURFACE;
        let inner = |half: f64| (half - SURFACE * radius).max(0.05 * least) as f32;
        let at = |height: f64| (foot + DVec3::Z * height).as_vec3().to_array();
        let cuboid = |height: f64| Skeleton::Cuboid {
            centre: at(0.5 * height),
            half: [inner(symbol.half.x), inner(symbol.half.y), (0.5 * height) as f32],
        };
        let skeleton = match symbol.terminal {
            Terminal::Block => cuboid(symbol.size),
            Terminal::Cap => cuboid(CAP_HEIGHT * symbol.size),
            Terminal::Cone => Skeleton::Cone {
                base: at(0.0),
                height: symbol.size as f32,
                low: inner(least),
                high: inner(CONE_TOP * least),
            },
        };
        Primitive { skeleton, radius: radius as f32, energy: 1.0 }
    }

    /// Compact primitives of `symbols`, for an index. Skeletons have sides along the axes, so turns are left out: widths and
    /// offsets vary instead.
    pub fn primitives(&self, symbols: &[Symbol]) -> Vec<Primitive> {
        symbols.iter().map(|symbol| self.solid(symbol, symbol.foot)).collect()
    }

    /// The blend of `symbols`, each turned about its own axis. One node for each symbol: narrow it to a box before it is
    /// asked often.
    pub fn volume(&self, symbols: &[Symbol]) -> Volume {
        let turned = |symbol: &Symbol| {
            let child = Volume::Few([self.solid(symbol, DVec3::ZERO)].into());
            let placement = Placement::new(symbol.foot, symbol.turn, 1.0).expect("feet and turns are finite");
            Volume::Instance(Arc::new(Instance { child, placement }))
        };
        Volume::Blend(symbols.iter().map(turned).collect())
    }
}
