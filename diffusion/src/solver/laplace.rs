//! ΔF = 0 between given values, the five fields of Hnaidi 2010 §5.2 that are diffused alone: A, R, the gradient's norm, and its
//! direction's two components. Fields that are given at the same nodes are solved together.

use super::SolveError;
use super::engine::{Engine, Kind, Processor};
use super::equations::{Equation, Equations};
use super::krylov::{Progress, Stop};
use crate::plane::Plane;

/// ΔF = 0 on `width × height` nodes but for those whose value is given.
pub fn equations(width: usize, height: usize, given: impl Fn(usize, usize) -> bool + Sync) -> Equations {
    Equations::new(width, height, |j, row| {
        row.iter_mut().enumerate().filter(|(i, _)| given(*i, j)).for_each(|(_, node)| *node = Equation::Given);
    })
}

/// Solves for the K fields in `values`, from what they hold at free nodes.
///
/// # Errors
/// [`SolveError::Unheld`] when no value is given.
pub fn diffuse<const K: usize>(
    equations: &Equations,
    values: &mut Plane<f64, K>,
    stop: Stop,
) -> Result<Progress<K>, SolveError> {
    if !equations.any_given() {
        return Err(SolveError::Unheld);
    }
    Processor.solve(Kind::Symmetric, equations, values, stop)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some scattered values and a fixed polyline, the same for every size.
    fn example(n: usize) -> (Equations, Plane<f64, 2>) {
        let at = |t: f64| ((t * (n - 1) as f64).round()) as usize;
        let mut fixed = vec![None; n * n];
        for k in 0..=4 * n {
            let t = k as f64 / (4 * n) as f64;
            let (x, y) = (0.15 + 0.6 * t, 0.3 + 0.4 * t * t);
            fixed[at(y) * n + at(x)] = Some([100.0 * t, 1.0 - t]);
            let (x, y) = (0.8 - 0.1 * t, 0.1 + 0.8 * t);
            fixed[at(y) * n + at(x)] = Some([40.0, t]);
        }
        fixed[0] = Some([-30.0, 0.5]);
        let operator = equations(n, n, |i, j| fixed[j * n + i].is_some());
        let mut values = Plane::new(n, n);
        for j in 0..n {
            for i in 0..n {
                if let Some(pair) = fixed[j * n + i] {
                    values.set(i, j, pair);
                }
            }
        }
        (operator, values)
    }

    #[test]
    fn eight_iterations_do_at_every_size() {
        for n in [65, 129, 257, 400] {
            let (operator, mut values) = example(n);
            let progress = diffuse(&operator, &mut values, Stop::default()).unwrap();
            assert!(progress.converged, "{n}: {progress:?}");
            assert!(progress.iterations() <= 8, "{n}: {:?}", progress.residuals);
        }
    }

    #[test]
    fn diffused_values_obey_the_maximum_principle_and_fixed_ones_stay() {
        let (operator, mut values) = example(129);
        let before = values.clone();
        diffuse(&operator, &mut values, Stop { relative_residual: 1e-12, ..Stop::default() }).unwrap();
        for j in 0..129 {
            for i in 0..129 {
                let [height, share] = values.at(i, j);
                assert!((-30.0 - 1e-6..=100.0 + 1e-6).contains(&height) && (-1e-6..=1.0 + 1e-6).contains(&share));
                if operator.is_given(i, j) {
                    let [fixed_height, fixed_share] = before.at(i, j);
                    assert!((height - fixed_height).abs() < 1e-9 && (share - fixed_share).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_plane_between_its_borders_is_the_plane() {
        let n = 65;
        let border = |i: usize, j: usize| i == 0 || j == 0 || i == n - 1 || j == n - 1;
        let plane = |i: usize, j: usize| 3.0 * i as f64 - 2.0 * j as f64 + 7.0;
        let operator = equations(n, n, border);
        let mut values = Plane::<f64, 1>::new(n, n);
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|&(i, j)| border(i, j)) {
            values.set(i, j, [plane(i, j)]);
        }
        diffuse(&operator, &mut values, Stop { relative_residual: 1e-13, ..Stop::default() }).unwrap();
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            assert!((values.at(i, j)[0] - plane(i, j)).abs() < 1e-8);
        }
    }

    #[test]
    fn a_field_that_nothing_holds_is_refused() {
        let operator = equations(20, 20, |_, _| false);
        let refused = diffuse(&operator, &mut Plane::<f64, 1>::new(20, 20), Stop::default());
        assert!(matches!(refused, Err(SolveError::Unheld)));
    }

    #[test]
    fn threads_do_not_matter() {
        let solve = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let (operator, mut values) = example(100);
                diffuse(&operator, &mut values, Stop::default()).unwrap();
                values
            })
        };
        assert_eq!(solve(1), solve(3));
    }
}
