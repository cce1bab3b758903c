//! Pictures put together: a raster of RGB with panels side by side, and lines drawn on it.

use glam::{DVec2, DVec3};

/// An RGB picture, row by row from the top.
#[derive(Clone)]
pub struct Canvas {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<u8>,
}

impl Canvas {
    /// A picture whose pixel (column, row from the top) has the colour `at(column, row)`, each part 0 to 1.
    pub fn new(width: usize, height: usize, at: impl Fn(usize, usize) -> DVec3 + Sync) -> Canvas {
        use rayon::prelude::*;
        let row = |y: usize| (0..width).flat_map(|x| bytes(at(x, y))).collect::<Vec<u8>>();
        let rows: Vec<Vec<u8>> = (0..height).into_par_iter().map(row).collect();
        Canvas { width, height, rgb: rows.concat() }
    }
    /// Panels of equal height side by side, a white gap between them.
    pub fn beside(panels: &[Canvas]) -> Canvas {
        const GAP: usize = 6;
        let height = panels.iter().map(|panel| panel.height).max().unwrap_or(0);
        let width = panels.iter().map(|panel| panel.width).sum::<usize>() + GAP * panels.len().saturating_sub(1);
        let mut rgb = vec![255; 3 * width * height];
        let mut left = 0;
        for panel in panels {
            for y in 0..panel.height {
                let from = &panel.rgb[3 * y * panel.width..][..3 * panel.width];
                rgb[3 * (y * width + left)..][..3 * panel.width].copy_from_slice(from);
            }
            left += panel.width + GAP;
        }
        Canvas { width, height, rgb }
    }
    /// One picture below the other.
    pub fn above(self, below: Canvas) -> Canvas {
        const GAP: usize = 6;
        let width = self.width.max(below.width);
        let height = self.height + GAP + below.height;
        let mut rgb = vec![255; 3 * width * height];
        for (top, panel) in [(0, &self), (self.height + GAP, &below)] {
            for y in 0..panel.height {
                let from = &panel.rgb[3 * y * panel.width..][..3 * panel.width];
                rgb[3 * (top + y) * width..][..3 * panel.width].copy_from_slice(from);
            }
        }
        Canvas { width, height, rgb }
    }
    /// A line through points in pixels, `radius` pixels to both sides, soft at its edge.
    pub fn line(&mut self, points: &[DVec2], radius: f64, colour: DVec3) {
        let mut cover = std::collections::BTreeMap::new();
        for pair in points.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let reach = radius + 1.0;
            let (low, high) = (a.min(b) - reach, a.max(b) + reach);
            let columns = low.x.max(0.0) as usize..(high.x.ceil().max(0.0) as usize).min(self.width);
            for y in low.y.max(0.0) as usize..(high.y.ceil().max(0.0) as usize).min(self.height) {
                for x in columns.clone() {
                    let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
                    let share = (radius + 0.5 - p.distance(a.lerp(b, t))).clamp(0.0, 1.0);
                    let most = cover.entry(y * self.width + x).or_insert(0.0f64);
                    *most = most.max(share);
                }
            }
        }
        for (k, share) in cover {
            let under = DVec3::from([0, 1, 2].map(|c| f64::from(self.rgb[3 * k + c]) / 255.0));
            self.rgb[3 * k..3 * k + 3].copy_from_slice(&bytes(under.lerp(colour, share)));
        }
    }
}

fn bytes(colour: DVec3) -> [u8; 3] {
    colour.to_array().map(|part| (part.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}
