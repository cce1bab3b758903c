//! Scenes by name.

use terrain_model::scene::Scene;

/// Loads a built-in scene.
pub fn load(name: &str) -> Result<Scene, String> {
    let text = match name {
        "builtin:fig3" => include_str!("../scenes/fig3.ron"),
        "builtin:fig19" => include_str!("../scenes/fig19.ron"),
        _ => return Err(format!("no scene {name}")),
    };
    Scene::read(text, &mut |_file| {
        let grid =
            terrain_model::io::geotiff::read_from(include_bytes!("../data/jacksboro/jacksboro.tif"), "jacksboro.tif")
                .map_err(|error| error.to_string())?;
        let image = terrain_model::primitive::image::Image::new(grid.width(), grid.height(), grid.values().to_vec())
            .ok_or("not an image")?;
        Ok(terrain_model::scene::PlacedImage {
            image: std::sync::Arc::new(image),
            origin: grid.origin(),
            spacing: grid.spacing(),
        })
    })
    .map_err(|error| error.to_string())
}
