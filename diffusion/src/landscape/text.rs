//! The text of a landscape: RON with one entry for each curve or preset, in the order in which they are drawn.
//!
//! ```
//! let text = r#"(
//!     format: "terrain-curves/1",
//!     title: "A ridge above a plain",
//!     extent: (1000, 1000),
//!     curves: [
//!         ("crest", ridge(points: [(200, 500, 180), (800, 550, 120)], left: (250, -35), right: (250, -30), noise: (6, 0.5))),
//!         ("plain", curve(path: ring([(100, 100), (900, 100), (900, 900), (100, 900)]), points: [
//!             (u: 0, elevation: (20, 0)),
//!             (u: 1, elevation: (20, 0)),
//!         ])),
//!     ],
//! )"#;
//! let landscape = terrain_diffusion::landscape::Landscape::parse(text)?;
//! assert_eq!(landscape.curves().len(), 2);
//! # Ok::<(), terrain_diffusion::landscape::LandscapeError>(())
//! ```

use super::{Feature, Frame, Landscape, LandscapeError, place};
use crate::detail::Detail;
use crate::presets::{Plain, Preset};
use glam::DVec2;
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};

/// The header every landscape starts with.
pub const FORMAT: &str = "terrain-curves/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File<C> {
    format: String,
    #[serde(default)]
    title: String,
    #[serde(default)]
    origin: DVec2,
    extent: DVec2,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    water: Option<f64>,
    #[serde(default)]
    detail: Detail,
    curves: Vec<(String, C)>,
}

/// The only entry that is written: presets have become curves.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Written {
    Curve(Plain),
}

const EXTENSIONS: Extensions = Extensions::IMPLICIT_SOME.union(Extensions::UNWRAP_VARIANT_NEWTYPES);

impl Landscape {
    /// Reads a landscape.
    ///
    /// # Errors
    /// [`LandscapeError::Syntax`] with line and column, or [`LandscapeError::Value`] with the curve's number and name.
    pub fn parse(text: &str) -> Result<Landscape, LandscapeError> {
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        let file: File<Preset> = options.from_str(text).map_err(|error| LandscapeError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            problem: error.code.to_string(),
        })?;
        if file.format != FORMAT {
            return Err(LandscapeError::value("format", format!("expected \"{FORMAT}\", found {:?}", file.format)));
        }
        let mut features = Vec::new();
        for (index, (name, preset)) in file.curves.iter().enumerate() {
            let drawn = preset.draw().map_err(|problem| LandscapeError::value(place(index, name), problem))?;
            let several = drawn.len() > 1;
            features.extend(drawn.into_iter().enumerate().map(|(k, drawn)| Feature {
                name: if several { format!("{name} {}", k + 1) } else { name.clone() },
                path: drawn.path,
                points: drawn.points,
            }));
        }
        let File { title, origin, extent, water, detail, .. } = file;
        Landscape::new(Frame { title, origin, extent, water, detail }, features)
    }
    /// The text of the landscape, every curve by its path and constraint points: [`Landscape::parse`] gives an equal one, up to a
    /// billionth of a degree in slopes.
    pub fn to_ron(&self) -> String {
        let Frame { title, origin, extent, water, detail } = self.frame.clone();
        let entry =
            |feature: &Feature| (feature.name.clone(), Written::Curve(Plain::of(&feature.path, &feature.points)));
        let curves = self.features.iter().map(entry).collect();
        let file = File { format: FORMAT.to_owned(), title, origin, extent, water, detail, curves };
        // One line for each constraint point.
        let pretty = ron::ser::PrettyConfig::new().depth_limit(5).extensions(EXTENSIONS);
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        options.to_string_pretty(&file, pretty).expect("numbers and names are always written")
    }
}
