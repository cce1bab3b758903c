//! A diffused raster as an image primitive of a scene, drawn as other scenes are: a block of ground with the water on it.

use super::canvas::Canvas;
use crate::experiment::ExperimentError;
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_diffusion::raster::Domain;
use terrain_model::primitive::image::{Image, ImagePatch};
use terrain_model::program::Program;
use terrain_model::scene::CameraPlacement;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::shade::{Landscape, Look, View, render, to_srgb8};
use terrain_model::trace::{Settings, Surface, Tracer};
use terrain_model::tree::Tree;

/// How a raster is looked at; lengths in sides of the raster, from its middle, elevations from the lowest ground.
#[derive(Clone, Copy)]
pub struct Eye {
    pub from: DVec3,
    pub to: DVec3,
    /// Vertical field of view, degrees.
    pub view: f64,
}

/// From the south-west, the whole block.
pub const BLOCK: Eye = Eye { from: DVec3::new(-0.62, -1.25, 0.80), to: DVec3::new(0.0, -0.03, 0.0), view: 37.0 };

/// How it looks.
#[derive(Clone, Copy)]
pub struct Style {
    pub arid: bool,
    /// Elevation from which snow lies; infinite for none.
    pub snow: f64,
    pub water: Option<f64>,
}

fn patch(image: Image, domain: &Domain, spacing: DVec2) -> Result<Program, ExperimentError> {
    let patch = ImagePatch {
        image: Arc::new(image),
        origin: domain.origin,
        spacing,
        margin: 2.0 * domain.spacing,
        weight: 1.0,
        weights: None,
        elevation_scale: 1.0,
        elevation_offset: 0.0,
    };
    let mut tree = Tree::new();
    let root = tree.push(patch);
    Program::compile(&tree, root).map_err(ExperimentError::failed)
}

/// Draws `height` over its domain.
pub fn view(
    height: &[f64],
    domain: &Domain,
    eye: Eye,
    style: Style,
    (width, rows): (usize, usize),
) -> Result<Canvas, ExperimentError> {
    let no_image = || ExperimentError::failed("the terrain is no image");
    let samples = |values: &[f64]| values.iter().map(|z| *z as f32).collect::<Vec<f32>>();
    let image = Image::new(domain.width, domain.height, samples(height)).ok_or_else(no_image)?;
    let ground = patch(image, domain, DVec2::splat(domain.spacing))?;
    let metres = domain.spacing * DVec2::new((domain.width - 1) as f64, (domain.height - 1) as f64);
    let water = style.water.map(|level| {
        let level = Image::new(2, 2, samples(&[level; 4])).ok_or_else(no_image)?;
        patch(level, domain, metres)
    });
    let water = water.transpose()?;
    let [low, high] = crate::hnaidi2010::rasters::range(height);
    let side = metres.max_element();
    let place = |p: DVec3| (domain.origin + 0.5 * metres + side * p.truncate()).extend(low + side * p.z);
    let placement =
        CameraPlacement { eye: place(eye.from), target: place(eye.to), field_of_view: eye.view.to_radians() };
    let camera = Camera::new(&placement, width, rows);
    let landscape = Landscape { water: water.as_ref().map(Surface::new), ..Landscape::from(Surface::new(&ground)) };
    let look = Look {
        snow: style.snow,
        arid: style.arid,
        floor: low - 0.03 * side,
        ..Look::over(domain.origin, domain.origin + metres, [style.water.unwrap_or(low).max(low), high])
    };
    let epsilon = 5e-5 * side;
    let settings = Settings { epsilon, bracket: 10.0 * epsilon, edge: epsilon, ..Settings::default() };
    let view = View {
        landscape: &landscape,
        pixel: camera.pixel(),
        tracer: Tracer::Segment,
        settings: &settings,
        look: &look,
    };
    let pixels = render(&view, &camera);
    Ok(Canvas { width, height: rows, rgb: pixels.iter().flat_map(|pixel| to_srgb8(pixel.colour)).collect() })
}
