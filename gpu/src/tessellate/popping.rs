//! What jumps between two frames. Both surfaces are compared where they have the same integers, over the common refinement of their
//! triangles, and both are seen from the second camera: what the camera's own motion does is not in it.
//!
//! **What bounds a jump.** A vertex m of the finer mesh lies in a triangle of the coarser one with corners pᵢ and shares wᵢ. The
//! surface S there has slopes within ±ρ of some C over the triangle, by intervals. Since S(pᵢ) − S(m) = Gᵢ(pᵢ − m) with Gᵢ in C ± ρ,
//! Σ wᵢ S(pᵢ) − S(m) = C·Σ wᵢ(pᵢ − m) + Σ wᵢ(Gᵢ − C)(pᵢ − m): the first is 0 but where the raster's border cuts the triangle, the
//! second at most Σ wᵢ ρ|pᵢ − m|. To this comes what the band limit of the other camera changes at m. The slopes vary by less the
//! smaller the triangle is, because octaves with waves shorter than two of its edges have faded; without that they would not.

use super::refine::Refinement;
use super::triangle::{LATTICE, SIDE, Triangle, Vertex};
use super::view::{View, dot};
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// A point of the surface in two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// How far it is moved on the screen of the second camera.
    pub pixels: f64,
    /// The most it may be.
    pub bound: f64,
    /// Did its triangles change, or the band limit alone?
    pub switched: bool,
}

/// Slopes are enclosed over triangles of up to so many cells; over larger ones heights are.
const CELLS: u32 = 16;
/// Of what is computed in `f64` from coordinates of up to 10⁷ m, metres.
const ROUNDING: f64 = 1e-7;

/// What the surface does over a box of the plane.
#[derive(Clone, Copy)]
enum Variation {
    /// Derivatives of position along the coordinates in a cell.
    Slopes([[Interval; 2]; 3]),
    /// How far apart two points are beside the plane's own coordinates, metres.
    Extent([f64; 3]),
}

/// Calls `visit` with each vertex of the common refinement of two frames that is in the image of the second; one on a border of leaves
/// comes with each of them. Points that something nearer hides are among them. `promised` are the refinements that bounds are of:
/// those of the frames themselves, unless a control breaks them.
pub fn jumps(frames: [&Refinement<'_>; 2], promised: [&Refinement<'_>; 2], mut visit: impl FnMut(Jump)) {
    let view = frames[1].view();
    let mut list: Vec<(Triangle, [Option<Triangle>; 2])> = Triangle::ROOTS.map(|root| (root, [None; 2])).to_vec();
    while let Some((triangle, mut leaves)) = list.pop() {
        // The box of the second frame holds the first frame's surface too: enclosures do not depend on the camera.
        if frames[1].ground().beyond(&triangle) || frames[1].hidden(&triangle) {
            continue;
        }
        for k in 0..2 {
            if leaves[k].is_none() && !frames[k].splits(&triangle) {
                leaves[k] = Some(triangle);
            }
        }
        let [Some(before), Some(after)] = leaves else {
            list.extend(triangle.children().map(|child| (child, leaves)));
            continue;
        };
        let switched = before != after;
        let mut sides = [(frames[0], before), (frames[1], after)].map(|(refinement, leaf)| Side::new(refinement, leaf));
        let mut coarse = if before.level < after.level { 0 } else { 1 };
        if !switched {
            coarse = 1;
        }
        let mut known: Vec<(Triangle, Variation)> = Vec::new();
        for vertex in vertices(&triangle) {
            let [(from, _), (to, _)] = sides.each_mut().map(|side| side.at(vertex));
            if !view.sees(to) {
                continue;
            }
            let mut off = [promised[0].change(promised[1], vertex); 3];
            let (_, inside) = sides[coarse].at(vertex);
            if let Some((triangle, shares)) = inside {
                let variation = match known.iter().find(|(other, _)| *other == triangle) {
                    Some((_, variation)) => *variation,
                    None => {
                        let variation = promised[coarse].variation(&triangle);
                        known.push((triangle, variation));
                        variation
                    }
                };
                let deviation = promised[coarse].deviation(&triangle, shares, vertex, variation);
                off = [0, 1, 2].map(|axis| off[axis] + deviation[axis]);
            }
            visit(Jump { pixels: apart(view, from, to), bound: reach(view, to, off), switched });
        }
    }
}

/// One of the two meshes over a leaf.
struct Side<'a> {
    refinement: &'a Refinement<'a>,
    leaf: Triangle,
    known: Vec<(Vertex, [f64; 3])>,
}

/// A triangle of a mesh and the shares of its corners.
type Within = Option<(Triangle, [f64; 3])>;

impl<'a> Side<'a> {
    fn new(refinement: &'a Refinement<'a>, leaf: Triangle) -> Side<'a> {
        Side { refinement, leaf, known: Vec::with_capacity(15) }
    }
    fn corner(&mut self, vertex: Vertex) -> [f64; 3] {
        if let Some((_, p)) = self.known.iter().find(|(other, _)| *other == vertex) {
            return *p;
        }
        let p = self.refinement.position(vertex);
        self.known.push((vertex, p));
        p
    }
    /// The mesh at `vertex`; with the triangle that it lies in if it is no corner.
    fn at(&mut self, vertex: Vertex) -> ([f64; 3], Within) {
        let triangle = self.leaf.down_to(vertex, LATTICE);
        let corners = triangle.corners();
        if corners.contains(&vertex) {
            return (self.corner(vertex), None);
        }
        let (shares, points) = (triangle.shares(vertex), corners.map(|corner| self.corner(corner)));
        let mean = |axis: usize| (0..3).map(|k| shares[k] * points[k][axis]).sum();
        ([0, 1, 2].map(mean), Some((triangle, shares)))
    }
}

/// The 15 vertices of a leaf's lattice.
fn vertices(leaf: &Triangle) -> Vec<Vertex> {
    let mut all: Vec<Vertex> = leaf.lattice(LATTICE).iter().flat_map(Triangle::corners).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Pixels between the images of two points.
fn apart(view: &View, p: [f64; 3], q: [f64; 3]) -> f64 {
    let [p, q] = [p, q].map(|p| {
        let [x, y, z] = seen(view, p);
        if z > 0.0 { [x / z, y / z] } else { [f64::INFINITY; 2] }
    });
    view.focal * ((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])).sqrt()
}

/// The most pixels from the image of `p` to that of a point within ±`off` of it. With t the tangent of the angle off the axis, b the
/// length of `off` and z the depth, |x′/z′ − x/z| ≤ (|x′ − x| + t|z′ − z|)/z′ ≤ b(1 + t)/(z − b).
fn reach(view: &View, p: [f64; 3], off: [f64; 3]) -> f64 {
    let ([x, y, z], b) = (seen(view, p), dot(off, off).sqrt() + ROUNDING);
    let tangent = (x * x + y * y).sqrt() / z;
    if z > b { view.focal * b * (1.0 + tangent) / (z - b) } else { f64::INFINITY }
}

fn seen(view: &View, p: [f64; 3]) -> [f64; 3] {
    view.axes.map(|axis| dot(axis, [0, 1, 2].map(|k| p[k] - view.eye[k])))
}

impl Refinement<'_> {
    /// How far the band limit of `other` moves `vertex` at most, metres.
    fn change(&self, other: &Refinement<'_>, vertex: Vertex) -> f64 {
        self.detail().change([self.size(vertex), other.size(vertex)])
    }
    /// Over the box of `triangle`, cut to the raster.
    fn variation(&self, triangle: &Triangle) -> Variation {
        let ground = self.ground();
        let corners = triangle.corners().map(|corner| ground.within(corner));
        let unit = SIDE / ground.cells() as u32;
        let pick = |of: fn(u32, u32) -> u32| [0, 1].map(|k| of(of(corners[0][k], corners[1][k]), corners[2][k]));
        let [low, high] = [pick(u32::min), pick(u32::max)];
        let inside = ground.inside().map(|cells| cells as u32 - 1);
        let first = [0, 1].map(|k| (low[k] / unit).min(inside[k]));
        let last = [0, 1].map(|k| (high[k].div_ceil(unit).max(1) - 1).clamp(first[k], inside[k]));
        if (last[0] - first[0] + 1) * (last[1] - first[1] + 1) > CELLS {
            return Variation::Extent(self.extent(low, high));
        }
        let mut whole: Option<[[Interval; 2]; 3]> = None;
        for j in first[1]..=last[1] {
            for i in first[0]..=last[0] {
                let share = [(0, i), (1, j)].map(|(k, cell)| {
                    let at = |x: u32| (f64::from(x.saturating_sub(cell * unit)) / f64::from(unit)).min(1.0);
                    Dual::<Interval, 2>::variable(Interval::new(at(low[k]), at(high[k])), k)
                });
                let slopes = self.slopes([i as usize, j as usize], share);
                let hull = |other: [[Interval; 2]; 3]| {
                    [0, 1, 2].map(|axis| [0, 1].map(|k| slopes[axis][k].hull(other[axis][k])))
                };
                whole = Some(whole.map_or(slopes, hull));
            }
        }
        whole.map_or(Variation::Extent([f64::INFINITY; 3]), Variation::Slopes)
    }
    /// Derivatives of the displaced surface, with the band limit that the camera asks for at each place.
    fn slopes(&self, cell: [usize; 2], share: [Dual<Interval, 2>; 2]) -> [[Interval; 2]; 3] {
        let (ground, view) = (self.ground(), self.view());
        let on = ground.smooth_at(&ground.place(cell, share));
        let away = [0, 1, 2].map(|k| on.position[k] - Dual::constant(view.eye[k]));
        let distance = (away[0].square() + away[1].square() + away[2].square()).sqrt();
        let size = distance * Dual::constant(self.target() / view.focal);
        self.detail().moved(&on, size).map(|x| x.slope)
    }
    /// Heights span what their enclosure does, other coordinates are moved both ways; with the noise where an octave may be left.
    fn extent(&self, low: Vertex, high: Vertex) -> [f64; 3] {
        let middle = [0, 1].map(|k| low[k].midpoint(high[k]));
        let reach = i64::from((high[0] - low[0]).max(high[1] - low[1]).div_ceil(2));
        let block = self.ground().enclosure(middle, reach);
        let wide = self.detail().widen(block);
        let corners = [low, high].map(|vertex| self.ground().metres(vertex));
        let eye = self.view().eye;
        let off = |k: usize| {
            let [from, to] = [corners[0][k] - wide.moved, corners[1][k] + wide.moved];
            (from - eye[k]).max(eye[k] - to).max(0.0)
        };
        let z = (wide.elevation[0] - eye[2]).max(eye[2] - wide.elevation[1]).max(0.0);
        let nearest = (off(0) * off(0) + off(1) * off(1) + z * z).sqrt();
        let size = self.target() * nearest / self.view().focal;
        let block = if self.detail().alive(size) { wide } else { block };
        [2.0 * block.moved, 2.0 * block.moved, block.elevation[1] - block.elevation[0]]
    }
    /// How far linear interpolation over `triangle` may be from the surface at `vertex`, along each axis, metres.
    fn deviation(&self, triangle: &Triangle, shares: [f64; 3], vertex: Vertex, variation: Variation) -> [f64; 3] {
        let ground = self.ground();
        let unit = f64::from(SIDE / ground.cells() as u32);
        let place = |vertex: Vertex| ground.within(vertex).map(|x| f64::from(x) / unit);
        let (m, corners) = (place(vertex), triangle.corners().map(place));
        let off = |k: usize| corners.map(|corner| corner[k] - m[k]);
        let sum = |k: usize, of: fn(f64) -> f64| (0..3).map(|i| shares[i] * of(off(k)[i])).sum::<f64>();
        let (net, all) = ([0, 1].map(|k| sum(k, |x| x).abs()), [0, 1].map(|k| sum(k, f64::abs)));
        match variation {
            Variation::Slopes(slopes) => slopes.map(|slope| {
                (0..2).map(|k| slope[k].magnitude() * net[k] + 0.5 * slope[k].width() * all[k]).sum::<f64>()
            }),
            Variation::Extent(extent) => {
                let [x, y] = [0, 1].map(|k| net[k] * ground.spacing()[k]);
                [extent[0] + x, extent[1] + y, extent[2]]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::displace::{Detail, Space};
    use crate::tessellate::ground::Ground;
    use crate::tessellate::tests::{camera, detail, detail_of, partial};
    use terrain_model::grid::Grid;
    use terrain_model::noise::Octaves;

    /// A smooth hill.
    fn hill() -> Ground {
        let elevation = |at: usize| {
            let [x, y] = [at % 65, at / 65].map(|i| i as f64 - 30.0);
            400.0 / (1.0 + 0.005 * (x * x + y * y))
        };
        let grid = Grid::new([0.0; 2].into(), [20.0; 2].into(), 65, 65, (0..65 * 65).map(elevation).collect()).unwrap();
        Ground::new(&grid, 0.6).unwrap()
    }

    #[test]
    fn no_point_jumps_farther_than_its_bound_and_detail_without_a_band_limit_jumps_farther() {
        let octaves = Octaves { octaves: 6, frequency: 0.02, lacunarity: 2.0, gain: 0.8, amplitude: 12.0 };
        let fine = Detail::new(&octaves, 3, Space::Volume).unwrap();
        for (ground, detail, smooth) in [(partial(), detail(), false), (hill(), fine, true)] {
            let (mut seen, mut switched, mut largest, mut most, mut beyond) = (0, 0, [0.0f64; 2], 0.0f64, 0);
            for k in 0..6 {
                let from = camera(&ground, k);
                let mut to = from;
                (0..3).for_each(|axis| to.eye[axis] += 3.0 * from.axes[2][axis]);
                let frames = [from, to].map(|view| Refinement::new(&ground, &detail, view, 24.0, 22));
                let promised = [&frames[0], &frames[1]];
                jumps(promised, promised, |jump| {
                    seen += 1;
                    switched += usize::from(jump.switched);
                    assert!(jump.pixels <= jump.bound, "camera {k}: {jump:?}");
                    largest[0] = largest[0].max(jump.pixels);
                    most = most.max(jump.bound);
                });
                // The same triangles, and octaves that are finer than they are.
                let control = [0, 1].map(|i| {
                    let mut control = Refinement::new(&ground, &detail, *frames[i].view(), 1e-3, 22);
                    control.radii_mut().copy_from_slice(frames[i].radii());
                    control
                });
                jumps([&control[0], &control[1]], promised, |jump| largest[1] = largest[1].max(jump.pixels));
                // Bounds of the ground without detail are none of the ground with it.
                let bare = detail_of(0.0);
                let bare = [from, to].map(|view| Refinement::new(&ground, &bare, view, 24.0, 22));
                jumps(promised, [&bare[0], &bare[1]], |jump| beyond += usize::from(jump.pixels > jump.bound));
            }
            eprintln!("{switched} of {seen} switched, {largest:?} of {most} pixels, {beyond} of the control beyond");
            assert!(switched > 200 && largest[0] > 0.3 && beyond > 100);
            assert!(!smooth || largest[1] > 2.0 * largest[0]);
        }
    }
}
