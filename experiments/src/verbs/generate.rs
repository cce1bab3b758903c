//! `terrain generate`: a scene of any number of primitives at equal overlap.

use super::{VerbError, print, write_bytes};
use crate::generate::Scatter;
use clap::Args;
use std::path::PathBuf;

/// Writes a scene of scattered discs: as many as asked for, equally many over every point.
#[derive(Args, Debug)]
pub struct Generate {
    /// How many primitives
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    primitives: u32,
    /// How many of them lie over a point on average, 0.5 to 64
    #[arg(long, value_name = "X", default_value_t = 4.0)]
    overlap: f64,
    /// Chooses places and elevations
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// The scene file to write (.ron)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Generate {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: an overlap out of range, or a file that cannot be written.
    pub fn run(&self) -> Result<(), VerbError> {
        if !(0.5..=64.0).contains(&self.overlap) {
            return Err(VerbError::Other(format!("--overlap {}: expected 0.5 to 64", self.overlap)));
        }
        let scatter = Scatter { primitives: self.primitives, overlap: self.overlap, seed: self.seed };
        write_bytes(&self.out, scatter.text().as_bytes())?;
        let extent = scatter.extent();
        print(&format!("{}: {} discs on {:.0} × {:.0} m", self.out.display(), self.primitives, extent.x, extent.y))
    }
}
