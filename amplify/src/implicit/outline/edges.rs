//! The edges of Ω in the order of its rings, under a hierarchy of boxes: neighbours along a ring are neighbours in the plane.

use glam::DVec2;

/// A straight line from one point to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    pub a: DVec2,
    pub b: DVec2,
}

impl Segment {
    /// From its point nearest to `p`, to `p`.
    #[inline(always)]
    pub fn offset(&self, p: DVec2) -> DVec2 {
        let (from, axis) = (p - self.a, self.b - self.a);
        let squared = axis.length_squared();
        let s = if squared > 0.0 { (from.dot(axis) / squared).clamp(0.0, 1.0) } else { 0.0 };
        from - axis * s
    }
    /// Does the ray from `p` towards −x cross it? Right for a `p` that is farther from it than coordinates are rounded.
    fn is_crossed(&self, p: DVec2) -> bool {
        let Segment { a, b } = self;
        (a.y > p.y) != (b.y > p.y) && a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) < p.x
    }
}

/// An axis-parallel rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub low: DVec2,
    pub high: DVec2,
}

impl Extent {
    const EMPTY: Extent = Extent { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    /// The smallest around all points.
    pub fn of(points: impl IntoIterator<Item = DVec2>) -> Extent {
        points.into_iter().fold(Extent::EMPTY, |all, p| Extent { low: all.low.min(p), high: all.high.max(p) })
    }
    /// Wider by `reach` on every side.
    pub fn dilated(&self, reach: f64) -> Extent {
        Extent { low: self.low - reach, high: self.high + reach }
    }
    fn meets(&self, other: &Extent) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// Closed rings.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    pub all: Vec<Segment>,
    /// The first edge of every ring, then the number of edges.
    pub rings: Vec<usize>,
    /// Node k has the children 2k and 2k + 1; the last `leaves` are the edges.
    boxes: Vec<Extent>,
    leaves: usize,
}

impl Edges {
    /// Of rings whose corners follow each other; a corner within `least` of the one before is left out.
    pub fn new(rings: &[Vec<DVec2>], least: f64) -> Edges {
        let mut all = Vec::new();
        let mut starts = vec![0];
        for ring in rings {
            let mut corners: Vec<DVec2> = Vec::with_capacity(ring.len());
            for &p in ring {
                if corners.last().is_none_or(|last| last.distance(p) > least) {
                    corners.push(p);
                }
            }
            while corners.len() > 1 && corners[0].distance(corners[corners.len() - 1]) <= least {
                corners.pop();
            }
            if corners.len() > 1 {
                all.extend((0..corners.len()).map(|k| Segment { a: corners[k], b: corners[(k + 1) % corners.len()] }));
            }
            starts.push(all.len());
        }
        let leaves = all.len().next_power_of_two();
        let mut boxes = vec![Extent::EMPTY; 2 * leaves];
        for (k, edge) in all.iter().enumerate() {
            boxes[leaves + k] = Extent::of([edge.a, edge.b]);
        }
        for k in (1..leaves).rev() {
            let (left, right) = (boxes[2 * k], boxes[2 * k + 1]);
            boxes[k] = Extent { low: left.low.min(right.low), high: left.high.max(right.high) };
        }
        Edges { all, rings: starts, boxes, leaves }
    }

    /// Calls `f` with the position of every edge whose box meets `region`.
    fn each(&self, region: &Extent, mut f: impl FnMut(u32)) {
        let mut open = vec![1];
        while let Some(k) = open.pop() {
            if !self.boxes[k].meets(region) {
                continue;
            }
            if k >= self.leaves {
                f((k - self.leaves) as u32);
            } else {
                open.extend([2 * k, 2 * k + 1]);
            }
        }
    }
    /// The positions of the edges whose box meets `region`.
    pub fn among(&self, region: &Extent) -> Vec<u32> {
        let mut found = Vec::new();
        self.each(region, |k| found.push(k));
        found
    }
    /// Is `p` in Ω by the even-odd rule? Right for a `p` that is farther from every edge than coordinates are rounded.
    pub fn holds(&self, p: DVec2) -> bool {
        let ray = Extent { low: DVec2::new(f64::NEG_INFINITY, p.y), high: p };
        let mut odd = false;
        self.each(&ray, |k| odd ^= self.all[k as usize].is_crossed(p));
        odd
    }
}
