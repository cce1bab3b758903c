//! A heightfield with compact primitives blended onto it: f = min(f_T, f_P) + Σ s·g (Paris 2019 §5.2–5.3).

use super::heightfield::Heightfield;
use super::index::Index;
use crate::field::{Box3, Density, DensityBounds};
use glam::DVec3;

/// The blend of a heightfield and compact primitives; either may be missing.
#[derive(Clone, Debug)]
pub struct Terrain {
    /// The ground.
    pub base: Option<Heightfield>,
    /// What accretes and carves.
    pub primitives: Index,
}

impl Density for Terrain {
    #[inline]
    fn value(&self, p: DVec3) -> f64 {
        self.primitives.value(self.base.as_ref().map_or(0.0, |base| base.value(p)), p)
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        self.primitives.sample(self.base.as_ref().map_or((0.0, DVec3::ZERO), |base| base.sample(p)), p)
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        let base = self.base.as_ref().map_or(DensityBounds::ZERO, |base| base.bounds(region));
        self.primitives.bounds(base, region)
    }
    fn support(&self) -> Box3 {
        let base = self.base.as_ref().map_or(Box3::EMPTY, Density::support);
        base.hull(&self.primitives.support())
    }
}
