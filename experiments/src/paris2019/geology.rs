//! Vertical sections of resistance through each archetype of rock.

use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Picture, Table};
use glam::DVec3;
use rayon::prelude::*;
use terrain_amplify::field::Box3;
use terrain_amplify::geology::{Archetype, Geology};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/geology",
    title: "Resistance of rock",
    section: "§4, Figs. 3 and 4",
    about: "Five archetypes of geology, cut by the plane y = 0: strata, folds, faults, caves of karst and sandstone with a hard layer. \
            Pale rock resists, dark rock erodes. As printed resistances leave [0, 1] when trees are summed; here each section is \
            enclosed, box by box, and every value lies within its enclosure.",
    code: "experiments/src/paris2019/geology.rs",
    test: "amplify/src/geology/tests.rs::any_tree_keeps_its_range_enclosure_and_slope",
    expected: |profile| Expected {
        seconds: profile.pick(2.0, 8.0),
        memory_bytes: 64 << 20,
        disk_bytes: profile.pick(1, 4) << 20,
    },
    run,
};

/// The section's width and height, metres.
const SIZE: [f64; 2] = [200.0, 120.0];
/// Pixels a side of the boxes that are enclosed.
const BOX: usize = 10;

/// From dark to pale rock.
fn colour(resistance: f64) -> [u8; 3] {
    let (dark, pale) = ([72.0, 52.0, 44.0], [240.0, 226.0, 200.0]);
    [0, 1, 2].map(|k| (dark[k] + (pale[k] - dark[k]) * resistance).round() as u8)
}

struct Section {
    values: Vec<f64>,
    outside: usize,
    shifted_outside: usize,
}

/// The values of a section `width` pixels wide, and how many lie outside the enclosure of their box; also how many would,
/// were each 0.3 larger.
fn section(geology: &Geology, width: usize, height: usize) -> Section {
    let pixel = SIZE[0] / width as f64;
    let at = |i: usize, j: usize| {
        DVec3::new((i as f64 + 0.5) * pixel - 0.5 * SIZE[0], 0.0, 0.5 * SIZE[1] - (j as f64 + 0.5) * pixel)
    };
    let values: Vec<f64> =
        (0..width * height).into_par_iter().map(|k| geology.value(at(k % width, k / width))).collect();
    let boxes: Vec<(usize, usize)> = (0..height / BOX).flat_map(|j| (0..width / BOX).map(move |i| (i, j))).collect();
    let [outside, shifted_outside] = boxes
        .into_par_iter()
        .map(|(bi, bj)| {
            let (i0, j0) = (bi * BOX, bj * BOX);
            let range = geology.bounds(&Box3::new(at(i0, j0), at(i0 + BOX - 1, j0 + BOX - 1))).range;
            let inside = (0..BOX * BOX).map(|k| values[(j0 + k / BOX) * width + i0 + k % BOX]);
            inside.fold([0, 0], |[a, b], v| {
                [a + usize::from(!range.contains(v)), b + usize::from(!range.contains(v + 0.3))]
            })
        })
        .reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]);
    Section { values, outside, shifted_outside }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let width = ctx.profile.pick(500, 1_000);
    let height = (width as f64 * SIZE[1] / SIZE[0]) as usize / BOX * BOX;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("sections", "Resistance over a section of 200 m by 120 m")
        .column("archetype")
        .column("lowest")
        .column("mean")
        .column("highest")
        .column("outside their enclosure");
    let progress = ctx.progress("archetypes", Archetype::ALL.len() as u64);
    let (mut outside, mut shifted) = (0, 0);
    for archetype in Archetype::ALL {
        let section = section(&archetype.geology(), width, height);
        let low = section.values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = section.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = section.values.iter().sum::<f64>() / section.values.len() as f64;
        let rgb: Vec<u8> = section.values.iter().flat_map(|&v| colour(v)).collect();
        let png = ctx.write_png(archetype.name(), width as u32, height as u32, &rgb)?;
        outcome.picture(Picture::new(png, archetype.name()).camera("section y = 0, 200 m by 120 m"));
        outcome.metric(&format!("{}.lowest", archetype.name()), low)?;
        outcome.metric(&format!("{}.highest", archetype.name()), high)?;
        table.row([
            Cell::from(archetype.name()),
            Cell::number(low, "", 3),
            Cell::number(mean, "", 3),
            Cell::number(high, "", 3),
            Cell::count(section.outside as u64),
        ]);
        outside += section.outside + usize::from(!(low >= 0.0 && high <= 1.0));
        shifted += section.shifted_outside;
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.metric("values_outside", outside as f64)?;
    outcome.control("larger by 0.3", "every value raised by 0.3", "some leave their enclosure", shifted > 0);
    outcome.deviation("the parameters of the figures' trees", "archetypes of our own in the paper's words");
    if outside > 0 {
        outcome.set_verdict(Verdict::NotReproduced, format!("{outside} values outside their enclosure or [0, 1]"));
    }
    Ok(outcome)
}
