//! Poisson spheres on a heightfield: points by chance, as many to a square metre on a cliff as on the flat, of which those
//! that are too near to an earlier one go.

use super::random::Random;
use crate::field::Box3;
use crate::implicit::surface::Surface;
use crate::sampling::thin::thin;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use terrain_model::noise::hash::mix;

/// Candidates for each square of the spacing's side: with 6 a set is four fifths as dense as a maximal one.
const CANDIDATES: f64 = 6.0;
/// Cells of the heightfield that are looked at together.
const STRETCH: u32 = 32;

/// Candidates on `surface` within `region`, in each cell of the raster as many as its area and a `spacing` in metres ask for, where
/// `wanted` holds of the cell's corners. The same on any number of threads.
pub fn sprinkle(
    surface: &Surface,
    region: &Box3,
    spacing: f64,
    wanted: impl Fn(DVec2, DVec2) -> bool + Sync,
    seed: u32,
) -> Vec<DVec3> {
    let (size, [low, high]) = (surface.spacing(), surface.ground());
    let [from, to] = [region.low.truncate().max(low), region.high.truncate().min(high)];
    if !from.cmple(to).all() {
        return Vec::new();
    }
    let cells = ((high - low) / size).round() - 1.0;
    let [first, end] = [from, to].map(|p| ((p - low) / size).floor().clamp(DVec2::ZERO, cells));
    let (rows, columns) = (first.y as u32..=end.y as u32, first.x as u32..=end.x as u32);
    let wanted = &wanted;
    let corner = |i: u32, j: u32| low + size * DVec2::new(i.into(), j.into());
    let last = *columns.end();
    rows.into_par_iter()
        .flat_map_iter(|j| {
            // Stretches without any elevation of the region are left out together.
            let stretches = columns.clone().step_by(STRETCH as usize).filter(move |&i| {
                let from = corner(i, j);
                reaches(surface, region, from, from + DVec2::new(size.x * f64::from(STRETCH), size.y))
            });
            stretches
                .flat_map(move |i| i..=last.min(i + STRETCH - 1))
                .map(move |i| corner(i, j))
                .filter(move |&corner| wanted(corner, corner + size))
                .flat_map(move |corner| in_cell(surface, region, corner, spacing, seed))
        })
        .filter(|p| region.contains(*p))
        .collect()
}

/// Points over one cell.
fn in_cell(surface: &Surface, region: &Box3, corner: DVec2, spacing: f64, seed: u32) -> Vec<DVec3> {
    let size = surface.spacing();
    // The elevations of a bilinear cell lie between those of its corners.
    let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
    for at in [corner, corner + size.with_y(0.0), corner + size.with_x(0.0), corner + size] {
        let [height, _] = surface.column::<f64>(at.to_array());
        (low, high) = (low.min(height), high.max(height));
    }
    if high < region.low.z || low > region.high.z {
        return Vec::new();
    }
    // On a cliff the points of the plane must be so many that those of the wall are no rarer.
    let steep = (high - low) / size.min_element();
    let area = size.x * size.y * (1.0 + steep * steep).sqrt();
    let random = Random::at(seed, corner.extend(0.0));
    // The share of a point that is left over is one by chance.
    let count = (CANDIDATES * area / (spacing * spacing) + random.unit(0)).min(1e6) as u32;
    (1..=count)
        .map(|k| {
            let at = corner + size * DVec2::new(random.unit(2 * k), random.unit(2 * k + 1));
            let [height, _] = surface.column::<f64>(at.to_array());
            at.extend(height)
        })
        .collect()
}

/// May some of the ground over a rectangle be in the region?
fn reaches(surface: &Surface, region: &Box3, low: DVec2, high: DVec2) -> bool {
    let heights = surface.elevations_over(&Box3 { low: low.extend(0.0), high: high.extend(0.0) });
    heights.hi() >= region.low.z && heights.lo() <= region.high.z
}

/// Poisson spheres on `surface` within `region`, no two nearer than `spacing` metres, the candidates at `p` kept with
/// probability `chance(p)`. Cells of the raster of which `wanted` does not hold are passed over.
pub fn scatter(
    surface: &Surface,
    region: &Box3,
    spacing: f64,
    wanted: impl Fn(DVec2, DVec2) -> bool + Sync,
    chance: impl Fn(DVec3) -> f64 + Sync,
    seed: u32,
) -> Vec<DVec3> {
    let lucky = |p: &DVec3| Random::at(mix(seed, 1), *p).unit(0) < chance(*p);
    let all = sprinkle(surface, region, spacing, wanted, seed).into_par_iter().filter(lucky).map(|p| (p, ()));
    thin(&all.collect::<Vec<_>>(), spacing, mix(seed, 2)).into_iter().map(|(p, ())| p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::implicit::heightfield::Implicitisation;
    use crate::implicit::volume::Volume;
    use std::sync::Arc;
    use terrain_model::grid::Grid;

    /// A plain beside a plane that rises two metres a metre.
    fn ramp() -> Arc<Surface> {
        let height = |k: usize| 2.0 * ((k % 81) as f32 - 40.0).max(0.0);
        let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 81, 81, (0..81 * 81).map(height).collect()).unwrap();
        match Implicitisation::of(&grid, 3.0).volume(&grid).unwrap() {
            Volume::Ground(surface, _) => surface,
            _ => unreachable!(),
        }
    }
    const ALL: Box3 = Box3 { low: DVec3::splat(-1e3), high: DVec3::splat(1e3) };

    #[test]
    fn as_many_points_lie_on_a_square_metre_of_slope_as_of_plain() {
        let surface = ramp();
        let all = scatter(&surface, &ALL, 2.0, |_, _| true, |_| 1.0, 5);
        let count = |on: &dyn Fn(&DVec3) -> bool| all.iter().filter(|p| on(p)).count() as f64;
        let (flat, steep) =
            (count(&|p| p.x < 39.0) / (39.0 * 80.0), count(&|p| p.x > 41.0) / (39.0 * 80.0 * 5f64.sqrt()));
        assert!((flat / steep - 1.0).abs() < 0.1, "{flat} {steep}");
        // Disks placed at random cover 0.547 of the plane when no other fits.
        let covered = flat * std::f64::consts::PI;
        assert!((0.79 * 0.547..0.547).contains(&covered), "{covered}");
        let nearest = all.iter().enumerate().flat_map(|(k, p)| all[..k].iter().map(|q| p.distance(*q)));
        assert!(nearest.fold(f64::INFINITY, f64::min) >= 2.0);
        assert!(all.iter().all(|p| p.z == 2.0 * (p.x - 40.0).max(0.0)));
    }

    #[test]
    fn chance_thins_and_regions_bound() {
        let surface = ramp();
        let count = |chance: f64| scatter(&surface, &ALL, 2.0, |_, _| true, |_| chance, 5).len();
        assert_eq!(count(0.0), 0);
        assert!(count(0.02) * 3 < count(1.0));
        let band = Box3 { low: DVec3::new(-5.0, 10.0, 20.0), high: DVec3::new(99.0, 30.0, 40.0) };
        let some = scatter(&surface, &band, 2.0, |_, _| true, |_| 1.0, 5);
        assert!(some.len() > 50 && some.iter().all(|p| band.contains(*p)));
        assert!(scatter(&surface, &Box3::EMPTY, 2.0, |_, _| true, |_| 1.0, 5).is_empty());
    }
}
