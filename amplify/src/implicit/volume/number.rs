//! The numbers a volume is computed in: reals, duals and intervals that know noise, images, outlines and lists of primitives.

use super::super::index::Index;
use super::super::outline::Outline;
use crate::field::Box3;
use glam::{DVec2, DVec3};
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
    /// The plane distance to an outline, R where it is more, metres.
    #[inline(always)]
    fn outline_distance(outline: &Outline, p: [Self; 2]) -> Self {
        Self::outline_jet(outline, p)[0]
    }
    /// [`VolumeNumber::outline_distance`] with its derivatives along x and y.
    fn outline_jet(outline: &Outline, p: [Self; 2]) -> [Self; 3];
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
    #[inline(always)]
    fn outline_distance(outline: &Outline, p: [f64; 2]) -> f64 {
        outline.distance(DVec2::from_array(p))
    }
    #[inline(always)]
    fn outline_jet(outline: &Outline, p: [f64; 2]) -> [f64; 3] {
        outline.jet(DVec2::from_array(p))
    }
}

impl VolumeNumber for Interval {
    #[inline(always)]
    fn hull(self) -> Interval {
        self
    }
    fn outline_distance(outline: &Outline, p: [Interval; 2]) -> Interval {
        outline.enclose(p)
    }
    /// The direction to the nearest point may be any.
    fn outline_jet(outline: &Outline, p: [Interval; 2]) -> [Interval; 3] {
        let slope = if outline.constant(p).is_some() { Interval::ZERO } else { Interval::symmetric(1.0) };
        [outline.enclose(p), slope, slope]
    }
}

impl<R: VolumeNumber + NoiseJet + Differentiable, const K: usize> VolumeNumber for Dual<R, K> {
    #[inline(always)]
    fn hull(self) -> Interval {
        self.value.hull()
    }
    #[inline(always)]
    fn outline_distance(outline: &Outline, p: [Self; 2]) -> Self {
        let [value, dx, dy] = R::outline_jet(outline, p.map(|x| x.value));
        Dual::chain(value, [dx, dy], p)
    }
    fn outline_jet(outline: &Outline, p: [Self; 2]) -> [Self; 3] {
        // Second derivatives are not used: only values are differentiated.
        let [_, dx, dy] = R::outline_jet(outline, p.map(|x| x.value));
        [Self::outline_distance(outline, p), Dual::fixed(dx), Dual::fixed(dy)]
    }
}
