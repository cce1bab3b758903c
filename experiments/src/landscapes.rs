//! Finding a landscape of feature curves: a file, as text or compact, or one that is embedded in the program.

use crate::scenes::BUILTIN;
use std::path::Path;
use terrain_diffusion::landscape::{Landscape, LandscapeError};
use terrain_diffusion::landscapes::ALL;

/// The small landscapes of figures: name and text.
const FIGURES: &[(&str, &str)] = &[
    ("fig2_layers", include_str!("../landscapes/fig2_layers.ron")),
    ("fig5_ridge", include_str!("../landscapes/fig5_ridge.ron")),
    ("fig5_peak", include_str!("../landscapes/fig5_peak.ron")),
    ("fig6_river", include_str!("../landscapes/fig6_river.ron")),
    ("fig6_cliff", include_str!("../landscapes/fig6_cliff.ron")),
    ("fig7_hill", include_str!("../landscapes/fig7_hill.ron")),
    ("fig7_crack", include_str!("../landscapes/fig7_crack.ron")),
    ("fig8_amplitude", include_str!("../landscapes/fig8_amplitude.ron")),
    ("fig8_roughness", include_str!("../landscapes/fig8_roughness.ron")),
    ("fig9_crossing", include_str!("../landscapes/fig9_crossing.ron")),
];

/// The embedded landscapes, the models of Table 1 first.
fn embedded() -> impl Iterator<Item = (&'static str, &'static str)> {
    ALL.iter().map(|model| (model.name, model.text)).chain(FIGURES.iter().copied())
}

/// Names of the embedded landscapes, for `builtin:NAME`.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    embedded().map(|(name, _)| name)
}

fn known() -> String {
    builtin_names().map(|name| format!("{BUILTIN}{name}")).collect::<Vec<_>>().join(", ")
}

/// The text of an embedded landscape.
///
/// # Errors
/// One line with the names there are.
pub fn builtin_text(name: &str) -> Result<&'static str, String> {
    let found = embedded().find(|(known, _)| *known == name);
    let none = || format!("{BUILTIN}{name}: no such landscape is embedded; use one of {}, or a file", known());
    found.map(|(_, text)| text).ok_or_else(none)
}

/// An embedded landscape.
///
/// # Errors
/// As [`load`].
pub fn builtin(name: &str) -> Result<Landscape, String> {
    Landscape::parse(builtin_text(name)?).map_err(|error| located(&format!("{BUILTIN}{name}"), &error))
}

/// Loads `builtin:NAME`, or a file: compact if it starts like one, else text.
///
/// # Errors
/// One line that names the file, the place and what was expected there.
pub fn load(path_or_builtin: &str) -> Result<Landscape, String> {
    if let Some(name) = path_or_builtin.strip_prefix(BUILTIN) {
        return builtin(name);
    }
    let bytes = std::fs::read(Path::new(path_or_builtin)).map_err(|error| {
        format!("{path_or_builtin}: {error}; expected a file of feature curves, or one of the embedded: {}", known())
    })?;
    if bytes.starts_with(b"TCC") {
        return Landscape::from_compact(&bytes).map_err(|error| located(path_or_builtin, &error));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        format!("{path_or_builtin}: byte {at} is no UTF-8; expected feature curves as RON text or in the compact form")
    })?;
    Landscape::parse(&text).map_err(|error| located(path_or_builtin, &error))
}

/// The error behind the file's name; a line and a column follow it without a space, as editors expect.
fn located(file: &str, error: &LandscapeError) -> String {
    let line = error.to_string().replace('\n', " ");
    if matches!(error, LandscapeError::Syntax { .. }) { format!("{file}:{line}") } else { format!("{file}: {line}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_landscape_parses_and_survives_its_compact_form() {
        for name in builtin_names() {
            let landscape = builtin(name).unwrap();
            let back = Landscape::from_compact(&landscape.to_compact().unwrap()).unwrap();
            assert_eq!(back.curves().len(), landscape.curves().len(), "{name}");
        }
    }
}
