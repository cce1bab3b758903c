//! Ω ⊖ B(R), the points of a plane domain Ω that are no nearer than R to its border (Paris 2019 §5.1, Fig. 7), and the
//! distance to it.

mod border;
mod edges;
#[cfg(test)]
pub(crate) mod tests;
mod tree;

use border::{Border, Piece};
use edges::{Edges, Extent};
use glam::DVec2;
use terrain_model::bounds::plus_up;
use terrain_model::interval::Interval;
use tree::{Grower, Node, Tree};

/// The most corners of one outline.
pub const MAX_CORNERS: usize = 1 << 20;

/// The largest coordinate, metres.
const LARGEST: f64 = 1e9;

/// Times the largest coordinate, this covers what `f64` adds to a distance from an edge or a piece: a dozen operations,
/// each off by 2⁻⁵³ of differences of coordinates. It is that of the spines.
const ROUNDING: f64 = 128.0 * f64::EPSILON;

/// By how much of R less than R an edge may be away from the outline, beside the rounding of coordinates.
const SLACK: f64 = 1.0 / (1u64 << 36) as f64;

/// Why there is no outline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OutlineError {
    /// A ring that encloses nothing.
    #[error("ring {ring} of a domain has {count} corners: expected 3 or more")]
    Ring {
        /// From 0.
        ring: usize,
        /// How many.
        count: usize,
    },
    /// A corner that is no place.
    #[error("corner {corner} of ring {ring} of a domain: expected components within ±1e9 m, found {point}")]
    Corner {
        /// From 0.
        ring: usize,
        /// Its position on the ring, from 0.
        corner: usize,
        /// What was given.
        point: DVec2,
    },
    /// Too many corners.
    #[error("a domain of {count} corners: expected at most {MAX_CORNERS}; simplify its rings")]
    Many {
        /// How many.
        count: usize,
    },
    /// A radius that the coordinates do not resolve.
    #[error(
        "falloff radius {radius} m of a domain: expected {least} m or more; use a larger radius or a smaller domain"
    )]
    Radius {
        /// What was asked, metres.
        radius: f64,
        /// 2⁻¹⁶ of the domain's longer side, or 2⁻²⁵ of its largest coordinate, metres.
        least: f64,
    },
    /// A prism's floor that is no elevation.
    #[error("floor at {floor} m: expected a finite elevation")]
    Floor {
        /// What was asked, metres.
        floor: f64,
    },
    /// Nothing is left.
    #[error("no point of the domain is {radius} m from its border: use a smaller radius or a wider domain")]
    Thin {
        /// R, metres.
        radius: f64,
    },
}

/// Ω ⊖ B(R) for an Ω bounded by straight edges: its border is made of edges shifted by R and, around reflex corners, of
/// exact arcs of radius R. It may have holes and be in several pieces.
///
/// The distance to it is that to the set A of points that are on it by the test "in Ω and no edge nearer than R", or on
/// a piece of the border. Pieces are cut with a slack δ = 2⁻³⁶·R + 2⁻⁴⁵·(largest coordinate), so that none is lost by rounding:
/// Ω ⊖ B(R) ⊂ A, and every point of A is farther than R − 4δ from all edges. So a neck that is narrower than 2R by less than
/// δ still holds, as a line.
#[derive(Clone, Debug)]
pub struct Outline {
    edges: Edges,
    pieces: Vec<Piece>,
    tree: Tree,
    radius: f64,
    /// By how much a distance may be off, metres.
    error: f64,
    extent: Extent,
}

impl Outline {
    /// Of the domain whose border are the closed `rings` of corners in metres, each given once (or the first again as the
    /// last), and `radius` R in metres. A point is in Ω if a ray from it crosses the rings an odd number of times: a ring
    /// in a ring is a hole. The order of corners does not matter, and rings may cross each other and themselves.
    ///
    /// # Errors
    /// [`OutlineError`] says which ring, corner or radius cannot be used, or that nothing is left.
    pub fn eroded(rings: &[Vec<DVec2>], radius: f64) -> Result<Outline, OutlineError> {
        let size = check(rings)?;
        let all = Extent::of(rings.iter().flatten().copied());
        let side = if rings.is_empty() { 0.0 } else { (all.high - all.low).max_element() };
        let least = (side / 65_536.0).max(size / 33_554_432.0);
        if !(radius > 0.0 && radius >= least && radius <= LARGEST) {
            return Err(OutlineError::Radius { radius, least });
        }
        let error = ROUNDING * (size + 2.0 * radius);
        let edges = Edges::new(rings, f64::EPSILON * size);
        let pieces = Border { edges: &edges, radius, slack: SLACK * radius + error }.pieces();
        if pieces.is_empty() {
            return Err(OutlineError::Thin { radius });
        }
        let tree = Grower { edges: &edges, pieces: &pieces, radius, error }.grow(&all);
        // An arc bends towards its corner, away from the outline: ends are the farthest points.
        let extent = Extent::of(pieces.iter().flat_map(|piece| piece.ends(radius))).dilated(error);
        Ok(Outline { edges, pieces, tree, radius, error, extent })
    }

    /// R, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }
    /// The rectangle around it, low and high corner, rounded outward.
    pub fn extent(&self) -> [DVec2; 2] {
        [self.extent.low, self.extent.high]
    }
    /// Bytes of edges, border and tree.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.edges.all[..]) + size_of_val(&self.pieces[..]) + self.tree.bytes()
    }

    /// From the outline's nearest point to `p`; the distance itself where `p` is on the outline or in a leaf farther than R.
    #[inline(always)]
    fn offset(&self, p: DVec2) -> Result<DVec2, f64> {
        match self.tree.leaf(p) {
            Node::Inside => Err(0.0),
            Node::Far | Node::Split(_) => Err(self.radius),
            Node::Near { pieces, edges, member } => {
                let on = |edge: &u32| self.edges.all[*edge as usize].offset(p).length() >= self.radius;
                if member && self.tree.list(edges).iter().all(on) {
                    return Err(0.0);
                }
                let list = self.tree.list(pieces).iter();
                Ok(nearest(list.map(|piece| &self.pieces[*piece as usize]), p, self.radius))
            }
        }
    }
    /// The distance to it, and R where that is more: f_P is 0 from there on. Metres.
    #[inline(always)]
    pub fn distance(&self, p: DVec2) -> f64 {
        match self.offset(p) {
            Err(distance) => distance,
            Ok(offset) => offset.length().min(self.radius),
        }
    }
    /// [`Outline::distance`] with its derivatives, which are 0 where it is constant.
    #[inline(always)]
    pub fn jet(&self, p: DVec2) -> [f64; 3] {
        match self.offset(p) {
            Err(distance) => [distance, 0.0, 0.0],
            Ok(offset) => {
                let distance = offset.length();
                if distance < self.radius {
                    let direction = offset.normalize_or_zero();
                    [distance, direction.x, direction.y]
                } else {
                    [self.radius, 0.0, 0.0]
                }
            }
        }
    }
    /// The distance where all points of a rectangle have the same: 0 or R.
    pub fn constant(&self, [x, y]: [Interval; 2]) -> Option<f64> {
        let region = Extent { low: DVec2::new(x.lo(), y.lo()), high: DVec2::new(x.hi(), y.hi()) };
        self.tree.over(&region).map(|leaf| if leaf == Node::Inside { 0.0 } else { self.radius })
    }
    /// Encloses the distances of a rectangle's points, rounding included: they differ from that of its middle by half its
    /// diagonal at most.
    pub fn enclose(&self, sides: [Interval; 2]) -> Interval {
        if let Some(distance) = self.constant(sides) {
            return Interval::point(distance);
        }
        let middle = sides.map(Interval::middle);
        let half = |k: usize| (sides[k] - Interval::point(middle[k])).magnitude();
        let diagonal = terrain_model::real::Real::length(Interval::point(half(0)), Interval::point(half(1))).hi();
        let reach = plus_up(diagonal, 2.0 * self.error);
        let distance = self.distance(DVec2::from_array(middle));
        Interval::new((distance - reach).max(0.0), plus_up(distance, reach).min(self.radius))
    }
}

/// The shortest offset.
#[inline(always)]
fn nearest<'a>(pieces: impl Iterator<Item = &'a Piece>, p: DVec2, radius: f64) -> DVec2 {
    let mut least = (f64::INFINITY, DVec2::INFINITY);
    for piece in pieces {
        let offset = piece.offset(p, radius);
        let squared = offset.length_squared();
        if squared < least.0 {
            least = (squared, offset);
        }
    }
    least.1
}

/// The largest coordinate, in size.
fn check(rings: &[Vec<DVec2>]) -> Result<f64, OutlineError> {
    let count = rings.iter().map(Vec::len).sum();
    if count > MAX_CORNERS {
        return Err(OutlineError::Many { count });
    }
    let mut size = 0.0f64;
    for (ring, corners) in rings.iter().enumerate() {
        if corners.len() < 3 {
            return Err(OutlineError::Ring { ring, count: corners.len() });
        }
        for (corner, &point) in corners.iter().enumerate() {
            let largest = point.abs().max_element();
            if !(point.is_finite() && largest <= LARGEST) {
                return Err(OutlineError::Corner { ring, corner, point });
            }
            size = size.max(largest);
        }
    }
    Ok(size)
}
