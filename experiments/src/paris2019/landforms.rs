//! Landforms one by one: the paper's figures of caves, spires, islands and pierced ground, and the statistics behind them.

mod pipeline;
mod statistics;

use super::{draw, landscapes};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Picture, Table};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_amplify::field::{Box3, Density, THRESHOLD};
use terrain_amplify::geology::{Archetype, Geology};
use terrain_amplify::implicit::heightfield::Implicitisation;
use terrain_amplify::implicit::surface::Distance;
use terrain_amplify::implicit::volume::Volume;
use terrain_amplify::landform::hoodoo::Hoodoo;
use terrain_amplify::landform::island::Island;
use terrain_amplify::landform::karst::Karst;
use terrain_amplify::landform::percolation::Site;
use terrain_amplify::polygonize::check::Census;
use terrain_amplify::polygonize::{Lattice, Polygonizer};
use terrain_amplify::recipe::{Pantry, Recipe, amplify};
use terrain_model::grid::Grid;
use terrain_model::noise::hash::mix;
use terrain_model::scene::CameraPlacement;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "paris2019/landforms",
    title: "Landforms",
    section: "§6, Figs. 1, 12–14, 18, 20, 21, 23, 24",
    about: "Percolation from three sinks in level strata, cut open at the paper's four steps; hoodoos of several grammars and goblins by \
            a river; floating islands between two terrains; ground pierced from cliffs and depressions; a coast with all of it, and stress, \
            resistance, erosion and effects of the sea on it. Rules \
            of the grammar are counted against their probabilities, and resistances along caves against the rock around them.",
    code: "experiments/src/paris2019/landforms.rs",
    test: "amplify/src/landform/karst/tests.rs::a_karst_follows_the_weak_strata_and_not_those_of_another_rock",
    expected: |profile| Expected {
        seconds: profile.pick(15.0, 60.0),
        memory_bytes: profile.pick(1_024, 4_096) << 20,
        disk_bytes: profile.pick(4, 30) << 20,
    },
    run,
};

/// The texts that recipes name.
struct Shelf;

impl Pantry for Shelf {
    fn raster(&mut self, name: &str) -> Result<Grid<f32>, String> {
        Err(format!("no raster {name}"))
    }
    fn text(&mut self, name: &str) -> Result<String, String> {
        match name {
            "strata" => Ok(include_str!("landforms/strata.ron").to_owned()),
            "limestone" => Ok(include_str!("landforms/pierced_rock.ron").to_owned()),
            _ => Err(format!("no geology {name}")),
        }
    }
}

/// What is meshed, checked and drawn.
struct Scene {
    name: &'static str,
    caption: &'static str,
    volume: Volume,
    lattice: Lattice,
    camera: CameraPlacement,
    rock: Geology,
}

fn lattice(low: DVec3, high: DVec3, cell: f64) -> Result<Lattice, ExperimentError> {
    let cells = ((high - low) / cell).ceil().to_array().map(|n| n as usize);
    Lattice::new(low, cell, cells).map_err(ExperimentError::failed)
}

fn looking(eye: [f64; 3], target: [f64; 3], field_of_view: f64) -> CameraPlacement {
    CameraPlacement { eye: DVec3::from_array(eye), target: DVec3::from_array(target), field_of_view }
}

fn level_strata() -> Result<Geology, ExperimentError> {
    Geology::parse(include_str!("landforms/strata.ron")).map_err(ExperimentError::failed)
}

/// A square ground of `side` metres, a sample each metre.
fn ground(side: usize, height: impl Fn(f64, f64) -> f64) -> Result<Grid<f32>, ExperimentError> {
    let samples = side + 1;
    let values = (0..samples * samples).map(|k| height((k % samples) as f64, (k / samples) as f64) as f32).collect();
    Grid::new(DVec2::ZERO, DVec2::ONE, samples, samples, values).map_err(ExperimentError::failed)
}

/// Steps of the percolation that Fig. 14 shows.
const STEPS: [usize; 4] = [0, 48, 97, 176];
/// Where Fig. 14 is cut open, metres north.
const CUT: f64 = 30.0;

/// The sites of Fig. 14: three sinks near the cut.
fn percolation(seed: u32) -> Result<(Volume, Karst, Vec<Site>), ExperimentError> {
    let grid = ground(60, |x, y| 40.0 + 2.0 * libm::sin(x / 9.0) * libm::cos(y / 11.0))?;
    let settings = Implicitisation { floor: -6.0, distance: Distance::Vertical, ..Implicitisation::of(&grid, 2.0) };
    let ground = settings.volume(&grid).map_err(ExperimentError::failed)?;
    let top = |x: f64| DVec3::new(x, CUT + 1.0, grid_height(&grid, x, CUT + 1.0));
    let karst = Karst {
        spacing: 2.0,
        stride: 1.3,
        directions: 12,
        threshold: 2.0,
        soluble: 1.0,
        radius: [2.2, 3.4],
        strength: 1.6,
        sites: STEPS[3] as u32,
        seed,
        sinks: vec![top(14.0), top(31.0), top(47.0)],
        ..Karst::default()
    };
    // Kept near the cut, so that it shows what grows.
    let domain = Box3::new(DVec3::new(4.0, CUT - 1.0, 2.0), DVec3::new(56.0, CUT + 3.0, 44.0));
    let rock = level_strata()?;
    let inside = |p: DVec3| ground.value(p) > THRESHOLD;
    let sites = karst.grow(&domain, inside, &[], |p| rock.value(p)).map_err(ExperimentError::failed)?;
    Ok((ground, karst, sites))
}

fn grid_height(grid: &Grid<f32>, x: f64, y: f64) -> f64 {
    terrain_amplify::landform::raster::bilinear(grid, DVec2::new(x, y))
}

fn fig14(seed: u32, cell: f64) -> Result<Vec<Scene>, ExperimentError> {
    let (ground, karst, sites) = percolation(seed)?;
    let names = [
        ("fig14_0", "Fig. 14, s = 0: three sinks above level strata, cut open"),
        ("fig14_48", "Fig. 14, s = 48"),
        ("fig14_97", "Fig. 14, s = 97"),
        ("fig14_176", "Fig. 14, s = 176: tunnels along the weak beds"),
    ];
    let scene = |(steps, (name, caption)): (usize, (&'static str, &'static str))| {
        let caves = karst.primitives(&sites[..steps.min(sites.len())]);
        Ok(Scene {
            name,
            caption,
            volume: Volume::terrain(ground.clone(), caves)
                .map_err(|k| ExperimentError::failed(format!("sphere {k}")))?,
            lattice: lattice(DVec3::new(0.0, CUT, -8.0), DVec3::new(60.0, 60.0, 48.0), cell)?,
            camera: looking([30.0, -62.0, 42.0], [30.0, 34.0, 20.0], 0.56),
            rock: level_strata()?,
        })
    };
    STEPS.into_iter().zip(names).map(scene).collect()
}

/// Hoodoos of five grammars in a row.
fn fig18(seed: u32, cell: f64) -> Result<Scene, ExperimentError> {
    let grid = ground(90, |x, y| 0.6 * libm::sin(x / 7.0) * libm::cos(y / 9.0))?;
    let settings = Implicitisation { distance: Distance::Vertical, ..Implicitisation::of(&grid, 2.0) };
    let ground = settings.volume(&grid).map_err(ExperimentError::failed)?;
    let rock = level_strata()?;
    let grammars = [
        Hoodoo { size: [2.6, 3.4], ..Hoodoo::default() },
        Hoodoo { size: [1.4, 1.8], ratio: 0.97, block: [0.85, 0.95], width: [0.9, 1.6], ..Hoodoo::default() },
        Hoodoo { size: [3.0, 4.0], ratio: 0.8, width: [0.3, 0.5], cone: [0.2, 0.2], ..Hoodoo::default() },
        Hoodoo {
            size: [1.0, 1.2],
            ratio: 1.03,
            block: [0.9, 0.9],
            width: [0.8, 2.6],
            symbols: 14,
            ..Hoodoo::default()
        },
        Hoodoo::goblin(),
    ];
    let mut parts = vec![ground];
    for (k, grammar) in grammars.into_iter().enumerate() {
        for j in 0..3u32 {
            let foot = DVec3::new(14.0 + 15.5 * k as f64, 30.0 + 11.0 * f64::from(j), 0.0);
            let grammar = Hoodoo { seed: seed ^ (7 * j + k as u32), ..grammar.clone() };
            let symbols = grammar.derive(foot, |p| rock.value(p)).map_err(ExperimentError::failed)?;
            parts.push(grammar.volume(&symbols));
        }
    }
    Ok(Scene {
        name: "fig18",
        caption: "Fig. 18: hoodoos of four grammars, and goblins",
        volume: Volume::Blend(parts),
        lattice: lattice(DVec3::new(0.0, 20.0, -4.0), DVec3::new(90.0, 66.0, 32.0), 0.7 * cell)?,
        camera: looking([45.0, -42.0, 22.0], [45.0, 42.0, 6.0], 0.6),
        rock,
    })
}

/// Goblins along the banks of a dry river.
fn fig23(seed: u32, cell: f64) -> Result<Scene, ExperimentError> {
    let bank = |x: f64, y: f64| (y - 60.0 - 14.0 * libm::sin(x / 24.0)).abs();
    let grid =
        ground(120, |x, y| 5.0 * (1.0 - libm::exp(-bank(x, y) * bank(x, y) / 180.0)) + 0.4 * libm::sin(x / 5.0))?;
    let settings = Implicitisation { distance: Distance::Vertical, ..Implicitisation::of(&grid, 2.0) };
    let ground = settings.volume(&grid).map_err(ExperimentError::failed)?;
    let rock = level_strata()?;
    let Volume::Ground(surface, _) = &ground else { return Err(ExperimentError::failed("no ground")) };
    let goblin = Hoodoo { seed, size: [0.9, 1.9], ..Hoodoo::goblin() };
    let on_banks = |p: DVec3| if (5.0..17.0).contains(&bank(p.x, p.y)) { 0.2 } else { 0.0 };
    let region = Box3::new(DVec3::new(3.0, 3.0, -9.0), DVec3::new(117.0, 117.0, 9.0));
    let mut primitives = Vec::new();
    for foot in terrain_amplify::landform::ground::scatter(surface, &region, 4.5, |_, _| true, on_banks, seed) {
        let symbols = goblin.derive(foot, |p| rock.value(p)).map_err(ExperimentError::failed)?;
        primitives.extend(goblin.primitives(&symbols));
    }
    Ok(Scene {
        name: "fig23",
        caption: "Fig. 23: goblins along the banks of a river",
        volume: Volume::terrain(ground, primitives).map_err(|k| ExperimentError::failed(format!("symbol {k}")))?,
        lattice: lattice(DVec3::new(0.0, 0.0, -6.0), DVec3::new(120.0, 120.0, 16.0), 0.7 * cell)?,
        camera: looking([20.0, -18.0, 26.0], [58.0, 62.0, 1.0], 0.62),
        rock,
    })
}

/// Five islands, one with caves.
fn islands(seed: u32) -> Result<(Volume, Box3), ExperimentError> {
    let strata = Arc::new(Archetype::HorizontalStrata.geology());
    let mut parts = Vec::new();
    let mut extent = Box3::EMPTY;
    let places = [
        (300.0, [0.0, 0.0, 520.0]),
        (375.0, [520.0, 260.0, 640.0]),
        (450.0, [-40.0, 620.0, 560.0]),
        (525.0, [700.0, 860.0, 520.0]),
        (600.0, [-720.0, 760.0, 690.0]),
    ];
    for (k, (width, at)) in places.into_iter().enumerate() {
        let island = Island { width, seed: mix(seed, k as u32), ..Island::default() };
        let at = DVec3::from_array(at);
        let volume = island.volume(at, Some(strata.clone())).map_err(ExperimentError::failed)?;
        extent = extent.hull(&volume.support());
        parts.push(if k == 0 {
            let sinks = vec![at + DVec3::new(-20.0, -90.0, 0.0)];
            let karst =
                Karst { sinks, sites: 2500, threshold: 2.0, spacing: 5.0, radius: [7.0, 10.0], ..Karst::default() };
            let inside = |p: DVec3| volume.value(p) > THRESHOLD;
            let sites =
                karst.grow(&island.extent(at), inside, &[], |p| strata.value(p)).map_err(ExperimentError::failed)?;
            Volume::terrain(volume.clone(), karst.primitives(&sites))
                .map_err(|k| ExperimentError::failed(format!("sphere {k}")))?
        } else {
            volume
        });
    }
    Ok((Volume::Blend(parts), extent))
}

fn amplified(
    name: &'static str,
    caption: &'static str,
    text: &str,
    grid: &Grid<f32>,
    seed: u32,
    cell: f64,
    camera: CameraPlacement,
) -> Result<Scene, ExperimentError> {
    let recipe = Recipe::parse(text).map_err(ExperimentError::failed)?;
    let made = amplify(grid, &recipe, &mut Shelf, seed, |_, _| ()).map_err(ExperimentError::failed)?;
    let lattice = Lattice::over(&made.support(), cell).map_err(ExperimentError::failed)?;
    Ok(Scene { name, caption, volume: made.volume, lattice, camera, rock: made.geology })
}

fn scenes(ctx: &Context) -> Result<Vec<Scene>, ExperimentError> {
    let seed = ctx.seed as u32;
    let cell = ctx.profile.pick(0.8, 0.4);
    let mut all = fig14(seed, 0.6 * cell)?;
    all.push(fig18(seed, 0.5 * cell)?);
    all.push(fig23(seed, 0.7 * cell)?);
    let (volume, extent) = islands(seed)?;
    all.push(Scene {
        name: "fig21",
        caption: "Fig. 21: islands of 300 m to 600 m between two terrains, strata eroded, caves in the nearest",
        volume,
        lattice: lattice(extent.low - 5.0, extent.high + 5.0, 7.0 * cell)?,
        camera: looking([-150.0, -640.0, 520.0], [40.0, 400.0, 470.0], 0.85),
        rock: Archetype::HorizontalStrata.geology(),
    });
    let pierced = landscapes::bluff()?;
    let camera = looking([96.0, -74.0, 78.0], [92.0, 96.0, 14.0], 0.62);
    let caption = "Fig. 24: ground pierced by water from cliffs and depressions";
    all.push(amplified("fig24", caption, include_str!("landforms/pierced.ron"), &pierced, seed, cell, camera)?);
    let coast = landscapes::cove()?;
    let camera = looking([150.0, -46.0, 44.0], [88.0, 92.0, 4.0], 0.66);
    let caption = "Fig. 1: undercut cliffs, a cave, an arch and spires of one recipe";
    all.push(amplified("fig1", caption, include_str!("landforms/overview.ron"), &coast, seed, cell, camera)?);
    Ok(all)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let (width, height) = ctx.profile.pick((640, 400), (1920, 1200));
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("scenes", "Meshes of the scenes")
        .column("scene")
        .column("cube")
        .column("triangles")
        .column("values of f")
        .column("bytes of the tree")
        .column("bytes of rasters")
        .column("pixels of rock");
    let mut wrong = Vec::new();
    let mut torn = false;
    let scenes = scenes(ctx)?;
    let progress = ctx.progress("scenes", scenes.len() as u64);
    for Scene { name, caption, volume, lattice, camera, rock } in &scenes {
        let tolerance = 0.01 * lattice.spacing();
        let polygonizer = Polygonizer::new(volume, *lattice, tolerance).map_err(ExperimentError::failed)?;
        let (mut mesh, report) = polygonizer.sparse().map_err(ExperimentError::failed)?;
        let census = Census::of(&mesh);
        let unproved = polygonizer.unproved_vertices(&mesh);
        let drawn = draw::draw(&mesh, camera, [width, height], |p| rock.value(p));
        let [tree, rasters] = volume.bytes();
        for (metric, value) in [
            ("triangles", mesh.triangles.len() as f64),
            ("evaluations", report.evaluations() as f64),
            ("holes", census.holes as f64),
            ("non_manifold_edges", census.non_manifold_edges as f64),
            ("unproved_vertices", unproved as f64),
            ("tree_bytes", tree as f64),
            ("raster_bytes", rasters as f64),
        ] {
            outcome.metric(&format!("{name}.{metric}"), value)?;
        }
        if !census.is_closed() || unproved > 0 || drawn.covered < 0.1 {
            wrong.push(format!("{name}: {census:?}, {unproved} vertices off, rock in {}", drawn.covered));
        }
        table.row([
            Cell::from(*name),
            Cell::number(lattice.spacing(), "m", 3),
            Cell::count(mesh.triangles.len() as u64),
            Cell::count(report.evaluations()),
            Cell::count(tree as u64),
            Cell::count(rasters as u64),
            Cell::number(100.0 * drawn.covered, "%", 3),
        ]);
        let file = ctx.write_png(name, width as u32, height as u32, &drawn.pixels)?;
        let DVec3 { x, y, z } = camera.eye;
        outcome.picture(Picture::new(file, caption).camera(format!("from ({x}, {y}, {z})")).seed(ctx.seed));
        if !torn {
            mesh.triangles.pop();
            torn = Census::of(&mesh).holes > 0;
        }
        progress.advance(1);
    }
    outcome.table(table)?;
    let islands = scenes.iter().find(|scene| scene.name == "fig21").map(|scene| scene.volume.bytes());
    let megabytes = islands.map_or(f64::NAN, |[tree, rasters]| (tree + rasters) as f64 / 1e6);
    outcome.metric("islands.megabytes", megabytes)?;
    if megabytes.is_nan() || megabytes > 6.0 {
        wrong.push(format!("the islands take {megabytes} MB, the paper's 6"));
    }
    outcome.control("a hole", "a triangle of the first mesh left out", "the census finds its edges", torn);
    statistics::strata(ctx, &mut outcome, &mut wrong)?;
    pipeline::pipeline(ctx, &mut outcome, &mut wrong)?;
    statistics::rules(ctx, &mut outcome, &mut wrong)?;
    outcome.deviation("the scenes, which are printed as pictures", "grounds, recipes and grammars of ours");
    outcome.deviation(
        "the form of a hoodoo's probability, of which the paper names drainage area, slope and mask",
        "mask · g((slope − s₀)/w)/(1 + A/A₀)",
    );
    if let Some(why) = wrong.first() {
        outcome.set_verdict(Verdict::NotReproduced, why.clone());
    }
    Ok(outcome)
}
