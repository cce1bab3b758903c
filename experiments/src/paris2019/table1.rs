//! The paper's Table 1: five scenes, what they hold, what they weigh, and what it takes to mesh them.

use super::amplified::{DESCRIPTIONS, Scene, cave};
use super::draw;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Picture, Table};
use glam::DVec3;
use std::time::Instant;
use terrain_amplify::field::{Box3, Density};
use terrain_amplify::polygonize::check::Census;
use terrain_amplify::polygonize::{Polygonizer, Report};
use terrain_amplify::stacks::Stacks;
use terrain_model::mesh::Mesh;
use terrain_papers::tables::{Paris2019Row, paris2019_table1};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/table1",
    title: "Table 1",
    section: "§8, Table 1, Figs. 11, 15, 17, 19, 25",
    about: "Coast, karst, canyon, hoodoos and a cave drawn by hand, of the paper's size, number of primitives and lattice. Grounds are \
            made from a seed; recipes and geologies are texts. Generation includes hydrology and the index, meshing excludes checks. \
            A call is a value of f; look-ups of bare ground and enclosures are counted apart. Trees are weighed without the ground, as \
            in the paper; stacks are made of the same field, columns a cube apart, tops within 0.1 m; a quick run converts a ninth of these columns and \
            counts each nine times.",
    code: "experiments/src/paris2019/table1.rs",
    test: "experiments/src/paris2019/amplified.rs::the_canyon_is_the_same_on_any_number_of_threads",
    expected: |profile| Expected {
        seconds: profile.pick(60.0, 240.0),
        memory_bytes: 4_096 << 20,
        disk_bytes: profile.pick(4, 12) << 20,
    },
    run,
};

/// How exactly tops of layers are known, metres.
const PRECISION: f64 = 0.1;
/// More corners than this are evaluated by the full profile alone: one after the other they take a minute and more.
const CORNERS: usize = 30_000_000;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut tables = Tables::new();
    let printed = paris2019_table1()?;
    let progress = ctx.progress("scenes", 5);
    let mut findings = Findings::default();
    for (k, row) in printed.rows.iter().enumerate() {
        let scene = DESCRIPTIONS.get(k).map_or_else(cave, |description| description.scene(ctx.seed as u32))?;
        if !row.scene.to_ascii_lowercase().starts_with(scene.name) {
            return Err(ExperimentError::failed(format!("{} is not {}", scene.name, row.scene)));
        }
        measure(ctx, &scene, row, &mut outcome, &mut tables, &mut findings)?;
        progress.advance(1);
    }
    outcome.table(tables.trees)?;
    outcome.table(tables.meshes)?;
    let mut prose = Table::new("prose", "What the prose says beside the paper's own table")
        .column("place")
        .column("quantity")
        .column("prose");
    for line in &printed.prose {
        prose.row([
            Cell::from(line.place.as_str()),
            Cell::from(line.quantity.as_str()),
            Cell::from(line.says.as_str()),
        ]);
    }
    outcome.table(prose)?;
    outcome.deviation(
        "the paper's grounds, Mystery Canyon among them, and what was drawn on them, none of which is published",
        "grounds of the same size made from a seed, and recipes",
    );
    outcome.control("a hole", "one triangle of the first mesh left out", "the census finds its edges", findings.torn);
    if let Some(why) = findings.wrong.first() {
        outcome.set_verdict(Verdict::NotReproduced, why.clone());
    } else if let Some(why) = findings.beyond.first() {
        outcome.set_verdict(Verdict::Partial, why.clone());
    }
    Ok(outcome)
}

#[derive(Default)]
struct Findings {
    /// Meshes that are no border of a solid.
    wrong: Vec<String>,
    /// What is beyond the paper's own number.
    beyond: Vec<String>,
    torn: bool,
}

struct Tables {
    trees: Table,
    meshes: Table,
}

impl Tables {
    fn new() -> Tables {
        let trees = Table::new("trees", "What scenes hold: the paper's, then ours")
            .column("scene")
            .column("side")
            .column("a")
            .column("ours")
            .column("#N")
            .column("ours")
            .column("generated in")
            .machine_column("ours")
            .column("bytes a node")
            .column("ours")
            .column("index, bytes a primitive")
            .column("stacks")
            .column("ours")
            .column("stacks / tree")
            .column("ours");
        let meshes = Table::new("meshes", "What it takes to mesh them: the paper's, then ours")
            .column("scene")
            .column("lattice")
            .column("triangles")
            .column("#C")
            .column("ours")
            .column("look-ups of ground")
            .column("enclosures")
            .column("#C₀")
            .column("ours")
            .column("#C₀/#C")
            .column("ours")
            .column("t")
            .machine_column("ours")
            .column("t₀")
            .machine_column("ours")
            .column("t₀/t")
            .machine_column("ours");
        Tables { trees, meshes }
    }
}

fn measure(
    ctx: &Context,
    scene: &Scene,
    row: &Paris2019Row,
    outcome: &mut Outcome,
    tables: &mut Tables,
    findings: &mut Findings,
) -> Result<(), ExperimentError> {
    let name = scene.name;
    let nodes = scene.index.primitives().len();
    let [own, beside] = scene.index.bytes().map(|bytes| bytes as f64 / nodes.max(1) as f64);
    let start = Instant::now();
    let stacks = stacks_bytes(scene, ctx.profile.pick(3.0, 1.0))?;
    outcome.timing(&format!("{name}.stacks_seconds"), start.elapsed().as_secs_f64())?;
    let tree = own * nodes as f64;
    outcome.metric(&format!("{name}.nodes"), nodes as f64)?;
    outcome.metric(&format!("{name}.coverage"), scene.coverage)?;
    outcome.metric(&format!("{name}.bytes_per_primitive"), own)?;
    outcome.metric(&format!("{name}.index_bytes_per_primitive"), beside)?;
    outcome.metric(&format!("{name}.stacks_bytes"), stacks)?;
    match scene.generation_seconds {
        Some(seconds) => outcome.timing(&format!("{name}.generation_seconds"), seconds)?,
        None => outcome.absent(&format!("{name}.generation_seconds"), "drawn by hand, as in the paper")?,
    }
    tables.trees.row([
        Cell::from(row.scene.as_str()),
        Cell::number(row.side_km, "km", 2),
        Cell::number(row.coverage, "", 2),
        Cell::number(scene.coverage, "", 2),
        Cell::count(row.nodes.into()),
        Cell::count(nodes as u64),
        row.generation_seconds.map_or_else(|| Cell::from("by hand"), |s| Cell::number(s, "s", 2)),
        scene.generation_seconds.map_or_else(|| Cell::from("by hand"), |s| Cell::number(s, "s", 3)),
        Cell::number(row.bytes_per_node(), "", 3),
        Cell::number(own, "", 3),
        Cell::number(beside, "", 3),
        Cell::number(row.arches_megabytes, "MB", 3),
        Cell::number(stacks / 1e6, "MB", 3),
        Cell::number(row.memory_ratio(), "", 3),
        Cell::number(stacks / tree, "", 3),
    ]);
    if nodes as u64 != u64::from(row.nodes) {
        findings.beyond.push(format!("{name}: {nodes} primitives, the paper's scene has {}", row.nodes));
    }

    let polygonizer = Polygonizer::new(&scene.volume, scene.lattice, 0.01 * scene.lattice.spacing());
    let polygonizer = polygonizer.map_err(ExperimentError::failed)?;
    let start = Instant::now();
    let (mesh, few) = polygonizer.sparse().map_err(ExperimentError::failed)?;
    let seconds = start.elapsed().as_secs_f64();
    let whole = whole(ctx, scene, &polygonizer)?;
    picture(ctx, scene, mesh, findings, outcome, &polygonizer)?;
    outcome.timing(&format!("{name}.mesh_seconds"), seconds)?;
    outcome.metric(&format!("{name}.evaluations"), few.evaluations() as f64)?;
    outcome.metric(&format!("{name}.lookups"), few.lookups as f64)?;
    outcome.metric(&format!("{name}.enclosures"), few.enclosures as f64)?;
    if let Some((all, seconds)) = &whole {
        outcome.metric(&format!("{name}.evaluations_standard"), all.evaluations() as f64)?;
        outcome.timing(&format!("{name}.mesh_seconds_standard"), *seconds)?;
    } else {
        let why = "evaluating every corner of this lattice is left to --full";
        outcome.absent(&format!("{name}.evaluations_standard"), why)?;
        outcome.absent(&format!("{name}.mesh_seconds_standard"), why)?;
    }
    let [nx, ny, nz] = scene.lattice.cells();
    let of_whole = |number: &dyn Fn(&Report, f64) -> Cell| {
        whole.as_ref().map_or_else(|| Cell::from("--full"), |(all, seconds)| number(all, *seconds))
    };
    tables.meshes.row([
        Cell::from(row.scene.as_str()),
        Cell::from(format!("{nx} × {ny} × {nz}").as_str()),
        Cell::count(few.cells),
        Cell::count(row.calls),
        Cell::count(few.evaluations()),
        Cell::count(few.lookups),
        Cell::count(few.enclosures),
        Cell::count(row.baseline_calls),
        of_whole(&|all, _| Cell::count(all.evaluations())),
        Cell::number(row.call_ratio(), "", 3),
        of_whole(&|all, _| Cell::number(all.evaluations() as f64 / few.evaluations() as f64, "", 3)),
        Cell::number(row.seconds, "s", 3),
        Cell::number(seconds, "s", 3),
        Cell::number(row.baseline_seconds, "s", 3),
        of_whole(&|_, whole| Cell::number(whole, "s", 3)),
        Cell::number(row.speedup(), "", 3),
        of_whole(&|_, whole| Cell::number(whole / seconds, "", 3)),
    ]);
    if few.evaluations() > row.calls {
        findings.beyond.push(format!("{name}: {} values of f, the paper's {}", few.evaluations(), row.calls));
    }
    Ok(())
}

/// Every corner, where the profile allows.
fn whole<F: Density>(
    ctx: &Context,
    scene: &Scene,
    polygonizer: &Polygonizer<'_, F>,
) -> Result<Option<(Report, f64)>, ExperimentError> {
    let corners: usize = scene.lattice.cells().iter().product();
    if corners > ctx.profile.pick(CORNERS, usize::MAX) {
        return Ok(None);
    }
    let start = Instant::now();
    let (_, all) = polygonizer.standard().map_err(ExperimentError::failed)?;
    Ok(Some((all, start.elapsed().as_secs_f64())))
}

/// Checks the mesh and draws it.
fn picture<F: Density>(
    ctx: &Context,
    scene: &Scene,
    mut mesh: Mesh,
    findings: &mut Findings,
    outcome: &mut Outcome,
    polygonizer: &Polygonizer<'_, F>,
) -> Result<(), ExperimentError> {
    let name = scene.name;
    let census = Census::of(&mesh);
    outcome.metric(&format!("{name}.triangles"), mesh.triangles.len() as f64)?;
    outcome.metric(&format!("{name}.holes"), census.holes as f64)?;
    outcome.metric(&format!("{name}.non_manifold_edges"), census.non_manifold_edges as f64)?;
    let sample = Mesh { positions: mesh.positions.iter().step_by(37).copied().collect(), ..Mesh::default() };
    let unproved = polygonizer.unproved_vertices(&sample);
    outcome.metric(&format!("{name}.unproved_vertices_in_37th"), unproved as f64)?;
    if !census.is_closed() || unproved > 0 {
        findings.wrong.push(format!("{name}: {census:?}, {unproved} vertices without a change of sign"));
    }
    let (width, height) = ctx.profile.pick((640, 400), (1920, 1200));
    let drawn = draw::draw(&mesh, &scene.camera, [width, height], |p| scene.geology.value(p));
    if drawn.covered < 0.3 {
        findings.wrong.push(format!("{name}: rock in {} of the picture", drawn.covered));
    }
    let file = ctx.write_png(name, width as u32, height as u32, &drawn.pixels)?;
    let DVec3 { x, y, z } = scene.camera.eye;
    outcome.picture(Picture::new(file, scene.caption).camera(format!("from ({x}, {y}, {z})")).seed(ctx.seed));
    if !findings.torn {
        mesh.triangles.pop();
        findings.torn = Census::of(&mesh).holes > 0;
    }
    Ok(())
}

/// Bytes of the same field as stacks, columns a cube apart; a quick run converts every `apart`th column both ways and counts each
/// for those that it leaves out. They begin above the solid's floor, so that a column of bare ground is one layer.
fn stacks_bytes(scene: &Scene, apart: f64) -> Result<f64, ExperimentError> {
    let cell = scene.lattice.spacing();
    let (low, high) = (scene.lattice.corner([0; 3]), scene.lattice.corner(scene.lattice.cells()));
    let region = Box3 { low: low + DVec3::Z * cell, high };
    let (stacks, _) =
        Stacks::convert(&scene.volume, &region, apart * cell, PRECISION, None).map_err(ExperimentError::failed)?;
    Ok(apart * apart * stacks.bytes() as f64)
}
