//! Looks for violations of a statement by itself: random points first, gradient ascent from the best of them, and intervals last,
//! which make the find a proof.

use super::witness::{Check, Violation};
use terrain_model::noise::mix;

/// The worst violation found.
#[derive(Clone, Debug, PartialEq)]
pub struct Prey {
    /// The numbers.
    pub at: Vec<f64>,
    /// Value over printed bound, in floating point.
    pub ratio: f64,
    /// A ratio that interval arithmetic proves; below 1 when it proves no violation.
    pub proved: f64,
}

/// Random points, and how many of the best are climbed from.
const POINTS: usize = 4000;
const CLIMBS: usize = 12;
/// Steps of one climb.
const STEPS: usize = 400;

/// The worst violation that is found of a statement; `None` when it says nothing anywhere.
pub fn hunt(violation: &dyn Violation, seed: u32) -> Option<Prey> {
    let root = violation.root();
    let ratio = |x: &[f64]| {
        let sides = violation.at(x)?;
        let ratio = sides.printed.value / sides.printed.limit;
        (sides.domain >= 0.0 && sides.printed.limit > 0.0 && ratio.is_finite()).then_some(ratio)
    };
    let mut state = seed;
    let mut random = || {
        state = mix(state, 0x9e37);
        f64::from(state) / f64::from(u32::MAX)
    };
    let mut best: Vec<(f64, Vec<f64>)> = (0..if root.is_empty() { 1 } else { POINTS })
        .filter_map(|_| {
            let x: Vec<f64> = root.iter().map(|(lo, hi)| lo + random() * (hi - lo)).collect();
            Some((ratio(&x)?, x))
        })
        .collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(CLIMBS);
    for (value, x) in &mut best {
        ascend(&ratio, root, value, x);
    }
    let (ratio, at) = best.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let check = Check::at(violation, &at)?;
    let proved = if check.inside && check.printed.limit.lo() > 0.0 {
        (check.printed.value.lo() / check.printed.limit.hi()).next_down()
    } else {
        0.0
    };
    Some(Prey { at, ratio, proved })
}

/// Steepest ascent by central differences in units of the box, with a step that grows on success and halves on failure.
fn ascend(ratio: &impl Fn(&[f64]) -> Option<f64>, root: &[(f64, f64)], value: &mut f64, x: &mut Vec<f64>) {
    let width: Vec<f64> = root.iter().map(|(lo, hi)| hi - lo).collect();
    let mut step = 0.05;
    for _ in 0..STEPS {
        let probe = 1e-4 * step;
        let gradient: Vec<f64> = (0..x.len())
            .map(|k| {
                let shifted = |by: f64| {
                    let mut y = x.clone();
                    y[k] = (y[k] + by * width[k]).clamp(root[k].0, root[k].1);
                    ratio(&y).unwrap_or(*value)
                };
                shifted(probe) - shifted(-probe)
            })
            .collect();
        let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        if length == 0.0 {
            return;
        }
        let mut y = x.clone();
        for k in 0..y.len() {
            y[k] = (y[k] + step * width[k] * gradient[k] / length).clamp(root[k].0, root[k].1);
        }
        match ratio(&y) {
            Some(higher) if higher > *value => {
                (*value, *x) = (higher, y);
                step *= 1.3;
            }
            _ => step *= 0.5,
        }
        if step < 1e-10 {
            return;
        }
    }
}
