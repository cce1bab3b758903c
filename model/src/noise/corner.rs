//! What all lattice noises share: a sum over the corners of a cell of weight · (gradient · offset). The jets sum these
//! corners, and the certificates bound them for every choice of gradients.

use crate::real::Real;

/// One corner's weight, the gradient of that weight, and the offset of the point from the corner.
#[derive(Clone, Copy, Debug)]
pub struct Corner<R, const D: usize> {
    /// Weight of the corner.
    pub weight: R,
    /// Gradient of the weight.
    pub slope: [R; D],
    /// Point minus corner.
    pub offset: [R; D],
}

/// a · b.
#[inline(always)]
pub fn dot<R: Real, const D: usize>(a: [R; D], b: [R; D]) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..D {
        sum = sum + a[k] * b[k];
    }
    sum
}

/// The value Σ w (g · d) of a noise with gradients `g` at its corners.
#[inline(always)]
pub fn value<R: Real, const D: usize, const C: usize>(corners: &[Corner<R, D>; C], gradients: &[[R; D]; C]) -> R {
    let mut sum = corners[0].weight * dot(gradients[0], corners[0].offset);
    for c in 1..C {
        sum = sum + corners[c].weight * dot(gradients[c], corners[c].offset);
    }
    sum
}

/// The gradient Σ (g · d) ∇w + w g of a noise with gradients `g` at its corners.
#[inline(always)]
pub fn gradient<R: Real, const D: usize, const C: usize>(
    corners: &[Corner<R, D>; C],
    gradients: &[[R; D]; C],
) -> [R; D] {
    let mut sum = [R::zero(); D];
    for c in 0..C {
        let Corner { weight, slope, offset } = corners[c];
        let height = dot(gradients[c], offset);
        for k in 0..D {
            let part = slope[k] * height + weight * gradients[c][k];
            sum[k] = if c == 0 { part } else { sum[k] + part };
        }
    }
    sum
}

/// a + t (b − a).
#[inline(always)]
pub fn lerp<R: Real>(a: R, b: R, t: R) -> R {
    a + t * (b - a)
}
