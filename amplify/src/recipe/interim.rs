//! To be replaced by the room of hydrology.

use super::Pits;
use crate::landform::raster::shaped;
use glam::{DVec2, DVec3};
use terrain_model::grid::Grid;

const AROUND: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

fn neighbours(grid: &Grid<f32>, k: usize) -> impl Iterator<Item = (usize, f64)> {
    let (w, h) = (grid.width() as i32, grid.height() as i32);
    let (i, j) = ((k as i32) % w, (k as i32) / w);
    let s = grid.spacing();
    AROUND.into_iter().filter_map(move |(dx, dy)| {
        let (x, y) = (i + dx, j + dy);
        let inside = x >= 0 && y >= 0 && x < w && y < h;
        inside.then(|| ((y * w + x) as usize, (DVec2::new(dx.into(), dy.into()) * s).length()))
    })
}

pub(super) fn drainage_area(grid: &Grid<f32>) -> Grid<f32> {
    let h = grid.values();
    let mut order: Vec<u32> = (0..h.len() as u32).collect();
    order.sort_by(|a, b| h[*b as usize].total_cmp(&h[*a as usize]));
    let cell = grid.spacing().x * grid.spacing().y;
    let mut area = vec![cell; h.len()];
    for k in order {
        let k = k as usize;
        let lower: Vec<(usize, f64)> = neighbours(grid, k)
            .filter(|(n, _)| h[*n] < h[k])
            .map(|(n, d)| (n, libm::pow(f64::from(h[k] - h[n]) / d, 1.1)))
            .collect();
        let total: f64 = lower.iter().map(|(_, w)| w).sum();
        for (n, w) in lower {
            area[n] += area[k] * w / total;
        }
    }
    shaped(grid, area.into_iter().map(|a| a as f32).collect())
}

pub(super) fn gradient(grid: &Grid<f32>) -> Grid<f32> {
    let h = grid.values();
    let s = |k: usize| neighbours(grid, k).map(|(n, d)| f64::from((h[k] - h[n]).abs()) / d).fold(0.0, f64::max);
    shaped(grid, (0..h.len()).map(|k| s(k) as f32).collect())
}

pub(super) fn stream_power(grid: &Grid<f32>) -> Grid<f32> {
    let (a, s) = (drainage_area(grid), gradient(grid));
    shaped(grid, a.values().iter().zip(s.values()).map(|(a, s)| a.sqrt() * s.min(1.0)).collect())
}

pub(super) fn spread(grid: &Grid<f32>, radius: f64) -> Grid<f32> {
    let r = (radius / grid.spacing().x).round() as i32;
    let (w, h) = (grid.width() as i32, grid.height() as i32);
    let pass = |values: &[f32], dx: i32, dy: i32| -> Vec<f32> {
        (0..values.len() as i32)
            .map(|k| {
                let (i, j) = (k % w, k / w);
                (-r..=r)
                    .filter_map(|t| {
                        let (x, y) = (i + t * dx, j + t * dy);
                        let weight = 1.0 - (t.abs() as f32) / (r as f32 + 1.0);
                        (x >= 0 && y >= 0 && x < w && y < h).then(|| values[(y * w + x) as usize] * weight)
                    })
                    .fold(0.0, f32::max)
            })
            .collect()
    };
    let across = pass(grid.values(), 1, 0);
    shaped(grid, pass(&across, 0, 1))
}

pub(super) fn accessibility(grid: &Grid<f32>, _radius: f64) -> Grid<f32> {
    shaped(grid, vec![1.0; grid.values().len()])
}

pub(super) fn deepest(grid: &Grid<f32>, pits: Pits) -> Vec<DVec3> {
    let h = grid.values();
    let low = (0..h.len()).filter(|&k| {
        let mut n = 0;
        neighbours(grid, k).all(|(other, _)| {
            n += 1;
            h[other] > h[k]
        }) && n == 8
    });
    low.take(pits.most as usize)
        .map(|k| grid.position(k % grid.width(), k / grid.width()).extend(f64::from(h[k])))
        .collect()
}
