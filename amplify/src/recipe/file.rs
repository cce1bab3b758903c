//! The text form of a recipe, RON, format `terrain-recipe/1`. Lengths are metres, z up; files are relative to the recipe.

use super::Landform;
use crate::implicit::surface::Distance;
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};

/// What a file says it is.
pub const FORMAT: &str = "terrain-recipe/1";

const EXTENSIONS: Extensions = Extensions::IMPLICIT_SOME.union(Extensions::UNWRAP_VARIANT_NEWTYPES);

/// How a heightfield is amplified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// [`FORMAT`].
    format: String,
    /// The rock: the name of an archetype, or a file (terrain-geology/1).
    pub geology: String,
    /// R of the heightfield's surface; two samples' spacings when absent.
    #[serde(default)]
    pub radius: Option<f64>,
    /// Elevation of the floor; 2R below the lowest sample when absent. Karst and canyons need rock below the surface.
    #[serde(default)]
    pub floor: Option<f64>,
    /// Which distance to the surface.
    #[serde(default)]
    pub distance: Distance,
    /// What happens to it, in this order: each acts on what the ones before have left.
    pub landforms: Vec<Entry>,
}

/// One landform and where it may act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Which, with its parameters.
    pub make: Landform,
    /// A raster over the ground: primitives stay where its nearest sample is above 0.
    #[serde(default)]
    pub mask: Option<String>,
    /// A box, lower and upper corner, outside of which nothing is placed.
    #[serde(default)]
    pub within: Option<[(f64, f64, f64); 2]>,
    /// A construction tree (terrain-volume/1): primitives stay where their centre is in its rock.
    #[serde(default)]
    pub inside: Option<String>,
    /// The most primitives; the first of them stay.
    #[serde(default)]
    pub limit: Option<usize>,
}

impl Entry {
    /// A landform wherever it can be.
    pub fn of(make: Landform) -> Entry {
        Entry { make, mask: None, within: None, inside: None, limit: None }
    }
}

/// Text that is no recipe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct RecipeSyntax {
    /// From 1.
    pub line: usize,
    /// From 1.
    pub column: usize,
    /// What was expected.
    pub problem: String,
}

impl Recipe {
    /// A recipe in rock of this name.
    pub fn new(geology: &str, landforms: Vec<Entry>) -> Recipe {
        Recipe {
            format: FORMAT.to_owned(),
            geology: geology.to_owned(),
            radius: None,
            floor: None,
            distance: Distance::default(),
            landforms,
        }
    }
    /// Reads a recipe; its numbers are checked when it is cooked.
    ///
    /// # Errors
    /// [`RecipeSyntax`] with the place.
    pub fn parse(text: &str) -> Result<Recipe, RecipeSyntax> {
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        let recipe: Recipe = options.from_str(text).map_err(|error| RecipeSyntax {
            line: error.span.start.line,
            column: error.span.start.col,
            problem: error.code.to_string(),
        })?;
        if recipe.format != FORMAT {
            let problem = format!("format: expected \"{FORMAT}\", found {:?}", recipe.format);
            return Err(RecipeSyntax { line: 1, column: 1, problem });
        }
        Ok(recipe)
    }
    /// Its text; [`Recipe::parse`] gives an equal recipe.
    pub fn to_ron(&self) -> String {
        let pretty = ron::ser::PrettyConfig::new().extensions(EXTENSIONS);
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        options.to_string_pretty(self, pretty).expect("numbers are always written")
    }
}
