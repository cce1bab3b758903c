//! The construction tree (Paris 2019 §5–6): leaves of ground, prism and compact primitives under blends, unions,
//! intersections, carvings, localised warps, erosion and instances. One formula per node serves values, gradients and
//! proofs.

mod bounds;
pub mod file;
mod fill;
mod memory;
mod number;
mod part;
#[cfg(test)]
mod tests;
mod vertical;

pub use number::VolumeNumber;
pub use part::{Erosion, Instance, Placement, Warp};

use super::index::Index;
use super::primitive::Primitive;
use super::prism::Prism;
use super::spine::Spine;
use super::surface::Surface;
use crate::field::{Box3, Density, DensityBounds, THRESHOLD, WithVertical};
use glam::DVec3;
use std::sync::Arc;
use terrain_model::dual::Dual;

/// A node with what is below it. Rock is where its field exceeds T. Clones share the leaves.
#[derive(Clone, Debug)]
pub enum Volume {
    /// The heightfield surface f_T.
    Surface(Arc<Surface>),
    /// The prism f_P.
    Prism(Arc<Prism>),
    /// The intersection of the two, min(f_T, f_P), as one leaf: the ground of most queries.
    Ground(Arc<Surface>, Arc<Prism>),
    /// The sum of compact primitives, found through an index.
    Primitives(Arc<Index>),
    /// The sum of a few compact primitives, each of which is computed.
    Few(Arc<[Primitive]>),
    /// A point or curve, its distance perturbed by noise or not.
    Spine(Arc<Spine>),
    /// The sum; nothing is the field 0.
    Blend(Vec<Volume>),
    /// The largest (claims P9); of nothing, 0.
    Union(Vec<Volume>),
    /// The smallest (claims P9); of nothing, 0.
    Intersection(Vec<Volume>),
    /// The first without the second: min(f, 2T − g), air where g > T.
    Carve(Arc<[Volume; 2]>),
    /// Space deformed within a region.
    Warp(Arc<Warp>),
    /// Rock taken away by its weakness, within a region.
    Erosion(Arc<Erosion>),
    /// A copy elsewhere.
    Instance(Arc<Instance>),
}

impl Volume {
    /// The field 0: air.
    pub const AIR: Volume = Volume::Blend(Vec::new());

    /// The blend of a ground and compact primitives.
    ///
    /// # Errors
    /// The position of the first primitive that is not sound.
    pub fn terrain(ground: Volume, primitives: Vec<Primitive>) -> Result<Volume, usize> {
        Ok(Volume::Blend(vec![ground, Volume::Primitives(Arc::new(Index::new(primitives)?))]))
    }
    /// The first without the second.
    #[must_use]
    pub fn carve(self, by: Volume) -> Volume {
        Volume::Carve(Arc::new([self, by]))
    }

    /// f on any number: the one formula of every node.
    #[inline(always)]
    pub fn density<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        // Leaves in the caller: most of a query is spent in them.
        match self {
            Volume::Surface(surface) => surface.density(p),
            Volume::Prism(prism) => prism.density(p),
            Volume::Ground(surface, prism) => surface.density(p).min(prism.density(p)),
            Volume::Primitives(index) => R::sum(index, p),
            Volume::Few(primitives) => {
                let mut sum = R::zero();
                for one in primitives.iter() {
                    sum = sum + one.density(p);
                }
                sum
            }
            Volume::Spine(spine) => spine.density(p),
            node => node.combined(p),
        }
    }

    /// f of a node with others below it.
    fn combined<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        match self {
            Volume::Surface(_) | Volume::Prism(_) | Volume::Ground(..) => R::zero(),
            Volume::Primitives(_) | Volume::Few(_) | Volume::Spine(_) => R::zero(),
            Volume::Blend(parts) => fold(parts, p, |f, g| f + g),
            Volume::Union(parts) => fold(parts, p, R::max),
            Volume::Intersection(parts) => fold(parts, p, R::min),
            Volume::Carve(parts) => fold(parts.as_ref(), p, |f, g| f.min(R::constant(2.0 * THRESHOLD) - g)),
            Volume::Warp(warp) => warp.density(p),
            Volume::Erosion(erosion) => erosion.density(p),
            Volume::Instance(instance) => instance.density(p),
        }
    }

    /// The index that holds the most primitives, copies aside.
    fn largest_index(&self) -> Option<&Index> {
        fn largest(parts: &[Volume]) -> Option<&Index> {
            parts.iter().filter_map(Volume::largest_index).max_by_key(|index| index.primitives().len())
        }
        match self {
            Volume::Primitives(index) => Some(index),
            Volume::Blend(parts) | Volume::Union(parts) | Volume::Intersection(parts) => largest(parts),
            Volume::Carve(parts) => largest(parts.as_ref()),
            Volume::Warp(warp) => warp.child.largest_index(),
            Volume::Erosion(erosion) => erosion.child.largest_index(),
            Volume::Surface(_) | Volume::Prism(_) | Volume::Ground(..) => None,
            Volume::Few(_) | Volume::Spine(_) | Volume::Instance(_) => None,
        }
    }
}

/// The parts' fields combined from the left; 0 without parts.
#[inline(always)]
fn fold<R: VolumeNumber>(parts: &[Volume], p: [R; 3], operator: impl Fn(R, R) -> R) -> R {
    let [first, others @ ..] = parts else { return R::zero() };
    let mut f = first.density(p);
    for part in others {
        f = operator(f, part.density(p));
    }
    f
}

impl Density for Volume {
    fn value(&self, p: DVec3) -> f64 {
        let p = p.to_array();
        // A ground with primitives, without the walk: a sixth faster.
        if let Volume::Blend(parts) = self
            && let [ground @ Volume::Ground(..), primitives @ Volume::Primitives(_)] = parts.as_slice()
        {
            return ground.density(p) + primitives.density(p);
        }
        self.density(p)
    }
    /// Points are served square by square of the ground: at random over 10⁵ primitives nearly every look-up would miss
    /// the caches.
    fn values(&self, points: &[DVec3]) -> Vec<f64> {
        const AT_ONCE: usize = 1 << 20;
        let Some(index) = self.largest_index() else { return points.iter().map(|&p| self.value(p)).collect() };
        points.chunks(AT_ONCE).flat_map(|points| index.square_by_square(points, |p| self.value(p))).collect()
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        let f = self.density::<Dual<f64, 3>>(std::array::from_fn(|k| Dual::variable(p[k], k)));
        (f.value, DVec3::from_array(f.slope))
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        self.enclose(region, false).0
    }
    fn support(&self) -> Box3 {
        let all = |parts: &[Volume]| parts.iter().fold(Box3::EMPTY, |all, part| all.hull(&part.support()));
        match self {
            Volume::Surface(surface) => surface.support(),
            Volume::Prism(prism) => prism.support(),
            Volume::Ground(surface, prism) => surface.support().meet(&prism.support()),
            Volume::Primitives(index) => index.support(),
            Volume::Few(primitives) => primitives.iter().fold(Box3::EMPTY, |all, one| all.hull(&one.support())),
            Volume::Spine(spine) => spine.support(),
            Volume::Blend(parts) | Volume::Union(parts) => all(parts),
            Volume::Intersection(parts) => {
                parts.iter().map(Density::support).reduce(|a, b| a.meet(&b)).unwrap_or(Box3::EMPTY)
            }
            Volume::Carve(parts) => parts[0].support(),
            Volume::Warp(warp) => warp.support(),
            Volume::Erosion(erosion) => erosion.child.support(),
            Volume::Instance(instance) => instance.support(),
        }
    }
    fn narrow(&self, region: &Box3) -> (DensityBounds, Volume) {
        self.enclose(region, true)
    }
    fn is_bare(&self) -> bool {
        matches!(self, Volume::Surface(_) | Volume::Prism(_))
    }
    fn along_z(&self, at: [f64; 2], f: &mut WithVertical<'_>) {
        self.on_vertical(at, f);
    }
    fn fill(&self, axes: [&[f64]; 3], out: &mut [f64]) {
        self.fill_block(axes, out);
    }
}
