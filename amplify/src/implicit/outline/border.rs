//! The border of Ω ⊖ B(R): of every edge shifted by R, and of the arc of radius R around every corner, what is in Ω and no
//! nearer than R to any edge.

use super::edges::{Edges, Extent, Segment};
use glam::DVec2;

/// A part of the border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    /// Of a shifted edge.
    Line(Segment),
    /// Around a corner, from one unit vector counterclockwise to another, at most a quarter turn.
    Arc { centre: DVec2, from: DVec2, to: DVec2 },
}

impl Piece {
    /// From its point nearest to `p`, to `p`.
    #[inline(always)]
    pub fn offset(&self, p: DVec2, radius: f64) -> DVec2 {
        match self {
            Piece::Line(segment) => segment.offset(p),
            &Piece::Arc { centre, from, to } => {
                let arm = p - centre;
                let length = arm.length();
                let within = from.perp_dot(arm) >= 0.0 && arm.perp_dot(to) >= 0.0 && arm.dot(from + to) > 0.0;
                if within && length > 0.0 {
                    return arm * (1.0 - radius / length);
                }
                let [a, b] = [from, to].map(|end| arm - end * radius);
                if b.length_squared() < a.length_squared() { b } else { a }
            }
        }
    }
    /// First and last point.
    pub fn ends(&self, radius: f64) -> [DVec2; 2] {
        match *self {
            Piece::Line(Segment { a, b }) => [a, b],
            Piece::Arc { centre, from, to } => [centre + from * radius, centre + to * radius],
        }
    }
    /// Grows from the first point to the last.
    fn key(&self, p: DVec2) -> f64 {
        match *self {
            Piece::Line(Segment { a, b }) => (p - a).dot(b - a),
            Piece::Arc { centre, from, to } => (p - centre).dot(to - from),
        }
    }
    /// The part between two points of it.
    fn part(&self, a: DVec2, b: DVec2) -> Piece {
        match *self {
            Piece::Line(_) => Piece::Line(Segment { a, b }),
            Piece::Arc { centre, .. } => {
                Piece::Arc { centre, from: (a - centre).normalize_or_zero(), to: (b - centre).normalize_or_zero() }
            }
        }
    }
    fn middle(&self, radius: f64) -> DVec2 {
        match *self {
            Piece::Line(Segment { a, b }) => a.midpoint(b),
            Piece::Arc { centre, from, to } => centre + (from + to).normalize_or_zero() * radius,
        }
    }

    /// Calls `f` with the points where this piece, or what it is a part of, crosses the circle.
    fn cross_circle(&self, centre: DVec2, inner: f64, radius: f64, mut f: impl FnMut(DVec2)) {
        match *self {
            Piece::Line(Segment { a, b }) => {
                let along = (b - a).normalize_or_zero();
                let foot = a + along * (centre - a).dot(along);
                both(inner * inner - foot.distance_squared(centre), |x| f(foot + along * x));
            }
            Piece::Arc { centre: own, .. } => {
                let between = centre - own;
                let distance = between.length();
                if distance == 0.0 {
                    return;
                }
                let along = between / distance;
                let x = 0.5 * ((radius - inner) * (radius + inner) / distance + distance);
                both(radius * radius - x * x, |y| f(own + along * x + along.perp() * y));
            }
        }
    }
    /// Calls `f` with the points where this piece, or what it is a part of, crosses the line through `point` along a unit
    /// vector.
    fn cross_line(&self, point: DVec2, unit: DVec2, radius: f64, mut f: impl FnMut(DVec2)) {
        match *self {
            Piece::Line(Segment { a, b }) => {
                let (from, to) = (unit.perp_dot(a - point), unit.perp_dot(b - point));
                if (from < 0.0) != (to < 0.0) {
                    f(a + (b - a) * (from / (from - to)));
                }
            }
            Piece::Arc { centre, .. } => {
                let foot = point + unit * (centre - point).dot(unit);
                both(radius * radius - foot.distance_squared(centre), |x| f(foot + unit * x));
            }
        }
    }
}

/// Calls `f` with both roots of a square, unless there are none or one.
fn both(square: f64, mut f: impl FnMut(f64)) {
    if square > 0.0 {
        f(-square.sqrt());
        f(square.sqrt());
    }
}

/// Finds the border. Every point of the true border is kept, whatever the rounding: cuts are
/// made `slack` nearer than R, and a part is kept if its middle is no nearer than R − 2 `slack`. So a neck that is
/// narrower than 2R by a few `slack` stays, as a line.
pub(super) struct Border<'a> {
    pub edges: &'a Edges,
    /// R, metres.
    pub radius: f64,
    /// Well above what coordinates are rounded by, metres.
    pub slack: f64,
}

impl Border<'_> {
    /// All its pieces, in the order of the corners.
    pub fn pieces(&self) -> Vec<Piece> {
        let mut out = Vec::new();
        for ring in self.edges.rings.windows(2) {
            let own = &self.edges.all[ring[0]..ring[1]];
            for (k, edge) in own.iter().enumerate() {
                let across = (edge.b - edge.a).normalize_or_zero().perp() * self.radius;
                for side in [across, -across] {
                    self.trim(Piece::Line(Segment { a: edge.a + side, b: edge.b + side }), &mut out);
                }
                self.corner(edge, &own[(k + 1) % own.len()], &mut out);
            }
        }
        out
    }

    /// Around the corner between two edges of a ring lie the points that it alone is nearest to, on the outer side of the
    /// turn.
    fn corner(&self, before: &Segment, after: &Segment, out: &mut Vec<Piece>) {
        let [t, u] = [before, after].map(|edge| (edge.b - edge.a).normalize_or_zero());
        let turn = t.perp_dot(u);
        if turn == 0.0 && t.dot(u) > 0.0 {
            return;
        }
        let (from, to) = if turn > 0.0 { (-t.perp(), -u.perp()) } else { (u.perp(), t.perp()) };
        // The sum where it is long, else the difference of the directions, which is along the same bisector.
        let middle = if t.dot(u) >= 0.0 { from + to } else { t - u }.normalize_or_zero();
        let centre = after.a;
        self.trim(Piece::Arc { centre, from, to: middle }, out);
        self.trim(Piece::Arc { centre, from: middle, to }, out);
    }

    /// Adds to `out` what of `whole` belongs to the border.
    fn trim(&self, whole: Piece, out: &mut Vec<Piece>) {
        let Border { edges, radius, slack } = *self;
        let (inner, least) = (radius - slack, radius - 2.0 * slack);
        let [start, end] = whole.ends(radius);
        let middle = whole.middle(radius);
        // No point of a line, or of an arc of a quarter turn at most, is farther from its middle than its ends.
        let half = middle.distance(start).max(middle.distance(end));
        let mut near = Vec::new();
        for k in edges.among(&Extent::of([middle]).dilated(half + radius)) {
            let edge = edges.all[k as usize];
            let distance = edge.offset(middle).length();
            if distance + half < least {
                return;
            }
            if distance - half <= radius {
                near.push(edge);
            }
        }
        let last = whole.key(end);
        let mut cuts = vec![(whole.key(start), start), (last, end)];
        let first = cuts[0].0;
        let mut cut = |p: DVec2| {
            let key = whole.key(p);
            // The other half of an arc's circle has the same keys.
            if key > first && key < last && p.distance(middle) <= half {
                cuts.push((key, p));
            }
        };
        for edge in &near {
            let unit = (edge.b - edge.a).normalize_or_zero();
            let across = unit.perp() * inner;
            for (corner, side) in [(edge.a, across), (edge.b, -across)] {
                whole.cross_circle(corner, inner, radius, &mut cut);
                whole.cross_line(edge.a + side, unit, radius, &mut cut);
            }
        }
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let keep = |a: DVec2, b: DVec2| {
            let p = whole.part(a, b).middle(radius);
            near.iter().all(|edge| edge.offset(p).length() >= least) && edges.holds(p)
        };
        let mut open: Option<DVec2> = None;
        for pair in cuts.windows(2) {
            let (a, b) = (pair[0].1, pair[1].1);
            if keep(a, b) {
                open.get_or_insert(a);
            } else if let Some(from) = open.take() {
                out.push(whole.part(from, a));
            }
        }
        if let Some(from) = open {
            out.push(whole.part(from, end));
        }
    }
}
