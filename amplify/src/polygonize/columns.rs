//! The paper's own bounded polygonisation (Paris 2019 §7, Fig 22), kept beside ours for comparison: a walk of the tree gives
//! each column of cubes the elevations between which the surface may lie, the ranges are dilated over the ring of
//! neighbours, and where nothing but the ground is above a corner, the vertex is the elevation itself.

use super::pieces::key;
use super::root::bracket;
use super::table::{EDGES, TRIANGLES};
use super::{PolygonizeError, Polygonizer, Report};
use crate::field::{Box3, Density, THRESHOLD};
use crate::implicit::surface::Surface;
use crate::implicit::volume::Volume;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use terrain_model::interval::Interval;
use terrain_model::mesh::Mesh;

/// How far the bounds of columns follow the operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// As printed: the union of the children's bounds at every operator. Warps and erosion are missed (claims P19).
    Printed,
    /// A warp widens the bounds by its displacement, erosion by its region; and a column that either of them acts on is
    /// not bare ground.
    Repaired,
}

/// Between which elevations the surface may lie in a column, and whether nothing but the ground is there (n(p) = 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// None: nothing is there.
    pub range: Option<Interval>,
    /// Only the ground.
    pub bare: bool,
}

const NOTHING: Column = Column { range: None, bare: true };

impl Column {
    /// Both together; not bare when both hold something.
    fn with(self, other: Column) -> Column {
        match (self.range, other.range) {
            (Some(a), Some(b)) => Column { range: Some(a.hull(b)), bare: false },
            (Some(_), None) => self,
            (None, _) => other,
        }
    }
}

/// The column of `volume` over the box `over`, of which only x and y count.
pub fn column(volume: &Volume, over: &Box3, reach: Reach) -> Column {
    let boxed = |support: &Box3| {
        let across = (0..2).all(|k| support.low[k] <= over.high[k] && over.low[k] <= support.high[k]);
        if across && !support.is_empty() {
            Column { range: Some(Interval::new(support.low.z, support.high.z)), bare: false }
        } else {
            NOTHING
        }
    };
    let all = |parts: &[Volume]| parts.iter().fold(NOTHING, |sum, part| sum.with(column(part, over, reach)));
    match volume {
        Volume::Surface(surface) | Volume::Ground(surface, _) => {
            Column { range: Some(surface.elevations_over(over)), bare: true }
        }
        // The paper bounds the surface; floor and walls are made apart.
        Volume::Prism(_) => NOTHING,
        Volume::Primitives(index) => {
            let tall = Box3 { low: over.low.with_z(f64::NEG_INFINITY), high: over.high.with_z(f64::INFINITY) };
            let near = index.among(&tall);
            near.iter().fold(NOTHING, |sum, &k| sum.with(boxed(&index.primitives()[k as usize].support())))
        }
        Volume::Few(primitives) => primitives.iter().fold(NOTHING, |sum, one| sum.with(boxed(&one.support()))),
        Volume::Spine(spine) => boxed(&spine.support()),
        Volume::Blend(parts) | Volume::Union(parts) | Volume::Intersection(parts) => all(parts),
        Volume::Carve(parts) => all(parts.as_ref()),
        Volume::Instance(instance) => boxed(&instance.support()),
        Volume::Warp(warp) => {
            let child = column(&warp.child, over, reach);
            let region = column(&warp.region, over, reach);
            match (reach, child.range, region.range) {
                (Reach::Repaired, Some(range), Some(_)) => {
                    let far = warp.reach();
                    // What comes in from the sides as well.
                    let side = DVec3::new(far, far, 0.0);
                    let wide = column(&warp.child, &Box3 { low: over.low - side, high: over.high + side }, reach);
                    let range = range.hull(wide.range.unwrap_or(range)) + Interval::symmetric(far);
                    Column { range: Some(range), bare: false }
                }
                _ => child,
            }
        }
        Volume::Erosion(erosion) => {
            let child = column(&erosion.child, over, reach);
            match reach {
                Reach::Printed => child,
                Reach::Repaired => child.with(column(&erosion.region, over, reach)),
            }
        }
    }
}

/// The ground of a tree, copies aside.
fn ground(volume: &Volume) -> Option<&Surface> {
    match volume {
        Volume::Surface(surface) | Volume::Ground(surface, _) => Some(surface),
        Volume::Blend(parts) | Volume::Union(parts) | Volume::Intersection(parts) => parts.iter().find_map(ground),
        Volume::Carve(parts) => parts.iter().find_map(ground),
        Volume::Warp(warp) => ground(&warp.child),
        Volume::Erosion(erosion) => ground(&erosion.child),
        _ => None,
    }
}

/// The values at one column of corners, from layer `first` up.
struct Values {
    first: usize,
    of: Vec<f64>,
    bare: bool,
}

/// What a row of cubes gives.
type Row = (Vec<(u64, DVec3)>, Vec<[u64; 3]>, u64);

impl Polygonizer<'_, Volume> {
    /// Marching cubes within the dilated bounds of columns. Cubes outside are not looked at, so a surface that leaves the
    /// bounds has holes, as have the walls below and above them; the lattice's border counts as air as ever.
    ///
    /// # Errors
    /// [`PolygonizeError::TooMany`] above 2³² − 1 vertices.
    pub fn columns(&self, reach: Reach) -> Result<(Mesh, Report), PolygonizeError> {
        let [nx, ny, nz] = self.lattice.cells();
        let over = |x: usize, y: usize| self.lattice.region([x, y, 0], [x + 1, y + 1, nz]);
        let each: Vec<Column> =
            (0..nx * ny).into_par_iter().map(|k| column(self.field, &over(k % nx, k / nx), reach)).collect();
        // The hull over a ring of neighbours; bare where all are.
        let hull = |xs: Range<usize>, ys: Range<usize>| {
            let mut sum: Option<(Interval, bool)> = None;
            for next in ys.flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| each[y * nx + x]) {
                let Some(range) = next.range else { continue };
                sum = Some(sum.map_or((range, next.bare), |(all, bare)| (all.hull(range), bare && next.bare)));
            }
            sum
        };
        let layers = |range: Interval| {
            let low = self.lattice.corner([0; 3]).z;
            let layer = |z: f64| ((z - low) / self.lattice.spacing()).floor();
            let from = (layer(range.lo()) - 1.0).clamp(0.0, nz as f64) as usize;
            from..((layer(range.hi()) + 2.0).clamp(0.0, nz as f64) as usize)
        };
        // Claims P20: the bounds of two columns at a common side meet once both hold those of their neighbours.
        let cubes: Vec<Range<usize>> = (0..nx * ny)
            .into_par_iter()
            .map(|k| {
                let (x, y) = (k % nx, k / nx);
                let range = hull(x.saturating_sub(1)..(x + 2).min(nx), y.saturating_sub(1)..(y + 2).min(ny));
                range.map_or(0..0, |(range, _)| layers(range))
            })
            .collect();
        let ground = ground(self.field);
        let corners: Vec<Values> = (0..(nx + 1) * (ny + 1))
            .into_par_iter()
            .map(|k| {
                let (x, y) = (k % (nx + 1), k / (nx + 1));
                let (xs, ys) = (x.saturating_sub(1)..(x + 1).min(nx), y.saturating_sub(1)..(y + 1).min(ny));
                let bare = hull(xs.clone(), ys.clone()).is_none_or(|(_, bare)| bare);
                let used = ys.flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| &cubes[y * nx + x]);
                let used =
                    used.filter(|z| !z.is_empty()).fold((usize::MAX, 0), |(a, b), z| (a.min(z.start), b.max(z.end)));
                if used.0 > used.1 {
                    return Values { first: 0, of: Vec::new(), bare };
                }
                let p = self.lattice.corner([x, y, 0]);
                let bare_ground = ground.filter(|_| bare).map(|surface| (surface, surface.column([p.x, p.y])));
                let value = |z: usize| match bare_ground {
                    _ if self.lattice.on_border([x, y, z]) => 0.0,
                    Some((surface, column)) => surface.on_column(column, self.lattice.coordinate(2, z, 0.0)),
                    None => self.corner([x, y, z]),
                };
                Values { first: used.0, of: (used.0..=used.1).map(value).collect(), bare: bare_ground.is_some() }
            })
            .collect();
        let rows: Vec<Row> = (0..ny)
            .into_par_iter()
            .map(|y| {
                let mut row = (Vec::new(), Vec::new(), 0);
                for x in 0..nx {
                    cubes[y * nx + x].clone().for_each(|z| self.cube([x, y, z], &corners, &mut row));
                }
                row
            })
            .collect();
        let mut report = Report::default();
        for values in &corners {
            if values.bare {
                report.lookups += 1;
            } else {
                report.corner_evaluations += values.of.len() as u64;
            }
        }
        report.cells = cubes.iter().map(|z| z.len() as u64).sum();
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (some, more, values) in rows {
            vertices.extend(some);
            triangles.extend(more);
            report.root_evaluations += values;
        }
        if u32::try_from(vertices.len()).is_err() {
            return Err(PolygonizeError::TooMany { vertices: vertices.len() });
        }
        vertices.par_sort_unstable_by_key(|vertex: &(u64, DVec3)| vertex.0);
        let number = |edge: u64| vertices.binary_search_by_key(&edge, |vertex| vertex.0).ok().map(|k| k as u32);
        let mut mesh = Mesh { positions: vertices.iter().map(|v| v.1.to_array()).collect(), ..Mesh::default() };
        // A corner on an edge of a cube that was not looked at leaves a hole.
        for edges in triangles {
            if let [Some(a), Some(b), Some(c)] = edges.map(number) {
                mesh.triangles.push([a, b, c]);
            }
        }
        Ok((mesh.with_normals(), report))
    }

    fn cube(&self, at: [usize; 3], corners: &[Values], row: &mut Row) {
        let across = self.lattice.cells()[0] + 1;
        let values = |c: usize| &corners[(at[1] + (c >> 1 & 1)) * across + at[0] + (c & 1)];
        let value = |c: usize| values(c).of[at[2] + (c >> 2) - values(c).first];
        let rock = (0..8).fold(0, |all, c| all | usize::from(value(c) > THRESHOLD) << c);
        if rock == 0 || rock == 255 {
            return;
        }
        for axis in 0..3 {
            let other = 1 << axis;
            if (rock ^ (rock >> other)) & 1 == 1 {
                let ends = [value(0), value(other)];
                let share = if values(0).bare && values(other).bare {
                    ((THRESHOLD - ends[0]) / (ends[1] - ends[0])).clamp(0.0, 1.0)
                } else {
                    let width = self.tolerance / self.lattice.spacing();
                    let root = bracket(ends, width, |share| self.field.value(self.lattice.on_edge(at, axis, share)));
                    row.2 += root.values;
                    root.share
                };
                row.0.push((key(at, axis), self.lattice.on_edge(at, axis, share)));
            }
        }
        let edge = |e: u8| {
            let (e, low) = (usize::from(e), EDGES[usize::from(e)][0]);
            key([at[0] + (low & 1), at[1] + (low >> 1 & 1), at[2] + (low >> 2)], e / 4)
        };
        row.1.extend(TRIANGLES[rock].iter().map(|t| t.map(edge)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::Census;
    use super::*;
    use crate::implicit::heightfield::tests::ground;
    use crate::implicit::primitive::Primitive;
    use crate::implicit::sigmoid::Sigmoid;
    use crate::implicit::skeleton::Skeleton;
    use crate::implicit::volume::Warp;
    use crate::polygonize::Lattice;
    use std::sync::Arc;

    fn point(at: [f32; 3], radius: f32, energy: f32) -> Primitive {
        Primitive { skeleton: Skeleton::Point(at), radius, energy }
    }

    fn around(p: &[f64; 3]) -> bool {
        (112.0..152.0).contains(&p[0]) && (-6.0..40.0).contains(&p[1])
    }

    /// Vertices off the surface, and holes, within the walls.
    fn wrong(mesher: &Polygonizer<'_, Volume>, mesh: &Mesh) -> (usize, u64) {
        let alone: Vec<[f64; 3]> = mesh.positions.iter().copied().filter(around).collect();
        let off = mesher.unproved_vertices(&Mesh { positions: alone, ..Mesh::default() });
        let inner = mesh.triangles.iter().filter(|t| t.iter().all(|&k| around(&mesh.positions[k as usize])));
        let mut sides: Vec<[u32; 2]> = Vec::new();
        for t in inner {
            sides.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]));
        }
        sides.sort_unstable();
        let inside = |p: &[f64; 3]| (114.0..150.0).contains(&p[0]) && (-4.0..38.0).contains(&p[1]);
        let open = sides.chunk_by(|a, b| a == b).filter(|side| side.len() == 1);
        let torn = open.filter(|side| side[0].iter().all(|&k| inside(&mesh.positions[k as usize])));
        (torn.count(), off)
    }

    #[test]
    fn without_a_warp_the_papers_bounds_hold_the_surface() {
        let all = vec![point([130.0, 10.0, 0.0], 9.0, -0.9), point([135.0, 12.0, 3.0], 6.0, 0.8)];
        let volume = Volume::terrain(ground(Sigmoid::UnitFree, 3.0), all).unwrap();
        let lattice = Lattice::over(&volume.support(), 1.0).unwrap();
        let mesher = Polygonizer::new(&volume, lattice, 0.05).unwrap();
        let (mesh, report) = mesher.columns(Reach::Printed).unwrap();
        assert_eq!(wrong(&mesher, &mesh).0, 0);
        assert!(Census::of(&mesh).non_manifold_edges == 0);
        let (_, whole) = mesher.standard().unwrap();
        assert!(report.evaluations() * 8 < whole.evaluations() && report.lookups > 0, "{report:?} {whole:?}");
    }

    /// Claims P19: a warp takes the surface out of the printed bounds, and its vertices off the surface; widened bounds
    /// hold it.
    #[test]
    fn a_warp_tears_the_printed_bounds() {
        let region = Volume::Few([point([132.0, 16.0, 0.0], 26.0, 1.0)].into());
        let warp = Warp::new(ground(Sigmoid::UnitFree, 3.0), region, 9.0, 24.0, 2, 7).unwrap();
        let volume = Volume::Warp(Arc::new(warp));
        let lattice = Lattice::over(&volume.support(), 1.0).unwrap();
        let mesher = Polygonizer::new(&volume, lattice, 0.05).unwrap();
        let (printed, _) = mesher.columns(Reach::Printed).unwrap();
        let (_, off) = wrong(&mesher, &printed);
        assert!(off > 100, "{off} vertices off the surface");
        let (repaired, _) = mesher.columns(Reach::Repaired).unwrap();
        assert_eq!(wrong(&mesher, &repaired), (0, 0));
    }
}
