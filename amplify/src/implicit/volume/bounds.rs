//! Enclosures of a volume over a box, and the volume that is left of it there: parts that are 0 or lose go, so that the rest
//! has the same values, to the bit, in the box.

use super::Volume;
use crate::field::{Box3, Density, DensityBounds, THRESHOLD};
use terrain_model::bounds::plus_up;
use terrain_model::interval::Interval;
use terrain_model::real::Real;

impl Volume {
    /// Encloses f and its slope over `over`; with `keep` also what is left of the tree there, else air.
    pub(super) fn enclose(&self, over: &Box3, keep: bool) -> (DensityBounds, Volume) {
        let itself = |bounds: DensityBounds| (bounds, if keep { self.clone() } else { Volume::AIR });
        match self {
            Volume::Surface(surface) => itself(surface.bounds(over)),
            Volume::Prism(prism) => itself(prism.bounds(over)),
            Volume::Ground(surface, prism) => {
                let (ground, walls) = (surface.bounds(over), prism.bounds(over));
                if ground.range.hi() <= walls.range.lo() {
                    return (ground, if keep { Volume::Surface(surface.clone()) } else { Volume::AIR });
                }
                if walls.range.hi() <= ground.range.lo() {
                    return (walls, if keep { Volume::Prism(prism.clone()) } else { Volume::AIR });
                }
                let range = Real::min(ground.range, walls.range);
                itself(DensityBounds { range, slope: ground.slope.max(walls.slope) })
            }
            Volume::Primitives(index) => {
                let all = index.primitives();
                few(index.among(over).into_iter().map(|k| &all[k as usize]), over, keep)
            }
            Volume::Few(primitives) => few(primitives.iter(), over, keep),
            Volume::Spine(spine) => itself(spine.bounds(over)),
            Volume::Blend(parts) => {
                let mut sum = DensityBounds::ZERO;
                let mut left = Vec::new();
                for part in parts {
                    let (bounds, rest) = part.enclose(over, keep);
                    if bounds == DensityBounds::ZERO {
                        continue;
                    }
                    sum = sum.plus(&bounds);
                    if keep {
                        left.push(rest);
                    }
                }
                (sum, single(left, Volume::Blend))
            }
            Volume::Union(parts) => extreme(parts, over, keep, 1.0),
            Volume::Intersection(parts) => extreme(parts, over, keep, -1.0),
            Volume::Carve(parts) => {
                let [(from, rest), (by, tool)] = [0, 1].map(|k| parts[k].enclose(over, keep));
                let range = Interval::point(2.0 * THRESHOLD) - by.range;
                if from.range.hi() <= range.lo() {
                    return (from, rest);
                }
                let slope = if range.hi() <= from.range.lo() { by.slope } else { from.slope.max(by.slope) };
                (
                    DensityBounds { range: Real::min(from.range, range), slope },
                    if keep { rest.carve(tool) } else { Volume::AIR },
                )
            }
            Volume::Warp(warp) => warp.enclose(over, keep),
            Volume::Erosion(erosion) => erosion.enclose(over, keep),
            Volume::Instance(instance) => instance.enclose(over, keep),
        }
    }
}

/// The only part, or all of them under their operator.
fn single(mut parts: Vec<Volume>, operator: fn(Vec<Volume>) -> Volume) -> Volume {
    if parts.len() == 1 { parts.remove(0) } else { operator(parts) }
}

/// Those of `primitives` whose support may meet the box.
fn few<'a>(primitives: impl Iterator<Item = &'a super::Primitive>, over: &Box3, keep: bool) -> (DensityBounds, Volume) {
    let mut sum = DensityBounds::ZERO;
    let mut left = Vec::new();
    for one in primitives {
        let bounds = one.bounds(over);
        if bounds == DensityBounds::ZERO {
            continue;
        }
        sum = sum.plus(&bounds);
        if keep {
            left.push(*one);
        }
    }
    (sum, if left.is_empty() { Volume::AIR } else { Volume::Few(left.into()) })
}

/// The largest (`sign` 1) or smallest (`sign` −1) of `parts`. A part that is nowhere beyond another's nearest value does not
/// count.
fn extreme(parts: &[Volume], over: &Box3, keep: bool, sign: f64) -> (DensityBounds, Volume) {
    let operator = if sign > 0.0 { Volume::Union } else { Volume::Intersection };
    let mut each: Vec<(DensityBounds, Volume)> = parts.iter().map(|part| part.enclose(over, keep)).collect();
    // How far a part reaches at least and at most, towards the extreme.
    let reach = |range: Interval| if sign > 0.0 { (range.lo(), range.hi()) } else { (-range.hi(), -range.lo()) };
    let certain = each.iter().map(|(bounds, _)| reach(bounds.range).0).fold(f64::NEG_INFINITY, f64::max);
    let holder = each.iter().position(|(bounds, _)| reach(bounds.range).0 >= certain);
    let mut at = 0;
    each.retain(|(bounds, _)| {
        let kept = reach(bounds.range).1 > certain || holder == Some(at);
        at += 1;
        kept
    });
    let Some(first) = each.first() else { return (DensityBounds::ZERO, Volume::AIR) };
    let (mut low, mut high, mut slope) = (first.0.range.lo(), first.0.range.hi(), 0.0f64);
    for (bounds, _) in &each {
        let pick = if sign > 0.0 { f64::max } else { f64::min };
        (low, high) = (pick(low, bounds.range.lo()), pick(high, bounds.range.hi()));
        slope = slope.max(bounds.slope);
    }
    let rest = if keep { single(each.into_iter().map(|(_, rest)| rest).collect(), operator) } else { Volume::AIR };
    (DensityBounds { range: Interval::new(low, high), slope }, rest)
}

impl DensityBounds {
    /// Of a sum.
    #[must_use]
    pub fn plus(&self, other: &DensityBounds) -> DensityBounds {
        DensityBounds { range: self.range + other.range, slope: plus_up(self.slope, other.slope) }
    }
}
