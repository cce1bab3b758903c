//! Bytes of construction trees against those of the same field as material stacks.

use super::{benagil, scenes};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use glam::DVec3;
use std::time::Instant;
use terrain_amplify::field::Box3;
use terrain_amplify::geology::{Archetype, Geology};
use terrain_amplify::implicit::index::Index;
use terrain_amplify::implicit::volume::Volume;
use terrain_amplify::stacks::Stacks;
use terrain_papers::tables::paris2019_table1;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/stacks",
    title: "Memory against material stacks",
    section: "§8.3–8.4, Table 1",
    about: "The paper finds two orders of magnitude less memory than material stacks (Arches) at the same precision. Here one field \
            is both: its primitives at 36 bytes each, and columns of layers at 5 bytes each and 4 for the column, tops within 0.1 m \
            of the transitions of f − T. Like the paper, trees are counted without the ground; with index and ground they stand \
            beside. Stacks hold the ground. Materials are compared with the field at random points.",
    code: "experiments/src/paris2019/stacks.rs",
    test: "amplify/src/stacks/tests.rs::materials_are_those_of_the_field_farther_than_the_precision_from_a_transition",
    expected: |profile| Expected {
        seconds: profile.pick(5.0, 15.0),
        memory_bytes: profile.pick(256, 512) << 20,
        disk_bytes: 16 << 10,
    },
    run,
};

/// How exactly tops are known: the paper's precision, metres.
const PRECISION: f64 = 0.1;
/// The ratio that the prose states.
const CLAIMED: f64 = 100.0;
/// Classes of rock where stacks store it by resistance.
const CLASSES: u8 = 4;

/// A field to convert. Its region begins above the solid's floor, so that a column of bare ground is one layer.
struct Scene {
    name: &'static str,
    volume: Volume,
    region: Box3,
    spacing: f64,
    geology: Option<Geology>,
}

fn scenes(ctx: &Context) -> Result<Vec<Scene>, ExperimentError> {
    let count = 13_264;
    let side = scenes::side(count);
    let volume = scenes::scattered(count, ctx.seed as u32)?;
    let region = Box3::new(DVec3::new(0.0, 0.0, -20.0), DVec3::new(side, side, 20.0));
    let carved = |name, spacing| Scene { name, volume: volume.clone(), region, spacing, geology: None };
    let mut all = vec![carved("carved_13264_4m", 4.0), carved("carved_13264_2m", 2.0), carved("carved_13264", 1.0)];
    if ctx.profile.pick(false, true) {
        all.push(carved("carved_13264_05m", 0.5));
    }
    let geology = Some(Archetype::HorizontalStrata.geology());
    all.push(Scene { geology, ..carved("carved_13264_8m_strata", 8.0) });
    let [nx, _, _] = benagil::lattice()?.cells();
    let region = Box3::new(DVec3::new(0.0, 0.0, -20.0), DVec3::new(benagil::SIDE, benagil::SIDE, 40.0));
    let spacing = benagil::SIDE / nx as f64 * ctx.profile.pick(2.0, 1.0);
    let name = ctx.profile.pick("benagil_half", "benagil");
    all.push(Scene { name, volume: benagil::volume()?, region, spacing, geology: None });
    Ok(all)
}

/// a: the share of columns in the vertical projection of a primitive, the paper's n(p) > 1.
fn coverage(stacks: &Stacks, index: &Index) -> f64 {
    let [nx, ny] = stacks.columns();
    let mut covered = vec![false; nx * ny];
    let low = stacks.position(0, 0);
    for one in index.primitives() {
        let support = one.support();
        let (from, to) =
            ((support.low.truncate() - low) / stacks.spacing(), (support.high.truncate() - low) / stacks.spacing());
        for j in from.y.ceil().max(0.0) as usize..(to.y.floor().max(-1.0) + 1.0).min(ny as f64) as usize {
            for i in from.x.ceil().max(0.0) as usize..(to.x.floor().max(-1.0) + 1.0).min(nx as f64) as usize {
                let at = stacks.position(i, j);
                let column = Box3 { low: at.extend(support.low.z), high: at.extend(support.high.z) };
                covered[j * nx + i] |= one.meets(&column);
            }
        }
    }
    covered.iter().filter(|c| **c).count() as f64 / covered.len() as f64
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("stacks", "One field as a tree and as stacks, tops within 0.1 m")
        .column("scene")
        .column("between columns")
        .column("classes of rock")
        .column("a, primitives over ground")
        .column("rock over air over rock")
        .column("layers a column")
        .column("stacks")
        .column("stacks, bytes a column")
        .column("tree without ground")
        .column("ratio")
        .column("with index and ground")
        .column("ratio")
        .column("enclosures")
        .column("values of f")
        .column("unresolved cells")
        .machine_column("converted in");
    let scenes = scenes(ctx)?;
    let progress = ctx.progress("scenes", scenes.len() as u64);
    let (mut wrong, mut ratios) = (Vec::new(), Vec::new());
    for Scene { name, volume, region, spacing, geology } in &scenes {
        let classes = geology.as_ref().map(|geology| (geology, CLASSES));
        let start = Instant::now();
        let (stacks, report) =
            Stacks::convert(volume, region, *spacing, PRECISION, classes).map_err(ExperimentError::failed)?;
        let seconds = start.elapsed().as_secs_f64();
        if let Err(fault) = stacks.check() {
            wrong.push(format!("{name}: {fault}"));
        }
        let size = region.high - region.low;
        let random = |k: u32| DVec3::from_array([0, 1, 2].map(|j| scenes::uniform(ctx.seed as u32 ^ 3, 3 * k + j)));
        let found = stacks.compare(volume, geology.as_ref(), (0..20_000).map(|k| region.low + size * random(k)));
        if found.wrong > 0 || found.compared < 15_000 {
            wrong.push(format!("{name}: {found:?}"));
        }
        let (ground, index) = scenes::parts(volume)?;
        let [own, beside] = index.bytes();
        let Volume::Ground(surface, _) = ground else { return Err(ExperimentError::failed("no ground")) };
        let all = own + beside + surface.bytes().iter().sum::<usize>();
        let [nx, ny] = stacks.columns();
        let columns = (nx * ny) as f64;
        let (bytes, overhang) = (stacks.bytes() as f64, stacks.overhangs() as f64 / columns);
        let (ratio, covered) = (bytes / own as f64, coverage(&stacks, index));
        if geology.is_none() {
            ratios.push((*name, *spacing, ratio));
        }
        for (metric, value) in [
            ("stacks_bytes", bytes),
            ("tree_bytes", own as f64),
            ("bytes_ratio", ratio),
            ("tree_bytes_with_index_and_ground", all as f64),
            ("bytes_ratio_with_index_and_ground", bytes / all as f64),
            ("overhang_share", overhang),
            ("coverage", covered),
            ("layers_per_column", stacks.layer_count() as f64 / columns),
            ("enclosures", report.enclosures as f64),
            ("evaluations", report.evaluations as f64),
            ("unresolved_cells", report.unresolved as f64),
            ("compared", found.compared as f64),
            ("wrong", found.wrong as f64),
        ] {
            outcome.metric(&format!("{name}.{metric}"), value)?;
        }
        outcome.timing(&format!("{name}.seconds"), seconds)?;
        let megabytes = |bytes: f64| Cell::number(bytes / 1e6, "MB", 3);
        table.row([
            Cell::from(*name),
            Cell::number(*spacing, "m", 3),
            Cell::count(if geology.is_some() { u64::from(CLASSES) } else { 1 }),
            Cell::number(covered, "", 3),
            Cell::number(overhang, "", 3),
            Cell::number(stacks.layer_count() as f64 / columns, "", 3),
            megabytes(bytes),
            Cell::number(bytes / columns, "", 3),
            megabytes(own as f64),
            Cell::number(ratio, "", 3),
            megabytes(all as f64),
            Cell::number(bytes / all as f64, "", 3),
            Cell::count(report.enclosures),
            Cell::count(report.evaluations),
            Cell::count(report.unresolved),
            Cell::number(seconds, "s", 3),
        ]);
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.table(paper()?)?;
    outcome.control(
        "a lost primitive",
        "stacks of a terrain of 1,000 against the field without the last",
        "some material differs",
        lost(ctx)?,
    );
    outcome.deviation(
        "spacing and bytes of a layer of the paper's stacks",
        "columns of a stated spacing; five bytes a layer and four a column, less than a list or a padded layer takes",
    );
    outcome.deviation(
        "what the precision of stacks is across the ground",
        "0.1 m along columns alone; columns as dense would be (spacing / 0.1 m)² as many",
    );
    judge(&mut outcome, &wrong, &ratios);
    Ok(outcome)
}

/// Table 1's memory, with the bytes that a column of the printed grid would take.
fn paper() -> Result<Table, ExperimentError> {
    let mut table = Table::new("paper", "The paper's own memory, from its Table 1")
        .column("scene")
        .column("a")
        .column("nodes")
        .column("ours")
        .column("ours, bytes a node")
        .column("Arches")
        .column("ratio")
        .column("Arches, bytes a column of the grid");
    for row in &paris2019_table1()?.rows {
        let columns = f64::from(row.grid[0]) * f64::from(row.grid[1]);
        table.row([
            Cell::from(row.scene.as_str()),
            Cell::number(row.coverage, "", 2),
            Cell::count(row.nodes.into()),
            Cell::number(row.megabytes, "MB", 2),
            Cell::number(row.bytes_per_node(), "", 3),
            Cell::number(row.arches_megabytes, "MB", 3),
            Cell::number(row.memory_ratio(), "", 3),
            Cell::number(row.arches_megabytes * 1e6 / columns, "", 3),
        ]);
    }
    Ok(table)
}

/// Is it noticed that a field has lost a primitive that its stacks have?
fn lost(ctx: &Context) -> Result<bool, ExperimentError> {
    let volume = scenes::scattered(1_000, ctx.seed as u32)?;
    let side = scenes::side(1_000);
    let region = Box3::new(DVec3::new(0.0, 0.0, -20.0), DVec3::new(side, side, 20.0));
    let (stacks, _) = Stacks::convert(&volume, &region, 1.0, PRECISION, None).map_err(ExperimentError::failed)?;
    let (ground, index) = scenes::parts(&volume)?;
    let mut fewer = index.primitives().to_vec();
    let Some(gone) = fewer.pop() else { return Ok(false) };
    let support = gone.support();
    let fewer = Volume::terrain(ground.clone(), fewer)
        .map_err(|k| ExperimentError::failed(format!("primitive {k} is not sound")))?;
    let points = (0..32_768u32).map(|k| {
        let t = [k % 32, k / 32 % 32, k / 1024].map(|k| f64::from(k) / 31.0);
        support.low + (support.high - support.low) * DVec3::from_array(t)
    });
    let points: Vec<DVec3> = points.collect();
    let right = stacks.compare(&volume, None, points.iter().copied());
    let other = stacks.compare(&fewer, None, points);
    Ok(right.wrong == 0 && other.wrong > 0)
}

fn judge(outcome: &mut Outcome, wrong: &[String], ratios: &[(&str, f64, f64)]) {
    if let Some(why) = wrong.first() {
        return outcome.set_verdict(Verdict::NotReproduced, why.clone());
    }
    if let Some((name, _, ratio)) = ratios.iter().find(|(_, spacing, ratio)| *spacing <= 1.0 && *ratio <= 1.0) {
        return outcome
            .set_verdict(Verdict::NotReproduced, format!("{name}: stacks take {ratio:.2} times the tree's bytes"));
    }
    let Some((_, spacing, ratio)) = ratios.iter().find(|(name, ..)| *name == "carved_13264") else { return };
    if *ratio < CLAIMED {
        // Bytes go with the number of columns.
        let needed = spacing * (ratio / CLAIMED).sqrt();
        let why = format!(
            "stacks take {ratio:.2} times the tree's bytes at {spacing} m between columns; two orders of magnitude need columns \
             {needed:.2} m apart. The paper's own rows range from 1.6 to 100, its scenes are not published"
        );
        outcome.set_verdict(Verdict::Partial, why);
    }
}
