//! Where an edge of the lattice crosses the surface: a bracket of a change of sign, closed down to the tolerance.

use crate::field::THRESHOLD;

/// A crossing, as the share of the edge from its first end, and how many values it took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    pub(super) share: f64,
    pub(super) values: u64,
}

/// The crossing of f = T on an edge with `ends` on both sides of it, within `width` of a change of sign. `f` gives values by
/// share.
///
/// Values are aimed just behind where interpolation sees the root, on the side of the farther end, so that the bracket
/// closes from both sides; every fourth halves it.
pub(super) fn bracket(ends: [f64; 2], width: f64, f: impl Fn(f64) -> f64) -> Root {
    let (mut a, mut b) = (0.0, 1.0);
    let [mut fa, mut fb] = ends.map(|f| f - THRESHOLD);
    let rising = fb > 0.0;
    // The end that was replaced last.
    let mut third: Option<(f64, f64)> = None;
    let mut values = 0;
    while b - a > width {
        let root = third.and_then(|third| quadratic([(a, fa), (b, fb), third])).unwrap_or(secant([(a, fa), (b, fb)]));
        let aim = if root - a < b - root { root + 0.25 * width } else { root - 0.25 * width };
        let t = if values % 4 == 3 { 0.5 * (a + b) } else { aim.clamp(a + 0.125 * width, b - 0.125 * width) };
        let value = f(t) - THRESHOLD;
        values += 1;
        if (value > 0.0) == rising {
            third = Some((b, fb));
            (b, fb) = (t, value);
        } else {
            third = Some((a, fa));
            (a, fa) = (t, value);
        }
    }
    Root { share: secant([(a, fa), (b, fb)]), values }
}

fn secant([(a, fa), (b, fb)]: [(f64, f64); 2]) -> f64 {
    a + (b - a) * (fa / (fa - fb)).clamp(0.0, 1.0)
}

/// Inverse quadratic interpolation through three points, where it stays between the first two.
fn quadratic([(a, fa), (b, fb), (c, fc)]: [(f64, f64); 3]) -> Option<f64> {
    let term = |x: f64, f: f64, g: f64, h: f64| x * (g / (f - g)) * (h / (f - h));
    let root = term(a, fa, fb, fc) + term(b, fb, fa, fc) + term(c, fc, fa, fb);
    (a < root && root < b).then_some(root)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn functions() -> [fn(f64) -> f64; 6] {
        [
            |t| t,
            |t| t * t * t * 1.3,
            |t| 1.0 / (1.0 + libm::exp(-40.0 * (t - 0.01))),
            |t| if t < 0.73 { 0.0 } else { 1.0 },
            |t| 0.5 + (t - 0.9) * 1e-9,
            |t| 0.5 + (t - 0.999_99) * (t + 1e-7),
        ]
    }

    #[test]
    fn a_change_of_sign_is_within_the_width() {
        for f in functions() {
            for width in [0.1, 1e-2, 1e-6, 1e-9] {
                for flip in [false, true] {
                    let f = |t: f64| if flip { f(1.0 - t) } else { f(t) };
                    let root = bracket([f(0.0), f(1.0)], width, f);
                    let rock = |t: f64| f(t.clamp(0.0, 1.0)) > THRESHOLD;
                    assert_ne!(rock(root.share - width), rock(root.share + width), "{root:?} at {width}");
                    assert!(root.values <= 4 * 32, "{root:?} at {width}");
                }
            }
        }
    }

    #[test]
    fn smooth_crossings_take_few_values() {
        let mut total = 0;
        for k in 0..100 {
            let at = 0.005 + 0.0099 * f64::from(k);
            let root = bracket([0.5 - at, 0.5 + (1.0 - at) * 1.5], 1e-2, |t| 0.5 + (t - at) * (1.0 + 0.5 * t));
            assert!((root.share - at).abs() < 1e-2);
            total += root.values;
        }
        assert!(total < 360, "{total} values for 100 crossings");
    }
}
