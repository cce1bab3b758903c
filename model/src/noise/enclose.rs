//! The walker of intervals. In the plane it is a Taylor polynomial. In space it is the hull, over the cells that a box
//! meets, of an enclosure inside each: the natural form, met with the mean-value form about the middle, whose excess shrinks
//! with the square of the box.

use super::corner::{Corner, dot, gradient, value};
use super::hash::Keys;
use super::walk::simplex_base;
use super::{
    GRADIENT2_RANGE, GRADIENT2_SLOPE, GRADIENT3_RANGE, GRADIENT3_SLOPE, Lattice, NoiseJet, NoiseValue, SIMPLEX3_RANGE,
    SIMPLEX3_SLOPE, gradient3, simplex3, taylor,
};
use crate::falloff::fade;
use crate::interval::Interval;
use crate::real::Real;

/// Most cells, or tetrahedron corners, looked at one by one; a larger box gets the global bounds.
const CELLS: i64 = 4;

/// Cells: an enclosure of a wider box would say no more than the bounds over all of the plane.
const WIDE: f64 = 0.35;

/// The fade of an interval in [0, 1] and its derivative. The fade increases, so its ends are its values at the ends.
pub(crate) fn fade_of(t: Interval) -> (Interval, Interval) {
    let at = |x: f64| fade(Interval::point(x)).0;
    (at(t.lo()).hull(at(t.hi())).meet(Interval::UNIT), fade(t).1)
}

/// The box's part in each cell that it meets: `visit(cell index, local box in [0, 1]ᴰ)`. False, with nothing visited,
/// when there are too many cells or the box is not finite.
pub(super) fn for_each_cell<const D: usize>(x: [Interval; D], mut visit: impl FnMut([u32; D], [Interval; D])) -> bool {
    // Beyond 2⁵⁰ the distance to a cell's corner is no longer resolved.
    if !x.iter().all(|x| x.magnitude() < 1.0e15) {
        return false;
    }
    let first = x.map(|x| x.lo().floor() as i64);
    let last = x.map(|x| x.hi().floor() as i64);
    let mut count = 1i64;
    for k in 0..D {
        count = count.saturating_mul(last[k] - first[k] + 1);
    }
    if count > CELLS {
        return false;
    }
    let mut cell = first;
    loop {
        let mut local = x;
        for k in 0..D {
            let t = x[k] - Interval::constant(cell[k] as f64);
            local[k] = Interval::new(t.lo().clamp(0.0, 1.0), t.hi().clamp(0.0, 1.0));
        }
        visit(cell.map(|i| i as u32), local);
        let mut k = 0;
        while k < D {
            cell[k] += 1;
            if cell[k] <= last[k] {
                break;
            }
            cell[k] = first[k];
            k += 1;
        }
        if k == D {
            return true;
        }
    }
}

/// Adds a lattice's base to a cell index.
pub(super) fn based<const D: usize>(lattice: Lattice<D>, mut cell: [u32; D]) -> [u32; D] {
    for (index, base) in cell.iter_mut().zip(lattice.base) {
        *index = index.wrapping_add(base as u32);
    }
    cell
}

/// The mean-value form: the value at the middle plus gradient · (box − middle).
fn about_middle<const D: usize>(
    x: [Interval; D],
    slopes: [Interval; D],
    at: impl Fn([Interval; D]) -> Interval,
) -> Interval {
    let middle = x.map(|x| Interval::point(x.middle()));
    let mut sum = at(middle);
    for k in 0..D {
        sum = sum + slopes[k] * (x[k] - middle[k]);
    }
    sum
}

fn global<const M: usize>(range: f64, slope: f64) -> [Interval; M] {
    let mut jet = [Interval::symmetric(slope); M];
    jet[0] = Interval::symmetric(range);
    jet
}

fn join<const M: usize>(hull: &mut Option<[Interval; M]>, mut jet: [Interval; M], bound: [Interval; M]) {
    for k in 0..M {
        jet[k] = jet[k].meet(bound[k]);
        if let Some(hull) = hull {
            jet[k] = jet[k].hull(hull[k]);
        }
    }
    *hull = Some(jet);
}

/// The corners of a simplex noise whose kernels reach into a box: `visit(hash index, box minus corner)`. False, with
/// nothing visited, when there are too many or the box is not finite.
///
/// No tetrahedron is looked for: a kernel ends on the far faces of the tetrahedra around its corner, so the sum over
/// all corners within reach is the noise.
pub(super) fn for_each_kernel(
    lattice: Lattice<3>,
    x: [Interval; 3],
    mut visit: impl FnMut([u32; 3], [Interval; 3]),
) -> bool {
    if !x.iter().all(|x| x.magnitude() < 1.0e15) {
        return false;
    }
    let c = Interval::constant;
    let cell = x.map(|x| x.lo().floor());
    let mut local = x;
    for k in 0..3 {
        local[k] = x[k] - c(cell[k]);
    }
    let whole = cell.map(|f| f as i64);
    let (base_quotient, base_rest) = simplex_base(lattice.base);
    let sum = whole[0] + whole[1] + whole[2];
    let rest = c((sum.rem_euclid(3) + i64::from(base_rest)) as f64);
    let quotient = (sum.div_euclid(3) as u32).wrapping_add(base_quotient);
    // A kernel of radius √½ spans ±1 in each skewed coordinate, its norm there being √½·‖(4, 1, 1)/3‖ = 1.
    let skew = (local[0] + local[1] + local[2] + rest) / c(3.0);
    let reach = local.map(|x| x + skew + Interval::symmetric(1.0));
    let first = reach.map(|u| u.lo().floor() as i64);
    let last = reach.map(|u| u.hi().ceil() as i64);
    if (0..3).map(|k| (last[k] - first[k] + 1) as f64).product::<f64>() > 64.0 * CELLS as f64 {
        return false;
    }
    for i in first[0]..=last[0] {
        for j in first[1]..=last[1] {
            for k in first[2]..=last[2] {
                let step = [i, j, k];
                let unskew = (rest + c((i + j + k) as f64)) / c(6.0);
                let mut offset = local;
                let mut index = [0u32; 3];
                for a in 0..3 {
                    offset[a] = local[a] - c(step[a] as f64) + unskew;
                    index[a] = (step[a] + whole[a]) as u32;
                    index[a] = index[a].wrapping_add(quotient).wrapping_add(lattice.base[a] as u32);
                }
                let [a, b, e] = offset.map(Real::square);
                if (a + b + e).lo() < simplex3::RADIUS2 {
                    visit(index, offset);
                }
            }
        }
    }
    true
}

impl NoiseJet for Interval {
    fn gradient2_jet(lattice: Lattice<2>, x: [Interval; 2]) -> [Interval; 3] {
        let bound = global(GRADIENT2_RANGE, GRADIENT2_SLOPE);
        // A number that is not below 2⁵⁰, NaN included, has no place in its cell.
        if !(x[0].width().max(x[1].width()) <= WIDE && x[0].magnitude().max(x[1].magnitude()) < 1e15) {
            return bound;
        }
        let mut jet = taylor::enclose(lattice, x);
        for (part, bound) in jet.iter_mut().zip(bound) {
            *part = part.meet(bound);
        }
        jet
    }
    fn gradient3_jet(lattice: Lattice<3>, x: [Interval; 3]) -> [Interval; 4] {
        let bound = global(GRADIENT3_RANGE, GRADIENT3_SLOPE);
        let keys = Keys::new(lattice.seed);
        let mut hull = None;
        let found = for_each_cell(x, |cell, t| {
            let g = keys.cell3(based(lattice, cell)).map(|h| gradient3::edge(h).map(Interval::constant));
            let corners = gradient3::corners(t, t.map(fade_of));
            let slopes = gradient(&corners, &g);
            let natural = value(&corners, &g);
            let mean = about_middle(t, slopes, |m| gradient3::cell(m, &g));
            join(&mut hull, [natural.meet(mean), slopes[0], slopes[1], slopes[2]], bound);
        });
        hull.filter(|_| found).unwrap_or(bound)
    }
    fn simplex3_jet(lattice: Lattice<3>, x: [Interval; 3]) -> [Interval; 4] {
        let bound = global(SIMPLEX3_RANGE, SIMPLEX3_SLOPE);
        let keys = Keys::new(lattice.seed);
        let mut sum = [Interval::ZERO; 4];
        let mut middle = Interval::ZERO;
        let found = for_each_kernel(lattice, x, |[i, j, k], offset| {
            let g = gradient3::edge(keys.point3(i, j, k)).map(Interval::constant);
            let Corner { weight, slope, .. } = simplex3::corner(offset);
            let height = dot(g, offset);
            sum[0] = sum[0] + weight * height;
            for a in 0..3 {
                sum[a + 1] = sum[a + 1] + (slope[a] * height + weight * g[a]);
            }
            let centre = simplex3::corner(offset.map(|d| Interval::point(d.middle())));
            middle = middle + centre.weight * dot(g, centre.offset);
        });
        if !found {
            return bound;
        }
        // The middles of all offsets are those of one point to within rounding: half the width of the box, widened by
        // a relative 2⁻⁴⁰, covers the distance from it.
        let half = x.map(|x| Interval::symmetric(x.width() * 0.5 * (1.0 + 1e-12) + x.magnitude() * 1e-15 + 1e-12));
        let mean = middle + sum[1] * half[0] + sum[2] * half[1] + sum[3] * half[2];
        sum[0] = sum[0].meet(mean);
        let mut hull = None;
        join(&mut hull, sum, bound);
        hull.unwrap_or(bound)
    }
}

impl NoiseValue for Interval {
    fn gradient2(lattice: Lattice<2>, x: [Interval; 2]) -> Interval {
        Self::gradient2_jet(lattice, x)[0]
    }
    fn gradient3(lattice: Lattice<3>, x: [Interval; 3]) -> Interval {
        Self::gradient3_jet(lattice, x)[0]
    }
    fn simplex3(lattice: Lattice<3>, x: [Interval; 3]) -> Interval {
        Self::simplex3_jet(lattice, x)[0]
    }
}
