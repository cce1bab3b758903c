//! Pits: local minima of a heightfield before it is filled, with the pools that would stand over them. Sinkholes that a karst
//! begins at (Paris 2019 §6.2) are found here.

use super::HydrologyError;
use super::fill::fill;
use super::padded::{Elevation, Padded, go, steps};
use glam::DVec2;
use terrain_model::grid::Grid;

/// A local minimum that is no edge: a sample, or a flat of several, all of whose neighbours are higher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pit {
    /// Column from the west of its first sample, from the south-west by rows.
    pub column: usize,
    /// Row from the south of that sample.
    pub row: usize,
    /// Where that sample is, metres.
    pub position: DVec2,
    /// Its elevation, metres.
    pub elevation: f64,
    /// How much higher its pool spills, metres.
    pub depth: f64,
    /// The pool's area, dx·dy for each 8-connected sample that filling raises, m². Pits of one pool share it.
    pub pool_area: f64,
}

/// All pits of `surface`, from the south-west by rows.
///
/// # Errors
/// As [`fill`].
pub fn pits<T: Elevation>(surface: &Grid<T>) -> Result<Vec<Pit>, HydrologyError> {
    let filled = Padded::new(&fill(surface)?, f64::NAN, T::to_f64)?;
    let raster = Padded::new(surface, f64::NAN, T::to_f64)?;
    let steps = steps(raster.stride);
    let cell_area = surface.spacing().x * surface.spacing().y;
    let mut seen = vec![false; raster.values.len()];
    let mut in_pool = vec![false; raster.values.len()];
    let wet = |cell: usize| filled.values[cell] > raster.values[cell];
    let mut pits = Vec::new();
    let (mut stack, mut pool) = (Vec::new(), Vec::new());
    for start in raster.row_starts().flat_map(|start| start..start + raster.width()) {
        if in_pool[start] || !wet(start) {
            continue;
        }
        // The pool, then the minima in it: a pit is always under water.
        pool.clear();
        in_pool[start] = true;
        stack.push(start);
        while let Some(cell) = stack.pop() {
            pool.push(cell);
            for next in steps.map(|step| go(cell, step)) {
                if !in_pool[next] && wet(next) {
                    in_pool[next] = true;
                    stack.push(next);
                }
            }
        }
        pool.sort_unstable();
        let pool_area = pool.len() as f64 * cell_area;
        for &first in &pool {
            if seen[first] {
                continue;
            }
            let elevation = raster.values[first];
            let mut lowest = true;
            seen[first] = true;
            stack.push(first);
            while let Some(cell) = stack.pop() {
                for next in steps.map(|step| go(cell, step)) {
                    lowest &= raster.values[next] >= elevation;
                    if raster.values[next] == elevation && !seen[next] {
                        seen[next] = true;
                        stack.push(next);
                    }
                }
            }
            if lowest {
                let (column, row) = (first % raster.stride - 1, first / raster.stride - 1);
                let position = surface.position(column, row);
                pits.push(Pit { column, row, position, elevation, depth: filled.values[first] - elevation, pool_area });
            }
        }
    }
    pits.sort_unstable_by_key(|pit| (pit.row, pit.column));
    Ok(pits)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{grid, neighbours, rasters};
    use super::*;

    #[test]
    fn a_pool_with_two_pits_is_described_by_hand() {
        // A rim of 9 with a gap of 5, a floor of 3 with pits of 1 and of 2, the latter two samples wide.
        let text = ["9999999", "9333339", "9313225", "9333339", "9999999"];
        let surface = grid(7, 5, DVec2::new(2.0, 3.0), |i, j| f64::from(text[j].as_bytes()[i] - b'0'));
        let found = pits(&surface).unwrap();
        let brief: Vec<_> = found.iter().map(|p| (p.column, p.row, p.elevation, p.depth, p.pool_area)).collect();
        assert_eq!(brief, [(2, 2, 1.0, 4.0, 90.0), (4, 2, 2.0, 3.0, 90.0)]);
        assert_eq!(found[0].position, DVec2::new(4.0, 6.0));
        // Control: where the rim is cut down to the floor of the second, only the first is left.
        let cut =
            grid(7, 5, DVec2::new(2.0, 3.0), |i, j| surface.get(i, j).unwrap().min(if i == 6 { 2.0 } else { 9.0 }));
        assert_eq!(pits(&cut).unwrap().len(), 1);
    }

    #[test]
    fn single_samples_below_all_neighbours_are_pits_and_nothing_else_is_among_them() {
        for surface in rasters(8) {
            let found = pits(&surface).unwrap();
            let strict = surface.positions().filter(|&(i, j, _, z)| {
                let (near, edge) = neighbours(&surface, i, j);
                !z.is_nan() && !edge && near.iter().all(|&(a, b)| surface.known(a, b).is_some_and(|n| n > z))
            });
            let strict: Vec<_> = strict.map(|(i, j, _, _)| (i, j)).collect();
            let at = |i: usize, j: usize| found.iter().any(|pit| (pit.column, pit.row) == (i, j));
            assert!(strict.iter().all(|&(i, j)| at(i, j)));
            for pit in &found {
                let (near, edge) = neighbours(&surface, pit.column, pit.row);
                let lower = near.iter().any(|&(a, b)| surface.known(a, b).is_some_and(|n| n < pit.elevation));
                assert!(!edge && !lower && pit.depth > 0.0 && pit.pool_area >= 1.0);
            }
            // On a filled surface there is none.
            assert!(pits(&fill(&surface).unwrap()).unwrap().is_empty());
        }
    }
}
