//! From curves to the fields of a terrain: which system each field is, and in what order they are solved (Hnaidi 2010 §5.2).
//!
//! Amplitude and roughness are diffused together; so are the gradient's norm and direction, which are only needed where slopes of
//! several curves meet; the elevation is diffused last, guided by the gradient where there is one.

use crate::curve::Curve;
use crate::plane::Plane;
use crate::raster::{Domain, Guide, Node, rasterise};
use crate::solver::guided::{self, Constraint, Slope, Update};
use crate::solver::held::{self, Ground};
use crate::solver::krylov::Stop;
use crate::solver::{SolveError, cascade, laplace};
use glam::DVec2;
use std::time::Instant;

/// How fields are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Solver {
    /// The paper's: weighted Jacobi from coarse to fine, 5(l − i) iterations on the i-th of l rasters, slopes read as printed. It does
    /// not converge, and slopes come out up to 41 % too steep (claims H1, H3).
    Paper,
    /// The paper's schedule with the update that is exact on planes.
    Corrected,
    /// The field that the paper's iteration tends to: slopes read as printed, converged.
    Printed,
    /// The update that is exact on planes, converged.
    #[default]
    Multigrid,
}

impl Solver {
    /// All of them.
    pub const ALL: [Solver; 4] = [Solver::Paper, Solver::Corrected, Solver::Printed, Solver::Multigrid];
    /// Its name in tables and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Solver::Paper => "paper",
            Solver::Corrected => "corrected",
            Solver::Printed => "printed",
            Solver::Multigrid => "multigrid",
        }
    }
    const fn update(self) -> Update {
        match self {
            Solver::Paper | Solver::Printed => Update::Printed,
            Solver::Corrected | Solver::Multigrid => Update::Corrected,
        }
    }
}

/// What is solved for, and how exactly.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Settings {
    /// How.
    pub solver: Solver,
    /// When each solve stops, but for [`Solver::Paper`] and [`Solver::Corrected`], whose iterations are given.
    pub stop: Stop,
    /// α of strict elevations: 0 interpolates them, more approximates (§5.2).
    pub smoothing: f64,
    /// Whether the gradient is diffused over the whole raster, to be looked at; else only where it is needed.
    pub whole_gradient: bool,
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
    /// The gradient as it guided the elevation, where curves give one; everywhere if that was asked for.
    pub gradient: Vec<Option<Guide>>,
    /// One for each solve.
    pub reports: Vec<Report>,
}

/// Diffuses what `curves` give over `domain`.
///
/// # Errors
/// [`SolveError::Unheld`] when no curve gives an elevation inside the domain, [`SolveError::Adrift`] when slopes lead in circles.
pub fn diffuse(curves: &[Curve], domain: Domain, settings: &Settings) -> Result<Fields, SolveError> {
    if matches!(settings.solver, Solver::Paper | Solver::Corrected) {
        return cascade::run(curves, domain, settings.solver.update());
    }
    let nodes = rasterise(curves, &domain);
    let mut reports = Vec::new();
    let [amplitude, roughness] = noise(&nodes, &domain, settings, &mut reports)?;
    let gradient = gradient(&nodes, &domain, settings, &mut reports)?;
    let elevation = elevation(&nodes, &gradient, &domain, settings, &mut reports)?;
    Ok(Fields { domain, elevation, amplitude, roughness, gradient, reports })
}

/// Solves ΔF = 0 for K fields with the values that `given` has.
fn diffuse_laplace<const K: usize>(
    field: &'static str,
    nodes: &[Node],
    domain: &Domain,
    stop: Stop,
    reports: &mut Vec<Report>,
    given: impl Fn(&Node) -> Option<[f64; K]> + Sync,
) -> Result<Plane<f64, K>, SolveError> {
    let start = Instant::now();
    let at = |i: usize, j: usize| given(&nodes[j * domain.width + i]);
    let equations = laplace::equations(domain.width, domain.height, |i, j| at(i, j).is_some());
    let mut values = Plane::new(domain.width, domain.height);
    values.update(|j, rows: [&mut [f64]; K], _| {
        for (i, given) in (0..domain.width).filter_map(|i| Some((i, at(i, j)?))) {
            (0..K).for_each(|k| rows[k][i + 1] = given[k]);
        }
    });
    let progress = laplace::diffuse(&equations, &mut values, stop)?;
    reports.push(Report {
        field,
        iterations: progress.iterations(),
        relative_residual: progress.last().into_iter().fold(0.0, f64::max),
        converged: progress.converged,
        seconds: start.elapsed().as_secs_f64(),
    });
    Ok(values)
}

fn noise(
    nodes: &[Node],
    domain: &Domain,
    settings: &Settings,
    reports: &mut Vec<Report>,
) -> Result<[Vec<f64>; 2], SolveError> {
    let given = |node: &Node| (node.noises > 0).then_some([node.amplitude, node.roughness]);
    if !nodes.iter().any(|node| given(node).is_some()) {
        return Ok([vec![0.0; nodes.len()], vec![0.0; nodes.len()]]);
    }
    let values = diffuse_laplace("amplitude, roughness", nodes, domain, settings.stop, reports, given)?;
    Ok([0, 1].map(|k| values.field(k)))
}

fn gradient(
    nodes: &[Node],
    domain: &Domain,
    settings: &Settings,
    reports: &mut Vec<Report>,
) -> Result<Vec<Option<Guide>>, SolveError> {
    // A strict elevation says all there is to say of a node.
    let free = |node: &Node| node.elevations == 0 || settings.smoothing > 0.0;
    let given =
        |node: &Node| (node.guides == 1).then_some([node.guide.rise, node.guide.direction.x, node.guide.direction.y]);
    let conflict = |node: &Node| node.guides > 1 && free(node);
    let guides = nodes.iter().any(|node| given(node).is_some());
    if !guides || !(settings.whole_gradient || nodes.iter().any(conflict)) {
        return Ok(nodes.iter().map(|node| (node.guides == 1).then_some(node.guide)).collect());
    }
    let values = diffuse_laplace("gradient: norm, direction", nodes, domain, settings.stop, reports, given)?;
    let diffused = |k: usize| {
        let [rise, x, y] = values.at(k % domain.width, k / domain.width);
        Guide { direction: DVec2::new(x, y), rise }
    };
    let wanted = |node: &Node| node.guides > 0 || settings.whole_gradient;
    Ok(nodes.iter().enumerate().map(|(k, node)| wanted(node).then(|| diffused(k))).collect())
}

fn elevation(
    nodes: &[Node],
    gradient: &[Option<Guide>],
    domain: &Domain,
    settings: &Settings,
    reports: &mut Vec<Report>,
) -> Result<Vec<f64>, SolveError> {
    let constraint = |k: usize| {
        let node = &nodes[k];
        match (node.elevations, node.guides, gradient[k]) {
            (1.., _, _) if settings.smoothing > 0.0 => {
                Constraint::Near { elevation: node.elevation, smoothing: settings.smoothing }
            }
            (1.., _, _) => Constraint::Elevation(node.elevation),
            // A diffused direction may have lost its length: then nothing is wanted here.
            (0, 1.., Some(guide)) => {
                Slope::along(guide.direction.to_array(), guide.rise).map_or(Constraint::Free, Constraint::Slope)
            }
            _ => Constraint::Free,
        }
    };
    let guided = (0..nodes.len()).any(|k| matches!(constraint(k), Constraint::Slope(_) | Constraint::Near { .. }));
    if !guided {
        let given = |node: &Node| (node.elevations > 0).then_some([node.elevation]);
        let values = diffuse_laplace("elevation", nodes, domain, settings.stop, reports, given)?;
        return Ok(values.field(0));
    }
    let start = Instant::now();
    let mut adrift = vec![false; nodes.len()];
    let ground = |k: usize| match constraint(k) {
        Constraint::Free => Ground::Free,
        Constraint::Slope(slope) => Ground::Follows(slope),
        _ => Ground::Given,
    };
    for node in held::adrift(domain.width, domain.height, ground) {
        adrift[node] = true;
    }
    println!("adrift {} {:.3}", adrift.iter().filter(|a| **a).count(), start.elapsed().as_secs_f64());
    let at = |i: usize, j: usize| {
        let node = j * domain.width + i;
        if adrift[node] { Constraint::Free } else { constraint(node) }
    };
    let mut values = Plane::new(domain.width, domain.height);
    let equations = guided::equations(domain.spacing, settings.solver.update(), at, &mut values)?;
    let progress = guided::solve(&equations, &mut values, settings.stop)?;
    reports.push(Report {
        field: "elevation",
        iterations: progress.iterations(),
        relative_residual: progress.last()[0],
        converged: progress.converged,
        seconds: start.elapsed().as_secs_f64(),
    });
    Ok(values.field(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};

    fn line(a: DVec2, b: DVec2, point: ConstraintPoint) -> Curve {
        let points = [0.0, 1.0].map(|place| ConstraintPoint { place, ..point }).to_vec();
        Curve::new(vec![a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], points).unwrap()
    }
    fn level(height: f64) -> ConstraintPoint {
        ConstraintPoint { elevation: Some(Elevation { height, radius: 0.0 }), ..ConstraintPoint::default() }
    }
    fn sloped(height: f64, extent: f64, degrees: f64) -> ConstraintPoint {
        let side = Side { extent, angle: degrees.to_radians() };
        ConstraintPoint { gradient: Some(Gradient { left: side, right: side }), ..level(height) }
    }
    fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn between_two_levels_the_ground_is_a_plane() {
        let curves =
            [line(v(0.0, -1.0), v(0.0, 101.0), level(0.0)), line(v(100.0, -1.0), v(100.0, 101.0), level(50.0))];
        let domain = Domain::square(100.0, 101);
        let fields = diffuse(&curves, domain, &Settings::default()).unwrap();
        for (k, height) in fields.elevation.iter().enumerate() {
            assert!((height - (k % 101) as f64 / 2.0).abs() < 1e-4, "{k}: {height}");
        }
        assert!(fields.amplitude.iter().all(|a| *a == 0.0) && fields.reports.len() == 1);
    }

    #[test]
    fn a_band_drops_by_its_ramp_in_any_direction() {
        // The slope ramps from tan 40° to 0 over 40 m: a drop of half of that.
        let ideal = -0.5 * 40.0 * libm::tan(40.0f64.to_radians());
        for degrees in [0.0f64, 15.0, 30.0, 45.0] {
            let (sin, cos) = (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
            let (centre, along) = (v(100.0, 100.0), v(cos, sin));
            let curves = [line(centre - along * 60.0, centre + along * 60.0, sloped(80.0, 40.0, -40.0))];
            // 80 cells across the band: within 1.5 h/a of it (diffusion.md), 2 %, and what the ends of the curve take.
            let domain = Domain::square(200.0, 401);
            let drop = |solver| {
                let fields = diffuse(&curves, domain, &Settings { solver, ..Settings::default() }).unwrap();
                assert!(fields.reports.iter().all(|report| report.converged), "{:?}", fields.reports);
                let foot = (centre + v(-sin, cos) * 39.0) / domain.spacing;
                fields.elevation[foot.y.round() as usize * 401 + foot.x.round() as usize] - 80.0
            };
            let error = drop(Solver::Multigrid) / ideal - 1.0;
            assert!(error.abs() < 0.03, "{degrees}°: {error}");
            let printed = drop(Solver::Printed) / ideal - 1.0;
            if degrees > 20.0 {
                assert!(printed > 0.2, "{degrees}°: the printed update is too steep, not by {printed}");
            }
        }
    }

    #[test]
    fn a_crack_is_a_trough_and_not_a_wall() {
        let mut crack = sloped(0.0, 15.0, -45.0);
        crack.elevation = None;
        crack.gradient = crack
            .gradient
            .map(|g| Gradient { left: Side { angle: 0.6, ..g.left }, right: Side { angle: 0.6, ..g.right } });
        let frame = [
            line(v(0.0, 0.0), v(100.0, 0.0), level(20.0)),
            line(v(0.0, 100.0), v(100.0, 100.0), level(20.0)),
            line(v(0.0, 0.0), v(0.0, 100.0), level(20.0)),
            line(v(100.0, 0.0), v(100.0, 100.0), level(20.0)),
        ];
        let curves = [&frame[..], &[line(v(30.0, 50.0), v(70.0, 50.0), crack)]].concat();
        let fields = diffuse(&curves, Domain::square(100.0, 201), &Settings::default()).unwrap();
        let at = |x: usize, y: usize| fields.elevation[2 * y * 201 + 2 * x];
        assert!(at(50, 50) < at(50, 65) - 2.0 && at(50, 50) < 20.0, "{} in it, {} beside it", at(50, 50), at(50, 65));
    }

    #[test]
    fn slopes_that_meet_are_diffused_and_noise_is_carried_along() {
        let mut ridge = sloped(60.0, 30.0, -30.0);
        ridge.noise = Some(Noise { amplitude: 4.0, roughness: 0.25 });
        let curves = [line(v(20.0, 50.0), v(80.0, 50.0), ridge), line(v(50.0, 20.0), v(50.0, 80.0), ridge)];
        let fields = diffuse(&curves, Domain::square(100.0, 129), &Settings::default()).unwrap();
        assert_eq!(fields.reports.len(), 3);
        assert!(fields.amplitude.iter().all(|a| (a - 4.0).abs() < 1e-6));
        assert!(fields.roughness.iter().all(|r| (r - 0.25).abs() < 1e-6));
        assert!(fields.elevation.iter().all(|h| h.is_finite() && *h < 60.0 + 1e-6));
    }

    #[test]
    fn curves_without_any_elevation_are_refused() {
        let mut crack = sloped(0.0, 15.0, 30.0);
        crack.elevation = None;
        let refused =
            diffuse(&[line(v(30.0, 50.0), v(70.0, 50.0), crack)], Domain::square(100.0, 65), &Settings::default());
        assert!(matches!(refused, Err(SolveError::Unheld)));
    }

    #[test]
    fn approximated_elevations_are_smoother_than_interpolated_ones() {
        let curves = [line(v(0.0, 30.0), v(100.0, 30.0), level(0.0)), line(v(20.0, 70.0), v(80.0, 70.0), level(50.0))];
        let at = |smoothing: f64| {
            let settings = Settings { smoothing, ..Settings::default() };
            let fields = diffuse(&curves, Domain::square(100.0, 101), &settings).unwrap();
            fields.elevation[70 * 101 + 50]
        };
        assert!((at(0.0) - 50.0).abs() < 1e-6 && at(0.9) < 49.0 && at(0.99) < at(0.9));
    }
}
