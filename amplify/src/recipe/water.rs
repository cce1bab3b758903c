//! The maps of water that landforms read, from the room of hydrology.

use super::Pits;
use crate::hydrology::HydrologyError;
use crate::hydrology::accessibility::accessibility_where;
use crate::hydrology::banks::convolve;
use crate::hydrology::fill::epsilon_fill;
use crate::hydrology::flow::{Routing, drainage_area};
use crate::hydrology::pits::pits;
use crate::hydrology::slope::{Gradient, gradient_magnitude};
use crate::hydrology::stream::stream_power;
use crate::landform::raster::shaped;
use crate::landform::sea::Sea;
use glam::DVec3;
use terrain_model::grid::Grid;

fn narrow(grid: &Grid<f64>) -> Grid<f32> {
    shaped(grid, grid.values().iter().map(|&value| value as f32).collect())
}

/// A, m², of the ground filled so that it drains.
pub(super) fn area(grid: &Grid<f32>) -> Result<Grid<f32>, HydrologyError> {
    Ok(narrow(&drainage_area(&epsilon_fill(grid)?, Routing::FREEMAN)?.area))
}

/// ‖∇h‖, metres a metre.
pub(super) fn gradient(grid: &Grid<f32>) -> Result<Grid<f32>, HydrologyError> {
    Ok(narrow(&gradient_magnitude(grid, Gradient::Horn)?))
}

/// √A·s, metres, with s the sine of the slope of the ground as it is. As a tangent, which is 10 on a cliff, it would make
/// walls that drain little as powerful as rivers.
pub(super) fn power(grid: &Grid<f32>) -> Result<Grid<f32>, HydrologyError> {
    let area = drainage_area(&epsilon_fill(grid)?, Routing::FREEMAN)?.area;
    let slope = gradient_magnitude(grid, Gradient::Horn)?;
    let sine = slope.values().iter().map(|&s| s / (1.0 + s * s).sqrt()).collect();
    Ok(narrow(&stream_power(&area, &shaped(&slope, sine))?))
}

/// The stress of a bed with that of its banks: a convolution over `radius` metres, scaled so that a straight bed one sample
/// wide keeps its stress, where that is more than the bed's own, at most 1.
pub(super) fn spread(bed: &Grid<f32>, radius: f64) -> Result<Grid<f32>, HydrologyError> {
    if radius == 0.0 {
        return Ok(bed.clone());
    }
    let spacing = bed.spacing().max_element();
    let bump = |k: f64| {
        let inside = (1.0 - (k * spacing / radius) * (k * spacing / radius)).max(0.0);
        inside * inside
    };
    let scale: f64 = 1.0 + 2.0 * (1..=(radius / spacing) as u32).map(|k| bump(k.into())).sum::<f64>();
    let wide = convolve(bed, radius)?;
    let both = |(own, wide): (&f32, &f64)| own.max((wide * scale).min(1.0) as f32);
    Ok(shaped(bed, bed.values().iter().zip(wide.values()).map(both).collect()))
}

/// α, without unit, in [0, 1], where the waves of `sea` reach, 0 elsewhere (Paris 2019 §6.1; Miller 1994).
///
/// # Errors
/// [`HydrologyError`]: what of the raster is no ground.
pub fn accessible(grid: &Grid<f32>, sea: &Sea) -> Result<Grid<f32>, HydrologyError> {
    let (width, height) = (grid.width(), grid.height());
    let reached = |k: usize| {
        // A cell is read at its four corners, of which any can be in reach of the waves.
        let (i, j) = (k % width, k / width);
        let around = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let mut heights = around(j, height).flat_map(|j| around(i, width).map(move |i| grid.values()[j * width + i]));
        let first = f64::from(heights.next().unwrap_or(f32::NAN));
        let (low, high) = heights.fold((first, first), |(a, b), h| (a.min(h.into()), b.max(h.into())));
        low < sea.level + sea.reach && high > sea.level - sea.reach
    };
    let open = accessibility_where(grid, sea.openness, reached)?;
    Ok(shaped(grid, open.values().iter().map(|&a| if a.is_nan() { 0.0 } else { a as f32 }).collect()))
}

/// The deepest pits, deepest first.
pub(super) fn deepest(grid: &Grid<f32>, Pits { depth, most }: Pits) -> Result<Vec<DVec3>, HydrologyError> {
    let mut all: Vec<_> = pits(grid)?.into_iter().filter(|pit| pit.depth >= depth).collect();
    // The sort is stable: pits as deep as each other stay in the order of the raster.
    all.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    all.truncate(most as usize);
    Ok(all.into_iter().map(|pit| pit.position.extend(pit.elevation)).collect())
}
