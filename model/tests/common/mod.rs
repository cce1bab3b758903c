//! Random trees for the laws that every tree must obey.
#![allow(dead_code)] // Each test uses its own part.

use glam::{DVec2, DVec3};
use std::sync::Arc;
use terrain_model::detail::Focus;
use terrain_model::noise::{Combination, Octaves};
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
use terrain_model::spline::{Path, WayPoint};
use terrain_model::tree::{Node, NodeId, Tree};

/// A small deterministic generator (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    /// Uniform in [lo, hi).
    pub fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
    pub fn point(&mut self, half: f64) -> DVec2 {
        DVec2::new(self.range(-half, half), self.range(-half, half))
    }
}

/// Half the side of the square in which random trees live, metres.
pub const HALF: f64 = 500.0;

/// An image spread over quadrangles.
fn spread(random: &mut Random) -> Spread {
    let (w, h) = (4 + random.below(10) as usize, 4 + random.below(10) as usize);
    let samples = (0..w * h).map(|_| random.range(0.0, 30.0) as f32).collect();
    let weights = (random.below(3) == 0).then(|| {
        let weights = (0..5 * 6).map(|_| random.range(0.0, 1.4) as f32).collect();
        Arc::new(Image::new(5, 6, weights).expect("a valid image"))
    });
    Spread {
        image: Arc::new(Image::new(w, h, samples).expect("a valid image")),
        weights,
        weight: random.range(0.6, 1.2),
        margin: [random.range(0.1, 0.5), random.range(0.1, 0.5)],
        elevation_scale: random.range(0.5, 1.5),
        elevation_offset: random.range(-20.0, 20.0),
    }
}

/// A curve of any kind along `points`.
fn curve(random: &mut Random, points: Vec<DVec3>) -> Curve {
    let knot = |distance: f64, height: f64, slope: f64| Knot { distance, height, slope };
    let valley = vec![knot(-40.0, 8.0, 0.0), knot(0.0, 0.0, 0.0), knot(45.0, 11.0, 0.1)];
    let braided = vec![
        knot(-40.0, 6.0, -0.1),
        knot(-20.0, -1.0, 0.0),
        knot(0.0, 2.0, 0.0),
        knot(25.0, -2.0, 0.0),
        knot(50.0, 9.0, 0.0),
    ];
    let path = match random.below(4) {
        0 => Path::Polyline(points),
        1 if points.len() % 2 == 1 => Path::Quadratic(points),
        2 => Path::Road(
            points
                .into_iter()
                .map(|position| WayPoint {
                    position,
                    radius: random.range(20.0, 60.0),
                    transition: random.range(0.0, 30.0),
                })
                .collect(),
        ),
        _ => Path::Smooth(points),
    };
    let mut sections = vec![Section { at: 0.0, profile: valley }];
    if random.below(2) == 0 {
        sections.push(Section { at: random.range(100.0, 300.0), profile: braided });
    }
    let radius = random.range(60.0, 150.0);
    Curve {
        path,
        radius,
        weight: random.range(0.8, 1.3),
        joint: random.range(15.0, 40.0),
        tolerance: random.range(0.01, 0.05) * radius,
        sections,
    }
}

/// A lake of 3 to 7 rays.
fn contour(random: &mut Random, centre: DVec2) -> Contour {
    let knot = |distance: f64, height: f64, slope: f64| Knot { distance, height, slope };
    let ray = |random: &mut Random| Ray {
        angle: None,
        radius: random.range(60.0, 150.0),
        profile: vec![
            knot(-40.0, -6.0, 0.0),
            knot(0.0, 0.0, random.range(0.0, 0.3)),
            knot(random.range(20.0, 60.0), random.range(2.0, 15.0), random.range(-0.1, 0.2)),
        ],
    };
    Contour {
        centre: centre.extend(random.range(-10.0, 40.0)),
        orientation: random.range(-3.0, 3.0),
        rays: (0..3 + random.below(5)).map(|_| ray(random)).collect(),
        reach: random.range(50.0, 150.0),
        weight: random.range(0.7, 1.3),
    }
}

fn primitive(tree: &mut Tree, random: &mut Random) -> NodeId {
    let c = random.point(HALF);
    let node: Primitive = match random.below(10) {
        0 => Disc {
            centre: DVec3::new(c.x, c.y, random.range(-50.0, 100.0)),
            radius: random.range(50.0, 600.0),
            weight: random.range(0.3, 1.5),
            noise: None,
        }
        .into(),
        1..=3 => Disc {
            centre: DVec3::new(c.x, c.y, random.range(-50.0, 100.0)),
            radius: random.range(100.0, 700.0),
            weight: random.range(0.5, 1.5),
            noise: Some(DiscNoise {
                combination: [
                    Combination::Sum,
                    Combination::Turbulence,
                    Combination::Ridged { offset: 0.7, sharpness: 2.0 },
                    Combination::Hybrid { offset: 0.6 },
                ][random.below(4) as usize],
                octaves: Octaves {
                    octaves: 1 + random.below(5) as u32,
                    frequency: random.range(0.002, 0.02),
                    amplitude: random.range(2.0, 40.0),
                    lacunarity: random.range(1.7, 2.3),
                    gain: random.range(0.3, 0.6),
                },
                seed: random.next() as u32,
            }),
        }
        .into(),
        4 => {
            let count = 2 + random.below(4);
            let step = random.point(1.0).normalize() * 150.0;
            let points = (0..count)
                .map(|k| {
                    let p = c + step * k as f64 + random.point(30.0);
                    DVec3::new(p.x, p.y, 40.0 - 3.0 * k as f64 + random.range(-1.0, 1.0))
                })
                .collect();
            curve(random, points).into()
        }
        5 => {
            let octaves = 1 + random.below(5) as u32;
            let disc = Disc {
                centre: DVec3::new(c.x, c.y, random.range(-50.0, 100.0)),
                radius: random.range(100.0, 700.0),
                weight: random.range(0.5, 1.5),
                noise: Some(DiscNoise {
                    combination: [Combination::Sum, Combination::Turbulence][random.below(2) as usize],
                    octaves: Octaves {
                        octaves,
                        frequency: random.range(0.002, 0.02),
                        amplitude: random.range(2.0, 40.0),
                        lacunarity: random.range(1.7, 2.3),
                        gain: random.range(0.3, 0.6),
                    },
                    seed: random.next() as u32,
                }),
            };
            DetailDisc { disc, filters: DetailDisc::even_filters(octaves) }.into()
        }
        6 => {
            let turn = DVec2::from_angle(random.range(-3.0, 3.0)) * random.range(100.0, 300.0);
            let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(DVec2::from);
            let corners = square.map(|corner| c + turn.rotate(corner + random.point(0.2)));
            Quad { spread: spread(random), corners }.into()
        }
        7 => {
            let mut at = c;
            let mut ahead = DVec2::from_angle(random.range(-3.0, 3.0));
            let points: Vec<DVec2> = (0..2 + random.below(4))
                .map(|_| {
                    at += ahead * random.range(90.0, 160.0);
                    ahead = ahead.rotate(DVec2::from_angle(random.range(-0.5, 0.5)));
                    at
                })
                .collect();
            Strip { spread: spread(random), sections: Strip::sections_along(&points, random.range(30.0, 80.0)) }.into()
        }
        8 => contour(random, c).into(),
        _ => {
            let (w, h) = (20 + random.below(30) as usize, 20 + random.below(30) as usize);
            let samples = (0..w * h).map(|_| random.range(0.0, 30.0) as f32).collect();
            let spacing = DVec2::new(random.range(5.0, 15.0), random.range(5.0, 15.0));
            let holes = match random.below(3) {
                0 => (0..w * h).map(|k| k / w == 6 && (3..8).contains(&(k % w))).collect(),
                _ => vec![false; w * h],
            };
            let weights = (random.below(3) == 0).then(|| {
                let weights = (0..9 * 7).map(|_| random.range(0.0, 1.4) as f32).collect();
                Arc::new(Image::new(9, 7, weights).expect("a valid image"))
            });
            ImagePatch {
                image: Arc::new(Image::with_holes(w, h, samples, holes).expect("a valid image")),
                weights,
                origin: c,
                spacing,
                margin: 0.4 * (spacing * DVec2::new(w as f64 - 1.0, h as f64 - 1.0) * 0.5).min_element(),
                weight: random.range(0.6, 1.2),
                elevation_scale: random.range(0.5, 1.5),
                elevation_offset: random.range(-20.0, 20.0),
            }
            .into()
        }
    };
    tree.push(node)
}

/// A random subtree.
pub fn subtree(tree: &mut Tree, random: &mut Random, depth: u32) -> NodeId {
    if depth == 0 {
        return primitive(tree, random);
    }
    match random.below(9) {
        0..=2 => {
            let operands = (0..2 + random.below(4)).map(|_| subtree(tree, random, depth - 1)).collect();
            tree.push(Node::Blend(operands))
        }
        3 => {
            let (a, b) = (subtree(tree, random, depth - 1), subtree(tree, random, depth - 1));
            let rule = if random.below(2) == 0 { WeightRule::Keep } else { WeightRule::Combine };
            tree.push(Node::Replace { a, b, rule })
        }
        4 => {
            let (a, b) = (subtree(tree, random, depth - 1), subtree(tree, random, depth - 1));
            let rule = if random.below(2) == 0 { WeightRule::Keep } else { WeightRule::Combine };
            tree.push(Node::Add { a, b, rule })
        }
        5 => {
            let (a, b) = (subtree(tree, random, depth - 1), subtree(tree, random, depth - 1));
            let from = random.range(0.0, 0.6);
            let lod = Lod { from, to: from + random.range(0.2, 0.4), passage: Passage::Blend };
            tree.push(Node::Lod { a, b, lod })
        }
        6 => {
            let (a, b) = (subtree(tree, random, depth - 1), subtree(tree, random, depth - 1));
            let ramp = |random: &mut Random, size: f64| {
                let (x, y) = (random.range(0.0, size), random.range(0.2 * size, 0.6 * size));
                [None, Some(Ramp { full: x, none: x + y }), Some(Ramp { full: x, none: x - y })]
                    [random.below(3) as usize]
            };
            let mask = Mask {
                probe: random.range(2.0, 20.0),
                elevation: ramp(random, 100.0),
                slope: ramp(random, 1.0),
                joining: [Joining::Add, Joining::Replace][random.below(2) as usize],
            };
            tree.push(Node::Masked { a, b, mask })
        }
        7 => {
            let node = subtree(tree, random, depth - 1);
            let controls: Vec<Control> = (0..1 + random.below(3))
                .map(|_| {
                    let radius = random.range(100.0, 400.0);
                    let shift = DVec2::from_angle(random.range(-3.0, 3.0)) * random.range(0.0, 0.25 * radius);
                    Control { centre: random.point(HALF), radius, shift }
                })
                .collect();
            // Those that fold together are left out.
            let warp = Warp::new(&controls).or_else(|_| Warp::new(&controls[..1])).expect("one alone does not fold");
            tree.push(Node::Warp { node, warp })
        }
        _ => {
            let node = subtree(tree, random, depth - 1);
            let map = Similarity {
                scale: random.range(0.5, 1.5),
                rotation: random.range(-3.0, 3.0),
                translation: random.point(100.0),
                elevation_scale: random.range(0.5, 1.2),
                elevation_offset: random.range(-5.0, 5.0),
            };
            let moved = tree.push(Node::Affine { node, map });
            if random.below(2) == 0 { moved } else { tree.push(Node::Blend(vec![node, moved])) }
        }
    }
}

/// A random tree with its root.
pub fn random_tree(seed: u64) -> (Tree, NodeId) {
    let mut random = Random(seed);
    let mut tree = Tree::new();
    let depth = 1 + random.below(3) as u32;
    let root = subtree(&mut tree, &mut random, depth);
    (tree, root)
}

/// A focus for the tree of this seed, two times of three.
pub fn random_focus(seed: u64) -> Option<Focus> {
    let mut random = Random(seed ^ 0xF0C5);
    let (position, near) = (random.point(HALF), random.range(0.0, 200.0));
    let far = near + random.range(200.0, 900.0);
    (random.below(3) > 0).then_some(Focus { position, near, far })
}
