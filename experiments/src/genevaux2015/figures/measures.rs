//! What can be measured of the features that the figures show: rivers that never rise, a level lake, images without a jump at
//! their joints, a road within its profile, sharp crests. Each measure has a control that it must notice.

use crate::scenes;
use glam::DVec2;
use std::sync::Arc;
use terrain_model::bounds::Region;
use terrain_model::primitive::Primitive;
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::image::Image;
use terrain_model::primitive::quad::Spread;
use terrain_model::primitive::strip::Strip;
use terrain_model::program::Program;
use terrain_model::scene::Scene;
use terrain_model::tree::{Node, NodeId, Tree};

/// A measured number, and what its control gives.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Of the scene.
    pub value: f64,
    /// Of what was broken on purpose.
    pub control: f64,
}

fn scene(name: &str) -> Result<(Scene, Program), String> {
    let scene = scenes::builtin(name).map_err(|error| error.to_string())?;
    let program = scene.program(scene.ground()).map_err(|error| error.to_string())?;
    Ok((scene, program))
}

fn curves(scene: &Scene) -> Vec<Curve> {
    let mut pending: Vec<NodeId> = vec![scene.layers[scene.ground()]];
    let mut out = Vec::new();
    while let Some(id) = pending.pop() {
        let node = scene.tree.node(id);
        if let Node::Primitive(Primitive::Curve(curve)) = node {
            out.push(curve.clone());
        }
        pending.extend(terrain_model::tree::operands(node));
    }
    out
}

/// Points of the skeleton with its tangents, `step` metres apart, from its start on.
fn walk(curve: &Curve, step: f64) -> Result<Vec<(DVec2, DVec2)>, String> {
    let mut points = Vec::new();
    for stretch in curve.path.stretches(curve.tolerance, curve.joint)? {
        let count = (stretch.arc.length / step).ceil().max(1.0);
        points.extend((0..count as u32).map(|k| stretch.arc.at(f64::from(k) / count * stretch.arc.length)));
    }
    Ok(points)
}

fn alone(primitive: impl Into<Node>) -> Result<Program, String> {
    let mut tree = Tree::new();
    let root = tree.push(primitive);
    Program::compile(&tree, root).map_err(|error| error.to_string())
}

/// The most that any river of these scenes rises above a point upstream of it, metres; the control walks up the river.
///
/// # Errors
/// A scene that cannot be read.
pub fn river_rise(names: &[&str]) -> Result<Measure, String> {
    let mut measure = Measure { value: 0.0, control: f64::INFINITY };
    for name in names {
        for curve in curves(&scene(name)?.0) {
            let step = 0.02 * curve.radius;
            let course = walk(&curve, step)?;
            let bed = alone(curve)?;
            let heights: Vec<f64> = course.iter().map(|(p, _)| bed.height(*p).0).collect();
            measure.value = measure.value.max(rise(heights.iter()));
            measure.control = measure.control.min(rise(heights.iter().rev()));
        }
    }
    Ok(measure)
}

fn rise<'a>(heights: impl Iterator<Item = &'a f64>) -> f64 {
    let (mut lowest, mut rise) = (f64::INFINITY, 0.0f64);
    for z in heights {
        lowest = lowest.min(*z);
        rise = rise.max(z - lowest);
    }
    rise
}

/// Highest minus lowest point of the lake of Fig. 7 within 60 % of its shortest ray, metres; the control is the ground without
/// the lake.
///
/// # Errors
/// A scene that cannot be read.
pub fn lake_spread() -> Result<Measure, String> {
    let (scene, program) = scene("fig7_lake")?;
    let Node::Replace { a, b, .. } = scene.tree.node(scene.layers[scene.ground()]) else {
        return Err("the lake of Fig. 7 no longer replaces the ground".to_owned());
    };
    let mut pending = vec![*b];
    let mut lake = None;
    while let Some(id) = pending.pop() {
        if let Node::Primitive(Primitive::Contour(contour)) = scene.tree.node(id) {
            lake = Some(contour.clone());
        }
        pending.extend(terrain_model::tree::operands(scene.tree.node(id)));
    }
    let lake = lake.ok_or("Fig. 7 has no contour")?;
    let reach = 0.6 * lake.rays.iter().map(|ray| ray.radius).fold(f64::INFINITY, f64::min);
    let without = Program::compile(&scene.tree, *a).map_err(|error| error.to_string())?;
    let spread = |program: &Program| {
        let heights = (-40..=40)
            .flat_map(|i| (-40..=40).map(move |j| DVec2::new(f64::from(i), f64::from(j)) / 40.0))
            .filter(|p| p.length() <= 1.0)
            .map(|p| program.height(lake.centre.truncate() + p * reach).0);
        let [lo, hi] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], z| [lo.min(z), hi.max(z)]);
        hi - lo
    };
    Ok(Measure { value: spread(&program), control: spread(&without) })
}

/// A strip of two images along a bent curve, the second `raised` metres higher, as two chains that meet at the joint; and as
/// one chain of the joined images when nothing is raised.
fn strips(raised: f64) -> Result<([Program; 2], [DVec2; 2]), String> {
    let image = |rows: std::ops::Range<usize>| {
        let sample = |i: usize, j: usize| ((i * 7 + j * 13) % 17) as f32;
        let samples = rows.clone().flat_map(|j| (0..9).map(move |i| sample(i, j))).collect();
        Image::new(9, rows.len(), samples).map(Arc::new).ok_or("an image of a strip")
    };
    let points = [(0.0, 0.0), (100.0, 0.0), (190.0, 50.0)].map(DVec2::from);
    let sections = Strip::sections_along(&points, 40.0);
    let strip = |image: Arc<Image>, sections: &[[DVec2; 2]], offset: f64| {
        let spread = Spread {
            image,
            weights: None,
            weight: 1.0,
            margin: [0.01, 0.01],
            elevation_scale: 1.0,
            elevation_offset: offset,
        };
        alone(Strip { spread, sections: sections.to_vec() })
    };
    let joint = sections[1];
    if raised == 0.0 {
        let both = strip(image(0..21)?, &sections, 0.0)?;
        return Ok(([both.clone(), both], joint));
    }
    Ok(([strip(image(0..11)?, &sections[..2], 0.0)?, strip(image(10..21)?, &sections[1..], raised)?], joint))
}

/// The largest step of elevation across the joint of two images along a curve, over 2·10⁻⁹ m; the control raises the second
/// image by a metre.
///
/// # Errors
/// Images that do not fit.
pub fn image_joint() -> Result<Measure, String> {
    let jump = |raised: f64| -> Result<f64, String> {
        let ([before, after], [left, right]) = strips(raised)?;
        let across = (right - left).normalize();
        let along = DVec2::new(-across.y, across.x);
        Ok((1..200)
            .map(|k| left.lerp(right, f64::from(k) / 200.0))
            .map(|p| (after.height(p + along * 1e-9).0 - before.height(p - along * 1e-9).0).abs())
            .fold(0.0, f64::max))
    };
    Ok(Measure { value: jump(0.0)?, control: jump(1.0)? })
}

/// The largest difference, on the common border, of the programs that two neighbouring tiles are pruned to, metres; the control
/// compares the border with points a metre aside.
///
/// # Errors
/// A scene that cannot be read.
pub fn tile_border(name: &str, side: f64) -> Result<Measure, String> {
    let (_, program) = scene(name)?;
    let mut measure = Measure { value: 0.0, control: 0.0 };
    let tile = side / 8.0;
    for k in 0..64u32 {
        let low = DVec2::new(f64::from(k % 8), f64::from(k / 8)) * tile;
        let pruned = |low: DVec2| program.prune(Region::rectangle(low, low + tile));
        let (here, east) = (pruned(low), pruned(low + DVec2::new(tile, 0.0)));
        for j in 0..=32u32 {
            let p = DVec2::new(low.x + tile, low.y + tile * f64::from(j) / 32.0);
            measure.value = measure.value.max((here.height(p).0 - east.height(p).0).abs());
            measure.control = measure.control.max((here.height(p).0 - east.height(p + DVec2::X * 1e-3 * side).0).abs());
        }
    }
    Ok(measure)
}

/// What is steepest on a road, metres per metre.
#[derive(Clone, Copy, Debug)]
pub struct RoadSlopes {
    /// Across the carriageway.
    pub across: Measure,
    /// Along its middle.
    pub along: Measure,
}

/// Cross-slope and grade of the road of Fig. 22, on the terrain, over a carriageway of `width` metres; the control walks beside
/// the road.
///
/// # Errors
/// A scene that cannot be read.
pub fn road_slopes(width: f64) -> Result<RoadSlopes, String> {
    let (scene, program) = scene("fig22")?;
    let slopes = |aside: f64| -> Result<[f64; 2], String> {
        let (mut across, mut along) = (0.0f64, 0.0f64);
        for curve in curves(&scene) {
            // Ends overlap the next piece of the road.
            let course = walk(&curve, 0.5)?;
            for (p, tangent) in course.iter().skip(2).take(course.len().saturating_sub(4)) {
                let normal = DVec2::new(-tangent.y, tangent.x);
                let at = |s: f64, n: f64| program.height(*p + *tangent * s + normal * (n + aside)).0;
                along = along.max((at(0.5, 0.0) - at(-0.5, 0.0)).abs());
                let half = 0.5 * width;
                let offsets = (0..12).map(|k| half * (f64::from(k) / 6.0 - 1.0));
                across =
                    offsets.map(|n| (at(0.0, n + half / 6.0) - at(0.0, n)).abs() / (half / 6.0)).fold(across, f64::max);
            }
        }
        Ok([across, along])
    };
    let ([across, along], [beside, up]) = (slopes(0.0)?, slopes(4.0 * width)?);
    Ok(RoadSlopes { across: Measure { value: across, control: beside }, along: Measure { value: along, control: up } })
}

/// How sharp the dunes of Fig. 17 are.
#[derive(Clone, Copy, Debug)]
pub struct Crest {
    /// Change of slope across 2 mm at the sharpest crest, metres per metre; the control is the swells below the dunes.
    pub bend: Measure,
    /// The same across 20 cm: where a crest is a kink the two agree.
    pub wide: f64,
}

/// The sharpest crest met on lines across the dunes of Fig. 17.
///
/// # Errors
/// A scene that cannot be read.
pub fn crest() -> Result<Crest, String> {
    let (scene, program) = scene("fig17_dunes")?;
    let Node::Add { a, .. } = scene.tree.node(scene.layers[scene.ground()]) else {
        return Err("the dunes of Fig. 17 are no longer added".to_owned());
    };
    let swells = Program::compile(&scene.tree, *a).map_err(|error| error.to_string())?;
    let bend = |program: &Program, p: DVec2, d: f64| {
        let z = |s: f64| program.height(p + DVec2::X * s).0;
        ((z(0.0) - z(-d)) - (z(d) - z(0.0))) / d
    };
    let mut sharpest = (0.0f64, DVec2::ZERO);
    let mut smooth = 0.0f64;
    for line in 0..24u32 {
        let y = 120.0 + 32.0 * f64::from(line);
        for k in 0..1600u32 {
            // A bend over 2 m, then the highest point of it by halving: crests are maxima along the line.
            let p = DVec2::new(100.0 + 0.5 * f64::from(k), y);
            smooth = smooth.max(bend(&swells, p, 1e-3));
            if bend(&program, p, 1.0) < 0.3 {
                continue;
            }
            let (mut lo, mut hi) = (p.x - 1.0, p.x + 1.0);
            for _ in 0..80 {
                let (u, v) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                let z = |x: f64| program.height(DVec2::new(x, y)).0;
                if z(u) < z(v) { lo = u } else { hi = v }
            }
            let top = DVec2::new(0.5 * (lo + hi), y);
            let sharp = bend(&program, top, 1e-3);
            if sharp > sharpest.0 {
                sharpest = (sharp, top);
            }
        }
    }
    let wide = bend(&program, sharpest.1, 0.1);
    Ok(Crest { bend: Measure { value: sharpest.0, control: smooth }, wide })
}
