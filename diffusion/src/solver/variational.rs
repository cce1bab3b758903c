//! The least-squares field: of all fields through the given elevations, the one that minimises
//!
//! > Σ over edges (F_p − F_q − G_pq)² + (λ − 1)·Σ over cells (n·∇F − g)²·s²,
//!
//! G_pq being what a slope asks of the edge from q to p and 0 where none does, s the spacing. In a band the first sum is
//! |∇F − g·n|² = (t·∇F)² + (n·∇F − g)² with t across n, and the second weighs the slope λ times; outside it is the Dirichlet energy. So a
//! band that nothing hems in has the slope asked for whatever λ is, and against a flux c forced on it from outside the slope gives way by
//! c/λ; with the whole of |∇F|² in bands it would be g·λ/(1 + λ) even then. Both sums are integrals of the plane, without the spacing:
//! the field does not depend on the raster as it grows fine. The system is symmetric and positive, so it has one answer
//! whatever the directions do, and −n with −g is the same as n with g.

use super::SolveError;
use super::engine::{Engine, Kind, Processor};
use super::equations::{Equation, Equations, Other};
use super::guided::{Constraint, Slope};
use super::krylov::{Progress, Stop};
use crate::plane::Plane;

/// What a node is to its neighbours.
#[derive(Clone, Copy, Debug)]
enum Ground {
    Free,
    Given,
    Near { weight: f64, elevation: f64 },
    Slope { n: [f32; 2], rise: f32, beyond: f32 },
}

/// The equations of the nodes of `elevation`, `spacing` metres apart, into which the elevations given are written; what is wanted of
/// nodes is given by row, with their columns; `weight` is λ ≥ 1.
///
/// # Errors
/// [`SolveError::Unheld`] when no elevation is given anywhere.
pub fn equations(
    spacing: f64,
    weight: f64,
    constraints: &[Vec<(u32, Constraint)>],
    elevation: &mut Plane<f64, 1>,
) -> Result<Equations, SolveError> {
    let (width, height) = (elevation.width(), elevation.height());
    let mut ground = vec![Ground::Free; width * height];
    for (j, row) in constraints.iter().enumerate() {
        for (i, constraint) in row {
            ground[j * width + *i as usize] = match *constraint {
                Constraint::Free => Ground::Free,
                Constraint::Elevation(value) => {
                    elevation.set(*i as usize, j, [value]);
                    Ground::Given
                }
                // α·mean + (1 − α)·elevation, times four neighbours.
                Constraint::Near { elevation, smoothing } => {
                    Ground::Near { weight: 4.0 * (1.0 - smoothing) / smoothing, elevation }
                }
                Constraint::Slope(Slope { direction, rise, beyond, .. }) => {
                    Ground::Slope { n: direction.map(|x| x as f32), rise: rise as f32, beyond: beyond as f32 }
                }
            };
        }
    }
    if !ground.iter().any(|ground| matches!(ground, Ground::Given | Ground::Near { .. })) {
        return Err(SolveError::Unheld);
    }
    let raster = Bands { width, height, spacing, weight, ground };
    Ok(Equations::new(width, height, |j, row| (0..width).for_each(|i| row[i] = raster.equation(i, j))))
}

/// Solves from what `elevation` holds, metres: the elevations given, and a first guess elsewhere.
///
/// # Errors
/// [`SolveError::Singular`].
pub fn solve(equations: &Equations, elevation: &mut Plane<f64, 1>, stop: Stop) -> Result<Progress<1>, SolveError> {
    Processor.solve(Kind::Symmetric, equations, elevation, stop)
}

struct Bands {
    width: usize,
    height: usize,
    spacing: f64,
    weight: f64,
    ground: Vec<Ground>,
}

impl Bands {
    fn at(&self, i: isize, j: isize) -> Option<Ground> {
        let inside = (0..self.width as isize).contains(&i) && (0..self.height as isize).contains(&j);
        inside.then(|| self.ground[j as usize * self.width + i as usize])
    }
    /// The derivative of half the sum by F at node (i, j).
    fn equation(&self, i: usize, j: usize) -> Equation {
        let (i, j) = (i as isize, j as isize);
        let Some(own) = self.at(i, j) else { return Equation::Laplace };
        let around = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y)));
        let slope = |ground: Option<Ground>| matches!(ground, Some(Ground::Slope { .. }));
        match own {
            Ground::Given => return Equation::Given,
            Ground::Near { .. } => {}
            _ if around.clone().any(|(x, y)| slope(self.at(i + x, j + y))) => {}
            _ => return Equation::Laplace,
        }
        let mut other = Other::default();
        if let Ground::Near { weight, elevation } = own {
            other.add((0, 0), weight);
            other.constant += weight * elevation;
        }
        for step in [(0, -1), (-1, 0), (1, 0), (0, 1)] {
            if let Some(beside) = self.at(i + step.0, j + step.1) {
                other.add(step, 1.0);
                other.constant += self.edge(own, beside, [-step.0 as f64, -step.1 as f64]);
            }
        }
        for (x, y) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
            self.cell(i + x, j + y, (-x, -y), &mut other);
        }
        Equation::Other(other)
    }
    /// What slopes ask of the edge to `p` from its neighbour `q`, `e` being the step from `q` to `p`: the mean over the ends that have a
    /// slope; less where the edge comes from a plateau, whose part of it is level.
    fn edge(&self, p: Ground, q: Ground, e: [f64; 2]) -> f64 {
        let (mut total, mut count) = (0.0, 0.0);
        for (end, far) in [(p, q), (q, p)] {
            if let Ground::Slope { n, rise, beyond } = end {
                let along = (f64::from(n[0]) * e[0] + f64::from(n[1]) * e[1]) * self.spacing;
                let share = match far {
                    Ground::Given | Ground::Near { .. } => (f64::from(beyond) / along.abs()).min(1.0),
                    _ => 1.0,
                };
                total += if along == 0.0 { 0.0 } else { f64::from(rise) * along * share };
                count += 1.0;
            }
        }
        if count > 0.0 { total / count } else { 0.0 }
    }
    /// Adds (λ − 1)·¼·Σ over the corners s of a cell of v_p·(Σ v_k·F_k − g_s), v_k the share of corner k in n_s·∇F, if all of them have a
    /// slope; `own` is the corner p that the equation is of.
    fn cell(&self, i: isize, j: isize, own: (isize, isize), other: &mut Other) {
        const CORNERS: [(isize, isize); 4] = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let corners = CORNERS.map(|(x, y)| self.at(i + x, j + y));
        for corner in corners {
            if !matches!(corner, Some(Ground::Slope { .. })) {
                return;
            }
        }
        let mut add = |weight: f64, share: &dyn Fn((isize, isize)) -> f64, asked: f64| {
            let scale = weight * share(own);
            for at in CORNERS.into_iter().filter(|at| *at != own) {
                other.add((at.0 - own.0, at.1 - own.1), -scale * share(at));
            }
            other.constant += scale * asked;
        };
        for corner in corners {
            let Some(Ground::Slope { n, rise, .. }) = corner else { return };
            let share =
                |(x, y): (isize, isize)| f64::from(n[0]) * (x as f64 - 0.5) + f64::from(n[1]) * (y as f64 - 0.5);
            add(0.25 * (self.weight - 1.0), &share, f64::from(rise) * self.spacing);
        }
        // The gradient at the middle of a cell does not see the twist F₀₀ − F₁₀ − F₀₁ + F₁₁. A quarter of its square makes the sum
        // n_x²·(mean of (∂F/∂x)² over two edges) + …, with which relaxation smooths; planes have none.
        add(self.weight - 1.0, &|(x, y)| if x == y { 0.5 } else { -0.5 }, 0.0);
    }
}

#[cfg(test)]
#[path = "variational_tests.rs"]
mod tests;
