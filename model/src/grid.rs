//! A raster of samples: every value sits at a point of the plane, rows run from south to north.
//!
//! Value (i, j) is *at* origin + (i·dx, j·dy): a sample, not the mean of a cell. Formats that store cells (GeoTIFF's
//! PixelIsArea, ESRI's `xllcorner`) are shifted by half a spacing when they are read, and back when they are written.

mod crs;

pub use crs::{Crs, CrsKind, GeoKeys};

use glam::DVec2;
use thiserror::Error;

/// A raster that cannot exist.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GridError {
    /// One of the sides is zero.
    #[error("a grid of {width} × {height} samples is empty; both sides need at least one sample")]
    Empty {
        /// Samples from west to east.
        width: usize,
        /// Samples from south to north.
        height: usize,
    },
    /// The number of values is not width × height (or the product does not fit in memory).
    #[error("a grid of {width} × {height} samples cannot hold {values} values")]
    Size {
        /// Samples from west to east.
        width: usize,
        /// Samples from south to north.
        height: usize,
        /// Values given.
        values: usize,
    },
    /// A spacing is zero, negative or not finite.
    #[error("the spacing is ({dx}, {dy}); both must be positive and finite")]
    Spacing {
        /// East–west distance of two samples.
        dx: f64,
        /// South–north distance of two samples.
        dy: f64,
    },
    /// The origin, or the opposite corner, is not finite.
    #[error("the grid reaches from ({x}, {y}) to a corner that is not finite")]
    Origin {
        /// Easting of sample (0, 0).
        x: f64,
        /// Northing of sample (0, 0).
        y: f64,
    },
    /// A value does not fit in the requested sample type.
    #[error("the value {value} at column {i}, row {j} from the south does not fit in a 16-bit integer")]
    Range {
        /// Column from the west.
        i: usize,
        /// Row from the south.
        j: usize,
        /// The value.
        value: f64,
    },
}

/// A number that a raster may hold.
pub trait Sample: Copy + PartialOrd + Send + Sync + 'static {
    /// The same number; exact for every implementation in this crate.
    fn to_f64(self) -> f64;

    /// Equality in which NaN equals NaN: the test for a no-data marker.
    fn same(self, other: Self) -> bool {
        self == other || (self.to_f64().is_nan() && other.to_f64().is_nan())
    }
}

macro_rules! samples {
    ($($t:ty),*) => { $(impl Sample for $t { fn to_f64(self) -> f64 { f64::from(self) } })* };
}
samples!(f32, f64, u8, i8, u16, i16, u32, i32);

/// A raster of `width` × `height` values, row-major from the south-west sample, with its place in the plane.
///
/// Units are those of the coordinate reference system: metres, unless [`Grid::is_metric`] says otherwise.
/// The constructor checks that both sides are positive, that there are width × height values, that both spacings are
/// positive and finite and that both corners are finite; no method breaks this.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    origin: DVec2,
    spacing: DVec2,
    width: usize,
    height: usize,
    values: Vec<T>,
    no_data: Option<T>,
    crs: Option<Crs>,
}

impl<T> Grid<T> {
    /// A raster with sample (0, 0), the south-west one, at `origin` and `values` row-major from the south.
    ///
    /// No no-data marker and no reference system: see [`Grid::with_no_data`] and [`Grid::with_crs`].
    ///
    /// # Errors
    /// [`GridError`] when a side is zero, `values.len() != width * height`, a spacing is not positive and finite, or a
    /// corner is not finite.
    pub fn new(
        origin: DVec2,
        spacing: DVec2,
        width: usize,
        height: usize,
        values: Vec<T>,
    ) -> Result<Grid<T>, GridError> {
        check_placement(origin, spacing, width, height)?;
        if width.checked_mul(height) != Some(values.len()) {
            return Err(GridError::Size { width, height, values: values.len() });
        }
        Ok(Grid { origin, spacing, width, height, values, no_data: None, crs: None })
    }

    /// The same raster in which values equal to `no_data` (NaN equals NaN) mean "unknown"; `None`: all are known.
    #[must_use]
    pub fn with_no_data(mut self, no_data: Option<T>) -> Grid<T> {
        self.no_data = no_data;
        self
    }

    /// The same raster with its coordinates said to be in `crs`. Nothing is transformed.
    #[must_use]
    pub fn with_crs(mut self, crs: Option<Crs>) -> Grid<T> {
        self.crs = crs;
        self
    }

    /// The same values at another place.
    ///
    /// # Errors
    /// [`GridError::Spacing`], [`GridError::Origin`].
    pub fn with_placement(mut self, origin: DVec2, spacing: DVec2) -> Result<Grid<T>, GridError> {
        check_placement(origin, spacing, self.width, self.height)?;
        self.origin = origin;
        self.spacing = spacing;
        Ok(self)
    }

    /// Other values, `width * height` of them from the south-west, at the same place and in the same system.
    ///
    /// # Errors
    /// [`GridError::Size`].
    pub fn with_values<U>(&self, values: Vec<U>, no_data: Option<U>) -> Result<Grid<U>, GridError> {
        let grid = Grid::new(self.origin, self.spacing, self.width, self.height, values)?;
        Ok(grid.with_no_data(no_data).with_crs(self.crs.clone()))
    }

    /// Position of sample (0, 0), the south-west one.
    pub fn origin(&self) -> DVec2 {
        self.origin
    }

    /// (dx, dy): distance of neighbouring samples to the east and to the north.
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }

    /// Samples from west to east.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Samples from south to north.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row-major from the south-west, no-data markers included.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// As [`Grid::values`], to change in place.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The values alone, row-major from the south-west.
    pub fn into_values(self) -> Vec<T> {
        self.values
    }

    /// Rows from south to north, each from west to east; reverse it for the order of images and most files.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, T> {
        self.values.chunks_exact(self.width)
    }

    /// The coordinate reference system, as far as the file said.
    pub fn crs(&self) -> Option<&Crs> {
        self.crs.as_ref()
    }

    /// Whether a unit of x and y is a metre.
    ///
    /// True for [`CrsKind::LocalMetres`], for [`CrsKind::Projected`] in metres, and where no system is stated
    /// (readers of formats that cannot state one mark what looks like degrees, see [`crate::io::esri_ascii`]).
    pub fn is_metric(&self) -> bool {
        self.crs.as_ref().is_none_or(Crs::is_metric)
    }

    /// Position of sample (i, j); also outside of the raster.
    pub fn position(&self, i: usize, j: usize) -> DVec2 {
        self.origin + self.spacing * DVec2::new(i as f64, j as f64)
    }

    /// The south-west and the north-east sample: the box the samples span, with no half cell around it.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        (self.origin, self.position(self.width - 1, self.height - 1))
    }
}

impl<T: Copy> Grid<T> {
    /// Value (i, j) as stored, a no-data marker included; `None` outside of the raster.
    pub fn get(&self, i: usize, j: usize) -> Option<T> {
        if i < self.width && j < self.height { self.values.get(j * self.width + i).copied() } else { None }
    }

    /// The value that marks an unknown sample.
    pub fn no_data(&self) -> Option<T> {
        self.no_data
    }

    /// Every sample with its column, row and position, from the south-west, rows first.
    pub fn positions(&self) -> impl Iterator<Item = (usize, usize, DVec2, T)> + '_ {
        self.values.iter().enumerate().map(|(k, &value)| {
            let (i, j) = (k % self.width, k / self.width);
            (i, j, self.position(i, j), value)
        })
    }
}

impl<T: Sample> Grid<T> {
    /// Whether `value` is the no-data marker (NaN equals NaN).
    pub fn is_no_data(&self, value: T) -> bool {
        self.no_data.is_some_and(|marker| marker.same(value))
    }

    /// Value (i, j) where it is known; `None` for no-data and outside of the raster.
    pub fn known(&self, i: usize, j: usize) -> Option<T> {
        self.get(i, j).filter(|&value| !self.is_no_data(value))
    }

    /// Number of no-data samples.
    pub fn no_data_count(&self) -> usize {
        self.values.iter().filter(|&&value| self.is_no_data(value)).count()
    }

    /// Smallest and largest known value, NaN aside; `None` when nothing is known.
    pub fn min_max(&self) -> Option<(T, T)> {
        let mut range = None;
        for &value in &self.values {
            if self.is_no_data(value) || value.to_f64().is_nan() {
                continue;
            }
            range = Some(match range {
                None => (value, value),
                Some((low, high)) => (if value < low { value } else { low }, if value > high { value } else { high }),
            });
        }
        range
    }

    /// A raster of `f(value)` at the same place, `f` being given `None` for no-data samples, with `no_data` as the
    /// new marker. That the marker differs from every known result is the caller's care.
    #[must_use]
    pub fn map<U>(&self, no_data: Option<U>, mut f: impl FnMut(Option<T>) -> U) -> Grid<U> {
        let values = self.values.iter().map(|&v| f(if self.is_no_data(v) { None } else { Some(v) })).collect();
        Grid {
            origin: self.origin,
            spacing: self.spacing,
            width: self.width,
            height: self.height,
            values,
            no_data,
            crs: self.crs.clone(),
        }
    }

    /// `f` over the known values; no-data samples and their marker stay.
    #[must_use]
    pub fn map_known(&self, mut f: impl FnMut(T) -> T) -> Grid<T> {
        let mut grid = self.clone();
        for value in grid.values.iter_mut() {
            if !self.is_no_data(*value) {
                *value = f(*value);
            }
        }
        grid
    }
}

impl Grid<i16> {
    /// The same raster in `f32`, exactly: every 16-bit integer is an `f32`.
    pub fn to_f32(&self) -> Grid<f32> {
        let marker = self.no_data.map(f32::from);
        self.map(marker, |value| value.map_or(marker.unwrap_or(0.0), f32::from))
    }
}

impl Grid<f32> {
    /// The same raster in 16-bit integers, rounded to nearest (halves away from zero), no-data as −32768.
    ///
    /// # Errors
    /// [`GridError::Range`] at the first known value that rounds to less than −32767 or more than 32767, or is NaN.
    pub fn to_i16(&self) -> Result<Grid<i16>, GridError> {
        let mut values = Vec::with_capacity(self.values.len());
        for (i, j, _, value) in self.positions() {
            let rounded = value.round();
            if self.is_no_data(value) {
                values.push(i16::MIN);
            } else if (-32767.0..=32767.0).contains(&rounded) {
                values.push(rounded as i16);
            } else {
                return Err(GridError::Range { i, j, value: f64::from(value) });
            }
        }
        self.with_values(values, self.no_data.map(|_| i16::MIN))
    }
}

fn check_placement(origin: DVec2, spacing: DVec2, width: usize, height: usize) -> Result<(), GridError> {
    if width == 0 || height == 0 {
        return Err(GridError::Empty { width, height });
    }
    let positive = |s: f64| s.is_finite() && s > 0.0;
    if !positive(spacing.x) || !positive(spacing.y) {
        return Err(GridError::Spacing { dx: spacing.x, dy: spacing.y });
    }
    let corner = origin + spacing * DVec2::new((width - 1) as f64, (height - 1) as f64);
    if !origin.is_finite() || !corner.is_finite() {
        return Err(GridError::Origin { x: origin.x, y: origin.y });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid<f32> {
        let values = vec![1.0, 2.0, -9999.0, 4.0, 5.0, 6.5];
        Grid::new(DVec2::new(100.0, 200.0), DVec2::new(10.0, 20.0), 3, 2, values).unwrap().with_no_data(Some(-9999.0))
    }

    #[test]
    fn sample_sits_at_origin_plus_index_times_spacing_with_row_zero_in_the_south() {
        let grid = grid();
        assert_eq!(grid.position(2, 1), DVec2::new(120.0, 220.0));
        assert_eq!(grid.bounds(), (DVec2::new(100.0, 200.0), DVec2::new(120.0, 220.0)));
        assert_eq!(grid.get(0, 1), Some(4.0));
        assert_eq!(grid.positions().nth(4), Some((1, 1, DVec2::new(110.0, 220.0), 5.0)));
        assert_eq!(grid.rows().next(), Some(&[1.0, 2.0, -9999.0][..]));
    }

    #[test]
    fn get_is_none_outside_even_where_the_index_would_wrap_to_the_next_row() {
        assert_eq!(grid().get(3, 0), None);
        assert_eq!(grid().get(0, 2), None);
        assert_eq!(grid().get(usize::MAX, usize::MAX), None);
    }

    #[test]
    fn min_max_ignores_no_data_and_nan() {
        assert_eq!(grid().min_max(), Some((1.0, 6.5)));
        let unknown = grid().map(Some(f32::NAN), |_| f32::NAN);
        assert_eq!((unknown.min_max(), unknown.no_data_count()), (None, 6));
    }

    #[test]
    fn map_gives_none_for_no_data_and_map_known_leaves_it() {
        let flags = grid().map(None, |value| value.is_some());
        assert_eq!(flags.values(), [true, true, false, true, true, true]);
        let doubled = grid().map_known(|v| 2.0 * v);
        assert_eq!((doubled.get(2, 0), doubled.get(0, 0)), (Some(-9999.0), Some(2.0)));
    }

    #[test]
    fn constructor_refuses_what_is_not_a_raster() {
        let one = DVec2::ONE;
        let build = |o, s, w, h, n| Grid::new(o, s, w, h, vec![0.0_f32; n]).unwrap_err();
        assert!(matches!(build(one, one, 0, 2, 0), GridError::Empty { .. }));
        assert!(matches!(build(one, one, 2, 2, 3), GridError::Size { .. }));
        assert!(matches!(build(one, one, usize::MAX, 2, 3), GridError::Size { .. }));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(build(one, DVec2::new(bad, 1.0), 1, 1, 1), GridError::Spacing { .. }));
            assert!(matches!(build(one, DVec2::new(1.0, bad), 1, 1, 1), GridError::Spacing { .. }));
        }
        assert!(matches!(build(DVec2::NAN, one, 1, 1, 1), GridError::Origin { .. }));
        assert!(matches!(build(one, DVec2::splat(1e308), 9, 9, 81), GridError::Origin { .. }));
    }

    #[test]
    fn sixteen_bit_integers_go_to_f32_and_back_unchanged() {
        let values = vec![i16::MIN, -32767, -1, 0, 1, 32767];
        let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 3, 2, values).unwrap().with_no_data(Some(i16::MIN));
        assert_eq!(grid.to_f32().to_i16().unwrap(), grid);
    }

    #[test]
    fn rounding_to_sixteen_bits_names_the_value_that_does_not_fit() {
        let grid = Grid::new(DVec2::ZERO, DVec2::ONE, 2, 2, vec![0.0, 1.5, 40000.0, 0.0]).unwrap();
        assert_eq!(grid.to_i16().unwrap_err(), GridError::Range { i: 0, j: 1, value: 40000.0 });
    }
}
