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

/// Cells to begin with.
const MOST: f64 = 2e8;
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
    let sides: [f64; D] = std::array::from_fn(|k| (high[k] - low[k]) / counts[k]);
    let mut open: Vec<[u32; D]> = (0..cells as usize)
        .into_par_iter()
        .map(|mut n| {
            counts.map(|count| {
                let index = n % count as usize;
                n /= count as usize;
                index as u32
            })
        })
        .collect();
    let mut taken = Exclusion::new(2.0 * most);
    let mut distances: Vec<f64> = Vec::new();
    // As many as shrink cells to the smallest distance and some more, while 32 bits can number the cells of a row.
    let longest = counts.iter().copied().fold(0.0, f64::max);
    let halvings = |from: f64, to: f64| (0..32).take_while(|&k| from >= to * f64::from(1u32 << k)).count() as u32;
    let rounds = (halvings(most, least) + ROUNDS).min(halvings(4_294_967_295.0, longest) - 1);
    for round in 0..=rounds {
        let scale = f64::from(1u32 << round);
        let corner = |cell: [u32; D], ahead: u32| -> [f64; D] {
            std::array::from_fn(|k| low[k] + f64::from(cell[k] + ahead) / scale * sides[k])
        };
        let box_of = |cell: [u32; D]| region.enclose(corner(cell, 0), corner(cell, 1));
        open = open
            .into_par_iter()
            .filter(|&cell| box_of(cell).is_some_and(|within| !covered(region, &taken, &distances, most, &within)))
            .collect();
        if open.is_empty() {
            break;
        }
        let keys: [Keys; D] = std::array::from_fn(|k| Keys::new(mix(mix(seed, round), k as u32)));
        let order = Keys::new(mix(mix(seed, round), D as u32));
        let darts: Vec<Dart> = open
            .par_iter()
            .filter_map(|&cell| {
                let at = |keys: &Keys| keys.point3(cell[0], cell[1], *cell.get(2).unwrap_or(&0));
                let u = std::array::from_fn(|k| {
                    let part = (f64::from(at(&keys[k])) + 0.5) / 4_294_967_296.0;
                    low[k] + (f64::from(cell[k]) + part) / scale * sides[k]
                });
                let place = region.place(u);
                let distance = region.distance(place).filter(|d| !d.is_nan())?.clamp(least, most);
                let close = |k: usize| place.distance_squared(taken.points()[k]) < square(distance.max(distances[k]));
                let free = taken.find_within(place, most, close).is_none();
                free.then_some(Dart { place, distance, priority: at(&order) })
            })
            .collect();
        for k in accepted(&darts, most) {
            taken.insert(darts[k].place);
            distances.push(darts[k].distance);
        }
        if round < rounds {
            open = open.into_par_iter().flat_map_iter(children).collect();
        }
    }
    let scale = f64::from(1u32 << rounds);
    let open = open.len() as f64 / counts.iter().map(|count| count * scale).product::<f64>();
    Ok(Poisson { points: taken.points().to_vec(), distances, open })
}

fn square(x: f64) -> f64 {
    x * x
}

/// The halves of a cell along all axes.
fn children<const D: usize>(cell: [u32; D]) -> impl Iterator<Item = [u32; D]> {
    (0..1u32 << D).map(move |part| std::array::from_fn(|k| 2 * cell[k] + (part >> k & 1)))
}

/// Does the disk of one point hold all of a box? Anything in it would be too close to that point.
fn covered<const D: usize>(
    region: &impl Region<D>,
    taken: &Exclusion,
    distances: &[f64],
    most: f64,
    within: &Box3,
) -> bool {
    let least = region.least_distance(within);
    let middle = 0.5 * (within.low + within.high);
    let holds = |k: usize| within.distance_squared(taken.points()[k]).hi() < square(distances[k].max(least));
    taken.find_within(middle, most, holds).is_some()
}

/// The darts that processing all by decreasing priority would accept, in the order given.
fn accepted(darts: &[Dart], most: f64) -> Vec<usize> {
    let mut near = Exclusion::new(2.0 * most);
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
