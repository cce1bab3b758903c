//! Six landscapes with the titles and curve counts of Hnaidi 2010 Table 1, authored for this project: the paper's own curves were never
//! published.

use crate::landscape::{Landscape, LandscapeError};

/// One of [`ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// For commands and files.
    pub name: &'static str,
    /// As in Table 1.
    pub title: &'static str,
    /// "Features" of Table 1.
    pub curves: usize,
    /// The file.
    pub text: &'static str,
}

macro_rules! models {
    ($($name:literal $title:literal $curves:literal,)*) => {
        [$(Model {
            name: $name,
            title: $title,
            curves: $curves,
            text: include_str!(concat!("../landscapes/", $name, ".ron")),
        }),*]
    };
}

/// The models in the order of Table 1.
pub const ALL: [Model; 6] = models! {
    "mountain" "Mountain" 59,
    "lake" "Lake" 45,
    "canyon" "Canyon" 74,
    "hills" "Hills" 55,
    "island" "Volcanic island" 48,
    "desert" "Desert" 26,
};

/// The numbers of curves after which Fig. 10 shows the canyon: its first 15, its first 30, all.
pub const CANYON_STAGES: [usize; 3] = [15, 30, 74];

/// The model of that name.
pub fn named(name: &str) -> Option<Model> {
    ALL.into_iter().find(|model| model.name == name)
}

impl Model {
    /// The landscape.
    ///
    /// # Errors
    /// None for [`ALL`], which tests read.
    pub fn landscape(&self) -> Result<Landscape, LandscapeError> {
        Landscape::parse(self.text)
    }
}

#[cfg(test)]
#[path = "landscapes_tests.rs"]
mod tests;
