//! Points of which no two are nearer than a spacing: a hash of cells twice as wide, so that the eight cells around a
//! point's nearest corner hold all that can be too near.

use glam::DVec3;

/// No point, no cell.
const NONE: u32 = u32::MAX;

/// The most points.
pub(super) const CAPACITY: usize = 1 << 30;

/// A cell of the table, and the point that was added to it last.
#[derive(Clone, Copy, Debug)]
struct Slot {
    cell: [i32; 3],
    last: u32,
}

/// The integers below.
fn whole(p: DVec3) -> [i32; 3] {
    p.floor().to_array().map(|x| x as i32)
}

/// Points at least a spacing apart.
#[derive(Clone, Debug)]
pub(super) struct Exclusion {
    spacing_squared: f64,
    inverse: f64,
    points: Vec<DVec3>,
    /// The point added to the same cell before each.
    before: Vec<u32>,
    /// A power of two of slots, at least half of them free.
    slots: Vec<Slot>,
    cells: usize,
}

impl Exclusion {
    /// Of no points; `spacing` is positive, and coordinates are below 10⁹ of it.
    pub(super) fn new(spacing: f64) -> Exclusion {
        let slots = vec![Slot { cell: [0; 3], last: NONE }; 64];
        let (points, before) = (Vec::new(), Vec::new());
        // A little wider than twice the spacing: positions in cells err by less than 10⁻⁷.
        let inverse = 0.499_999_5 / spacing;
        Exclusion { spacing_squared: spacing * spacing, inverse, points, before, slots, cells: 0 }
    }
    /// The points, in the order in which they were added.
    pub(super) fn points(&self) -> &[DVec3] {
        &self.points
    }
    /// The slot of `cell`: its own, or the free one where it belongs.
    fn slot(&self, cell: [i32; 3]) -> usize {
        // Blocks of 2³ cells lie side by side: a query's eight meet few of them, and so few lines of the cache.
        let word = |k: usize, by: u64| ((cell[k] >> 1) as u32 as u64).wrapping_mul(by);
        let mixed = word(0, 0x9e37_79b9_7f4a_7c15) ^ word(1, 0xc2b2_ae3d_27d4_eb4f) ^ word(2, 0x1656_67b1_9e37_79f9);
        let block = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 32;
        let within = (cell[0] & 1) | (cell[1] & 1) << 1 | (cell[2] & 1) << 2;
        let mask = self.slots.len() - 1;
        let mut at = ((block << 3) as usize | within as usize) & mask;
        while self.slots[at].last != NONE && self.slots[at].cell != cell {
            at = (at + 1) & mask;
        }
        at
    }
    /// Is no point nearer to `p` than the spacing?
    pub(super) fn is_free(&self, p: DVec3) -> bool {
        // A point within the spacing is within half a cell: no farther than the neighbour on the nearer side.
        let scaled = p * self.inverse;
        let (own, base) = (whole(scaled), whole(scaled - 0.5));
        // The point's own cell first: most places that are taken are taken there.
        let first = (0..3).fold(0, |bits, k| bits | ((own[k] - base[k]) << k));
        (0..8).all(|k| {
            let corner = k ^ first;
            let cell = std::array::from_fn(|k| base[k] + ((corner >> k) & 1));
            let mut k = self.slots[self.slot(cell)].last;
            while k != NONE {
                if self.points[k as usize].distance_squared(p) < self.spacing_squared {
                    return false;
                }
                k = self.before[k as usize];
            }
            true
        })
    }
    /// Adds a point that is free.
    pub(super) fn add(&mut self, p: DVec3) {
        if 2 * (self.cells + 1) > self.slots.len() {
            self.grow();
        }
        let cell = whole(p * self.inverse);
        let at = self.slot(cell);
        self.cells += usize::from(self.slots[at].last == NONE);
        self.before.push(self.slots[at].last);
        self.slots[at] = Slot { cell, last: self.points.len() as u32 };
        self.points.push(p);
    }
    fn grow(&mut self) {
        let size = 2 * self.slots.len();
        let old = std::mem::replace(&mut self.slots, vec![Slot { cell: [0; 3], last: NONE }; size]);
        for slot in old.into_iter().filter(|slot| slot.last != NONE) {
            let at = self.slot(slot.cell);
            self.slots[at] = slot;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain_model::noise::hash;

    #[test]
    fn a_place_is_free_exactly_when_no_point_is_nearer_than_the_spacing() {
        for (seed, spacing, middle) in [(1, 1.0, 0.0), (2, 0.37, -1e6), (3, 5.0, 3.0)] {
            let mut exclusion = Exclusion::new(spacing);
            let (mut refused, mut wrong) = (0, 0);
            for k in 0..3000u32 {
                let random = |j: u32| f64::from(hash::mix(seed, 3 * k + j)) / 4_294_967_296.0;
                let p = middle + DVec3::new(random(0), random(1), random(2)) * 9.0 * spacing;
                let apart = |spacing: f64| exclusion.points().iter().all(|q| p.distance(*q) >= spacing);
                assert_eq!(exclusion.is_free(p), apart(spacing), "{p}");
                // Control: another spacing decides otherwise for some.
                wrong += usize::from(apart(spacing) != apart(0.95 * spacing));
                if exclusion.is_free(p) { exclusion.add(p) } else { refused += 1 }
            }
            assert!(refused > 1000 && exclusion.points().len() > 200 && wrong > 50, "{refused} {wrong}");
        }
    }
}
