//! A raster with a margin of one cell around it, so that loops over neighbours need no test of the border, and elevations as
//! integers in the same order, so that the next larger number is one more.

use super::HydrologyError;
use terrain_model::grid::{Grid, Sample};

/// A floating-point elevation whose numbers can be counted.
pub trait Elevation: Sample {
    /// An integer.
    type Key: Copy + Ord + Default + Send + Sync;

    /// The number of floats from zero to this one, negative below zero. Both zeros have 0; keys are ordered as numbers are.
    fn key(self) -> Self::Key;
    /// The number with this key; of the two zeros the positive one.
    fn from_key(key: Self::Key) -> Self;
    /// The key of the next larger number.
    fn up(key: Self::Key) -> Self::Key;
    /// Whether the number with this key stays finite when it is raised by `steps` numbers.
    fn can_rise(key: Self::Key, steps: u64) -> bool;
}

macro_rules! elevation {
    ($float:ty, $key:ty) => {
        impl Elevation for $float {
            type Key = $key;

            #[inline]
            fn key(self) -> $key {
                let magnitude = self.abs().to_bits() as $key;
                if self < 0.0 { -magnitude } else { magnitude }
            }
            #[inline]
            fn from_key(key: $key) -> $float {
                let magnitude = <$float>::from_bits(key.unsigned_abs());
                if key < 0 { -magnitude } else { magnitude }
            }
            #[inline]
            fn up(key: $key) -> $key {
                key + 1
            }
            fn can_rise(key: $key, steps: u64) -> bool {
                i128::from(key) + i128::from(steps) <= i128::from(<$float>::MAX.key())
            }
        }
    };
}
elevation!(f32, i32);
elevation!(f64, i64);

/// Index steps to the eight neighbours: south-west first, then by rows.
pub fn steps(stride: usize) -> [isize; 8] {
    let s = stride as isize;
    [-s - 1, -s, -s + 1, -1, 1, s - 1, s, s + 1]
}

/// The cell of a margined raster reached by a step.
#[inline(always)]
pub fn go(cell: usize, step: isize) -> usize {
    cell.wrapping_add_signed(step)
}

/// Values with a margin, row-major from the south-west, and which of them are known.
pub struct Padded<V> {
    /// Width and a margin on both sides.
    pub stride: usize,
    /// (width + 2) · (height + 2) values.
    pub values: Vec<V>,
    /// As many; false in the margin and at no-data.
    pub known: Vec<bool>,
}

impl<V: Copy> Padded<V> {
    /// `value` of each known sample of `grid`, `outside` elsewhere.
    ///
    /// # Errors
    /// [`HydrologyError::NotFinite`], [`HydrologyError::Large`], [`HydrologyError::Geographic`].
    pub fn new<T: Sample>(grid: &Grid<T>, outside: V, value: impl Fn(T) -> V) -> Result<Padded<V>, HydrologyError> {
        if !grid.is_metric() {
            return Err(HydrologyError::Geographic);
        }
        let (width, height) = (grid.width(), grid.height());
        let stride = width + 2;
        let size = stride.checked_mul(height + 2).filter(|&size| u32::try_from(size).is_ok());
        let size = size.ok_or(HydrologyError::Large { width, height })?;
        let mut values = vec![outside; size];
        let mut known = vec![false; size];
        for (j, row) in grid.rows().enumerate() {
            let start = (j + 1) * stride + 1;
            for (i, &sample) in row.iter().enumerate() {
                if grid.is_no_data(sample) {
                    continue;
                }
                if !sample.to_f64().is_finite() {
                    return Err(HydrologyError::NotFinite { i, j, value: sample.to_f64() });
                }
                values[start + i] = value(sample);
                known[start + i] = true;
            }
        }
        Ok(Padded { stride, values, known })
    }
    /// Rows of the raster without the margin: index of the first cell of each.
    pub fn row_starts(&self) -> impl Iterator<Item = usize> + use<V> {
        let stride = self.stride;
        (1..self.values.len() / stride - 1).map(move |j| j * stride + 1)
    }
    /// Samples from west to east.
    pub fn width(&self) -> usize {
        self.stride - 2
    }
    /// Does water leave at this known cell: is a neighbour outside or unknown?
    pub fn is_edge(&self, cell: usize) -> bool {
        steps(self.stride).iter().any(|&step| !self.known[go(cell, step)])
    }
    /// Known cells where water leaves, from the south-west.
    pub fn edges(&self) -> impl Iterator<Item = usize> + '_ {
        let width = self.width();
        self.row_starts().flat_map(move |start| start..start + width).filter(|&k| self.known[k] && self.is_edge(k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_count_numbers_and_come_back() {
        for x in [0.0f32, 1.0, -1.0, f32::MIN_POSITIVE, -1e-45, f32::MAX, -3.5e20] {
            assert_eq!(f32::from_key(x.key()), x);
            if x < f32::MAX {
                assert_eq!(f32::from_key(f32::up(x.key())), x.next_up());
            }
            let wide = f64::from(x);
            assert_eq!(f64::from_key(f64::up(wide.key())), wide.next_up());
        }
        assert_eq!((-0.0f64).key(), 0.0f64.key());
        assert!((-1e-45f32).key() < 0.0f32.key() && (-2.0f32).key() < (-1.0f32).key());
        assert!(f32::can_rise(1.0f32.key(), 1 << 20));
        assert!(!f32::can_rise(f32::MAX.key(), 1));
    }
}
