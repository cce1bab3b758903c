//! Elevation along a chain of arcs: a C¹ cubic between knots, which rises or falls where its knots do.

use super::Arc;
use crate::skeleton::arc::Stretch;
use glam::DVec2;

/// Elevation and grade at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    pub abscissa: f64,
    pub elevation: f64,
    pub grade: f64,
}

/// Elevations of a whole chain.
pub(super) enum Elevations {
    /// Constant grade on each arc, from the elevations of the joints.
    Broken(Vec<f64>),
    /// C¹ through knots.
    Smooth(Vec<Knot>),
}

/// Knots through (abscissa, elevation) with grades by which the cubics between them are monotone where the points are: the
/// harmonic mean of Fritsch and Butland (1984), 0 at an extremum.
pub(super) fn monotone(points: &[DVec2]) -> Vec<Knot> {
    let secant = |k: usize| (points[k + 1].y - points[k].y) / (points[k + 1].x - points[k].x);
    let length = |k: usize| points[k + 1].x - points[k].x;
    let last = points.len() - 1;
    let grade = |k: usize| {
        if k == 0 {
            return secant(0);
        } else if k == last {
            return secant(last - 1);
        }
        let (before, after) = (secant(k - 1), secant(k));
        if before * after <= 0.0 {
            return 0.0;
        }
        let (v, w) = (2.0 * length(k) + length(k - 1), length(k) + 2.0 * length(k - 1));
        (v + w) / (v / before + w / after)
    };
    let knot = |k: usize| Knot { abscissa: points[k].x, elevation: points[k].y, grade: grade(k) };
    (0..points.len()).map(knot).collect()
}

/// The cubic between two knots: elevation and grade at abscissa `s`.
fn between(a: &Knot, b: &Knot, s: f64) -> (f64, f64) {
    let h = b.abscissa - a.abscissa;
    let (t, rise) = ((s - a.abscissa) / h, b.elevation - a.elevation);
    let (p, q) = (a.grade * h, b.grade * h);
    let (c2, c3) = (3.0 * rise - 2.0 * p - q, p + q - 2.0 * rise);
    (a.elevation + t * (p + t * (c2 + t * c3)), (p + t * (2.0 * c2 + t * 3.0 * c3)) / h)
}

/// Arcs with the elevations they carry.
pub(super) fn stretches(arcs: &[Arc], elevations: &Elevations, reach: f64) -> Vec<Stretch> {
    let mut abscissae = vec![0.0];
    let mut abscissa = 0.0;
    for arc in arcs {
        abscissa += arc.length;
        abscissae.push(abscissa);
    }
    let ends: Vec<[[f64; 2]; 2]> = match elevations {
        Elevations::Broken(z) => broken(arcs, z),
        Elevations::Smooth(knots) => smooth(&abscissae, knots),
    };
    (0..arcs.len())
        .map(|k| {
            let [elevation, grade] = ends[k];
            // Past a joint elevation goes on with the shallower of the neighbour's grade at the joint and its mean: then no
            // part of a mean lies on the far side of the neighbour, and a river that falls keeps falling.
            let past = |neighbour: Option<usize>, side: usize| {
                // Beyond the ends of a chain its own grade goes on, so that curves that continue each other blend into one.
                let Some(n) = neighbour else { return grade[side] };
                let at_joint = ends[n][1][1 - side];
                let (length, run) = (arcs[n].length, reach.min(arcs[n].length));
                let knot = |e: usize, s: f64| Knot { abscissa: s, elevation: ends[n][0][e], grade: ends[n][1][e] };
                let (from, to) = if side == 1 { (0.0, run) } else { (length, length - run) };
                let there = between(&knot(0, 0.0), &knot(1, length), to).0;
                shallower(at_joint, (there - ends[n][0][1 - side]) / (to - from))
            };
            let beyond = [past(k.checked_sub(1), 0), past((k + 1 < arcs.len()).then_some(k + 1), 1)];
            Stretch { arc: arcs[k], abscissa: abscissae[k], elevation, grade, beyond }
        })
        .collect()
}

fn shallower(a: f64, b: f64) -> f64 {
    if a * b <= 0.0 {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}

/// Elevations and grades at both ends of each segment.
fn broken(arcs: &[Arc], z: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let of = |(arc, z): (&Arc, &[f64])| [[z[0], z[1]], [(z[1] - z[0]) / arc.length; 2]];
    arcs.iter().zip(z.windows(2)).map(of).collect()
}

fn smooth(abscissae: &[f64], knots: &[Knot]) -> Vec<[[f64; 2]; 2]> {
    let mut k = 0;
    let mut joints: Vec<(f64, f64)> = Vec::with_capacity(abscissae.len());
    for s in abscissae {
        while k + 2 < knots.len() && *s >= knots[k + 1].abscissa {
            k += 1;
        }
        joints.push(between(&knots[k], &knots[k + 1], s.clamp(knots[k].abscissa, knots[k + 1].abscissa)));
    }
    limit(abscissae, &mut joints);
    joints.windows(2).map(|j| [[j[0].0, j[1].0], [j[0].1, j[1].1]]).collect()
}

/// Lowers grades to three times the mean grade of the stretches beside them, at which a cubic is still monotone (Fritsch and
/// Carlson 1980). An extremum between two places is left alone.
fn limit(abscissae: &[f64], places: &mut [(f64, f64)]) {
    let mean = |places: &[(f64, f64)], a: usize| (places[a + 1].0 - places[a].0) / (abscissae[a + 1] - abscissae[a]);
    for k in 0..places.len() {
        for side in [k.checked_sub(1), (k + 1 < places.len()).then_some(k)].into_iter().flatten() {
            let (own, mean) = (places[k].1, mean(places, side));
            if mean == 0.0 || (own * mean > 0.0 && own.abs() > 3.0 * mean.abs()) {
                places[k].1 = 3.0 * mean;
            }
        }
    }
}

/// Knots whose grades are limited so that the cubics between them are monotone where the knots are.
pub(super) fn limited(mut knots: Vec<Knot>) -> Vec<Knot> {
    let abscissae: Vec<f64> = knots.iter().map(|knot| knot.abscissa).collect();
    let mut places: Vec<(f64, f64)> = knots.iter().map(|knot| (knot.elevation, knot.grade)).collect();
    limit(&abscissae, &mut places);
    for (knot, place) in knots.iter_mut().zip(places) {
        knot.grade = place.1;
    }
    knots
}
