//! Maximal Poisson sampling by darts on cells that are split (the scheme of Ebeida et al. 2012), made parallel by priorities.
//!
//! In each round every cell that is still open receives one dart. Darts too close to earlier points are dropped; of those left a
//! dart is accepted unless one that is too close and of higher priority is. Position and priority come from hashes of the cell,
//! so this names one set whatever the order of work. Then cells split, and parts that lie within the disk of a point are closed.

use super::SamplingError;
use super::exclusion::Exclusion;
use crate::field::Box3;
use glam::DVec3;
use rayon::prelude::*;
use terrain_model::noise::hash::{Keys, mix};

/// Where points may be: the image of a box of D parameters in space, and the distance that is wanted at each place.
pub trait Region<const D: usize>: Sync {
    /// Opposite corners of the box of parameters.
    fn domain(&self) -> [[f64; D]; 2];
    /// The place that parameters name, metres.
    fn place(&self, u: [f64; D]) -> DVec3;
    /// A box around the places of all parameters from `low` to `high`; `None` where no point is wanted at any of them.
    fn enclose(&self, low: [f64; D], high: [f64; D]) -> Option<Box3>;
    /// The distance that a point at `p` keeps, metres; `None` where no point is wanted. Held at the ends of
    /// [`Region::distances`]; NaN is none.
    fn distance(&self, p: DVec3) -> Option<f64>;
    /// The smallest and the largest distance.
    fn distances(&self) -> [f64; 2];
    /// A lower bound of [`Region::distance`] in a box: decides how soon a gap counts as closed, never a distance.
    fn least_distance(&self, within: &Box3) -> f64;
}

/// Points that keep their distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Poisson {
    /// Where they are, metres; round by round, in the order of cells.
    pub points: Vec<DVec3>,
    /// The distance that each keeps, metres: any two are at least the larger of their distances apart, in that the rounded
    /// square of their distance is not below its rounded square.
    pub distances: Vec<f64>,
    /// The share of the box of parameters in cells that are still open: at most this share could take another point.
    pub open: f64,
}

/// Cells to begin with, each about 100 bytes of a round.
const MOST: f64 = 2e7;
/// Rounds after cells are as small as the smallest distance: what stays open halves about every round.
const ROUNDS: u32 = 14;

/// A dart that keeps its distance from all earlier points.
struct Dart {
    place: DVec3,
    distance: f64,
    priority: u32,
}

/// What is known of a dart in this round.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    Unknown,
    In,
    Out,
}

/// A maximal, or nearly maximal, set of points in `region`; the same bytes for a seed on any number of threads.
///
/// # Errors
/// [`SamplingError`] for a region without an inside, distances out of range, or too many cells.
pub fn sample<const D: usize>(region: &impl Region<D>, seed: u32) -> Result<Poisson, SamplingError> {
    let [low, high] = region.domain();
    if !(0..D).all(|k| low[k].is_finite() && high[k].is_finite() && low[k] < high[k]) {
        return Err(SamplingError::Region { low: low.to_vec(), high: high.to_vec() });
    }
    let [least, most] = region.distances();
    if !(least > 0.0 && least <= most && most.is_finite()) {
        return Err(SamplingError::Distances { least, most });
    }
    // A disk of the largest distance covers a cell that it begins in, on flat ground.
    let wanted = most / (D as f64).sqrt();
    let counts: [f64; D] = std::array::from_fn(|k| ((high[k] - low[k]) / wanted).ceil());
    let cells = counts.iter().product::<f64>();
    if cells > MOST {
        return Err(SamplingError::Many { cells });
    }
    let sides = std::array::from_fn(|k| (high[k] - low[k]) / counts[k]);
    let all = (0..cells as usize).into_par_iter().map(|mut n| {
        counts.map(|count| {
            let index = n % count as usize;
            n /= count as usize;
            index as u32
        })
    });
    // As many as shrink cells to the smallest distance and some more, while 32 bits can number the cells of a row.
    let longest = counts.iter().copied().fold(0.0, f64::max);
    let halvings = |from: f64, to: f64| (0..32).take_while(|&k| from >= to * f64::from(1u32 << k)).count() as u32;
    let rounds = (halvings(most, least) + ROUNDS).min(halvings(4_294_967_295.0, longest) - 1);
    let mut throw = Throw { region, low, sides, most, least, taken: Exclusion::new(2.0 * most), distances: Vec::new() };
    let mut open: Vec<Cell<D>> = all.map(|index| Cell { round: 0, index }).collect();
    for round in 0..=rounds {
        let hashes = Hashes::new(seed, round);
        let thrown: Vec<(Cell<D>, Option<Dart>)> = open
            .into_par_iter()
            .flat_map_iter(|cell| {
                let parts = if round == 0 { vec![cell] } else { cell.parts() };
                throw.at(&cell, parts, &hashes)
            })
            .collect();
        open = thrown.iter().map(|thrown| thrown.0).collect();
        let darts: Vec<Dart> = thrown.into_iter().filter_map(|thrown| thrown.1).collect();
        for k in accepted(&darts, most) {
            throw.taken.insert(darts[k].place);
            throw.distances.push(darts[k].distance);
        }
    }
    let last = counts.iter().map(|count| count * f64::from(1u32 << rounds)).product::<f64>();
    let Throw { taken, distances, .. } = throw;
    Ok(Poisson { points: taken.points().to_vec(), distances, open: open.len() as f64 / last })
}

/// A box of parameters: the one of the lattice that is `index` after `round` halvings.
#[derive(Clone, Copy)]
struct Cell<const D: usize> {
    round: u32,
    index: [u32; D],
}

impl<const D: usize> Cell<D> {
    /// Its halves along all axes.
    fn parts(&self) -> Vec<Cell<D>> {
        let part = |n: u32| std::array::from_fn(|k| 2 * self.index[k] + (n >> k & 1));
        (0..1u32 << D).map(|n| Cell { round: self.round + 1, index: part(n) }).collect()
    }
}

/// The hashes of a round: a position along each axis, and a priority.
struct Hashes<const D: usize> {
    axes: [Keys; D],
    priority: Keys,
}

impl<const D: usize> Hashes<D> {
    fn new(seed: u32, round: u32) -> Hashes<D> {
        let keys = |k: usize| Keys::new(mix(mix(seed, round), k as u32));
        Hashes { axes: std::array::from_fn(keys), priority: keys(D) }
    }
}

/// What a round knows: the region, its lattice, and the points of earlier rounds.
struct Throw<'a, R, const D: usize> {
    region: &'a R,
    low: [f64; D],
    sides: [f64; D],
    most: f64,
    least: f64,
    taken: Exclusion,
    distances: Vec<f64>,
}

impl<R: Region<D>, const D: usize> Throw<'_, R, D> {
    /// Parameters `ahead` of a cell's low corner, in shares of its sides.
    fn parameters(&self, cell: &Cell<D>, ahead: [f64; D]) -> [f64; D] {
        let scale = f64::from(1u32 << cell.round);
        std::array::from_fn(|k| self.low[k] + (f64::from(cell.index[k]) + ahead[k]) / scale * self.sides[k])
    }
    fn enclose(&self, cell: &Cell<D>) -> Option<Box3> {
        self.region.enclose(self.parameters(cell, [0.0; D]), self.parameters(cell, [1.0; D]))
    }
    /// The `parts` of a cell that are open, each with its dart where that is far enough from all points.
    fn at(&self, cell: &Cell<D>, parts: Vec<Cell<D>>, hashes: &Hashes<D>) -> Vec<(Cell<D>, Option<Dart>)> {
        let Some(whole) = self.enclose(cell) else { return Vec::new() };
        // Points that any place in the cell can be too close to; a little more, for the rounding of places.
        let (middle, half) = (0.5 * (whole.low + whole.high), 0.5 * (whole.high - whole.low));
        let slack = 1e-9 * self.most + 1e-12 * middle.abs().max_element();
        let mut near = Vec::new();
        self.taken.each_within(middle, self.most + half.length() + slack, |k| {
            near.push((self.taken.points()[k], self.distances[k]));
        });
        let mut open = Vec::new();
        for part in parts {
            let Some(within) = self.enclose(&part) else { continue };
            let least = self.region.least_distance(&within);
            // In the disk of one point nothing can be added: it would be too close to that point.
            let holds = |(p, d): &(DVec3, f64)| within.distance_squared(*p).hi() < square(d.max(least));
            if !near.iter().any(holds) {
                open.push((part, self.dart(&part, &near, hashes)));
            }
        }
        open
    }
    fn dart(&self, cell: &Cell<D>, near: &[(DVec3, f64)], hashes: &Hashes<D>) -> Option<Dart> {
        let [x, y, z] = std::array::from_fn(|k| *cell.index.get(k).unwrap_or(&0));
        let share = |k: usize| (f64::from(hashes.axes[k].point3(x, y, z)) + 0.5) / 4_294_967_296.0;
        let place = self.region.place(self.parameters(cell, std::array::from_fn(share)));
        let distance = self.region.distance(place).filter(|d| !d.is_nan())?.clamp(self.least, self.most);
        let close = |(p, d): &(DVec3, f64)| place.distance_squared(*p) < square(distance.max(*d));
        let priority = hashes.priority.point3(x, y, z);
        (!near.iter().any(close)).then_some(Dart { place, distance, priority })
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// The darts that processing all by decreasing priority would accept, in the order given.
fn accepted(darts: &[Dart], most: f64) -> Vec<usize> {
    let mut near = Exclusion::new(most);
    darts.iter().for_each(|dart| near.insert(dart.place));
    let before = |a: usize, b: usize| (darts[a].priority, a) > (darts[b].priority, b);
    let rivals: Vec<Vec<u32>> = (0..darts.len())
        .into_par_iter()
        .map(|k| {
            let mut rivals = Vec::new();
            near.each_within(darts[k].place, most, |other| {
                let keep = square(darts[k].distance.max(darts[other].distance));
                if before(other, k) && darts[k].place.distance_squared(darts[other].place) < keep {
                    rivals.push(other as u32);
                }
            });
            rivals
        })
        .collect();
    // Each pass settles from the fates of the pass before, at least the first of all that are unknown.
    let mut fates = vec![Fate::Unknown; darts.len()];
    while fates.contains(&Fate::Unknown) {
        fates = (0..darts.len())
            .into_par_iter()
            .map(|k| match fates[k] {
                Fate::Unknown if rivals[k].iter().any(|&rival| fates[rival as usize] == Fate::In) => Fate::Out,
                Fate::Unknown if rivals[k].iter().all(|&rival| fates[rival as usize] == Fate::Out) => Fate::In,
                fate => fate,
            })
            .collect();
    }
    (0..darts.len()).filter(|&k| fates[k] == Fate::In).collect()
}
