//! Accessibility of a heightfield (Miller 1994; Paris 2019 §6.1): how large a ball can touch the surface at a point from above
//! and meet it nowhere else, as a share of a largest radius. Bays and gullies are hard to reach, headlands easy.
//!
//! The surface is its samples. A ball that touches at p along the normal n and whose radius is r leaves out a sample q exactly
//! when 2r·n·(q − p) ≤ ‖q − p‖², so the radius is the least ‖q − p‖² / 2n·(q − p) over the samples above the tangent plane. Balls
//! of smaller radius lie in those of larger, so a block of samples that is outside of the ball so far stays outside. Blocks lie
//! under planes that follow the slope of the ground: a hillside as such is in no ball's way.

use super::HydrologyError;
use super::padded::{Elevation, Padded};
use super::slope::{Gradient, gradient};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use terrain_model::grid::Grid;

/// α in (0, 1]: the radius of the largest ball at each sample over `radius`, the largest that is tried, metres; NaN, the
/// marker, at no-data. The normal is that of Horn's gradient. Samples farther than 2·`radius` do not matter.
///
/// Exact for the samples: the surface between them can reach into a ball by about spacing² / 8r.
///
/// # Errors
/// [`HydrologyError`] for a geographic grid, a value that is not finite, too many samples, or a radius that is not positive
/// and finite.
pub fn accessibility<T: Elevation>(surface: &Grid<T>, radius: f64) -> Result<Grid<f64>, HydrologyError> {
    accessibility_where(surface, radius, |_| true)
}

/// [`accessibility`] of the samples of which `wanted` holds, by their place in the raster; NaN, the marker, elsewhere.
///
/// # Errors
/// As [`accessibility`].
pub fn accessibility_where<T: Elevation>(
    surface: &Grid<T>,
    radius: f64,
    wanted: impl Fn(usize) -> bool + Sync,
) -> Result<Grid<f64>, HydrologyError> {
    if !(radius > 0.0 && radius.is_finite()) {
        let expected = "a positive number of metres";
        return Err(HydrologyError::Parameter { name: "the largest radius", value: radius, expected });
    }
    let raster = Padded::new(surface, f64::NAN, T::to_f64)?;
    let (spacing, width, height) = (surface.spacing(), surface.width(), surface.height());
    // As high as the largest ball is wide, or the raster, whichever is less.
    let samples = (2.0 * radius / spacing.min_element()).min(width.max(height) as f64);
    let pyramid = Pyramid::new(&raster, spacing, samples);
    let mut values = vec![f64::NAN; width * height];
    values.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
        let mut stack = Vec::new();
        for (i, out) in row.iter_mut().enumerate() {
            let cell = (j + 1) * raster.stride + i + 1;
            if raster.known[cell] && wanted(j * width + i) {
                let slope = gradient(&raster, cell, spacing, Gradient::Horn);
                let ball = Ball::new([i, j], raster.values[cell], slope, radius);
                *out = pyramid.shrink(ball, &raster, spacing, &mut stack).radius / radius;
            }
        }
    });
    Ok(surface.with_values(values, Some(f64::NAN)).expect("a value for each sample of the surface"))
}

/// Tests for what is clear of a ball are made with one a little larger: rounding must not lose a sample that just touches.
const SLACK: f64 = 1.0 + 1e-9;

/// A ball that touches the surface at a sample.
#[derive(Clone, Copy)]
struct Ball {
    column: usize,
    row: usize,
    elevation: f64,
    normal: DVec3,
    radius: f64,
}

impl Ball {
    fn new([column, row]: [usize; 2], elevation: f64, slope: DVec2, radius: f64) -> Ball {
        let normal = DVec3::new(-slope.x, -slope.y, 1.0).normalize();
        Ball { column, row, elevation, normal, radius }
    }
    /// From where it touches to sample (i, j) at elevation `z`.
    fn towards(&self, i: usize, j: usize, z: f64, spacing: DVec2) -> DVec3 {
        let across = |to: usize, from: usize| to as f64 - from as f64;
        DVec3::new(across(i, self.column) * spacing.x, across(j, self.row) * spacing.y, z - self.elevation)
    }
    /// The radius at which a point `d` from where it touches is on it; infinite below the tangent plane.
    fn radius_at(&self, d: DVec3) -> f64 {
        let above = 2.0 * self.normal.dot(d);
        if above > 0.0 { d.length_squared() / above } else { f64::INFINITY }
    }
    /// Could a sample be in it that lies in the block of columns and rows `low` to `high` under `roof`?
    ///
    /// A sample is where 2r·n·d > ‖d‖², and n·d is at most what the roof has at a corner, ‖d‖ at least the distance across.
    fn meets(&self, low: [usize; 2], high: [usize; 2], roof: &Roof, spacing: DVec2) -> bool {
        let near = self.towards(low[0], low[1], roof.elevation, spacing);
        let far = self.towards(high[0], high[1], roof.elevation, spacing).truncate();
        let size = far - near.truncate();
        // n·d is linear on the roof: the largest at a corner is the one at the first corner and what each side adds.
        let rise = self.normal.truncate() + self.normal.z * roof.slope;
        let above = self.normal.dot(near) + (rise * size).max(DVec2::ZERO).element_sum();
        let across = near.truncate().max(-far).max(DVec2::ZERO).length_squared();
        2.0 * above * (self.radius * SLACK) > across
    }
}

/// Known samples of a block are at or below `elevation` + `slope` · (their place − that of its south-west sample).
#[derive(Clone, Copy)]
struct Roof {
    elevation: f64,
    slope: DVec2,
}

/// Roofs of blocks of [`LEAF`] samples a side, and of 2, 4, 8 … times as many.
struct Pyramid {
    levels: Vec<Level>,
}

struct Level {
    /// Blocks from west to east.
    width: usize,
    roofs: Vec<Roof>,
}

/// Binary logarithm of the samples along a side of the smallest blocks: all their samples are read.
const LEAF: usize = 2;

impl Pyramid {
    /// Levels until a block is `samples` wide.
    fn new(raster: &Padded<f64>, spacing: DVec2, samples: f64) -> Pyramid {
        let (width, height) = (raster.width(), raster.values.len() / raster.stride - 2);
        let mut levels = Vec::new();
        let mut scale = LEAF;
        loop {
            let across = width.div_ceil(1 << scale);
            let blocks = across * height.div_ceil(1 << scale);
            let roof = |k: usize| roof(raster, spacing, [(k % across) << scale, (k / across) << scale], 1 << scale);
            levels.push(Level { width: across, roofs: (0..blocks).into_par_iter().map(roof).collect() });
            if (1u64 << scale) as f64 >= samples {
                return Pyramid { levels };
            }
            scale += 1;
        }
    }

    /// `ball` made so small that no sample is in it.
    fn shrink(&self, mut ball: Ball, raster: &Padded<f64>, spacing: DVec2, stack: &mut Vec<[usize; 3]>) -> Ball {
        let (width, height) = (raster.width(), raster.values.len() / raster.stride - 2);
        let z = |i: usize, j: usize| raster.values[(j + 1) * raster.stride + i + 1];
        let visit = |ball: &mut Ball, i: usize, j: usize| {
            let d = ball.towards(i, j, z(i, j), spacing);
            // Most are clear of the ball and need no division; a little more, for rounding.
            if 2.0 * ball.normal.dot(d) * (ball.radius * SLACK) > d.length_squared() {
                ball.radius = ball.radius_at(d).min(ball.radius);
            }
        };
        // Neighbours first: they often make it small at once.
        for j in ball.row.saturating_sub(1)..(ball.row + 2).min(height) {
            for i in ball.column.saturating_sub(1)..(ball.column + 2).min(width) {
                visit(&mut ball, i, j);
            }
        }
        let top = self.levels.len() - 1;
        let wide = top + LEAF;
        let reach = |from: usize, spacing: f64, end: usize| {
            let cells = (2.0 * ball.radius / spacing).min(end as f64) as usize + 1;
            (from.saturating_sub(cells) >> wide, (from + cells).min(end - 1) >> wide)
        };
        let ((west, east), (south, north)) = (reach(ball.column, spacing.x, width), reach(ball.row, spacing.y, height));
        for j in south..=north {
            stack.extend((west..=east).map(|i| [top, i, j]));
        }
        while let Some([level, i, j]) = stack.pop() {
            let blocks = &self.levels[level];
            let scale = level + LEAF;
            let low = [i << scale, j << scale];
            let high = [((i + 1) << scale).min(width) - 1, ((j + 1) << scale).min(height) - 1];
            if !ball.meets(low, high, &blocks.roofs[j * blocks.width + i], spacing) {
                continue;
            }
            if level == 0 {
                for j in low[1]..=high[1] {
                    for i in low[0]..=high[0] {
                        visit(&mut ball, i, j);
                    }
                }
                continue;
            }
            let below = &self.levels[level - 1];
            let rows = below.roofs.len() / below.width;
            for (a, b) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (i, j) = (2 * i + a, 2 * j + b);
                if i < below.width && j < rows {
                    stack.push([level - 1, i, j]);
                }
            }
        }
        ball
    }
}

/// The roof of the block of `side` samples from `low`, cut at the border: it slopes as the block's corners do.
fn roof(raster: &Padded<f64>, spacing: DVec2, low: [usize; 2], side: usize) -> Roof {
    let (width, height) = (raster.width(), raster.values.len() / raster.stride - 2);
    let high = [(low[0] + side).min(width) - 1, (low[1] + side).min(height) - 1];
    let z = |i: usize, j: usize| raster.values[(j + 1) * raster.stride + i + 1];
    let size = DVec2::new((high[0] - low[0]) as f64, (high[1] - low[1]) as f64) * spacing;
    let [sw, se, nw, ne] = [z(low[0], low[1]), z(high[0], low[1]), z(low[0], high[1]), z(high[0], high[1])];
    let slope = 0.5 * DVec2::new(se - sw + ne - nw, nw - sw + ne - se) / size;
    // Where a corner is unknown or a side has one sample.
    let slope = if slope.is_finite() { slope } else { DVec2::ZERO };
    let (mut elevation, mut largest) = (f64::NEG_INFINITY, 0.0f64);
    for j in low[1]..=high[1] {
        for i in low[0]..=high[0] {
            let across = DVec2::new((i - low[0]) as f64, (j - low[1]) as f64) * spacing;
            // The unknown is NaN, and `max` passes it by.
            elevation = elevation.max(z(i, j) - slope.dot(across));
            largest = largest.max(z(i, j).abs());
        }
    }
    // Roundings are some ulps of the terms, which are no larger than this.
    let slack = 16.0 * f64::EPSILON * (largest + slope.abs().dot(size));
    Roof { elevation: elevation + slack, slope }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{grid, narrow, rasters, unit};
    use super::*;

    /// All samples against all.
    fn by_definition(surface: &Grid<f64>, radius: f64) -> Vec<f64> {
        let raster = Padded::new(surface, f64::NAN, |z| z).unwrap();
        let spacing = surface.spacing();
        let mut values = Vec::new();
        for (i, j, _, z) in surface.positions() {
            let cell = (j + 1) * raster.stride + i + 1;
            let ball = Ball::new([i, j], z, gradient(&raster, cell, spacing, Gradient::Horn), radius);
            let others = surface.positions().filter(|&(_, _, _, z)| !z.is_nan());
            let least =
                others.map(|(a, b, _, z)| ball.radius_at(ball.towards(a, b, z, spacing))).fold(radius, f64::min);
            values.push(if z.is_nan() { f64::NAN } else { least / radius });
        }
        values
    }

    fn differing(a: &[f64], b: &[f64]) -> usize {
        a.iter().zip(b).filter(|(a, b)| a != b && !(a.is_nan() && b.is_nan())).count()
    }

    #[test]
    fn pruning_leaves_no_sample_out_to_the_bit() {
        // And a smooth hillside, where roofs are what prunes.
        let hillside = grid(70, 40, DVec2::ONE, |i, j| {
            let (x, y) = (i as f64, j as f64);
            2.0 * x - 1.5 * y + 6.0 * libm::sin(x / 9.0) * libm::cos(y / 7.0)
        });
        for surface in rasters(11).into_iter().chain([hillside]) {
            let surface = surface.with_placement(DVec2::ZERO, DVec2::new(4.0, 7.0)).unwrap();
            for radius in [3.0, 30.0, 1e5] {
                let fast = accessibility(&surface, radius).unwrap();
                assert_eq!(differing(fast.values(), &by_definition(&surface, radius)), 0);
            }
        }
        // Control: a spike beyond the reach of one radius changes it for a larger one alone.
        let flat = grid(40, 3, DVec2::ONE, |i, _| if i == 30 { 9.0 } else { 0.0 });
        let at = |radius: f64| accessibility(&flat, radius).unwrap().get(10, 1).unwrap();
        assert_eq!(at(5.0), 1.0);
        assert!(at(50.0) < 1.0);
    }

    #[test]
    fn the_ball_in_a_round_valley_is_the_valleys() {
        // A half pipe of radius 20 m sampled each 0.5 m; at its bottom every ball up to 20 m touches there alone.
        let pipe = grid(61, 5, DVec2::splat(0.5), |i, _| {
            let x = (i as f64 - 30.0) * 0.5;
            20.0 - (400.0 - x * x).sqrt()
        });
        let bottom = |radius: f64| accessibility(&pipe, radius).unwrap().get(30, 2).unwrap() * radius;
        assert_eq!(bottom(10.0), 10.0);
        assert!((bottom(60.0) - 20.0).abs() < 1e-9, "{}", bottom(60.0));
        // A ridge is reached by every ball.
        let ridge = pipe.map_known(|z| -z);
        assert!((accessibility(&ridge, 60.0).unwrap().get(30, 2).unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_share_is_in_zero_to_one_and_the_same_bytes_on_one_thread_and_on_two() {
        let rough = narrow(&grid(50, 40, DVec2::splat(2.0), |i, j| 30.0 * unit(5, i, j)));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| accessibility(&rough, 25.0).unwrap())
        };
        let (one, two) = (on(1), on(2));
        assert_eq!(one.values(), two.values());
        assert!(one.values().iter().all(|&a| a > 0.0 && a <= 1.0));
        assert!(one.values().iter().any(|&a| a < 0.5));
        assert!(matches!(accessibility(&rough, 0.0), Err(HydrologyError::Parameter { .. })));
    }
}
