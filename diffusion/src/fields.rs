//! From curves to the fields of a terrain: which system each field is, and in what order they are solved (Hnaidi 2010 §5.2).
//!
//! Amplitude and roughness are diffused together; so are the gradient's norm and direction, which are only needed where slopes of
//! several curves meet; the elevation is diffused last, guided by the gradient where there is one.

use crate::curve::Curve;
use crate::plane::Plane;
use crate::raster::{Domain, Node, Raster, rasterise};
use crate::solver::engine::{Engine, Kind, Processor};
use crate::solver::equations::{Equation, Equations};
use crate::solver::guided::{self, Constraint, Slope, Update};
use crate::solver::krylov::{Progress, Stop};
use crate::solver::{SolveError, cascade, held, variational};
use rayon::prelude::*;
use std::time::Instant;

/// How fields are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Solver {
    /// The paper's: weighted Jacobi from coarse to fine, 5(l − i) iterations on the i-th of l rasters, slopes read as printed. It does
    /// not converge, and slopes come out up to 41 % too steep (claims H1, H3).
    Paper,
    /// The paper's schedule with the update that is exact on planes.
    Corrected,
    /// The field that the paper's iteration tends to: slopes read as printed, converged, but for slopes that lead from nothing, which are
    /// left to diffusion ([`crate::solver::held`]).
    Printed,
    /// The update that is exact on planes, converged; slopes that lead from nothing are left to diffusion too.
    #[default]
    Multigrid,
    /// The field of least squares: symmetric, and the same terrain at every resolution.
    Variational,
}

impl Solver {
    /// All of them.
    pub const ALL: [Solver; 5] =
        [Solver::Paper, Solver::Corrected, Solver::Printed, Solver::Multigrid, Solver::Variational];
    /// Its name in tables and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Solver::Paper => "paper",
            Solver::Corrected => "corrected",
            Solver::Printed => "printed",
            Solver::Multigrid => "multigrid",
            Solver::Variational => "variational",
        }
    }
    /// How it reads a slope.
    pub const fn update(self) -> Update {
        match self {
            Solver::Paper | Solver::Printed => Update::Printed,
            Solver::Corrected | Solver::Multigrid | Solver::Variational => Update::Corrected,
        }
    }
}

/// What is solved for, and how exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How.
    pub solver: Solver,
    /// When each solve stops, but for [`Solver::Paper`] and [`Solver::Corrected`], whose iterations are given.
    pub stop: Stop,
    /// α of strict elevations: 0 interpolates them, more approximates (§5.2).
    pub smoothing: f64,
    /// λ ≥ 1, how much slopes weigh in bands with [`Solver::Variational`].
    pub slope_weight: f64,
    /// Whether the gradient is diffused over the whole raster, to be looked at; else only where it is needed.
    pub whole_gradient: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        let (solver, stop) = (Solver::default(), Stop::default());
        Settings { solver, stop, smoothing: 0.0, slope_weight: 10.0, whole_gradient: false }
    }
}

impl Settings {
    fn check(&self) -> Result<(), SolveError> {
        let range = |what, value, fits, expected| {
            if fits { Ok(()) } else { Err(SolveError::Setting { what, value, expected }) }
        };
        range("smoothing", self.smoothing, (0.0..1.0).contains(&self.smoothing), "0 or more, less than 1")?;
        let weight = self.slope_weight;
        range("slope_weight", weight, weight >= 1.0 && weight.is_finite(), "a finite number, 1 or more")
    }
}

/// How one solve went.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// What was solved for.
    pub field: &'static str,
    /// Iterations: of the Krylov method, or of Jacobi on all rasters together.
    pub iterations: usize,
    /// Largest ‖b − A·x‖ / ‖b‖ of the fields solved together.
    pub relative_residual: f64,
    /// Whether the tolerance was met.
    pub converged: bool,
    /// Wall time, set-up included.
    pub seconds: f64,
    /// What the solve held beside what it solved for, bytes.
    pub bytes: usize,
}

/// The fields of a terrain, row by row from the south.
#[derive(Clone, Debug)]
pub struct Fields {
    /// Where the nodes are.
    pub domain: Domain,
    /// h, metres.
    pub elevation: Vec<f64>,
    /// A, metres; 0 where no curve gives a noise.
    pub amplitude: Vec<f64>,
    /// R.
    pub roughness: Vec<f64>,
    /// The rise along a direction and the direction, east and north; 0 where there is none. Diffused over the whole raster if that was
    /// asked for or slopes of several curves meet; a diffused direction is shorter than 1 where those around it differ.
    pub gradient: Vec<[f32; 3]>,
    /// One for each solve.
    pub reports: Vec<Report>,
}

/// Diffuses what `curves` give over `domain`.
///
/// # Errors
/// [`SolveError::Unheld`] when no curve gives an elevation inside the domain; [`SolveError::Setting`] for a setting out of its range.
pub fn diffuse(curves: &[Curve], domain: Domain, settings: &Settings) -> Result<Fields, SolveError> {
    settings.check()?;
    if matches!(settings.solver, Solver::Paper | Solver::Corrected) {
        return cascade::run(curves, domain, settings.solver.update());
    }
    converge(&rasterise(curves, &domain), domain, settings, None, &mut Processor)
}

/// The same with the systems solved by `engine`: for the solvers that converge. The paper's schedule
/// solves no system and is refused.
///
/// # Errors
/// As [`diffuse`]; [`SolveError::Device`] when the engine fails; [`SolveError::Schedule`].
pub fn diffuse_on<E: Engine>(
    curves: &[Curve],
    domain: Domain,
    settings: &Settings,
    engine: &mut E,
) -> Result<Fields, SolveError> {
    settings.check()?;
    if matches!(settings.solver, Solver::Paper | Solver::Corrected) {
        return Err(SolveError::Schedule);
    }
    converge(&rasterise(curves, &domain), domain, settings, None, engine)
}

/// Solves for what a raster holds its nodes to, from the fields of another on the same domain if there is one.
pub(crate) fn converge<E: Engine>(
    raster: &Raster,
    domain: Domain,
    settings: &Settings,
    start: Option<&Fields>,
    engine: &mut E,
) -> Result<Fields, SolveError> {
    settings.check()?;
    let mut solve = Solve { raster, domain, settings, start, engine, reports: Vec::new() };
    let [amplitude, roughness] = solve.noise()?;
    let gradient = solve.gradient()?;
    let elevation = solve.elevation(&gradient)?;
    Ok(Fields { domain, elevation, amplitude, roughness, gradient, reports: solve.reports })
}

/// What solves share.
struct Solve<'a, E> {
    raster: &'a Raster,
    domain: Domain,
    settings: &'a Settings,
    /// The first guess.
    start: Option<&'a Fields>,
    engine: &'a mut E,
    reports: Vec<Report>,
}

impl<E: Engine> Solve<'_, E> {
    /// Solves ΔF = 0 for K fields with the values that `given` has.
    fn laplace<const K: usize>(
        &mut self,
        field: &'static str,
        given: impl Fn(&Node) -> Option<[f64; K]> + Sync,
        guess: impl Fn(&Fields, usize) -> [f64; K] + Sync,
    ) -> Result<Plane<f64, K>, SolveError> {
        let start = Instant::now();
        let Domain { width, height, .. } = self.domain;
        let raster = self.raster;
        let given = |j: usize| raster.row(j).iter().filter_map(|(i, node)| Some((*i as usize, given(node)?)));
        let equations = Equations::new(width, height, |j, row| given(j).for_each(|(i, _)| row[i] = Equation::Given));
        let mut values = Plane::new(width, height);
        values.update(|j, rows: [&mut [f64]; K], _| {
            for (fields, i) in self.start.iter().flat_map(|fields| (0..width).map(move |i| (fields, i))) {
                let guess = guess(fields, j * width + i);
                (0..K).for_each(|k| rows[k][i + 1] = guess[k]);
            }
            given(j).for_each(|(i, given)| (0..K).for_each(|k| rows[k][i + 1] = given[k]));
        });
        if !equations.any_given() {
            return Err(SolveError::Unheld);
        }
        let progress = self.engine.solve(Kind::Symmetric, &equations, &mut values, self.settings.stop)?;
        self.report(field, &progress, start);
        Ok(values)
    }
    fn report<const K: usize>(&mut self, field: &'static str, progress: &Progress<K>, start: Instant) {
        self.reports.push(Report {
            field,
            iterations: progress.iterations(),
            relative_residual: progress.last().into_iter().fold(0.0, f64::max),
            converged: progress.converged,
            seconds: start.elapsed().as_secs_f64(),
            bytes: progress.bytes + self.raster.bytes(),
        });
    }

    /// A and R.
    fn noise(&mut self) -> Result<[Vec<f64>; 2], SolveError> {
        let given = |node: &Node| (node.noises > 0).then_some([node.amplitude, node.roughness]);
        if !self.raster.nodes().any(|node| given(node).is_some()) {
            let nothing = vec![0.0; self.domain.width * self.domain.height];
            return Ok([nothing.clone(), nothing]);
        }
        let guess = |fields: &Fields, node: usize| [fields.amplitude[node], fields.roughness[node]];
        let values = self.laplace("amplitude, roughness", given, guess)?;
        Ok([0, 1].map(|k| values.field(k)))
    }

    /// The gradient at every node, or at those that one curve alone gives a slope if no others are asked for.
    fn gradient(&mut self) -> Result<Vec<[f32; 3]>, SolveError> {
        let Settings { smoothing, whole_gradient, .. } = *self.settings;
        let given = |node: &Node| (node.guides == 1).then_some(node.guide.to_array());
        // A strict elevation says all there is to say of a node.
        let conflict = |node: &Node| node.guides > 1 && (node.elevations == 0 || smoothing > 0.0);
        let guided = self.raster.nodes().any(|node| node.guides == 1);
        let needed = whole_gradient || self.raster.nodes().any(conflict);
        let guess = |fields: &Fields, node: usize| fields.gradient[node].map(f64::from);
        let values =
            if guided && needed { Some(self.laplace("gradient: norm, direction", given, guess)?) } else { None };
        let width = self.domain.width;
        let mut gradient = vec![[0.0; 3]; width * self.domain.height];
        gradient.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
            if let Some(values) = &values {
                let fields = [0, 1, 2].map(|k| &values.row(j as isize, k)[1..]);
                row.iter_mut().enumerate().for_each(|(i, to)| *to = fields.map(|field| field[i] as f32));
            } else {
                let given = self.raster.row(j).iter().filter_map(|(i, node)| Some((*i as usize, given(node)?)));
                given.for_each(|(i, given)| row[i] = given.map(|value| value as f32));
            }
        });
        Ok(gradient)
    }

    /// h.
    fn elevation(&mut self, gradient: &[[f32; 3]]) -> Result<Vec<f64>, SolveError> {
        let start = Instant::now();
        let Domain { width, height, spacing, .. } = self.domain;
        let smoothing = self.settings.smoothing;
        let mut constraints: Vec<Vec<(u32, Constraint)>> = (0..height)
            .into_par_iter()
            .map(|j| {
                let of = |i: u32, node: &Node| match (node.elevations, node.guides) {
                    (1.., _) if smoothing > 0.0 => Some(Constraint::Near { elevation: node.elevation, smoothing }),
                    (1.., _) => Some(Constraint::Elevation(node.elevation)),
                    // A diffused direction may have lost its length: then nothing is wanted here.
                    (0, 1) => Slope::along(node.guide.direction.to_array(), node.guide.rise)
                        .map(|slope| Constraint::Slope(Slope { beyond: node.guide.beyond, ..slope })),
                    (0, 2..) => {
                        let [rise, x, y] = gradient[j * width + i as usize].map(f64::from);
                        Slope::along([x, y], rise).map(Constraint::Slope)
                    }
                    _ => None,
                };
                self.raster.row(j).iter().filter_map(|(i, node)| Some((*i, of(*i, node)?))).collect()
            })
            .collect();
        let any = |is: &dyn Fn(&Constraint) -> bool| constraints.iter().flatten().any(|(_, constraint)| is(constraint));
        if !any(&|constraint| !matches!(constraint, Constraint::Elevation(_))) {
            let given = |node: &Node| (node.elevations > 0).then_some([node.elevation]);
            let values = self.laplace("elevation", given, |fields, node| [fields.elevation[node]])?;
            return Ok(values.field(0));
        }
        let mut values = Plane::new(width, height);
        if let Some(start) = self.start {
            values.update(|j, [row]: [&mut [f64]; 1], _| {
                row[1..=width].copy_from_slice(&start.elevation[j * width..][..width]);
            });
        }
        if self.settings.solver == Solver::Variational {
            let equations = variational::equations(spacing, self.settings.slope_weight, &constraints, &mut values)?;
            drop(constraints);
            let progress = self.engine.solve(Kind::Symmetric, &equations, &mut values, self.settings.stop)?;
            self.report("elevation", &progress, start);
            return Ok(values.field(0));
        }
        let (mut slopes, mut given) = (Vec::new(), Vec::new());
        for (j, row) in constraints.iter().enumerate() {
            for (i, constraint) in row {
                let node = j * width + *i as usize;
                match constraint {
                    Constraint::Slope(slope) => slopes.push((node, *slope)),
                    _ => given.push(node),
                }
            }
        }
        for node in held::adrift(width, height, &slopes, &given) {
            let row = &mut constraints[node / width];
            if let Ok(found) = row.binary_search_by_key(&(node % width), |(i, _)| *i as usize) {
                row[found].1 = Constraint::Free;
            }
        }
        drop(slopes);
        let equations = guided::equations(spacing, self.settings.solver.update(), &constraints, &mut values)?;
        drop(constraints);
        let progress = self.engine.solve(Kind::Directed, &equations, &mut values, self.settings.stop)?;
        self.report("elevation", &progress, start);
        Ok(values.field(0))
    }
}

#[cfg(test)]
#[path = "fields_tests.rs"]
mod tests;
