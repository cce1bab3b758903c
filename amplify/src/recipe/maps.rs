//! What an amplified terrain looks like from above (Paris 2019 §6, Figs. 11 and 12): stress, resistance and effects as
//! rasters, and the share of the ground that primitives cover.

use super::Amplified;
use crate::field::{Box3, Density, THRESHOLD};
use crate::implicit::index::Index;
use crate::landform::raster::shaped;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use terrain_model::grid::Grid;

/// Maps with the samples of the heightfield.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// The largest σ of sea and rivers on the heightfield, in [0, 1].
    pub stress: Grid<f32>,
    /// ρ on the heightfield, in [0, 1].
    pub resistance: Grid<f32>,
    /// 0 where no primitive is above or below; else how many layers of rock lie above each other: 1 is an open cliff, 2 an
    /// overhang, arch or cave, 3 and more caves over caves.
    pub effects: Grid<f32>,
}

/// Points of a column are no nearer than this, metres, however small the primitives around are.
const FINEST: f64 = 0.25;

impl Amplified {
    /// The maps over `grid`, the heightfield it was made of. Layers thinner than half of the smallest radius around,
    /// or than a quarter of a metre, may be missed.
    pub fn maps(&self, grid: &Grid<f32>) -> Maps {
        let place = |k: usize| {
            let at: DVec2 = grid.position(k % grid.width(), k / grid.width());
            at.extend(f64::from(grid.values()[k]))
        };
        let samples = 0..grid.values().len();
        let resistance = samples.clone().into_par_iter().map(|k| self.geology.value(place(k)) as f32).collect();
        let effects = samples.into_par_iter().map(|k| self.layers(place(k)) as f32).collect();
        Maps { stress: self.stress.clone(), resistance: shaped(grid, resistance), effects: shaped(grid, effects) }
    }

    /// Layers of rock in the column through `p`; 0 without primitives.
    fn layers(&self, p: DVec3) -> u32 {
        let column = Box3 { low: p.with_z(f64::NEG_INFINITY), high: p.with_z(f64::INFINITY) };
        let (mut touched, mut step) = (Box3::EMPTY, f64::INFINITY);
        for k in self.index.among(&column) {
            let one = &self.index.primitives()[k as usize];
            let support = one.support();
            if !one.meets(&Box3 { low: p.with_z(support.low.z), high: p.with_z(support.high.z) }) {
                continue;
            }
            touched = touched.hull(&support);
            step = step.min(0.5 * f64::from(one.radius));
        }
        if touched.is_empty() {
            return 0;
        }
        let (bottom, top) = (touched.low.z.min(p.z), touched.high.z.max(p.z));
        let count = ((top - bottom) / step.max(FINEST)).ceil().clamp(1.0, 1e5);
        let rock = |k: f64| self.volume.value(p.with_z(bottom + (top - bottom) * k / count)) >= THRESHOLD;
        let (mut layers, mut inside) = (0, false);
        for k in 0..=count as u32 {
            let now = rock(k.into());
            layers += u32::from(now && !inside);
            inside = now;
        }
        layers.max(1)
    }

    /// [`coverage`] of the ground of `grid`.
    pub fn coverage(&self, grid: &Grid<f32>, cell: f64) -> f64 {
        let (low, high) = grid.bounds();
        coverage(&self.index, [low, high], cell)
    }
}

/// a: the share of the squares of `cell` metres of a rectangle whose middle lies in the vertical projection of a primitive
/// (Paris 2019 §7).
pub fn coverage(index: &Index, [low, high]: [DVec2; 2], cell: f64) -> f64 {
    let cells = ((high - low) / cell).ceil().max(DVec2::ONE);
    let (width, height) = (cells.x as usize, cells.y as usize);
    let mut covered = vec![false; width * height];
    for one in index.primitives() {
        let support = one.support();
        let [from, to] = [support.low, support.high].map(|p| (p.truncate() - low) / cell);
        let [first, last] = [from, to].map(|at| at.floor().clamp(DVec2::ZERO, cells - 1.0));
        for y in first.y as usize..=last.y as usize {
            for x in first.x as usize..=last.x as usize {
                if covered[y * width + x] {
                    continue;
                }
                let at = low + cell * DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let column = Box3 { low: at.extend(support.low.z), high: at.extend(support.high.z) };
                covered[y * width + x] = one.meets(&column);
            }
        }
    }
    covered.iter().filter(|covered| **covered).count() as f64 / covered.len() as f64
}
