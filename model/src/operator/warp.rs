//! Warp of the plane by compact displacements (Génevaux 2015 §5.4, Fig. 14): f = f_A∘ω⁻¹, α = α_A∘ω⁻¹.
//!
//! What is stored and evaluated is ω⁻¹(p) = p + δ(p), δ = Σ aᵢ·(1 − ‖p−cᵢ‖²/rᵢ²)₊³. A bijection that is C² need not
//! keep slopes bounded (claims G26: (x³, y)); here sup ‖Dδ‖ < 1 is certified when a warp is made, so that ω exists, is C²,
//! and both maps have bounded derivatives. (1−u)₊³ and its first two derivatives vanish at u = 1, and u is a polynomial
//! of p: δ is C².

use super::Frame;
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::certify::cover::largest_over;
use crate::detail::Focus;
use crate::dual::Dual;
use crate::falloff::{WYVILL_SLOPE, wyvill};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters, around};
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, Real};
use glam::{DMat2, DVec2};

/// A displacement around a point. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Where it is strongest.
    pub centre: DVec2,
    /// How far it reaches.
    pub radius: f64,
    /// How the terrain at the centre moves, to first order: aᵢ = −shift.
    pub shift: DVec2,
}

/// A warp that is certified to be a diffeomorphism.
#[derive(Clone, Debug, PartialEq)]
pub struct Warp {
    parameters: Vec<f64>,
}

/// The most controls of one warp; more are nested.
pub const MAX_CONTROLS: usize = 64;

/// Parameters before those of the controls: certified sup ‖Dδ‖, a bound of sup ‖δ‖.
const HEADER: usize = 2;
/// Of a control: centre, 1/r², a.
const STRIDE: usize = 5;
/// Boxes that certifying one warp looks at.
const BUDGET: usize = 6000;

impl Warp {
    /// A warp by these controls.
    ///
    /// # Errors
    /// When values are not finite or a radius is not positive, and when δ cannot be certified to be steep less than 1:
    /// then the warp might fold.
    pub fn new(controls: &[Control]) -> Result<Warp, String> {
        let sound = |c: &Control| c.centre.is_finite() && c.shift.is_finite() && c.radius > 0.0 && c.radius.is_finite();
        if controls.is_empty() || controls.len() > MAX_CONTROLS || !controls.iter().all(sound) {
            return Err(format!("a warp needs 1 to {MAX_CONTROLS} controls with finite values and positive radii"));
        }
        let mut parameters = vec![0.0, 0.0];
        let mut whole: Option<[Interval; 2]> = None;
        let mut reach = 0.0;
        let mut finest = f64::INFINITY;
        for c in controls {
            parameters.extend([c.centre.x, c.centre.y, 1.0 / (c.radius * c.radius), -c.shift.x, -c.shift.y]);
            let around = c.centre.to_array().map(|x| Interval::point(x) + Interval::symmetric(c.radius));
            whole = Some(whole.map_or(around, |w| [w[0].hull(around[0]), w[1].hull(around[1])]));
            reach = plus_up(reach, c.shift.length().next_up());
            finest = finest.min(c.radius);
        }
        let Some(whole) = whole else { return Err("a warp needs controls".to_owned()) };
        let p = Parameters(&parameters[..]);
        let slope = |x| displacement_slope(p, controls.len(), x);
        // The sum of the controls' own slopes settles most warps; where they overlap too much for it, parts are looked at.
        let mut steepness = slope(whole);
        if steepness >= 1.0 {
            steepness = largest_over(whole, finest / 256.0, BUDGET, |x| Some(slope(x)).filter(|slope| *slope > 0.0));
        }
        if steepness >= 1.0 {
            return Err(format!(
                "a warp may fold: its displacement is as steep as {steepness:.3}, expected below 1; shift less or widen radii"
            ));
        }
        (parameters[0], parameters[1]) = (steepness, reach);
        Ok(Warp { parameters })
    }
    /// Certified sup ‖Dδ‖ < 1.
    pub fn steepness(&self) -> f64 {
        self.parameters[0]
    }
    fn count(&self) -> usize {
        (self.parameters.len() - HEADER) / STRIDE
    }
    /// ω⁻¹: where the terrain that stands at `p` comes from.
    pub fn source(&self, p: DVec2) -> DVec2 {
        DVec2::from_array(enter::<f64, f64>(Parameters(&self.parameters), self.count(), p.to_array()))
    }
    /// J of ω⁻¹ at `p`, by its formula: I + Σ aᵢ ∇wᵢᵀ, ∇wᵢ = −6(1−u)₊²·(p−cᵢ)/rᵢ². The gradient of a warped elevation
    /// is Jᵀ·g for a column vector g (claims G27).
    pub fn jacobian(&self, p: DVec2) -> DMat2 {
        self.parameters[HEADER..].chunks_exact(STRIDE).fold(DMat2::IDENTITY, |j, c| {
            let d = p - DVec2::new(c[0], c[1]);
            let left = (1.0 - d.length_squared() * c[2]).max(0.0);
            let slope = d * (-6.0 * left * left * c[2]);
            let a = DVec2::new(c[3], c[4]);
            j + DMat2::from_cols(a * slope.x, a * slope.y)
        })
    }
    /// ω: where the terrain of `q` comes to stand, within `tolerance` metres; `None` when rounding forbids the tolerance.
    ///
    /// p ← q − δ(p) contracts by sup ‖Dδ‖ = L, and p is off by at most ‖p + δ(p) − q‖ / (1 − L).
    pub fn target(&self, q: DVec2, tolerance: f64) -> Option<DVec2> {
        let mut p = q;
        let steepness = self.steepness();
        // L^n < 1e-18 of the reach, and a few more for rounding.
        let rounds = if steepness > 0.0 { (-42.0 / libm::log(steepness)) as usize + 8 } else { 8 };
        for _ in 0..rounds.min(1_000_000) {
            let off = self.source(p) - q;
            if off.length() <= tolerance * (1.0 - steepness) {
                return Some(p);
            }
            p -= off;
        }
        None
    }
    pub(crate) fn compile(&self, out: &mut Layout) -> Code {
        Code { at: out.store(self.parameters.iter().copied()), controls: self.count() as u16 }
    }
}

/// A compiled warp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    at: u32,
    controls: u16,
}

/// ω⁻¹ at `x`.
#[inline(always)]
fn enter<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, count: usize, x: [R; 2]) -> [R; 2] {
    let [dx, dy] = displacement(p, count, x);
    [x[0] + dx, x[1] + dy]
}

#[inline(always)]
fn displacement<R: Number, P: Copy + Into<f64>>(p: Parameters<P>, count: usize, x: [R; 2]) -> [R; 2] {
    let mut sum = [R::zero(); 2];
    for control in 0..count {
        let k = HEADER + control * STRIDE;
        let c = p.pair::<R>(k);
        let u = ((x[0] - c[0]).square() + (x[1] - c[1]).square()) * p.get(k + 2);
        let w = wyvill(u);
        sum = [sum[0] + w * p.get(k + 3), sum[1] + w * p.get(k + 4)];
    }
    sum
}

/// A bound of the spectral norm of a matrix of intervals: ‖M‖² ≤ ‖M‖₁·‖M‖∞, and the Frobenius norm.
fn norm(m: [[Interval; 2]; 2]) -> f64 {
    let a = m.map(|row| row.map(Interval::magnitude));
    let row = plus_up(a[0][0], a[0][1]).max(plus_up(a[1][0], a[1][1]));
    let column = plus_up(a[0][0], a[1][0]).max(plus_up(a[0][1], a[1][1]));
    let squares = m.as_flattened().iter().fold(Interval::ZERO, |sum, x| sum + x.square());
    Real::sqrt(Interval::point(times_up(row, column))).hi().min(Real::sqrt(squares).hi())
}

/// Dδ over a box.
fn displacement_matrix(p: Parameters<f64>, count: usize, x: [Interval; 2]) -> [[Interval; 2]; 2] {
    let x = [Dual::<Interval, 2>::variable(x[0], 0), Dual::variable(x[1], 1)];
    displacement(p, count, x).map(|d| d.slope)
}
/// sup ‖Dδ‖ over a box: the norm of its matrix, and at most Σ ‖aᵢ‖·|g′| with |g′| = 6·√u·(1−u)²/r, which is largest at
/// u = 1/5.
fn displacement_slope(p: Parameters<f64>, count: usize, x: [Interval; 2]) -> f64 {
    let mut sum = 0.0;
    for c in p.0[HEADER..HEADER + count * STRIDE].chunks_exact(STRIDE) {
        let point = Interval::point;
        let u = ((x[0] - point(c[0])).square() + (x[1] - point(c[1])).square()) * point(c[2]);
        if u.lo() >= 1.0 {
            continue;
        }
        let steepest = |u: f64| (point(6.0) * Real::sqrt(point(u)) * (point(1.0) - point(u)).square()).hi();
        let g = if u.hi() < 0.2 {
            steepest(u.hi())
        } else if u.lo() > 0.2 {
            steepest(u.lo())
        } else {
            WYVILL_SLOPE
        };
        let a = Interval::length(point(c[3]), point(c[4])) * Real::sqrt(point(c[2])) * point(g);
        sum = plus_up(sum, a.hi());
    }
    norm(displacement_matrix(p, count, x)).min(sum)
}

impl Code {
    /// K ≥ sup ‖J‖ over a region: from its Jacobian there, and at most 1 + sup ‖Dδ‖.
    fn stretch(&self, p: Parameters<f64>, region: &Region) -> f64 {
        let mut j = displacement_matrix(p, usize::from(self.controls), region.extent);
        let local = plus_up(1.0, displacement_slope(p, usize::from(self.controls), region.extent));
        for (k, row) in j.iter_mut().enumerate() {
            row[k] = row[k] + Interval::point(1.0);
        }
        norm(j).min(local).min(plus_up(1.0, p.0[0]))
    }
}

impl Frame for Code {
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, u32::from(self.controls)]);
    }
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    #[inline(always)]
    fn enter<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2]) -> [R; 2] {
        enter(p, usize::from(self.controls), x)
    }
    #[inline(always)]
    fn leave<R: Number, P: Copy + Into<f64>>(&self, _: Parameters<P>, a: Operand<R>) -> Operand<R> {
        a
    }
    /// A segment becomes a curve: its box stands for it. The box is convex, so slopes over it bound difference quotients
    /// along the curve.
    fn enter_region(&self, p: Parameters<f64>, region: &Region) -> Region {
        Region { extent: enter::<Interval, f64>(p, usize::from(self.controls), region.extent), ends: None }
    }
    /// λ, λ_α and μ grow by K = sup ‖J‖ over the region (claims G26).
    fn leave_bounds(&self, p: Parameters<f64>, region: &Region, b: Bounds) -> Bounds {
        if b.is_absent() {
            return Bounds::ABSENT;
        }
        let stretch = self.stretch(p, region);
        Bounds {
            slope: times_up(b.slope, stretch),
            support_slope: times_up(b.support_slope, stretch),
            weight_slope: times_up(b.weight_slope, stretch),
            weighted_slope: times_up(b.weighted_slope, stretch),
            ..b
        }
    }
    /// ω moves no point further than sup ‖δ‖.
    fn support(&self, p: Parameters<f64>, (lo, hi): Extent) -> Option<Extent> {
        around([lo, hi], p.0[1])
    }
    fn focus(&self, p: Parameters<f64>, focus: Focus) -> Focus {
        let position = enter::<f64, f64>(p, usize::from(self.controls), focus.position.to_array());
        Focus { position: DVec2::from_array(position), ..focus }
    }
    fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> (Code, DVec2) {
        let mut moved = p.0[..HEADER + usize::from(self.controls) * STRIDE].to_vec();
        for control in moved[HEADER..].chunks_exact_mut(STRIDE) {
            control[0] -= origin.x;
            control[1] -= origin.y;
        }
        (Code { at: tile.store(moved), ..*self }, origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Combination, Octaves};
    use crate::primitive::disc::{Disc, DiscNoise};
    use crate::program::Program;
    use crate::tree::{Node, Tree};
    use glam::DVec3;
    use proptest::prelude::*;

    fn control(centre: [f64; 2], radius: f64, shift: [f64; 2]) -> Control {
        Control { centre: DVec2::from(centre), radius, shift: DVec2::from(shift) }
    }
    /// Certified once: it takes a while.
    static WARP: std::sync::LazyLock<Warp> = std::sync::LazyLock::new(|| {
        let controls = [
            control([0.0, 0.0], 300.0, [90.0, 40.0]),
            control([150.0, 100.0], 200.0, [-30.0, 50.0]),
            control([-200.0, 50.0], 250.0, [20.0, -60.0]),
        ];
        Warp::new(&controls).expect("it does not fold")
    });

    proptest! {
        #[test]
        fn the_inverse_undoes_the_map(x in -500.0f64..500.0, y in -500.0f64..500.0) {
            let warp = &*WARP;
            let q = DVec2::new(x, y);
            let p = warp.target(q, 1e-9).expect("it converges");
            prop_assert!(warp.source(p).distance(q) < 1e-9);
            // And the other way: ω∘ω⁻¹ = id.
            let back = warp.target(warp.source(q), 1e-9).expect("it converges");
            prop_assert!(back.distance(q) < 2e-9);
            // Control: a point a micrometre aside comes from elsewhere.
            prop_assert!(warp.source(p + DVec2::splat(1e-6)).distance(q) > 1e-8);
        }

        #[test]
        fn the_jacobian_is_that_of_differences_and_within_its_bound(x in -500.0f64..500.0, y in -500.0f64..500.0, w in 0.0f64..100.0) {
            let warp = &*WARP;
            let p = DVec2::new(x, y);
            let j = warp.jacobian(p);
            let e = 1e-4;
            for (axis, column) in [(DVec2::X, j.x_axis), (DVec2::Y, j.y_axis)] {
                let difference = (warp.source(p + axis * e) - warp.source(p - axis * e)) / (2.0 * e);
                prop_assert!(difference.distance(column) < 1e-6);
            }
            let code = Code { at: 0, controls: 3 };
            let region = Region::rectangle(p - DVec2::splat(w), p + DVec2::splat(0.5 * w));
            let stretch = code.stretch(Parameters(&warp.parameters), &region);
            for k in 0..32 {
                let turned = j.mul_vec2(DVec2::from_angle(f64::from(k) * 0.2));
                prop_assert!(turned.length() <= stretch * (1.0 + 1e-12) && turned.length() >= 1.0 - warp.steepness());
            }
        }
    }

    #[test]
    fn one_control_folds_where_its_slope_passes_one_and_is_refused_there() {
        // The slope of a·(1 − x²/r²)³ is a·L/r.
        let steep = crate::falloff::WYVILL_SLOPE;
        let just = |factor: f64| Warp::new(&[control([10.0, -7.0], 100.0, [0.0, factor * 100.0 / steep])]);
        assert!(just(0.99).is_ok_and(|warp| (0.99..1.0).contains(&warp.steepness())));
        let error = just(1.001).unwrap_err();
        assert!(error.contains("may fold") && !error.contains('\n'), "{error}");
        // Two that would not fold alone fold together.
        let pair = [control([0.0, 0.0], 100.0, [40.0, 0.0]), control([5.0, 0.0], 100.0, [40.0, 0.0])];
        assert!(Warp::new(&pair[..1]).is_ok() && Warp::new(&pair).is_err());
    }

    #[test]
    fn a_warped_gradient_is_the_transposed_jacobian_times_the_gradient() {
        let octaves = Octaves { octaves: 3, frequency: 0.004, lacunarity: 2.0, gain: 0.5, amplitude: 40.0 };
        let noise = DiscNoise { combination: Combination::Sum, octaves, seed: 5 };
        let mut tree = Tree::new();
        let node = tree.push(Disc { centre: DVec3::ZERO, radius: 900.0, weight: 1.0, noise: Some(noise) });
        let warp = &*WARP;
        let root = tree.push(Node::Warp { node, warp: warp.clone() });
        let (bare, warped) =
            (Program::compile(&tree, node).expect("compiles"), Program::compile(&tree, root).expect("compiles"));
        let mut untransposed = 0.0f64;
        for k in 0..500 {
            let p = DVec2::new(-300.0 + 1.2 * f64::from(k), 200.0 - 0.9 * f64::from(k));
            let (inner, outer) = (bare.sample(warp.source(p)), warped.sample(p));
            let j = warp.jacobian(p);
            assert!((inner.elevation - outer.elevation).abs() < 1e-12);
            assert!(outer.gradient.distance(j.transpose() * inner.gradient) < 1e-12);
            assert!(outer.weight_gradient.distance(j.transpose() * inner.weight_gradient) < 1e-12);
            untransposed = untransposed.max(outer.gradient.distance(j * inner.gradient));
        }
        // Control: J·g is wrong.
        assert!(untransposed > 1e-3, "{untransposed}");
    }
}
