//! The order in which primitives are stored and points are served: by squares of the ground, so that neighbours stay in the
//! caches.

use crate::field::Box3;
use glam::{DVec2, DVec3};

/// Squares of ground that hold a few hundred primitives each.
pub(super) struct Squares {
    low: DVec2,
    scale: DVec2,
    side: usize,
}

impl Squares {
    pub(super) fn new(support: &Box3, primitives: usize) -> Squares {
        const PRIMITIVES: f64 = 256.0;
        let side = (primitives as f64 / PRIMITIVES).sqrt().ceil().clamp(1.0, 256.0);
        let size = (support.high - support.low).truncate().max(DVec2::splat(f64::MIN_POSITIVE));
        Squares { low: support.low.truncate(), scale: DVec2::splat(side) / size, side: side as usize }
    }
    pub(super) fn count(&self) -> usize {
        self.side * self.side
    }
    /// The square that holds `p`; the nearest, off the support.
    #[inline(always)]
    pub(super) fn of(&self, p: DVec3) -> usize {
        let at = (p.truncate() - self.low) * self.scale;
        // Conversion takes what is negative or no number to 0.
        (at.y as usize).min(self.side - 1) * self.side + (at.x as usize).min(self.side - 1)
    }
}
