//! An adaptive mesh of a terrain: a restricted quadtree that is split until every triangle is proved to lie within a
//! tolerance of the field, straight up and down.
//!
//! Cells that are proved to lie off the terrain are left out. Cells that are not proved to lie on it are split down to
//! the finest level, where the rule is: **a triangle is kept when its three corners lie on the terrain**. So the border
//! of the mesh is within a finest cell of the border of the terrain as far as corners can tell, and what sticks out
//! between two corners is not measured, there being no terrain to compare with.

use super::deviation::Gauge;
use super::quadtree::{Cell, Judgement, MAX_LEVEL, Point, Quadtree, Refine, Sides, fan, lattice};
use super::{Mesh, MeshError};
use crate::bounds::THRESHOLD;
use crate::program::Program;
use glam::DVec2;
use std::collections::HashMap;

/// What to mesh and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// South-west corner, metres.
    pub low: DVec2,
    /// North-east corner, metres.
    pub high: DVec2,
    /// The largest vertical distance from the field, metres.
    pub tolerance: f64,
    /// The deepest level, at most [`MAX_LEVEL`]; level 0 has one cell, or more where the rectangle is oblong.
    pub finest: u32,
    /// Pieces that a proof may cut a triangle into. Fewer are faster and give more triangles.
    pub budget: u32,
}

impl Settings {
    /// With fewer pieces, cells are split for want of a proof; with more, hardly a triangle is saved.
    pub const BUDGET: u32 = 256;
    /// On the finest level, where splitting is no way out, this many times the budget.
    const LAST: u32 = 4;

    /// Columns and rows of cells of level 0, about square.
    pub fn roots(&self) -> [u32; 2] {
        let size = self.high - self.low;
        let short = size.min_element();
        [size.x, size.y].map(|side| (side / short).round().clamp(1.0, 64.0) as u32)
    }
}

/// A mesh and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Adaptive {
    /// Vertices on the field, triangles anticlockwise.
    pub mesh: Mesh,
    /// No triangle is further from the terrain than this, metres; `f64::INFINITY` where that is not known.
    pub at_most: f64,
    /// Some triangle is this far from it, metres.
    pub at_least: f64,
    /// Triangles of cells of the finest level that are not proved to be within the tolerance, in order.
    pub open: Vec<usize>,
    /// Leaves that the mesh is made of.
    pub leaves: usize,
    /// The finest level that is used.
    pub deepest: u32,
}

/// The mesh of the terrain of `program` over a rectangle. Deterministic, whatever the number of threads.
///
/// # Errors
/// [`MeshError::Settings`] for a rectangle without area, a tolerance that is not positive or too deep a level;
/// [`MeshError::TooMany`] above 2³² − 1 vertices.
pub fn adaptive(program: &Program, settings: &Settings) -> Result<Adaptive, MeshError> {
    grow(program, settings, true)
}

/// What not to do: neighbours differ by any number of levels and take no notice of each other. A control for
/// [`cracks`](super::cracks::cracks).
///
/// # Errors
/// As [`adaptive`].
pub fn unrestricted(program: &Program, settings: &Settings) -> Result<Adaptive, MeshError> {
    grow(program, settings, false)
}

fn grow(program: &Program, settings: &Settings, restricted: bool) -> Result<Adaptive, MeshError> {
    MeshError::refuse(settings.low, settings.high, settings.tolerance)?;
    if settings.finest > MAX_LEVEL {
        return Err(MeshError::Settings { problem: "finest level", expected: "at most 20" });
    }
    let terrain = Terrain { program, settings: *settings, points: lattice(settings.roots(), settings.finest) };
    let tree = Quadtree::grow(settings.roots(), settings.finest, &terrain, restricted);
    let mut gauge = Gauge::new(program);
    let mut grown =
        Adaptive { mesh: Mesh::default(), at_most: 0.0, at_least: 0.0, open: Vec::new(), leaves: 0, deepest: 0 };
    let mut vertices: HashMap<Point, u32> = HashMap::new();
    for leaf in tree.leaves() {
        grown.leaves += 1;
        grown.deepest = grown.deepest.max(leaf.cell.level);
        let [low, high] = terrain.corners(leaf.cell);
        gauge.enter(low, high);
        for (triangle, kept) in fan(settings.finest, leaf.cell, leaf.sides).zip(0..) {
            if leaf.note.dropped >> kept & 1 == 1 {
                continue;
            }
            if leaf.note.open >> kept & 1 == 1 {
                grown.open.push(grown.mesh.triangles.len());
            }
            let indices = triangle.map(|point| {
                *vertices.entry(point).or_insert_with(|| {
                    grown.mesh.positions.push(gauge.vertex(terrain.place(point)).0);
                    (grown.mesh.positions.len() - 1) as u32
                })
            });
            grown.mesh.triangles.push(indices);
        }
        grown.at_most = grown.at_most.max(leaf.note.at_most);
        grown.at_least = grown.at_least.max(leaf.note.at_least);
        if u32::try_from(grown.mesh.positions.len() + 16).is_err() {
            return Err(MeshError::TooMany { vertices: grown.mesh.positions.len() });
        }
    }
    Ok(grown)
}

/// What is remembered about a leaf. Bits count the triangles of its fan.
#[derive(Clone, Copy, Debug, Default)]
struct Note {
    at_most: f64,
    at_least: f64,
    dropped: u8,
    open: u8,
}

struct Terrain<'a> {
    program: &'a Program,
    settings: Settings,
    points: [u32; 2],
}

impl Terrain<'_> {
    /// A lattice point in the plane. Points of one row or column agree in that coordinate exactly.
    fn place(&self, point: Point) -> DVec2 {
        let along = |axis: usize| {
            let (low, high) = (self.settings.low[axis], self.settings.high[axis]);
            if point[axis] == self.points[axis] {
                return high;
            }
            low + (high - low) * (f64::from(point[axis]) / f64::from(self.points[axis]))
        };
        DVec2::new(along(0), along(1))
    }
    fn corners(&self, cell: Cell) -> [DVec2; 2] {
        let side = 2u32 << (self.settings.finest - cell.level);
        [0, 1].map(|k| self.place([(cell.i + k) * side, (cell.j + k) * side]))
    }
}

impl<'a> Refine for Terrain<'a> {
    type Note = Note;
    type Scratch = Gauge<'a>;

    fn scratch(&self) -> Gauge<'a> {
        Gauge::new(self.program)
    }

    fn judge(&self, gauge: &mut Gauge<'a>, cell: Cell, sides: Sides) -> Judgement<Note> {
        let Settings { tolerance, finest, budget, .. } = self.settings;
        let [low, high] = self.corners(cell);
        gauge.enter(low, high);
        let weight = gauge.weight(low, high);
        if weight.hi() < THRESHOLD {
            return Judgement::LeaveOut;
        }
        let inside = weight.lo() >= THRESHOLD;
        let last = cell.level == finest;
        if !inside && !last {
            return Judgement::Split(Note::default());
        }
        let mut note = Note::default();
        let mut vertex = |point: Point| gauge.vertex(self.place(point));
        let fan: Vec<([[f64; 3]; 3], bool)> = fan(finest, cell, sides)
            .map(|triangle| {
                let corners = triangle.map(&mut vertex);
                (corners.map(|corner| corner.0), inside || corners.iter().all(|corner| corner.1))
            })
            .collect();
        let budget = if last { Settings::LAST * budget } else { budget };
        if !last && fan.iter().any(|(corners, _)| gauge.exceeds(corners, tolerance)) {
            return Judgement::Split(note);
        }
        for (k, (corners, kept)) in fan.iter().enumerate() {
            if !kept {
                note.dropped |= 1 << k;
                continue;
            }
            let deviation = gauge.triangle(corners, tolerance, budget);
            note.at_most = note.at_most.max(deviation.at_most);
            note.at_least = note.at_least.max(deviation.at_least);
            if !deviation.within(tolerance) {
                if !last {
                    return Judgement::Split(note);
                }
                note.open |= 1 << k;
            }
        }
        if fan.len() == note.dropped.count_ones() as usize {
            Judgement::LeaveOut
        } else if note.open != 0 {
            Judgement::Split(note)
        } else {
            Judgement::Keep(note)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cracks::{Cracks, cracks};
    use crate::mesh::deviation::certify;
    use crate::mesh::tests::{disc, hills};
    use crate::tree::Tree;

    const SETTINGS: Settings =
        Settings { low: DVec2::ZERO, high: DVec2::new(64.0, 48.0), tolerance: 0.75, finest: 8, budget: 128 };

    #[test]
    fn the_mesh_is_closed_lies_on_the_field_and_within_the_tolerance_of_it() {
        let program = hills();
        let Adaptive { mesh, at_most, at_least, open, .. } = adaptive(&program, &SETTINGS).unwrap();
        mesh.check().unwrap();
        assert_eq!(cracks(&mesh), Cracks::default());
        assert!(
            open.is_empty() && at_least <= at_most && at_most <= SETTINGS.tolerance,
            "{at_least} {at_most} {open:?}"
        );
        assert!(mesh.positions.iter().all(|&[x, y, z]| program.height(DVec2::new(x, y)).0 == z));
        let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
        assert!((total / (64.0 * 48.0) - 1.0).abs() < 1e-12, "{total}");
        // The triangles are of several sizes.
        let areas = mesh.triangles.iter().map(|t| area(&mesh, t));
        let (small, large) = areas.fold((f64::INFINITY, 0.0f64), |(s, l), a| (s.min(a), l.max(a)));
        assert!(large / small >= 16.0, "{small} {large}");

        // Asked again, triangle by triangle, the proof stands; and it falls with a vertex moved by twice the tolerance.
        assert!(certify(&program, &mesh, SETTINGS.tolerance, 1000).holds());
        let mut moved = mesh.clone();
        moved.positions[100][2] += 2.0 * SETTINGS.tolerance;
        let found = certify(&program, &moved, SETTINGS.tolerance, 1000);
        assert!(!found.holds() && found.at_least > SETTINGS.tolerance);
        assert!(found.open.iter().all(|&t| moved.triangles[t].contains(&100)));
    }

    fn area(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    }

    #[test]
    fn a_tree_without_the_rule_has_cracks() {
        let found = cracks(&unrestricted(&hills(), &SETTINGS).unwrap().mesh);
        assert!(found.t_junctions > 0, "{found:?}");
    }

    #[test]
    fn what_the_finest_level_cannot_prove_is_named() {
        let coarse = Settings { finest: 2, ..SETTINGS };
        let found = adaptive(&hills(), &coarse).unwrap();
        assert!(!found.open.is_empty() && found.at_most > coarse.tolerance);
        let certificate = certify(&hills(), &found.mesh, coarse.tolerance, Settings::LAST * coarse.budget);
        assert_eq!(certificate.open, found.open);
    }

    #[test]
    fn triangles_at_the_border_have_their_corners_on_the_terrain() {
        let mut tree = Tree::new();
        let root = tree.push(disc((0.0, 0.0), 10.0, 5.0, None));
        let program = Program::compile(&tree, root).unwrap();
        let around =
            Settings { low: DVec2::splat(-12.0), high: DVec2::splat(12.0), tolerance: 0.01, finest: 6, budget: 16 };
        let found = adaptive(&program, &around).unwrap();
        assert!(found.mesh.positions.iter().all(|p| program.height(DVec2::new(p[0], p[1])).1 >= THRESHOLD));
        assert_eq!(cracks(&found.mesh), Cracks::default());
        // α = 1.6 (1 − d²/r²)³ is 1/2 at this distance.
        let radius = 10.0 * (1.0 - libm::cbrt(0.5 / 1.6)).sqrt();
        let total: f64 = found.mesh.triangles.iter().map(|t| area(&found.mesh, t)).sum();
        let (disc, rim) = (std::f64::consts::PI * radius * radius, std::f64::consts::TAU * radius);
        let cell = 24.0 / 64.0;
        assert!(total <= disc && total >= disc - rim * cell * 2f64.sqrt(), "{total} {disc}");
    }

    #[test]
    fn the_result_does_not_depend_on_threads() {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| adaptive(&hills(), &SETTINGS)).unwrap()
        };
        assert_eq!(with(1), with(5));
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let program = hills();
        for bad in [
            Settings { tolerance: 0.0, ..SETTINGS },
            Settings { tolerance: f64::NAN, ..SETTINGS },
            Settings { high: DVec2::ZERO, ..SETTINGS },
            Settings { finest: 21, ..SETTINGS },
        ] {
            assert!(matches!(adaptive(&program, &bad), Err(MeshError::Settings { .. })));
        }
    }
}
