//! The numbers a volume is computed in: reals, duals and intervals that know noise, images and lists of primitives.

use super::super::index::Index;
use crate::field::Box3;
use glam::DVec3;
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::interval::Interval;
use terrain_model::noise::{NoiseJet, NoiseValue};
use terrain_model::primitive::image::ImageNumber;

/// A number on which every node of a [`Volume`](super::Volume) has its formula.
pub trait VolumeNumber: ImageNumber + NoiseValue {
    /// The reals it may be.
    fn hull(self) -> Interval;
    /// The sum of the primitives of an index.
    fn sum(index: &Index, p: [Self; 3]) -> Self {
        let hull = p.map(Self::hull);
        let [low, high] = [hull.map(Interval::lo), hull.map(Interval::hi)].map(DVec3::from_array);
        let all = index.primitives();
        let add = |sum: Self, k: u32| sum + all[k as usize].density(p);
        if low == high {
            index.near(low).fold(Self::zero(), add)
        } else {
            index.among(&Box3 { low, high }).into_iter().fold(Self::zero(), add)
        }
    }
}

impl VolumeNumber for f64 {
    #[inline(always)]
    fn hull(self) -> Interval {
        Interval::point(self)
    }
    #[inline(always)]
    fn sum(index: &Index, p: [f64; 3]) -> f64 {
        index.value(DVec3::from_array(p))
    }
}

impl VolumeNumber for Interval {
    #[inline(always)]
    fn hull(self) -> Interval {
        self
    }
}

impl<R: VolumeNumber + NoiseJet + Differentiable, const K: usize> VolumeNumber for Dual<R, K> {
    #[inline(always)]
    fn hull(self) -> Interval {
        self.value.hull()
    }
}
