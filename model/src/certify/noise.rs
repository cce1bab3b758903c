//! Certified ranges and slopes of the lattice noises, for every point and every choice of gradients at once.
//!
//! A noise is Σ wᵢ (gᵢ · dᵢ) over the corners of a cell, so with h the support function of the gradient set
//! (h(v) = max g · v) its largest value at x is Σ h(wᵢ dᵢ), and its largest slope along a direction e is
//! F(x, e) = Σ h(wᵢ e + (e · ∇wᵢ) dᵢ), each corner choosing its worst gradient on its own (claims §5). F is convex and
//! homogeneous in e: over a patch of directions it is largest at the patch's vertices. So the search runs over the
//! cell and a small polygon of directions. The corners come from the library's own formulas, run on duals of
//! intervals.

use super::{Objective, Upper, Verdict, prove_below, sharpen};
use crate::dual::Dual;
use crate::falloff::fade;
use crate::interval::Interval;
use crate::noise::corner::Corner;
use crate::noise::{gradient2, gradient3, simplex3};
use crate::real::Real;

/// A dual number over intervals along each coordinate of the cell.
type Wide<const D: usize> = Dual<Interval, D>;

/// A noise as the certificates see it: the corners of one cell and the support function of its gradients.
pub trait CellNoise<const D: usize, const C: usize>: Sync {
    /// The corners, with derivatives, over a box of the cell.
    fn corners(&self, x: [Interval; D]) -> [Corner<Wide<D>, D>; C];
    /// The corners at a point.
    fn corners_at(&self, x: [f64; D]) -> [Corner<f64, D>; C];
    /// max g · v over the gradient set.
    fn support<R: Real>(&self, v: [R; D]) -> R;
    /// True for a box that does not meet the cell.
    fn outside(&self, _x: &[Interval; D]) -> bool {
        false
    }
}

/// The coordinates as variables, and the fade and its derivative of each. The value of the fade, which increases, is
/// enclosed by its values at the ends.
fn faded<const D: usize>(x: [Interval; D]) -> ([Wide<D>; D], [(Wide<D>, Wide<D>); D]) {
    let mut t = [Dual::fixed(x[0]); D];
    for k in 0..D {
        t[k] = Dual::variable(x[k], k);
    }
    let fades = t.map(|t| {
        let (mut value, slope) = fade(t);
        let ends = [t.value.lo(), t.value.hi()].map(|x| fade(Interval::point(x)).0);
        value.value = ends[0].hull(ends[1]).meet(Interval::UNIT);
        value.slope = t.slope.map(|s| if s == Interval::ZERO { s } else { slope.value });
        (value, slope)
    });
    (t, fades)
}

/// [`gradient2`](crate::noise::NoiseValue::gradient2).
pub struct Gradient2;
impl CellNoise<2, 4> for Gradient2 {
    fn corners(&self, x: [Interval; 2]) -> [Corner<Wide<2>, 2>; 4] {
        let (t, fades) = faded(x);
        gradient2::corners(t, fades)
    }
    fn corners_at(&self, x: [f64; 2]) -> [Corner<f64, 2>; 4] {
        gradient2::corners(x, x.map(fade))
    }
    fn support<R: Real>(&self, v: [R; 2]) -> R {
        let (a, b) = (v[0].abs(), v[1].abs());
        let (long, short) = (R::constant(gradient2::LONG), R::constant(gradient2::SHORT));
        (long * a + short * b).max(short * a + long * b)
    }
}

/// max g · v over the 12 edges (±1, ±1, 0): the two largest of |vₖ|.
fn edge_support<R: Real>(v: [R; 3]) -> R {
    let [a, b, c] = v.map(R::abs);
    (a + b).max(a + c).max(b + c)
}

/// [`gradient3`](crate::noise::NoiseValue::gradient3).
pub struct Gradient3;
impl CellNoise<3, 8> for Gradient3 {
    fn corners(&self, x: [Interval; 3]) -> [Corner<Wide<3>, 3>; 8] {
        let (t, fades) = faded(x);
        gradient3::corners(t, fades)
    }
    fn corners_at(&self, x: [f64; 3]) -> [Corner<f64, 3>; 8] {
        gradient3::corners(x, x.map(fade))
    }
    fn support<R: Real>(&self, v: [R; 3]) -> R {
        edge_support(v)
    }
}

/// [`simplex3`](crate::noise::NoiseValue::simplex3) in the tetrahedron x ≥ y ≥ z of its cell; exchanging axes makes
/// the five others, and leaves the gradient set alone.
pub struct Simplex3;
impl CellNoise<3, 4> for Simplex3 {
    fn corners(&self, x: [Interval; 3]) -> [Corner<Wide<3>, 3>; 4] {
        let offset = [0, 1, 2].map(|k: usize| Dual::variable(x[k], k));
        let (one, zero) = (Dual::one(), Dual::zero());
        simplex3::corners(offset, [one, zero, zero], [one, one, zero])
    }
    fn corners_at(&self, x: [f64; 3]) -> [Corner<f64, 3>; 4] {
        simplex3::corners(x, [1.0, 0.0, 0.0], [1.0, 1.0, 0.0])
    }
    fn support<R: Real>(&self, v: [R; 3]) -> R {
        edge_support(v)
    }
    fn outside(&self, x: &[Interval; 3]) -> bool {
        let skew = (x[0] + x[1] + x[2]) / Interval::constant(3.0);
        // Skewed coordinates 1 ≥ u ≥ v ≥ w ≥ 0.
        x[0].hi() < x[1].lo() || x[1].hi() < x[2].lo() || (x[0] + skew).lo() > 1.0 || (x[2] + skew).hi() < 0.0
    }
}

/// The tetrahedron's bounding box: corners 0, (5, −1, −1)/6, (4, 4, −2)/6, (3, 3, 3)/6.
pub fn simplex_root() -> [Interval; 3] {
    let sixth =
        |a: f64, b: f64| Interval::constant(a) / Interval::constant(6.0) + Interval::constant(b) * Interval::UNIT;
    [sixth(0.0, 0.84), sixth(-1.0, 0.84), sixth(-2.0, 0.84)]
}

/// The largest value of a noise over all gradients.
pub struct Range<T>(pub T);

impl<T> Range<T> {
    fn upper<const D: usize, const C: usize>(&self, part: &[Interval; D], target: f64) -> Upper
    where
        T: CellNoise<D, C>,
    {
        let evaluate = |corners: &[Corner<Wide<D>, D>; C], _: usize| {
            let mut sum = Dual::zero();
            for corner in corners {
                sum = sum + corner.weight * self.0.support(corner.offset);
            }
            sum
        };
        let (bound, effect) = sharpen(*part, 1, target, &|x| self.0.corners(x), &evaluate);
        Upper { bound, axis: largest(effect.iter().zip(part).map(|(e, p)| e + 1e-3 * p.width())) }
    }
    fn at<const D: usize, const C: usize>(&self, x: [f64; D]) -> f64
    where
        T: CellNoise<D, C>,
    {
        self.0.corners_at(x).iter().map(|corner| corner.weight * self.0.support(corner.offset)).sum()
    }
}

macro_rules! range_objective {
    ($noise:ty, $d:literal, $c:literal) => {
        impl Objective<$d> for Range<$noise> {
            fn upper(&self, part: &[Interval; $d], target: f64) -> Upper {
                self.upper::<$d, $c>(part, target)
            }
            fn at(&self, x: [f64; $d]) -> f64 {
                if self.0.outside(&x.map(Interval::point)) {
                    return f64::NEG_INFINITY;
                }
                self.at::<$d, $c>(x)
            }
            fn outside(&self, part: &[Interval; $d]) -> bool {
                self.0.outside(part)
            }
        }
    };
}
range_objective!(Gradient2, 2, 4);
range_objective!(Gradient3, 3, 8);
range_objective!(Simplex3, 3, 4);

/// The largest slope of a noise over all gradients, along directions of one face of the cube: component `face` is 1
/// and the others, in order, are the last coordinates of the box. `ordered` keeps the directions whose free
/// components do not increase.
pub struct Slope<T> {
    /// The noise.
    pub noise: T,
    /// Which component of the direction is 1.
    pub face: usize,
    /// Leave out directions whose free components increase; their mirror images are looked at.
    pub ordered: bool,
}

/// F(x, e) over a box of corners.
fn steepness<R: Real, const D: usize, const C: usize>(
    noise: &impl CellNoise<D, C>,
    corners: &[Corner<R, D>; C],
    e: [R; D],
) -> R {
    let mut sum = R::zero();
    for Corner { weight, slope, offset } in corners {
        let rise = crate::noise::corner::dot(e, *slope);
        let mut v = e;
        for k in 0..D {
            v[k] = *weight * e[k] + rise * offset[k];
        }
        sum = sum + noise.support(v);
    }
    sum
}

impl<T> Slope<T> {
    fn direction<const D: usize>(&self, free: &[f64]) -> [f64; D] {
        let mut e = [1.0; D];
        let mut free = free.iter();
        for (k, e) in e.iter_mut().enumerate() {
            if k != self.face {
                *e = *free.next().unwrap_or(&0.0);
            }
        }
        e
    }
    fn upper<const D: usize, const C: usize>(&self, x: [Interval; D], patch: &[Interval], target: f64) -> Upper
    where
        T: CellNoise<D, C>,
    {
        // Directions are not normalised: on the patch ‖e‖ is at least this, and F(x, e) = ‖e‖ F(x, e/‖e‖).
        let mut square = Interval::constant(1.0);
        for q in patch {
            square = square + q.square();
        }
        let norm = Real::sqrt(square).lo();
        let evaluate = |corners: &[Corner<Wide<D>, D>; C], vertex: usize| {
            let mut free = [0.0; D];
            for (k, q) in patch.iter().enumerate() {
                free[k] = if vertex >> k & 1 == 1 { q.hi() } else { q.lo() };
            }
            let e = self.direction::<D>(&free).map(Wide::<D>::constant);
            steepness(&self.noise, corners, e)
        };
        let scaled = (target * norm).next_down();
        let (bound, effect) = sharpen(x, 1 << patch.len(), scaled, &|x| self.noise.corners(x), &evaluate);
        // A patch overestimates by about the square of its width; its own effect is compared with the cell's.
        let sides = effect.iter().zip(&x).map(|(e, x)| e + 0.3 * x.width());
        let turns = patch.iter().map(|q| 4.0 * q.width() * q.width().max(0.25));
        Upper { bound: (bound / norm).next_up(), axis: largest(sides.chain(turns)) }
    }
    fn at<const D: usize, const C: usize>(&self, x: [f64; D], free: &[f64]) -> f64
    where
        T: CellNoise<D, C>,
    {
        let e = self.direction::<D>(free);
        let norm = e.iter().map(|v| v * v).sum::<f64>().sqrt();
        steepness(&self.noise, &self.noise.corners_at(x), e) / norm
    }
}

fn largest(scores: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (k, score) in scores.enumerate() {
        if score > best.1 {
            best = (k, score);
        }
    }
    best.0
}

impl Objective<3> for Slope<Gradient2> {
    fn upper(&self, [x, y, q]: &[Interval; 3], target: f64) -> Upper {
        self.upper::<2, 4>([*x, *y], &[*q], target)
    }
    fn at(&self, [x, y, q]: [f64; 3]) -> f64 {
        self.at::<2, 4>([x, y], &[q])
    }
}

/// The largest derivative ∂ᵃ⁺ᵇn/∂xᵃ∂yᵇ of gradient noise in the plane over all gradients, (a, b) in [`Self::order`]: for the
/// corner weight U(x)·V(y) and the offset (d, e) it is Σ h(V⁽ᵇ⁾·(U·d)⁽ᵃ⁾, U⁽ᵃ⁾·(V·e)⁽ᵇ⁾), with (U·d)⁽ᵃ⁾ = U⁽ᵃ⁾·d + a·U⁽ᵃ⁻¹⁾.
struct Derivative {
    order: [usize; 2],
}

impl Derivative {
    fn largest<R: Real>(&self, t: [R; 2], natural: impl Fn(R) -> [R; 4]) -> R {
        let c = R::constant;
        let weights = t.map(natural);
        let mut sum = R::zero();
        for corner in 0..4 {
            let mut own = [R::zero(); 2];
            let mut with_offset = [R::zero(); 2];
            for k in 0..2 {
                let (far, order) = (corner >> k & 1 == 1, self.order[k]);
                let offset = if far { t[k] - R::one() } else { t[k] };
                let weight = |n: usize| match (far, n) {
                    (true, _) => weights[k][n],
                    (false, 0) => R::one() - weights[k][0],
                    (false, _) => -weights[k][n],
                };
                own[k] = weight(order);
                with_offset[k] = weight(order) * offset;
                if order > 0 {
                    with_offset[k] = with_offset[k] + c(order as f64) * weight(order - 1);
                }
            }
            sum = sum + Gradient2.support([own[1] * with_offset[0], own[0] * with_offset[1]]);
        }
        sum
    }
}

/// The fade and its three derivatives; each uses t about the middle, where it is even or odd.
fn fades<R: Real>(t: R) -> [R; 4] {
    let c = R::constant;
    let (value, slope) = fade(t);
    let m = t - c(0.5);
    let bump = c(0.25) - m.square();
    [value, slope, c(-120.0) * bump * m, c(360.0) * m.square() - c(30.0)]
}

impl Objective<2> for Derivative {
    fn upper(&self, part: &[Interval; 2], _: f64) -> Upper {
        let natural = |t: Interval| {
            let mut all = fades(t);
            all[0] = fade(Interval::point(t.lo())).0.hull(fade(Interval::point(t.hi())).0).meet(Interval::UNIT);
            all
        };
        let axis = usize::from(part[1].width() > part[0].width());
        Upper { bound: self.largest(*part, natural).hi(), axis }
    }
    fn at(&self, x: [f64; 2]) -> f64 {
        self.largest(x, fades)
    }
}

macro_rules! slope_in_space {
    ($noise:ty, $c:literal) => {
        impl Objective<5> for Slope<$noise> {
            fn upper(&self, [x, y, z, p, q]: &[Interval; 5], target: f64) -> Upper {
                self.upper::<3, $c>([*x, *y, *z], &[*p, *q], target)
            }
            fn at(&self, [x, y, z, p, q]: [f64; 5]) -> f64 {
                if self.noise.outside(&[x, y, z].map(Interval::point)) {
                    return f64::NEG_INFINITY;
                }
                self.at::<3, $c>([x, y, z], &[p, q])
            }
            fn outside(&self, [x, y, z, p, q]: &[Interval; 5]) -> bool {
                (self.ordered && q.lo() >= p.hi()) || self.noise.outside(&[*x, *y, *z])
            }
        }
    };
}
slope_in_space!(Gradient3, 8);
slope_in_space!(Simplex3, 4);

const HALF: fn() -> Interval = || Interval::new(0.0, 0.5);

/// Is sup|n| of gradient noise in the plane at most `target`?
pub fn gradient2_range(target: f64, budget: u64) -> Verdict<2> {
    prove_below(&Range(Gradient2), [Interval::UNIT; 2], target, budget)
}
/// Is sup‖∇n‖ of gradient noise in the plane at most `target`?
///
/// Reflecting and exchanging axes maps the cell and its 8 directions to themselves, so e = (1, q) with q in [0, 1]
/// suffices; the point reflection that is left halves the cell.
pub fn gradient2_slope(target: f64, budget: u64) -> Verdict<3> {
    let slope = Slope { noise: Gradient2, face: 0, ordered: false };
    prove_below(&slope, [HALF(), Interval::UNIT, Interval::UNIT], target, budget)
}
/// Is |∂ᵃ⁺ᵇn/∂xᵃ∂yᵇ| of gradient noise in the plane at most `target` inside every cell, `order` being [a, b], each up to 3?
/// Reflections halve the cell in both coordinates.
pub fn gradient2_curvature(order: [usize; 2], target: f64, budget: u64) -> Verdict<2> {
    prove_below(&Derivative { order }, [HALF(); 2], target, budget)
}
/// Is sup|n| of gradient noise in space at most `target`? Reflections reduce the cell to an eighth.
pub fn gradient3_range(target: f64, budget: u64) -> Verdict<3> {
    prove_below(&Range(Gradient3), [HALF(); 3], target, budget)
}
/// Is sup‖∇n‖ of gradient noise in space at most `target`? Symmetries as in the plane: e = (1, p, q), 0 ≤ q ≤ p ≤ 1.
pub fn gradient3_slope(target: f64, budget: u64) -> Verdict<5> {
    let slope = Slope { noise: Gradient3, face: 0, ordered: true };
    let unit = Interval::UNIT;
    prove_below(&slope, [HALF(), unit, unit, unit, unit], target, budget)
}
/// Is sup|n| of simplex noise in space at most `target`?
pub fn simplex3_range(target: f64, budget: u64) -> Verdict<3> {
    prove_below(&Range(Simplex3), simplex_root(), target, budget)
}
/// Is sup‖∇n‖ of simplex noise in space at most `target`? The two faces to be proved, (1, p, q) and (p, 1, q) with
/// q ≤ p: the reflection x → ½(1, 1, 1) − (z, y, x) maps the tetrahedron and the gradients to themselves and exchanges
/// the first and last component of e up to sign.
pub fn simplex3_slope(target: f64, budget: u64) -> [Verdict<5>; 2] {
    [0, 1].map(|face| prove_below(&simplex3_face(face), simplex3_slope_root(), target, budget))
}
/// The slope of simplex noise along the directions of one face, 0 or 1, of [`simplex3_slope`].
pub fn simplex3_face(face: usize) -> Slope<Simplex3> {
    Slope { noise: Simplex3, face, ordered: face == 1 }
}
/// The box of points and directions for [`simplex3_face`].
pub fn simplex3_slope_root() -> [Interval; 5] {
    let [x, y, z] = simplex_root();
    [x, y, z, Interval::symmetric(1.0), Interval::symmetric(1.0)]
}
