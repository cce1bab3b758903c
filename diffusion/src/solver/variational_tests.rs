use super::*;
use crate::solver::rows::{Rows, STEPS, index_of};
use crate::solver::samples::{plane, rows};

const N: usize = 65;

/// The equations of a plane, a first guess, and the plane.
fn plane_problem(degrees: f64, rise: f64, weight: f64) -> (Equations, Plane<f64, 1>, impl Fn(usize, usize) -> f64) {
    let (rows, plane) = plane(N, degrees, rise);
    let mut x = Plane::new(N, N);
    (equations(2.0, weight, &rows, &mut x).unwrap(), x, plane)
}

#[test]
fn planes_are_exact_in_any_direction_and_with_any_weight() {
    for degrees in [0.0, 15.0, 30.0, 45.0, 100.0, 200.0, 300.0] {
        for weight in [1.0, 10.0, 100.0] {
            let (system, mut x, plane) = plane_problem(degrees, -0.5, weight);
            let progress = solve(&system, &mut x, Stop { relative_residual: 1e-11, iterations: 100 }).unwrap();
            assert!(progress.converged, "{degrees}°, {weight}: {:?}", progress.last());
            for (i, j) in (0..N).flat_map(|j| (0..N).map(move |i| (i, j))) {
                // Weights and directions are rounded to f32, over a rise of 90 m.
                let error = (x.at(i, j)[0] - plane(i, j)).abs();
                assert!(error < 1e-4, "{degrees}°, {weight}: {error} at ({i}, {j})");
            }
        }
    }
}

#[test]
fn the_system_is_symmetric() {
    let (system, ..) = plane_problem(35.0, 0.7, 40.0);
    let mut rows = vec![vec![[0.0; 9]; N]; N];
    rows.iter_mut().enumerate().for_each(|(j, row)| system.coefficients(j, row));
    for (i, j) in (1..N - 1).flat_map(|j| (1..N - 1).map(move |i| (i, j))) {
        for (k, (x, y)) in STEPS.into_iter().enumerate() {
            let (p, q) = ((i as isize + x) as usize, (j as isize + y) as usize);
            let (here, there) = (rows[j][i][k], rows[q][p][index_of((-x, -y))]);
            assert!((here - there).abs() <= 1e-5 * rows[j][i][4], "({i}, {j}) {k}: {here}, {there}");
        }
    }
}

#[test]
fn a_direction_turned_around_asks_for_the_same() {
    let slope = |sign: f64| {
        let at = |i: usize, _| match i {
            0 => Constraint::Elevation(10.0),
            1..=30 => Constraint::Slope(Slope::along([sign, 0.2 * sign], sign * 0.4).unwrap()),
            _ => Constraint::Free,
        };
        let mut x = Plane::new(N, N);
        let system = equations(1.0, 10.0, &rows(N, at), &mut x).unwrap();
        assert!(solve(&system, &mut x, Stop::default()).unwrap().converged);
        x
    };
    let (forth, back) = (slope(1.0), slope(-1.0));
    let difference = forth.iter(0).zip(back.iter(0)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(difference < 1e-4 && forth.at(30, 32)[0] > 15.0, "{difference}");
}

#[test]
fn iterations_do_not_depend_on_where_bands_lie() {
    // Bands to both sides of a given line, at odd and even rows, square and aslant.
    for (row, degrees) in [(48, 0.0), (49, 0.0), (48, 3.0), (51, 40.0)] {
        let n = [libm::sin(f64::to_radians(degrees)), libm::cos(f64::to_radians(degrees))];
        let at = |i: usize, j: usize| match j.abs_diff(row) {
            _ if !(20..=80).contains(&i) => Constraint::Free,
            0 => Constraint::Elevation(10.0),
            1..=20 => Constraint::Slope(Slope::along(n, -0.4).unwrap()),
            _ => Constraint::Free,
        };
        let mut x = Plane::new(101, 101);
        let system = equations(1.0, 10.0, &rows(101, at), &mut x).unwrap();
        let progress = solve(&system, &mut x, Stop::default()).unwrap();
        assert!(progress.converged && progress.iterations() <= 20, "{row}, {degrees}°: {:?}", progress.residuals);
    }
}
