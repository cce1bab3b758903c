//! Rasters for tests, and the definitions of both fills as the fixed point of a relaxation that knows no queue.

use super::padded::Elevation;
use glam::DVec2;
use terrain_model::grid::{Grid, Sample};
use terrain_model::noise::hash;

/// Random bits of a cell.
pub fn bits(seed: u32, i: usize, j: usize) -> u32 {
    hash::Keys::new(seed).point2(i as u32, j as u32)
}

/// In [0, 1).
pub fn unit(seed: u32, i: usize, j: usize) -> f64 {
    f64::from(bits(seed, i, j)) / 4_294_967_296.0
}

/// A raster of `value(i, j)`, no marker.
pub fn grid<T: Sample>(width: usize, height: usize, spacing: DVec2, value: impl Fn(usize, usize) -> T) -> Grid<T> {
    let values = (0..width * height).map(|k| value(k % width, k / width)).collect();
    Grid::new(DVec2::ZERO, spacing, width, height, values).expect("a small grid is one")
}

/// Rasters of many kinds, as `f64`: white noise, plateaus of few elevations, hills with basins, each whole and with holes.
pub fn rasters(seed: u32) -> Vec<Grid<f64>> {
    let sizes = [(17, 23), (1, 19), (24, 1), (2, 9), (1, 1), (31, 30)];
    let mut all = Vec::new();
    for (n, (width, height)) in sizes.into_iter().enumerate() {
        let seed = hash::mix(seed, n as u32);
        let noise = grid(width, height, DVec2::ONE, |i, j| unit(seed, i, j) * 200.0 - 100.0);
        let levels = grid(width, height, DVec2::ONE, |i, j| f64::from(bits(seed, i, j) % 4) - 2.0);
        let hills = grid(width, height, DVec2::ONE, |i, j| {
            let wave = |k: usize, period: f64| libm::sin(k as f64 / period);
            (wave(i, 2.7) * wave(j, 3.1) * 50.0 + unit(seed, i, j) * 8.0).round()
        });
        for whole in [noise, levels, hills] {
            let holes = whole.values().iter().enumerate();
            let holes =
                holes.map(|(k, &z)| if bits(seed ^ 1, k, 0).is_multiple_of(11) { f64::NAN } else { z }).collect();
            let holes = whole.with_values(holes, Some(f64::NAN)).expect("of the same size");
            all.extend([whole, holes]);
        }
    }
    all
}

/// The same raster in `f32`.
pub fn narrow(grid: &Grid<f64>) -> Grid<f32> {
    grid.map(Some(f32::NAN), |z| z.map_or(f32::NAN, |z| z as f32))
}

/// Known neighbours of a cell, and whether it is an edge.
pub fn neighbours<T: Sample>(grid: &Grid<T>, i: usize, j: usize) -> (Vec<(usize, usize)>, bool) {
    let mut all = Vec::new();
    for dj in [-1, 0, 1] {
        for di in [-1, 0, 1] {
            if let (Some(i), Some(j)) = (i.checked_add_signed(di), j.checked_add_signed(dj))
                && (di, dj) != (0, 0)
                && grid.known(i, j).is_some()
            {
                all.push((i, j));
            }
        }
    }
    let edge = all.len() < 8;
    (all, edge)
}

/// The greatest fixed point of w = z at edges, w = max(z, min over neighbours of lift(w)) elsewhere, from +∞ downwards.
pub fn relaxed<T: Elevation>(grid: &Grid<T>, top: T, lift: impl Fn(T) -> T) -> Grid<T> {
    let mut w = grid.map_known(|_| top);
    loop {
        let mut changed = false;
        for (i, j, _, z) in grid.positions() {
            if grid.is_no_data(z) {
                continue;
            }
            let (near, edge) = neighbours(grid, i, j);
            let mut level = z;
            if !edge {
                let lowest = near.iter().filter_map(|&(i, j)| w.known(i, j)).map(&lift);
                let lowest = lowest.fold(top, |a, b| if b < a { b } else { a });
                level = if lowest > z { lowest } else { z };
            }
            let own = &mut w.values_mut()[j * grid.width() + i];
            if level < *own {
                *own = level;
                changed = true;
            }
        }
        if !changed {
            return w;
        }
    }
}

/// Known samples that differ.
pub fn mismatches<T: Elevation>(a: &Grid<T>, b: &Grid<T>) -> usize {
    a.values().iter().zip(b.values()).filter(|(a, b)| !a.same(**b)).count()
}
