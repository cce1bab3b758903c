//! A heightfield with compact primitives blended onto it: f = min(f_T, f_P) + Σ s·g (Paris 2019 §5.2–5.3).

use super::heightfield::Heightfield;
use super::index::Index;
use crate::field::{Box3, Density, DensityBounds};
use glam::DVec3;
use terrain_model::primitive::image::ImageNumber;

/// The blend of a heightfield and compact primitives; either may be missing.
#[derive(Clone, Debug)]
pub struct Terrain {
    /// The ground.
    pub base: Option<Heightfield>,
    /// What accretes and carves.
    pub primitives: Index,
}

impl Terrain {
    /// f on any number, over the primitives whose support may meet `region`, which holds `p`.
    pub fn density<R: ImageNumber>(&self, p: [R; 3], region: &Box3) -> R {
        let base = self.base.as_ref().map_or(R::zero(), |base| base.density(p));
        let all = self.primitives.primitives();
        self.primitives.among(region).iter().fold(base, |sum, &k| sum + all[k as usize].density(p))
    }
}

impl Density for Terrain {
    #[inline]
    fn value(&self, p: DVec3) -> f64 {
        self.primitives.value(self.base.as_ref().map_or(0.0, |base| base.value(p)), p)
    }
    /// Points are served square by square of the ground: at random over 10⁵ primitives nearly every look-up would miss
    /// the caches.
    fn values(&self, points: &[DVec3]) -> Vec<f64> {
        const AT_ONCE: usize = 1 << 20;
        points.chunks(AT_ONCE).flat_map(|points| self.primitives.square_by_square(points, |p| self.value(p))).collect()
    }
    fn sample(&self, p: DVec3) -> (f64, DVec3) {
        self.primitives.sample(self.base.as_ref().map_or((0.0, DVec3::ZERO), |base| base.sample(p)), p)
    }
    fn bounds(&self, region: &Box3) -> DensityBounds {
        self.narrow(region, None).0
    }
    fn narrow(&self, region: &Box3, among: Option<&[u32]>) -> (DensityBounds, Vec<u32>) {
        let base = self.base.as_ref().map_or(DensityBounds::ZERO, |base| base.bounds(region));
        self.primitives.narrow(base, region, among)
    }
    fn support(&self) -> Box3 {
        let base = self.base.as_ref().map_or(Box3::EMPTY, Density::support);
        base.hull(&self.primitives.support())
    }
}

#[cfg(test)]
mod tests {
    use super::super::heightfield::tests::waves;
    use super::super::primitive::tests::any_primitive;
    use super::super::sigmoid::Sigmoid;
    use super::*;
    use proptest::prelude::*;

    fn terrain(primitives: Vec<super::super::primitive::Primitive>) -> Terrain {
        let base = Heightfield::new(&waves(), Sigmoid::UnitFree, 4.0, -30.0).unwrap();
        Terrain { base: Some(base), primitives: Index::new(primitives).unwrap() }
    }

    fn near(at: [f64; 3]) -> DVec3 {
        DVec3::new(100.0, -20.0, -20.0) + DVec3::from_array(at) * DVec3::new(70.0, 75.0, 40.0)
    }

    fn moved() -> impl Strategy<Value = super::super::primitive::Primitive> {
        use super::super::skeleton::Skeleton;
        (any_primitive(), prop::array::uniform3(0.0f64..1.0)).prop_map(|(mut one, at)| {
            // Only points can be moved by their one corner: the others stay off the ground, alone.
            if let Skeleton::Point(centre) = &mut one.skeleton {
                *centre = near(at).to_array().map(|x| x as f32);
            }
            one
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_terrain_is_within_its_bounds_and_its_values_do_not_depend_on_their_order(
            primitives in prop::collection::vec(moved(), 0..40),
            points in prop::collection::vec(prop::array::uniform3(0.0f64..1.0), 1..40),
            size in 0.1f64..20.0,
        ) {
            let terrain = terrain(primitives);
            let points: Vec<DVec3> = points.into_iter().map(near).collect();
            let values: Vec<f64> = points.iter().map(|&p| terrain.value(p)).collect();
            prop_assert_eq!(&terrain.values(&points), &values);
            let region = Box3::new(points[0], points[0] + size);
            let (around, near) = terrain.narrow(&Box3::new(points[0] - 3.0, points[0] + 30.0), None);
            let bounds = terrain.bounds(&region);
            prop_assert_eq!(terrain.narrow(&region, Some(&near)).0, bounds);
            prop_assert!(around.range.encloses(bounds.range));
            for pair in points.windows(2) {
                let [p, q] = [pair[0], pair[1]].map(|p| p.clamp(region.low, region.high));
                let (f, g) = (terrain.value(p), terrain.value(q));
                prop_assert!(bounds.range.contains(f), "{f} in {bounds:?}");
                prop_assert!((f - g).abs() <= bounds.slope * p.distance(q) + 1e-13, "{bounds:?}");
            }
        }
    }
}
