//! GeoTIFF elevations: one band, strips or tiles, placed by the geographic tags of OGC GeoTIFF 1.1.
//!
//! | tag | here |
//! |---|---|
//! | ModelPixelScale 33550, ModelTiepoint 33922 | spacing, and the place of one raster point; north up |
//! | ModelTransformation 34264 | the same as a matrix; refused when it turns or mirrors the raster |
//! | GeoKeyDirectory 34735, GeoDoubleParams 34736, GeoAsciiParams 34737 | the [`Crs`](crate::grid::Crs), and kept as they are |
//! | GTRasterType, key 1025 | PixelIsArea (1, also when absent): samples half a spacing inside; PixelIsPoint (2): samples on the points |
//! | GDAL_NODATA 42113 | the no-data marker |
//!
//! The directory is read and checked here, against the length of the file, before the `tiff` crate decodes any strip:
//! no header makes us allocate more than the file could hold.

mod directory;
mod layout;
mod place;
mod read;
mod write;

pub use read::{read, read_from};
pub use write::{RasterType, write_f32, write_i16};

#[cfg(test)]
mod gdal_tests;
#[cfg(test)]
mod tests;
