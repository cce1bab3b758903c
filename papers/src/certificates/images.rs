//! Images (Génevaux 2015 §4.2, §7.3.1): on a rectangle, on a quadrangle, along a curve.

use super::family::{Member, Shrunk, holds};
use super::search::{Finding, Form, Number};
use super::terrain::{Said, Terrain};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use glam::DVec2;
use std::sync::Arc;
use terrain_model::operator::BlendRule;
use terrain_model::primitive::image::{Image, ImagePatch};
use terrain_model::primitive::quad::{Quad, Spread};
use terrain_model::primitive::strip::Strip;

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "image-index-set",
        shows: "An image of 2 × 2 samples (0, 0; 0, 100) is steep where the printed maximum sees no difference.",
        control: "each difference over its whole range",
        certifies: &[],
        kind: Kind::Witness(&TWO_BY_TWO),
    },
    Certificate {
        id: "image-family",
        shows: "Images on rectangles keep their bounds, with equal and unequal spacing.",
        control: "half of the slope bound",
        certifies: &["primitive/image.rs::bounds"],
        kind: Kind::Proof(images),
    },
    Certificate {
        id: "quad-flat-corner",
        shows: "Where a corner of a quadrangle flattens, an image on it is steeper than on a square.",
        control: "max ‖J‖_F / min det J over the corners",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["flatness"], root: [(1e-3, 0.5)], measure: FlatCorner }),
    },
    Certificate {
        id: "quad-family",
        shows: "Images on quadrangles and along curves keep their bounds.",
        control: "a third of the slope bound",
        certifies: &["primitive/quad.rs::bounds"],
        kind: Kind::Proof(quads),
    },
];

fn patch(width: usize, samples: Vec<f32>, spacing: DVec2) -> Option<ImagePatch> {
    let height = samples.len() / width;
    let half = spacing * DVec2::new(width as f64 - 1.0, height as f64 - 1.0) * 0.5;
    Some(ImagePatch {
        image: Arc::new(Image::new(width, height, samples)?),
        origin: DVec2::ZERO,
        spacing,
        margin: 0.25 * half.min_element(),
        weight: 1.0,
        weights: None,
        elevation_scale: 1.0,
        elevation_offset: 0.0,
    })
}

static TWO_BY_TWO: Terrain = Terrain::new(
    || {
        // i and j from 0 to n − 2 = 0: the differences f(0,0) − f(1,0) and f(0,0) − f(0,1), both 0; a micrometre is granted.
        let image = patch(2, vec![0.0, 0.0, 0.0, 100.0], DVec2::ONE)?;
        Said::of(1e-6, (DVec2::ZERO, DVec2::ONE), |tree| tree.push(image))
    },
    [(0.0, 1.0), (0.0, 1.0)],
);

/// Heights without a pattern, from a small integer sequence.
fn heights(count: usize) -> Vec<f32> {
    (0..count).map(|k| ((k * 37 + k * k * 11) % 29) as f32).collect()
}

fn images(form: Form) -> Finding {
    let of = |spacing: DVec2| {
        let image = patch(6, heights(30), spacing)?;
        Member::of(move |tree| tree.push(image))
    };
    holds([of(DVec2::splat(10.0)), of(DVec2::new(8.0, 15.0))], BlendRule::Corrected, form, Shrunk(0.5))
}

struct FlatCorner;
impl Measure<1> for FlatCorner {
    fn sides<R: Number>(&self, [d]: [R; 1]) -> Sides<R> {
        // (0,0), (1,0), (1/2+d, 1/2+d), (0,1) at the third corner: ∂x/∂u = (1/2+d, d−1/2), ∂x/∂v = (d−1/2, 1/2+d), whose inverse has
        // norm 1/(2d). The deepest step an image of unit slope in u and v can make there; on the square it would be 1 (√2 both ways).
        let half = R::constant(0.5);
        let (long, short) = (half + d, d - half);
        let det = long.square() - short.square();
        let value = R::one() / (d + d);
        let frobenius = (R::constant(2.0) * (long.square() + short.square())).sqrt();
        // The other corners: ‖J‖_F² is at most 2 + (1/2−d)²·2 there and their determinants are larger.
        let most = frobenius.max((R::constant(2.0) + (half - d).square() * R::constant(2.0)).sqrt());
        Sides::limits(value, R::constant(2.0).sqrt(), most / det * R::constant(1.0 + 1e-9))
    }
}

fn spread() -> Option<Spread> {
    Some(Spread {
        image: Arc::new(Image::new(4, 5, heights(20))?),
        weights: None,
        weight: 1.0,
        margin: [0.2, 0.2],
        elevation_scale: 1.0,
        elevation_offset: 0.0,
    })
}

fn quads(form: Form) -> Finding {
    let quad = |corners: [(f64, f64); 4]| {
        let quad = Quad { spread: spread()?, corners: corners.map(DVec2::from) };
        Member::of(move |tree| tree.push(quad))
    };
    let strip = || {
        let points = [(0.0, 0.0), (60.0, 5.0), (110.0, 30.0)].map(DVec2::from);
        let strip = Strip { spread: spread()?, sections: Strip::sections_along(&points, 20.0) };
        Member::of(move |tree| tree.push(strip))
    };
    let members = [
        quad([(0.0, 0.0), (50.0, 5.0), (60.0, 60.0), (-5.0, 45.0)]),
        quad([(0.0, 0.0), (40.0, 0.0), (40.0, 50.0), (0.0, 50.0)]),
        strip(),
    ];
    holds(members, BlendRule::Corrected, form, Shrunk(1.0 / 3.0))
}
