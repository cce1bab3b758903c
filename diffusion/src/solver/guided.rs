//! The guided field h of Hnaidi 2010 §5.2: elevations given at some nodes, slopes at others, diffusion between.
//!
//! A node with a slope takes the mixture α·F_L + β·F_G + (1−α−β)·F_I of the mean of its neighbours, of the elevation that the slope
//! implies from the neighbour it comes from, and of a given elevation. For a unit direction n and the slope g along it, n·∇F = g read
//! upwind says |n_x|·(F − F_x) + |n_y|·(F − F_y) = g·s, where F_x is the neighbour against n_x, F_y that against n_y, and s the spacing:
//!
//! > F_G = (|n_x|·F_x + |n_y|·F_y + g·s) / (|n_x| + |n_y|),
//!
//! which is exact on planes. As printed (equation 2) the weights are n_x² and n_y² and nothing is divided, so that along n the slope
//! comes out as g / (|n_x|³ + |n_y|³): 41 % too steep at 45° (claims H1). That form is kept as [`Update::Printed`].

use super::SolveError;
use super::engine::{Engine, Kind, Processor};
use super::equations::{Equation, Equations, Other};
use super::krylov::{Progress, Stop};
use super::rows::{SELF, STEPS, index_of};
use crate::plane::Plane;

/// What holds at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Constraint {
    /// Nothing: F is the mean of the neighbours that exist (α = 1).
    #[default]
    Free,
    /// The elevation is given, metres (α = β = 0).
    Elevation(f64),
    /// The slope is given along a direction.
    Slope(Slope),
    /// The elevation is approached: α·mean + (1−α)·elevation, 0 < α < 1.
    Near {
        /// Metres.
        elevation: f64,
        /// α: 0 holds the elevation, 1 forgets it.
        smoothing: f64,
    },
}

/// A slope along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// n: east and north. Taken as it is: a diffused direction need not have unit length (claims H2), see [`Slope::along`].
    pub direction: [f64; 2],
    /// g: metres up for a metre along n; negative goes down.
    pub rise: f64,
    /// How far along n the slope has begun, metres; infinite if that is not known.
    pub beyond: f64,
    /// α of the mixture.
    pub smoothing: f64,
    /// β of the mixture, α + β ≤ 1; where it is less than 1 and no elevation is given, both are scaled to a sum of 1.
    pub guidance: f64,
}

impl Slope {
    /// α = β = ½ as in the paper, along a direction that is made a unit vector; `None` where it has no length to speak of, since then
    /// no direction is given.
    pub fn along(direction: [f64; 2], rise: f64) -> Option<Slope> {
        let length = (direction[0] * direction[0] + direction[1] * direction[1]).sqrt();
        let unit = direction.map(|component| component / length);
        (length > 1e-6).then_some(Slope { direction: unit, rise, beyond: f64::INFINITY, smoothing: 0.5, guidance: 0.5 })
    }
}

/// How a slope is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Update {
    /// Weights |n_x|, |n_y| over their sum: exact on planes.
    #[default]
    Corrected,
    /// Weights n_x², n_y² as in equation 2.
    Printed,
}

/// One node's equation F = Σ weight·F_neighbour + constant, weights by index of [`STEPS`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    weights: [f64; 9],
    constant: f64,
}

impl Row {
    /// The right-hand side for the neighbours' values given by their steps: one Jacobi iteration.
    pub(super) fn value(&self, at: impl Fn(isize, isize) -> f64) -> f64 {
        let named = STEPS.into_iter().enumerate().filter(|&(k, _)| self.weights[k] != 0.0);
        named.fold(self.constant, |total, (k, (x, y))| total + self.weights[k] * at(x, y))
    }
    pub(super) fn of(
        constraint: Constraint,
        update: Update,
        spacing: f64,
        exists: &impl Fn(isize, isize) -> bool,
    ) -> Row {
        let mut row = Row::default();
        match constraint {
            Constraint::Elevation(value) => row.constant = value,
            Constraint::Free => row.mean(1.0, exists),
            Constraint::Near { elevation, smoothing } => {
                row.mean(smoothing, exists);
                row.constant = (1.0 - smoothing) * elevation;
            }
            Constraint::Slope(slope) => {
                let total = slope.smoothing + slope.guidance;
                let (alpha, beta) = (slope.smoothing / total, slope.guidance / total);
                let [x, y] = slope.direction;
                // The neighbour against the direction.
                let west_or_east = (if x > 0.0 { -1 } else { 1 }, 0);
                let south_or_north = (0, if y > 0.0 { -1 } else { 1 });
                let share = |component: f64| match update {
                    Update::Corrected => component.abs(),
                    Update::Printed => component * component,
                };
                let shares = [share(x), share(y)];
                let divisor = match update {
                    Update::Corrected => shares[0] + shares[1],
                    Update::Printed => 1.0,
                };
                // Of a slope that comes from outside the raster only half would be read, at any steepness: it is not followed.
                let missing = |share: f64, (x, y): (isize, isize)| share > 0.0 && !exists(x, y);
                if missing(shares[0], west_or_east) || missing(shares[1], south_or_north) || shares == [0.0, 0.0] {
                    row.mean(1.0, exists);
                    return row;
                }
                row.mean(alpha, exists);
                row.weights[index_of(west_or_east)] += beta * shares[0] / divisor;
                row.weights[index_of(south_or_north)] += beta * shares[1] / divisor;
                row.constant = beta * slope.rise * spacing / divisor;
            }
        }
        row
    }
    /// The equation as differences, scaled so that a free node's own coefficient is the number of its neighbours.
    fn scaled(&self, exists: &impl Fn(isize, isize) -> bool) -> Other {
        let beside = [(0, -1), (-1, 0), (1, 0), (0, 1)];
        let scale = beside.iter().filter(|&&(x, y)| exists(x, y)).count() as f64;
        let mut other = Other { constant: self.constant * scale, ..Other::default() };
        (0..9).for_each(|k| other.weights[k] = (self.weights[k] * scale) as f32);
        // What the neighbours do not make up; less than a rounding of their sum is nothing.
        let rest = 1.0 - self.weights.iter().sum::<f64>();
        other.weights[SELF] = if rest.abs() > 1e-12 { (rest * scale) as f32 } else { 0.0 };
        other
    }
    /// Adds `share` times the mean of the neighbours that exist.
    fn mean(&mut self, share: f64, exists: &impl Fn(isize, isize) -> bool) {
        let beside = [(0, -1), (-1, 0), (1, 0), (0, 1)];
        let count = beside.iter().filter(|&&(x, y)| exists(x, y)).count() as f64;
        for (x, y) in beside.into_iter().filter(|&(x, y)| exists(x, y)) {
            self.weights[index_of((x, y))] += share / count;
        }
    }
}

/// The equations of the nodes of `elevation`, `spacing` metres apart, into which the elevations given are written; what is wanted of
/// nodes is given by row, with their columns.
///
/// # Errors
/// [`SolveError::Unheld`] when no elevation is given anywhere; [`SolveError::Adrift`] when some nodes follow slopes around in
/// circles and never come to one, which has no solution or many (claims H3).
pub fn equations(
    spacing: f64,
    update: Update,
    constraints: &[Vec<(u32, Constraint)>],
    elevation: &mut Plane<f64, 1>,
) -> Result<Equations, SolveError> {
    let (width, height) = (elevation.width(), elevation.height());
    let equations = Equations::new(width, height, |j, row| {
        for (i, constraint) in &constraints[j] {
            let i = *i as usize;
            let exists = |x: isize, y: isize| {
                i.checked_add_signed(x).is_some_and(|i| i < width)
                    && j.checked_add_signed(y).is_some_and(|j| j < height)
            };
            row[i] = match constraint {
                Constraint::Free => Equation::Laplace,
                Constraint::Elevation(_) => Equation::Given,
                constraint => Equation::Other(Row::of(*constraint, update, spacing, &exists).scaled(&exists)),
            };
        }
    })
    .directed();
    elevation.update(|j, [row], _| {
        for (i, constraint) in &constraints[j] {
            if let Constraint::Elevation(value) = constraint {
                row[*i as usize + 1] = *value;
            }
        }
    });
    let holds = |constraint: &Constraint| matches!(constraint, Constraint::Elevation(_) | Constraint::Near { .. });
    if !constraints.iter().flatten().any(|(_, constraint)| holds(constraint)) {
        return Err(SolveError::Unheld);
    }
    let held =
        |i: usize, j: usize| constraints[j].iter().any(|(at, constraint)| *at as usize == i && holds(constraint));
    match equations.adrift(held) {
        None => Ok(equations),
        Some((column, row)) => Err(SolveError::Adrift { column, row }),
    }
}

/// Solves from what `elevation` holds, metres: the elevations given, and a first guess elsewhere.
///
/// # Errors
/// [`SolveError::Singular`].
pub fn solve(equations: &Equations, elevation: &mut Plane<f64, 1>, stop: Stop) -> Result<Progress<1>, SolveError> {
    Processor.solve(Kind::Directed, equations, elevation, stop)
}

#[cfg(test)]
mod tests {
    use super::super::samples::{plane, rows};
    use super::*;

    const N: usize = 65;

    fn nodes() -> impl Iterator<Item = (usize, usize)> {
        (0..N).flat_map(|j| (0..N).map(move |i| (i, j)))
    }

    #[test]
    fn planes_of_any_direction_are_exact_and_not_as_printed() {
        for degrees in [0.0, 15.0, 30.0, 45.0, 100.0, 200.0, 300.0] {
            let error = |update| {
                let (rows, plane) = plane(N, degrees, -0.5);
                let mut x = Plane::new(N, N);
                let system = equations(2.0, update, &rows, &mut x).unwrap();
                let stop = Stop { relative_residual: 1e-12, iterations: 60 };
                assert!(solve(&system, &mut x, stop).unwrap().converged);
                nodes().map(|(i, j)| (x.at(i, j)[0] - plane(i, j)).abs()).fold(0.0, f64::max)
            };
            // Weights are rounded to f32: slopes are off by 2⁻²³ of themselves at most, over a rise of 90 m.
            assert!(error(Update::Corrected) < 90.0 / 8388608.0, "{degrees}°: {}", error(Update::Corrected));
            // Along an axis the two are the same.
            assert_eq!(error(Update::Printed) > 1.0, degrees != 0.0, "{degrees}°: {}", error(Update::Printed));
        }
    }

    #[test]
    fn solution_satisfies_every_equation_as_the_paper_states_it() {
        let constraint = |i: usize, j: usize| match (i, j) {
            (10..=50, 20) => Constraint::Elevation(100.0),
            (10..=50, 14..=19) => Constraint::Slope(Slope::along([0.2, -1.0], -0.8).unwrap()),
            (10..=50, 21..=30) => Constraint::Slope(Slope::along([-0.3, 1.0], -0.4).unwrap()),
            (60, 60) => Constraint::Near { elevation: 10.0, smoothing: 0.25 },
            (30, 50) => Constraint::Elevation(0.0),
            _ => Constraint::Free,
        };
        for update in [Update::Corrected, Update::Printed] {
            let mut x = Plane::new(N, N);
            let system = equations(1.0, update, &rows(N, constraint), &mut x).unwrap();
            let progress = solve(&system, &mut x, Stop { relative_residual: 1e-12, iterations: 60 }).unwrap();
            assert!(progress.converged && progress.iterations() <= 25, "{:?}", progress.residuals);
            let at = |i: usize, j: usize| x.at(i, j)[0];
            let mean = |i: usize, j: usize| (at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1)) / 4.0;
            assert!((at(30, 20) - 100.0).abs() < 1e-6 && (at(5, 40) - mean(5, 40)).abs() < 1e-6);
            assert!((at(60, 60) - (0.25 * mean(60, 60) + 7.5)).abs() < 1e-6);
            let length = libm::sqrt(1.04);
            let (nx, ny) = (0.2 / length, 1.0 / length);
            let (fx, fy) = (at(29, 16), at(30, 17));
            let expected = match update {
                Update::Corrected => (nx * fx + ny * fy - 0.8) / (nx + ny),
                Update::Printed => nx * nx * fx + ny * ny * fy - 0.8,
            };
            assert!((at(30, 16) - (mean(30, 16) + expected) / 2.0).abs() < 1e-6, "{update:?}");
        }
    }

    #[test]
    fn nothing_held_and_a_ring_of_slopes_are_refused() {
        let crack = |_: usize, _: usize| Constraint::Slope(Slope::along([1.0, 0.0], 1.0).unwrap());
        assert!(matches!(
            equations(1.0, Update::Corrected, &rows(9, crack), &mut Plane::new(9, 9)),
            Err(SolveError::Unheld)
        ));
        // Pure guidance along a closed ring: each node names the next one only.
        let ring = |i: usize, j: usize| {
            let [x, y] = match (i, j) {
                (3, 3) => [-1.0, 0.0],
                (4, 3) => [0.0, -1.0],
                (4, 4) => [1.0, 0.0],
                (3, 4) => [0.0, 1.0],
                (0, 0) => return Constraint::Elevation(1.0),
                _ => return Constraint::Free,
            };
            Constraint::Slope(Slope { smoothing: 0.0, guidance: 1.0, ..Slope::along([x, y], 1.0).unwrap() })
        };
        let refused = equations(1.0, Update::Corrected, &rows(9, ring), &mut Plane::new(9, 9));
        assert!(matches!(refused, Err(SolveError::Adrift { column: 3 | 4, row: 3 | 4 })), "{refused:?}");
    }

    #[test]
    fn a_direction_without_length_is_none() {
        assert_eq!(Slope::along([0.0, 0.0], 1.0), None);
        assert_eq!(Slope::along([0.0, 3.0], 1.0).map(|slope| slope.direction), Some([0.0, 1.0]));
    }
}
