//! Image on a convex quadrangle (Génevaux 2015 §4.2, Fig. 8), by inverse bilinear interpolation, and the machine it
//! shares with images along curves: a chain of quadrangles, each with the next's border as its own.
//!
//! A point of a quadrangle is L + u·E + v·F + u·v·G. With d = x − L and × the cross product, v solves
//! (G×F)·v² + B·v + d×E = 0 with B = E×F + d×G. At the root inside, B + 2(G×F)v = √(B² − 4(G×F)(d×E)) is det J > 0, and
//! v = 2(E×d) / (B + det J) with B + det J = 2·det J(u, 0): the denominator is never small and nothing cancels, for
//! parallelograms too. u is found the same way.

use super::image::{Image, edge, weights_of};
use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, times_up};
use crate::dual::Dual;
use crate::interval::Interval;
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Finite, Point, Positive, Scope, one};
use glam::DVec2;
use serde::Deserialize;
use std::sync::Arc;

/// How an image is spread over quadrangles.
#[derive(Clone, Debug)]
pub struct Spread {
    /// The raster; u runs along its rows, v along its columns.
    pub image: Arc<Image>,
    /// Weights ≥ 0 as samples spread over the same quadrangles; they multiply `weight`.
    pub weights: Option<Arc<Image>>,
    /// Weight inside.
    pub weight: f64,
    /// Share of the width and of the length over which the weight rises from each border, in (0, 1/2].
    pub margin: [f64; 2],
    /// Factor of the samples.
    pub elevation_scale: f64,
    /// Metres added to the scaled samples.
    pub elevation_offset: f64,
}

/// An image on a convex quadrangle.
#[derive(Clone, Debug)]
pub struct Quad {
    /// What is spread.
    pub spread: Spread,
    /// The corners of the image, anticlockwise from the one of sample (0, 0), metres.
    pub corners: [DVec2; 4],
}

/// A quadrangle in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    file: String,
    corners: (Point, Point, Point, Point),
    #[serde(default = "tenth")]
    margin: Positive,
    #[serde(default = "one")]
    weight: Positive,
    #[serde(default)]
    weight_file: Option<String>,
    #[serde(default = "unit")]
    elevation_scale: Finite,
    #[serde(default)]
    elevation_offset: Finite,
}

pub(super) fn unit() -> Finite {
    Finite::of(1.0)
}
pub(super) fn tenth() -> Positive {
    Positive::of(0.1)
}
pub(super) fn point(p: Point) -> DVec2 {
    DVec2::new(p.0.into(), p.1.into())
}

impl File {
    pub(crate) fn build(&self, scope: &mut Scope<'_>) -> Result<Quad, String> {
        let (a, b, c, d) = self.corners;
        let spread = Spread {
            image: scope.image(&self.file, None)?.image,
            weights: self.weight_file.as_deref().map(|file| scope.image(file, None)).transpose()?.map(|w| w.image),
            weight: self.weight.into(),
            margin: [self.margin.into(); 2],
            elevation_scale: self.elevation_scale.into(),
            elevation_offset: self.elevation_offset.into(),
        };
        Ok(Quad { spread, corners: [a, b, c, d].map(point) })
    }
}

impl Authored for Quad {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let [a, b, c, d] = self.corners;
        chain(&self.spread, &[Section { left: a, right: b, at: 0.0 }, Section { left: d, right: c, at: 1.0 }], out)
    }
}

/// A border between two quadrangles of a chain, or an end of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Where u = 0.
    pub left: DVec2,
    /// Where u = 1.
    pub right: DVec2,
    /// Which row of the image lies here, 0 the first and 1 the last.
    pub at: f64,
}

/// Parameters before the sections: weight, 1/margin along u and v, elevation scale and offset, largest weight sample,
/// cells of the image along u and v, cells of the weights along u and v.
const HEADER: usize = 10;
/// Of a section: left end L, extent E to the right end, row. Of the quadrangle that follows: F, G, E×F, G×F, E×G, least
/// det J, largest ‖J⁻¹‖. The last section has none.
const STRIDE: usize = 14;

/// A compiled chain of quadrangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    image: u16,
    weights: Option<u16>,
    pieces: u16,
}

fn cross<R: Real>(a: [R; 2], b: [R; 2]) -> R {
    a[0] * b[1] - a[1] * b[0]
}

/// Compiles a chain; each quadrangle must be convex and turn left from u to v.
pub(super) fn chain(spread: &Spread, sections: &[Section], out: &mut Layout) -> Result<Code, String> {
    let Spread { image, weights, weight, margin, elevation_scale, elevation_offset } = spread;
    let finite = sections.iter().all(|s| s.left.is_finite() && s.right.is_finite());
    let finite = finite && weight.is_finite() && elevation_scale.is_finite() && elevation_offset.is_finite();
    if !(finite && *weight > 0.0) {
        return Err("a mapped image needs finite corners and elevations and a positive weight".to_owned());
    }
    if !margin.iter().all(|m| *m > 0.0 && *m <= 0.5) {
        return Err("the margin of a mapped image is a share of its side, above 0 and at most 0.5".to_owned());
    }
    let cells = |image: &Image| [image.width() as f64 - 1.0, image.height() as f64 - 1.0];
    let [columns, rows] = cells(image);
    let weights = weights_of(image, weights.as_ref(), [margin[0] * columns, margin[1] * rows])?;
    let (largest, weight_cells) = weights.as_ref().map_or((1.0, [0.0; 2]), |w| (w.range().hi(), cells(w)));
    let mut p = vec![*weight, 1.0 / margin[0], 1.0 / margin[1], *elevation_scale, elevation_offset + 0.0, largest];
    p.extend([columns, rows, weight_cells[0], weight_cells[1]]);
    for (k, here) in sections.iter().enumerate() {
        let e = here.right - here.left;
        p.extend([here.left.x, here.left.y, e.x, e.y, here.at]);
        let Some(next) = sections.get(k + 1) else { break };
        let (f, g) = (next.left - here.left, next.right - next.left - e);
        let [e, f, g] = [e, f, g].map(|v| v.to_array().map(Interval::point));
        // det J = E×F + u·E×G + v·G×F is affine and ‖J‖_F is convex in (u, v): the corners hold both extremes (claims G20).
        let (mut least, mut largest) = (f64::INFINITY, 0.0f64);
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let [u, v] = [u, v].map(Interval::point);
            let columns = [0, 1].map(|axis| [e[axis] + v * g[axis], f[axis] + u * g[axis]]);
            least = least.min((columns[0][0] * columns[1][1] - columns[1][0] * columns[0][1]).lo());
            let squares = columns.as_flattened().iter().fold(Interval::ZERO, |sum, x| sum + x.square());
            largest = largest.max(Real::sqrt(squares).hi());
        }
        if least <= 0.0 {
            return Err(format!(
                "quadrangle {k} of a mapped image is not convex with corners anticlockwise; expected each to turn left"
            ));
        }
        let middle = |x: Interval| x.middle();
        p.extend([f[0], f[1], g[0], g[1], cross(e, f), cross(g, f), cross(e, g)].map(middle));
        p.extend([least, (Interval::point(largest) / Interval::point(least)).hi()]);
    }
    let image = out.image(image)?;
    let weights = weights.map(|weights| out.image(&weights)).transpose()?;
    Ok(Code { at: out.store(p), image, weights, pieces: (sections.len() - 1) as u16 })
}

/// A quadrangle with the position of a point in it.
struct Place<R: Real> {
    /// Holds where the point lies inside. Of two quadrangles with a common border it holds for one exactly.
    inside: R::Mask,
    uv: [R; 2],
}

/// Where `x` lies in the quadrangle that starts at `p`.
#[inline(always)]
fn place<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, x: [R; 2]) -> Place<R> {
    let from = |k: usize| [x[0] - p.get::<R>(k), x[1] - p.get::<R>(k + 1)];
    let (d, e) = (from(0), p.pair::<R>(2));
    let (f, g) = (p.pair::<R>(5), p.pair::<R>(7));
    let two = R::constant(2.0);
    let least = p.get::<R>(12);
    let (ef, gf, eg) = (p.get::<R>(9), p.get::<R>(10), p.get::<R>(11));
    let dg = cross(d, g);
    let (along_v, along_u) = (cross(e, d), cross(d, f));
    // The same two numbers decide for the quadrangle on the other side of a border.
    let (entered, left) = (along_v, cross(p.pair::<R>(STRIDE + 2), from(STRIDE)));
    let right = [d[0] - e[0], d[1] - e[1]];
    let to_right = cross([f[0] + g[0], f[1] + g[1]], right);
    let inside = entered.less(R::zero()).not().and(left.less(R::zero()));
    let inside = inside.and(R::zero().less(along_u)).and(R::zero().less(to_right));
    let b = ef + dg;
    // Inside, det J is at least its least corner: the clamp changes nothing there and keeps enclosures bounded.
    let discriminant = b.square() + R::constant(4.0) * gf * along_v;
    let determinant = discriminant.max(least.square()).sqrt();
    let positive = |sum: R| sum.max(two * least);
    let mut v = (two * along_v / positive(b + determinant)).clamp01();
    let mut u = (two * along_u / positive(ef - dg + determinant)).clamp01();
    if R::ENCLOSES {
        // u and v from each other: what both forms allow.
        u = u.tighten((along_u / (ef + v * gf).max(least)).clamp01());
        v = v.tighten((along_v / (ef + u * eg).max(least)).clamp01());
    }
    Place { inside, uv: [u, v] }
}

/// Row of the image at v of the quadrangle that starts at `p`.
#[inline(always)]
fn row<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, v: R) -> R {
    p.get::<R>(4) + v * (p.get::<R>(STRIDE + 4) - p.get::<R>(4))
}

/// The weight at (u, row) without the weight image.
#[inline(always)]
fn fade<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, u: R, row: R) -> R {
    let half = R::constant(0.5);
    let from_edge = |x: R| half - (x - half).abs();
    p.get::<R>(0) * edge(from_edge(u), p.get(1)) * edge(from_edge(row), p.get(2))
}

impl Code {
    /// Elevation and weight at (u, row).
    #[inline(always)]
    fn shade<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, u: R, row: R) -> (R, R) {
        let at = [u * p.get::<R>(6), row * p.get::<R>(7)];
        let elevation = R::lookup(&tables.images[usize::from(self.image)], [0, 0], at) * p.get::<R>(3) + p.get::<R>(4);
        let mut weight = fade(p, u, row);
        if let Some(weights) = self.weights {
            let at = [u * p.get::<R>(8), row * p.get::<R>(9)];
            weight = weight * R::spline(&tables.images[usize::from(weights)], [0, 0], at);
        }
        (elevation, weight)
    }
    /// Where the sections start.
    fn pieces(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        (0..usize::from(self.pieces)).map(|k| HEADER + k * STRIDE)
    }
    /// The sections, for [`Leaf::support`] and [`Leaf::rebase`].
    fn sections(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        (0..=usize::from(self.pieces)).map(|k| HEADER + k * STRIDE)
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, u32::from(self.image), u32::from(self.pieces)]);
        out.extend(self.weights.map(u32::from));
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let (mut elevation, mut weight) = (R::zero(), R::zero());
        let mut met = false;
        for start in self.pieces() {
            let piece = p.from(start);
            let place = place::<R, P>(piece, x);
            if !place.inside.may_hold() {
                continue;
            }
            let [u, v] = place.uv;
            let (f, a) = self.shade(p, tables, u, row(piece, v));
            elevation = if met { R::select(place.inside, f, elevation) } else { f };
            weight = R::select(place.inside, a, weight);
            met = true;
        }
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        let mut range = Interval::ZERO;
        for start in self.pieces() {
            let piece = p.from(start);
            let place = place::<Interval, f64>(piece, region.extent);
            if place.inside.may_hold() {
                let weight = fade(p, place.uv[0], row(piece, place.uv[1])) * Interval::new(0.0, p.0[5]);
                range = range.hull(weight);
            }
        }
        Interval::new(range.lo().max(0.0), range.hi().max(0.0))
    }
    /// Over each quadrangle the formula in (u, v) on duals, carried to the plane by J⁻ᵀ over the range of (u, v), and at
    /// most λ_uv · ‖J⁻¹‖ with ‖J⁻¹‖ ≤ max ‖J‖_F / min det J over the corners (claims G20). Across a common border the
    /// elevation is continuous, so that the steepest quadrangle bounds the chain.
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
        let mut whole: Option<Bounds> = None;
        for start in self.pieces() {
            let piece = p.from(start);
            let place = place::<Interval, f64>(piece, region.extent);
            if !place.inside.may_hold() {
                continue;
            }
            let [u, v] = [Dual::<Interval, 2>::variable(place.uv[0], 0), Dual::variable(place.uv[1], 1)];
            let (f, a) = self.shade(p, tables, u, row(piece, v));
            if a.value.hi() <= 0.0 {
                continue;
            }
            let get = |k: usize| Interval::point(piece.0[k]);
            let [u, v] = place.uv;
            let (least, inverse) = (piece.0[12], piece.0[13]);
            let determinant = get(9) + u * get(11) + v * get(10);
            let determinant = Interval::new(determinant.lo().max(least), determinant.hi().max(least));
            let (along_u, along_v) =
                ([get(2) + v * get(7), get(3) + v * get(8)], [get(5) + u * get(7), get(6) + u * get(8)]);
            let carried = |slope: [Interval; 2]| {
                let x = (slope[0] * along_v[1] - slope[1] * along_u[1]) / determinant;
                let y = (slope[1] * along_u[0] - slope[0] * along_v[0]) / determinant;
                Interval::length(x, y).hi().min(times_up(Interval::length(slope[0], slope[1]).hi(), inverse))
            };
            let inside = place.inside.must_hold();
            let weight = Interval::new(if inside { a.value.lo().max(0.0) } else { 0.0 }, a.value.hi());
            let b = Bounds::primitive(f.value, weight, carried(f.slope), carried(a.slope));
            whole = Some(whole.map_or(b, |w| Bounds {
                elevation: w.elevation.hull(b.elevation),
                weight: w.weight.hull(b.weight),
                slope: w.slope.max(b.slope),
                support_slope: w.support_slope.max(b.support_slope),
                weight_slope: w.weight_slope.max(b.weight_slope),
                weighted_slope: w.weighted_slope.max(b.weighted_slope),
            }));
        }
        whole.unwrap_or(Bounds::ABSENT)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        let corners = self.sections().flat_map(|k| {
            let left = DVec2::new(p.0[k], p.0[k + 1]);
            [left, left + DVec2::new(p.0[k + 2], p.0[k + 3])]
        });
        let size = corners.clone().fold(0.0f64, |size, c| size.max(c.length()));
        around(corners, 1e-9 * size)
    }
    fn rebase(&self, p: Parameters<f64>, _: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let mut moved = p.0[..HEADER + usize::from(self.pieces) * STRIDE + 5].to_vec();
        for k in self.sections() {
            moved[k] -= origin.x;
            moved[k + 1] -= origin.y;
        }
        Code { at: tile.store(moved), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Program;
    use crate::tree::Tree;
    use proptest::prelude::*;

    fn compile(corners: [DVec2; 4], samples: Vec<f32>) -> Result<Program, String> {
        let image = Arc::new(Image::new(2, 2, samples).expect("a valid image"));
        let spread =
            Spread { image, weights: None, weight: 1.0, margin: [0.1; 2], elevation_scale: 1.0, elevation_offset: 0.0 };
        let mut tree = Tree::new();
        let root = tree.push(Quad { spread, corners });
        Program::compile(&tree, root).map_err(|error| error.problem)
    }
    fn bilinear(c: [DVec2; 4], u: f64, v: f64) -> DVec2 {
        c[0] * (1.0 - u) * (1.0 - v) + c[1] * u * (1.0 - v) + c[2] * u * v + c[3] * (1.0 - u) * v
    }

    proptest! {
        #[test]
        fn the_inverse_of_a_bilinear_map_is_found(dx in prop::array::uniform4(-60.0f64..60.0), dy in prop::array::uniform4(-60.0f64..60.0), u in 0.01f64..0.99, v in 0.01f64..0.99, straight: bool) {
            let square = [(0.0, 0.0), (200.0, 0.0), (200.0, 200.0), (0.0, 200.0)].map(DVec2::from);
            let mut corners = square;
            for k in 0..4 {
                corners[k] += DVec2::new(dx[k], dy[k]) + DVec2::splat(1000.0);
            }
            if straight {
                corners[2] = corners[1] + corners[3] - corners[0];
            }
            // Elevation u, then elevation v: the image is the parametrization.
            if let Ok(program) = compile(corners, vec![0.0, 1.0, 0.0, 1.0]) {
                let across = compile(corners, vec![0.0, 0.0, 1.0, 1.0]).expect("the same corners");
                let at = bilinear(corners, u, v);
                let (got_u, got_v) = (program.height(at).0, across.height(at).0);
                prop_assert!((got_u - u).abs() < 1e-9 && (got_v - v).abs() < 1e-9, "{got_u} {u} {got_v} {v}");
                // Control: a point moved by a millimetre has another place.
                let off = at + DVec2::new(1e-3, 0.0);
                prop_assert!((program.height(off).0 - u).abs() + (across.height(off).0 - v).abs() > 1e-7);
            }
        }
    }

    #[test]
    fn the_slope_grows_as_a_corner_flattens_and_stays_within_the_bound() {
        // Claims G20: sup ‖J⁻¹‖ is 5, 50, 500 for d = 0.1, 0.01, 0.001 on the unit square with this corner.
        let mut factors = Vec::new();
        for d in [0.1, 0.01, 0.001] {
            let corners = [DVec2::ZERO, DVec2::X, DVec2::splat(0.5 + d), DVec2::Y].map(|c| c * 100.0);
            let program = compile(corners, vec![0.0, 100.0, 0.0, 100.0]).expect("convex");
            let bounds = program.bounds(Region::rectangle(DVec2::ZERO, DVec2::splat(100.0)));
            let mut steepest = 0.0f64;
            for k in 0..400 {
                let s = 1.0 - 1e-4 * f64::from(k) / 400.0;
                let sample = program.sample(bilinear(corners, s, s));
                steepest = steepest.max(sample.gradient.length());
            }
            assert!(steepest <= bounds.slope && bounds.slope < 4.0 * steepest, "{steepest} {bounds:?}");
            factors.push(steepest);
        }
        // Control: by the bound of the undeformed image, √2, every one of these would be wrong.
        assert!(factors[0] > 2.0 && factors[1] > 20.0 && factors[2] > 200.0, "{factors:?}");
    }

    #[test]
    fn a_quadrangle_that_is_not_convex_is_refused() {
        let corners = [DVec2::ZERO, DVec2::X, DVec2::splat(0.4), DVec2::Y].map(|c| c * 100.0);
        assert!(compile(corners, vec![0.0; 4]).unwrap_err().contains("convex"));
        let clockwise = [DVec2::ZERO, DVec2::Y, DVec2::ONE, DVec2::X];
        assert!(compile(clockwise, vec![0.0; 4]).unwrap_err().contains("anticlockwise"));
    }

    #[test]
    fn off_the_quadrangle_there_is_no_weight() {
        let corners = [(0.0, 0.0), (200.0, 30.0), (260.0, 180.0), (-20.0, 150.0)].map(DVec2::from);
        let program = compile(corners, vec![1.0, 2.0, 3.0, 4.0]).expect("convex");
        let inside = |p: DVec2| (0..4).all(|k| (corners[(k + 1) % 4] - corners[k]).perp_dot(p - corners[k]) > 0.0);
        let mut counts = [0, 0];
        for k in 0..100 * 100 {
            let p = DVec2::new(-200.0 + 6.0 * f64::from(k % 100), -200.0 + 6.0 * f64::from(k / 100));
            let weight = program.height(p).1;
            assert_eq!(weight > 0.0, inside(p), "{p}");
            counts[usize::from(weight > 0.0)] += 1;
        }
        assert!(counts[0] > 1000 && counts[1] > 500, "{counts:?}");
    }
}
