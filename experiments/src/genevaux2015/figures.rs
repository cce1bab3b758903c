//! Figures: a picture of each scene, what of it is terrain, whether every primitive shows, and what can be measured of rivers,
//! lakes, joints, roads and dunes.

mod idle;
mod measures;

use crate::experiment::{Context, Expected, Experiment, ExperimentError, Profile};
use crate::layers::Layers;
use crate::report::{Cell, Outcome, Picture, Table};
use crate::scenes;
use glam::DVec3;
use idle::{Seen, changes, primitives};
use measures::Measure;
use std::time::Instant;
use terrain_model::bounds::THRESHOLD;
use terrain_model::primitive::disc::Disc;
use terrain_model::trace::camera::Camera;
use terrain_model::trace::shade::{Look, View, render, to_srgb8};
use terrain_model::trace::{Answer, Ray, Settings, Tracer};
use terrain_model::tree::Node;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/figures",
    title: "Figures 1 to 23: the scenes",
    section: "§4–§8, Figs. 1–23",
    about: "Each figure that shows a terrain is a scene file; where the paper layers water, sand or plants over it, they are trees of \
            their own. Each scene is drawn, its share of terrain counted, and each of its primitives taken out in turn: one that \
            changes fewer than 100 of the 1920 × 1080 pixels is idle. Rivers must not rise, lakes be level, joints of images and \
            borders of tiles not jump, a road keep within its profile, and crests of dunes be kinks.",
    code: "experiments/src/genevaux2015/figures.rs",
    test: "experiments/src/genevaux2015/figures/idle.rs::a_primitive_that_does_nothing_is_found",
    expected: |profile| Expected {
        seconds: profile.pick(60.0, 3000.0),
        memory_bytes: profile.pick(256 << 20, 1 << 30),
        disk_bytes: profile.pick(4 << 20, 64 << 20),
    },
    run,
};

/// Scene, camera, and what the figure shows. A figure whose terrain ends in sight cannot fill its picture.
const FIGURES: [(&str, &str, &str); 20] = [
    ("fig1", "main", "Fig. 1: a lake among mountains"),
    ("fig3", "main", "Fig. 3: a river carved into hills"),
    ("fig5_discs", "main", "Fig. 5: discs, constant, with turbulence, and ridged"),
    ("fig6_river", "main", "Fig. 6: curves: rivers that meet"),
    ("fig7_lake", "main", "Fig. 7: a contour: a lake with its shores"),
    ("fig8_quad", "main", "Fig. 8: an image on a quadrangle"),
    ("fig9_strip", "main", "Fig. 9: images along curves"),
    ("fig10_blend", "main", "Fig. 10: blending of patches"),
    ("fig11_union", "main", "Fig. 11: apart, touching, overlapping"),
    ("fig12_craters", "main", "Fig. 12: craters in order of time"),
    ("fig13_dunes", "main", "Fig. 13: dunes where the ground is low and gentle"),
    ("fig14_warp", "main", "Fig. 14: a terrain and what a warp makes of it"),
    ("fig15_instances", "main", "Fig. 15: instances of one subtree"),
    ("fig16_lod", "main", "Fig. 16: level of detail"),
    ("fig17_dunes", "main", "Fig. 17: sharp dunes"),
    ("fig19", "main", "Fig. 19: a coast of 200 × 200 km"),
    ("fig20", "main", "Fig. 20: lakes and sand"),
    ("fig21", "main", "Fig. 21: a lake, dunes and mountains on 100 × 100 km"),
    ("fig22", "main", "Fig. 22: a winding road"),
    ("fig23_instances", "main", "Fig. 23: thirty instances of a mountain"),
];
/// The one whose patches lie apart.
const OPEN: &str = "fig11_union";

/// The picture that primitives must show in.
const SIZE: (usize, usize) = (1920, 1080);
/// Pixels of it that a primitive must change.
const IDLE: u64 = 100;
/// The share of terrain that a picture must have.
const SHARE: f64 = 0.8;

/// What was found of a scene.
struct Found {
    share: f64,
    primitives: usize,
    operators: usize,
    /// Where each primitive stands in the scene file, and the pixels of [`SIZE`] that it changes.
    changed: Vec<(String, u64)>,
    /// The same for a primitive that was added and does nothing.
    added: u64,
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let titles =
        ["primitives", "operators", "terrain share", "idle primitives", "least pixels of a primitive", "which"];
    let table = Table::new("figures", "Scenes of the figures: what shows").column("scene");
    let mut table = titles.into_iter().fold(table, Table::column);
    let mut idlers = Table::new("idle", "Idle primitives").column("scene").column("primitive").column("pixels");
    let (mut idle_scenes, mut narrow, mut noticed) = (Vec::new(), Vec::new(), true);
    let progress = ctx.progress("figures", FIGURES.len() as u64);
    for (name, camera, caption) in FIGURES {
        let start = Instant::now();
        let found = figure(ctx, name, camera, caption, &mut outcome)?;
        outcome.timing(&format!("{name}.seconds"), start.elapsed().as_secs_f64())?;
        let idle = found.changed.iter().filter(|(_, count)| *count < IDLE).count();
        let least = found.changed.iter().min_by_key(|(_, count)| *count);
        let (which, least) = least.map_or(("", 0), |(path, count)| (path.as_str(), *count));
        for (path, count) in found.changed.iter().filter(|(_, count)| *count < IDLE) {
            idlers.row([Cell::from(name), Cell::from(path.as_str()), Cell::count(*count)]);
        }
        outcome.metric(&format!("{name}.idle_primitives"), idle as f64)?;
        outcome.metric(&format!("{name}.terrain_share"), found.share)?;
        outcome.metric(&format!("{name}.least_changed_pixels"), least as f64)?;
        table.row([
            Cell::from(name),
            Cell::count(found.primitives as u64),
            Cell::count(found.operators as u64),
            Cell::number(found.share, "", 3),
            Cell::count(idle as u64),
            Cell::count(least),
            Cell::from(which),
        ]);
        if idle > 0 {
            idle_scenes.push(name);
        }
        if found.share < SHARE && name != OPEN {
            narrow.push(name);
        }
        noticed &= found.added < IDLE;
        progress.advance(1);
    }
    outcome.table(table)?;
    outcome.table(idlers)?;
    outcome.control(
        "an idle primitive",
        "a disc of weight 10⁻⁹ blended with each scene",
        "it is counted as idle in every scene",
        noticed,
    );
    let measured = measure(&mut outcome)?;
    if !(measured && idle_scenes.is_empty() && narrow.is_empty()) {
        let why = format!(
            "idle primitives: {}; below 80 % terrain: {}; measures within their limits: {measured}",
            list(&idle_scenes),
            list(&narrow)
        );
        outcome.set_verdict(Verdict::Partial, why);
    }
    outcome.deviation(
        "the figures' primitives, cameras and light are not published",
        "scenes of the same subjects; Table 1's with its numbers of primitives and operators",
    );
    outcome.deviation(
        "Fig. 11 shows patches apart, and no ground between them",
        "the same: its share of terrain is measured and not held to 80 %",
    );
    Ok(outcome)
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn figure(
    ctx: &Context,
    name: &str,
    camera: &str,
    caption: &str,
    outcome: &mut Outcome,
) -> Result<Found, ExperimentError> {
    let scene = scenes::builtin(name).map_err(ExperimentError::failed)?;
    let root = scene.layers[scene.ground()];
    let ground = scene.program(scene.ground()).map_err(ExperimentError::failed)?;
    let layers = Layers::of(&scene, ground).map_err(ExperimentError::failed)?;
    let landscape = layers.landscape();
    // Every n-th pixel of every n-th row of the picture.
    let part = ctx.profile.pick(16, 2);
    let (width, height) = (SIZE.0 / part, SIZE.1 / part);
    let placement = scene.cameras.get(camera).ok_or_else(|| ExperimentError::failed(format!("{name}: no {camera}")))?;
    let camera = Camera::new(placement, width, height);
    let look = Look::seen(&landscape.ground, &camera).wished(&scene.appearance);
    // Half of the time goes to rays to the sun; a quick run does without.
    let look = Look { shadows: ctx.profile == Profile::Full, ..look };
    let epsilon = 5e-5 * look.size;
    let settings = Settings { epsilon, bracket: 10.0 * epsilon, edge: epsilon, ..Settings::default() };
    let tracer = Tracer::Segment;
    let view = View { landscape: &landscape, pixel: camera.pixel(), tracer, settings: &settings, look: &look };
    let pixels = render(&view, &camera);
    let rgb: Vec<u8> = pixels.iter().flat_map(|pixel| to_srgb8(pixel.colour)).collect();
    let png = ctx.write_png(name, width as u32, height as u32, &rgb)?;
    outcome
        .picture(Picture::new(png, caption).camera(format!("{name}, {:?} to {:?}", placement.eye, placement.target)));

    let pixel = camera.pixel() / part as f64;
    let shows = |(k, answer): (usize, Answer)| {
        let Answer::Hit { t } = answer else { return None };
        let ray: Ray = camera.ray((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        Some(Seen { at: ray.at(t), footprint: t * pixel })
    };
    let seen: Vec<Seen> = pixels.iter().map(|pixel| pixel.answer).enumerate().filter_map(shows).collect();
    let focus = |program: terrain_model::program::Program| program.with_focus(scene.focus.as_ref());
    let scale = (part * part) as u64;
    let (all, moved) = primitives(&scene.tree, root);
    let changed = changes(&scene.tree, root, (&all, moved), focus, &seen).map_err(ExperimentError::failed)?;
    let paths = all.iter().map(|id| scene.path(*id).to_owned());
    let changed = paths.zip(changed).map(|(path, count)| (path, count * scale)).collect();

    // The control: the same scene with a primitive that hardly weighs.
    let mut tree = scene.tree.clone();
    let middle = seen.get(seen.len() / 2).map_or(DVec3::ZERO, |seen| seen.at);
    let dust = Disc { centre: middle, radius: 1e-2 * look.size, weight: 1e-9 * THRESHOLD, noise: None };
    let dust = tree.push(dust);
    let with = tree.push(Node::Blend(vec![root, dust]));
    let added = changes(&tree, with, (&[dust], moved), focus, &seen).map_err(ExperimentError::failed)?;
    let added = added.iter().sum::<u64>() * scale;
    let (primitives, operators) = scene.tree.count(root);
    Ok(Found { share: seen.len() as f64 / pixels.len() as f64, primitives, operators, changed, added })
}

/// Rounding of heights of a few hundred metres.
const ROUNDING: f64 = 1e-9;
/// Width of the carriageway of Fig. 22, metres, and the cross-slope of its profile, metres per metre.
const CARRIAGEWAY: f64 = 6.0;
const CROSS_SLOPE: f64 = 0.03;

fn measure(outcome: &mut Outcome) -> Result<bool, ExperimentError> {
    let failed = |problem: String| ExperimentError::Failed(problem);
    let road = measures::road_slopes(CARRIAGEWAY).map_err(failed)?;
    let crest = measures::crest().map_err(failed)?;
    let rows = [
        ("river_rise_metres", measures::river_rise(&["fig3", "fig6_river", "fig7_lake"]).map_err(failed)?, ROUNDING),
        ("lake_spread_metres", measures::lake_spread().map_err(failed)?, ROUNDING),
        ("joint_jump_metres", measures::image_joint().map_err(failed)?, 1e-7),
        ("tile_border_jump_metres", measures::tile_border("fig3", 1000.0).map_err(failed)?, 0.0),
        ("road_cross_slope", road.across, CROSS_SLOPE),
        ("road_grade", road.along, road.grade + 1e-3),
    ];
    let titles = ["measured", "at most", "of the control"];
    let mut table =
        titles.into_iter().fold(Table::new("measures", "Features measured").column("measure"), Table::column);
    let mut good = true;
    let mut row = |outcome: &mut Outcome, name: &str, Measure { value, control }: Measure, limit: f64| {
        table.row([
            Cell::from(name),
            Cell::number(value, "", 4),
            Cell::number(limit, "", 4),
            Cell::number(control, "", 4),
        ]);
        outcome.control(name, "see the measure's documentation", "its limit is exceeded", control > limit);
        good &= value <= limit;
        outcome.metric(name, value)
    };
    for (name, measure, limit) in rows {
        row(outcome, name, measure, limit)?;
    }
    // A kink bends as much over 2 mm as over 20 cm; the smooth swells bend a hundred times less.
    outcome.metric("dune_crest_bend", crest.bend.value)?;
    outcome.metric("dune_crest_bend_wide", crest.wide)?;
    outcome.control(
        "dune_crest_bend",
        "the swells below the dunes, which are smooth",
        "hardly a bend over 2 mm",
        crest.bend.control < 0.05 * crest.bend.value,
    );
    good &= crest.bend.value > 0.5 * crest.wide && crest.bend.value > 0.3;
    outcome.table(table)?;
    Ok(good)
}
