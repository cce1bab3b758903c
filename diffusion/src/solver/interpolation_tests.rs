use super::super::equations::{Equation, Equations};
use super::*;

fn laplace(width: usize, height: usize, given: &[(usize, usize)]) -> Equations {
    Equations::new(width, height, |j, row| {
        given.iter().filter(|node| node.1 == j).for_each(|node| row[node.0] = Equation::Given);
    })
}

#[test]
fn constants_are_interpolated_away_from_constraints_and_constraints_take_nothing() {
    for (w, h) in [(9, 9), (8, 6), (7, 10)] {
        let p = Interpolation::of(&laplace(w, h, &[(3, 3)]));
        for (i, j) in (0..h).flat_map(|j| (0..w).map(move |i| (i, j))) {
            let total: f32 = p.at(i, j).iter().sum();
            let near = i.abs_diff(3) + j.abs_diff(3) <= 2;
            if i == 3 && j == 3 {
                assert_eq!(total, 0.0, "odd constrained node of {w} × {h}");
            } else if !near {
                assert!((total - 1.0).abs() < 1e-6, "({i}, {j}) of {w} × {h}: {total}");
            }
            assert!(p.at(i, j).iter().all(|weight| (0.0..=1.0).contains(weight)));
        }
    }
}

/// Column by column: A_c·e = Pᵀ(A(P·e)).
fn is_triple_product(fine: &Equations) {
    let p = Interpolation::of(fine);
    let coarse = p.coarse_operator(fine);
    let product = |operator: &(dyn Fn(usize, [&[f32]; 3], &mut [f32]) + Sync), x: &Plane<f32, 1>| {
        let mut y = Plane::<f32, 1>::new(x.width(), x.height());
        y.update(|j, [row], _| operator(j, x.beside(j, 0), &mut row[1..]));
        y.update(|_, [row], _| *row.last_mut().unwrap() = 0.0);
        y
    };
    for (ci, cj) in (0..coarse.height()).flat_map(|cj| (0..coarse.width()).map(move |ci| (ci, cj))) {
        if fine.is_given(2 * ci, 2 * cj) {
            assert_eq!(coarse.at(ci, cj), std::array::from_fn(|k| if k == SELF { 1.0 } else { 0.0 }));
            continue;
        }
        let mut unit = Plane::<f32, 1>::new(coarse.width(), coarse.height());
        unit.set(ci, cj, [1.0]);
        let mut up = Plane::<f32, 1>::new(fine.width(), fine.height());
        up.update(|j, [row], _| p.add_row(&unit, j, 0, row));
        let image = product(&|j, beside, out| fine.product(j, beside, out), &up);
        let mut down = Plane::<f32, 1>::new(coarse.width(), coarse.height());
        p.restrict(&image, &mut down);
        let direct = product(&|j, beside, out| coarse.product(j, beside, out), &unit);
        let given = |n: usize| fine.is_given(n % coarse.width() * 2, n / coarse.width() * 2);
        for (_, (down, direct)) in down.iter(0).zip(direct.iter(0)).enumerate().filter(|&(n, _)| !given(n)) {
            assert!((down - direct).abs() < 1e-5, "({ci}, {cj}): {down}, {direct}");
        }
    }
}

#[test]
fn coarse_operator_is_the_triple_product() {
    let fine = laplace(7, 6, &[(2, 2), (5, 1)]);
    is_triple_product(&fine);
    assert!(Interpolation::of(&fine).coarse_operator(&fine).is_symmetric(1e-6));
    // Wide enough that plain nodes are met.
    let wide = laplace(24, 21, &[(2, 2), (15, 3)]);
    is_triple_product(&wide);
    assert!((0..12).any(|i| Interpolation::of(&wide).coarse_operator(&wide).at(i, 5) == PLAIN));
}
