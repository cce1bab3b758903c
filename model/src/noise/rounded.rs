//! The walker of numbers that carry their own `f32` error: the exact part by the walker of intervals, the error by
//! running the cell formula itself on such numbers in each cell that the point may fall in.
//!
//! Exact and `f32` arithmetic may put a point near a border in different cells A and B. The noise is continuous with
//! its gradient, so with a border point b between the exact point p and the `f32` point p̂,
//! |fl_B(p̂) − n_A(p)| ≤ |fl_B(p̂) − n_B(b)| + |n_A(b) − n_A(p)|: the errors of the cells met add up. Values have the
//! shorter way |fl_B(p̂) − n(p̂)| + λ·|p̂ − p|, in which only the cell of p̂ matters.

use super::corner::dot;
use super::enclose::{based, for_each_cell, for_each_kernel};
use super::hash::Keys;
use super::{
    GRADIENT2_SLOPE, GRADIENT3_SLOPE, Lattice, NoiseJet, NoiseValue, SIMPLEX3_SLOPE, gradient2, gradient3, simplex3,
};
use crate::interval::Interval;
use crate::real::Real;
use crate::rounding::{Rounded, UNIT};

/// A coordinate's error inside its cell: x − ⌊x⌋ rounds only for −1 < x < 0, by half an ulp of a number below 1.
fn in_cell(x: Rounded) -> f64 {
    x.error + UNIT
}

/// Visits the cells that `f32` may put the point into, with the coordinates that it may hold there.
fn cells<const D: usize>(x: [Rounded; D], mut visit: impl FnMut([u32; D], [Interval; D])) -> bool {
    let reach = x.map(|x| if x.error == 0.0 { x.exact } else { x.reach() });
    for_each_cell(reach, |cell, t| {
        visit(cell, t.map(|t| Interval::new((t.lo() - UNIT).max(0.0), (t.hi() + UNIT).min(1.0))))
    })
}

/// The largest error of `cell` on coordinates as `f32` holds them.
fn value_error<const D: usize>(x: [Rounded; D], mut cell: impl FnMut([u32; D], [Rounded; D]) -> Rounded) -> f64 {
    let mut most = 0.0f64;
    let found = cells(x, |index, t| most = most.max(cell(index, t.map(|t| Rounded::new(t, 0.0))).error));
    if found { most } else { f64::INFINITY }
}

/// The errors of `jet`, added up over the cells that the exact or the `f32` point may lie in.
fn jet_errors<const D: usize, const M: usize>(
    x: [Rounded; D],
    mut jet: impl FnMut([u32; D], [Rounded; D]) -> [Rounded; M],
) -> [f64; M] {
    let mut sum = [0.0f64; M];
    let found = cells(x, |cell, t| {
        let mut local = x;
        for k in 0..D {
            local[k] = Rounded::new(t[k], in_cell(x[k]));
        }
        for (sum, part) in sum.iter_mut().zip(jet(cell, local)) {
            *sum = (*sum + part.error).next_up();
        }
    });
    if found { sum } else { [f64::INFINITY; M] }
}

/// λ · |input error|, rounded up.
fn moved<const D: usize>(slope: f64, x: [Rounded; D]) -> f64 {
    slope * x.iter().map(|x| in_cell(*x)).sum::<f64>() * (1.0 + 8.0 * f64::EPSILON)
}

fn attach<const M: usize>(exact: [Interval; M], errors: [f64; M]) -> [Rounded; M] {
    let mut out = [Rounded::constant(0.0); M];
    for k in 0..M {
        out[k] = Rounded::new(exact[k], errors[k]);
    }
    out
}

impl NoiseValue for Rounded {
    fn gradient2(lattice: Lattice<2>, x: [Rounded; 2]) -> Rounded {
        let keys = Keys::new(lattice.seed);
        let exact = Interval::gradient2(lattice, x.map(|x| x.exact));
        // Evaluation on error-free coordinates, then the noise's own slope times the error of the coordinates.
        let evaluation = value_error(x, |cell, t| {
            let g = keys.cell2(based(lattice, cell)).map(|h| gradient2::direction(h).map(Rounded::constant));
            gradient2::cell(t, &g)
        });
        let evaluation = evaluation.min(gradient2_uniform());
        Rounded::new(exact, (evaluation + moved(GRADIENT2_SLOPE, x)).next_up())
    }
    fn gradient3(lattice: Lattice<3>, x: [Rounded; 3]) -> Rounded {
        let keys = Keys::new(lattice.seed);
        let exact = Interval::gradient3(lattice, x.map(|x| x.exact));
        let evaluation = value_error(x, |cell, t| {
            let g = keys.cell3(based(lattice, cell)).map(|h| gradient3::edge(h).map(Rounded::constant));
            gradient3::cell(t, &g)
        });
        let evaluation = evaluation.min(gradient3_uniform());
        Rounded::new(exact, (evaluation + moved(GRADIENT3_SLOPE, x)).next_up())
    }
    fn simplex3(lattice: Lattice<3>, x: [Rounded; 3]) -> Rounded {
        let exact = Interval::simplex3(lattice, x.map(|x| x.exact));
        let still = x.map(|x| Rounded::new(x.exact + Interval::symmetric(x.error), 0.0));
        let [evaluation, ..] = simplex_errors(lattice, still);
        let evaluation = evaluation.min(simplex_uniform());
        Rounded::new(exact, (evaluation + moved(SIMPLEX3_SLOPE, x)).next_up())
    }
}

impl NoiseJet for Rounded {
    fn gradient2_jet(lattice: Lattice<2>, x: [Rounded; 2]) -> [Rounded; 3] {
        let keys = Keys::new(lattice.seed);
        let exact = Interval::gradient2_jet(lattice, x.map(|x| x.exact));
        let mut errors = jet_errors(x, |cell, t| {
            let g = keys.cell2(based(lattice, cell)).map(|h| gradient2::direction(h).map(Rounded::constant));
            gradient2::cell_jet(t, &g)
        });
        errors[0] = Self::gradient2(lattice, x).error;
        attach(exact, errors)
    }
    fn gradient3_jet(lattice: Lattice<3>, x: [Rounded; 3]) -> [Rounded; 4] {
        let keys = Keys::new(lattice.seed);
        let exact = Interval::gradient3_jet(lattice, x.map(|x| x.exact));
        let mut errors = jet_errors(x, |cell, t| {
            let g = keys.cell3(based(lattice, cell)).map(|h| gradient3::edge(h).map(Rounded::constant));
            gradient3::cell_jet(t, &g)
        });
        errors[0] = Self::gradient3(lattice, x).error;
        attach(exact, errors)
    }
    fn simplex3_jet(lattice: Lattice<3>, x: [Rounded; 3]) -> [Rounded; 4] {
        let exact = Interval::simplex3_jet(lattice, x.map(|x| x.exact));
        let mut errors = simplex_errors(lattice, x);
        errors[0] = Self::simplex3(lattice, x).error;
        attach(exact, errors)
    }
}

/// The evaluation error anywhere in a cell, for any gradients.
fn gradient2_uniform() -> f64 {
    let component = Rounded::new(
        Interval::symmetric(gradient2::LONG),
        Rounded::constant(gradient2::LONG).error.max(Rounded::constant(gradient2::SHORT).error),
    );
    gradient2::cell([Rounded::new(Interval::UNIT, 0.0); 2], &[[component; 2]; 4]).error
}

/// The evaluation error anywhere in a cell, for any gradients.
fn gradient3_uniform() -> f64 {
    let component = Rounded::new(Interval::symmetric(1.0), 0.0);
    gradient3::cell([Rounded::new(Interval::UNIT, 0.0); 3], &[[component; 3]; 8]).error
}

/// Rounding of an offset on the way from the coordinates, in units of 2⁻²⁴: x − ⌊x⌋ gives ½, minus a step of at most 3
/// gives 3, the unskewing (at most 13 sixths) 2.2 for the constant and 2.2 for the product, its sum 1, the shift to
/// another corner 2.4. Together 11.3.
const OFFSET_ERROR: f64 = 12.0 * UNIT;
/// How far outside the tetrahedron that `f32` picks a point can lie, beside its own error: the skewed coordinates and
/// the order of the offsets are each off by less than 16 units per axis.
const OUTSIDE: f64 = 64.0 * UNIT;

/// What the corners that `f32` misses can contribute: their kernels vanish on the tetrahedron that was picked, so
/// at a distance δ outside it ½ − d² is at most 2·√½·δ, and weight and slope are its fourth and third power.
fn missed(x: [Rounded; 3]) -> (f64, f64) {
    let distance = OUTSIDE + x.iter().map(|x| x.error).sum::<f64>();
    let rest = (1.5 * distance).min(simplex3::RADIUS2);
    let (square, scale) = (rest * rest, simplex3::SCALE * 1.01);
    (scale * square * square, scale * (8.0 * square * rest + square * square))
}

/// Rounding errors of the sum over corners and of its gradient; all corners in reach are counted, though `f32` adds
/// four of them.
fn simplex_errors(lattice: Lattice<3>, x: [Rounded; 3]) -> [f64; 4] {
    let keys = Keys::new(lattice.seed);
    let mut errors = [0.0f64; 4];
    let input = [0, 1, 2].map(|k: usize| x[k].error);
    let (value, slope) = missed(x);
    let reach = x.map(|x| x.exact + Interval::symmetric(in_cell(x)));
    let found = for_each_kernel(lattice, reach, |[i, j, k], offset| {
        let g = gradient3::edge(keys.point3(i, j, k)).map(Rounded::constant);
        let d = [0, 1, 2].map(|k: usize| Rounded::new(offset[k], input[k] + OFFSET_ERROR));
        let corner = simplex3::corner(d);
        let height = dot(g, d);
        let mut parts = [corner.weight * height; 4];
        for a in 0..3 {
            parts[a + 1] = corner.slope[a] * height + corner.weight * g[a];
        }
        for (a, part) in parts.iter().enumerate() {
            // Three additions follow, each rounding a partial sum of such parts.
            let sums = 4.0 * UNIT * (part.exact.magnitude() + part.error);
            errors[a] = (errors[a] + part.error + sums + if a == 0 { value } else { slope }) * (1.0 + 1e-15);
        }
    });
    if found { errors } else { [f64::INFINITY; 4] }
}

/// The evaluation error of the sum over four corners anywhere, for any gradients.
fn simplex_uniform() -> f64 {
    let d = [Rounded::new(Interval::symmetric(1.0), OFFSET_ERROR); 3];
    let g = [Rounded::new(Interval::symmetric(1.0), 0.0); 3];
    let corner = simplex3::corner(d);
    let part = corner.weight * dot(g, d);
    let missed = simplex3::SCALE * (1.5 * OUTSIDE) * (1.5 * OUTSIDE);
    4.0 * (part.error + 4.0 * UNIT * (part.exact.magnitude() + part.error) + missed)
}
