//! A linear operator on a raster that couples each node to its eight neighbours: the coarser levels of multigrid.

use super::hierarchy::Operator;
use super::rows::{Rows, SELF};
use crate::plane::{Float, wide};
use rayon::prelude::*;

/// Nine coefficients a node, those of one row and one step in an array of their own. One that points out of the raster is 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stencil {
    width: usize,
    height: usize,
    coefficients: Vec<f32>,
    /// 1 / the coefficient of the node itself.
    inverse: Vec<f32>,
    /// Whether a node carries values along a direction.
    directed: Vec<bool>,
}

impl Stencil {
    /// The operator whose rows `row(j, rows to fill, flags to fill)` gives.
    pub(super) fn new(
        width: usize,
        height: usize,
        row: impl Fn(usize, &mut [[f32; 9]], &mut [bool]) + Sync,
    ) -> Stencil {
        let mut coefficients = vec![0.0; 9 * width * height];
        let mut inverse = vec![0.0; width * height];
        let mut directed = vec![false; width * height];
        let lines = coefficients.par_chunks_mut(9 * width).zip(inverse.par_chunks_mut(width));
        lines.zip(directed.par_chunks_mut(width)).enumerate().for_each_init(
            || vec![[0.0; 9]; width],
            |nodes, (j, ((line, inverse), directed))| {
                row(j, nodes, directed);
                for (i, node) in nodes.iter().enumerate() {
                    (0..9).for_each(|k| line[k * width + i] = node[k]);
                    inverse[i] = if node[SELF] > 0.0 { 1.0 / node[SELF] } else { 0.0 };
                }
            },
        );
        Stencil { width, height, coefficients, inverse, directed }
    }
    pub(super) fn arrays(&self) -> Operator<'_> {
        let Stencil { width, height, coefficients, inverse, directed } = self;
        Operator { width: *width, height: *height, coefficients, inverse, directed }
    }
    fn line(&self, j: usize, k: usize) -> &[f32] {
        &self.coefficients[(9 * j + k) * self.width..][..self.width]
    }
    /// The row of node (i, j).
    pub(super) fn at(&self, i: usize, j: usize) -> [f32; 9] {
        std::array::from_fn(|k| self.line(j, k)[i])
    }
    pub(super) fn bytes(&self) -> usize {
        4 * (self.coefficients.len() + self.inverse.len()) + self.directed.len()
    }
}

impl Rows for Stencil {
    fn width(&self) -> usize {
        self.width
    }
    fn height(&self) -> usize {
        self.height
    }
    fn inverse(&self, j: usize) -> &[f32] {
        &self.inverse[j * self.width..][..self.width]
    }
    fn product<T: Float>(&self, j: usize, beside: [&[T]; 3], out: &mut [T]) {
        let out = &mut out[..self.width];
        // One line of the stencil at a time: the compiler proves few arrays distinct and then gives up on vectors.
        for (line, x) in beside.into_iter().enumerate() {
            let [a, b, c] = [0, 1, 2].map(|k| self.line(j, 3 * line + k));
            let x = &x[..self.width + 2];
            wide(
                #[inline(always)]
                || {
                    for i in 0..out.len() {
                        let [a, b, c] = [a[i], b[i], c[i]].map(T::of_single);
                        let sum = a * x[i] + b * x[i + 1] + c * x[i + 2];
                        out[i] = if line == 0 { sum } else { out[i] + sum };
                    }
                },
            );
        }
    }
    fn sweep(&self, j: usize, from_east: bool, b: &[f32], [south, north]: [&[f32]; 2], row: &mut [f32]) {
        let (flags, inverse) = (&self.directed[j * self.width..][..self.width], self.inverse(j));
        let mut relax = |i: usize| {
            let a = self.at(i, j);
            let beside = [south, &*row, north];
            let product: f32 = (0..9).map(|k| a[k] * beside[k / 3][i + k % 3]).sum();
            row[i + 1] += (b[i + 1] - product) * inverse[i];
        };
        let directed = flags.iter().enumerate().filter(|&(_, directed)| *directed).map(|(i, _)| i);
        if from_east { directed.rev().for_each(&mut relax) } else { directed.for_each(&mut relax) }
    }
    fn coefficients(&self, j: usize, out: &mut [[f32; 9]]) {
        out.iter_mut().enumerate().for_each(|(i, out)| *out = self.at(i, j));
    }
    fn follows(&self, j: usize, out: &mut [bool]) {
        out.copy_from_slice(&self.directed[j * self.width..][..self.width]);
    }
    fn uniform(&self, _: usize, out: &mut [bool]) {
        out.fill(false);
    }
}

impl Stencil {
    /// Whether the operator is its own transpose, up to `tolerance` on a coefficient.
    #[cfg(test)]
    pub(super) fn is_symmetric(&self, tolerance: f32) -> bool {
        use super::rows::{STEPS, index_of};
        let differs = |i: usize, j: usize| {
            STEPS.into_iter().enumerate().any(|(k, (x, y))| {
                let Some((p, q)) = i.checked_add_signed(x).zip(j.checked_add_signed(y)) else { return false };
                let inside = p < self.width && q < self.height;
                inside && (self.at(i, j)[k] - self.at(p, q)[index_of((-x, -y))]).abs() > tolerance
            })
        };
        (0..self.height).all(|j| (0..self.width).all(|i| !differs(i, j)))
    }
}
