//! Krylov methods in `f64` around the `f32` cycle: conjugate gradients for symmetric operators, BiCGStab for the others. Several fields
//! that share an operator advance together, each with its own scalars; one that has arrived stands still.

use super::cycle::Cycle;
use crate::plane::Plane;

/// A linear operator on K fields at once.
pub trait Operator<const K: usize>: Sync {
    /// `result` = b − A·x; without `b`, A·x.
    fn residual(&self, x: &Plane<f64, K>, b: Option<&Plane<f64, K>>, result: &mut Plane<f64, K>);
}

impl<const K: usize> Operator<K> for crate::stencil::Stencil<f64> {
    fn residual(&self, x: &Plane<f64, K>, b: Option<&Plane<f64, K>>, result: &mut Plane<f64, K>) {
        crate::stencil::Stencil::residual(self, x, b, result);
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// ‖b − A·x‖ / ‖b‖ in the Euclidean norm, for every field.
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
}

impl<const K: usize> Progress<K> {
    /// Iterations done.
    pub fn iterations(&self) -> usize {
        self.residuals.len() - 1
    }
    /// The last relative residual of each field, recomputed from x where the method has ended.
    pub fn last(&self) -> [f64; K] {
        self.residuals.last().copied().unwrap_or([f64::NAN; K])
    }
}

/// a·x + y in place, per field.
fn add<const K: usize>(y: &mut Plane<f64, K>, a: [f64; K], x: &Plane<f64, K>) {
    y.update(|j, row| {
        for (y, x) in row.iter_mut().zip(x.padded_row(j as isize)) {
            *y = std::array::from_fn(|k| y[k] + a[k] * x[k]);
        }
    });
}

/// y ← x + a·y, per field.
fn scale_add<const K: usize>(y: &mut Plane<f64, K>, a: [f64; K], x: &Plane<f64, K>) {
    y.update(|j, row| {
        for (y, x) in row.iter_mut().zip(x.padded_row(j as isize)) {
            *y = std::array::from_fn(|k| x[k] + a[k] * y[k]);
        }
    });
}

/// a / b, or 0 where b is 0 or the field has arrived.
fn ratio<const K: usize>(a: [f64; K], b: [f64; K], active: [bool; K]) -> [f64; K] {
    std::array::from_fn(|k| if active[k] && b[k] != 0.0 { a[k] / b[k] } else { 0.0 })
}

/// Norms of residuals over those of right-hand sides.
struct Meter<const K: usize> {
    scale: [f64; K],
    stop: Stop,
    residuals: Vec<[f64; K]>,
}

impl<const K: usize> Meter<K> {
    fn new(b: &Plane<f64, K>, stop: Stop) -> Meter<K> {
        let scale = b.dot(b).map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
        Meter { scale, stop, residuals: Vec::new() }
    }
    fn note(&mut self, residual: &Plane<f64, K>) {
        let squares = residual.dot(residual);
        self.residuals.push(std::array::from_fn(|k| squares[k].sqrt() * self.scale[k]));
    }
    /// The fields that have not arrived. A residual that is no number has not.
    fn active(&self) -> [bool; K] {
        self.residuals[self.residuals.len() - 1]
            .map(|residual| residual.is_nan() || residual > self.stop.relative_residual)
    }
    fn done(&self) -> bool {
        self.residuals.len() > self.stop.iterations || !self.active().contains(&true)
    }
    /// The residual of x itself takes the place of the one that the method carried along.
    fn finish(mut self, true_residual: &Plane<f64, K>) -> Progress<K> {
        self.residuals.pop();
        self.note(true_residual);
        let converged = !self.active().contains(&true);
        Progress { residuals: self.residuals, converged }
    }
}

/// Preconditioned conjugate gradients, from the `x` given. A must be symmetric and positive, the cycle symmetric.
pub fn conjugate_gradients<const K: usize>(
    operator: &impl Operator<K>,
    cycle: &mut Cycle<K>,
    b: &Plane<f64, K>,
    x: &mut Plane<f64, K>,
    stop: Stop,
) -> Progress<K> {
    let plane = || Plane::<f64, K>::new(b.width(), b.height());
    let (mut r, mut z, mut p, mut q) = (plane(), plane(), plane(), plane());
    operator.residual(x, Some(b), &mut r);
    let mut meter = Meter::new(b, stop);
    meter.note(&r);
    let mut rho = [0.0; K];
    while !meter.done() {
        let active = meter.active();
        cycle.apply(&r, &mut z);
        let next = r.dot(&z);
        scale_add(&mut p, ratio(next, rho, active), &z);
        rho = next;
        operator.residual(&p, None, &mut q);
        let alpha = ratio(rho, p.dot(&q), active);
        add(x, alpha, &p);
        add(&mut r, alpha.map(|a| -a), &q);
        meter.note(&r);
    }
    operator.residual(x, Some(b), &mut r);
    meter.finish(&r)
}

/// BiCGStab (van der Vorst 1992), preconditioned from the right, from the `x` given: for operators that are not symmetric.
pub fn bicgstab<const K: usize>(
    operator: &impl Operator<K>,
    cycle: &mut Cycle<K>,
    b: &Plane<f64, K>,
    x: &mut Plane<f64, K>,
    stop: Stop,
) -> Progress<K> {
    let plane = || Plane::<f64, K>::new(b.width(), b.height());
    let (mut r, mut p, mut v, mut s, mut t) = (plane(), plane(), plane(), plane(), plane());
    operator.residual(x, Some(b), &mut r);
    let shadow = r.clone();
    let mut meter = Meter::new(b, stop);
    meter.note(&r);
    let (mut rho, mut alpha, mut omega) = ([1.0; K], [1.0; K], [1.0; K]);
    let mut first = true;
    while !meter.done() {
        let active = meter.active();
        let next = shadow.dot(&r);
        if first {
            p.assign(&r);
            first = false;
        } else {
            // p ← r + β(p − ω·v)
            let beta = ratio(next, rho, active);
            let beta = std::array::from_fn(|k| if omega[k] != 0.0 { beta[k] * alpha[k] / omega[k] } else { 0.0 });
            add(&mut p, omega.map(|o| -o), &v);
            scale_add(&mut p, beta, &r);
        }
        rho = next;
        cycle.apply(&p, &mut s);
        operator.residual(&s, None, &mut v);
        alpha = ratio(rho, shadow.dot(&v), active);
        add(x, alpha, &s);
        // r is now the half-step's residual.
        add(&mut r, alpha.map(|a| -a), &v);
        cycle.apply(&r, &mut s);
        operator.residual(&s, None, &mut t);
        omega = ratio(t.dot(&r), t.dot(&t), active);
        add(x, omega, &s);
        add(&mut r, omega.map(|o| -o), &t);
        meter.note(&r);
    }
    operator.residual(x, Some(b), &mut r);
    meter.finish(&r)
}
