//! The published ranges and slopes are proved here, on the spot or from stored splits, and witnesses stand below them.

use terrain_model::certify::noise::{
    CellNoise, Gradient2, Gradient3, Simplex3, Slope, gradient2_curvature, gradient2_range, gradient2_slope,
    gradient3_range, gradient3_slope, simplex3_face, simplex3_range, simplex3_slope_root,
};
use terrain_model::certify::{Objective, Verdict, tree};
use terrain_model::noise::corner::{Corner, dot, gradient};
use terrain_model::noise::{
    GRADIENT2_CURVATURE, GRADIENT2_RANGE, GRADIENT2_SLOPE, GRADIENT2_THIRD, GRADIENT3_RANGE, GRADIENT3_SLOPE,
    SIMPLEX3_RANGE, SIMPLEX3_SLOPE, gradient2, gradient3, mix, simplex3,
};

const BUDGET: u64 = 1_000_000;

fn proved<const N: usize>(verdict: Verdict<N>) -> bool {
    matches!(verdict, Verdict::Proved { .. })
}
fn refuted<const N: usize>(verdict: Verdict<N>) -> bool {
    matches!(verdict, Verdict::Refuted { .. })
}

#[test]
fn plane_noise_has_the_published_range_and_slope() {
    assert!(proved(gradient2_range(GRADIENT2_RANGE, BUDGET)));
    assert!(proved(gradient2_slope(GRADIENT2_SLOPE, BUDGET)));
    // Controls: just below the witnesses the same search refutes.
    assert!(refuted(gradient2_range(0.6608, BUDGET)));
    assert!(refuted(gradient2_slope(2.067, BUDGET)));
}

#[test]
fn plane_noise_has_the_published_higher_derivatives() {
    let [straight, mixed] = GRADIENT2_CURVATURE;
    let [third, across] = GRADIENT2_THIRD;
    for (order, bound) in [([2, 0], straight), ([1, 1], mixed), ([3, 0], third), ([2, 1], across)] {
        let verdict = gradient2_curvature(order, bound, BUDGET);
        assert!(proved(verdict), "{order:?} {verdict:?}");
        // Control: a hundredth less is refuted.
        assert!(refuted(gradient2_curvature(order, 0.99 * bound, BUDGET)), "{order:?}");
    }
    // Exchanging axes exchanges the orders.
    assert!(refuted(gradient2_curvature([0, 2], 0.99 * straight, BUDGET)));
}

#[test]
fn space_noise_has_the_published_range() {
    assert!(proved(gradient3_range(GRADIENT3_RANGE, BUDGET)));
    assert!(refuted(gradient3_range(1.036, BUDGET)));
}

#[test]
fn space_noise_has_the_published_slope() {
    let verdict = gradient3_slope(GRADIENT3_SLOPE, BUDGET);
    assert!(proved(verdict), "{verdict:?}");
}

#[test]
fn simplex_noise_has_the_published_range() {
    assert!(proved(simplex3_range(SIMPLEX3_RANGE, BUDGET)));
    assert!(refuted(simplex3_range(0.2943, BUDGET)));
}

/// The full check, 2 344 465 leaves in 94 s, is `cargo run --release -p terrain-model --example certify_noise --
/// simplex3-slope 2.071 model/certificates/simplex3-slope`; here every 16th piece is checked, an eighth of the leaves.
#[test]
fn simplex_noise_has_the_published_slope_in_a_sample_of_its_stored_proof() {
    let files: [&[u8]; 2] =
        [include_bytes!("../certificates/simplex3-slope.0"), include_bytes!("../certificates/simplex3-slope.1")];
    for (face, file) in files.into_iter().enumerate() {
        let objective = simplex3_face(face);
        let leaves = tree::check(&objective, simplex3_slope_root(), SIMPLEX3_SLOPE, file, |piece| piece % 16 == 10);
        assert!(leaves.is_ok_and(|n| n > 20_000), "face {face}: {leaves:?}");
        // Control: the same splits do not prove a hundredth less.
        let lower = tree::check(&objective, simplex3_slope_root(), 0.98 * SIMPLEX3_SLOPE, file, |_| true);
        assert!(matches!(lower, Err(tree::CheckError::TooHigh { .. })));
    }
}

/// The gradients of a set that make the slope along `e` largest, and ‖∇n‖ of the noise with exactly these.
fn attained<const D: usize, const C: usize>(corners: &[Corner<f64, D>; C], set: &[[f64; D]], e: [f64; D]) -> f64 {
    let chosen = std::array::from_fn(|c| {
        let Corner { weight, slope, offset } = corners[c];
        let v: [f64; D] = std::array::from_fn(|k| weight * e[k] + dot(e, slope) * offset[k]);
        *set.iter().max_by(|a, b| dot(**a, v).total_cmp(&dot(**b, v))).expect("a gradient")
    });
    let slopes = gradient(corners, &chosen);
    dot(slopes, slopes).sqrt()
}

#[test]
fn explicit_gradients_come_within_a_hundredth_of_the_published_slopes() {
    let directions: Vec<[f64; 2]> = (0..8u32).map(|k| gradient2::direction(k << 29)).collect();
    let plane = attained(&Gradient2.corners_at([0.5, 0.5]), &directions, [1.0, 0.0]);
    assert!((plane - (gradient2::LONG * 15.0 + gradient2::SHORT * 7.0) / 8.0).abs() < 1e-15);
    assert!(plane <= GRADIENT2_SLOPE && GRADIENT2_SLOPE < 1.001 * plane);

    let edges: Vec<[f64; 3]> =
        (0..12u32).map(|k| gradient3::edge((((k / 4) * 0x5556 + 0x10) << 16) | (k % 4))).collect();
    let space = attained(&Gradient3.corners_at([0.5; 3]), &edges, [1.0, 0.0, 0.0]);
    assert!((space - 3.75).abs() < 1e-15);
    assert!(space <= GRADIENT3_SLOPE && GRADIENT3_SLOPE < 1.01 * space);

    let at = [13.0 / 42.0, 0.25, 4.0 / 21.0];
    let simplex = attained(&Simplex3.corners_at(at), &edges, [1.0, 0.842, 1.0]);
    assert!(simplex <= SIMPLEX3_SLOPE && SIMPLEX3_SLOPE < 1.011 * simplex, "{simplex}");
    assert!((simplex3::SCALE * 2.0f64.sqrt() - 32.0).abs() < 1e-14);
}

#[test]
fn symmetry_leaves_no_direction_out() {
    let mut state = 9;
    let mut random = |lo: f64, hi: f64| {
        state = mix(state, 4);
        lo + (hi - lo) * f64::from(state) / f64::from(u32::MAX)
    };
    let mut best = [0.0f64; 3];
    for step in 0..200_000usize {
        let (p, q) = (random(-1.0, 1.0), random(-1.0, 1.0));
        let x = [random(0.0, 1.0), random(0.0, 1.0), random(0.0, 1.0)];
        let plane = Slope { noise: Gradient2, face: step % 2, ordered: false };
        best[0] = best[0].max(plane.at([x[0], x[1], p]));
        let space = Slope { noise: Gradient3, face: step % 3, ordered: false };
        best[1] = best[1].max(space.at([x[0], x[1], x[2], p, q]));
        let simplex = Slope { noise: Simplex3, face: step % 3, ordered: false };
        let [u, v, w] = [0.85 * x[0], 0.85 * x[1] - 0.17, 0.85 * x[2] - 0.34];
        best[2] = best[2].max(simplex.at([u, v, w, p, q]));
    }
    assert!(best[0] <= GRADIENT2_SLOPE && best[1] <= GRADIENT3_SLOPE && best[2] <= SIMPLEX3_SLOPE, "{best:?}");
    assert!(best[0] > 2.0 && best[1] > 3.0 && best[2] > 1.8, "{best:?}");
}
