//! Depressions filled by priority flood (Barnes, Lehman and Mulla 2014): flat up to the spill, or with the least rise that
//! lets every cell drain.
//!
//! Both floods rest on one observation (that of Zhou, Sun and Fu 2016): a cell that is not below a settled neighbour settles at
//! once, whatever the order. Such cells are climbed with a plain stack, and only what still has an unvisited, lower neighbour
//! when the climb has ended waits in the priority queue.

use super::HydrologyError;
use super::padded::{Elevation, Padded, go, steps};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use terrain_model::grid::Grid;

/// The lowest surface without depressions at or above `surface`: at each cell the minimum, over all 8-connected paths to an
/// edge, of the largest elevation on the path, the cell's own included. An edge is a known cell at the border of the grid or
/// beside no-data; no-data stays. Cells that are not raised keep their bits.
///
/// # Errors
/// [`HydrologyError`] for a geographic grid, a value that is not finite, or too many samples.
pub fn fill<T: Elevation>(surface: &Grid<T>) -> Result<Grid<T>, HydrologyError> {
    let mut flood = Flood::new(surface)?;
    flood.climb(|own, there| (there >= own).then_some(there));
    while let Some(Reverse((level, cell))) = flood.waiting.pop() {
        // Nothing that waits is lower, so whatever is below this level and open fills up to it.
        flood.stack.push(cell);
        flood.climb(|own, there| (there >= own || own == level).then_some(there.max(own)));
    }
    Ok(flood.finish(surface))
}

/// The lowest surface at or above `surface` on which every cell that is no edge has a neighbour strictly below it, so that a
/// strictly descending path leads from it to an edge: at each cell the minimum, over all 8-connected paths p₀ … pₖ from it to
/// an edge, of the largest of z(pᵢ) raised by i numbers of the type `T` (`next_up` i times). It is therefore at or above
/// [`fill`], and above it by at most as many numbers as the shortest of the paths that [`fill`] is attained on has steps.
/// Flats that hold no edge are raised too. No-data stays; cells that are not raised keep their bits.
///
/// # Errors
/// As [`fill`], and [`HydrologyError::High`] where raising could overflow.
pub fn epsilon_fill<T: Elevation>(surface: &Grid<T>) -> Result<Grid<T>, HydrologyError> {
    let mut flood = Flood::new(surface)?;
    if let Some((_, high)) = surface.min_max()
        && !T::can_rise(high.key(), flood.open.len() as u64)
    {
        return Err(HydrologyError::High { value: high.to_f64() });
    }
    let above = |own, there| (there > own).then_some(there);
    flood.climb(above);
    // Raised cells, each one number above the cell it drains to. Cells leave by increasing level, so they enter by it too.
    let mut raised: VecDeque<(T::Key, u32)> = VecDeque::new();
    loop {
        let heap = flood.waiting.peek().map(|Reverse(first)| first.0);
        let from_heap = match (heap, raised.front()) {
            (None, None) => break,
            (Some(a), Some(b)) => a <= b.0,
            (a, _) => a.is_some(),
        };
        let taken = if from_heap { flood.waiting.pop().map(|Reverse(first)| first) } else { raised.pop_front() };
        let (level, cell) = taken.expect("the queue that was chosen is not empty");
        let wet = T::up(level);
        for step in steps(flood.raster.stride) {
            let next = go(cell as usize, step);
            if flood.open[next] {
                flood.open[next] = false;
                let own = &mut flood.raster.values[next];
                if *own > wet {
                    flood.stack.push(next as u32);
                } else {
                    *own = wet;
                    raised.push_back((wet, next as u32));
                }
            }
        }
        if !flood.stack.is_empty() {
            flood.climb(above);
        }
    }
    Ok(flood.finish(surface))
}

/// A flood under way.
struct Flood<T: Elevation> {
    /// Levels: final where not open.
    raster: Padded<T::Key>,
    /// Known and not yet reached.
    open: Vec<bool>,
    /// Reached, with final level; what lies above them is to be climbed.
    stack: Vec<u32>,
    /// Climbed, with neighbours that were below when they were.
    doubtful: Vec<u32>,
    /// Reached cells with open neighbours below them.
    waiting: BinaryHeap<Reverse<(T::Key, u32)>>,
}

impl<T: Elevation> Flood<T> {
    /// All edges reached, nothing climbed.
    fn new(surface: &Grid<T>) -> Result<Flood<T>, HydrologyError> {
        let raster = Padded::new(surface, T::Key::default(), T::key)?;
        let stack: Vec<u32> = raster.edges().map(|cell| cell as u32).collect();
        let mut open = raster.known.clone();
        for &cell in &stack {
            open[cell as usize] = false;
        }
        Ok(Flood { raster, open, stack, doubtful: Vec::new(), waiting: BinaryHeap::new() })
    }

    /// Reaches all that can be reached from the stack, and queues what has other open neighbours left. `reach` gives the level
    /// at which a cell with its own level, the first argument, settles a neighbour of some elevation, the second.
    fn climb(&mut self, reach: impl Fn(T::Key, T::Key) -> Option<T::Key>) {
        let steps = steps(self.raster.stride);
        while let Some(cell) = self.stack.pop() {
            let own = self.raster.values[cell as usize];
            let mut below = false;
            for step in steps {
                let next = go(cell as usize, step);
                if self.open[next] {
                    if let Some(level) = reach(own, self.raster.values[next]) {
                        self.open[next] = false;
                        self.raster.values[next] = level;
                        self.stack.push(next as u32);
                    } else {
                        below = true;
                    }
                }
            }
            if below {
                self.doubtful.push(cell);
            }
        }
        for cell in self.doubtful.drain(..) {
            if steps.iter().any(|&step| self.open[go(cell as usize, step)]) {
                self.waiting.push(Reverse((self.raster.values[cell as usize], cell)));
            }
        }
    }

    /// The levels as a raster like `surface`.
    fn finish(self, surface: &Grid<T>) -> Grid<T> {
        let mut filled = surface.clone();
        let width = surface.width();
        for (start, row) in self.raster.row_starts().zip(filled.values_mut().chunks_exact_mut(width)) {
            for (k, value) in row.iter_mut().enumerate() {
                let level = self.raster.values[start + k];
                if self.raster.known[start + k] && level > value.key() {
                    *value = T::from_key(level);
                }
            }
        }
        filled
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{bits, grid, mismatches, narrow, neighbours, rasters, relaxed};
    use super::*;
    use glam::DVec2;

    #[test]
    fn fill_is_the_minimax_over_paths_to_an_edge_to_the_bit() {
        let mut raised = 0;
        for wide in (0..6).flat_map(rasters) {
            let filled = fill(&wide).unwrap();
            assert_eq!(mismatches(&filled, &relaxed(&wide, f64::INFINITY, |z| z)), 0);
            let narrow = narrow(&wide);
            assert_eq!(mismatches(&fill(&narrow).unwrap(), &relaxed(&narrow, f32::INFINITY, |z| z)), 0);
            raised += mismatches(&filled, &wide);
        }
        assert!(raised > 1000, "{raised}");
        // Control: one sample raised by one number is seen.
        let wide = &rasters(0)[0];
        let mut wrong = fill(wide).unwrap();
        let middle = wrong.values().len() / 2;
        wrong.values_mut()[middle] = wrong.values()[middle].next_up();
        assert_eq!(mismatches(&wrong, &relaxed(wide, f64::INFINITY, |z| z)), 1);
    }

    #[test]
    fn epsilon_fill_is_the_least_surface_that_drains_to_the_bit() {
        for wide in (0..6).flat_map(rasters) {
            let filled = epsilon_fill(&wide).unwrap();
            assert_eq!(mismatches(&filled, &relaxed(&wide, f64::INFINITY, f64::next_up)), 0);
            let narrow = narrow(&wide);
            let filled = epsilon_fill(&narrow).unwrap();
            assert_eq!(mismatches(&filled, &relaxed(&narrow, f32::INFINITY, f32::next_up)), 0);
        }
        // Control: the flat fill is another surface.
        let wide = &rasters(0)[2];
        assert!(mismatches(&fill(wide).unwrap(), &relaxed(wide, f64::INFINITY, f64::next_up)) > 10);
    }

    /// Known cells that are no edge and have no neighbour below them.
    fn stuck<T: Elevation>(grid: &Grid<T>) -> usize {
        let known = grid.positions().filter(|&(_, _, _, z)| !grid.is_no_data(z));
        known
            .filter(|&(i, j, _, z)| {
                let (near, edge) = neighbours(grid, i, j);
                !edge && !near.iter().any(|&(i, j)| grid.known(i, j).is_some_and(|w| w < z))
            })
            .count()
    }

    #[test]
    fn after_an_epsilon_fill_every_cell_descends_to_an_edge_at_any_magnitude() {
        for scale in [0.0f32, 1e-45, 1e-30, 1.0, 1e4, 1e30] {
            let rough = grid(20, 20, DVec2::ONE, |i, j| scale * ((bits(3, i, j) % 5) as f32 - 2.0));
            assert_eq!(stuck(&epsilon_fill(&rough).unwrap()), 0, "{scale}");
            // Control: the flat fill leaves cells that do not drain.
            assert!(stuck(&fill(&rough).unwrap()) > 50, "{scale}");
        }
    }

    #[test]
    fn epsilon_fill_exceeds_the_flat_one_by_at_most_one_number_a_step_of_the_way_out() {
        let mut met = 0;
        for wide in (0..4).flat_map(rasters) {
            let (flat, drained) = (fill(&wide).unwrap(), epsilon_fill(&wide).unwrap());
            // Steps of the shortest path out along which the largest elevation is that of the fill: relaxed by hand.
            let mut length = wide.map(None, |z| z.map_or(u64::MAX, |_| u64::MAX - 1));
            for _ in 0..wide.values().len() {
                let before = length.clone();
                for (i, j, _, level) in flat.positions().filter(|&(_, _, _, z)| !z.is_nan()) {
                    let (near, edge) = neighbours(&wide, i, j);
                    let fits = near.iter().filter(|&&(a, b)| flat.known(a, b).is_some_and(|z| z <= level));
                    let through = fits.filter_map(|&(a, b)| length.get(a, b)).min().unwrap_or(u64::MAX - 1);
                    let own = &mut length.values_mut()[j * wide.width() + i];
                    *own = if edge { 0 } else { through.saturating_add(1).min(*own) };
                }
                if before == length {
                    break;
                }
            }
            for ((&low, &high), &steps) in flat.values().iter().zip(drained.values()).zip(length.values()) {
                if !low.is_nan() {
                    let excess = high.key() - low.key();
                    assert!(excess >= 0 && excess <= steps as i64);
                    met = met.max(if excess == steps as i64 { excess } else { 0 });
                }
            }
        }
        // Control: the bound is met by cells some way from an edge, so one step less would fail.
        assert!(met > 3, "{met}");
    }

    #[test]
    fn cells_that_are_not_raised_keep_their_bits() {
        let zeros = grid(5, 5, DVec2::ONE, |i, j| if (i + j) % 2 == 0 { -0.0f64 } else { 0.0 });
        let filled = fill(&zeros).unwrap();
        assert!(filled.values().iter().zip(zeros.values()).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(epsilon_fill(&zeros).unwrap().values()[12].to_bits() == 2);
    }

    #[test]
    fn what_cannot_be_filled_is_named() {
        let mut bad = grid(4, 3, DVec2::ONE, |_, _| 1.0f32);
        bad.values_mut()[6] = f32::NAN;
        assert!(matches!(fill(&bad), Err(HydrologyError::NotFinite { i: 2, j: 1, .. })));
        let high = grid(4, 3, DVec2::ONE, |_, _| f32::MAX);
        assert!(matches!(epsilon_fill(&high), Err(HydrologyError::High { .. })));
        assert!(fill(&high).is_ok());
        let degrees = grid(4, 3, DVec2::ONE, |_, _| 0.0f32).with_crs(Some(terrain_model::grid::Crs::geographic(None)));
        assert_eq!(fill(&degrees), Err(HydrologyError::Geographic));
    }
}
