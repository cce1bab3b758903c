//! A volume at the corners of a block: columns of ground are looked up once, and a point primitive is summed row by row.
//! The numbers are those of the formula, to the bit.

use super::super::primitive::Primitive;
use super::super::skeleton::Skeleton;
use super::Volume;
use crate::field::{Density, THRESHOLD};
use glam::DVec3;
use terrain_model::falloff::wyvill;

/// Calls `f` with every corner and its slot.
fn each<'a>([xs, ys, zs]: [&[f64]; 3], out: &'a mut [f64], mut f: impl FnMut(DVec3, &'a mut f64)) {
    let mut slots = out.iter_mut();
    for &z in zs {
        for &y in ys {
            for (&x, slot) in xs.iter().zip(&mut slots) {
                f(DVec3::new(x, y, z), slot);
            }
        }
    }
}

/// Fills with `parts` combined from the left.
fn combine(parts: &[Volume], axes: [&[f64]; 3], out: &mut [f64], operator: impl Fn(f64, f64) -> f64) {
    let Some((first, others)) = parts.split_first() else { return out.fill(0.0) };
    first.fill(axes, out);
    if others.is_empty() {
        return;
    }
    // A mesher's groups stay on the stack.
    let (mut small, mut large) = ([0.0; 128], Vec::new());
    let next = match small.get_mut(..out.len()) {
        Some(next) => next,
        None => {
            large.resize(out.len(), 0.0);
            large.as_mut_slice()
        }
    };
    for part in others {
        part.fill(axes, next);
        out.iter_mut().zip(next.iter()).for_each(|(f, g)| *f = operator(*f, *g));
    }
}

fn add(one: &Primitive, axes: [&[f64]; 3], out: &mut [f64]) {
    let Skeleton::Point(centre) = one.skeleton else { return each(axes, out, |p, slot| *slot += one.value(p)) };
    let [xs, ys, zs] = axes;
    let [cx, cy, cz] = centre.map(f64::from);
    let (reach, energy) = (f64::from(one.radius) * f64::from(one.radius), f64::from(one.energy));
    let squared = |x: f64, c: f64| (x - c) * (x - c);
    let mut rows = out.chunks_exact_mut(xs.len());
    for &z in zs {
        let dz = squared(z, cz);
        for (&y, row) in ys.iter().zip(&mut rows) {
            let dy = squared(y, cy);
            if dy + dz >= reach {
                continue;
            }
            for (&x, slot) in xs.iter().zip(row) {
                *slot += energy * wyvill((squared(x, cx) + dy + dz) / reach);
            }
        }
    }
}

impl Volume {
    pub(super) fn fill_block(&self, axes: [&[f64]; 3], out: &mut [f64]) {
        match self {
            Volume::Surface(surface) => {
                let [xs, ys, zs] = axes;
                let layer = xs.len() * ys.len();
                for (j, &y) in ys.iter().enumerate() {
                    for (i, &x) in xs.iter().enumerate() {
                        let column = surface.column([x, y]);
                        for (k, &z) in zs.iter().enumerate() {
                            out[k * layer + j * xs.len() + i] = surface.on_column(column, z);
                        }
                    }
                }
            }
            Volume::Ground(surface, prism) => {
                Volume::Surface(surface.clone()).fill_block(axes, out);
                each(axes, out, |p, f| *f = f.min(prism.density(p.to_array())));
            }
            Volume::Few(primitives) => {
                out.fill(0.0);
                primitives.iter().for_each(|one| add(one, axes, out));
            }
            Volume::Blend(parts) => combine(parts, axes, out, |f, g| f + g),
            Volume::Union(parts) => combine(parts, axes, out, f64::max),
            Volume::Intersection(parts) => combine(parts, axes, out, f64::min),
            Volume::Carve(parts) => combine(parts.as_ref(), axes, out, |f, g| f.min(2.0 * THRESHOLD - g)),
            Volume::Erosion(erosion) => {
                erosion.child.fill(axes, out);
                let mut share = vec![0.0; out.len()];
                erosion.region.fill(axes, &mut share);
                let mut shares = share.into_iter();
                each(axes, out, |p, f| {
                    let share = shares.next().unwrap_or(0.0).clamp(0.0, 1.0);
                    if share > 0.0 {
                        *f -= share * (1.0 - erosion.geology.value(p));
                    }
                });
            }
            Volume::Prism(_) | Volume::Primitives(_) | Volume::Spine(_) | Volume::Warp(_) | Volume::Instance(_) => {
                each(axes, out, |p, slot| *slot = self.value(p));
            }
        }
    }
}
