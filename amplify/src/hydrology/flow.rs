//! Drainage area: what rains on each cell flows down to its lower neighbours, to all of them by slope (Freeman 1991) or to the
//! steepest alone (D8, O'Callaghan and Mark 1984).

use super::HydrologyError;
use super::padded::{Elevation, Padded, go, steps};
use super::power::Power;
use glam::DVec2;
use rayon::prelude::*;
use terrain_model::grid::Grid;

/// Where the water of a cell goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Routing {
    /// To the neighbour of steepest descent; of several as steep the first, counted from the south-west by rows.
    Steepest,
    /// To all lower neighbours, in proportion to slope^`exponent` (Freeman 1991, eq. 3).
    Multiple {
        /// Larger is closer to [`Routing::Steepest`]; above 0, at most 16.
        exponent: f64,
    },
}

impl Routing {
    /// Freeman's own exponent, 1.1.
    pub const FREEMAN: Routing = Routing::Multiple { exponent: 1.1 };
}

/// What flows where.
#[derive(Clone, Debug, PartialEq)]
pub struct Drainage {
    /// A: area that drains through each cell, its own dx·dy included, m²; NaN, the marker, where elevations are unknown.
    pub area: Grid<f64>,
    /// Cells without a lower neighbour, as i + width·j in ascending order. All water ends in them; after an
    /// [`epsilon_fill`](super::fill::epsilon_fill) they are edges.
    pub outlets: Vec<usize>,
}

/// Distances to the eight neighbours in the order of [`steps`], metres.
pub(super) fn distances(spacing: DVec2) -> [f64; 8] {
    let d = spacing.length();
    [d, spacing.y, d, spacing.x, spacing.x, d, spacing.y, d]
}

/// The drainage area of `surface`, which should drain: see [`epsilon_fill`](super::fill::epsilon_fill). Water that reaches a
/// cell without a lower neighbour stays there. Linear in the number of samples; the same on any number of threads.
///
/// # Errors
/// [`HydrologyError`] for a geographic grid, a value that is not finite, too many samples, or an exponent out of range.
pub fn drainage_area<T: Elevation>(surface: &Grid<T>, routing: Routing) -> Result<Drainage, HydrologyError> {
    let raster = Padded::new(surface, f64::NAN, T::to_f64)?;
    let spacing = surface.spacing();
    let (area, sinks) = match routing {
        Routing::Steepest => accumulate(&raster, spacing, |slopes, steepest| {
            let first = slopes.iter().position(|&slope| slope == steepest);
            std::array::from_fn(|k| if Some(k) == first { 1.0 } else { 0.0 })
        }),
        Routing::Multiple { exponent } if exponent > 0.0 && exponent <= 16.0 => {
            let power = Power::new(exponent);
            accumulate(&raster, spacing, |slopes, steepest| {
                let weights = slopes.map(|slope| if slope > 0.0 { power.of(slope / steepest) } else { 0.0 });
                let total: f64 = weights.iter().sum();
                weights.map(|weight| weight / total)
            })
        }
        Routing::Multiple { exponent: value } => {
            let expected = "a number above 0, at most 16";
            return Err(HydrologyError::Parameter { name: "the exponent of slopes", value, expected });
        }
    };
    let width = surface.width();
    let mut values = Vec::with_capacity(width * surface.height());
    for start in raster.row_starts() {
        values.extend((start..start + width).map(|k| if raster.known[k] { area[k] } else { f64::NAN }));
    }
    let place = |k: usize| (k % raster.stride - 1) + (k / raster.stride - 1) * width;
    let mut outlets: Vec<usize> = sinks.into_iter().map(place).collect();
    outlets.sort_unstable();
    let area = surface.with_values(values, Some(f64::NAN)).expect("a value for each sample of the surface");
    Ok(Drainage { area, outlets })
}

/// In place of a count of givers: has passed its water on.
const DONE: u8 = u8::MAX;

/// Cells in an order in which each follows all that are higher beside it: a cell is ready when as many have given as there are.
/// `shares` maps slopes, 0 where not down, and the largest of them to parts of 1.
fn accumulate(
    raster: &Padded<f64>,
    spacing: DVec2,
    shares: impl Fn([f64; 8], f64) -> [f64; 8],
) -> (Vec<f64>, Vec<usize>) {
    let (z, stride) = (&raster.values, raster.stride);
    let steps = steps(stride);
    let per_metre = distances(spacing).map(|d| 1.0 / d);
    let mut missing = vec![0u8; z.len()];
    missing.par_chunks_mut(stride).enumerate().for_each(|(j, row)| {
        if j == 0 || (j + 1) * stride == z.len() {
            return;
        }
        for (i, missing) in row.iter_mut().enumerate().take(stride - 1).skip(1) {
            let cell = j * stride + i;
            *missing = steps.iter().map(|&step| u8::from(z[go(cell, step)] > z[cell])).sum();
        }
    });
    let mut area = vec![spacing.x * spacing.y; z.len()];
    let mut ready: Vec<u32> = Vec::new();
    let mut sinks = Vec::new();
    for source in 0..z.len() {
        if missing[source] != 0 || !raster.known[source] {
            continue;
        }
        // One source at a time: what it lets follow is near, and still in the caches.
        ready.push(source as u32);
        while let Some(cell) = ready.pop() {
            let cell = cell as usize;
            missing[cell] = DONE;
            let own = z[cell];
            let mut slopes: [f64; 8] = std::array::from_fn(|k| (own - z[go(cell, steps[k])]).max(0.0));
            let drop = slopes.iter().copied().fold(0.0, f64::max);
            if drop == 0.0 {
                sinks.push(cell);
                continue;
            }
            if drop < f64::MIN_POSITIVE / f64::EPSILON {
                // A power of two keeps ratios, and makes subnormal drops normal, which division would lose.
                slopes = slopes.map(|drop| drop * f64::from_bits((1023 + 120) << 52));
            }
            for k in 0..8 {
                slopes[k] *= per_metre[k];
            }
            let steepest = slopes.iter().copied().fold(0.0, f64::max);
            let shares = shares(slopes, steepest);
            let own = area[cell];
            for k in 0..8 {
                if slopes[k] > 0.0 {
                    let next = go(cell, steps[k]);
                    area[next] += own * shares[k];
                    missing[next] -= 1;
                    if missing[next] == 0 {
                        ready.push(next as u32);
                    }
                }
            }
        }
    }
    (area, sinks)
}

#[cfg(test)]
mod tests {
    use super::super::fill::epsilon_fill;
    use super::super::testing::{grid, narrow, neighbours, rasters, unit};
    use super::*;

    /// Σ over outlets of what ends there, and the area of all known cells.
    fn balance<T: Elevation>(surface: &Grid<T>, drainage: &Drainage) -> (f64, f64) {
        let left = drainage.outlets.iter().map(|&k| drainage.area.values()[k]).sum();
        let known = surface.values().len() - surface.no_data_count();
        (left, known as f64 * surface.spacing().x * surface.spacing().y)
    }

    #[test]
    fn what_leaves_at_the_outlets_is_what_rained() {
        for wide in rasters(5) {
            let wide = wide.with_placement(DVec2::ZERO, DVec2::new(3.0, 7.0)).unwrap();
            for routing in [Routing::FREEMAN, Routing::Steepest] {
                let narrow = narrow(&wide);
                for drainage in [drainage_area(&wide, routing).unwrap(), drainage_area(&narrow, routing).unwrap()] {
                    let (left, total) = balance(&wide, &drainage);
                    assert!((left - total).abs() <= 1e-9 * total, "{left} of {total}");
                }
            }
        }
        // Control: one outlet forgotten is seen.
        let wide = &rasters(5)[0];
        let mut drainage = drainage_area(wide, Routing::FREEMAN).unwrap();
        drainage.outlets.pop();
        let (left, total) = balance(wide, &drainage);
        assert!((left - total).abs() > 1e-9 * total);
    }

    #[test]
    fn after_an_epsilon_fill_all_water_leaves_at_edges() {
        for wide in rasters(6) {
            let inner = |surface: &Grid<f64>| {
                let outlets = drainage_area(surface, Routing::FREEMAN).unwrap().outlets;
                outlets.iter().filter(|&&k| !neighbours(surface, k % surface.width(), k / surface.width()).1).count()
            };
            assert_eq!(inner(&epsilon_fill(&wide).unwrap()), 0);
            // Control: before it some stays in pits.
            assert!(wide.values().len() < 300 || wide.no_data_count() > 0 || inner(&wide) > 0);
        }
    }

    /// The definition in plain words: cells from the highest to the lowest, weights by `libm::pow`.
    fn by_sorting(surface: &Grid<f64>, exponent: f64) -> Vec<f64> {
        let (width, d) = (surface.width(), surface.spacing());
        let mut order: Vec<usize> = (0..surface.values().len()).filter(|&k| !surface.values()[k].is_nan()).collect();
        order.sort_by(|&a, &b| surface.values()[b].total_cmp(&surface.values()[a]));
        let mut area = surface.map_known(|_| d.x * d.y).into_values();
        for k in order {
            let (i, j) = (k % width, k / width);
            let slope = |&(a, b): &(usize, usize)| {
                let run = d * DVec2::new(a as f64 - i as f64, b as f64 - j as f64);
                ((surface.values()[k] - surface.values()[b * width + a]) / run.length()).max(0.0)
            };
            let near = neighbours(surface, i, j).0;
            let total: f64 = near.iter().map(|n| libm::pow(slope(n), exponent)).sum();
            for n in near.iter().filter(|n| slope(n) > 0.0) {
                area[n.1 * width + n.0] += area[k] * libm::pow(slope(n), exponent) / total;
            }
        }
        area
    }

    #[test]
    fn areas_are_those_of_freemans_formula_evaluated_from_the_highest_cell_down() {
        let worst = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).filter(|(a, _)| !a.is_nan()).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        };
        for wide in rasters(7) {
            let wide = wide.with_placement(DVec2::ZERO, DVec2::new(3.0, 7.0)).unwrap();
            let drained = epsilon_fill(&wide.map_known(|z| z + 1e-3 * unit(3, z.to_bits() as usize, 0))).unwrap();
            let area = drainage_area(&drained, Routing::FREEMAN).unwrap().area.into_values();
            assert!(worst(&area, &by_sorting(&drained, 1.1)) < 1e-11);
        }
        // Control: another exponent is another answer.
        let wide = epsilon_fill(&rasters(7)[0]).unwrap();
        let area = drainage_area(&wide, Routing::FREEMAN).unwrap().area.into_values();
        assert!(worst(&area, &by_sorting(&wide, 1.2)) > 1e-3);
    }

    #[test]
    fn a_cone_drains_evenly_and_a_valley_gathers() {
        // Rain on a plane tilted to the south: the same along each row away from the sides.
        let plane = grid(9, 6, DVec2::new(2.0, 5.0), |_, j| j as f64);
        let area = drainage_area(&plane, Routing::Steepest).unwrap().area;
        for j in 0..6 {
            assert_eq!(area.get(4, j), Some(10.0 * (6 - j) as f64));
        }
        let valley = grid(9, 6, DVec2::ONE, |i, j| 0.1 * j as f64 + (i as f64 - 4.0).abs());
        let drainage = drainage_area(&valley, Routing::Steepest).unwrap();
        assert_eq!(drainage.outlets, [4]);
        assert_eq!(drainage.area.get(4, 0), Some(54.0));
    }

    #[test]
    fn the_smallest_slopes_share_water_as_large_ones_do() {
        // A cell 4 numbers above one neighbour and 2 above another: subnormal drops keep their ratio.
        let tiny = |n: u64| f64::from_bits(n);
        let row = grid(3, 1, DVec2::splat(10.0), |i, _| [tiny(5), tiny(9), tiny(7)][i]);
        let area = drainage_area(&row, Routing::Multiple { exponent: 1.0 }).unwrap().area;
        assert!((area.get(0, 0).unwrap() / 100.0 - 1.0 - 2.0 / 3.0).abs() < 1e-12);
        assert!((area.get(2, 0).unwrap() / 100.0 - 1.0 - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn areas_are_the_same_bytes_on_one_thread_and_on_two() {
        let rough = grid(60, 50, DVec2::ONE, |i, j| unit(9, i, j) + 0.1 * (i + j) as f64);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| drainage_area(&rough, Routing::FREEMAN).unwrap())
        };
        assert_eq!(on(1).area.values(), on(2).area.values());
    }

    #[test]
    fn an_exponent_out_of_range_is_named() {
        let flat = grid(2, 2, DVec2::ONE, |_, _| 0.0);
        for exponent in [0.0, -1.0, 17.0, f64::NAN] {
            let answer = drainage_area(&flat, Routing::Multiple { exponent });
            assert!(matches!(answer, Err(HydrologyError::Parameter { .. })));
        }
    }
}
