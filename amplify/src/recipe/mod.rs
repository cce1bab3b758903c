//! A heightfield amplified by a recipe: landforms in an order, each acting on what the ones before have left (Paris 2019 §6,
//! Fig. 12). One seed, one result, on any number of threads.

mod cook;
mod file;
mod maps;
#[cfg(test)]
mod tests;
mod water;

pub use cook::{Amplified, Made, Pantry, RecipeError, amplify};
pub use file::{Entry, FORMAT, Recipe, RecipeSyntax};
pub use maps::{Maps, coverage};
pub use water::accessible;

use crate::brush::Stroke;
use crate::landform::arch::Arch;
use crate::landform::canyon::Canyon;
use crate::landform::hoodoo::{Habitat, Hoodoo};
use crate::landform::karst::Karst;
use crate::landform::sea::Sea;
use crate::landform::{Check, ParameterError};
use serde::{Deserialize, Serialize};

/// What a recipe can ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Landform {
    /// Cliffs that waves undercut (§6.1).
    Sea(Sea),
    /// Valleys that rivers undercut (§6.1).
    Canyon(Canyon),
    /// Caves (§6.2).
    Karst {
        /// Percolation and spheres; sinks and resurgences of the user's.
        #[serde(default)]
        percolation: Karst,
        /// Pits of the terrain as sinks.
        #[serde(default)]
        pits: Option<Pits>,
        /// Places on cliffs as sinks (Fig. 24).
        #[serde(default)]
        cliffs: Option<Cliffs>,
    },
    /// Spires (§6.3).
    Hoodoos {
        /// The grammar.
        #[serde(default)]
        grammar: Hoodoo,
        /// Where they stand.
        #[serde(default)]
        habitat: Habitat,
        /// No two are nearer, metres; 0.1 to 10⁴.
        spacing: f64,
    },
    /// Strokes of brushes (§3.2), in place.
    Brush(Vec<Stroke>),
    /// An arch (§3.2, Fig. 8), in place.
    Arch(Arch),
}

/// Which pits of the terrain are sinks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pits {
    /// Depth below the rim, metres; 0 to 10⁵.
    pub depth: f64,
    /// The deepest so many; 1 to 10⁶.
    pub most: u32,
}

impl Default for Pits {
    fn default() -> Pits {
        Pits { depth: 1.0, most: 100 }
    }
}

/// Which places on cliffs are sinks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cliffs {
    /// The least slope, metres of height per metre; 0 to 100.
    pub slope: f64,
    /// No two are nearer, metres; 0.1 to 10⁴.
    pub spacing: f64,
}

impl Default for Cliffs {
    fn default() -> Cliffs {
        Cliffs { slope: 1.5, spacing: 100.0 }
    }
}

impl Landform {
    /// Its name in recipes.
    pub fn name(&self) -> &'static str {
        match self {
            Landform::Sea(_) => "sea",
            Landform::Canyon(_) => "canyon",
            Landform::Karst { .. } => "karst",
            Landform::Hoodoos { .. } => "hoodoos",
            Landform::Brush(_) => "brush",
            Landform::Arch(_) => "arch",
        }
    }
    /// # Errors
    /// The first parameter out of its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        match self {
            Landform::Sea(sea) => sea.check(),
            Landform::Canyon(canyon) => canyon.check(),
            Landform::Karst { percolation, pits, cliffs } => {
                percolation.check()?;
                let Pits { depth, most } = pits.unwrap_or_default();
                Check("pits").within("depth", depth, [0.0, 1e5], "m")?;
                Check("pits").within("most", most.into(), [1.0, 1e6], "pits")?;
                let Cliffs { slope, spacing } = cliffs.unwrap_or_default();
                Check("cliffs").within("slope", slope, [0.0, 100.0], "m/m")?;
                Check("cliffs").within("spacing", spacing, [0.1, 1e4], "m")
            }
            Landform::Hoodoos { grammar, habitat, spacing } => {
                grammar.check()?;
                habitat.check()?;
                Check("hoodoos").within("spacing", *spacing, [0.1, 1e4], "m")
            }
            Landform::Brush(_) => Ok(()),
            Landform::Arch(arch) => arch.check(),
        }
    }
}
