//! The small terrains that certificates of operators are about.

use super::search::Number;
use glam::DVec3;
use terrain_model::dual::Dual;
use terrain_model::falloff::wyvill;
use terrain_model::noise::{Combination, Octaves};
use terrain_model::primitive::curve::Curve;
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::real::{Operand, Real};
use terrain_model::spline::Path;
use terrain_model::tree::{Node, NodeId, Tree};

pub(super) fn flat(x: f64, y: f64, radius: f64, weight: f64, z: f64) -> Disc {
    Disc { centre: DVec3::new(x, y, z), radius, weight, noise: None }
}

pub(super) fn noisy(x: f64, y: f64, radius: f64, amplitude: f64, combination: Combination, seed: u32) -> Disc {
    let octaves = Octaves { octaves: 3, frequency: 0.004, lacunarity: 2.0, gain: 0.5, amplitude };
    Disc { noise: Some(DiscNoise { combination, octaves, seed }), ..flat(x, y, radius, 1.0, 0.0) }
}

/// A segment whose elevation runs from one end to the other.
pub(super) fn tilted(half: f64, grade: f64, radius: f64, weight: f64) -> Node {
    let end = |x: f64| DVec3::new(x, 0.0, grade * x);
    let path = Path::Polyline(vec![end(-half), end(half)]);
    Curve { weight, joint: 4.0 * radius, ..Curve::new(path, radius, vec![]) }.into()
}

pub(super) fn blend(tree: &mut Tree, discs: impl IntoIterator<Item = Disc>) -> NodeId {
    let operands = discs.into_iter().map(|disc| tree.push(disc)).collect();
    tree.push(Node::Blend(operands))
}

/// Elevation and weight of the blend of two unit discs at ±half, elevations 0 and `rise`, weights `w`, with gradients.
pub(super) fn pair<R: Number>(half: R, w: R, rise: f64, [x, y]: [R; 2]) -> Operand<Dual<R, 2>> {
    let (x, y) = (Dual::<R, 2>::variable(x, 0), Dual::variable(y, 1));
    let operand = |centre: R, z: f64| {
        let g = wyvill((x - Dual::fixed(centre)).square() + y.square());
        Operand::new(Dual::constant(z), Dual::fixed(w) * g)
    };
    Dual::weighted_mean(&[operand(-half, 0.0), operand(half, rise)], 0.0)
}

pub(super) fn steepness<R: Number>(f: Dual<R, 2>) -> R {
    R::length(f.slope[0], f.slope[1])
}

pub(super) fn at_corner<R: Number>(distance: R) -> Operand<Dual<R, 2>> {
    let corner = R::constant(0.75).sqrt();
    pair(R::constant(0.5), R::one(), 1.0, [R::zero(), corner - distance])
}

pub(super) fn ring(count: u32, apart: f64) -> Vec<Disc> {
    // The corners of a triangle, a square and a pentagon, in tenths of a per mille; no sine is needed.
    let corners: &[(f64, f64)] = match count {
        3 => &[(1.0, 0.0), (-0.5, 0.866), (-0.5, -0.866)],
        4 => &[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)],
        _ => &[(1.0, 0.0), (0.309, 0.951), (-0.809, 0.588), (-0.809, -0.588), (0.309, -0.951)],
    };
    corners.iter().zip(0..).map(|(&(x, y), k)| flat(x * apart, y * apart, 1.0, 1.0, f64::from(k))).collect()
}
