//! Table 1: feature curves of each scene and the size of its file.

use super::models::{MODELS, load};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Compared, Comparison, Outcome, Table, Tolerance};
use terrain_diffusion::landscape::Landscape;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hnaidi2010/table1",
    title: "Table 1: feature curves and sizes of files",
    section: "§6, Table 1",
    about: "Six landscapes with the paper's numbers of curves, and the bytes of their compact form: 16 bits a number, absent categories \
            left out. Every file is read back, and what its 16 bits cost is measured against half of a step.",
    code: "experiments/src/hnaidi2010/table1.rs",
    test: "experiments/src/hnaidi2010/table1.rs::reading_back_moves_no_curve_by_more_than_half_a_step",
    expected: |_| Expected { seconds: 1.0, memory_bytes: 16 << 20, disk_bytes: 64 << 10 },
    run,
};

/// Largest distance of a way-point and its twin over half of a step, and largest difference of elevations over the same.
fn loss(landscape: &Landscape, back: &Landscape) -> [f64; 2] {
    let precision = landscape.compact_precision();
    let (mut position, mut height) = (0.0f64, 0.0f64);
    for (a, b) in landscape.features().iter().zip(back.features()) {
        for (p, q) in a.path.points().iter().zip(b.path.points()) {
            let moved = (*p - *q).abs();
            position = position.max(moved.x / precision.position[0]).max(moved.y / precision.position[1]);
        }
        for (p, q) in a.points.iter().zip(&b.points) {
            if let (Some(p), Some(q)) = (p.elevation, q.elevation) {
                height = height.max((p.height - q.height).abs() / precision.height);
            }
        }
    }
    [position, height]
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let printed = terrain_papers::tables::hnaidi2010_table1()?;
    let mut compared = Comparison::new("table1", "Curves, and bytes of the compact form", "", &ctx.hardware);
    let mut table = Table::new("compact", "What the compact form costs")
        .column("landscape")
        .column("bytes")
        .column("bytes a curve")
        .column("position, at most")
        .column("elevation, at most")
        .column("of half a step, positions")
        .column("of half a step, elevations");
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let (mut lossy, mut noticed) = (0.0f64, true);
    for (name, scene) in MODELS {
        let landscape = load(name)?;
        let bytes = landscape.to_compact().map_err(ExperimentError::failed)?;
        outcome.input(&format!("{name}.ron"), landscape.to_ron().as_bytes());
        let row = printed.rows.iter().find(|row| row.scene == scene);
        let row = row.ok_or_else(|| ExperimentError::failed(format!("Table 1 has no scene {scene}")))?;
        let curves = landscape.curves().len();
        outcome.metric(&format!("{name}.curves"), curves as f64)?;
        outcome.metric(&format!("{name}.bytes"), bytes.len() as f64)?;
        let each = bytes.len() as f64 / curves as f64;
        outcome.metric(&format!("{name}.bytes_per_curve"), each)?;
        compared.push(Compared::new(
            format!("{scene}: curves"),
            "",
            f64::from(row.features),
            curves as f64,
            Tolerance::absolute(0.0, "the landscapes are made to it"),
        ));
        compared.push(Compared::new(
            format!("{scene}: kB"),
            "kB",
            row.kilobytes,
            bytes.len() as f64 / 1000.0,
            Tolerance::ratio(0.5, 2.0, "neither the paper's curves nor its file format are published"),
        ));
        let back = Landscape::from_compact(&bytes).map_err(ExperimentError::failed)?;
        let losses = loss(&landscape, &back);
        lossy = losses.into_iter().fold(lossy, f64::max);
        let precision = landscape.compact_precision();
        table.row([
            Cell::from(name),
            Cell::count(bytes.len() as u64),
            Cell::number(each, "B", 3),
            Cell::number(precision.position[0].max(precision.position[1]), "m", 2),
            Cell::number(precision.height, "m", 2),
            Cell::number(losses[0], "", 3),
            Cell::number(losses[1], "", 3),
        ]);
        let fewer = landscape.first(curves - 1).map_err(ExperimentError::failed)?;
        noticed &= fewer.curves().len() as u32 != row.features && damaged(&landscape, &bytes);
    }
    if compared.verdict() != Verdict::Reproduced {
        outcome.set_verdict(compared.verdict(), "a count or a size lies outside of its tolerance");
    }
    // Rounding of the sums that make a step.
    if lossy > 1.0 + 1e-6 {
        outcome.set_verdict(Verdict::Partial, format!("the compact form moves something by {lossy} halves of a step"));
    }
    outcome.table(compared.into_table())?;
    outcome.table(table)?;
    outcome.metric("largest_loss_of_half_a_step", lossy)?;
    outcome.control(
        "a damaged file",
        "one way-point's high byte changed in each compact file; a landscape without its last curve",
        "the way-point is off by more than half a step, or the file is refused; the count differs",
        noticed,
    );
    outcome.deviation(
        "the paper's scenes and their file format",
        "landscapes of the same subjects and numbers of curves, in a compact form of our own: 16 bits a number",
    );
    Ok(outcome)
}

/// Whether a change of the last bytes of a file is noticed.
fn damaged(landscape: &Landscape, bytes: &[u8]) -> bool {
    // Any byte of a coordinate will do: from the end backwards, the first whose change leaves a file that can be read.
    (0..bytes.len()).rev().take(400).any(|k| {
        let mut other = bytes.to_vec();
        other[k] ^= 0x40;
        Landscape::from_compact(&other).is_ok_and(|back| loss(landscape, &back).into_iter().any(|loss| loss > 2.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_back_moves_no_curve_by_more_than_half_a_step() {
        let landscape = load("desert").unwrap();
        let bytes = landscape.to_compact().unwrap();
        let losses = loss(&landscape, &Landscape::from_compact(&bytes).unwrap());
        assert!(losses.iter().all(|loss| *loss > 0.0 && *loss < 1.0 + 1e-6), "{losses:?}");
        assert!(damaged(&landscape, &bytes));
    }
}
