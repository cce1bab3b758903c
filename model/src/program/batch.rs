//! The SIMD executor: `f32` lanes over a tile program, with the instruction set chosen at run time.

use super::run::Text;
use super::{Cells, Evaluator, Evidence, Program, Pruner, TileProgram};
use crate::bounds::Region;
use crate::lanes::Lanes;
use glam::DVec2;
use pulp::WithSimd;
use rayon::prelude::*;

/// Lanes evaluated together.
pub const WIDTH: usize = 16;

/// Samples along the side of a baked tile.
const TILE: usize = 32;

/// Evaluates tile programs over lists of points.
#[derive(Debug)]
pub struct BatchEvaluator {
    evaluator: Evaluator<Lanes<WIDTH>>,
    arch: pulp::Arch,
}

impl BatchEvaluator {
    /// An evaluator with stacks deep enough for `program` and every tile pruned from it.
    pub fn new(program: &Program) -> BatchEvaluator {
        BatchEvaluator { evaluator: Evaluator::with_depth(program.depth), arch: pulp::Arch::new() }
    }
    /// Elevation and weight at each point, metres from the tile's origin. All slices have the same length.
    ///
    /// # Panics
    /// When the lengths differ.
    pub fn evaluate(&mut self, tile: &TileProgram, x: &[f32], y: &[f32], elevation: &mut [f32], weight: &mut [f32]) {
        self.evaluator.reach(tile.depth());
        assert!(x.len() == y.len() && x.len() == elevation.len() && x.len() == weight.len());
        let batch = Batch { evaluator: &mut self.evaluator, text: tile.text(), x, y, elevation, weight };
        if cfg!(debug_assertions) {
            // The machine is compiled once for each instruction set, all formulas inlined. Every set gives the same bits, so a build
            // for tests has one of them.
            batch.with_simd(pulp::Scalar::new());
        } else {
            self.arch.dispatch(batch);
        }
    }
}

/// One call of the evaluator. A type with an inlined method, not a closure: the compiler wraps a closure's body into a
/// function of its own, which is then compiled without the instruction set that was chosen.
struct Batch<'a> {
    evaluator: &'a mut Evaluator<Lanes<WIDTH>>,
    text: Text<'a, f32>,
    x: &'a [f32],
    y: &'a [f32],
    elevation: &'a mut [f32],
    weight: &'a mut [f32],
}

impl pulp::WithSimd for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Batch { evaluator, text, x, y, elevation, weight } = self;
        let mut k = 0;
        while k < x.len() {
            let n = (x.len() - k).min(WIDTH);
            let mut at = [Lanes::splat(x[k]), Lanes::splat(y[k])];
            at[0].0[..n].copy_from_slice(&x[k..k + n]);
            at[1].0[..n].copy_from_slice(&y[k..k + n]);
            let (f, a) = evaluator.run_text(text, at);
            elevation[k..k + n].copy_from_slice(&f.0[..n]);
            weight[k..k + n].copy_from_slice(&a.0[..n]);
            k += n;
        }
    }
}

/// A raster of elevations and weights, row 0 in the south.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// Samples along x.
    pub width: usize,
    /// Samples along y.
    pub height: usize,
    /// Metres, 0 where the weight is 0.
    pub elevation: Vec<f32>,
    /// α.
    pub weight: Vec<f32>,
}

impl Program {
    /// [`Cells::bake`] without keeping the squares.
    pub fn bake(&self, origin: DVec2, spacing: DVec2, width: usize, height: usize) -> Baked {
        Cells::new(self, Evidence::Ranges).bake(origin, spacing, width, height)
    }
}

impl Cells {
    /// Samples a raster: value (i, j) at `origin` + (i·dx, j·dy). Tiles are pruned, re-based and evaluated in SIMD, in
    /// parallel; the result does not depend on the number of threads.
    pub fn bake(&self, origin: DVec2, spacing: DVec2, width: usize, height: usize) -> Baked {
        let mut baked =
            Baked { width, height, elevation: vec![0.0; width * height], weight: vec![0.0; width * height] };
        let rows = TILE * width;
        baked
            .elevation
            .par_chunks_mut(rows.max(1))
            .zip(baked.weight.par_chunks_mut(rows.max(1)))
            .enumerate()
            .for_each_init(
                || BatchEvaluator { evaluator: Evaluator::with_depth([1, 1]), arch: pulp::Arch::new() },
                |batch, (band, (elevation, weight))| {
                    let count = elevation.len() / width;
                    for left in (0..width).step_by(TILE) {
                        let columns = (width - left).min(TILE);
                        let corner = origin + DVec2::new(left as f64, (band * TILE) as f64) * spacing;
                        let far = corner + DVec2::new(columns as f64 - 1.0, count as f64 - 1.0) * spacing;
                        // A sample's own rounding may step over the edge by an ulp: the box is a hair larger.
                        let slack = DVec2::splat(1e-12) * (corner.abs().max(far.abs()) + spacing);
                        let (low, high) = (corner - slack, far + slack);
                        let pruned = Pruner::new(self.over(low, high)).prune(Region::rectangle(low, high));
                        let tile = TileProgram::new(&pruned, corner);
                        let n = columns * count;
                        let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
                        for k in 0..n {
                            x[k] = ((k % columns) as f64 * spacing.x) as f32;
                            y[k] = ((k / columns) as f64 * spacing.y) as f32;
                        }
                        let (mut f, mut a) = (vec![0.0; n], vec![0.0; n]);
                        batch.evaluate(&tile, &x, &y, &mut f, &mut a);
                        for k in 0..n {
                            let to = (k / columns) * width + left + k % columns;
                            elevation[to] = if a[k] > 0.0 { f[k] } else { 0.0 };
                            weight[to] = a[k];
                        }
                    }
                },
            );
        baked
    }
}
