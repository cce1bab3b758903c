//! What diffusion moves and computes at the least: each array that a step names read or written once, whatever caches save or lose.

/// Bytes and operations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Read and written.
    pub bytes: f64,
    /// Multiplications and additions.
    pub operations: f64,
}

/// BiCGStab around V(2,2) cycles, `iterations` of it on `width × height` nodes with the plain equation. Nodes with weights of their own read
/// up to ten words more, which is not counted.
pub fn multigrid(width: usize, height: usize, iterations: usize) -> Work {
    let (mut words, mut operations) = (0.0, 0.0);
    let (mut w, mut h) = (width, height);
    let mut finest = true;
    loop {
        let nodes = (w * h) as f64;
        // Of an operator: the kind of a node, or nine coefficients and the diagonal's inverse; operations of a product.
        let (operator, product) = if finest { (1.0, 8.0) } else { (10.0, 18.0) };
        // Fifteen colours, each of which reads all of x, and a quarter of everything else; one that starts.
        let relaxed = 15.0 * (1.0 + (2.0 + operator) / 4.0) + 2.0 + operator;
        // The residual; restriction and interpolation with eight weights for four nodes.
        let carried = 3.0 + operator + (1.0 + 2.0 + 0.25) + (2.0 + 2.0 + 0.25);
        words += nodes * (relaxed + carried);
        operations += nodes * (15.0 / 4.0 * (product + 3.0) + product + 1.0 + 4.5 + 5.5);
        (w, h, finest) = (w.div_ceil(2), h.div_ceil(2), false);
        if w.min(h) <= terrain_diffusion::solver::hierarchy::SHORTEST {
            break;
        }
    }
    let nodes = (width * height) as f64;
    // Two cycles; two products; three pairs of inner products; the direction; two advances.
    let words = 2.0 * words + nodes * (2.0 * 3.0 + 3.0 * 2.0 + 4.0 + 2.0 * 6.0);
    let operations = 2.0 * operations + nodes * (2.0 * 8.0 + 3.0 * 4.0 + 4.0 + 2.0 * 4.0);
    Work { bytes: 4.0 * words * iterations as f64, operations: operations * iterations as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_grows_with_nodes_and_iterations_and_coarse_levels_cost_less_than_the_finest() {
        let one = multigrid(257, 257, 1);
        let (four, twice) = (multigrid(513, 513, 1), multigrid(257, 257, 2));
        assert!((four.bytes / one.bytes - 4.0).abs() < 0.1 && twice.bytes == 2.0 * one.bytes);
        // The finest level alone: two cycles of 45 words, 28 around them.
        let finest = 4.0 * (257.0 * 257.0) * (2.0 * 42.0 + 28.0);
        assert!(one.bytes > finest && one.bytes < 3.0 * finest && one.operations > 0.0);
    }
}
