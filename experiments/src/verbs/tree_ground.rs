//! A feature tree as ground for tessellation: sampled to a raster, with a proved bound of how far that is from the tree.

use glam::DVec2;
use rayon::prelude::*;
use terrain_model::bounds::{Region, THRESHOLD};
use terrain_model::grid::Grid;
use terrain_model::program::{BoundsEvaluator, Cells, Evaluator, Evidence, Program};

/// A sampled tree.
pub struct Sampled {
    /// Elevations. Samples off the terrain have its lowest.
    pub grid: Grid<f64>,
    /// Samples off the terrain.
    pub off: usize,
    /// Metres between the raster, bilinear, and the tree at most, wherever it is proved.
    pub bound: f64,
    /// Cells where it is not: those that may be off the terrain, or whose slope has no bound.
    pub open: usize,
}

/// Cells along the side of a block whose slope is bounded at once.
const BLOCK: usize = 8;

/// Samples `program` on `size` samples of a box. `None` where none lies on the terrain.
///
/// Of a cell with corners pᵢ, bilinear weights wᵢ and diagonal d, |f(p) − Σ wᵢ f(pᵢ)| ≤ λ Σ wᵢ|p − pᵢ| ≤ λ √(Σ wᵢ|p − pᵢ|²) =
/// λ √(u(1 − u)·sx² + v(1 − v)·sy²) ≤ λ·d/2, with λ the certified slope on the terrain around it.
pub fn sample(program: &Program, low: DVec2, high: DVec2, [width, height]: [usize; 2]) -> Option<Sampled> {
    let spacing = (high - low) / DVec2::new((width - 1) as f64, (height - 1) as f64);
    let at = |i: usize, j: usize| low + spacing * DVec2::new(i as f64, j as f64);
    let cells = Cells::new(program, Evidence::Ranges);
    let row = |j: usize| -> Vec<Option<f64>> {
        let mut evaluator = Evaluator::new(program);
        let sample = |i: usize| {
            let p = at(i, j);
            let (z, weight) = evaluator.height(cells.at(p), p);
            (weight >= THRESHOLD).then_some(z)
        };
        (0..width).map(sample).collect()
    };
    let samples: Vec<Option<f64>> = (0..height).into_par_iter().flat_map_iter(row).collect();
    let lowest = samples.iter().flatten().copied().reduce(f64::min)?;
    let off = samples.iter().filter(|z| z.is_none()).count();
    let blocks = [width - 1, height - 1].map(|cells| cells.div_ceil(BLOCK));
    let bounds_of_row = |b: usize| {
        let mut evaluator = BoundsEvaluator::new(program);
        (0..blocks[0]).fold((0.0f64, 0usize), |(bound, open), a| {
            let (i, j) = (a * BLOCK, b * BLOCK);
            let end = [(i + BLOCK).min(width - 1), (j + BLOCK).min(height - 1)];
            let (from, to) = (at(i, j), at(end[0], end[1]));
            let found = evaluator.bounds_of(cells.over(from, to), Region::rectangle(from, to));
            let reach = found.slope * spacing.length() / 2.0;
            if found.weight.lo() >= THRESHOLD && reach.is_finite() {
                (bound.max(reach), open)
            } else {
                (bound, open + (end[0] - i) * (end[1] - j))
            }
        })
    };
    let rows: Vec<(f64, usize)> = (0..blocks[1]).into_par_iter().map(bounds_of_row).collect();
    let (bound, open) = rows.into_iter().fold((0.0f64, 0), |(a, m), (b, n)| (a.max(b), m + n));
    let values = samples.into_iter().map(|z| z.unwrap_or(lowest)).collect();
    // A micrometre is for rounding of elevations and of the products above.
    Some(Sampled { grid: Grid::new(low, spacing, width, height, values).ok()?, off, bound: bound + 1e-6, open })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn the_raster_keeps_within_its_bound_of_the_tree_and_not_within_that_of_a_finer_one() {
        let program = scenes::load("builtin:demo").unwrap();
        let program = program.program(program.ground()).unwrap();
        let (low, high) = program.support().unwrap();
        let (middle, half) = ((low + high) / 2.0, (high - low) / 8.0);
        let [coarse, fine] = [33, 1025].map(|n| sample(&program, middle - half, middle + half, [n, n]).unwrap());
        assert!(coarse.open == 0 && coarse.off == 0, "{} {}", coarse.open, coarse.off);
        let (mut beyond, mut most) = (0, 0.0f64);
        for k in 0..4000u32 {
            let random = |axis| f64::from(terrain_model::noise::mix(k, axis)) / 4_294_967_296.0;
            let p = middle - half + 2.0 * half * DVec2::new(random(0), random(1));
            let place = (p - coarse.grid.origin()) / coarse.grid.spacing();
            let [i, j] = [place.x, place.y].map(|x| (x as usize).min(31));
            let (u, v) = (place.x - i as f64, place.y - j as f64);
            let z = |i: usize, j: usize| coarse.grid.values()[j * 33 + i];
            let south = z(i, j) * (1.0 - u) + z(i + 1, j) * u;
            let north = z(i, j + 1) * (1.0 - u) + z(i + 1, j + 1) * u;
            let off = (south * (1.0 - v) + north * v - program.height(p).0).abs();
            assert!(off <= coarse.bound, "{p}: {off} of {}", coarse.bound);
            beyond += usize::from(off > fine.bound);
            most = most.max(off);
        }
        assert!(beyond > 0 && fine.bound < coarse.bound / 8.0, "{beyond} {most} {} {}", fine.bound, coarse.bound);
    }
}
