//! The numbers a volume is computed in: reals, duals and intervals that know noise, images and lists of primitives.

use super::super::index::Index;
use crate::field::Box3;
use glam::DVec3;
use std::borrow::Cow;
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::interval::Interval;
use terrain_model::noise::{NoiseJet, NoiseValue};
use terrain_model::primitive::image::ImageNumber;

/// A number on which every node of a [`Volume`](super::Volume) has its formula.
pub trait VolumeNumber: ImageNumber + NoiseValue {
    /// The reals it may be.
    fn hull(self) -> Interval;
    /// The primitives that may be other than 0 at `p`, in the order of their sum.
    #[inline(always)]
    fn listed(index: &Index, p: [Self; 3]) -> Cow<'_, [u32]> {
        let p = p.map(Self::hull);
        let [low, high] = [p.map(Interval::lo), p.map(Interval::hi)].map(DVec3::from_array);
        if low == high { Cow::Borrowed(index.near(low)) } else { Cow::Owned(index.among(&Box3 { low, high })) }
    }
}

impl VolumeNumber for f64 {
    #[inline(always)]
    fn hull(self) -> Interval {
        Interval::point(self)
    }
    #[inline(always)]
    fn listed(index: &Index, p: [f64; 3]) -> Cow<'_, [u32]> {
        Cow::Borrowed(index.near(DVec3::from_array(p)))
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
