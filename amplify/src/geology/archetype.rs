//! Geologies to start from, as files that can be copied and edited.

use super::Geology;

/// A named geology.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Archetype {
    /// Flat beds of varying resistance.
    HorizontalStrata,
    /// Beds bent into folds.
    Folded,
    /// Folded beds cut by two faults.
    Faulted,
    /// Thick limestone with weak bedding planes and a fracture.
    KarstLimestone,
    /// Soft rock with thin harder beds, hard domes and a weak band.
    Sandstone,
}

impl Archetype {
    /// All of them.
    pub const ALL: [Archetype; 5] = [
        Archetype::HorizontalStrata,
        Archetype::Folded,
        Archetype::Faulted,
        Archetype::KarstLimestone,
        Archetype::Sandstone,
    ];
    /// Its name in files and commands.
    pub fn name(self) -> &'static str {
        match self {
            Archetype::HorizontalStrata => "horizontal_strata",
            Archetype::Folded => "folded",
            Archetype::Faulted => "faulted",
            Archetype::KarstLimestone => "karst_limestone",
            Archetype::Sandstone => "sandstone",
        }
    }
    /// Its file.
    pub fn text(self) -> &'static str {
        match self {
            Archetype::HorizontalStrata => include_str!("archetypes/horizontal_strata.ron"),
            Archetype::Folded => include_str!("archetypes/folded.ron"),
            Archetype::Faulted => include_str!("archetypes/faulted.ron"),
            Archetype::KarstLimestone => include_str!("archetypes/karst_limestone.ron"),
            Archetype::Sandstone => include_str!("archetypes/sandstone.ron"),
        }
    }
    /// The geology.
    pub fn geology(self) -> Geology {
        Geology::parse(self.text()).expect("embedded files are valid; a test reads them all")
    }
}

/// The archetype of this name.
pub fn archetype(name: &str) -> Option<Archetype> {
    Archetype::ALL.into_iter().find(|a| a.name() == name)
}
