//! The six landscapes of the paper's tables, and what is done with each.

use crate::experiment::ExperimentError;
use crate::landscapes;
use terrain_diffusion::detail::detail;
use terrain_diffusion::fields::{Fields, Settings, diffuse};
use terrain_diffusion::landscape::Landscape;
use terrain_diffusion::raster::Domain;

/// Name of the embedded landscape, and the paper's of the scene, in the paper's order.
pub const MODELS: [(&str, &str); 6] = [
    ("mountain", "Mountain"),
    ("lake", "Lake"),
    ("canyon", "Canyon"),
    ("hills", "Hills"),
    ("island", "Volcanic"),
    ("desert", "Desert"),
];

/// An embedded landscape.
pub fn load(name: &str) -> Result<Landscape, ExperimentError> {
    landscapes::builtin(name).map_err(ExperimentError::failed)
}

/// The diffused fields of a landscape, and the detail on them.
pub fn terrain(
    landscape: &Landscape,
    domain: Domain,
    settings: &Settings,
) -> Result<(Fields, Vec<f64>), ExperimentError> {
    let fields = diffuse(landscape.curves(), domain, settings).map_err(ExperimentError::failed)?;
    let noise = landscape.frame().detail;
    let detail = detail(&domain, &fields.amplitude, &fields.roughness, |p, a, r| noise.at(p, a, r));
    Ok((fields, detail))
}
