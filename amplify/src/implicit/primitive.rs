//! A compact primitive: energy times the falloff of the distance to a skeleton (Paris 2019 §5.2). Positive energy
//! accretes, negative carves.

use super::skeleton::Skeleton;
use crate::field::{Box3, DensityBounds};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::bounds::times_up;
use terrain_model::dual::Dual;
use terrain_model::falloff::{wyvill, wyvill_steepness};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// One primitive, 36 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Primitive {
    /// What it is built around.
    pub skeleton: Skeleton,
    /// R: where the falloff ends, metres from the skeleton.
    pub radius: f32,
    /// f on the skeleton; negative carves.
    pub energy: f32,
}

impl Primitive {
    /// Is the skeleton sound, the radius positive, and the energy finite?
    pub fn is_sound(&self) -> bool {
        self.skeleton.is_sound() && self.radius > 0.0 && self.radius.is_finite() && self.energy.is_finite()
    }

    /// f = s·g(d/R), one formula for every number.
    #[inline(always)]
    pub fn density<R: Real>(&self, p: [R; 3]) -> R {
        let radius = R::constant(f64::from(self.radius));
        R::constant(f64::from(self.energy)) * wyvill(self.skeleton.distance_squared(p) / radius.square())
    }

    /// f at `p`.
    #[inline(always)]
    pub fn value(&self, p: DVec3) -> f64 {
        self.density(p.to_array())
    }

    /// f and ∇f at `p`.
    pub fn sample(&self, p: DVec3) -> (f64, DVec3) {
        let p: [Dual<f64, 3>; 3] = std::array::from_fn(|k| Dual::variable(p[k], k));
        let f = self.density(p);
        (f.value, DVec3::from_array(f.slope))
    }

    /// Encloses the squared distances of `region` in units of R²; the support begins below 1.
    fn distances(&self, region: &Box3) -> Interval {
        let u = self.skeleton.distances_squared(region) / Interval::point(f64::from(self.radius)).square();
        Interval::new(u.lo().max(0.0), u.hi())
    }

    /// May the support meet `region`?
    pub fn meets(&self, region: &Box3) -> bool {
        self.distances(region).lo() < 1.0
    }

    /// Encloses f over `region`, with |s|·max|g′|/R over the distances that occur there: the distance's slope is at
    /// most 1. Exactly 0 off the support.
    pub fn bounds(&self, region: &Box3) -> DensityBounds {
        let u = self.distances(region);
        if u.lo() >= 1.0 {
            return DensityBounds::ZERO;
        }
        let energy = f64::from(self.energy);
        let steep = (Interval::point(wyvill_steepness(u)) / Interval::point(f64::from(self.radius))).hi();
        DensityBounds { range: Interval::point(energy) * wyvill(u), slope: times_up(energy.abs(), steep) }
    }

    /// The box off which f is 0, rounded outward.
    pub fn support(&self) -> Box3 {
        let extent = self.skeleton.extent();
        let stretch = self.skeleton.stretch();
        let side: [Interval; 3] = std::array::from_fn(|k| {
            let reach = times_up(stretch[k], f64::from(self.radius));
            Interval::new(extent.low[k], extent.high[k]) + Interval::symmetric(reach)
        });
        Box3 { low: DVec3::from_array(side.map(Interval::lo)), high: DVec3::from_array(side.map(Interval::hi)) }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub(crate) fn any_primitive() -> impl Strategy<Value = Primitive> {
        let at = || prop::array::uniform3(-20.0f32..20.0);
        let half = || prop::array::uniform3(0.5f32..6.0);
        let skeleton = prop_oneof![
            at().prop_map(Skeleton::Point),
            (at(), half()).prop_map(|(a, d)| Skeleton::Segment(a, [a[0] + d[0], a[1] - d[1], a[2] + d[2]])),
            (at(), 0.5f32..6.0).prop_map(|(centre, radius)| Skeleton::Sphere { centre, radius }),
            (at(), half()).prop_map(|(centre, half)| Skeleton::Cuboid { centre, half }),
            (at(), half()).prop_map(|(centre, half)| Skeleton::Ellipsoid { centre, half }),
            (at(), 1.0f32..8.0, 0.0f32..5.0, 0.1f32..5.0).prop_map(|(base, height, low, high)| Skeleton::Cone {
                base,
                height,
                low,
                high
            }),
        ];
        (skeleton, 0.5f32..12.0, -1.5f32..1.5).prop_map(|(skeleton, radius, energy)| Primitive {
            skeleton,
            radius,
            energy,
        })
    }

    /// A point inside, near or outside the support.
    fn near(primitive: &Primitive, at: [f64; 3]) -> DVec3 {
        let support = primitive.support();
        let size = support.high - support.low;
        support.low + size * DVec3::from_array(at.map(|x| 1.3 * x - 0.15))
    }

    const CASES: u32 = 3000;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(CASES))]

        #[test]
        fn a_primitive_is_within_its_bounds_over_every_box(
            primitive in any_primitive(),
            a in prop::array::uniform3(0.0f64..1.0), b in prop::array::uniform3(0.0f64..1.0),
            u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..1.0,
        ) {
            prop_assert!(primitive.is_sound());
            let corner = near(&primitive, a);
            let region = Box3::new(corner, corner.lerp(near(&primitive, b), size));
            let bounds = primitive.bounds(&region);
            let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
                .clamp(region.low, region.high);
            let (p, q) = (inside(u), inside(v));
            let (f, g) = (primitive.value(p), primitive.value(q));
            prop_assert!(bounds.range.contains(f) && bounds.range.contains(g), "{f} and {g} in {bounds:?}");
            let change = (f - g).abs();
            prop_assert!(change <= bounds.slope * p.distance(q) + 1e-14, "{change} over {}: {bounds:?}", p.distance(q));
            let enclosure = primitive.density(region.intervals());
            prop_assert!(enclosure.contains(f));
        }

        #[test]
        fn a_primitive_ends_at_its_support(primitive in any_primitive(), at in prop::array::uniform3(0.0f64..1.0)) {
            let p = near(&primitive, at);
            prop_assert!(primitive.support().contains(p) || primitive.value(p) == 0.0);
        }

        #[test]
        fn the_gradient_is_the_slope_of_the_value(
            primitive in any_primitive(), at in prop::array::uniform3(0.0f64..1.0), k in 0usize..3,
        ) {
            let p = near(&primitive, at);
            let (f, gradient) = primitive.sample(p);
            prop_assert_eq!(f, primitive.value(p));
            const H: f64 = 1e-6;
            let step = DVec3::AXES[k] * H;
            let central = (primitive.value(p + step) - primitive.value(p - step)) / (2.0 * H);
            // f″ is below 6 s/R² ≤ 36, plus what the kinks of edges add: h times that.
            prop_assert!((central - gradient[k]).abs() < 2e-4, "{central} against {}", gradient[k]);
        }
    }

    /// The control of the property above: half the bound is convicted.
    #[test]
    fn half_the_slope_bound_of_a_point_is_exceeded() {
        let primitive = Primitive { skeleton: Skeleton::Point([0.0; 3]), radius: 2.0, energy: -1.0 };
        let bounds = primitive.bounds(&primitive.support());
        let x = 2.0 / 5.0f64.sqrt();
        let rise = (primitive.value(DVec3::X * (x + 1e-3)) - primitive.value(DVec3::X * (x - 1e-3))) / 2e-3;
        assert!(rise <= bounds.slope && rise > 0.99 * bounds.slope && rise > 0.5 * bounds.slope);
    }

    #[test]
    fn a_primitive_takes_36_bytes() {
        assert_eq!(size_of::<Primitive>(), 36);
    }

    #[test]
    fn the_field_is_constant_inside_a_volume_and_half_at_the_same_distance_from_every_side() {
        let solids = [
            Skeleton::Sphere { centre: [0.0; 3], radius: 3.0 },
            Skeleton::Cuboid { centre: [0.0; 3], half: [3.0; 3] },
            Skeleton::Ellipsoid { centre: [0.0; 3], half: [3.0, 4.0, 5.0] },
            Skeleton::Cone { base: [0.0, 0.0, -3.0], height: 6.0, low: 3.0, high: 3.0 },
        ];
        for skeleton in solids {
            let solid = Primitive { skeleton, radius: 2.0, energy: 1.0 };
            for at in [DVec3::ZERO, DVec3::new(2.9, 0.0, 0.0), DVec3::new(0.3, 0.4, 2.8)] {
                assert_eq!(solid.value(at), 1.0, "{skeleton:?} at {at}");
            }
            assert!((solid.value(DVec3::X * 4.0) - 0.421875).abs() < 1e-12, "{skeleton:?}");
        }
    }

    #[test]
    fn what_is_not_sound_is_said_to_be() {
        let point = |radius: f32, energy: f32| Primitive { skeleton: Skeleton::Point([0.0; 3]), radius, energy };
        assert!(point(1.0, 0.5).is_sound());
        assert!(!point(0.0, 0.5).is_sound() && !point(1.0, f32::NAN).is_sound());
        assert!(!Skeleton::Segment([1.0; 3], [1.0; 3]).is_sound());
    }
}
