//! Points that keep their distance (Paris 2019 §6): Poisson disks on the plane, Poisson spheres on a heightfield or in a volume,
//! a spatial hash that says what is taken, and the spectrum that shows that the points are blue noise.

mod darts;
pub mod exclusion;
pub mod regions;
pub mod spectrum;
#[cfg(test)]
mod tests;
pub mod thin;

pub use darts::{Poisson, Region, sample};

/// Why there are no samples.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SamplingError {
    /// A region without an inside, or at coordinates that are not finite.
    #[error("a region from {low:?} to {high:?}: expected finite corners, the second above the first")]
    Region {
        /// Smallest coordinates.
        low: Vec<f64>,
        /// Largest coordinates.
        high: Vec<f64>,
    },
    /// Distances out of range.
    #[error("distances from {least} m to {most} m: expected positive, finite numbers in this order")]
    Distances {
        /// The smallest.
        least: f64,
        /// The largest.
        most: f64,
    },
    /// More points than can be numbered.
    #[error("{cells} cells to throw darts at: expected at most 20000000; enlarge the distance or divide the region")]
    Many {
        /// How many.
        cells: f64,
    },
    /// Rings of frequencies that cannot be.
    #[error("frequencies up to {highest} in steps of {step}: expected positive, finite numbers, the step the smaller")]
    Frequencies {
        /// Width of a ring, periods a metre.
        step: f64,
        /// The highest, periods a metre.
        highest: f64,
    },
    /// Too many frequencies for so many points.
    #[error("{terms} waves to hold at once: expected at most 200000000; lower the highest frequency")]
    Waves {
        /// Points times frequencies along both sides.
        terms: f64,
    },
    /// A band around a surface whose sides are crossed or not numbers.
    #[error("elevations from {low} m to {high} m: expected two numbers in this order")]
    Band {
        /// The lower.
        low: f64,
        /// The upper.
        high: f64,
    },
    /// A heightfield with samples of unknown elevation, or fewer than 2 × 2.
    #[error(
        "a heightfield of {width} × {height} samples, {unknown} without elevation: expected at least 2 × 2, all known"
    )]
    Heightfield {
        /// Samples from west to east.
        width: usize,
        /// Samples from south to north.
        height: usize,
        /// Samples that are no-data or not finite.
        unknown: usize,
    },
}
