//! A plot of a refuted statement: one number of its witness varied, the others held, value against the printed limit and ours.

use super::judge::Judged;
use crate::report::{Axis, Plot, Style};
use terrain_papers::certificates::{Kind, find};
use terrain_papers::ledger::Evidence;

/// The witness certificates of a row.
pub fn ids(judged: &Judged) -> impl Iterator<Item = String> + '_ {
    judged.items.iter().filter_map(|item| match &item.evidence {
        Evidence::Certificate(id) => {
            matches!(find(id)?.kind, Kind::Witness(violation) if !violation.names().is_empty()).then(|| id.clone())
        }
        _ => None,
    })
}

/// Points along the plot.
const POINTS: u32 = 240;

/// The plot of one of a row's witnesses, along its first number; `None` when there is nothing to draw.
pub fn of(judged: &Judged, id: &str) -> Option<Plot> {
    let certificate = find(id)?;
    let Kind::Witness(violation) = certificate.kind else { return None };
    let witness = judged.row.witness_of(certificate)?;
    let (name, &(lo, hi)) = (violation.names().first()?, violation.root().first()?);
    let sampled: Vec<_> = (0..=POINTS)
        .filter_map(|k| {
            let mut x = witness.clone();
            x[0] = lo + (hi - lo) * f64::from(k) / f64::from(POINTS);
            let sides = violation.at(&x)?;
            (sides.domain >= 0.0).then_some((x[0], sides))
        })
        .collect();
    let series = |pick: &dyn Fn(&terrain_papers::certificates::Sides<f64>) -> f64| -> Vec<(f64, f64)> {
        sampled.iter().map(|(x, sides)| (*x, pick(sides))).filter(|(_, y)| y.is_finite()).collect()
    };
    let value = series(&|sides| sides.printed.value);
    if value.len() < 2 {
        return None;
    }
    let caption = format!("{}: {}", judged.row.name(), certificate.shows);
    let x = format!("{name}; the witness is at {}", witness[0]);
    let plot = Plot::new(&format!("row-{id}"), &caption, Axis::linear(&x), Axis::linear("value and limits"));
    let plot = plot.series("value", Style::Line, value);
    let plot = plot.series("printed limit", Style::Dashed, series(&|sides| sides.printed.limit));
    let ours = series(&|sides| sides.corrected.limit);
    Some(if ours.len() > 1 { plot.series("corrected limit", Style::Dashed, ours) } else { plot })
}
