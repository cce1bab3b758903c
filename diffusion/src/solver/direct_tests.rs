//! Sparse Gaussian elimination (faer) as the oracle of every iterative solve.

use super::equations::{Equation, Equations};
use super::guided::{self, Constraint, Slope, Update};
use super::krylov::Stop;
use super::samples::rows;
use super::{laplace, variational};
use crate::plane::Plane;
use faer::prelude::*;
use faer::sparse::{SparseColMat, Triplet};

const N: usize = 97;
const STOP: Stop = Stop { relative_residual: 1e-10, iterations: 100 };

/// The solution of A·x = b, A by entries.
fn solved(entries: &[(usize, usize, f64)], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let triplets: Vec<_> = entries.iter().map(|&(row, column, value)| Triplet::new(row, column, value)).collect();
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets).unwrap();
    let right = Mat::from_fn(n, 1, |i, _| b[i]);
    let x = matrix.sp_lu().unwrap().solve(&right);
    (0..n).map(|i| x[(i, 0)]).collect()
}

/// The direct solution of equations whose matrix is read off their residuals: each of nine combs of unit vectors shows every ninth column.
fn direct(equations: &Equations, given: &Plane<f64, 1>) -> Vec<f64> {
    let (width, height) = (given.width(), given.height());
    let residual = |values: &Plane<f64, 1>| {
        let mut residual = Plane::<f64, 1>::new(width, height);
        equations.residual(values, &mut residual);
        residual
    };
    let mut entries = Vec::new();
    let constant = residual(&Plane::new(width, height));
    for (comb_x, comb_y) in (0..3).flat_map(|y| (0..3).map(move |x| (x, y))) {
        let mut comb = Plane::<f64, 1>::new(width, height);
        for (i, j) in (comb_y..height).step_by(3).flat_map(|j| (comb_x..width).step_by(3).map(move |i| (i, j))) {
            comb.set(i, j, [1.0]);
        }
        let image = residual(&comb);
        for (i, j) in (0..height).flat_map(|j| (0..width).map(move |i| (i, j))) {
            // The tooth within one step of (i, j).
            let tooth = |at: usize, comb: usize| (at + 4 - comb) / 3 * 3 + comb;
            let (p, q) = ((tooth(i, comb_x)).wrapping_sub(3), (tooth(j, comb_y)).wrapping_sub(3));
            let value = constant.at(i, j)[0] - image.at(i, j)[0];
            // The constant leaves a rounding where there is no entry.
            if value.abs() > 1e-9 {
                assert!(p.abs_diff(i) <= 1 && q.abs_diff(j) <= 1, "({i}, {j}) reads ({p}, {q})");
                entries.push((j * width + i, q * width + p, value));
            }
        }
    }
    let mut b: Vec<f64> = constant.field(0);
    for (i, j) in (0..height).flat_map(|j| (0..width).map(move |i| (i, j))).filter(|&(i, j)| equations.is_given(i, j)) {
        entries.push((j * width + i, j * width + i, 1.0));
        b[j * width + i] = given.at(i, j)[0];
    }
    solved(&entries, &b)
}

/// The largest difference, as a share of the range of what is right.
fn difference(found: &Plane<f64, 1>, right: &[f64]) -> f64 {
    let (low, high) = right.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    found.iter(0).zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / (high - low)
}

/// A ridge, a riverbed and a crack.
fn constraint(i: usize, j: usize) -> Constraint {
    let slope = |n: [f64; 2], rise: f64| Slope::along(n, rise).map_or(Constraint::Free, Constraint::Slope);
    match (i, j) {
        (20..=70, 60) => Constraint::Elevation(100.0 + i as f64),
        (20..=70, 61..=75) => slope([0.1, 1.0], -0.6),
        (20..=70, 45..=59) => slope([0.0, -1.0], -0.9),
        (10..=85, 20) => Constraint::Elevation(10.0),
        (10..=85, 21..=30) => slope([0.3, 1.0], 0.4),
        (80..=90, 50..=80) => slope([if i < 85 { 1.0 } else { -1.0 }, 0.05], -0.5),
        (5, 90) => Constraint::Near { elevation: 30.0, smoothing: 0.3 },
        _ => Constraint::Free,
    }
}

#[test]
fn diffused_values_are_those_of_elimination() {
    let fixed = |i: usize, j: usize| (i * 7 + j * 3).is_multiple_of(211) || (i == 30 && j > 20);
    let equations = Equations::new(N, N, |j, row| {
        (0..N).filter(|&i| fixed(i, j)).for_each(|i| row[i] = Equation::Given);
    });
    let mut x = Plane::<f64, 1>::new(N, N);
    for (i, j) in (0..N).flat_map(|j| (0..N).map(move |i| (i, j))).filter(|&(i, j)| fixed(i, j)) {
        x.set(i, j, [((i * 5 + j * 11) % 97) as f64]);
    }
    let right = direct(&equations, &x);
    assert!(laplace::diffuse(&equations, &mut x, STOP).unwrap().converged);
    assert!(difference(&x, &right) < 1e-6, "{}", difference(&x, &right));
    x.set(3, 3, [x.at(3, 3)[0] + 0.01]);
    assert!(difference(&x, &right) > 1e-5, "a centimetre is seen");
}

#[test]
fn guided_elevations_are_those_of_elimination() {
    for update in [Update::Corrected, Update::Printed] {
        let mut x = Plane::new(N, N);
        let equations = guided::equations(2.0, update, &rows(N, constraint), &mut x).unwrap();
        let right = direct(&equations, &x);
        assert!(guided::solve(&equations, &mut x, STOP).unwrap().converged);
        assert!(difference(&x, &right) < 1e-6, "{update:?}: {}", difference(&x, &right));
    }
}

#[test]
fn least_squares_are_those_of_elimination() {
    for weight in [1.0, 10.0, 100.0] {
        let mut x = Plane::new(N, N);
        let equations = variational::equations(2.0, weight, &rows(N, constraint), &mut x).unwrap();
        let right = direct(&equations, &x);
        let progress = variational::solve(&equations, &mut x, STOP).unwrap();
        assert!(progress.converged, "{weight}: {:?}", progress.last());
        assert!(difference(&x, &right) < 1e-6, "{weight}: {}", difference(&x, &right));
    }
}
