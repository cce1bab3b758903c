//! Primitives inserted after an index was made, by cells of a grid without bounds: what brushes add. The grid is as coarse as
//! the largest of them, so each is in few cells.

use super::primitive::Primitive;
use crate::field::Box3;
use glam::DVec3;
use std::collections::HashMap;

/// A cell's box is widened by this share of its side before supports are tested against it: far more than positions in
/// cells err by.
const SLACK: f64 = 1e-6;

/// The grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    /// Side of a cell, metres.
    cell: f64,
    cells: HashMap<[i32; 3], Vec<u32>>,
    /// In order of number.
    numbers: Vec<u32>,
}

impl Recent {
    pub(super) fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }
    pub(super) fn bytes(&self) -> usize {
        let lists: usize = self.cells.values().map(|list| size_of_val(list.as_slice())).sum();
        lists + self.cells.len() * size_of::<([i32; 3], Vec<u32>)>() + size_of_val(self.numbers.as_slice())
    }
    fn cell_of(&self, p: DVec3) -> [i32; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i32)
    }
    fn cell_box(&self, cell: [i32; 3]) -> Box3 {
        let low = DVec3::from_array(cell.map(f64::from));
        Box3 { low: (low - SLACK) * self.cell, high: (low + (1.0 + SLACK)) * self.cell }
    }
    /// Adds number `k` of `all`; numbers are added in their order.
    pub(super) fn insert(&mut self, all: &[Primitive], k: u32) {
        let support = all[k as usize].support();
        let side = 0.5 * (support.high - support.low).max_element();
        self.numbers.push(k);
        if side > 2.0 * self.cell {
            // Coarser, or the first: everything finds its cells again.
            self.cell = side.max(f64::from(f32::MIN_POSITIVE));
            self.cells.clear();
            std::mem::take(&mut self.numbers).into_iter().for_each(|k| {
                self.numbers.push(k);
                self.list(&all[k as usize], k);
            });
        } else {
            self.list(&all[k as usize], k);
        }
    }
    fn list(&mut self, one: &Primitive, k: u32) {
        let support = one.support();
        let (low, high) = (self.cell_of(support.low), self.cell_of(support.high));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if one.meets(&self.cell_box([x, y, z])) {
                        self.cells.entry([x, y, z]).or_default().push(k);
                    }
                }
            }
        }
    }
    /// Those whose support may hold `p`, ascending.
    #[inline(never)]
    pub(super) fn near(&self, p: DVec3) -> &[u32] {
        self.cells.get(&self.cell_of(p)).map_or(&[], Vec::as_slice)
    }
    /// Appends those whose support may meet `region`, in no order and more than once.
    pub(super) fn among(&self, region: &Box3, found: &mut Vec<u32>) {
        let (low, high) = (self.cell_of(region.low), self.cell_of(region.high));
        let count = (0..3).map(|k| f64::from(high[k]) - f64::from(low[k]) + 1.0).product::<f64>();
        if count > self.cells.len() as f64 {
            let within = |cell: &[i32; 3]| (0..3).all(|k| (low[k]..=high[k]).contains(&cell[k]));
            self.cells.iter().filter(|(cell, _)| within(cell)).for_each(|(_, list)| found.extend_from_slice(list));
            return;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    self.cells.get(&[x, y, z]).into_iter().for_each(|list| found.extend_from_slice(list));
                }
            }
        }
    }
}
