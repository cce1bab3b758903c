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
/// A slope above which a block is asked in parts.
const STEEP: f64 = 1.0;

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
    let prover = Prover { cells: &cells, low, spacing, last: [width - 1, height - 1] };
    let bounds_of_row = |b: usize| {
        let mut evaluator = BoundsEvaluator::new(program);
        (0..blocks[0])
            .fold((0.0f64, 0), |so_far, a| prover.prove(&mut evaluator, [a * BLOCK, b * BLOCK], BLOCK, so_far))
    };
    let rows: Vec<(f64, usize)> = (0..blocks[1]).into_par_iter().map(bounds_of_row).collect();
    let (bound, open) = rows.into_iter().fold((0.0f64, 0), |(a, m), (b, n)| (a.max(b), m + n));
    let values = samples.into_iter().map(|z| z.unwrap_or(lowest)).collect();
    // A micrometre is for rounding of elevations and of the products above.
    Some(Sampled { grid: Grid::new(low, spacing, width, height, values).ok()?, off, bound: bound + 1e-6, open })
}

/// What bounds of slopes are asked of.
struct Prover<'a> {
    cells: &'a Cells,
    low: DVec2,
    spacing: DVec2,
    /// The last sample of both sides.
    last: [usize; 2],
}

impl Prover<'_> {
    /// The largest bound and the cells without one, with those of a block; one that is steep or open is asked in quarters.
    fn prove(
        &self,
        evaluator: &mut BoundsEvaluator<'_>,
        first: [usize; 2],
        side: usize,
        (bound, open): (f64, usize),
    ) -> (f64, usize) {
        let end = [0, 1].map(|k| (first[k] + side).min(self.last[k]));
        if (0..2).any(|k| first[k] >= end[k]) {
            return (bound, open);
        }
        let at = |place: [usize; 2]| self.low + self.spacing * DVec2::new(place[0] as f64, place[1] as f64);
        let (from, to) = (at(first), at(end));
        let found = evaluator.bounds_of(self.cells.over(from, to), Region::rectangle(from, to));
        let reach = found.slope * self.spacing.length() / 2.0;
        let proved = found.weight.lo() >= THRESHOLD && reach.is_finite();
        if side > 1 && !(proved && found.slope <= STEEP) {
            let half = side / 2;
            let quarters = [[0, 0], [half, 0], [0, half], [half, half]];
            return quarters.into_iter().fold((bound, open), |so_far, [i, j]| {
                self.prove(evaluator, [first[0] + i, first[1] + j], half, so_far)
            });
        }
        if proved { (bound.max(reach), open) } else { (bound, open + (end[0] - first[0]) * (end[1] - first[1])) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn the_raster_keeps_within_its_bound_of_the_tree_and_one_half_as_high_again_does_not() {
        let scene = scenes::load("builtin:demo").unwrap();
        let program = scene.program(scene.ground()).unwrap();
        let (low, high) = program.support().unwrap();
        let (middle, half) = ((low + high) / 2.0, (high - low) / 64.0);
        let made = sample(&program, middle - half, middle + half, [17, 17]).unwrap();
        assert!(made.open == 0 && made.off == 0, "{} {}", made.open, made.off);
        let mut beyond = 0;
        for k in 0..2000u32 {
            let random = |axis| f64::from(terrain_model::noise::mix(k, axis)) / 4_294_967_296.0;
            let p = middle - half + 2.0 * half * DVec2::new(random(0), random(1));
            let place = (p - made.grid.origin()) / made.grid.spacing();
            let [i, j] = [place.x, place.y].map(|x| (x as usize).min(15));
            let (u, v) = (place.x - i as f64, place.y - j as f64);
            let z = |i: usize, j: usize| made.grid.values()[j * 17 + i];
            let south = z(i, j) * (1.0 - u) + z(i + 1, j) * u;
            let north = z(i, j + 1) * (1.0 - u) + z(i + 1, j + 1) * u;
            let (raster, tree) = (south * (1.0 - v) + north * v, program.height(p).0);
            assert!((raster - tree).abs() <= made.bound, "{p}: {raster} {tree} {}", made.bound);
            beyond += usize::from((1.5 * raster - tree).abs() > made.bound);
        }
        assert!(beyond > 1000, "{beyond} {}", made.bound);
    }
}
