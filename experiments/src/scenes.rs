//! Finding a scene: a file with the images beside it, or one that is embedded in the program.

use miette::{Diagnostic, NamedSource, SourceOffset, SourceSpan};
use std::path::Path;
use std::sync::Arc;
use terrain_model::grid::Grid;
use terrain_model::io;
use terrain_model::primitive::image::Image;
use terrain_model::scene::{PlacedImage, Scene, SceneError};

/// What an argument starts with that names an embedded scene.
pub const BUILTIN: &str = "builtin:";

/// The embedded scenes: name and text. Images are looked up in [`IMAGES`] by the name that the scene gives them.
const SCENES: &[(&str, &str)] = &[
    ("demo", include_str!("../scenes/demo.ron")),
    ("fig1", include_str!("../scenes/fig1.ron")),
    ("fig3", include_str!("../scenes/fig3.ron")),
    ("fig5_discs", include_str!("../scenes/fig5_discs.ron")),
    ("fig6_river", include_str!("../scenes/fig6_river.ron")),
    ("fig7_lake", include_str!("../scenes/fig7_lake.ron")),
    ("fig8_quad", include_str!("../scenes/fig8_quad.ron")),
    ("fig9_strip", include_str!("../scenes/fig9_strip.ron")),
    ("fig10_blend", include_str!("../scenes/fig10_blend.ron")),
    ("fig11_union", include_str!("../scenes/fig11_union.ron")),
    ("fig12_craters", include_str!("../scenes/fig12_craters.ron")),
    ("fig13_dunes", include_str!("../scenes/fig13_dunes.ron")),
    ("fig14_warp", include_str!("../scenes/fig14_warp.ron")),
    ("fig15_instances", include_str!("../scenes/fig15_instances.ron")),
    ("fig16_lod", include_str!("../scenes/fig16_lod.ron")),
    ("fig17_dunes", include_str!("../scenes/fig17_dunes.ron")),
    ("fig19", include_str!("../scenes/fig19.ron")),
    ("fig20", include_str!("../scenes/fig20.ron")),
    ("fig21", include_str!("../scenes/fig21.ron")),
    ("fig22", include_str!("../scenes/fig22.ron")),
    ("fig23_instances", include_str!("../scenes/fig23_instances.ron")),
];

/// The embedded GeoTIFFs, named as a scene in `experiments/scenes` reaches them: such a scene can also be read as a file.
const IMAGES: &[(&str, &[u8])] =
    &[("../data/jacksboro/jacksboro.tif", include_bytes!("../data/jacksboro/jacksboro.tif"))];

/// Why a scene cannot be loaded; each prints as one line. A syntax error also carries the source, for `miette`.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum SceneFileError {
    /// No embedded scene has this name.
    #[error("{BUILTIN}{name}: no such scene is embedded; use one of {known}, or a file")]
    Builtin {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The file cannot be read.
    #[error("{file}: {source}; expected a scene file (.ron) or one of the embedded scenes: {known}")]
    Io {
        /// The file.
        file: String,
        /// What the system said.
        source: std::io::Error,
        /// The names of the embedded scenes.
        known: String,
    },
    /// The text is not a scene.
    #[error("{file}:{line}:{column}: {problem}")]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was expected.
        problem: String,
        /// The text of the scene.
        #[source_code]
        text: Arc<NamedSource<String>>,
        /// Where in the text.
        #[label("here")]
        span: SourceSpan,
    },
    /// A node, or an image it names, cannot be used.
    #[error("{file}: {path}: {problem}")]
    Node {
        /// The file.
        file: String,
        /// Where, as `layers.bedrock.blend[3]`.
        path: String,
        /// What was expected.
        problem: String,
    },
}

/// Names of the embedded scenes, for `builtin:NAME`.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

fn known() -> String {
    builtin_names().map(|name| format!("{BUILTIN}{name}")).collect::<Vec<_>>().join(", ")
}

/// Loads `builtin:NAME`, or a scene file with its images, whose relative names start at the scene's folder.
///
/// # Errors
/// [`SceneFileError`]: no such scene or file, not a scene, an image that cannot be read, is not in metres or says nothing.
pub fn load(path_or_builtin: &str) -> Result<Scene, SceneFileError> {
    if let Some(name) = path_or_builtin.strip_prefix(BUILTIN) {
        return builtin(name);
    }
    let path = Path::new(path_or_builtin);
    let text = std::fs::read_to_string(path).map_err(|source| SceneFileError::Io {
        file: path_or_builtin.to_owned(),
        source,
        known: known(),
    })?;
    let folder = path.parent().unwrap_or(Path::new("."));
    read(path_or_builtin, &text, &mut |file| {
        let image = folder.join(file);
        placed(&image.display().to_string(), io::read_grid(&image).map_err(|error| error.to_string())?)
    })
}

/// Loads the embedded scene of this name.
///
/// # Errors
/// [`SceneFileError::Builtin`] when there is none.
pub fn builtin(name: &str) -> Result<Scene, SceneFileError> {
    let Some((_, text)) = SCENES.iter().find(|(other, _)| *other == name) else {
        return Err(SceneFileError::Builtin { name: name.to_owned(), known: known() });
    };
    read(&format!("{BUILTIN}{name}"), text, &mut |file| {
        let Some((_, bytes)) = IMAGES.iter().find(|(other, _)| *other == file) else {
            return Err(format!("{file}: this image is not embedded"));
        };
        placed(file, io::geotiff::read_from(bytes, file).map_err(|error| error.to_string())?)
    })
}

/// Reads a scene without images from its text; `name` stands for the file in errors.
///
/// # Errors
/// [`SceneFileError`]: not a scene, or one with an image.
pub fn parse(name: &str, text: &str) -> Result<Scene, SceneFileError> {
    read(name, text, &mut |file| Err(format!("{file}: expected a scene without images")))
}

fn read(
    file: &str,
    text: &str,
    images: &mut dyn FnMut(&str) -> Result<PlacedImage, String>,
) -> Result<Scene, SceneFileError> {
    Scene::read(text, images).map_err(|error| located(file, text, error))
}

/// The error of a scene with the file it stands in.
pub fn located(file: &str, text: &str, error: SceneError) -> SceneFileError {
    let file = file.to_owned();
    match error {
        SceneError::Syntax { line, column, problem } => {
            let start = SourceOffset::from_location(text, line, column);
            let text = Arc::new(NamedSource::new(&file, text.to_owned()));
            SceneFileError::Syntax { file, line, column, problem, text, span: SourceSpan::new(start, 0) }
        }
        SceneError::Node { path, problem } => SceneFileError::Node { file, path, problem },
    }
}

/// A raster as an image of a scene: it must be in metres. Where it is unknown the image has no weight.
fn placed(name: &str, grid: Grid<f32>) -> Result<PlacedImage, String> {
    if grid.crs().is_some_and(terrain_model::grid::Crs::is_geographic) {
        return Err(format!(
            "{name}: coordinates in degrees; expected metres; run `terrain convert --local-metres {name} OUT` and use OUT"
        ));
    }
    if !grid.is_metric() {
        return Err(format!(
            "{name}: coordinates in another unit than metres; expected metres; reproject it with `gdalwarp -t_srs`"
        ));
    }
    let (origin, spacing, width, height) = (grid.origin(), grid.spacing(), grid.width(), grid.height());
    let holes: Vec<bool> = grid.values().iter().map(|value| grid.is_no_data(*value) || value.is_nan()).collect();
    let known = holes.iter().filter(|hole| !**hole).count();
    let image = Image::with_holes(width, height, grid.into_values(), holes).ok_or_else(|| {
        format!(
            "{name}: {width} × {height} samples, {known} known; expected at least 2 × 2 finite elevations, one known"
        )
    })?;
    Ok(PlacedImage { image: Arc::new(image), origin, spacing })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_scene_loads_and_every_layer_compiles() {
        for name in builtin_names() {
            let scene = load(&format!("{BUILTIN}{name}")).unwrap_or_else(|error| panic!("{error}"));
            for layer in scene.layers.keys() {
                scene.program(layer).unwrap_or_else(|error| panic!("{name}: {error}"));
            }
        }
    }

    #[test]
    fn an_embedded_scene_is_the_file_of_its_name() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        for name in builtin_names() {
            let file = load(&folder.join(name).with_extension("ron").to_string_lossy()).unwrap();
            let embedded = builtin(name).unwrap();
            let sample = |scene: &Scene| scene.program(scene.ground()).unwrap().height(glam::DVec2::splat(9e3));
            assert_eq!(sample(&file), sample(&embedded), "{name}");
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let line = load("builtin:none").unwrap_err().to_string();
        assert!(line.contains("builtin:demo") && !line.contains('\n'), "{line}");
    }
}
