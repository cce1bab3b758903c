//! Degrees to metres without resampling: the grid keeps its samples and takes the size they have on the ellipsoid at its
//! centre.
//!
//! At latitude φ on WGS 84 (a = 6378137 m, e² = f(2 − f), 1/f = 298.257223563) a radian of longitude is N cos φ long and
//! a radian of latitude M, with w = 1 − e² sin² φ, N = a/√w, M = a(1 − e²)/(w√w) (Snyder 1987, Map Projections, eq. 4-20
//! and 4-18). The new spacing is dx = N cos φ₀ Δλ and dy = M Δφ at the centre latitude φ₀. Lengths are on the ellipsoid:
//! at height h they are longer by h/a, 1.6·10⁻⁴ at 1000 m, which the report does not include.

use glam::DVec2;
use thiserror::Error;

use crate::grid::{Crs, Grid};

/// Equatorial radius of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// Flattening of WGS 84.
const F: f64 = 1.0 / 298.257_223_563;
const RADIANS_PER_DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A grid that cannot be flattened.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LocalMetresError {
    /// The coordinates are not degrees.
    #[error("the grid is not in degrees (its system is {system}); expected longitude and latitude, set by the file")]
    NotGeographic {
        /// What the grid says it is in.
        system: String,
    },
    /// The grid reaches a pole, where a degree of longitude has no length, or beyond.
    #[error("the grid spans latitudes {south} to {north} degrees; expected it between -89 and 89: cut it")]
    Latitude {
        /// Southernmost latitude, degrees.
        south: f64,
        /// Northernmost latitude, degrees.
        north: f64,
    },
    /// The grid goes round the globe.
    #[error("the grid spans {span} degrees of longitude; expected at most 180: cut it")]
    Longitude {
        /// East–west extent, degrees.
        span: f64,
    },
}

/// What [`local_metres`] did, and how wrong it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalMetresReport {
    /// (longitude, latitude) of the south-west sample, degrees: the new origin (0, 0).
    pub geographic_origin: DVec2,
    /// The latitude φ₀ at which the spacing is exact, degrees.
    pub centre_latitude: f64,
    /// (dx, dy) of the samples in degrees.
    pub spacing_degrees: DVec2,
    /// (dx, dy) of the samples in metres.
    pub spacing_metres: DVec2,
    /// The largest of |stated/true − 1| over all rows of the grid, for an east–west step.
    pub worst_error_east: f64,
    /// The same for a south–north step.
    pub worst_error_north: f64,
}

impl LocalMetresReport {
    /// The largest relative error of the length of any short path in the grid, whatever its direction: a length is the
    /// root of the sum of the squares of its two parts, so it is scaled by no more than the worse of them.
    pub fn worst_relative_error(&self) -> f64 {
        self.worst_error_east.max(self.worst_error_north)
    }
}

impl std::fmt::Display for LocalMetresReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} × {} degrees at latitude {} are {:.4} × {:.4} m; origin {} E, {} N; lengths are wrong by at most \
             {:.4} % east–west and {:.4} % south–north",
            self.spacing_degrees.x,
            self.spacing_degrees.y,
            self.centre_latitude,
            self.spacing_metres.x,
            self.spacing_metres.y,
            self.geographic_origin.x,
            self.geographic_origin.y,
            100.0 * self.worst_error_east,
            100.0 * self.worst_error_north,
        )
    }
}

/// The same samples in metres, with the south-west one at (0, 0), and what that costs: see the module.
///
/// # Errors
/// [`LocalMetresError`]: a grid that is not geographic, reaches within a degree of a pole, or spans over 180° of
/// longitude.
pub fn local_metres(grid: &Grid<f32>) -> Result<(Grid<f32>, LocalMetresReport), LocalMetresError> {
    if !grid.crs().is_some_and(Crs::is_geographic) {
        let system = grid.crs().map_or("not stated".into(), |crs| format!("{:?}", crs.kind));
        return Err(LocalMetresError::NotGeographic { system });
    }
    let (low, high) = grid.bounds();
    if !(low.y >= -89.0 && high.y <= 89.0) {
        return Err(LocalMetresError::Latitude { south: low.y, north: high.y });
    }
    if high.x - low.x > 180.0 {
        return Err(LocalMetresError::Longitude { span: high.x - low.x });
    }
    let centre_latitude = 0.5 * (low.y + high.y);
    let stated = metres_per_degree(centre_latitude);
    let mut worst = DVec2::ZERO;
    for j in 0..grid.height() {
        let exact = metres_per_degree(grid.position(0, j).y);
        worst = worst.max((stated / exact - DVec2::ONE).abs());
    }
    let spacing = stated * grid.spacing();
    let report = LocalMetresReport {
        geographic_origin: grid.origin(),
        centre_latitude,
        spacing_degrees: grid.spacing(),
        spacing_metres: spacing,
        worst_error_east: worst.x,
        worst_error_north: worst.y,
    };
    let flat = grid.clone().with_crs(Some(Crs::local_metres()));
    let system = || LocalMetresError::NotGeographic { system: "a spacing too small for metres".into() };
    let flat = flat.with_placement(DVec2::ZERO, spacing).map_err(|_| system())?;
    Ok((flat, report))
}

/// (east, north): length of a degree of longitude and of latitude at a latitude in degrees, metres on WGS 84.
fn metres_per_degree(latitude: f64) -> DVec2 {
    let phi = latitude * RADIANS_PER_DEGREE;
    let (sin, cos) = (libm::sin(phi), libm::cos(phi));
    let e2 = F * (2.0 - F);
    let w = 1.0 - e2 * sin * sin;
    let root = w.sqrt();
    DVec2::new(A / root * cos, A * (1.0 - e2) / (w * root)) * RADIANS_PER_DEGREE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(south: f64, side: usize) -> Grid<f32> {
        let spacing = DVec2::splat(1.0 / 1200.0);
        Grid::new(DVec2::new(-84.0, south), spacing, side, side, vec![1.0; side * side])
            .unwrap()
            .with_crs(Some(Crs::geographic(Some(4326))))
    }

    #[test]
    fn degree_has_its_tabulated_length() {
        // At the equator a·π/180 and a(1 − e²)·π/180; at 60° the usual tables, in kilometres to three decimals.
        let table = [(0.0, 111_319.490_8, 110_574.275_8, 1e-4), (60.0, 55_800.0, 111_412.0, 0.5)];
        for (latitude, east, north, tolerance) in table {
            let length = metres_per_degree(latitude);
            assert!((length.x - east).abs() < tolerance && (length.y - north).abs() < tolerance, "{length}");
        }
    }

    #[test]
    fn samples_stay_and_only_their_place_changes() {
        let grid = degrees(36.0, 101);
        let (flat, report) = local_metres(&grid).unwrap();
        assert_eq!((flat.values(), flat.origin()), (grid.values(), DVec2::ZERO));
        assert!(flat.is_metric() && !grid.is_metric());
        assert_eq!(flat.spacing(), report.spacing_metres);
        assert_eq!(report.geographic_origin, grid.origin());
    }

    #[test]
    fn stated_error_covers_every_row_and_is_reached() {
        // The measured length of each row against the flat one: no row may be worse than the report, one is as bad.
        let grid = degrees(36.0, 601);
        let (flat, report) = local_metres(&grid).unwrap();
        let error = |j: usize| {
            let exact = metres_per_degree(grid.position(0, j).y).x * grid.spacing().x;
            (flat.spacing().x / exact - 1.0).abs()
        };
        let worst = (0..601).map(error).fold(0.0, f64::max);
        // Two ways to round the same quotient.
        assert!((worst - report.worst_error_east).abs() < 1e-12);
        // tan 36.25° · 0.25° in radians, to first order.
        assert!((worst - 0.0032).abs() < 1e-4, "{worst}");
        assert!(report.worst_relative_error() >= report.worst_error_north);
    }

    #[test]
    fn error_grows_with_the_extent() {
        let small = local_metres(&degrees(36.0, 11)).unwrap().1.worst_relative_error();
        let large = local_metres(&degrees(36.0, 101)).unwrap().1.worst_relative_error();
        assert!(small < 0.2 * large);
    }

    #[test]
    fn what_is_not_degrees_or_reaches_a_pole_is_refused() {
        let metric = degrees(36.0, 3).with_crs(Some(Crs::projected(None)));
        assert!(matches!(local_metres(&metric), Err(LocalMetresError::NotGeographic { .. })));
        assert!(matches!(local_metres(&degrees(36.0, 3).with_crs(None)), Err(LocalMetresError::NotGeographic { .. })));
        assert!(matches!(local_metres(&degrees(89.5, 3)), Err(LocalMetresError::Latitude { .. })));
        let wide = degrees(0.0, 2).with_placement(DVec2::new(-180.0, 0.0), DVec2::new(200.0, 1.0)).unwrap();
        assert!(matches!(local_metres(&wide), Err(LocalMetresError::Longitude { .. })));
    }
}
