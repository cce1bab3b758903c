//! The paper's own solver (Hnaidi 2010 §5.2): from the coarsest raster to the finest, a few Jacobi iterations on each, 5(l−i) on the
//! i-th of l. It is kept to be compared with: five iterations on the finest raster do not converge (claims H3).
//!
//! What the paper leaves open is chosen so: the raster ends where it ends (a node is the mean of the neighbours that exist, also where one is missing that its slope would be read from), the
//! coarsest raster has about eight cells along its shorter side and starts from the mean of what is given, curves are drawn anew on
//! every raster, values go up bilinearly, and slopes are scaled by the spacing of their raster (claims H4).

use super::SolveError;
use super::guided::{Constraint, Row, Slope, Update};
use crate::curve::Curve;
use crate::fields::{Fields, Report};
use crate::raster::{Domain, Guide, Node, rasterise};
use glam::DVec2;
use rayon::prelude::*;
use std::time::Instant;

/// Cells along the shorter side of the coarsest raster, at least.
const COARSEST: usize = 8;
/// Iterations on the i-th of l rasters are 5(l − i), this many times l − i.
pub const ITERATIONS: usize = 5;

/// The rasters of the cascade, coarsest first; each has about half the cells of the next and the same corners.
pub fn domains(finest: Domain) -> Vec<Domain> {
    let mut domains = vec![finest];
    let mut last = finest;
    while (last.width.min(last.height) - 1) / 2 >= COARSEST {
        let half = |nodes: usize| (nodes - 1).div_ceil(2) + 1;
        let (width, height) = (half(last.width), half(last.height));
        // Cells stay square: the longer side may reach past the finest raster by less than a cell.
        let spacing = last.spacing * (last.width.max(last.height) - 1) as f64 / (width.max(height) - 1) as f64;
        last = Domain { origin: last.origin, spacing, width, height };
        domains.push(last);
    }
    domains.reverse();
    domains
}

/// Runs the cascade; the reports say what it leaves of each equation.
///
/// # Errors
/// [`SolveError::Unheld`] when no curve gives an elevation on the finest raster.
pub fn run(curves: &[Curve], domain: Domain, update: Update) -> Result<Fields, SolveError> {
    let start = Instant::now();
    let domains = domains(domain);
    let mut state: Option<(Domain, Level)> = None;
    let mut iterations = 0;
    let mut nodes = Vec::new();
    for (i, domain) in domains.iter().enumerate() {
        nodes = rasterise(curves, domain).dense();
        let count = ITERATIONS * (domains.len() - i);
        let mut level = match &state {
            Some((below, values)) => values.raised(below, domain),
            None => Level::first(&nodes),
        };
        level.iterate_slopes_and_noise(&nodes, domain, count);
        level.iterate_elevation(&nodes, domain, update, count);
        iterations += count;
        state = Some((*domain, level));
    }
    let seconds = start.elapsed().as_secs_f64();
    if !held(&nodes) {
        return Err(SolveError::Unheld);
    }
    let Some((_, level)) = state else { return Err(SolveError::Unheld) };
    // Two of everything, as Jacobi reads one and writes the other; the raster; a row of nine weights per node.
    let bytes = nodes.len() * (2 * 6 * 8 + size_of::<Node>() + size_of::<Row>());
    Ok(level.fields(&nodes, domain, update, Spent { iterations, seconds, bytes }))
}

/// Whether any node is given an elevation.
pub fn held(nodes: &[Node]) -> bool {
    nodes.iter().any(|node| node.elevations > 0)
}

/// What a run of the cascade took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spent {
    /// Jacobi iterations on all rasters together.
    pub iterations: usize,
    /// Wall time.
    pub seconds: f64,
    /// Memory, bytes.
    pub bytes: usize,
}

/// The largest ‖F − J(F)‖ / ‖J(0)‖ over the K fields, J one Jacobi iteration: the relative residual of equations scaled to a diagonal
/// of 1. 0 where nothing is given.
fn laplace_residual<const K: usize>(
    values: &[[f64; K]],
    nodes: &[Node],
    domain: &Domain,
    given: impl Fn(&Node) -> Option<[f64; K]> + Sync + Copy,
) -> f64 {
    let next = laplace_step(values, nodes, domain, given);
    let constant = laplace_step(&vec![[0.0; K]; values.len()], nodes, domain, given);
    (0..K).map(|k| relative(|n| values[n][k] - next[n][k], |n| constant[n][k], values.len())).fold(0.0, f64::max)
}

/// ‖r‖ / ‖b‖ over n entries; 0 where b is 0.
fn relative(r: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64, n: usize) -> f64 {
    let norm = |entry: &dyn Fn(usize) -> f64| (0..n).map(|k| entry(k) * entry(k)).sum::<f64>().sqrt();
    let scale = norm(&b);
    if scale > 0.0 { norm(&r) / scale } else { 0.0 }
}

/// The values of one raster, row by row from the south.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Metres.
    pub elevation: Vec<f64>,
    /// Amplitude, metres, and roughness.
    pub noise: Vec<[f64; 2]>,
    /// Rise, and direction east and north.
    pub gradient: Vec<[f64; 3]>,
}

/// The rise and the direction that a node is given, east and north.
pub fn given_gradient(node: &Node) -> Option<[f64; 3]> {
    (node.guides == 1).then_some([node.guide.rise, node.guide.direction.x, node.guide.direction.y])
}
/// The amplitude and the roughness that a node is given.
pub fn given_noise(node: &Node) -> Option<[f64; 2]> {
    (node.noises > 0).then_some([node.amplitude, node.roughness])
}
/// The elevation that a node is given.
pub fn given_elevation(node: &Node) -> Option<[f64; 1]> {
    (node.elevations > 0).then_some([node.elevation])
}
/// What guides a node: the slope given, or where several meet the diffused one.
fn guide(node: &Node, &[rise, x, y]: &[f64; 3]) -> Option<Guide> {
    (node.guides > 0 && node.elevations == 0).then_some(Guide {
        direction: DVec2::new(x, y),
        rise,
        beyond: f64::INFINITY,
    })
}

/// The mean of what is given.
fn mean<const K: usize>(nodes: &[Node], given: impl Fn(&Node) -> Option<[f64; K]>) -> [f64; K] {
    let values: Vec<[f64; K]> = nodes.iter().filter_map(given).collect();
    std::array::from_fn(|k| values.iter().map(|value| value[k]).sum::<f64>() / values.len().max(1) as f64)
}

impl Level {
    /// The fields of the finest raster, whose nodes are `nodes`, with what they leave of each equation.
    pub fn fields(self, nodes: &[Node], domain: Domain, update: Update, spent: Spent) -> Fields {
        let Spent { iterations, seconds, bytes } = spent;
        let report = |field, relative_residual| Report {
            field,
            iterations,
            relative_residual,
            converged: false,
            seconds: 0.0,
            bytes,
        };
        let reports = vec![
            report("amplitude, roughness", laplace_residual(&self.noise, nodes, &domain, given_noise)),
            report("gradient: norm, direction", laplace_residual(&self.gradient, nodes, &domain, given_gradient)),
            Report { seconds, ..report("elevation", self.elevation_residual(nodes, &domain, update)) },
        ];
        let gradient = self.gradient.iter().map(|value| value.map(|value| value as f32)).collect();
        let [amplitude, roughness] = [0, 1].map(|k| self.noise.iter().map(|pair| pair[k]).collect());
        Fields { domain, elevation: self.elevation, amplitude, roughness, gradient, reports }
    }
    /// The first guess on the coarsest raster: the mean of what is given.
    pub fn first(nodes: &[Node]) -> Level {
        let n = nodes.len();
        let [elevation] = mean(nodes, given_elevation);
        Level {
            elevation: vec![elevation; n],
            noise: vec![mean(nodes, given_noise); n],
            gradient: vec![mean(nodes, given_gradient); n],
        }
    }
    /// Bilinear values of a coarser raster's fields on a finer one.
    pub fn raised(&self, from: &Domain, to: &Domain) -> Level {
        let single: Vec<[f64; 1]> = self.elevation.iter().map(|h| [*h]).collect();
        Level {
            elevation: raise(&single, from, to).into_iter().map(|[h]| h).collect(),
            noise: raise(&self.noise, from, to),
            gradient: raise(&self.gradient, from, to),
        }
    }
    /// `count` iterations of the gradient, and of the noise beside it.
    pub fn iterate_slopes_and_noise(&mut self, nodes: &[Node], domain: &Domain, count: usize) {
        for _ in 0..count {
            self.gradient = laplace_step(&self.gradient, nodes, domain, given_gradient);
        }
        for _ in 0..count {
            self.noise = laplace_step(&self.noise, nodes, domain, given_noise);
        }
    }
    /// `count` iterations of the elevation, guided by the gradient as it is.
    pub fn iterate_elevation(&mut self, nodes: &[Node], domain: &Domain, update: Update, count: usize) {
        let rows = self.elevation_rows(nodes, domain, update);
        for _ in 0..count {
            self.elevation = elevation_step(&self.elevation, &rows, domain);
        }
    }
    /// ‖F − J(F)‖ / ‖J(0)‖.
    fn elevation_residual(&self, nodes: &[Node], domain: &Domain, update: Update) -> f64 {
        let rows = self.elevation_rows(nodes, domain, update);
        let next = elevation_step(&self.elevation, &rows, domain);
        let constant = elevation_step(&vec![0.0; next.len()], &rows, domain);
        relative(|n| self.elevation[n] - next[n], |n| constant[n], next.len())
    }
    /// The equation of each node, guided by the gradient as it is.
    fn elevation_rows(&self, nodes: &[Node], domain: &Domain, update: Update) -> Vec<Row> {
        let constraint = |i: usize, j: usize| {
            let node = &nodes[j * domain.width + i];
            match guide(node, &self.gradient[j * domain.width + i]) {
                _ if node.elevations > 0 => Constraint::Elevation(node.elevation),
                None => Constraint::Free,
                // As printed, a diffused direction is used as it is, whatever its length (claims H2).
                Some(guide) if update == Update::Printed => Constraint::Slope(Slope {
                    direction: guide.direction.to_array(),
                    rise: guide.rise,
                    beyond: f64::INFINITY,
                    smoothing: 0.5,
                    guidance: 0.5,
                }),
                Some(guide) => {
                    Slope::along(guide.direction.to_array(), guide.rise).map_or(Constraint::Free, Constraint::Slope)
                }
            }
        };
        places(domain)
            .into_par_iter()
            .map(|(i, j)| Row::of(constraint(i, j), update, domain.spacing, &|x, y| inside(domain, i, j, x, y)))
            .collect()
    }
}

/// One Jacobi iteration of the guided field.
fn elevation_step(old: &[f64], rows: &[Row], domain: &Domain) -> Vec<f64> {
    let value = |(k, row): (usize, &Row)| row.value(|x, y| old[k.wrapping_add_signed(y * domain.width as isize + x)]);
    rows.par_iter().enumerate().map(value).collect()
}

fn places(domain: &Domain) -> Vec<(usize, usize)> {
    (0..domain.height).flat_map(|j| (0..domain.width).map(move |i| (i, j))).collect()
}

fn inside(domain: &Domain, i: usize, j: usize, x: isize, y: isize) -> bool {
    i.checked_add_signed(x).is_some_and(|i| i < domain.width)
        && j.checked_add_signed(y).is_some_and(|j| j < domain.height)
}

/// One Jacobi iteration of ΔF = 0: what is given stays, the rest becomes the mean of its neighbours.
fn laplace_step<const K: usize>(
    old: &[[f64; K]],
    nodes: &[Node],
    domain: &Domain,
    given: impl Fn(&Node) -> Option<[f64; K]> + Sync,
) -> Vec<[f64; K]> {
    let width = domain.width;
    (0..old.len())
        .into_par_iter()
        .map(|k| {
            if let Some(value) = given(&nodes[k]) {
                return value;
            }
            let (i, j) = (k % width, k / width);
            let beside = [(0, -1), (-1, 0), (1, 0), (0, 1)].into_iter().filter(|&(x, y)| inside(domain, i, j, x, y));
            let (mut total, mut count) = ([0.0; K], 0.0);
            for (x, y) in beside {
                let value = old[k.wrapping_add_signed(y * width as isize + x)];
                total = std::array::from_fn(|k| total[k] + value[k]);
                count += 1.0;
            }
            total.map(|sum| sum / count)
        })
        .collect()
}

/// Bilinear values of a coarse raster at the nodes of a finer one.
fn raise<const K: usize>(values: &[[f64; K]], from: &Domain, to: &Domain) -> Vec<[f64; K]> {
    let ratio = to.spacing / from.spacing;
    let cell = |index: usize, nodes: usize| {
        let x = (index as f64 * ratio).min((nodes - 1) as f64);
        let whole = (x as usize).min(nodes - 2);
        (whole, x - whole as f64)
    };
    places(to)
        .into_par_iter()
        .map(|(i, j)| {
            let ((i, u), (j, v)) = (cell(i, from.width), cell(j, from.height));
            let at = |di: usize, dj: usize| values[(j + dj) * from.width + i + di];
            let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
            std::array::from_fn(|k| (a[k] * (1.0 - u) + b[k] * u) * (1.0 - v) + (c[k] * (1.0 - u) + d[k] * u) * v)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{ConstraintPoint, Elevation};
    use crate::fields::{Settings, diffuse};

    fn level(a: DVec2, b: DVec2, height: f64) -> Curve {
        let elevation = Some(Elevation { height, radius: 2.0 });
        let points =
            [0.0, 1.0].map(|place| ConstraintPoint { place, elevation, ..ConstraintPoint::default() }).to_vec();
        Curve::new(vec![a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], points).unwrap()
    }

    #[test]
    fn rasters_keep_their_corners_and_halve_their_cells() {
        let sizes: Vec<usize> = domains(Domain::square(100.0, 513)).iter().map(|domain| domain.width).collect();
        assert_eq!(sizes, [9, 17, 33, 65, 129, 257, 513]);
        for domain in domains(Domain::square(100.0, 300)) {
            assert!((domain.spacing * (domain.width - 1) as f64 - 100.0).abs() < 1e-9);
        }
    }

    #[test]
    fn raising_keeps_bilinear_values() {
        let (coarse, fine) = (Domain::square(100.0, 9), Domain::square(100.0, 14));
        let value = |domain: &Domain| -> Vec<[f64; 1]> {
            let at = |(i, j)| DVec2::new(i as f64, j as f64) * domain.spacing;
            places(domain).into_iter().map(|(i, j)| at((i, j))).map(|p| [3.0 * p.x - p.y + 2.0]).collect()
        };
        for (raised, exact) in raise(&value(&coarse), &coarse, &fine).iter().zip(value(&fine)) {
            assert!((raised[0] - exact[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn five_iterations_on_the_finest_raster_do_not_converge() {
        let v = DVec2::new;
        let curves = [
            level(v(10.0, 20.0), v(60.0, 90.0), 100.0),
            level(v(70.0, 10.0), v(90.0, 70.0), 0.0),
            level(v(30.0, 5.0), v(40.0, 15.0), 60.0),
        ];
        let domain = Domain::square(100.0, 257);
        let cascade = run(&curves, domain, Update::Printed).unwrap();
        assert!(cascade.reports.iter().all(|report| report.iterations == 30 + 25 + 20 + 15 + 10 + 5));
        assert!(cascade.reports[2].relative_residual > 1e-4);
        let fields = diffuse(&curves, domain, &Settings::default()).unwrap();
        let differences = cascade.elevation.iter().zip(&fields.elevation).map(|(a, b)| (a - b).abs());
        let worst = differences.fold(0.0, f64::max);
        // A few percent of the range of 100 m (diffusion.md), far from the tolerance of the converged field.
        assert!((0.5..20.0).contains(&worst), "{worst}");
    }
}
