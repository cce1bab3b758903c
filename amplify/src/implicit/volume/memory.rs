//! Bytes of a volume: what is shared counts once.

use super::Volume;
use std::collections::HashSet;
use std::sync::Arc;

/// The counts of a shared block, before its content.
const SHARED: usize = 2 * size_of::<usize>();

impl Volume {
    /// Bytes of the tree: nodes, primitives with their indexes, and apart the rasters of grounds, which the paper's memory
    /// excludes. Noises and geologies are left out.
    pub fn bytes(&self) -> [usize; 2] {
        let mut seen = HashSet::new();
        let [tree, rasters] = self.below(&mut seen);
        [size_of::<Volume>() + tree, rasters]
    }

    /// Of what is behind the node.
    fn below(&self, seen: &mut HashSet<usize>) -> [usize; 2] {
        let mut first = |address: usize| seen.insert(address);
        match self {
            Volume::Surface(surface) => {
                if !first(Arc::as_ptr(surface).addr()) {
                    return [0; 2];
                }
                [0, SHARED + surface.bytes().iter().sum::<usize>()]
            }
            Volume::Ground(surface, prism) => {
                let rasters = Volume::Surface(surface.clone()).below(seen)[1];
                [Volume::Prism(prism.clone()).below(seen)[0], rasters]
            }
            Volume::Prism(prism) => {
                [if first(Arc::as_ptr(prism).addr()) { SHARED + size_of_val(&**prism) } else { 0 }, 0]
            }
            Volume::Primitives(index) => {
                let new = first(Arc::as_ptr(index).addr());
                [if new { SHARED + size_of_val(&**index) + index.bytes().iter().sum::<usize>() } else { 0 }, 0]
            }
            Volume::Few(primitives) => {
                let new = first(Arc::as_ptr(primitives).addr());
                [if new { SHARED + size_of_val(&**primitives) } else { 0 }, 0]
            }
            Volume::Spine(spine) => [if first(Arc::as_ptr(spine).addr()) { SHARED + spine.bytes() } else { 0 }, 0],
            Volume::Blend(parts) | Volume::Union(parts) | Volume::Intersection(parts) => all(parts, seen),
            Volume::Carve(parts) => {
                if !first(Arc::as_ptr(parts).addr()) {
                    return [0; 2];
                }
                let [tree, rasters] = all(parts.as_ref(), seen);
                [SHARED + tree, rasters]
            }
            Volume::Warp(warp) => {
                let new = first(Arc::as_ptr(warp).addr());
                if new { two(size_of_val(&**warp), [&warp.child, &warp.region], seen) } else { [0; 2] }
            }
            Volume::Erosion(erosion) => {
                let new = first(Arc::as_ptr(erosion).addr());
                if new { two(size_of_val(&**erosion), [&erosion.child, &erosion.region], seen) } else { [0; 2] }
            }
            Volume::Instance(instance) => {
                if !first(Arc::as_ptr(instance).addr()) {
                    return [0; 2];
                }
                let [tree, rasters] = instance.child.below(seen);
                [SHARED + size_of_val(&**instance) + tree, rasters]
            }
        }
    }
}

fn all(parts: &[Volume], seen: &mut HashSet<usize>) -> [usize; 2] {
    parts.iter().fold([size_of_val(parts), 0], |[a, b], part| {
        let [tree, rasters] = part.below(seen);
        [a + tree, b + rasters]
    })
}

fn two(own: usize, parts: [&Volume; 2], seen: &mut HashSet<usize>) -> [usize; 2] {
    parts.iter().fold([SHARED + own, 0], |[a, b], part| {
        let [tree, rasters] = part.below(seen);
        [a + tree, b + rasters]
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Instance, Placement};
    use super::*;
    use crate::implicit::heightfield::tests::ground;
    use crate::implicit::primitive::Primitive;
    use crate::implicit::sigmoid::Sigmoid;
    use crate::implicit::skeleton::Skeleton;
    use glam::DVec3;

    #[test]
    fn what_is_shared_counts_once() {
        let one = Primitive { skeleton: Skeleton::Point([0.0; 3]), radius: 1.0, energy: 1.0 };
        let few = |n: usize| Volume::Few(vec![one; n].into());
        assert_eq!(few(100).bytes()[0] - few(50).bytes()[0], 50 * 36);
        let child = few(100);
        let copy = |x: f64| {
            let placement = Placement::new(DVec3::X * x, 0.0, 1.0).unwrap();
            Volume::Instance(Arc::new(Instance { child: child.clone(), placement }))
        };
        let copies = |n: usize| Volume::Blend((0..n).map(|k| copy(k as f64)).collect()).bytes()[0];
        assert!(copies(2) - copies(1) < 300 && copies(1) > 3600);
        let ground = ground(Sigmoid::UnitFree, 4.0);
        let [tree, rasters] = ground.bytes();
        assert!(tree < 200 && rasters > 33 * 25 * 4);
        assert_eq!(Volume::Blend(vec![ground.clone(), ground]).bytes()[1], rasters);
    }
}
