//! The trees that the conformance suite runs, each with the points where executors are likeliest to part: borders of cells,
//! rims of supports, joints of chains.

use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_model::detail::Focus;
use terrain_model::noise::{Combination, Octaves, mix};
use terrain_model::operator::WeightRule;
use terrain_model::operator::affine::Similarity;
use terrain_model::operator::lod::{Lod, Passage};
use terrain_model::operator::masked::{Joining, Mask, Ramp};
use terrain_model::operator::warp::{Control, Warp};
use terrain_model::primitive::Primitive;
use terrain_model::primitive::contour::{Contour, Ray};
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::detail_disc::DetailDisc;
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::primitive::image::{Image, ImagePatch};
use terrain_model::primitive::quad::{Quad, Spread};
use terrain_model::primitive::strip::Strip;
use terrain_model::profile::{Knot, Section};
use terrain_model::program::{Program, TileProgram};
use terrain_model::spline::Path;
use terrain_model::tree::{Node, NodeId, Tree};

/// A tree over one neighbourhood, with the focus of its levels of detail.
#[derive(Debug)]
pub struct Case {
    pub program: Program,
    /// Middle and half width of where it is asked, metres.
    pub middle: DVec2,
    reach: f64,
    /// Where else it is asked: on borders of cells and quadrangles, metres.
    marks: Vec<DVec2>,
}

/// Every node and operator that the shader runs, near the origin and far from it.
///
/// # Errors
/// Which tree does not compile.
pub fn cases() -> Result<Vec<Case>, String> {
    let mut out = Vec::new();
    for middle in [DVec2::new(13.0, -7.0), DVec2::new(3_141_592.65, -2_718_281.83)] {
        for raster in rasters(middle)? {
            let mut tree = Tree::new();
            let root = tree.push(raster.primitive);
            let program = Program::compile(&tree, root).map_err(|error| format!("{}: {error}", raster.name))?;
            out.push(Case { program, middle, reach: 600.0, marks: raster.marks });
        }
        let mut push = |name: &str, make: &dyn Fn(&mut Tree) -> Result<NodeId, String>| {
            let mut tree = Tree::new();
            let root = make(&mut tree)?;
            let program = Program::compile(&tree, root).map_err(|error| format!("{name}: {error}"))?;
            let focus = Focus { position: middle + DVec2::new(-300.0, 50.0), near: 100.0, far: 900.0 };
            let program = program.with_focus(Some(&focus));
            out.push(Case { program, middle, reach: 550.0, marks: Vec::new() });
            Ok::<(), String>(())
        };
        let disc = |x: f64, y: f64, radius: f64, noise: Option<DiscNoise>| Disc {
            centre: DVec3::new(middle.x + x, middle.y + y, 120.0 + 0.1 * x),
            radius,
            weight: 0.9,
            noise,
        };
        let noise = |combination: Combination, octaves: u32| {
            let octaves = Octaves { octaves, frequency: 0.004, lacunarity: 2.03, gain: 0.55, amplitude: 80.0 };
            Some(DiscNoise { combination, octaves, seed: 77 })
        };
        let sum = noise(Combination::Sum, 5);
        let kinds = [
            ("sum", Combination::Sum),
            ("turbulence", Combination::Turbulence),
            ("ridged", Combination::Ridged { offset: 1.0, sharpness: 2.0 }),
            ("multifractal", Combination::Multifractal { offset: 0.8 }),
            ("hybrid", Combination::Hybrid { offset: 0.7 }),
        ];
        push("disc", &|tree| Ok(tree.push(disc(0.0, 0.0, 500.0, None))))?;
        for (name, kind) in kinds {
            push(name, &|tree| Ok(tree.push(disc(0.0, 0.0, 500.0, noise(kind, 6)))))?;
        }
        push("detail disc", &|tree| {
            let disc = disc(0.0, 0.0, 500.0, sum);
            Ok(tree.push(DetailDisc { disc, filters: DetailDisc::even_filters(5) }))
        })?;
        push("blend", &|tree| {
            let parts = (0..12).map(|k| {
                let at = DVec2::from_angle(f64::from(k)) * 250.0;
                tree.push(disc(at.x, at.y, 300.0, sum.filter(|_| k % 2 == 0)))
            });
            let parts = parts.collect();
            Ok(tree.push(Node::Blend(parts)))
        })?;
        let knot = |distance: f64, height: f64, slope: f64| Knot { distance, height, slope };
        let bank = vec![knot(-60.0, 15.0, 0.0), knot(0.0, -8.0, 0.3), knot(40.0, 5.0, -0.1), knot(90.0, 25.0, 0.0)];
        let course = |closeness: f64| -> Vec<DVec3> {
            let at = |k: i32| {
                DVec3::new(
                    middle.x + closeness * f64::from(k),
                    middle.y + f64::from(k * k % 7) * 40.0,
                    3.0 * f64::from(k),
                )
            };
            (-5..=5).map(at).collect()
        };
        let paths = [("polyline", Path::Polyline(course(80.0))), ("smooth", Path::Smooth(course(90.0)))];
        for (name, path) in paths {
            push(&format!("curve {name}, sections"), &|tree| {
                let even = vec![knot(-50.0, 20.0, 0.0), knot(0.0, -5.0, 0.0), knot(50.0, 20.0, 0.0)];
                let sections = [(0.0, even), (300.0, bank.clone())];
                let sections = sections.map(|(at, profile)| Section { at, profile }).to_vec();
                Ok(tree.push(Curve { sections, ..Curve::new(path.clone(), 120.0, Vec::new()) }))
            })?;
        }
        push("curve segment", &|tree| {
            let path = Path::Polyline(course(80.0)[4..6].to_vec());
            Ok(tree.push(Curve::new(path, 120.0, bank.clone())))
        })?;
        push("contour", &|tree| {
            let rays = (0..5u32).map(|k| Ray {
                angle: None,
                radius: 250.0 + 30.0 * f64::from(k % 3),
                profile: vec![knot(-150.0, 0.0, 0.0), knot(0.0, 10.0 + f64::from(k), 0.2), knot(80.0, 30.0, 0.0)],
            });
            let centre = DVec3::new(middle.x, middle.y, 40.0);
            let (rays, orientation) = (rays.collect(), 0.3);
            Ok(tree.push(Contour { centre, orientation, rays, reach: 150.0, weight: 0.8 }))
        })?;
        for rule in [WeightRule::Keep, WeightRule::Combine, WeightRule::CombinePaper] {
            push(&format!("replace {rule:?}"), &|tree| {
                let (a, b) = (tree.push(disc(-100.0, 0.0, 400.0, sum)), tree.push(disc(150.0, 0.0, 300.0, None)));
                Ok(tree.push(Node::Replace { a, b, rule }))
            })?;
            push(&format!("add {rule:?}"), &|tree| {
                let (a, b) = (tree.push(disc(-100.0, 0.0, 400.0, sum)), tree.push(disc(150.0, 0.0, 300.0, None)));
                Ok(tree.push(Node::Add { a, b, rule }))
            })?;
        }
        for passage in [Passage::Blend, Passage::Paper] {
            push(&format!("lod {passage:?}"), &|tree| {
                let (a, b) = (tree.push(disc(0.0, 0.0, 500.0, None)), tree.push(disc(0.0, 0.0, 520.0, sum)));
                Ok(tree.push(Node::Lod { a, b, lod: Lod { from: 0.2, to: 0.9, passage } }))
            })?;
        }
        for joining in [Joining::Add, Joining::Replace] {
            push(&format!("masked {joining:?}"), &|tree| {
                let (a, b) = (tree.push(disc(0.0, 0.0, 600.0, sum)), tree.push(disc(50.0, 0.0, 500.0, None)));
                let elevation = Some(Ramp { full: 100.0, none: 170.0 });
                let mask = Mask { probe: 4.0, elevation, slope: Some(Ramp { full: 0.2, none: 0.9 }), joining };
                Ok(tree.push(Node::Masked { a, b, mask }))
            })?;
        }
        let turned = |about: DVec2, rotation: f64, scale: f64| {
            let translation = about - DVec2::from_angle(rotation).rotate(about) * scale;
            Similarity { scale, rotation, translation, elevation_scale: 1.5, elevation_offset: -20.0 }
        };
        push("affine", &|tree| {
            let node = tree.push(disc(0.0, 0.0, 400.0, sum));
            Ok(tree.push(Node::Affine { node, map: turned(middle, 0.7, 1.2) }))
        })?;
        push("warp", &|tree| {
            let node = tree.push(disc(0.0, 0.0, 450.0, sum));
            let control = |x: f64, y: f64| Control {
                centre: middle + DVec2::new(x, y),
                radius: 260.0,
                shift: DVec2::new(50.0, -30.0),
            };
            let warp = Warp::new(&[control(-200.0, 0.0), control(220.0, 60.0)])?;
            Ok(tree.push(Node::Warp { node, warp }))
        })?;
        push("nested", &|tree| {
            let leaves = [-1.0, 0.0, 1.0].map(|k| tree.push(disc(180.0 * k, 90.0, 350.0, sum)));
            let inner = tree.push(Node::Blend(leaves.to_vec()));
            let turned = tree.push(Node::Affine { node: inner, map: turned(middle, -1.1, 0.8) });
            let flat = tree.push(disc(0.0, -200.0, 300.0, None));
            let sum = tree.push(Node::Add { a: turned, b: flat, rule: WeightRule::Keep });
            let first = tree.push(Node::Blend(vec![inner, sum]));
            Ok(tree.push(Node::Blend(vec![first, flat, turned])))
        })?;
    }
    Ok(out)
}

impl Case {
    /// `count` random points of the case relative to `origin`, and adversarial ones: borders of the lattice cells of the
    /// first octave, the rims of supports of radius 400 and 500, the marks, and the middle itself, each with its neighbours.
    pub fn points(&self, tile: &TileProgram, count: u32, seed: u32) -> Vec<[f32; 2]> {
        let local = self.middle - tile.origin;
        let unit = |k: u32, salt: u32| f64::from(mix(mix(seed, salt), k)) / 4_294_967_296.0;
        let place = |x: f64, y: f64| [(local.x + x) as f32, (local.y + y) as f32];
        let spread = |k: u32, salt: u32| (2.0 * unit(k, salt) - 1.0) * self.reach;
        let mut out: Vec<[f32; 2]> = (0..count).map(|k| place(spread(k, 1), spread(k, 2))).collect();
        let mut near = vec![place(0.0, 0.0)];
        near.extend(self.marks.iter().map(|mark| (*mark - tile.origin).as_vec2().to_array()));
        for k in 0..count / 16 {
            let rim = DVec2::from_angle(std::f64::consts::TAU * unit(k, 3)) * [400.0, 500.0][k as usize % 2];
            near.push(place(rim.x, rim.y));
            if let Some(octave) = tile.octaves().first() {
                let border = |axis: usize, from: f64| {
                    let cell = (from * octave.frequency + octave.offset[axis]).round();
                    ((cell - octave.offset[axis]) / octave.frequency) as f32
                };
                let (x, y) = (local.x + spread(k, 4), local.y + spread(k, 5));
                near.push([border(0, x), y as f32]);
                near.push([border(0, x), border(1, y)]);
            }
        }
        for [x, y] in near {
            out.extend([[x, y], [x.next_up(), y], [x, y.next_down()], [x.next_down(), y.next_up()]]);
        }
        out
    }
}

/// A raster on the ground, with its borders.
struct Raster {
    name: &'static str,
    primitive: Primitive,
    marks: Vec<DVec2>,
}

/// Samples between 0 and 1.
fn noisy(width: usize, height: usize, seed: u32) -> Vec<f32> {
    (0..width * height).map(|k| (mix(seed, k as u32) >> 8) as f32 / (1 << 24) as f32).collect()
}

/// Images on rectangles, quadrangles and along a curve, with holes and with images of weights.
fn rasters(middle: DVec2) -> Result<Vec<Raster>, String> {
    const COLUMNS: usize = 23;
    const ROWS: usize = 17;
    let made = |image: Option<Image>| image.map(Arc::new).ok_or_else(|| "a raster of the suite is refused".to_owned());
    let elevations = noisy(COLUMNS, ROWS, 3).iter().map(|sample| 90.0 * sample).collect::<Vec<f32>>();
    let whole = made(Image::new(COLUMNS, ROWS, elevations.clone()))?;
    let holes = (0..COLUMNS * ROWS).map(|k| k == 8 * COLUMNS + 11).collect();
    let pierced = made(Image::with_holes(COLUMNS, ROWS, elevations, holes))?;
    let weights = made(Image::new(9, 12, noisy(9, 12, 4)))?;
    let mut out = Vec::new();
    let (spacing, margin) = (DVec2::new(48.0, 57.0), 110.0);
    let size = spacing * DVec2::new(COLUMNS as f64 - 1.0, ROWS as f64 - 1.0);
    let origin = middle - 0.5 * size;
    let patches = [("image", &whole, None), ("weighted image", &whole, Some(&weights)), ("pierced", &pierced, None)];
    for (name, image, weights) in patches {
        let patch = ImagePatch {
            image: image.clone(),
            origin,
            spacing,
            margin,
            weight: 0.9,
            weights: weights.cloned(),
            elevation_scale: 1.5,
            elevation_offset: -20.0,
        };
        let corners =
            (0..=4u32).flat_map(|i| (0..=4u32).map(move |j| DVec2::new(5.5 * f64::from(i), 4.0 * f64::from(j))));
        let cells = corners.map(|at| origin + at.floor() * spacing);
        let rims = [-1.0, 1.0].into_iter().flat_map(|side| {
            let outer = middle + 0.5 * side * size;
            let inner = outer - side * margin;
            [DVec2::new(outer.x, middle.y), DVec2::new(middle.x, outer.y), DVec2::new(inner.x, middle.y), inner]
        });
        out.push(Raster { name, primitive: patch.into(), marks: cells.chain(rims).collect() });
    }
    let spread = |weights: Option<&Arc<Image>>| Spread {
        image: whole.clone(),
        weights: weights.cloned(),
        weight: 0.8,
        margin: [0.2, 0.1],
        elevation_scale: 1.5,
        elevation_offset: -20.0,
    };
    let skewed = [(-420.0, -380.0), (500.0, -250.0), (310.0, 340.0), (-330.0, 450.0)];
    let parallel = [(-450.0, -300.0), (250.0, -400.0), (450.0, 300.0), (-250.0, 400.0)];
    for (name, corners, weights) in [("quad", skewed, Some(&weights)), ("parallelogram", parallel, None)] {
        let corners = corners.map(|corner| middle + DVec2::from(corner));
        let marks = borders(&[[corners[0], corners[1]], [corners[3], corners[2]]]);
        out.push(Raster { name, primitive: Quad { spread: spread(weights), corners }.into(), marks });
    }
    let course = [(-500.0, -300.0), (-200.0, -260.0), (0.0, -40.0), (-70.0, 220.0), (200.0, 500.0)];
    let sections = Strip::sections_along(&course.map(|at| middle + DVec2::from(at)), 90.0);
    let marks = borders(&sections);
    out.push(Raster { name: "strip", primitive: Strip { spread: spread(Some(&weights)), sections }.into(), marks });
    Ok(out)
}

/// Points on the sections of a chain and between them, the ends of the sections among them.
fn borders(sections: &[[DVec2; 2]]) -> Vec<DVec2> {
    let across = |section: &[DVec2; 2], u: f64| section[0].lerp(section[1], u);
    let between = |pair: &[[DVec2; 2]], u: f64, v: f64| across(&pair[0], u).lerp(across(&pair[1], u), v);
    let shares = || (0..=4u32).map(|k| 0.25 * f64::from(k));
    let at = shares().flat_map(|u| [0.0, 0.5, 1.0].map(|v| (u, v)));
    at.flat_map(|(u, v)| sections.windows(2).map(move |pair| between(pair, u, v)).collect::<Vec<_>>()).collect()
}
