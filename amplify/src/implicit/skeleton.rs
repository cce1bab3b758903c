//! Skeletons of primitives: points and segments, which are thin, and spheres, boxes, ellipsoids and cones, whose field is
//! constant inside (Paris 2019 §5.2). Each answers with a distance whose slope is at most 1.

use crate::field::Box3;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// A skeleton; metres, z up. Parameters are `f32`, and what they are is exactly what they say: no computation
/// rounds them again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Skeleton {
    /// A point.
    Point([f32; 3]),
    /// The segment between two points.
    Segment([f32; 3], [f32; 3]),
    /// A solid sphere.
    Sphere {
        /// Its centre.
        centre: [f32; 3],
        /// Its radius.
        radius: f32,
    },
    /// A solid box with sides along the axes.
    Cuboid {
        /// Its centre.
        centre: [f32; 3],
        /// Half its sides.
        half: [f32; 3],
    },
    /// A solid ellipsoid with axes along x, y and z.
    Ellipsoid {
        /// Its centre.
        centre: [f32; 3],
        /// Half its axes.
        half: [f32; 3],
    },
    /// A solid cone frustum about a vertical axis.
    Cone {
        /// The centre of its lower face.
        base: [f32; 3],
        /// Its height.
        height: f32,
        /// Radius of the lower face.
        low: f32,
        /// Radius of the upper face.
        high: f32,
    },
}

impl Skeleton {
    /// Are its sizes positive and its numbers finite? A cone may have one radius 0.
    pub fn is_sound(&self) -> bool {
        let finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
        let positive = |x: f32| x > 0.0 && x.is_finite();
        match self {
            Skeleton::Point(p) => finite(p),
            Skeleton::Segment(a, b) => finite(a) && finite(b) && a != b,
            Skeleton::Sphere { centre, radius } => finite(centre) && positive(*radius),
            Skeleton::Cuboid { centre, half } | Skeleton::Ellipsoid { centre, half } => {
                finite(centre) && half.iter().all(|&x| positive(x))
            }
            Skeleton::Cone { base, height, low, high } => {
                finite(base) && positive(*height) && [low, high].iter().all(|x| **x >= 0.0) && positive(low + high)
            }
        }
    }

    /// The squared distance to the skeleton, metres²; 0 inside. That of the ellipsoid is the largest multiple of its
    /// norm that is a lower bound of the distance, (‖p‖_E − 1) · its shortest half axis; its slope is at most 1.
    #[inline(always)]
    pub fn distance_squared<R: Real>(&self, p: [R; 3]) -> R {
        let c = |x: f32| R::constant(f64::from(x));
        let from = |centre: &[f32; 3]| -> [R; 3] { std::array::from_fn(|k| p[k] - c(centre[k])) };
        let squared = |v: [R; 3]| v[0].square() + v[1].square() + v[2].square();
        // Most are points: a branch that is predicted, before one that is looked up in a table.
        if let Skeleton::Point(centre) = self {
            return squared(from(centre));
        }
        match self {
            Skeleton::Point(centre) => squared(from(centre)),
            Skeleton::Segment(a, b) => {
                // Differences of `f32` are not `f32`: they are taken in R.
                let v = from(a);
                let d: [R; 3] = std::array::from_fn(|k| c(b[k]) - c(a[k]));
                let along = (v[0] * d[0] + v[1] * d[1] + v[2] * d[2]) / squared(d);
                let t = along.clamp01();
                squared(std::array::from_fn(|k| v[k] - t * d[k]))
            }
            Skeleton::Sphere { centre, radius } => {
                let v = from(centre);
                let d = R::length(R::length(v[0], v[1]), v[2]) - c(*radius);
                d.max(R::zero()).square()
            }
            Skeleton::Cuboid { centre, half } => {
                let v = from(centre);
                squared(std::array::from_fn(|k| (v[k].abs() - c(half[k])).max(R::zero())))
            }
            Skeleton::Ellipsoid { centre, half } => {
                let v = from(centre);
                let [x, y, z]: [R; 3] = std::array::from_fn(|k| v[k] / c(half[k]));
                let norm = R::length(R::length(x, y), z) - R::one();
                (norm.max(R::zero()) * c(half[0].min(half[1]).min(half[2]))).square()
            }
            Skeleton::Cone { base, height, low, high } => {
                // In the half plane of distance from the axis and height the solid is a trapezoid: the distance is 0
                // inside, else the least to its lower, upper and slanted sides.
                let v = from(base);
                let (r, z) = (R::length(v[0], v[1]), v[2]);
                let (r0, r1, h) = (c(*low), c(*high), c(*height));
                let disc = |radius: R, z: R| (r - radius).max(R::zero()).square() + z.square();
                let (dr, dz) = (r1 - r0, h);
                let along = (((r - r0) * dr + z * dz) / (dr.square() + dz.square())).clamp01();
                let side = (r - r0 - along * dr).square() + (z - along * dz).square();
                let outside = disc(r0, z).min(disc(r1, z - h)).min(side);
                // Inside: between the faces and on the axis' side of the slant.
                let over = R::zero().less(z - h);
                let right = R::zero().less((r - r0) * dz - z * dr);
                let under = z.less(R::zero());
                let zero = R::zero();
                R::select(over, outside, R::select(under, outside, R::select(right, outside, zero)))
            }
        }
    }

    /// Encloses the squared distances of the points of `region`. A point's follow from the formula; else the distance at
    /// the middle changes by no more than half the diagonal.
    pub fn distances_squared(&self, region: &Box3) -> Interval {
        if let Skeleton::Point(centre) = self {
            return region.distance_squared(DVec3::from_array(centre.map(f64::from)));
        }
        let middle = (region.low + region.high) * 0.5;
        let half = region.distance_squared(middle).hi();
        let reach = Interval::symmetric(Real::sqrt(Interval::point(half)).hi());
        let at = Real::sqrt(self.distance_squared(middle.to_array().map(Interval::point)));
        Real::max(at + reach, Interval::ZERO).square()
    }

    /// The smallest box around the skeleton.
    pub fn extent(&self) -> Box3 {
        let at = |p: &[f32; 3]| DVec3::from_array(p.map(f64::from));
        let sized = |centre: &[f32; 3], half: [f32; 3]| {
            let side: [Interval; 3] = std::array::from_fn(|k| {
                Interval::point(f64::from(centre[k])) + Interval::symmetric(f64::from(half[k]))
            });
            Box3 { low: DVec3::from_array(side.map(Interval::lo)), high: DVec3::from_array(side.map(Interval::hi)) }
        };
        match self {
            Skeleton::Point(p) => Box3::new(at(p), at(p)),
            Skeleton::Segment(a, b) => Box3::new(at(a), at(b)),
            Skeleton::Sphere { centre, radius } => sized(centre, [*radius; 3]),
            Skeleton::Cuboid { centre, half } | Skeleton::Ellipsoid { centre, half } => sized(centre, *half),
            Skeleton::Cone { base, height, low, high } => {
                let wide = low.max(*high);
                let foot = sized(base, [wide, wide, 0.0]);
                let top = (Interval::point(foot.low.z) + Interval::point(f64::from(*height))).hi();
                Box3 { low: foot.low, high: foot.high.with_z(foot.high.z.max(top)) }
            }
        }
    }

    /// By how much the support exceeds the extent, per metre of the falloff's radius: 1 but for the ellipsoid, whose
    /// distance is shorter than the true one by the ratio of its half axes.
    pub fn stretch(&self) -> [f64; 3] {
        match self {
            Skeleton::Ellipsoid { half, .. } => {
                let least = f64::from(half[0].min(half[1]).min(half[2]));
                half.map(|h| (f64::from(h) / least).next_up())
            }
            _ => [1.0; 3],
        }
    }
}
