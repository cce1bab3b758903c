//! Krylov methods around the cycle: conjugate gradients for symmetric operators, BiCGStab for the others. What is solved for is kept in
//! `f64` and its residual is computed anew in every iteration; the residual itself and what corrects it are `f32`, which costs digits
//! relative to the residual and not to the field. Several fields that share an operator advance together, each with its own
//! scalars; one that has arrived stands still.

use super::cycle::Cycle;
use super::equations::Equations;
use super::rows::Rows;
use crate::plane::{Plane, dot, sum, wide};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// ‖b − A·x‖ / ‖b‖ in the Euclidean norm, for every field; b holds the given values and what they contribute to other equations.
    pub relative_residual: f64,
    /// Iterations after which to stop anyway.
    pub iterations: usize,
}

impl Default for Stop {
    fn default() -> Stop {
        Stop { relative_residual: 1e-8, iterations: 100 }
    }
}

/// How far a solve came.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress<const K: usize> {
    /// ‖b − A·x‖ / ‖b‖ of each field at the start and after each iteration; 0 where b is 0.
    pub residuals: Vec<[f64; K]>,
    /// Whether every field met the tolerance.
    pub converged: bool,
    /// What it took beside the field itself, bytes.
    pub bytes: usize,
}

impl<const K: usize> Progress<K> {
    /// Iterations done.
    pub fn iterations(&self) -> usize {
        self.residuals.len() - 1
    }
    /// The last relative residual of each field.
    pub fn last(&self) -> [f64; K] {
        self.residuals.last().copied().unwrap_or([f64::NAN; K])
    }
}

/// The residual of x into the cycle, and its relative norms into the meter.
struct Meter<'a, const K: usize> {
    equations: &'a Equations,
    scale: [f64; K],
    stop: Stop,
    residuals: Vec<[f64; K]>,
}

impl<'a, const K: usize> Meter<'a, K> {
    fn new(equations: &'a Equations, x: &Plane<f64, K>, stop: Stop) -> Meter<'a, K> {
        let scale = equations.known(x).map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
        Meter { equations, scale, stop, residuals: Vec::new() }
    }
    fn measure(&mut self, x: &Plane<f64, K>, residual: &mut Plane<f32, K>) {
        let squares = self.equations.residual(x, residual);
        self.residuals.push(std::array::from_fn(|k| squares[k].sqrt() * self.scale[k]));
    }
    /// The fields that have not arrived. A residual that is no number has not.
    fn active(&self) -> [bool; K] {
        let above = |residual: f64| residual.is_nan() || residual > self.stop.relative_residual;
        self.residuals[self.residuals.len() - 1].map(above)
    }
    fn done(&self) -> bool {
        self.residuals.len() > self.stop.iterations || !self.active().contains(&true)
    }
    fn finish(self, bytes: usize) -> Progress<K> {
        let converged = !self.active().contains(&true);
        Progress { residuals: self.residuals, converged, bytes }
    }
}

/// y ← y + a·x, per field.
fn add<T: crate::plane::Float, const K: usize>(y: &mut Plane<T, K>, a: [f64; K], x: &Plane<f32, K>) {
    y.update(|j, fields, _| {
        for (k, row) in fields.into_iter().enumerate() {
            let a = T::of(a[k]);
            wide(
                #[inline(always)]
                || row.iter_mut().zip(x.row(j as isize, k)).for_each(|(y, x)| *y += a * T::of_single(*x)),
            );
        }
    });
}

/// y ← x + a·y, per field.
fn scale_add<const K: usize>(y: &mut Plane<f32, K>, a: [f64; K], x: &Plane<f32, K>) {
    y.update(|j, fields, _| {
        for (k, row) in fields.into_iter().enumerate() {
            let a = a[k] as f32;
            wide(
                #[inline(always)]
                || row.iter_mut().zip(x.row(j as isize, k)).for_each(|(y, x)| *y = x + a * *y),
            );
        }
    });
}

/// a / b, or 0 where b is 0 or the field has arrived.
fn ratio<const K: usize>(a: [f64; K], b: [f64; K], active: [bool; K]) -> [f64; K] {
    std::array::from_fn(|k| if active[k] && b[k] != 0.0 { a[k] / b[k] } else { 0.0 })
}

/// p·A·p.
fn energy<const K: usize>(equations: &Equations, p: &Plane<f32, K>) -> [f64; K] {
    use rayon::prelude::*;
    let rows: Vec<[f64; K]> = (0..p.height())
        .into_par_iter()
        .map_init(
            || vec![0.0; p.width()],
            |product, j| {
                std::array::from_fn(|k| {
                    let beside = p.beside(j, k);
                    equations.product(j, beside, product);
                    wide(
                        #[inline(always)]
                        || dot(&beside[1][1..=p.width()], product),
                    )
                })
            },
        )
        .collect();
    sum(&rows)
}

/// Preconditioned conjugate gradients, from the `x` given. A must be symmetric and positive, the cycle symmetric.
pub fn conjugate_gradients<const K: usize>(
    equations: &Equations,
    cycle: &mut Cycle<'_, K>,
    x: &mut Plane<f64, K>,
    stop: Stop,
) -> Progress<K> {
    let mut p = Plane::new(x.width(), x.height());
    let mut meter = Meter::new(equations, x, stop);
    meter.measure(x, cycle.residual());
    let mut rho = [0.0; K];
    while !meter.done() {
        let active = meter.active();
        cycle.apply();
        let (r, z) = cycle.correction();
        let next = r.dot(z);
        scale_add(&mut p, ratio(next, rho, active), z);
        rho = next;
        let alpha = ratio(rho, energy(equations, &p), active);
        add(x, alpha, &p);
        meter.measure(x, cycle.residual());
    }
    meter.finish(equations.bytes() + cycle.bytes() + p.bytes())
}

/// BiCGStab (van der Vorst 1992), preconditioned from the right, from the `x` given: for operators that are not symmetric.
pub fn bicgstab<const K: usize>(
    equations: &Equations,
    cycle: &mut Cycle<'_, K>,
    x: &mut Plane<f64, K>,
    stop: Stop,
) -> Progress<K> {
    let plane = || Plane::<f32, K>::new(x.width(), x.height());
    let product = |x: &Plane<f32, K>, result: &mut Plane<f32, K>| {
        result.update(|j, fields, _| {
            for (k, row) in fields.into_iter().enumerate() {
                equations.product(j, x.beside(j, k), &mut row[1..]);
            }
        });
    };
    let (mut r, mut p, mut v, mut t) = (plane(), plane(), plane(), plane());
    let mut meter = Meter::new(equations, x, stop);
    meter.measure(x, &mut r);
    let shadow = r.clone();
    let (mut rho, mut alpha, mut omega) = ([1.0; K], [1.0; K], [1.0; K]);
    while !meter.done() {
        let active = meter.active();
        let next = shadow.dot(&r);
        if meter.residuals.len() == 1 {
            p.assign(&r);
        } else {
            // p ← r + β(p − ω·v)
            let beta = ratio(next, rho, active);
            let beta = std::array::from_fn(|k| if omega[k] != 0.0 { beta[k] * alpha[k] / omega[k] } else { 0.0 });
            add(&mut p, omega.map(|o| -o), &v);
            scale_add(&mut p, beta, &r);
        }
        rho = next;
        cycle.residual().assign(&p);
        cycle.apply();
        let (_, z) = cycle.correction();
        product(z, &mut v);
        alpha = ratio(rho, shadow.dot(&v), active);
        add(x, alpha, z);
        // r is now the half-step's residual.
        add(&mut r, alpha.map(|a| -a), &v);
        cycle.residual().assign(&r);
        cycle.apply();
        let (_, z) = cycle.correction();
        product(z, &mut t);
        omega = ratio(t.dot(&r), t.dot(&t), active);
        add(x, omega, z);
        meter.measure(x, &mut r);
    }
    let planes = [&r, &p, &v, &t, &shadow].map(Plane::bytes).iter().sum::<usize>();
    meter.finish(equations.bytes() + cycle.bytes() + planes)
}
