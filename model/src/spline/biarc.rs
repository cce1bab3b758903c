//! A smooth curve as a chain of biarcs: two arcs that meet with one tangent and take the curve's points and tangents at
//! both ends. Pieces are halved until the curve keeps within a tolerance.

use super::Arc;
use glam::DVec2;

/// A curve over [0, 1]: position and derivative.
pub(super) trait Planar {
    fn at(&self, t: f64) -> (DVec2, DVec2);
}

/// The arcs of a piece of a curve that ends at parameter `to`.
pub(super) struct Piece {
    pub arcs: Vec<Arc>,
    pub to: f64,
}

/// Halvings of one curve before it is given up.
const DEEPEST: u32 = 14;
/// Points of a piece at which the distance to its arcs is measured.
const SAMPLES: u32 = 12;
/// Arcs turn by less than this, radians: 45°.
pub(super) const TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Fits arcs to `curve` so that no measured point of it is farther than `tolerance` metres from them.
pub(super) fn fit(curve: &impl Planar, tolerance: f64) -> Result<Vec<Piece>, String> {
    let mut out = Vec::new();
    // Two pieces at least: elevation is known exactly at their ends, and cubic between.
    let mut pending = vec![(0.5, 1.0, 1), (0.0, 0.5, 1)];
    while let Some((from, to, depth)) = pending.pop() {
        // Half of the tolerance is left for what lies between the measured points.
        if let Some(arcs) = piece(curve, from, to, 0.5 * tolerance) {
            out.push(Piece { arcs, to });
        } else if depth == DEEPEST {
            return Err("a curve has a cusp or doubles back; move its control points apart".to_owned());
        } else {
            let middle = 0.5 * (from + to);
            pending.push((middle, to, depth + 1));
            pending.push((from, middle, depth + 1));
        }
    }
    Ok(out)
}

fn piece(curve: &impl Planar, from: f64, to: f64, tolerance: f64) -> Option<Vec<Arc>> {
    let ((a, leaving), (b, arriving)) = (curve.at(from), curve.at(to));
    let arcs = biarc(a, leaving.try_normalize()?, b, arriving.try_normalize()?)?;
    if arcs.iter().any(|arc| arc.turn().abs() > 1.5) {
        return None;
    }
    let off = |t: f64| arcs.iter().fold(f64::INFINITY, |d, arc| d.min(arc.distance(curve.at(t).0)));
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(SAMPLES);
    let onward = |k: u32| curve.at(at(k)).1.dot(b - a) > 0.0;
    if !(1..SAMPLES).all(|k| onward(k) && off(at(k)) <= tolerance) {
        return None;
    }
    let parts = |arc: &Arc| libm::ceil(arc.turn().abs() / TURN).max(1.0) as usize;
    Some(arcs.iter().flat_map(|arc| arc.split(parts(arc))).collect())
}

/// Two arcs from `a` with tangent `leaving` to `b` with tangent `arriving`, with control legs of equal length d: the joint
/// is the middle of a + d·leaving and b − d·arriving. One arc, or one segment, where two are the same.
fn biarc(a: DVec2, leaving: DVec2, b: DVec2, arriving: DVec2) -> Option<Vec<Arc>> {
    let v = b - a;
    let along = v.dot(leaving + arriving);
    let d = v.length_squared()
        / (along + (along * along + 2.0 * (1.0 - leaving.dot(arriving)) * v.length_squared()).sqrt());
    let joint = 0.5 * (a + d * leaving + b - d * arriving);
    let first = Arc::through(a, leaving, joint)?;
    let second = Arc::through(joint, first.at(first.length).1, b)?;
    if first.length + second.length > 3.0 * v.length() {
        return None;
    }
    if first.curvature == 0.0 && second.curvature == 0.0 {
        return Some(vec![Arc::segment(a, b)?]);
    }
    Some(vec![first, second])
}
