//! Water on a heightfield (Paris 2019 §6.1): depressions filled, drainage areas, slopes, stream power, pits, banks, and the
//! accessibility that the sea's stress is made of. Rasters are in metres; rows run from south to north.

pub mod accessibility;
pub mod banks;
pub mod fill;
pub mod flow;
mod padded;
pub mod pits;
mod power;
pub mod slope;
pub mod stream;
#[cfg(test)]
mod testing;

pub use padded::Elevation;

/// Why a raster cannot be worked on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HydrologyError {
    /// Degrees where metres are needed.
    #[error("the grid is geographic: convert it to metres first (terrain convert --local-metres)")]
    Geographic,
    /// A sample that is neither finite nor the no-data marker.
    #[error(
        "the value at column {i}, row {j} from the south is {value}: expected a finite number or the no-data marker"
    )]
    NotFinite {
        /// Column from the west.
        i: usize,
        /// Row from the south.
        j: usize,
        /// The value.
        value: f64,
    },
    /// An elevation so near the largest number that raising it by one ulp a cell could leave the finite ones.
    #[error(
        "an elevation of {value} is too large to be raised: expected at most half of the largest number of its type"
    )]
    High {
        /// The largest elevation.
        value: f64,
    },
    /// More samples than an index of 32 bits can number.
    #[error(
        "a grid of {width} × {height} samples: expected fewer than 4294967296 with a margin of one around it; crop it"
    )]
    Large {
        /// Samples from west to east.
        width: usize,
        /// Samples from south to north.
        height: usize,
    },
    /// Two rasters that should lie on one another do not.
    #[error("grids of {first:?} and {second:?} samples, or at different places: expected two of one place and size")]
    Different {
        /// Width and height of the first.
        first: [usize; 2],
        /// Width and height of the second.
        second: [usize; 2],
    },
    /// A parameter out of range.
    #[error("{name} is {value}: expected {expected}")]
    Parameter {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it could be.
        expected: &'static str,
    },
}
