//! Rasters as C¹ fields: the biquadratic B-spline over the samples. It is a convex combination of nine samples and its
//! derivative one of their differences, so both stay within what the pyramid of the raster says, and where nine samples
//! are 0 it is exactly 0. Weights are looked up this way (Génevaux 2015 §4.2: α must be C¹, so not bilinear).

use super::raster::Image;
use crate::interval::Interval;
use crate::lanes::Lanes;
use crate::real::Real;
use crate::rounding::{Rounded, UNIT};

/// How far around a position the samples lie that its spline reads.
pub(super) const REACH: usize = 2;

/// Value and derivative along one axis from three samples; `t` in [0, 1] runs over the span of the middle one.
///
/// ½(1−t)²·c₀ + (½ + t − t²)·c₁ + ½t²·c₂, written with differences: equal samples give exactly their value.
#[inline(always)]
fn span<R: Real>(c: [R; 3], t: R) -> [R; 2] {
    let (d0, d1) = (c[1] - c[0], c[2] - c[1]);
    let half = R::constant(0.5);
    [c[1] + half * (t.square() * d1 - (R::one() - t).square() * d0), d0 + t * (d1 - d0)]
}

/// The spline with its derivatives along u and v, from nine samples row by row.
#[inline(always)]
fn patch<R: Real>(s: [R; 9], [u, v]: [R; 2]) -> [R; 3] {
    let rows = [span([s[0], s[1], s[2]], u), span([s[3], s[4], s[5]], u), span([s[6], s[7], s[8]], u)];
    let [value, along_v] = span([rows[0][0], rows[1][0], rows[2][0]], v);
    let [along_u, _] = span([rows[0][1], rows[1][1], rows[2][1]], v);
    [value, along_u, along_v]
}

impl Image {
    /// The nine samples around (i, j); beyond the border those of the border.
    #[inline(always)]
    fn nine(&self, i: usize, j: usize) -> [f32; 9] {
        let near = |k: usize, count: usize| [k.saturating_sub(1), k, (k + 1).min(count - 1)];
        let (columns, rows) = (near(i, self.width()), near(j, self.height()));
        let mut out = [0.0; 9];
        for k in 0..9 {
            out[k] = self.sample(columns[k % 3], rows[k / 3]);
        }
        out
    }
    /// Middle sample and position in its span along one axis of `count` samples; positions outside are clamped.
    fn span_at(count: usize, base: i32, u: f64) -> (usize, f64) {
        let u = (u + f64::from(base)).clamp(0.0, count as f64 - 1.0) + 0.5;
        let middle = (u as usize).min(count - 1);
        (middle, u - middle as f64)
    }
    fn enclose_spline(&self, at: [Interval; 2]) -> [Interval; 3] {
        let counts = [self.width(), self.height()];
        let ends = |x: Interval, count: usize| [Image::span_at(count, 0, x.lo()).0, Image::span_at(count, 0, x.hi()).0];
        let (columns, rows) = (ends(at[0], counts[0]), ends(at[1], counts[1]));
        let around = |ends: [usize; 2]| Interval::new(ends[0] as f64 - 1.0, ends[1] as f64 + 1.0);
        let mut jet = self.enclose(around(columns), around(rows));
        // A span at the border repeats a sample: its difference there is 0.
        for (k, ends) in [columns, rows].into_iter().enumerate() {
            if ends[0] == 0 || ends[1] + 1 >= counts[k] {
                jet[k + 1] = jet[k + 1].hull(Interval::ZERO);
            }
        }
        if columns[1] - columns[0] > 2 || rows[1] - rows[0] > 2 {
            return jet;
        }
        let mut hull: Option<[Interval; 3]> = None;
        for j in rows[0]..=rows[1] {
            for i in columns[0]..=columns[1] {
                let local = |k: usize, middle: usize| {
                    let last = counts[k] as f64 - 1.0;
                    let x = Interval::new(at[k].lo().clamp(0.0, last), at[k].hi().clamp(0.0, last));
                    let t = x + Interval::point(0.5 - middle as f64);
                    Interval::new(t.lo().clamp(0.0, 1.0), t.hi().clamp(0.0, 1.0))
                };
                let samples = self.nine(i, j).map(|s| Interval::point(f64::from(s)));
                let here = patch(samples, [local(0, i), local(1, j)]);
                hull = Some(hull.map_or(here, |h| [h[0].hull(here[0]), h[1].hull(here[1]), h[2].hull(here[2])]));
            }
        }
        let Some(hull) = hull else { return jet };
        [jet[0].meet(hull[0]), jet[1].meet(hull[1]), jet[2].meet(hull[2])]
    }
}

/// [`super::raster::ImageNumber::spline_jet`] of `f64`.
#[inline(always)]
pub(super) fn double(image: &Image, base: [i32; 2], u: [f64; 2]) -> [f64; 3] {
    let (i, s) = Image::span_at(image.width(), base[0], u[0]);
    let (j, t) = Image::span_at(image.height(), base[1], u[1]);
    patch(image.nine(i, j).map(f64::from), [s, t])
}

/// [`super::raster::ImageNumber::spline_jet`] of lanes.
#[inline(always)]
pub(super) fn lanes<const N: usize>(image: &Image, base: [i32; 2], u: [Lanes<N>; 2]) -> [Lanes<N>; 3] {
    let mut nine = [Lanes::splat(0.0); 9];
    let half = Lanes::splat(0.5);
    let (x, y) = (u[0] + half, u[1] + half);
    let ((iu, fu), (iv, fv)) = (x.floor(), y.floor());
    let (mut s, mut t) = (x - fu, y - fv);
    for lane in 0..N {
        // From the first to the last sample; there the span is entered and left at its middle.
        let clamp = |middle: i32, count: usize, at: &mut f32| {
            let last = count as i32 - 1;
            if middle < 0 || (middle == 0 && *at < 0.5) {
                *at = 0.5;
                0
            } else if middle > last || (middle == last && *at > 0.5) {
                *at = 0.5;
                last
            } else {
                middle
            }
        };
        let i = clamp(iu[lane].wrapping_add(base[0]), image.width(), &mut s.0[lane]);
        let j = clamp(iv[lane].wrapping_add(base[1]), image.height(), &mut t.0[lane]);
        let samples = image.nine(i as usize, j as usize);
        for k in 0..9 {
            nine[k].0[lane] = samples[k];
        }
    }
    patch(nine, [s, t])
}

/// [`super::raster::ImageNumber::spline_jet`] of intervals.
pub(super) fn interval(image: &Image, base: [i32; 2], u: [Interval; 2]) -> [Interval; 3] {
    let shift = |x: Interval, base: i32| if base == 0 { x } else { x + Interval::point(f64::from(base)) };
    let at = [shift(u[0], base[0]), shift(u[1], base[1])];
    let mut jet = image.enclose_spline(at);
    // Outside the raster the border value is continued.
    for (k, count) in [image.width(), image.height()].into_iter().enumerate() {
        if at[k].lo() < 0.0 || at[k].hi() > count as f64 - 1.0 {
            jet[k + 1] = jet[k + 1].hull(Interval::ZERO);
        }
    }
    jet
}

/// [`super::raster::ImageNumber::spline_jet`] of numbers that carry their rounding error.
///
/// The spline is C¹: a position off by e moves the value by the derivative times e, and the derivative by no more than
/// its width over what can be reached. u + ½ and the subtraction of the span round by a unit of |u| + 1; a span is 6
/// operations on numbers of at most twice the largest sample, so that four of them round by less than 48 units of it.
pub(super) fn rounded(image: &Image, base: [i32; 2], u: [Rounded; 2]) -> [Rounded; 3] {
    let exact = interval(image, base, [u[0].exact, u[1].exact]);
    let position = u.map(|u| u.error + UNIT * (u.reach().magnitude() + 1.0));
    let wider = |k: usize| u[k].exact + Interval::symmetric(position[k]);
    let near = interval(image, base, [wider(0), wider(1)]);
    let rounding = 48.0 * UNIT * near[0].magnitude();
    let moved = near[1].magnitude() * position[0] + near[2].magnitude() * position[1];
    let slope = |k: usize| {
        // Differences of neighbours round by a unit of the samples, not of the difference.
        let off = near[k].width() + rounding;
        Rounded::new(exact[k], off * (1.0 + 1e-12) + 1e-40)
    };
    [Rounded::new(exact[0], (moved + rounding) * (1.0 + 1e-12) + 1e-40), slope(1), slope(2)]
}

#[cfg(test)]
mod tests {
    use super::super::raster::ImageNumber;
    use super::*;
    use crate::certify::{Objective, Upper, Verdict, prove_below};
    use proptest::prelude::*;

    fn image(seed: u32) -> Image {
        let samples = (0..7 * 9).map(|k| crate::noise::mix(seed, k) as f32 / u32::MAX as f32).collect();
        Image::new(7, 9, samples).expect("a valid image")
    }

    proptest! {
        #[test]
        fn the_spline_is_enclosed_and_its_jumps_vanish(seed in 0u32..99, u in -1.0f64..8.0, v in -1.0f64..10.0, w in 0.0f64..4.0, s in 0.0f64..=1.0, t in 0.0f64..=1.0) {
            let image = image(seed);
            let (a, b) = (Interval::new(u, u + w), Interval::new(v, v + 0.5 * w));
            let jet = interval(&image, [0, 0], [a, b]);
            let p = [(u + s * w).min(a.hi()), (v + 0.5 * t * w).min(b.hi())];
            let inside = double(&image, [0, 0], p);
            let slack = Interval::symmetric(1e-14);
            prop_assert!((jet[0] + slack).contains(inside[0]), "{:?} {:?}", jet, inside);
            // Where a position is clamped the value does not move.
            let free = [p[0] > 0.0 && p[0] < 6.0, p[1] > 0.0 && p[1] < 8.0];
            for k in 0..2 {
                prop_assert!(!free[k] || (jet[k + 1] + slack).contains(inside[k + 1]));
            }
            // C¹ inside: over 1e-7 the derivative moves by at most 4 · 1e-7, across spans too. A bilinear patch jumps.
            if free[0] && p[0] < 5.9 {
                let next = double(&image, [0, 0], [p[0] + 1e-7, p[1]]);
                prop_assert!((next[1] - inside[1]).abs() < 1e-6);
                prop_assert!((next[0] - inside[0] - 1e-7 * inside[1]).abs() < 1e-12);
            }
        }

        #[test]
        fn lanes_stay_within_the_derived_error(seed in 0u32..99, u in -1.0f32..8.0, v in -1.0f32..10.0, base in -3i32..3) {
            let image = image(seed);
            let single = f32::spline_jet(&image, [base, 0], [u, v]);
            let exact = |x: f32| Rounded::new(Interval::point(f64::from(x)), 0.0);
            let derived = rounded(&image, [base, 0], [exact(u), exact(v)]);
            prop_assert!(derived[0].error < 1e-4);
            prop_assert!(derived[0].reach().contains(f64::from(single[0])), "{:?} {:?}", derived, single);
            // Control: a value a thousandth off lies outside.
            prop_assert!(!derived[0].reach().contains(f64::from(single[0]) + 1e-3));
        }
    }

    /// Value, −value, slope and −slope of a span with samples in [0, 1], over (c₀, c₁, c₂, t).
    struct Span(usize);

    impl Objective<4> for Span {
        fn upper(&self, part: &[Interval; 4], _: f64) -> Upper {
            let [a, b, c, t] = *part;
            let [value, slope] = span([a, b, c], t);
            let bound = [value.hi(), -value.lo(), slope.hi(), -slope.lo()][self.0];
            let widest = (0..4).fold(3, |axis, k| if part[k].width() > part[axis].width() { k } else { axis });
            Upper { bound, axis: widest }
        }
        fn at(&self, [a, b, c, t]: [f64; 4]) -> f64 {
            let [value, slope] = span([a, b, c], t);
            [value, -value, slope, -slope][self.0]
        }
    }

    /// For all samples in [0, 1] and everywhere in a span: the value lies in [0, 1], the slope in [−1, 1]. All are attained, so
    /// the proofs leave a twentieth.
    #[test]
    fn weights_by_the_spline_are_certified_for_every_raster() {
        for (which, limit) in [1.0, 0.0, 1.0, 1.0].into_iter().enumerate() {
            let proved = prove_below(&Span(which), [Interval::UNIT; 4], limit + 0.05, 200_000);
            assert!(matches!(proved, Verdict::Proved { .. }), "{which}: {proved:?}");
            // Control: a little below what is attained is refuted.
            let refuted = prove_below(&Span(which), [Interval::UNIT; 4], limit - 0.01, 200_000);
            assert!(matches!(refuted, Verdict::Refuted { .. }), "{which}: {refuted:?}");
        }
    }

    #[test]
    fn the_derivative_of_a_bilinear_lookup_jumps() {
        // The control of the C¹ law above.
        let image = image(4);
        let at = |u: f64| f64::lookup_jet(&image, [0, 0], [u, 3.3])[1];
        assert!((at(3.0 + 1e-8) - at(3.0 - 1e-8)).abs() > 1e-2);
    }
}
