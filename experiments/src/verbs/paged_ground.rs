//! A RAW raster on disk as ground for tessellation, of which only the pages that are seen are in memory.

use super::VerbError;
use glam::DVec2;
use std::path::Path;
use terrain_gpu::tessellate::ground::{Ground, GroundError};
use terrain_gpu::tessellate::pages::{Elevations, PAGE_BYTES};
use terrain_model::grid::Crs;
use terrain_model::io::RawWindows;

struct Raster(RawWindows);

impl Elevations for Raster {
    fn size(&self) -> [usize; 2] {
        self.0.size()
    }
    fn spacing(&self) -> [f64; 2] {
        self.0.spacing().to_array()
    }
    fn window(&self, first: [usize; 2], last: [usize; 2]) -> Result<Vec<f64>, String> {
        let values = self.0.window(first, last).map_err(|error| error.to_string())?;
        Ok(values.into_iter().map(f64::from).collect())
    }
}

/// The ground of `path` with at most `megabytes` of pages in memory, and its south-west corner.
pub fn open(path: &Path, alpha: f64, megabytes: u32) -> Result<(Ground, DVec2), VerbError> {
    let named = |problem: &dyn std::fmt::Display| VerbError::Other(format!("{}: {problem}", path.display()));
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    if !matches!(extension.as_deref(), Some("raw" | "r32")) {
        return Err(named(&"--resident reads .raw and .r32; make one: `terrain convert FILE OUT.r32`"));
    }
    let windows = RawWindows::open(path)?;
    if windows.crs().is_some_and(Crs::is_geographic) {
        return Err(named(&GroundError::Geographic));
    }
    let origin = windows.origin();
    let most = (u64::from(megabytes) << 20) / PAGE_BYTES;
    let ground = Ground::paged(Box::new(Raster(windows)), alpha, most as usize).map_err(|error| named(&error))?;
    Ok((ground, origin))
}

/// The error of a raster that could not be read any more, which must not become a picture.
pub fn sound(path: &Path, ground: &Ground) -> Result<(), VerbError> {
    ground.failure().map_or(Ok(()), |problem| Err(VerbError::Other(format!("{}: {problem}", path.display()))))
}

/// What was needed, for the end of a line; nothing of a raster in memory.
pub fn told(ground: &Ground) -> String {
    ground.residence().map_or_else(String::new, |r| {
        format!(", {} of {} pages in memory, at most {}", r.resident[0], r.pages, r.resident[1])
    })
}
