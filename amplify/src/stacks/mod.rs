//! Material stacks: a grid of columns, each the list of layers of one material from the bottom up, the explicit model that
//! construction trees are compared with (Peytavie 2009; Paris 2019 §8.4, Table 1).

mod compare;
mod convert;
#[cfg(test)]
mod tests;

pub use compare::Comparison;
pub use convert::ConversionReport;

use crate::field::Box3;
use glam::{DVec2, DVec3};
use terrain_model::grid::{Grid, GridError};

/// Why there are no stacks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StacksError {
    /// A region without volume, or one that is not finite.
    #[error("a region from {low} to {high} m: expected finite corners, the second above the first in x, y and z")]
    Region {
        /// Smallest coordinates, metres.
        low: DVec3,
        /// Largest coordinates, metres.
        high: DVec3,
    },
    /// Columns that cannot be laid out.
    #[error(
        "columns {spacing} m apart would be {across:?}: expected a positive spacing and 1 to 1048576 along each side, fewer than 4294967295 in all"
    )]
    Columns {
        /// What was asked, metres.
        spacing: f64,
        /// How many there would be along x and y.
        across: [f64; 2],
    },
    /// A precision that tops of 32 bits or the region do not have.
    #[error(
        "precision {precision} m: expected {least} m, eight steps of 32-bit elevations, to {most} m, the region's height"
    )]
    Precision {
        /// What was asked, metres.
        precision: f64,
        /// The least, metres.
        least: f64,
        /// The most, metres.
        most: f64,
    },
    /// No class of rock.
    #[error("0 classes of rock: expected 1 to 255")]
    Classes,
    /// More layers than indices can name.
    #[error("{layers} layers: expected fewer than 4294967296; use a wider spacing")]
    TooMany {
        /// How many there would be.
        layers: u64,
    },
    /// A value outside its enclosure.
    #[error(
        "the field at {at} m contradicts its own bounds: expected each value within the enclosure of every box around it"
    )]
    Contradiction {
        /// Where, metres.
        at: DVec3,
    },
}

/// What a layer is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Material {
    /// Nothing.
    Air,
    /// Rock by resistance ρ: class k of n is ρ in [k/n, (k + 1)/n], 0 the least resistant. Without a geology all rock is class 0.
    Rock(u8),
}

impl Material {
    /// The byte of a layer.
    fn code(self) -> u8 {
        match self {
            Material::Air => 0,
            Material::Rock(class) => class + 1,
        }
    }
    fn of(code: u8) -> Material {
        code.checked_sub(1).map_or(Material::Air, Material::Rock)
    }
    /// Not air?
    pub fn is_rock(self) -> bool {
        self != Material::Air
    }
}

/// One layer of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// What it is made of.
    pub material: Material,
    /// Elevation of its top, metres; its bottom is the top of the layer below or the floor of the region.
    pub top: f32,
}

/// What of [`Stacks`] is broken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StacksFault {
    /// The starts of columns do not run from 0 to the number of layers without going back.
    #[error("column {column} of {columns} starts at layer {start}: expected starts that ascend from 0 to {layers}")]
    Starts {
        /// Which; `columns` is the end of the last.
        column: usize,
        /// How many columns there are.
        columns: usize,
        /// Where it starts.
        start: u32,
        /// How many layers there are.
        layers: usize,
    },
    /// A top at or below the one under it, or out of the region.
    #[error("column {column}, layer {layer}: a top at {top} m; expected one above {below} m and at most {highest} m")]
    Top {
        /// Which column, row by row.
        column: usize,
        /// Which layer of it, from the bottom.
        layer: usize,
        /// Its top, metres.
        top: f32,
        /// The top below, metres.
        below: f32,
        /// The top of the region, metres.
        highest: f32,
    },
    /// Two layers that are one, or a layer of air on top.
    #[error(
        "column {column}, layer {layer}: expected a material other than that of the next layer, air above the last"
    )]
    Material {
        /// Which column, row by row.
        column: usize,
        /// Which layer of it, from the bottom.
        layer: usize,
    },
}

/// Columns of layers over a rectangle. Column (i, j) stands for the square of side `spacing` around its middle, where it was
/// sampled; where the region's sides are no multiples of it, the last ones reach to the border. Above the last layer there is air up to the top of the region.
///
/// A layer takes five bytes, four for its top and one for its material, a column four for where its layers start.
#[derive(Clone, Debug, PartialEq)]
pub struct Stacks {
    region: Box3,
    spacing: f64,
    precision: f64,
    classes: u8,
    columns: [usize; 2],
    /// Column k has the layers `starts[k]..starts[k + 1]`.
    starts: Vec<u32>,
    tops: Vec<f32>,
    materials: Vec<u8>,
}

impl Stacks {
    /// What was converted, metres.
    pub fn region(&self) -> &Box3 {
        &self.region
    }
    /// Metres between columns.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }
    /// How exactly tops are known, metres.
    pub fn precision(&self) -> f64 {
        self.precision
    }
    /// Columns along x and y.
    pub fn columns(&self) -> [usize; 2] {
        self.columns
    }
    /// Where column (i, j) was sampled.
    pub fn position(&self, i: usize, j: usize) -> DVec2 {
        self.region.low.truncate() + self.spacing * (DVec2::new(i as f64, j as f64) + 0.5)
    }
    /// The column of `(x, y)`; none off the region.
    pub fn column_at(&self, x: f64, y: f64) -> Option<[usize; 2]> {
        let (p, low, high) = (DVec2::new(x, y), self.region.low.truncate(), self.region.high.truncate());
        if !(low.cmple(p).all() && p.cmple(high).all()) {
            return None;
        }
        let at = (p - low) / self.spacing;
        Some([(at.x as usize).min(self.columns[0] - 1), (at.y as usize).min(self.columns[1] - 1)])
    }
    fn range(&self, [i, j]: [usize; 2]) -> std::ops::Range<usize> {
        let k = j * self.columns[0] + i;
        self.starts[k] as usize..self.starts[k + 1] as usize
    }
    /// The layers of column (i, j) from the bottom up.
    ///
    /// # Panics
    /// When there is no such column.
    pub fn layers(&self, i: usize, j: usize) -> impl DoubleEndedIterator<Item = Layer> + '_ {
        self.range([i, j]).map(|k| Layer { material: Material::of(self.materials[k]), top: self.tops[k] })
    }
    /// What is at a point; a layer holds its top. None off the region.
    pub fn material(&self, x: f64, y: f64, z: f64) -> Option<Material> {
        self.material_in(self.column_at(x, y)?, z)
    }
    fn material_in(&self, column: [usize; 2], z: f64) -> Option<Material> {
        let layers = self.range(column);
        if !(self.region.low.z <= z && z <= self.region.high.z) {
            return None;
        }
        let below = self.tops[layers.clone()].partition_point(|&top| f64::from(top) < z);
        Some(self.materials[layers].get(below).map_or(Material::Air, |&code| Material::of(code)))
    }
    /// Is there rock at a point? Never off the region.
    pub fn is_rock(&self, x: f64, y: f64, z: f64) -> bool {
        self.material(x, y, z).is_some_and(Material::is_rock)
    }
    /// Elevation of the highest rock, metres; none off the region and where a column is air.
    pub fn surface_elevation(&self, x: f64, y: f64) -> Option<f32> {
        // Air is never on top.
        self.tops[self.range(self.column_at(x, y)?)].last().copied()
    }
    /// Elevations of the highest rock where columns were sampled, metres; NaN, which marks no data, where a column is air.
    ///
    /// # Errors
    /// [`GridError`] never occurs for what [`Stacks::convert`] made.
    pub fn elevations(&self) -> Result<Grid<f32>, GridError> {
        let top = |ends: &[u32]| if ends[0] < ends[1] { self.tops[ends[1] as usize - 1] } else { f32::NAN };
        let values = self.starts.windows(2).map(top).collect();
        let [nx, ny] = self.columns;
        let grid = Grid::new(self.position(0, 0), DVec2::splat(self.spacing), nx, ny, values)?;
        Ok(grid.with_no_data(Some(f32::NAN)))
    }
    /// Layers in all columns.
    pub fn layer_count(&self) -> usize {
        self.tops.len()
    }
    /// How many columns have rock above air above rock.
    pub fn overhangs(&self) -> usize {
        let runs = |ends: &[u32]| {
            let layers = &self.materials[ends[0] as usize..ends[1] as usize];
            layers.chunk_by(|a, b| (*a == 0) == (*b == 0)).filter(|run| run[0] != 0).count()
        };
        self.starts.windows(2).filter(|ends| runs(ends) > 1).count()
    }
    /// Bytes of layers and starts: 5 a layer, 4 a column and 4 for the end of the last.
    pub fn bytes(&self) -> usize {
        size_of_val(self.tops.as_slice()) + size_of_val(self.materials.as_slice()) + size_of_val(self.starts.as_slice())
    }

    /// Do starts and tops ascend, and are neighbouring layers of different materials?
    ///
    /// # Errors
    /// The first [`StacksFault`].
    pub fn check(&self) -> Result<(), StacksFault> {
        let (columns, layers) = (self.columns[0] * self.columns[1], self.tops.len());
        let fault = |column: usize, start: u32| StacksFault::Starts { column, columns, start, layers };
        if self.starts.len() != columns + 1 || self.materials.len() != layers || self.starts[0] != 0 {
            return Err(fault(0, self.starts.first().copied().unwrap_or(0)));
        }
        if self.starts[columns] as usize != layers {
            return Err(fault(columns, self.starts[columns]));
        }
        if let Some(k) = self.starts.windows(2).position(|ends| ends[0] > ends[1]) {
            return Err(fault(k + 1, self.starts[k + 1]));
        }
        let highest = self.region.high.z as f32;
        for (column, ends) in self.starts.windows(2).enumerate() {
            let own = ends[0] as usize..ends[1] as usize;
            let mut below = self.region.low.z as f32;
            for (layer, k) in own.clone().enumerate() {
                let top = self.tops[k];
                if !(top > below && top <= highest) {
                    return Err(StacksFault::Top { column, layer, top, below, highest });
                }
                let next = if k + 1 < own.end { self.materials[k + 1] } else { Material::Air.code() };
                if self.materials[k] == next || self.materials[k] > self.classes {
                    return Err(StacksFault::Material { column, layer });
                }
                below = top;
            }
        }
        Ok(())
    }
}
