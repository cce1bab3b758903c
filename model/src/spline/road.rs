//! The course of a road: straights, and at each way-point a clothoid, an arc of a circle and a clothoid, whose curvature
//! rises and falls linearly. Clothoids are then fitted by biarcs as other curves are.

use super::Arc;
use super::biarc::{Planar, fit};
use super::elevation::{Elevations, monotone};
use glam::{DVec2, DVec3};

/// Where the straights of a road would meet. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayPoint {
    /// Position; z is the elevation of the road in the middle of its curve.
    pub position: DVec3,
    /// Radius of the circle; at the ends of a road without meaning.
    pub radius: f64,
    /// Length of each clothoid; shortened where two of them would turn farther than the way does.
    pub transition: f64,
}

/// One clothoid: curvature from 0 at `origin` to ±1/(radius) after `length` metres.
struct Clothoid {
    origin: DVec2,
    /// Tangent at the origin, in the direction of the curve.
    direction: DVec2,
    radius: f64,
    length: f64,
    /// 1 to the left, −1 to the right.
    hand: f64,
    /// It ends at its origin instead of starting there.
    leaving: bool,
}

/// The standard clothoid of a radius and length: coordinates after `s` metres, and the angle turned by, radians.
fn standard(radius: f64, length: f64, s: f64) -> (DVec2, f64) {
    let angle = s * s / (2.0 * radius * length);
    let (mut x, mut y) = (0.0, 0.0);
    let mut term = 1.0;
    // x + iy = s·Σ (i·angle)ⁿ / (n!·(2n + 1)); at most half a turn, so 40 terms are below the last bit.
    for n in 0..40 {
        let part = term / f64::from(2 * n + 1);
        match n % 4 {
            0 => x += part,
            1 => y += part,
            2 => x -= part,
            _ => y -= part,
        }
        term *= angle / f64::from(n + 1);
    }
    (s * DVec2::new(x, y), angle)
}

impl Planar for Clothoid {
    fn at(&self, t: f64) -> (DVec2, DVec2) {
        let s = self.length * if self.leaving { 1.0 - t } else { t };
        let (p, angle) = standard(self.radius, self.length, s);
        let along = if self.leaving { -self.direction } else { self.direction };
        let left = self.hand * self.direction.perp();
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        let sin = if self.leaving { -sin } else { sin };
        (self.origin + p.x * along + p.y * left, self.length * (cos * self.direction + sin * left))
    }
}

/// The bend at a way-point: how far before and after it the bend starts and ends, and its parts.
struct Bend {
    reach: f64,
    transition: f64,
    /// Angle of the arc between the clothoids, radians.
    turn: f64,
    hand: f64,
}

fn bend(point: &WayPoint, arriving: DVec2, leaving: DVec2) -> Result<Option<Bend>, String> {
    let angle = libm::atan2(arriving.perp_dot(leaving), arriving.dot(leaving));
    if angle.abs() < 1e-9 {
        return Ok(None);
    }
    let WayPoint { radius, transition, .. } = *point;
    if !(radius > 0.0 && radius.is_finite() && transition >= 0.0 && transition.is_finite()) {
        return Err("needs a positive radius and a transition of at least 0 m".to_owned());
    }
    if angle.abs() > 3.0 {
        return Err("turns back on itself; make a hairpin of two way-points".to_owned());
    }
    let transition = transition.min(angle.abs() * radius);
    let (end, turned) = if transition > 0.0 { standard(radius, transition, transition) } else { (DVec2::ZERO, 0.0) };
    let centre = DVec2::new(end.x - radius * libm::sin(turned), end.y + radius * libm::cos(turned));
    let reach = centre.x + centre.y * libm::tan(0.5 * angle.abs());
    Ok(Some(Bend { reach, transition, turn: angle.abs() - 2.0 * turned, hand: angle.signum() }))
}

/// The arcs of a road, and its elevation: that of each way-point in the middle of its bend.
pub(super) fn chain(points: &[WayPoint], tolerance: f64) -> Result<(Vec<Arc>, Elevations), String> {
    let place = |k: usize| points[k].position.truncate();
    let direction = |k: usize| (place(k + 1) - place(k)).normalize();
    let last = points.len() - 1;
    let mut bends: Vec<Option<Bend>> = vec![None];
    for k in 1..last {
        let here = bend(&points[k], direction(k - 1), direction(k));
        bends.push(here.map_err(|problem| format!("way-point {} of a road {problem}", k + 1))?);
    }
    bends.push(None);
    let reach = |k: usize| bends[k].as_ref().map_or(0.0, |bend| bend.reach);
    if let Some(k) = (0..last).find(|&k| reach(k) + reach(k + 1) > place(k).distance(place(k + 1))) {
        return Err(format!(
            "the bends at way-points {} and {} of a road need {:.1} m between them and have {:.1} m; use smaller radii or \
             shorter transitions",
            k + 1,
            k + 2,
            reach(k) + reach(k + 1),
            place(k).distance(place(k + 1))
        ));
    }
    let mut arcs: Vec<Arc> = Vec::new();
    let mut known = vec![DVec2::new(0.0, points[0].position.z)];
    let total = |arcs: &[Arc]| arcs.iter().map(|arc| arc.length).sum::<f64>();
    let mut from = place(0);
    for k in 1..=last {
        let (u, to) = (direction(k - 1), place(k) - direction(k - 1) * reach(k));
        arcs.extend(Arc::segment(from, to).filter(|arc| arc.length > 1e-9 * total(&arcs)));
        from = to;
        let before = total(&arcs);
        if let Some(bend) = &bends[k] {
            let v = direction(k);
            let end = place(k) + v * bend.reach;
            let Bend { transition, hand, .. } = *bend;
            let clothoid = |origin: DVec2, direction: DVec2, leaving: bool| Clothoid {
                origin,
                direction,
                radius: points[k].radius,
                length: transition,
                hand,
                leaving,
            };
            let (arriving, leaving) = (clothoid(from, u, false), clothoid(end, v, true));
            if transition > 0.0 {
                arcs.extend(fit(&arriving, tolerance)?.into_iter().flat_map(|piece| piece.arcs));
            }
            if bend.turn > 1e-9 {
                let (start, tangent) = if transition > 0.0 { arriving.at(1.0) } else { (from, u) };
                let curvature = hand / points[k].radius;
                let arc = Arc { start, tangent: tangent.normalize(), curvature, length: bend.turn * points[k].radius };
                arcs.extend(arc.split(libm::ceil(bend.turn / super::biarc::TURN) as usize));
            }
            if transition > 0.0 {
                arcs.extend(fit(&leaving, tolerance)?.into_iter().flat_map(|piece| piece.arcs));
            }
            from = end;
        }
        known.push(DVec2::new(0.5 * (before + total(&arcs)), points[k].position.z));
    }
    Ok((arcs, Elevations::Smooth(monotone(&known))))
}
