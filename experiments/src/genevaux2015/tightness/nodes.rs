//! One node of every kind, and built-in scenes, each with the region that it is bounded over.

use crate::scenes;
use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_model::detail::Focus;
use terrain_model::noise::{Combination, Octaves};
use terrain_model::operator::WeightRule;
use terrain_model::operator::affine::Similarity;
use terrain_model::operator::lod::{Lod, Passage};
use terrain_model::operator::masked::{Joining, Mask, Ramp};
use terrain_model::operator::warp::{Control, Warp};
use terrain_model::primitive::contour::{Contour, Ray};
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::detail_disc::DetailDisc;
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::primitive::image::{Image, ImagePatch};
use terrain_model::primitive::quad::{Quad, Spread};
use terrain_model::primitive::strip::Strip;
use terrain_model::profile::Knot;
use terrain_model::program::Program;
use terrain_model::spline::Path;
use terrain_model::tree::{Node, NodeId, Tree};

/// A program and the region it is bounded over.
pub struct Case {
    pub name: &'static str,
    pub program: Program,
    pub low: DVec2,
    pub high: DVec2,
}

fn knot(distance: f64, height: f64, slope: f64) -> Knot {
    Knot { distance, height, slope }
}
fn plain(x: f64, z: f64, radius: f64, weight: f64) -> Disc {
    Disc { centre: DVec3::new(x, 0.0, z), radius, weight, noise: None }
}
fn rough(x: f64, z: f64) -> Disc {
    let octaves = Octaves { octaves: 3, frequency: 0.01, amplitude: 20.0, lacunarity: 2.0, gain: 0.5 };
    let noise = DiscNoise { combination: Combination::Sum, octaves, seed: 7 };
    Disc { noise: Some(noise), ..plain(x, z, 200.0, 1.0) }
}
fn curve(points: &[(f64, f64, f64)], radius: f64) -> Curve {
    let points = points.iter().map(|p| DVec3::new(p.0, p.1, p.2)).collect();
    let valley = vec![knot(-40.0, 20.0, 0.0), knot(-8.0, 0.0, 0.0), knot(8.0, 0.0, 0.0), knot(40.0, 20.0, 0.0)];
    Curve::new(Path::Smooth(points), radius, valley)
}
fn image() -> Result<Arc<Image>, String> {
    let samples = (0..9 * 9u32).map(|k| (k * 37 % 23) as f32).collect();
    Image::new(9, 9, samples).map(Arc::new).ok_or_else(|| "an image needs samples".to_owned())
}
fn spread() -> Result<Spread, String> {
    let image = image()?;
    Ok(Spread { image, weights: None, weight: 1.0, margin: [0.3; 2], elevation_scale: 1.0, elevation_offset: 0.0 })
}
fn lake() -> Contour {
    let shore = |height: f64| vec![knot(-5.0, 0.0, 0.0), knot(0.0, 0.0, 0.0), knot(30.0, height, 0.2)];
    let rays = [(80.0, 4.0), (120.0, 9.0), (70.0, 6.0), (95.0, 12.0), (60.0, 5.0)];
    Contour {
        centre: DVec3::new(0.0, 0.0, 100.0),
        orientation: 0.3,
        rays: rays.map(|(radius, height)| Ray { angle: None, radius, profile: shore(height) }).to_vec(),
        reach: 60.0,
        weight: 1.2,
    }
}

type Build = fn(&mut Tree) -> Result<NodeId, String>;

const NODES: [(&str, Build); 18] = [
    ("disc", |t| Ok(t.push(plain(0.0, 10.0, 100.0, 1.0)))),
    ("disc_noise", |t| Ok(t.push(rough(0.0, 10.0)))),
    ("detail_disc", |t| {
        let disc = rough(0.0, 10.0);
        Ok(t.push(DetailDisc { disc, filters: DetailDisc::even_filters(3) }))
    }),
    ("curve_straight", |t| Ok(t.push(curve(&[(0., 0., 30.), (200., 0., 10.)], 60.0)))),
    ("curve_hairpin", |t| Ok(t.push(curve(&[(0., 0., 30.), (100., 0., 25.), (100., 30., 20.), (0., 30., 15.)], 40.0)))),
    ("curve_meander", |t| {
        let points =
            [(0., 0., 60.), (60., 50., 55.), (120., -50., 50.), (180., 60., 44.), (200., -40., 40.), (300., 0., 33.)];
        Ok(t.push(curve(&points, 60.0)))
    }),
    ("contour", |t| Ok(t.push(lake()))),
    ("image", |t| {
        Ok(t.push(ImagePatch {
            image: image()?,
            weights: None,
            origin: DVec2::splat(-40.0),
            spacing: DVec2::splat(10.0),
            margin: 20.0,
            weight: 1.0,
            elevation_scale: 1.0,
            elevation_offset: 0.0,
        }))
    }),
    ("quad", |t| {
        let corners = [(0.0, 0.0), (200.0, 30.0), (230.0, 180.0), (-20.0, 150.0)].map(DVec2::from);
        Ok(t.push(Quad { spread: spread()?, corners }))
    }),
    ("strip", |t| {
        let points = [(0.0, 0.0), (120.0, 0.0), (230.0, 50.0)].map(DVec2::from);
        Ok(t.push(Strip { spread: spread()?, sections: Strip::sections_along(&points, 50.0) }))
    }),
    ("blend", |t| {
        let operands = [(-60.0, 0.0), (60.0, 50.0)].map(|(x, z)| t.push(plain(x, z, 100.0, 1.0))).to_vec();
        Ok(t.push(Node::Blend(operands)))
    }),
    ("replace", |t| {
        let (a, b) = (t.push(rough(0.0, 10.0)), t.push(plain(30.0, 40.0, 80.0, 1.0)));
        Ok(t.push(Node::Replace { a, b, rule: WeightRule::Keep }))
    }),
    ("add", |t| {
        let (a, b) = (t.push(rough(0.0, 10.0)), t.push(plain(30.0, 15.0, 80.0, 1.0)));
        Ok(t.push(Node::Add { a, b, rule: WeightRule::Keep }))
    }),
    ("masked", |t| {
        let (a, b) = (t.push(rough(0.0, 10.0)), t.push(plain(0.0, 5.0, 150.0, 1.0)));
        let elevation = Some(Ramp { full: 5.0, none: 15.0 });
        let mask = Mask { probe: 5.0, elevation, slope: None, joining: Joining::Add };
        Ok(t.push(Node::Masked { a, b, mask }))
    }),
    ("lod", |t| {
        let (a, b) = (t.push(plain(0.0, 10.0, 200.0, 1.0)), t.push(rough(0.0, 10.0)));
        Ok(t.push(Node::Lod { a, b, lod: Lod { from: 0.3, to: 0.7, passage: Passage::Blend } }))
    }),
    ("warp", |t| {
        let node = t.push(rough(0.0, 10.0));
        let control = Control { centre: DVec2::new(40.0, 20.0), radius: 150.0, shift: DVec2::new(25.0, 10.0) };
        Ok(t.push(Node::Warp { node, warp: Warp::new(&[control])? }))
    }),
    ("affine", |t| {
        let node = t.push(rough(0.0, 10.0));
        let map = Similarity {
            scale: 0.8,
            rotation: 0.4,
            translation: DVec2::new(10.0, 5.0),
            elevation_scale: 1.1,
            elevation_offset: 2.0,
        };
        Ok(t.push(Node::Affine { node, map }))
    }),
    ("nested_blend", |t| {
        let inner = [(-60.0, 0.0), (60.0, 50.0)].map(|(x, z)| t.push(plain(x, z, 100.0, 1.0))).to_vec();
        let (a, b) = (t.push(rough(0.0, 10.0)), t.push(Node::Blend(inner)));
        Ok(t.push(Node::Replace { a, b, rule: WeightRule::Keep }))
    }),
];

/// Built-in scenes that are small enough to be enclosed.
const SCENES: [(&str, &str); 4] = [
    ("scene_fig3", "builtin:fig3"),
    ("scene_fig6_river", "builtin:fig6_river"),
    ("scene_fig7_lake", "builtin:fig7_lake"),
    ("scene_fig12_craters", "builtin:fig12_craters"),
];

/// All of them.
///
/// # Errors
/// What is wrong with one of them: a bug.
pub fn nodes() -> Result<Vec<Case>, String> {
    let focus = Focus { position: DVec2::new(20.0, 0.0), near: 20.0, far: 300.0 };
    let mut out = Vec::new();
    let mut place = |name: &'static str, program: Program| {
        let (low, high) = program.support().ok_or_else(|| format!("{name} has no support"))?;
        out.push(Case { name, program, low, high });
        Ok::<(), String>(())
    };
    for (name, build) in NODES {
        let mut tree = Tree::new();
        let root = build(&mut tree)?;
        let program = Program::compile(&tree, root).map_err(|error| format!("{name}: {error}"))?;
        place(name, program.with_focus(Some(&focus)))?;
    }
    for (name, file) in SCENES {
        let scene = scenes::load(file).map_err(|error| error.to_string())?;
        place(name, scene.program(scene.ground()).map_err(|error| format!("{name}: {error}"))?)?;
    }
    Ok(out)
}
