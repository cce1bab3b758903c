//! Irregular networks of the paper's scenes with a proved largest error, beside regular meshes of equal error.

use super::meshes::{Ground, draw, grounds, moved_vertex_is_noticed, regular_of_equal_error};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Picture, Table};
use std::time::Instant;
use terrain_model::mesh::cracks::cracks;
use terrain_model::mesh::tin::{Settings, tin};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/tin",
    title: "Irregular networks with a proved error",
    section: "§8, Fig. 2",
    about: "The paper exports terrains as triangulated irregular networks and gives no error. Here the worst point is inserted into a \
            Delaunay triangulation until every triangle is proved, by branch and bound over duals of intervals, to lie within a \
            tolerance of the terrain, straight up and down. Beside the certified error stands the largest distance found at a \
            point, and the coarsest regular mesh whose error is not refuted by points.",
    code: "experiments/src/genevaux2015/tin.rs",
    test: "model/src/mesh/tin.rs::the_network_is_closed_lies_on_the_field_and_within_the_tolerance_of_it",
    expected: |profile| Expected {
        seconds: profile.pick(25.0, 900.0),
        memory_bytes: profile.pick(128 << 20, 1 << 30),
        disk_bytes: 1 << 20,
    },
    run,
};

fn settings(ground: &Ground) -> Settings {
    let Ground { low, high, tolerance, .. } = *ground;
    let border = (high - low).max_element() / 1024.0;
    Settings { low, high, tolerance, border, vertices: 1 << 20, budget: Settings::BUDGET }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let grounds = grounds(ctx)?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let titles = ["tolerance", "certified error", "largest found", "not proved", "triangles", "vertices", "cracks"];
    let table = Table::new("networks", "Networks, and regular meshes of equal error");
    let table = titles.into_iter().fold(table.column("scene"), Table::column);
    let mut table = table.column("regular triangles, at least").column("ratio");
    let mut good = true;
    let mut noticed = true;
    let progress = ctx.progress("networks", grounds.len() as u64);
    for ground in &grounds {
        let (name, program) = (ground.scene.name, &ground.scene.program);
        let settings = settings(ground);
        let start = Instant::now();
        let found = tin(program, &settings).map_err(ExperimentError::failed)?;
        outcome.timing(&format!("{name}.seconds"), start.elapsed().as_secs_f64())?;
        let (side, plain) = regular_of_equal_error(ground)?;
        let (triangles, cracked) = (found.mesh.triangles.len(), cracks(&found.mesh).total());
        let mut metric = |what: &str, value: f64| outcome.metric(&format!("{name}.{what}"), value);
        metric("tolerance_metres", ground.tolerance)?;
        // The certified error: no point of the mesh is further away.
        metric("max_error_metres", found.at_most)?;
        metric("found_error_metres", found.at_least)?;
        metric("triangles", triangles as f64)?;
        metric("vertices", found.mesh.positions.len() as f64)?;
        metric("not_proved", found.open.len() as f64)?;
        metric("cracks", cracked as f64)?;
        metric("regular.samples_a_side", side as f64)?;
        metric("regular.triangles", plain as f64)?;
        table.row([
            Cell::from(name),
            Cell::number(ground.tolerance, "m", 4),
            Cell::number(found.at_most, "m", 6),
            Cell::number(found.at_least, "m", 6),
            Cell::count(found.open.len() as u64),
            Cell::count(triangles as u64),
            Cell::count(found.mesh.positions.len() as u64),
            Cell::count(cracked as u64),
            Cell::count(plain as u64),
            Cell::number(plain as f64 / triangles as f64, "", 3),
        ]);
        good &= found.open.is_empty() && found.at_most <= ground.tolerance && cracked == 0;
        noticed &= moved_vertex_is_noticed(program, &found.mesh, ground.tolerance, settings.budget);
        let image = draw(ctx, name, ground, &found.mesh)?;
        outcome.picture(Picture::new(image, &format!("{}: {triangles} triangles from above", ground.scene.row)));
        progress.advance(1);
    }
    if !good {
        outcome.set_verdict(Verdict::NotReproduced, "a triangle is not proved to be within the tolerance, or a crack");
    }
    outcome.table(table)?;
    outcome.control(
        "a vertex off the terrain",
        "one vertex raised by twice the tolerance",
        "every triangle around it is refuted",
        noticed,
    );
    outcome.deviation(
        "The error of the paper's networks is not given.",
        "5 m on Fig. 3 and 800 m on Fig. 19, or a half of that at full size.",
    );
    Ok(outcome)
}
