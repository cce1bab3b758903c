//! A volume on one vertical: the ground is looked up once, and of a few primitives those are left that reach it. The numbers
//! are those of the formula, to the bit.

use super::super::primitive::Primitive;
use super::super::skeleton::Skeleton;
use super::Volume;
use crate::field::{Density, WithVertical};
use glam::DVec3;
use terrain_model::falloff::wyvill;

/// More primitives than this are computed one by one.
const AT_ONCE: usize = 32;

/// A point primitive seen from a vertical.
#[derive(Clone, Copy, Default)]
struct Beside {
    /// Squared distance of the vertical, metres².
    squared: f64,
    z: f64,
    /// R², metres².
    reach: f64,
    energy: f64,
}

/// A point primitive; not those whose support is beside the vertical.
fn beside(one: &Primitive, [x, y]: [f64; 2]) -> Option<Option<Beside>> {
    let Skeleton::Point(centre) = one.skeleton else { return None };
    let [cx, cy, z] = centre.map(f64::from);
    let squared = (x - cx) * (x - cx) + (y - cy) * (y - cy);
    let reach = f64::from(one.radius) * f64::from(one.radius);
    Some((squared < reach).then_some(Beside { squared, z, reach, energy: f64::from(one.energy) }))
}

/// The points among `primitives` that reach the vertical, in their order; `None` when there are others or too many.
fn points(primitives: &[Primitive], at: [f64; 2]) -> Option<([Beside; AT_ONCE], usize)> {
    let (mut near, mut count) = ([Beside::default(); AT_ONCE], 0);
    for one in primitives {
        if let Some(point) = beside(one, at)? {
            *near.get_mut(count)? = point;
            count += 1;
        }
    }
    Some((near, count))
}

impl Volume {
    /// Calls `f` with the field over (x, y).
    pub(super) fn on_vertical(&self, at: [f64; 2], f: &mut WithVertical<'_>) {
        match self {
            Volume::Surface(surface) => {
                let column = surface.column(at);
                f(&|z| surface.on_column(column, z));
            }
            Volume::Few(primitives) => {
                let Some((near, count)) = points(primitives, at) else { return f(&|z| self.at(at, z)) };
                f(&|z| {
                    let of = |one: &Beside| one.energy * wyvill((one.squared + (z - one.z) * (z - one.z)) / one.reach);
                    near[..count].iter().fold(0.0, |sum, one| sum + of(one))
                });
            }
            Volume::Blend(parts) => match parts.as_slice() {
                [a, b] => a.on_vertical(at, &mut |a| b.on_vertical(at, &mut |b| f(&|z| a(z) + b(z)))),
                _ => f(&|z| self.at(at, z)),
            },
            _ => f(&|z| self.at(at, z)),
        }
    }

    fn at(&self, [x, y]: [f64; 2], z: f64) -> f64 {
        self.value(DVec3::new(x, y, z))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::heightfield::tests::ground;
    use super::super::super::primitive::tests::any_primitive;
    use super::super::super::sigmoid::Sigmoid;
    use super::*;
    use crate::field::Box3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Over ground, prism, primitives of every kind, and more of them than are computed at once.
        #[test]
        fn a_vertical_has_the_values_of_the_formula(
            some in prop::collection::vec(any_primitive(), 0..48), points in any::<bool>(),
            at in prop::array::uniform2(-25.0f64..25.0), zs in prop::array::uniform8(-25.0f64..25.0),
        ) {
            let some: Vec<Primitive> = some
                .into_iter()
                .map(|one| match one.skeleton {
                    Skeleton::Segment(a, _) if points => Primitive { skeleton: Skeleton::Point(a), ..one },
                    _ if points => Primitive { skeleton: Skeleton::Point([1.0, 2.0, 3.0]), ..one },
                    _ => one,
                })
                .collect();
            let all = Volume::terrain(ground(Sigmoid::UnitFree, 3.0), some.clone()).unwrap();
            let middle = DVec3::new(at[0] + 130.0, at[1] + 10.0, 0.0);
            let surface = ground(Sigmoid::UnitFree, 3.0).narrow(&Box3::around(middle, 1.0)).1;
            let few = Volume::Few(some.into());
            let pair = Volume::Blend(vec![surface.clone(), few.clone()]);
            for volume in [few, pair, surface, all] {
                volume.along_z(at, &mut |value| {
                    zs.iter().for_each(|&z| assert!(value(z) == volume.at(at, z), "{volume:?} at {at:?}, {z}"));
                });
            }
        }
    }
}
