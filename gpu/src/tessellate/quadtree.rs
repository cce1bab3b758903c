//! The adaptive quadtree of Génevaux 2015 §8.2 (its reference DIP14) over the same ground, to compare with: cells split by distance, neighbours
//! differ by one level at most, and a cell is a fan about its centre with a corner where a smaller neighbour has one. So no edge opens;
//! but a cell must know its neighbours, which a bisected triangle need not.

use super::refine::Refinement;
use super::triangle::{SIDE, Vertex};
use terrain_model::mesh::quadtree::{Cell, Judgement, MAX_LEVEL, Quadtree, Refine, Sides, fan};

/// Grid units between points of the tree.
const UNIT: u32 = SIDE >> (MAX_LEVEL + 1);

struct Judge<'a> {
    refinement: &'a Refinement<'a>,
    cull: bool,
}

impl Judge<'_> {
    /// Middle of a cell and half its side, grid units.
    fn square(cell: Cell) -> (Vertex, i64) {
        let half = SIDE >> (cell.level + 1);
        ([cell.i, cell.j].map(|at| (2 * at + 1) * half), i64::from(half))
    }
}

impl Refine for Judge<'_> {
    type Note = ();
    type Scratch = ();
    fn scratch(&self) {}
    /// Edges of a fan are between half a cell's side and the side; a cell splits while its side is above twice the target.
    fn judge(&self, (): &mut (), cell: Cell, _: Sides) -> Judgement<()> {
        let (refinement, (middle, half)) = (self.refinement, Judge::square(cell));
        let ground = refinement.ground();
        let block = refinement.detail().widen(ground.enclosure(middle, half));
        let ([x, y], [sx, sy]) = (ground.metres(middle), ground.unit());
        let [rx, ry] = [sx, sy].map(|s| s * half as f64);
        let end = ground.extent();
        let beyond = x - rx >= end[0] || y - ry >= end[1];
        let (low, high) = ([x - rx - block.moved, y - ry - block.moved], [x + rx + block.moved, y + ry + block.moved]);
        let ([bottom, top], view) = (block.elevation, refinement.view());
        if beyond || self.cull && view.misses([low[0], low[1], bottom], [high[0], high[1], top]) {
            return Judgement::LeaveOut;
        }
        let radius = (rx * ry).sqrt() * view.focal / refinement.target();
        let near = view.distance_squared([x, y], block.elevation) < radius * radius;
        if near { Judgement::Split(()) } else { Judgement::Keep(()) }
    }
}

/// Its triangles for the camera and edges of `refinement`, without those that cannot be in the image if `cull`. With `stitched` off
/// fans have no corners for their neighbours: a control.
pub fn triangles(refinement: &Refinement<'_>, cull: bool, stitched: bool) -> Vec<[Vertex; 3]> {
    let tree = Quadtree::build([1, 1], MAX_LEVEL, &Judge { refinement, cull });
    let fans = tree
        .leaves()
        .into_iter()
        .flat_map(|leaf| fan(MAX_LEVEL, leaf.cell, if stitched { leaf.sides } else { Sides::default() }));
    fans.map(|corners| corners.map(|point| point.map(|x| x * UNIT))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::census::Census;
    use crate::tessellate::tests::{camera, detail, ground};

    #[test]
    fn fans_with_corners_for_their_neighbours_meet_and_those_without_do_not() {
        let (ground, detail) = (ground(), detail());
        let mut control = 0;
        for k in 0..6 {
            let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
            assert_eq!(
                Census::of_triangles(triangles(&refinement, false, true), ground.end()),
                Census::default(),
                "camera {k}"
            );
            control += Census::of_triangles(triangles(&refinement, false, false), ground.end()).t_junctions;
        }
        assert!(control > 100, "{control}");
    }

    #[test]
    fn what_culling_leaves_covers_what_is_seen_and_is_less_than_the_whole() {
        let (ground, detail) = (ground(), detail());
        let (mut all, mut kept) = (0, 0);
        for k in 0..6 {
            let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
            let whole = triangles(&refinement, false, true);
            let seen = |triangle: &&[Vertex; 3]| {
                triangle.iter().any(|vertex| refinement.view().sees(refinement.position(*vertex)))
            };
            // A culled neighbour splits nothing, so fans at the image's border may differ; areas do not.
            let area = |list: &mut dyn Iterator<Item = &[Vertex; 3]>| -> f64 {
                let twice = |[a, b, c]: &[Vertex; 3]| {
                    let [u, v] = [b, c].map(|p| [0, 1].map(|k| f64::from(p[k]) - f64::from(a[k])));
                    (u[0] * v[1] - u[1] * v[0]).abs()
                };
                list.map(twice).sum()
            };
            let left = triangles(&refinement, true, true);
            assert!(area(&mut whole.iter().filter(seen)) <= area(&mut left.iter()), "camera {k}");
            (all, kept) = (all + whole.len(), kept + left.len());
        }
        assert!(kept > 1000 && kept * 5 < all * 4, "{kept} of {all}");
    }
}
