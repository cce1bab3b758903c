//! A terrain cut into square tiles, each with the program that is left on it, re-based to its centre, and with what the
//! tracer must know of it: bounds from the model, and how far the device may be from the model. Layout: trace/tile.wgsl.

use crate::program::conformance::DEVICE;
use crate::program::encode::Encoded;
use glam::DVec2;
use rayon::prelude::*;
use terrain_model::bounds::{Region, THRESHOLD};
use terrain_model::certify::cover::largest_over;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::program::{BoundsEvaluator, Evaluator, Program, Pruner, TileProgram};
use terrain_model::rounding::Rounded;
use terrain_model::trace::Surface;

/// A tile's bounds hold this share of its width beyond it: more than rounding can carry a ray out of it.
const PAD: f64 = 1e-3;
/// Splits spent on the slope bound of one tile, and the finest part as a share of its width.
const BUDGET: usize = 48;
const FINEST: f64 = 1.0 / 32.0;
/// How often a part of a tile is halved where its gradient has no bound.
const HALVED: u32 = 2;
/// Points along a side of a tile at which the device's error is derived.
const PROBES: u32 = 4;
/// What the largest error found at them is multiplied by for the points between.
const BETWEEN: f64 = 2.0;
/// Words of a tile.
const TILE: usize = 12;

/// A terrain as the device traces it.
#[derive(Debug)]
pub struct Tiles {
    pub(super) encoded: Encoded,
    /// The shader's records, row by row from the south-west.
    pub(super) records: Vec<u32>,
    /// South-west corner, metres.
    corner: DVec2,
    /// Of a tile, metres; its half is a number of `f32`.
    width: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// λ_h of the whole terrain.
    pub(super) steepest: f64,
    /// See [`Tiles::margins`].
    margins: Vec<[f64; 2]>,
    /// The most iterations that one evaluation may take, about.
    pub(super) cost: usize,
}

/// What the device must know of one tile that has ground.
struct Tile {
    program: TileProgram,
    slope: f64,
    weight_slope: f64,
    /// No elevation is higher, no weight less.
    highest: f64,
    least_weight: f64,
    /// Of ∂f/∂x and ∂f/∂y.
    gradient: [Interval; 2],
    margins: [f64; 2],
}

impl Tiles {
    /// `count` tiles along the longer side of the terrain's support. `None` when there is nothing to trace.
    pub fn new(surface: &Surface<'_>, count: usize) -> Option<Tiles> {
        let (lo, hi) = surface.support()?;
        // Few digits, so that positions at a border are exact.
        let width =
            f64::from(f32::from_bits(((((hi - lo).max_element() / count as f64) as f32).to_bits() | 0xfff) + 1));
        let cells = ((hi - lo) / width).ceil();
        let (columns, rows) = (cells.x.max(1.0) as usize, cells.y.max(1.0) as usize);
        let mut out = Tiles {
            encoded: Encoded::default(),
            records: Vec::new(),
            corner: lo,
            width,
            columns,
            rows,
            steepest: surface.global().steepest(),
            margins: Vec::new(),
            cost: 1,
        };
        let tiles: Vec<Option<Tile>> = (0..columns * rows)
            .into_par_iter()
            .map_init(|| Bounder::new(surface), |bounder, k| bounder.tile(out.centre(k), width))
            .collect();
        for k in 0..tiles.len() {
            let near = out.around(k).filter_map(|k| tiles[k].as_ref()).map(|tile| tile.margins);
            out.margins
                .push(near.fold([0.0; 2], |most, own| [0, 1].map(|which| most[which].max(BETWEEN * own[which]))));
        }
        for (k, tile) in tiles.iter().enumerate() {
            out.push(tile.as_ref(), out.margins[k]);
        }
        Some(out)
    }
    /// World position of the centre of tile `k`, metres.
    pub fn centre(&self, k: usize) -> DVec2 {
        self.corner + (DVec2::new((k % self.columns) as f64, (k / self.columns) as f64) + 0.5) * self.width
    }
    /// The tile in which a point lies, the nearest one for points outside.
    pub(super) fn cell(&self, p: DVec2) -> [usize; 2] {
        let at = ((p - self.corner) / self.width).floor();
        [at.x.clamp(0.0, self.columns as f64 - 1.0) as usize, at.y.clamp(0.0, self.rows as f64 - 1.0) as usize]
    }
    /// Half the width of a tile, metres.
    pub fn half(&self) -> f64 {
        0.5 * self.width
    }
    /// How many tiles there are.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }
    /// The tile and its neighbours.
    fn around(&self, k: usize) -> impl Iterator<Item = usize> {
        let (columns, rows) = (self.columns, self.rows);
        let (i, j) = (k % columns, k / columns);
        let beside = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        beside(j, rows).flat_map(move |j| beside(i, columns).map(move |i| j * columns + i))
    }
    /// How far the device's elevations, metres, and weights may be from the terrain's on a tile, where it has ground: what
    /// `f32` rounds by `Rounded`, times [`DEVICE`], and what rounding the parameters moves. The sum is derived at 16 points
    /// of the tile and of each of its neighbours; between them it is taken to be at most twice the largest of
    /// these, which is no proof: tests and the experiment `gpu/tracing` hold the device to it elsewhere.
    pub fn margins(&self, tile: usize) -> [f64; 2] {
        self.margins[tile]
    }
    /// The largest of them.
    pub fn largest_margins(&self) -> [f64; 2] {
        self.margins.iter().fold([0.0; 2], |most, own| [0, 1].map(|which| most[which].max(own[which])))
    }
    fn push(&mut self, tile: Option<&Tile>, margins: [f64; 2]) {
        let Some(tile) = tile else {
            self.records.extend([0; TILE]);
            return;
        };
        let program = self.encoded.push(&tile.program);
        let up = |x: f64| (x as f32).next_up().to_bits();
        let down = |x: f64| (x as f32).next_down().to_bits();
        // A position is off by less than PAD·width, so that its weight is above T too.
        let inside = tile.least_weight >= THRESHOLD + margins[1];
        let [x, y] = tile.gradient;
        self.records.extend([program.start, program.end, up(tile.slope), up(tile.weight_slope)]);
        self.records.extend([up(tile.highest + margins[0]), u32::from(inside), up(margins[0]), up(margins[1])]);
        self.records.extend([down(x.lo()), down(y.lo()), up(x.hi()), up(y.hi())]);
        // Loops run over instructions, their octaves, and arcs, which take several parameters each.
        let loops = tile.program.code().len() + tile.program.octaves().len() + tile.program.parameters().len() / 4;
        self.cost = self.cost.max(loops);
    }
}

/// Bounds tiles, reusing its stacks.
struct Bounder<'a> {
    surface: &'a Surface<'a>,
    bounds: BoundsEvaluator<'a>,
    duals: Evaluator<Dual<Interval, 2>>,
}

impl<'a> Bounder<'a> {
    fn new(surface: &'a Surface<'a>) -> Bounder<'a> {
        let program = surface.program();
        Bounder { surface, bounds: BoundsEvaluator::new(program), duals: Evaluator::new(program) }
    }
    /// `None` where no ground is.
    fn tile(&mut self, centre: DVec2, width: f64) -> Option<Tile> {
        let reach = DVec2::splat((0.5 + PAD) * width);
        let (lo, hi) = (centre - reach, centre + reach);
        let region = Region::rectangle(lo, hi);
        let pruned = Pruner::new(self.surface.cells().over(lo, hi)).prune(region);
        let (mut highest, mut least_weight, mut weight_slope) = (f64::NEG_INFINITY, f64::INFINITY, 0.0f64);
        let mut gradient: Option<[Interval; 2]> = None;
        // The quarters of quarters bound better than the whole does.
        for extent in parts(region.extent) {
            let bounds = self.bounds.bounds_of(&pruned, Region { extent, ends: None });
            least_weight = least_weight.min(bounds.weight.lo());
            weight_slope = weight_slope.max(bounds.weight_slope);
            if bounds.weight.hi() >= THRESHOLD {
                highest = highest.max(bounds.elevation.hi());
                gradient = either(gradient, self.gradient(&pruned, extent, HALVED));
            }
        }
        let gradient = gradient?;
        let slope = largest_over(region.extent, FINEST * width, BUDGET, |extent| {
            let bounds = self.bounds.bounds_of(&pruned, Region { extent, ends: None });
            (bounds.weight.hi() >= THRESHOLD).then_some(bounds.slope)
        });
        let slope = slope.min(self.surface.global().slope);
        let gradient = gradient.map(|g| Interval::new(g.lo().max(-slope), g.hi().min(slope)));
        let program = TileProgram::new(&pruned, centre);
        let margins = margins(&program, &pruned, width);
        Some(Tile { program, slope, weight_slope, highest, least_weight, gradient, margins })
    }
    /// Encloses the gradient where there is ground.
    fn gradient(&mut self, program: &Program, extent: [Interval; 2], halve: u32) -> Option<[Interval; 2]> {
        let [x, y] = [0, 1].map(|axis| Dual::variable(extent[axis], axis));
        let (elevation, weight) = self.duals.run(program, [x, y]);
        if weight.value.hi() < THRESHOLD {
            return None;
        }
        let bounded = elevation.slope.iter().all(|slope| slope.magnitude().is_finite());
        if bounded || halve == 0 {
            return Some(elevation.slope);
        }
        let quarters =
            extent.map(|side| [Interval::new(side.lo(), side.middle()), Interval::new(side.middle(), side.hi())]);
        let [west_east, south_north] = quarters;
        let each = west_east.into_iter().flat_map(|x| south_north.map(|y| [x, y]));
        each.fold(None, |sum, quarter| either(sum, self.gradient(program, quarter, halve - 1)))
    }
}

/// What encloses both, where there are two.
fn either(a: Option<[Interval; 2]>, b: Option<[Interval; 2]>) -> Option<[Interval; 2]> {
    match (a, b) {
        (Some(a), Some(b)) => Some([a[0].hull(b[0]), a[1].hull(b[1])]),
        (a, b) => a.or(b),
    }
}

/// The box in sixteen.
fn parts(extent: [Interval; 2]) -> impl Iterator<Item = [Interval; 2]> {
    (0..16u32).map(move |k| {
        let share = [k % 4, k / 4];
        [0, 1].map(|axis| {
            let (side, at) = (extent[axis], |share: u32| f64::from(share) * 0.25);
            let (from, to) = (at(share[axis]), at(share[axis] + 1));
            // Rounding leaves no gap.
            let place = |share: f64| side.lo() + share * (side.hi() - side.lo());
            Interval::new(place(from - 1e-6).max(side.lo()), place(to + 1e-6).min(side.hi()))
        })
    })
}

/// The largest error at points of a tile: see [`Tiles::margins`].
fn margins(tile: &TileProgram, program: &Program, width: f64) -> [f64; 2] {
    let (mut rounded, mut single) = (tile.evaluator::<Rounded>(), tile.evaluator::<f64>());
    let mut largest = [0.0f64; 2];
    for k in 0..PROBES * PROBES {
        let share = |k: u32| (f64::from(k) + 0.5) / f64::from(PROBES) - 0.5;
        let local = DVec2::new(share(k % PROBES), share(k / PROBES)) * width;
        let derived = tile.run(&mut rounded, local.to_array().map(|x| Rounded::new(Interval::point(x), 0.0)));
        let stored = tile.run(&mut single, local.to_array());
        let exact = program.height(tile.origin + local);
        let weight = DEVICE * derived.1.error + (stored.1 - exact.1).abs();
        largest[1] = largest[1].max(weight);
        if exact.1 + weight >= THRESHOLD {
            largest[0] = largest[0].max(DEVICE * derived.0.error + (stored.0 - exact.0).abs());
        }
    }
    largest
}
