//! Scenes of the paper's figures, each a construction tree in text, meshed, checked and drawn.

use super::{benagil, draw};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Picture, Table};
use glam::{DVec2, DVec3};
use terrain_amplify::field::Density;
use terrain_amplify::geology::Archetype;
use terrain_amplify::implicit::volume::{Volume, file};
use terrain_amplify::polygonize::check::Census;
use terrain_amplify::polygonize::{Lattice, Polygonizer};
use terrain_model::grid::Grid;
use terrain_model::scene::CameraPlacement;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/figures",
    title: "Scenes",
    section: "§4–§8, Figs. 3–5, 7–10, 25",
    about: "Each scene is a tree of the nodes that the paper's figure shows, in text (terrain-volume/1): geology on one cliff, hoodoos \
            of instanced skeletons cracked by a warp, a domain that is no rectangle, an arch and caves, star-convex noise, erosion of weak strata, and the cave of \
            551 strokes. Every mesh is closed and manifold, every vertex a change of sign within a hundredth of a cube.",
    code: "experiments/src/paris2019/figures.rs",
    test: "experiments/src/paris2019/figures.rs::every_scene_is_read_and_has_rock_and_air",
    expected: |profile| Expected {
        seconds: profile.pick(15.0, 120.0),
        memory_bytes: profile.pick(512, 4_096) << 20,
        disk_bytes: profile.pick(4, 40) << 20,
    },
    run,
};

/// Name, tree and caption.
const SCENES: [(&str, &str, &str); 7] = [
    ("fig3", include_str!("figures/fig3.ron"), "Fig. 3: folded strata that end at a fault, turbulent rock beyond it"),
    ("fig4", include_str!("figures/fig4.ron"), "Fig. 4: strata, a fault, a weak place and a warp on one cliff"),
    ("fig5", include_str!("figures/fig5.ron"), "Fig. 5: hoodoos of spheres, cones and ellipsoids, cracked by a warp"),
    ("fig7", include_str!("figures/fig7.ron"), "Fig. 7: a domain with a bay and a hole"),
    ("fig8", include_str!("figures/fig8.ron"), "Fig. 8: an arch that accretes, caves that carve"),
    ("fig9", include_str!("figures/fig9.ron"), "Fig. 9: point and curve, bare and with star-convex noise"),
    ("fig10", include_str!("figures/fig10.ron"), "Fig. 10: three weak strata erode"),
];
/// Side of the grounds of trees, metres.
const SIDE: f64 = 120.0;

/// The grounds that the trees name.
fn raster(name: &str) -> Result<Grid<f32>, String> {
    let elevation = |p: DVec2| match name {
        "plain" => Some(0.8 * libm::sin(p.x / 9.0) * libm::cos(p.y / 13.0)),
        "cliff" => {
            let t = ((p.y - 48.0 - 5.0 * libm::sin(p.x / 15.0)) / 8.0).clamp(0.0, 1.0);
            Some(-4.0 + (22.0 + 1.5 * libm::sin(p.x / 21.0 + p.y / 17.0)) * t * t * (3.0 - 2.0 * t))
        }
        _ => None,
    };
    let samples = SIDE as usize + 1;
    let values: Option<Vec<f32>> = (0..samples * samples)
        .map(|k| elevation(DVec2::new((k % samples) as f64, (k / samples) as f64)).map(|z| z as f32))
        .collect();
    let values = values.ok_or_else(|| format!("no ground {name:?}: expected plain or cliff"))?;
    Grid::new(DVec2::ZERO, DVec2::ONE, samples, samples, values).map_err(|error| error.to_string())
}

fn tree(text: &str) -> Result<Volume, ExperimentError> {
    let node = file::parse(text).map_err(ExperimentError::failed)?;
    node.build(&mut raster).map_err(ExperimentError::failed)
}

/// A scene ready to be meshed and drawn.
struct Scene {
    name: &'static str,
    caption: &'static str,
    volume: Volume,
    lattice: Lattice,
    camera: CameraPlacement,
    rock: Archetype,
}

fn scenes(cell: f64) -> Result<Vec<Scene>, ExperimentError> {
    let mut all = Vec::new();
    for (name, text, caption) in SCENES {
        let volume = tree(text)?;
        let lattice = Lattice::over(&volume.support(), cell).map_err(ExperimentError::failed)?;
        let camera = CameraPlacement {
            eye: DVec3::new(38.0, -62.0, 46.0),
            target: DVec3::new(60.0, 54.0, 4.0),
            field_of_view: 0.75,
        };
        all.push(Scene { name, caption, volume, lattice, camera, rock: Archetype::Sandstone });
    }
    let camera = CameraPlacement {
        eye: DVec3::new(150.0, 40.0, 62.0),
        target: DVec3::new(205.0, 222.0, 2.0),
        field_of_view: 0.8,
    };
    let caption = "Fig. 25: a sea cave with a hole in its roof, 551 strokes, 13,264 primitives";
    let (volume, lattice) = (benagil::volume()?, benagil::lattice()?);
    all.push(Scene { name: "fig25", caption, volume, lattice, camera, rock: Archetype::HorizontalStrata });
    Ok(all)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let (width, height) = ctx.profile.pick((640, 400), (1920, 1200));
    let scenes = scenes(ctx.profile.pick(0.75, 0.3))?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("scenes", "Meshes of the scenes")
        .column("scene")
        .column("cube")
        .column("vertices")
        .column("triangles")
        .column("values of f")
        .column("values of bare ground")
        .column("pixels of rock");
    let progress = ctx.progress("scenes", scenes.len() as u64);
    let mut wrong = Vec::new();
    let mut noticed = None;
    for Scene { name, caption, volume, lattice, camera, rock } in &scenes {
        let tolerance = 0.01 * lattice.spacing();
        let polygonizer = Polygonizer::new(volume, *lattice, tolerance).map_err(ExperimentError::failed)?;
        let (mesh, report) = polygonizer.sparse().map_err(ExperimentError::failed)?;
        let census = Census::of(&mesh);
        let unproved = polygonizer.unproved_vertices(&mesh);
        if !census.is_closed() || unproved > 0 {
            wrong.push(format!("{name}: {census:?}, {unproved} vertices without a change of sign"));
        }
        if noticed.is_none() {
            let mut broken = mesh.clone();
            broken.triangles.pop();
            broken.positions[0][2] += 2.0 * lattice.spacing();
            noticed = Some(Census::of(&broken).holes > 0 && polygonizer.unproved_vertices(&broken) == 1);
        }
        let geology = rock.geology();
        let drawn = draw::draw(&mesh, camera, [width, height], |p| geology.value(p));
        for (metric, value) in [
            ("triangles", mesh.triangles.len() as f64),
            ("evaluations", report.evaluations() as f64),
            ("lookups", report.lookups as f64),
            ("holes", census.holes as f64),
            ("non_manifold_edges", census.non_manifold_edges as f64),
            ("unproved_vertices", unproved as f64),
            ("rock_share", drawn.covered),
        ] {
            outcome.metric(&format!("{name}.{metric}"), value)?;
        }
        if drawn.covered < 0.3 {
            wrong.push(format!("{name}: rock in {} of the picture", drawn.covered));
        }
        table.row([
            Cell::from(*name),
            Cell::number(lattice.spacing(), "m", 3),
            Cell::count(mesh.positions.len() as u64),
            Cell::count(mesh.triangles.len() as u64),
            Cell::count(report.evaluations()),
            Cell::count(report.lookups),
            Cell::number(100.0 * drawn.covered, "%", 3),
        ]);
        let file = ctx.write_png(name, width as u32, height as u32, &drawn.pixels)?;
        let DVec3 { x, y, z } = camera.eye;
        outcome.picture(Picture::new(file, caption).camera(format!("from ({x}, {y}, {z})")).seed(ctx.seed));
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.deviation(
        "the scenes themselves: the paper prints pictures of them",
        "trees of the same nodes, laid out by us and kept as text",
    );
    outcome.control(
        "a hole and a vertex off the surface",
        "a triangle left out, a vertex moved by two cubes",
        "the census and the search for a change of sign find them",
        noticed == Some(true),
    );
    if let Some(why) = wrong.first() {
        outcome.set_verdict(Verdict::NotReproduced, why.clone());
    }
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_read_and_has_rock_and_air() {
        assert!(tree(&SCENES[0].1.replace("cliff", "nowhere")).is_err());
        for (name, text, _) in SCENES {
            let volume = tree(text).unwrap();
            assert!(volume.value(DVec3::new(90.0, 90.0, -8.0)) > 0.5, "{name}");
            assert!(volume.value(DVec3::new(60.0, 60.0, 60.0)) < 0.5, "{name}");
        }
    }
}
