//! Three ways to the same length of edges: bisected triangles, patches of the raster as the paper cuts them, and the quadtree of
//! Génevaux 2015 §8.2.

use super::scenes::{detail, looking, mountain};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::Hash;
use terrain_gpu::tessellate::census::Census;
use terrain_gpu::tessellate::coverage::Corners;
use terrain_gpu::tessellate::displace::Space;
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::patches::{Partition, Patches};
use terrain_gpu::tessellate::quadtree;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::FINEST;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/variants",
    title: "Bisection, patches and quadtree",
    section: "§6; Génevaux 2015 §8.2",
    about: "The same ground, detail, cameras and wanted edges; three cameras together. Patches are the cells of the raster, each edge cut \
            by its length on the screen over the wanted one, into equal pieces or into ones that grow from nothing, 64 at most, and \
            stitched inside, as the stages of the graphics pipeline do. The quadtree splits cells by distance, neighbours differ by one \
            level, fans have corners for them. Triangles are those left by culling; cracks are counted over the whole domain; edges are \
            those with an end in the image, displaced, over the target. Controls: bisection with every second radius × 0.6, one factor \
            a patch, fans without corners for their neighbours.",
    code: "experiments/src/tessellation/variants.rs",
    test: "gpu/src/tessellate/patches.rs::patches_with_factors_by_edge_meet_and_those_with_one_factor_each_do_not",
    expected: |profile| Expected {
        seconds: profile.pick(9.0, 120.0),
        memory_bytes: profile.pick(1 << 30, 6 << 30),
        disk_bytes: 64 << 10,
    },
    run,
};

const NAMES: [&str; 4] = ["bisection", "patches, equal pieces", "patches, growing pieces", "quadtree"];
const IDS: [&str; 4] = ["bisection", "patches_integer", "patches_fractional", "quadtree"];

/// What one variant needs for one camera.
#[derive(Clone, Copy, Default)]
struct Found {
    triangles: u64,
    /// Of these, those with a corner in the image.
    seen: u64,
    edges: u64,
    within: u64,
    /// Sum of log₂ of lengths over the target.
    log: f64,
    cracks: u64,
    broken: u64,
    /// Edges of patches, and those that are cut into the most pieces there are and are still too long.
    patch_edges: [u64; 2],
}

impl Found {
    fn plus(self, other: Found) -> Found {
        Found {
            triangles: self.triangles + other.triangles,
            seen: self.seen + other.seen,
            edges: self.edges + other.edges,
            within: self.within + other.within,
            log: self.log + other.log,
            cracks: self.cracks + other.cracks,
            broken: self.broken + other.broken,
            patch_edges: [0, 1].map(|k| self.patch_edges[k] + other.patch_edges[k]),
        }
    }
    /// Triangles, and lengths of their edges.
    fn of(refinement: &Refinement<'_>, triangles: impl Iterator<Item = Corners>) -> Found {
        let (view, mut found) = (refinement.view(), Found::default());
        for corners in triangles {
            found.triangles += 1;
            let seen = corners.map(|p| view.sees(p));
            found.seen += u64::from(seen.contains(&true));
            for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(i, j)| seen[*i] || seen[*j]) {
                let (mut length, mut distance) = (0.0, 0.0);
                for k in 0..3 {
                    let (along, off) =
                        (corners[i][k] - corners[j][k], (corners[i][k] + corners[j][k]) / 2.0 - view.eye[k]);
                    length += along * along;
                    distance += off * off;
                }
                let ratio = (length / distance).sqrt() * view.focal / refinement.target();
                found.edges += 1;
                found.within += u64::from((0.5..=2.0).contains(&ratio));
                found.log += libm::log2(ratio.max(1e-9));
            }
        }
        found
    }
}

/// Triangles by names of their corners, each corner computed once.
fn placed<K: Copy + Eq + Hash>(triangles: Vec<[K; 3]>, place: impl Fn(K) -> [f64; 3]) -> impl Iterator<Item = Corners> {
    let mut known: HashMap<K, [f64; 3]> = HashMap::with_capacity(triangles.len() / 2);
    let all: Vec<Corners> = triangles
        .into_iter()
        .map(|corners| corners.map(|corner| *known.entry(corner).or_insert_with(|| place(corner))))
        .collect();
    all.into_iter()
}

/// One of [`NAMES`]; with a census of the whole domain and of its control if `whole`.
fn variant(refinement: &mut Refinement<'_>, which: usize, whole: bool) -> Found {
    let refined = &*refinement;
    match which {
        0 => {
            let leaves = refined.leaves(true);
            let mut found = Found::of(refined, leaves.iter().flat_map(|leaf| refined.patch(leaf)));
            if whole {
                found.cracks = Census::of(&refined.leaves(false), refined.ground().end()).cracks as u64;
                let radii = refined.radii().to_vec();
                refinement.radii_mut().iter_mut().skip(1).step_by(2).for_each(|radius| *radius *= 0.6);
                found.broken = Census::of(&refinement.leaves(false), refinement.ground().end()).cracks as u64;
                refinement.radii_mut().copy_from_slice(&radii);
            }
            found
        }
        3 => {
            let triangles = quadtree::triangles(refined, true, true);
            let mut found = Found::of(refined, placed(triangles, |vertex| refined.position(vertex)));
            if whole {
                let census = |stitched| {
                    Census::of_triangles(quadtree::triangles(refined, false, stitched), refined.ground().end()).cracks
                };
                (found.cracks, found.broken) = (census(true) as u64, census(false) as u64);
            }
            found
        }
        _ => {
            let partition = if which == 1 { Partition::Integer } else { Partition::Fractional };
            let patches = Patches::new(refined, partition);
            let mut found = Found::of(refined, placed(patches.triangles(true), |corner| patches.position(corner)));
            if whole {
                found.cracks = patches.cracks() as u64;
            }
            let [columns, rows] = refined.ground().inside().map(|n| n as u32);
            for at in (0..columns * rows).map(|k| [k % columns, k / columns]) {
                for axis in 0..2 {
                    found.patch_edges[0] += 1;
                    found.patch_edges[1] += u64::from(patches.factor(at, axis).1);
                }
            }
            if whole {
                found.broken = patches.by_patch().cracks() as u64;
            }
            found
        }
    }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let ground = Ground::new(&mountain(ctx.profile.pick(65, 129))?, 0.6).map_err(ExperimentError::failed)?;
    let frame = ctx.profile.pick([480, 270], [1920, 1080]);
    let six = detail(&ground, 3.0, Space::Volume)?;
    let views = [
        looking((&ground, &six), [0.325, 0.1875, 400.0], [0.5375, 0.525, 100.0], frame)?,
        looking((&ground, &six), [0.42, 0.36, 10.0], [0.515, 0.60, 60.0], frame)?,
        looking((&ground, &six), [0.10, 0.10, 900.0], [0.50, 0.50, 0.0], frame)?,
    ];
    let targets = [32.0, 16.0, 8.0, 4.0];
    // Cracks do not depend on the edge's length: they are counted where there are fewest triangles.
    let counted = ctx.profile.pick(2, 3);
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("variants", "Three cameras together")
        .column("edge")
        .column("variant")
        .column("triangles")
        .column("with a corner in the image")
        .column("these, over bisection")
        .column("edges within a factor 2")
        .column("geometric mean of edges, in targets")
        .column("patch edges that 64 pieces do not suffice")
        .column("cracks")
        .column("cracks of its control");
    let mut series: [Vec<(f64, f64)>; 4] = Default::default();
    let (mut cracks, mut broken) = (0, [0; 4]);
    let progress = ctx.progress("variants", 16);
    for (at, &target) in targets.iter().enumerate() {
        let jobs: Vec<(usize, usize)> =
            (0..4).flat_map(|which| (0..views.len()).map(move |view| (which, view))).collect();
        let each: Vec<Found> = jobs
            .par_iter()
            .map(|(which, view)| {
                let mut refinement = Refinement::new(&ground, &six, views[*view], target, FINEST);
                variant(&mut refinement, *which, at < counted)
            })
            .collect();
        let of = |which: usize| {
            let mine = jobs.iter().zip(&each).filter(|((w, _), _)| *w == which);
            mine.fold(Found::default(), |sum, (_, found)| sum.plus(*found))
        };
        let base = of(0).seen as f64;
        for which in 0..4 {
            let found = of(which);
            let within = 100.0 * found.within as f64 / found.edges.max(1) as f64;
            let mean = libm::exp2(found.log / found.edges.max(1) as f64);
            let [all, most] = found.patch_edges.map(|n| n as f64);
            let name = format!("edge{target}.{}", IDS[which]);
            outcome.metric(&format!("{name}.triangles"), found.triangles as f64)?;
            outcome.metric(&format!("{name}.triangles_in_image"), found.seen as f64)?;
            outcome.metric(&format!("{name}.within_factor_2_percent"), within)?;
            outcome.metric(&format!("{name}.mean_edge_in_targets"), mean)?;
            let (limited, none) = (100.0 * most / all.max(1.0), || Cell::missing("not counted at this length"));
            table.row([
                Cell::number(target, "px", 2),
                NAMES[which].into(),
                Cell::count(found.triangles),
                Cell::count(found.seen),
                Cell::number(found.seen as f64 / base, "", 3),
                Cell::number(within, "%", 3),
                Cell::number(mean, "", 3),
                if all > 0.0 { Cell::number(limited, "%", 3) } else { Cell::missing("no limit") },
                if at < counted { Cell::count(found.cracks) } else { none() },
                if at < counted { Cell::count(found.broken) } else { none() },
            ]);
            if all > 0.0 {
                outcome.metric(&format!("{name}.limited_percent"), limited)?;
            }
            series[which].push((target, found.seen as f64));
            cracks += found.cracks;
            broken[which] += found.broken;
            progress.advance(1);
        }
    }
    outcome.table(table)?;
    let mut plot = Plot::new(
        "triangles",
        "Triangles with a corner in the image, three cameras",
        Axis::log("edge (px)"),
        Axis::log("triangles"),
    );
    for (name, points) in NAMES.iter().zip(series) {
        plot = plot.series(name, Style::LineAndPoints, points);
    }
    outcome.plot(plot)?;
    outcome.metric("cracks", cracks as f64)?;
    for (which, name) in IDS.iter().enumerate() {
        outcome.metric(&format!("control_cracks.{name}"), broken[which] as f64)?;
    }
    let broke = ["every second radius × 0.6", "one factor a patch", "one factor a patch", "no corners for neighbours"];
    for which in 0..4 {
        outcome.control(NAMES[which], broke[which], "the census finds cracks", broken[which] > 0);
    }
    outcome.deviation(
        "hull shader, tessellator and domain shader",
        "the same pieces on the processor: wgpu has no such stages",
    );
    outcome.deviation(
        "partitioning is not stated",
        "equal pieces, and ones that grow from nothing, shorter ones at an edge's ends; inside the larger of opposite factors",
    );
    if cracks > 0 {
        outcome.set_verdict(Verdict::NotReproduced, format!("{cracks} edges do not fit"));
    }
    Ok(outcome)
}
