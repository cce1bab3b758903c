//! The device's answers beside the certified tracer's, ray by ray.

use super::{Found, Settings, Tiles};
use glam::DVec3;
use rayon::prelude::*;
use terrain_model::bounds::THRESHOLD;
use terrain_model::program::{Cells, Evidence};
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::{Answer, Ray, Surface};

/// Rays that one thread proves at a time.
const CHUNK: usize = 64;

/// What was compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compared {
    /// Rays.
    pub rays: usize,
    /// Those for which a hit, or a wall, is certified.
    pub hits: usize,
    /// Of those, the answers beyond the certified bracket by more than their slack, or none.
    pub missed: usize,
    /// Answers where the terrain is farther than the tracer allows.
    pub false_hits: usize,
    /// Answers near the terrain on rays that are certified to meet none: they graze it.
    pub grazes: usize,
    /// Rays that were given up.
    pub gave_up: usize,
    /// Rays that the proof left open.
    pub undecided: usize,
    /// Evaluations of the terrain.
    pub steps: u64,
    /// The largest slack of a hit, metres.
    pub largest_slack: f64,
}

/// The proof of each ray.
pub fn prove(surface: &Surface<'_>, rays: &[Ray], effort: &Effort) -> Vec<Certified> {
    let cells = Cells::new(surface.program(), Evidence::Enclosures);
    let oracle = || CertifiedTracer::over(&cells);
    rays.par_iter().with_min_len(CHUNK).map_init(oracle, |oracle, ray| oracle.trace(ray, effort)).collect()
}

/// Counts answers by where they lie.
pub fn compare(
    (surface, tiles): (&Surface<'_>, &Tiles),
    settings: &Settings,
    rays: &[Ray],
    proved: &[Certified],
    found: &[Found],
) -> Compared {
    let mut out = Compared { rays: rays.len(), ..Compared::default() };
    for ((ray, proved), found) in rays.iter().zip(proved).zip(found) {
        out.steps += u64::from(found.steps);
        out.gave_up += usize::from(matches!(found.answer, Answer::GaveUp { .. }));
        let met = found.answer.distance();
        match *proved {
            Certified::Hit { t1, .. } | Certified::Wall { t1, .. } => {
                out.hits += 1;
                out.missed += usize::from(met.is_none_or(|t| t > t1 + found.slack));
            }
            Certified::Miss => out.grazes += usize::from(met.is_some()),
            Certified::Undecided { .. } => out.undecided += 1,
        }
        let Some(t) = met else { continue };
        out.largest_slack = out.largest_slack.max(found.slack);
        out.false_hits += usize::from(!near(surface, tiles, settings, ray.at(t), found));
    }
    out
}

/// Is the terrain as near as the device's answer promises? What it took for less than its threshold, or for a weight of T,
/// is off by its slack.
fn near(surface: &Surface<'_>, tiles: &Tiles, settings: &Settings, p: DVec3, found: &Found) -> bool {
    let slack = found.slack;
    let program = surface.cells().over(p.truncate(), p.truncate());
    let (elevation, weight) = program.height(p.truncate());
    let height = settings.epsilon.max(2.0 * slack) + slack;
    let thin = 2.0 * (tiles.margins(found.place.tile)[1] + surface.global().weight_slope * slack);
    p.z - elevation <= height && weight >= THRESHOLD - thin
}
