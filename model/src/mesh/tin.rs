//! A triangulated irregular network of a terrain with a proved largest vertical error: Delaunay triangles, into which
//! the worst point is inserted until every triangle is proved to be good enough (greedy insertion, Garland and Heckbert
//! 1995, with proofs instead of samples to end it).
//!
//! First points are tried: of all triangles the one with the worst point gets it as a vertex, until none is found above
//! a share of the tolerance. Then every triangle is measured by [`Gauge`]; one that fails gets a vertex where it was
//! refuted, or where its bound is loosest, and only new triangles are measured again.
//!
//! Where the terrain ends, triangles that are not proved to lie on it are cut down to `border`; of those a triangle is
//! kept when its three corners lie on the terrain, as in [`adaptive`](super::adaptive).

use super::deviation::{Deviation, Gauge, between, measure};
use super::{Mesh, MeshError};
use crate::bounds::THRESHOLD;
use crate::program::Program;
use glam::DVec2;
use rayon::prelude::*;
use spade::handles::FixedVertexHandle;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::collections::{BTreeMap, BinaryHeap};

/// What to mesh and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// South-west corner, metres.
    pub low: DVec2,
    /// North-east corner, metres.
    pub high: DVec2,
    /// The largest vertical distance from the field, metres.
    pub tolerance: f64,
    /// Triangles across the border of the terrain have no longer sides than this, metres.
    pub border: f64,
    /// The most vertices.
    pub vertices: usize,
    /// Pieces that a proof may cut a triangle into.
    pub budget: u32,
}

impl Settings {
    /// Pieces that nearly every proof gets along with.
    pub const BUDGET: u32 = 512;
    /// Points are inserted without a proof until none is found above this share of the tolerance: nearer to 1, proofs
    /// get long; lower, triangles get many.
    const SHARE: f64 = 0.65;
}

/// A network and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tin {
    /// Vertices on the field, triangles anticlockwise.
    pub mesh: Mesh,
    /// The certified error: no triangle is further from the terrain than this, metres, proved or not.
    pub at_most: f64,
    /// Some triangle is this far from it, metres: the largest distance found at a point.
    pub at_least: f64,
    /// Triangles not proved to be within the tolerance when the vertices were spent, in order.
    pub open: Vec<usize>,
}

/// Points tried on a triangle: those with barycentric coordinates that are multiples of 1/LATTICE, but the corners.
const LATTICE: u32 = 6;
/// A new vertex nearer to a side on the rectangle's border than this share of the side's length is put on it.
const RIM: f64 = 0.125;
/// Triangles across the rectangle's longer side to begin with.
const FIRST: f64 = 8.0;

#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: [f64; 3],
    on_terrain: bool,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(self.position[0], self.position[1])
    }
}

/// The corners of a triangle, the smallest first and anticlockwise: its name, while it exists.
type Name = [usize; 3];

/// A triangle to improve: the worst first, and among equals the first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    error: f64,
    name: Name,
    at: DVec2,
}
impl Eq for Candidate {}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Candidate) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Candidate {
    fn cmp(&self, other: &Candidate) -> std::cmp::Ordering {
        self.error.total_cmp(&other.error).then_with(|| other.name.cmp(&self.name))
    }
}

struct Network<'a> {
    program: &'a Program,
    settings: Settings,
    gauge: Gauge<'a>,
    triangles: DelaunayTriangulation<Vertex>,
}

/// The network of the terrain of `program` over a rectangle. Deterministic, whatever the number of threads.
///
/// # Errors
/// [`MeshError::Settings`] for a rectangle without area, or a tolerance or a border that is not positive.
pub fn tin(program: &Program, settings: &Settings) -> Result<Tin, MeshError> {
    MeshError::refuse(settings.low, settings.high, settings.tolerance)?;
    if settings.border.is_nan() || settings.border <= 0.0 {
        return Err(MeshError::Settings { problem: "border of a mesh", expected: "a positive number of metres" });
    }
    let mut network =
        Network { program, settings: *settings, gauge: Gauge::new(program), triangles: DelaunayTriangulation::new() };
    network.begin();
    network.insert_worst();
    let found = network.prove();
    Ok(network.finish(&found))
}

impl Network<'_> {
    /// Inserts a point; `None` where it cannot be a vertex of its own, or the vertices are spent.
    fn insert(&mut self, p: DVec2) -> Option<FixedVertexHandle> {
        if self.triangles.num_vertices() >= self.settings.vertices {
            return None;
        }
        let before = self.triangles.num_vertices();
        let p = p.clamp(self.settings.low, self.settings.high);
        let (elevation, weight) = self.program.height(p);
        let vertex = Vertex { position: [p.x, p.y, elevation], on_terrain: weight >= THRESHOLD };
        // The error is of coordinates beyond 10^±50, which no terrain has.
        let handle = self.triangles.insert(vertex).ok()?;
        (self.triangles.num_vertices() > before).then_some(handle)
    }

    /// A coarse grid, so that no hill is missed by the first points tried.
    fn begin(&mut self) {
        let size = self.settings.high - self.settings.low;
        let counts = (FIRST * size / size.max_element()).ceil();
        for j in 0..=counts.y as u32 {
            for i in 0..=counts.x as u32 {
                let share = DVec2::new(f64::from(i), f64::from(j)) / counts;
                self.insert(self.settings.low + size * share);
            }
        }
    }

    /// The point, or the nearest one on a side that the triangle has on the rectangle's border, if it is that near. A
    /// vertex close above such a side leaves a flat triangle, whose worst point is closer still, and so on for ever:
    /// across the border there is no triangle to flip the side with.
    fn off_the_rim(&self, name: Name, p: DVec2) -> DVec2 {
        let corners = self.corners(name).map(|corner| corner.position);
        let mut moved = p;
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            for axis in 0..2 {
                let rim = a[axis];
                let on_rim = rim == b[axis] && (rim == self.settings.low[axis] || rim == self.settings.high[axis]);
                if on_rim && (p[axis] - rim).abs() < RIM * (a[1 - axis] - b[1 - axis]).abs() {
                    moved[axis] = rim;
                }
            }
        }
        moved
    }

    fn corners(&self, name: Name) -> [Vertex; 3] {
        name.map(|index| *self.triangles.vertex(FixedVertexHandle::from_index(index)).data())
    }

    fn named(corners: [FixedVertexHandle; 3]) -> Name {
        let [a, b, c] = corners.map(|corner| corner.index());
        match a.min(b).min(c) {
            least if least == a => [a, b, c],
            least if least == b => [b, c, a],
            _ => [c, a, b],
        }
    }

    fn names(&self) -> Vec<Name> {
        let mut names: Vec<Name> =
            self.triangles.inner_faces().map(|face| Self::named(face.vertices().map(|v| v.fix()))).collect();
        names.sort_unstable();
        names
    }

    /// Does the triangle still exist?
    fn exists(&self, name: Name) -> bool {
        let [a, b, c] = name.map(FixedVertexHandle::from_index);
        let Some(side) = self.triangles.get_edge_from_neighbors(a, b) else { return false };
        side.next().to().fix() == c && side.face().as_inner().is_some()
    }

    /// The triangles around a vertex.
    fn around(&self, vertex: FixedVertexHandle) -> Vec<Name> {
        let sides = self.triangles.vertex(vertex).out_edges();
        let faces = sides.filter_map(|side| side.face().as_inner());
        let mut names: Vec<Name> = faces.map(|face| Self::named(face.vertices().map(|v| v.fix()))).collect();
        names.sort_unstable();
        names
    }

    /// The point tried on a triangle that lies furthest from the terrain.
    fn worst(&mut self, name: Name) -> Candidate {
        let corners = self.corners(name).map(|corner| corner.position);
        let [a, b, c] = corners.map(|p| DVec2::new(p[0], p[1]));
        self.gauge.enter(a.min(b).min(c), a.max(b).max(c));
        let mut worst = Candidate { error: 0.0, name, at: a };
        for i in 0..=LATTICE {
            for j in 0..=LATTICE - i {
                let [x, y, z] = on_lattice(&corners, [i, j]);
                let (elevation, weight) = self.gauge.height(DVec2::new(x, y));
                let error = (elevation - z).abs();
                if weight >= THRESHOLD && error > worst.error {
                    worst = Candidate { error, at: DVec2::new(x, y), ..worst };
                }
            }
        }
        worst
    }

    /// Gives the worst triangle its worst point, again and again.
    fn insert_worst(&mut self) {
        let target = Settings::SHARE * self.settings.tolerance;
        let mut queue: BinaryHeap<Candidate> = BinaryHeap::new();
        for name in self.names() {
            queue.push(self.worst(name));
        }
        while let Some(Candidate { error, name, at }) = queue.pop() {
            if error <= target {
                break;
            }
            if !self.exists(name) {
                continue;
            }
            let Some(vertex) = self.insert(self.off_the_rim(name, at)) else { continue };
            for name in self.around(vertex) {
                let worst = self.worst(name);
                if worst.error > target {
                    queue.push(worst);
                }
            }
        }
    }

    /// Measures every triangle and inserts vertices where one fails, until none does or the vertices are spent.
    fn prove(&mut self) -> BTreeMap<Name, Deviation> {
        let Settings { tolerance, budget, .. } = self.settings;
        let mut known: BTreeMap<Name, Deviation> = BTreeMap::new();
        loop {
            let names = self.names();
            let new: Vec<Name> = names.iter().copied().filter(|name| !known.contains_key(name)).collect();
            let measured: Vec<Deviation> = new
                .par_iter()
                .map_init(
                    || Gauge::new(self.program),
                    |gauge, &name| measure(gauge, &self.corners(name).map(|v| v.position), tolerance, budget),
                )
                .collect();
            known.extend(new.iter().copied().zip(measured));
            let mut inserted = 0;
            for name in names {
                let Some(&found) = known.get(&name) else { continue };
                if self.exists(name)
                    && let Some(p) = self.wanted(name, &found)
                {
                    inserted += usize::from(self.insert(self.off_the_rim(name, p)).is_some());
                }
            }
            known.retain(|&name, _| self.exists(name));
            if inserted == 0 {
                return known;
            }
        }
    }

    /// Where a triangle needs a vertex.
    fn wanted(&self, name: Name, found: &Deviation) -> Option<DVec2> {
        if found.outside {
            return None;
        }
        let corners = self.corners(name);
        let [a, b, c] = corners.map(|corner| DVec2::new(corner.position[0], corner.position[1]));
        if !found.inside {
            let sides = [[a, b], [b, c], [c, a]];
            let longest = sides.into_iter().fold([a, b], |l, s| if length(s) > length(l) { s } else { l });
            if length(longest) > self.settings.border {
                return Some(longest[0] + 0.5 * (longest[1] - longest[0]));
            }
            if !corners.iter().all(|corner| corner.on_terrain) {
                return None;
            }
        }
        if found.within(self.settings.tolerance) {
            None
        } else if found.at_least > self.settings.tolerance {
            Some(found.witness)
        } else {
            Some(found.loosest)
        }
    }

    /// The triangles that are kept, with the vertices they use.
    fn finish(&self, known: &BTreeMap<Name, Deviation>) -> Tin {
        let mut tin = Tin { mesh: Mesh::default(), at_most: 0.0, at_least: 0.0, open: Vec::new() };
        let mut numbers: Vec<Option<u32>> = vec![None; self.triangles.num_vertices()];
        for (&name, found) in known {
            let corners = self.corners(name);
            if found.outside || !corners.iter().all(|corner| corner.on_terrain) {
                continue;
            }
            if !found.within(self.settings.tolerance) {
                tin.open.push(tin.mesh.triangles.len());
            }
            tin.at_most = tin.at_most.max(found.at_most);
            tin.at_least = tin.at_least.max(found.at_least);
            let mut triangle = [0; 3];
            for ((index, number), corner) in name.into_iter().zip(&mut triangle).zip(corners) {
                *number = *numbers[index].get_or_insert_with(|| {
                    tin.mesh.positions.push(corner.position);
                    (tin.mesh.positions.len() - 1) as u32
                });
            }
            tin.mesh.triangles.push(triangle);
        }
        tin
    }
}

fn length([a, b]: [DVec2; 2]) -> f64 {
    a.distance(b)
}

/// A lattice point of a triangle. On a side it is computed from the side's ends alone, so that the border of the
/// rectangle is not left.
fn on_lattice(corners: &[[f64; 3]; 3], [i, j]: [u32; 2]) -> [f64; 3] {
    let share = |n: u32| f64::from(n) / f64::from(LATTICE);
    let [a, b, c] = *corners;
    if i + j == LATTICE { between(&[b, c, a], [share(j), 0.0]) } else { between(&[a, b, c], [share(i), share(j)]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cracks::{Cracks, cracks};
    use crate::mesh::deviation::certify;
    use crate::mesh::tests::{disc, hills};
    use crate::tree::Tree;

    const SETTINGS: Settings = Settings {
        low: DVec2::ZERO,
        high: DVec2::new(64.0, 48.0),
        tolerance: 0.4,
        border: 1.0,
        vertices: 20_000,
        budget: Settings::BUDGET,
    };

    fn area(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    }

    #[test]
    fn the_network_is_closed_lies_on_the_field_and_within_the_tolerance_of_it() {
        let program = hills();
        let Tin { mesh, at_most, at_least, open } = tin(&program, &SETTINGS).unwrap();
        mesh.check().unwrap();
        assert_eq!(cracks(&mesh), Cracks::default());
        assert!(
            open.is_empty() && at_least <= at_most && at_most <= SETTINGS.tolerance,
            "{at_least} {at_most} {open:?}"
        );
        assert!(at_least > 0.5 * SETTINGS.tolerance, "{at_least}");
        assert!(mesh.positions.iter().all(|&[x, y, z]| program.height(DVec2::new(x, y)).0 == z));
        let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
        assert!((total / (64.0 * 48.0) - 1.0).abs() < 1e-12, "{total}");

        assert!(certify(&program, &mesh, SETTINGS.tolerance, SETTINGS.budget).holds());
        let mut moved = mesh.clone();
        moved.positions[50][2] += 2.0 * SETTINGS.tolerance;
        let found = certify(&program, &moved, SETTINGS.tolerance, SETTINGS.budget);
        assert!(!found.holds() && found.at_least > SETTINGS.tolerance);
        assert!(found.open.iter().all(|&t| moved.triangles[t].contains(&50)));
    }

    #[test]
    fn a_vertex_near_a_side_on_the_border_is_put_on_it_and_no_other() {
        let program = hills();
        let mut network = Network {
            program: &program,
            settings: SETTINGS,
            gauge: Gauge::new(&program),
            triangles: DelaunayTriangulation::new(),
        };
        network.begin();
        let (mut rims, mut others) = (0, 0);
        for name in network.names() {
            let [a, b, c] = network.corners(name).map(|corner| DVec2::new(corner.position[0], corner.position[1]));
            for (from, to, apex) in [(a, b, c), (b, c, a), (c, a, b)] {
                let near = from.lerp(to, 0.5).lerp(apex, 0.01);
                let on_rim = |p: DVec2| p.x == 0.0 || p.y == 0.0 || p.x == 64.0 || p.y == 48.0;
                let rim = on_rim(from.lerp(to, 0.5));
                let moved = network.off_the_rim(name, near);
                assert_eq!((on_rim(moved), moved == near), (rim, !rim), "{from} {to}");
                rims += usize::from(rim);
                others += usize::from(!rim);
            }
            let middle = (a + b + c) / 3.0;
            assert_eq!(network.off_the_rim(name, middle), middle);
        }
        assert!(rims == 28 && others > 100, "{rims} {others}");
    }

    #[test]
    fn a_network_out_of_vertices_says_what_is_not_proved() {
        let program = hills();
        let few = Settings { vertices: 150, ..SETTINGS };
        let found = tin(&program, &few).unwrap();
        assert!(!found.open.is_empty() && found.at_most > few.tolerance && found.mesh.positions.len() <= 150);
        let certificate = certify(&program, &found.mesh, few.tolerance, few.budget);
        assert_eq!((certificate.open, certificate.at_most), (found.open, found.at_most));
    }

    #[test]
    fn triangles_at_the_border_have_their_corners_on_the_terrain() {
        let mut tree = Tree::new();
        let root = tree.push(disc((0.0, 0.0), 10.0, 5.0, None));
        let program = Program::compile(&tree, root).unwrap();
        let (low, high) = (DVec2::splat(-12.0), DVec2::splat(12.0));
        let found = tin(&program, &Settings { low, high, border: 0.5, tolerance: 0.01, ..SETTINGS }).unwrap();
        assert!(found.open.is_empty());
        assert_eq!(cracks(&found.mesh), Cracks::default());
        assert!(found.mesh.positions.iter().all(|p| program.height(DVec2::new(p[0], p[1])).1 >= THRESHOLD));
        // α = 1.6 (1 − d²/r²)³ is 1/2 at this distance.
        let radius = 10.0 * (1.0 - libm::cbrt(0.5 / 1.6)).sqrt();
        let total: f64 = found.mesh.triangles.iter().map(|t| area(&found.mesh, t)).sum();
        let (disc, rim) = (std::f64::consts::PI * radius * radius, std::f64::consts::TAU * radius);
        assert!(total <= disc && total >= disc - 0.5 * rim, "{total} {disc}");
    }

    #[test]
    fn the_result_does_not_depend_on_threads() {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| tin(&hills(), &Settings { vertices: 400, ..SETTINGS })).unwrap()
        };
        assert_eq!(with(1), with(5));
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for bad in [
            Settings { tolerance: -1.0, ..SETTINGS },
            Settings { border: f64::NAN, ..SETTINGS },
            Settings { low: SETTINGS.high, ..SETTINGS },
        ] {
            assert!(matches!(tin(&hills(), &bad), Err(MeshError::Settings { .. })));
        }
    }
}
