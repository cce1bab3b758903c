//! What fills and drainage areas are by definition, slowly and without any of the code they judge; and a map of a field.

use terrain_model::grid::Grid;

/// What lies around a known sample.
struct Around {
    /// Indices of known neighbours with their offsets in samples.
    near: Vec<(usize, [f64; 2])>,
    /// Does water leave here: are there fewer than eight?
    edge: bool,
}

fn around(grid: &Grid<f32>, i: usize, j: usize) -> Around {
    let mut near = Vec::with_capacity(8);
    for b in -1isize..=1 {
        for a in -1isize..=1 {
            let (Some(i), Some(j)) = (i.checked_add_signed(a), j.checked_add_signed(b)) else { continue };
            if (a, b) != (0, 0) && grid.known(i, j).is_some() {
                near.push((j * grid.width() + i, [a as f64, b as f64]));
            }
        }
    }
    let edge = near.len() < 8;
    Around { near, edge }
}

/// The greatest w with w = z at edges and w = max(z, lift(the lowest neighbour's w)) elsewhere: from +∞ down by sweeps, forward
/// and back in turn, until one changes nothing.
pub fn relaxed(grid: &Grid<f32>, lift: impl Fn(f32) -> f32) -> Grid<f32> {
    let all: Vec<Option<Around>> =
        grid.positions().map(|(i, j, _, z)| (!grid.is_no_data(z)).then(|| around(grid, i, j))).collect();
    let mut w = grid.map_known(|_| f32::INFINITY);
    let count = all.len();
    let mut calm = 0;
    let mut forward = true;
    while calm < 2 {
        calm += 1;
        for n in 0..count {
            let k = if forward { n } else { count - 1 - n };
            let Some(Around { near, edge }) = &all[k] else { continue };
            let lowest = near.iter().map(|&(n, _)| w.values()[n]).fold(f32::INFINITY, f32::min);
            let z = grid.values()[k];
            let level = if *edge { z } else { z.max(lift(lowest)) };
            if level < w.values()[k] {
                w.values_mut()[k] = level;
                calm = 0;
            }
        }
        forward = !forward;
    }
    w
}

/// Samples whose values are not the same; NaN is the same as NaN.
pub fn differing(a: &Grid<f32>, b: &Grid<f32>) -> usize {
    a.values().iter().zip(b.values()).filter(|(a, b)| a != b && !(a.is_nan() && b.is_nan())).count()
}

/// Drainage areas, m², by Freeman's weights slope^`exponent`: cells from the highest down, each gives what it has.
pub fn areas(surface: &Grid<f32>, exponent: f64) -> Vec<f64> {
    let spacing = surface.spacing();
    let z = surface.values();
    let mut order: Vec<usize> = (0..z.len()).filter(|&k| !surface.is_no_data(z[k])).collect();
    order.sort_by(|&a, &b| z[b].total_cmp(&z[a]));
    let mut areas = vec![spacing.x * spacing.y; z.len()];
    for k in order {
        let near = around(surface, k % surface.width(), k / surface.width()).near;
        let weight = |n: usize, [a, b]: [f64; 2]| {
            let run = ((a * spacing.x) * (a * spacing.x) + (b * spacing.y) * (b * spacing.y)).sqrt();
            libm::pow((f64::from(z[k]) - f64::from(z[n])).max(0.0) / run, exponent)
        };
        let total: f64 = near.iter().map(|&(n, offset)| weight(n, offset)).sum();
        for &(n, offset) in near.iter().filter(|(n, _)| z[*n] < z[k]) {
            areas[n] += areas[k] * weight(n, offset) / total;
        }
    }
    areas
}

/// A map, row 0 in the north: 0 is pale, 1 dark blue, the unknown grey.
pub fn shaded(values: &Grid<f64>) -> Vec<u8> {
    let rows: Vec<&[f64]> = values.rows().collect();
    let colour = |&v: &f64| {
        if values.is_no_data(v) {
            return [128; 3];
        }
        let t = v.clamp(0.0, 1.0);
        [250.0 - 235.0 * t, 245.0 - 200.0 * t, 230.0 - 110.0 * t].map(|c| c as u8)
    };
    rows.iter().rev().flat_map(|row| row.iter().flat_map(colour)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn a_bowl_by_hand() {
        let bowl = [9.0, 9.0, 9.0, 9.0, 9.0, 1.0, 2.0, 5.0, 9.0, 9.0, 9.0, 9.0];
        let bowl = Grid::new(DVec2::ZERO, DVec2::ONE, 4, 3, bowl.to_vec()).expect("twelve samples");
        assert_eq!(relaxed(&bowl, |z| z).values()[4..8], [9.0, 5.0, 5.0, 5.0]);
        let up = |z: f32| z + 1.0;
        let drained = relaxed(&bowl, up);
        assert_eq!(drained.values()[4..8], [9.0, 7.0, 6.0, 5.0]);
        assert_eq!(differing(&bowl, &drained), 2);
        // All twelve square metres end at the gap.
        assert!((areas(&drained, 1.1)[7] - 12.0).abs() < 1e-12);
    }
}
