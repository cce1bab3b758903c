//! From a thousand primitives to a million: the grid of lists beside the paper's tree of boxes and beside no index at all, and
//! what one more stroke costs.

use super::bvh::Bvh;
use super::{benagil, scenes};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use glam::DVec3;
use std::time::Instant;
use terrain_amplify::brush::Sculpture;
use terrain_amplify::implicit::index::Index;
use terrain_amplify::implicit::primitive::Primitive;
use terrain_amplify::polygonize::Polygonizer;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/scaling",
    title: "Scaling to a million primitives, and editing",
    section: "§6, §8.2",
    about: "Sums of compact primitives at random points within 2 m of a heightfield, supports overlapping about threefold, one \
            thread: from lists by cell, from the paper's tree of bounding boxes, and from all primitives. Sums are compared to the \
            bit. Then the last strokes of the sea cave of Fig. 25, each drawn and the mesh mended where it changed, as a user waits \
            for it; the mended mesh is compared with one made of the whole.",
    code: "experiments/src/paris2019/scaling.rs",
    test: "experiments/src/paris2019/bvh.rs::the_tree_leaves_out_nothing_and_little_is_looked_at",
    expected: |profile| Expected { seconds: profile.pick(8.0, 30.0), memory_bytes: 1 << 30, disk_bytes: 32 << 10 },
    run,
};

const COUNTS: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Points whose sums are compared to the bit.
const COMPARED: usize = 200;
/// Values of single primitives that are spent on sums over all of them.
const ALL: usize = 6_000_000;
/// Primitives of an inserted stroke.
const STROKE: usize = 24;
/// By how much a query may look at more of a million than of a thousand. Primitives are as dense in each terrain, so nothing grows but
/// the share of points away from the rim: on a side of 118 m, 16 % lie within the largest radius, 5 m, of it and miss about half.
const GROWTH: f64 = 1.1;
/// A mended cave takes no longer than this, seconds: what feels immediate.
const IMMEDIATE: f64 = 0.1;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut wrong = 0;
    let queries = ctx.profile.pick(50_000, 1_000_000);
    let mut work = Table::new("index", "What a query looks at, and what an index weighs")
        .column("primitives")
        .column("covering a query")
        .column("by lists: primitives")
        .column("by boxes: primitives")
        .column("by boxes: boxes")
        .column("lists, bytes a primitive")
        .column("boxes, bytes a primitive");
    let mut speed = Table::new("speed", "Sums a second on one thread, and the time to build and to add a stroke of 24")
        .column("primitives")
        .machine_column("lists")
        .machine_column("boxes")
        .machine_column("all")
        .machine_column("lists built in")
        .machine_column("boxes built in")
        .machine_column("a stroke added in");
    let (mut by_lists, mut by_boxes) = (Vec::new(), Vec::new());
    let progress = ctx.progress("terrains", COUNTS.len() as u64);
    for count in COUNTS {
        let terrain = scenes::scattered(count, ctx.seed as u32)?;
        let (_, index) = scenes::parts(&terrain)?;
        let points = scenes::near_surface(queries, scenes::side(count), ctx.seed as u32 ^ 1);
        let all = index.primitives();
        let (mut lists, built) = timed(|| Index::new(all.to_vec()));
        let lists = lists.as_mut().map_err(|k| ExperimentError::failed(format!("primitive {k} is not sound")))?;
        let (tree, tree_built) = timed(|| Bvh::new(all));

        wrong += points.iter().take(COMPARED).filter(|&&p| !agree(all, lists, &tree, p)).count();
        let of = f64::from(queries);
        let near = points.iter().map(|&p| lists.near(p).count()).sum::<usize>() as f64 / of;
        let covering = |p: DVec3| lists.near(p).filter(|&k| all[k as usize].value(p) != 0.0).count();
        let hit = points.iter().map(|&p| covering(p)).sum::<usize>() as f64 / of;
        let mut in_leaves = 0u64;
        let boxes = points.iter().map(|&p| tree.near(p, |_| in_leaves += 1)).sum::<u64>() as f64 / of;
        let in_leaves = in_leaves as f64 / of;

        let best = |points: &[DVec3], value: &dyn Fn(DVec3) -> f64| {
            let pass = || timed(|| points.iter().map(|&p| value(p)).sum::<f64>()).1;
            points.len() as f64 / (0..3).map(|_| pass()).fold(f64::INFINITY, f64::min)
        };
        let of_lists = best(&points, &|p| lists.value(p));
        let of_boxes = best(&points, &|p| {
            let mut sum = 0.0;
            tree.near(p, |k| sum += all[k as usize].value(p));
            sum
        });
        let few = &points[..(ALL / count / 3).clamp(1, points.len())];
        let of_all = best(few, &|p| all.iter().map(|one| one.value(p)).sum());
        // The stroke lies where others do: the lists there are the longest.
        let stroke = all[..STROKE].to_vec();
        let (inserted, added) = timed(|| lists.insert(&stroke));
        inserted.map_err(|k| ExperimentError::failed(format!("primitive {k} of a stroke is not sound")))?;

        let bytes = [index.bytes()[1], tree.bytes()].map(|bytes| bytes as f64 / count as f64);
        let name = |what: &str| format!("n{count}.{what}");
        outcome.metric(&name("lists.primitives_per_query"), near)?;
        outcome.metric(&name("boxes.primitives_per_query"), in_leaves)?;
        outcome.metric(&name("boxes.boxes_per_query"), boxes)?;
        outcome.metric(&name("lists.bytes_per_primitive"), bytes[0])?;
        outcome.metric(&name("boxes.bytes_per_primitive"), bytes[1])?;
        outcome.timing(&name("lists.queries_per_second"), of_lists)?;
        outcome.timing(&name("boxes.queries_per_second"), of_boxes)?;
        outcome.timing(&name("all.queries_per_second"), of_all)?;
        outcome.timing(&name("lists.build_seconds"), built)?;
        outcome.timing(&name("boxes.build_seconds"), tree_built)?;
        outcome.timing(&name("insert_seconds"), added)?;
        let mut row = vec![Cell::count(count as u64)];
        row.extend([hit, near, in_leaves, boxes, bytes[0], bytes[1]].map(|x| Cell::number(x, "", 3)));
        work.row(row);
        let mut row = vec![Cell::count(count as u64)];
        row.extend([of_lists, of_boxes, of_all].map(|x| Cell::number(x / 1e6, "M/s", 3)));
        row.extend([built, tree_built, added].map(|x| Cell::number(1e3 * x, "ms", 3)));
        speed.row(row);
        by_lists.push((count as f64, near));
        by_boxes.push((count as f64, boxes + in_leaves));
        progress.advance(1);
    }
    outcome.table(work)?;
    outcome.table(speed)?;
    let growth = |work: &[(f64, f64)]| work[work.len() - 1].1 / work[0].1;
    let (grown, of_tree) = (growth(&by_lists), growth(&by_boxes));
    outcome.metric("lists.growth_of_work", grown)?;
    outcome.metric("boxes.growth_of_work", of_tree)?;
    let plot = Plot::new("work", "Boxes and primitives looked at", Axis::log("primitives"), Axis::linear("a query"));
    outcome.plot(plot.series("lists by cell", Style::LineAndPoints, by_lists).series(
        "tree of boxes",
        Style::LineAndPoints,
        by_boxes,
    ))?;
    outcome.metric("wrong_values", wrong as f64)?;
    let terrain = scenes::scattered(COUNTS[0], ctx.seed as u32)?;
    let (_, index) = scenes::parts(&terrain)?;
    let points = scenes::near_surface(100, scenes::side(COUNTS[0]), ctx.seed as u32 ^ 1);
    let lost = noticed(index.primitives(), &points)?;
    outcome.control(
        "lost primitives",
        "those that cover a point left out of the lists, or of the tree",
        "sums differ",
        lost,
    );
    outcome.control("a tree for the lists", "the growth of the tree's work", "it is above the limit", of_tree > GROWTH);
    let median = edits(ctx, &mut outcome)?;
    if wrong > 0 {
        outcome.set_verdict(Verdict::NotReproduced, format!("{wrong} sums differ from those over all primitives"));
    } else if grown > GROWTH {
        outcome.set_verdict(Verdict::NotReproduced, format!("a query looks at {grown} times as much of a million"));
    } else if median.is_none() {
        outcome.set_verdict(Verdict::NotReproduced, "the mended mesh of the cave is not that of the whole");
    } else if let Some(seconds) = median.filter(|seconds| *seconds > IMMEDIATE) {
        outcome.set_verdict(Verdict::Partial, format!("a stroke takes {seconds} s"));
    }
    Ok(outcome)
}

fn timed<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let made = f();
    (made, start.elapsed().as_secs_f64())
}

/// Are the sums at `p` from the lists and from the tree, each in the order of the primitives, that of all of them?
fn agree(all: &[Primitive], lists: &Index, tree: &Bvh, p: DVec3) -> bool {
    let whole = all.iter().fold(0.0, |sum, one| sum + one.value(p));
    let mut found = Vec::new();
    tree.near(p, |k| found.push(k));
    found.sort_unstable();
    let by_tree = found.iter().fold(0.0, |sum, &k| sum + all[k as usize].value(p));
    lists.value(p) == whole && by_tree == whole
}

/// Does the comparison notice lists, and does it notice a tree, that lack one primitive of those that cover its points?
fn noticed(all: &[Primitive], points: &[DVec3]) -> Result<bool, ExperimentError> {
    let covering = |p: &&DVec3| all.iter().any(|one| one.value(**p) != 0.0);
    let Some(&p) = points.iter().find(covering) else { return Ok(false) };
    let mut lost = all.to_vec();
    lost.retain(|one| one.value(p) == 0.0);
    let lists = |of: &[Primitive]| {
        Index::new(of.to_vec()).map_err(|k| ExperimentError::failed(format!("primitive {k} is not sound")))
    };
    let (whole, tree) = (lists(all)?, Bvh::new(all));
    let fair = agree(all, &whole, &tree, p);
    Ok(fair && !agree(all, &lists(&lost)?, &tree, p) && !agree(all, &whole, &Bvh::new(&lost), p))
}

/// The last strokes of the cave, one after the other; the median of their seconds, `None` when the mended mesh is not that of the
/// whole.
fn edits(ctx: &Context, outcome: &mut Outcome) -> Result<Option<f64>, ExperimentError> {
    let strokes = benagil::strokes()?;
    let last = ctx.profile.pick(40, 150);
    let (before, drawn) = strokes.split_at(strokes.len() - last);
    let mut sculpture = Sculpture::new(benagil::ground()?);
    for stroke in before {
        sculpture.draw(stroke.clone()).map_err(ExperimentError::failed)?;
    }
    let (lattice, tolerance) = (benagil::lattice()?, 1e-2);
    let volume = sculpture.volume();
    let mesher = Polygonizer::new(&volume, lattice, tolerance).map_err(ExperimentError::failed)?;
    let (mut pieces, whole) = timed(|| mesher.pieces());
    // A volume that is still held would make the first stroke copy the index.
    drop(volume);
    let cells = pieces.report().cells;
    let mut seconds = Vec::new();
    let mut stale = None;
    for (k, stroke) in drawn.iter().enumerate() {
        if k + 1 == last {
            stale = Some(pieces.clone());
        }
        let start = Instant::now();
        let changed = sculpture.draw(stroke.clone()).map_err(ExperimentError::failed)?;
        let volume = sculpture.volume();
        let mesher = Polygonizer::new(&volume, lattice, tolerance).map_err(ExperimentError::failed)?;
        mesher.mend(&mut pieces, &changed);
        seconds.push(start.elapsed().as_secs_f64());
    }
    let share = (pieces.report().cells - cells) as f64 / (cells * last as u64) as f64;
    let (mended, joined) = timed(|| pieces.mesh());
    let volume = sculpture.volume();
    let mesher = Polygonizer::new(&volume, lattice, tolerance).map_err(ExperimentError::failed)?;
    let (fresh, _) = mesher.sparse().map_err(ExperimentError::failed)?;
    let differs = mended.map_err(ExperimentError::failed)? != fresh;
    let stale = stale.map(|pieces| pieces.mesh()).transpose().map_err(ExperimentError::failed)?;
    let stale = stale.is_some_and(|stale| stale != fresh);
    outcome.control("a stroke that is not mended", "the pieces before the last stroke", "the meshes differ", stale);
    seconds.sort_by(f64::total_cmp);
    let (median, longest) = (seconds[last / 2], seconds[last - 1]);
    outcome.metric("edit.strokes", last as f64)?;
    outcome.metric("edit.mean_share_of_cubes", share)?;
    outcome.metric("edit.meshes_that_differ", f64::from(u8::from(differs)))?;
    outcome.timing("edit.seconds_median", median)?;
    outcome.timing("edit.seconds_longest", longest)?;
    outcome.timing("edit.seconds_whole", whole)?;
    let mut table = Table::new("edits", "A stroke in the sea cave, drawn and its mesh mended")
        .column("strokes")
        .column("share of the cubes looked at")
        .machine_column("median")
        .machine_column("longest")
        .machine_column("the whole mesh made again")
        .machine_column("pieces joined to one mesh");
    let mut row = vec![Cell::count(last as u64), Cell::number(share, "", 2)];
    row.extend([median, longest, whole, joined].map(|x| Cell::number(1e3 * x, "ms", 3)));
    table.row(row);
    outcome.table(table)?;
    Ok((!differs).then_some(median))
}
