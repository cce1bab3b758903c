//! The tree ready to evaluate: every node's formula once over any number type, and its Lipschitz constant.

use super::noise::{Turbulence, fold_slope};
use glam::DVec3;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill};
use terrain_model::noise::NoiseValue;
use terrain_model::real::{Mask, Real};

#[derive(Clone, Debug)]
pub(super) enum Rock {
    Constant(f64),
    Strata(Turbulence),
    Turbulence(Turbulence),
    /// `normal` is a unit vector; `sheet` is (1 − roughness) · resistance.
    Plane {
        point: DVec3,
        normal: DVec3,
        radius: f64,
        sheet: f64,
        roughness: f64,
        noise: Turbulence,
    },
    /// Weights sum to 1.
    Blend(Vec<(f64, Rock)>),
    Change(Box<Rock>, Vec<Polyline>),
    /// `amplitude` is that of one channel, 1/√3 of the whole.
    Fold {
        amplitude: f64,
        noise: Box<[Turbulence; 3]>,
        child: Box<Rock>,
    },
    Taper {
        centre: DVec3,
        radius: f64,
        height: f64,
        compression: f64,
        child: Box<Rock>,
    },
    Fault {
        point: DVec3,
        normal: DVec3,
        translation: DVec3,
        child: Box<Rock>,
        against: Option<Box<Rock>>,
    },
}

/// A local change around a polyline; a sphere is one point.
#[derive(Clone, Debug)]
pub(super) struct Polyline {
    pub(super) points: Vec<DVec3>,
    pub(super) radius: f64,
    pub(super) change: f64,
}

/// Upper bound of u(1 − u²)³, at u² = 1/7.
pub(super) const TAPER_REACH: f64 = 0.2381;

impl Rock {
    /// ρ at `p`. `torn` becomes true where an enclosure meets both sides of a fault.
    pub(super) fn resistance<R: NoiseValue>(&self, p: [R; 3], torn: &mut bool) -> R {
        let c = R::constant;
        match self {
            Rock::Constant(value) => c(*value),
            Rock::Strata(noise) => noise.unit([R::zero(), R::zero(), p[2]]),
            Rock::Turbulence(noise) => noise.unit(p),
            Rock::Plane { point, normal, radius, sheet, roughness, noise } => {
                // Squared, so that both sides of the plane fall off.
                let u = (along(p, *point, *normal) / c(*radius)).square();
                c(*sheet) * wyvill(u) + c(*roughness) * noise.unit(p)
            }
            Rock::Blend(parts) => {
                let add = |sum: R, (weight, rock): &(f64, Rock)| sum + c(*weight) * rock.resistance(p, torn);
                parts.iter().fold(R::zero(), add)
            }
            Rock::Change(child, changes) => {
                let rho = child.resistance(p, torn);
                changes.iter().fold(rho, |sum, change| sum + change.at(p)).clamp01()
            }
            Rock::Fold { amplitude, noise, child } => {
                let q = std::array::from_fn(|k| p[k] + c(*amplitude) * noise[k].signed(p));
                child.resistance(q, torn)
            }
            Rock::Taper { centre, radius, height, compression, child } => {
                let [x, y, z] = offset(p, *centre);
                let across = wyvill((x.square() + y.square()) / c(radius * radius));
                let shift = c(*compression) * z * wyvill((z / c(*height)).square()) * across;
                child.resistance([p[0], p[1], p[2] + shift], torn)
            }
            Rock::Fault { point, normal, translation, child, against } => {
                let inside = R::zero().less(along(p, *point, *normal));
                let moved = offset(p, *translation);
                let still = against.as_ref().unwrap_or(child);
                if inside.must_hold() {
                    return child.resistance(moved, torn);
                } else if !inside.may_hold() {
                    return still.resistance(p, torn);
                }
                *torn = true;
                R::select(inside, child.resistance(moved, torn), still.resistance(p, torn))
            }
        }
    }

    /// A Lipschitz constant of ρ, 1/metre, infinite where a fault may jump. Sums add, a warp multiplies by its own
    /// constant, a falloff of a 1-Lipschitz distance has sup|g′|/radius, clamping adds nothing.
    pub(super) fn slope(&self) -> f64 {
        match self {
            Rock::Constant(_) => 0.0,
            Rock::Strata(noise) | Rock::Turbulence(noise) => 0.5 * noise.slope,
            Rock::Plane { radius, sheet, roughness, noise, .. } => {
                sheet * WYVILL_SLOPE / radius + roughness * 0.5 * noise.slope
            }
            Rock::Blend(parts) => parts.iter().map(|(weight, rock)| weight * rock.slope()).sum(),
            Rock::Change(child, changes) => {
                child.slope() + changes.iter().map(|c| c.change.abs() * WYVILL_SLOPE / c.radius).sum::<f64>()
            }
            Rock::Fold { amplitude, noise, child } => child.slope() * (1.0 + fold_slope(*amplitude, noise)),
            // The shift s = k·u·g·g has |∂s/∂z| ≤ |k| and a horizontal slope of at most |k|·height·sup u(1 − u²)³·sup|g′|/radius.
            Rock::Taper { radius, height, compression, child, .. } => {
                let across = TAPER_REACH * height * WYVILL_SLOPE / radius;
                child.slope() * (1.0 + compression.abs() * (1.0 + across * across).sqrt())
            }
            Rock::Fault { child, against, .. } => {
                if against.is_none() && child.slope() == 0.0 {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
        }
    }
}

impl Polyline {
    /// change · g(d/radius).
    fn at<R: Real>(&self, p: [R; 3]) -> R {
        let mut nearest = squared(offset(p, self.points[0]));
        for ends in self.points.windows(2) {
            let axis = ends[1] - ends[0];
            let t = (along(p, ends[0], axis) / R::constant(axis.length_squared())).clamp01();
            let from = offset(p, ends[0]);
            let rest = std::array::from_fn(|k| from[k] - t * R::constant(axis[k]));
            nearest = nearest.min(squared(rest));
        }
        R::constant(self.change) * wyvill(nearest / R::constant(self.radius * self.radius))
    }
}

fn offset<R: Real>(p: [R; 3], from: DVec3) -> [R; 3] {
    std::array::from_fn(|k| p[k] - R::constant(from[k]))
}
fn squared<R: Real>([x, y, z]: [R; 3]) -> R {
    x.square() + y.square() + z.square()
}
/// (p − from)·axis
fn along<R: Real>(p: [R; 3], from: DVec3, axis: DVec3) -> R {
    let [x, y, z] = offset(p, from);
    x * R::constant(axis.x) + y * R::constant(axis.y) + z * R::constant(axis.z)
}
