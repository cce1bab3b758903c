//! Small statements of the papers that a test says best.

use terrain_model::real::{Operand, Real};

/// Claims R5: blending blends of two, or all three at once, differs in the last bits. A law of real numbers, not of `f64`.
#[test]
fn blending_is_not_associative_in_floating_point() {
    let mean = |parts: &[Operand<f64>]| f64::weighted_mean(parts, 0.0);
    let mut differ = 0;
    for k in 1..200u32 {
        let x = f64::from(k);
        let [a, b, c] = [(0.1 * x, 0.3), (7.0 / x, 0.4), (1.0 + x, 0.1 + 1.0 / x)].map(|(f, w)| Operand::new(f, w));
        let (all, nested) = (mean(&[a, b, c]), mean(&[mean(&[a, b]), c]));
        assert!((all.elevation / nested.elevation - 1.0).abs() < 1e-13, "{all:?} {nested:?}");
        differ += u32::from(all.elevation.to_bits() != nested.elevation.to_bits());
    }
    assert!(differ > 3, "{differ}");
}
