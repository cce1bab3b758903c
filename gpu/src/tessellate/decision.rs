//! What a camera decides on the device, in `f32`: the twin of `shaders/tessellate/refine.wgsl`, with its order of operations.
//!
//! **Rounding opens no crack.** Write u = 2⁻²⁴. Places are integers less the integer vertex o nearest the eye, at most 2²⁴, so
//! they are exact in `f32`, as are the eye e (relative to o) and the metres s of a grid unit, which are `f32` numbers to begin
//! with. With those numbers the nesting of [`super::refine`] holds exactly; what rounds is the evaluation.
//!
//! 1. Elevations of enclosures are rounded outward and widened by one amplitude. Rounding is monotone, so segments still nest.
//! 2. d = fl(fl(i·s) − e) is off by u|i·s| + u|d| to first order. Over the domain |e| ≤ s/2, beside it e and i·s have opposite
//!    signs; so |i·s| ≤ |d| + s/2 and d is off by 2u|d| + us/2. The elevation's difference is off by u of itself.
//! 3. Squares and sums add 3u to d². So the root of what is computed differs from the distance D by less than 4uD + us.
//! 4. A stored R² gives R(1 + u). Radii are made in `f64` from sides which s rounds: u more.
//!
//! A child that splits therefore has D′ < R(l+1)(1 + 6u) + us, its parent D < (R(l+1) + e(l)/(2√2))(1 + 7u) + us and a root
//! below that times 1 + 4u, plus us: 12u(R(l+1) + e(l)/(2√2)) + 2us in excess. A unit s is at most e(l)/16 at the finest level
//! which splits, less than a fifth of e(l)/(2√2): together below 13u < 10⁻⁶ of R(l), which has an excess of 10⁻⁵. Contracting a
//! product and a sum into one operation leaves a rounding out; both triangles at an edge run the same code on the same numbers.

use super::displace::Detail;
use super::ground::{Block, Ground, beyond};
use super::refine::Refinement;
use super::triangle::{FINEST, SIDE, Triangle, Vertex};

/// 16 units in the last place of 1: see [`Decision::hidden`].
const SLACK: f32 = 16.0 / 16_777_216.0;

/// The enclosures of a ground, rounded outward to `f32`.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// Blocks along a side of the finest level.
    cells: u32,
    levels: u32,
    /// The raster's north-east corner.
    end: Vertex,
    /// Lowest, highest and farthest move of each block, from the finest to the whole.
    blocks: Vec<[f32; 3]>,
}

fn up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

impl Pyramid {
    /// Of `ground`, before noise.
    pub fn new(ground: &Ground) -> Pyramid {
        let outward = |block: &Block| [-up(-block.elevation[0]), up(block.elevation[1]), up(block.moved)];
        let levels = ground.pyramid();
        let blocks = levels.iter().flatten().map(outward).collect();
        Pyramid { cells: ground.blocks() as u32, levels: levels.len() as u32, end: ground.end(), blocks }
    }
    /// As the device reads it.
    pub fn words(&self) -> Vec<u32> {
        self.blocks.as_flattened().iter().map(|x| x.to_bits()).collect()
    }
    /// [`Ground::enclosure`], with room for `amplitude` more.
    fn enclosure(&self, centre: [i32; 2], reach: i32, amplitude: f32) -> [f32; 3] {
        let (mut shift, mut side, mut first) = ((SIDE / self.cells).trailing_zeros(), self.cells, 0);
        for _ in 1..self.levels {
            if 2i32 << shift >= reach {
                break;
            }
            first += side * side;
            side >>= 1;
            shift += 1;
        }
        let index = |x: i32| (x.max(0) as u32 >> shift).min(side - 1);
        let [from, to] = [centre.map(|x| index(x - (reach + 1))), centre.map(|x| index(x + reach))];
        let at = |i: u32, j: u32| self.blocks[(first + j * side + i) as usize];
        let [mut low, mut high, mut moved] = at(from[0], from[1]);
        for j in from[1]..=to[1] {
            for i in from[0]..=to[0] {
                let block = at(i, j);
                (low, high, moved) = (low.min(block[0]), high.max(block[1]), moved.max(block[2]));
            }
        }
        [low - amplitude, high + amplitude, moved + amplitude]
    }
}

/// A [`Refinement`] in `f32`, for an eye that `f32` can hold.
#[derive(Clone, Debug)]
pub struct Decision<'a> {
    pyramid: &'a Pyramid,
    origin: [i32; 2],
    unit: [f32; 2],
    eye: [f32; 3],
    amplitude: f32,
    planes: [[f32; 3]; 5],
    /// R(l)².
    radii: Vec<f32>,
}

impl<'a> Decision<'a> {
    /// What `refinement` decides over the ground of `pyramid`.
    pub fn new(pyramid: &'a Pyramid, refinement: &Refinement<'_>) -> Decision<'a> {
        let (view, unit) = (refinement.view(), refinement.ground().unit());
        let nearest = |axis: usize| (view.eye[axis] / unit[axis]).round().clamp(0.0, f64::from(SIDE));
        let place = [0, 1].map(nearest);
        let relative = |axis: usize| (view.eye[axis] - place[axis] * unit[axis]) as f32;
        Decision {
            pyramid,
            origin: place.map(|x| x as i32),
            unit: unit.map(|x| x as f32),
            eye: [relative(0), relative(1), view.eye[2] as f32],
            amplitude: up(amplitude(refinement.detail())),
            planes: view.planes().map(|plane| plane.map(|x| x as f32)),
            radii: refinement.radii().iter().map(|r| (r * r) as f32).collect(),
        }
    }
    /// The grid vertex that places are relative to.
    pub fn origin(&self) -> Vertex {
        self.origin.map(|x| x as u32)
    }
    /// Metres of a grid unit.
    pub fn unit(&self) -> [f32; 2] {
        self.unit
    }
    /// The eye: x and y from the origin, elevation.
    pub fn eye(&self) -> [f32; 3] {
        self.eye
    }
    /// As the device reads it; lists of `capacity` triangles and of `leaf_capacity` leaves.
    pub fn words(&self, cull: bool, capacity: u32, leaf_capacity: u32) -> Vec<u32> {
        let mut words: Vec<u32> = self.origin.map(|x| x as u32).to_vec();
        let mut floats = |values: &[f32]| words.extend(values.iter().map(|x| x.to_bits()));
        floats(&self.unit);
        floats(&self.eye);
        floats(&[self.amplitude]);
        self.planes.iter().for_each(|[x, y, z]| floats(&[*x, *y, *z, 0.0]));
        words.extend([self.pyramid.cells, self.pyramid.levels, u32::from(cull), capacity, leaf_capacity]);
        words.extend(self.pyramid.end);
        words.extend(self.radii.iter().map(|r| r.to_bits()));
        words.resize((35 + FINEST as usize + 1).next_multiple_of(4), 0);
        words
    }
    fn metres(&self, vertex: Vertex) -> [f32; 2] {
        [0, 1].map(|k| (vertex[k] as i32 - self.origin[k]) as f32 * self.unit[k])
    }
    fn enclosure(&self, triangle: &Triangle) -> [f32; 3] {
        self.pyramid.enclosure(triangle.middle().map(|x| x as i32), triangle.reach() as i32, self.amplitude)
    }
    /// Squared distance that decides, and the squared radius it is compared with.
    pub fn distance_and_radius(&self, triangle: &Triangle) -> [f32; 2] {
        let ([x, y], [low, high, _]) = (self.metres(triangle.middle()), self.enclosure(triangle));
        let [dx, dy] = [x - self.eye[0], y - self.eye[1]];
        let dz = (low - self.eye[2]).max(self.eye[2] - high).max(0.0);
        [dx * dx + dy * dy + dz * dz, self.radii[triangle.level as usize]]
    }
    /// Whether no displaced point of `triangle` can be in the image.
    ///
    /// A bound b = i·s ± moved less the eye, times a component of a plane: unit, product, widening, difference, plane, product
    /// and two sums round by at most 8u(|b| + 2·moved + |eye|)|n| in each axis. Twice that is allowed for.
    pub fn hidden(&self, triangle: &Triangle) -> bool {
        self.hidden_by(triangle, SLACK)
    }
    /// The same, with another allowance for rounding: what a device can decide lies between half of it and one and a half.
    fn hidden_by(&self, triangle: &Triangle, slack: f32) -> bool {
        let [bottom, top, moved] = self.enclosure(triangle);
        let corners = triangle.corners().map(|c| self.metres(c));
        let (mut low, mut high) = ([0.0, 0.0, bottom], [0.0, 0.0, top]);
        for axis in 0..2 {
            let [a, b, c] = corners.map(|c| c[axis]);
            (low[axis], high[axis]) = (a.min(b).min(c) - moved, a.max(b).max(c) + moved);
        }
        self.planes.iter().any(|n| {
            let bound = [0, 1, 2].map(|k| if n[k] > 0.0 { high[k] } else { low[k] });
            let far = [0, 1, 2].map(|k| bound[k] - self.eye[k]);
            let size = [0, 1, 2].map(|k| n[k].abs() * (bound[k].abs() + moved + self.eye[k].abs()));
            n[0] * far[0] + n[1] * far[1] + n[2] * far[2] < -slack * (size[0] + size[1] + size[2])
        })
    }
    /// The leaves of every device that rounds otherwise, and those that rounding decides.
    ///
    /// Two evaluations of d² differ by at most 16u d² + 4us d (see the module), less than 2·10⁻⁶ d² wherever d nears a radius.
    pub fn possible_leaves(&self, cull: bool) -> [Vec<Triangle>; 2] {
        let mut leaves = [Vec::new(), Vec::new()];
        let mut list = Triangle::ROOTS.map(|root| (root, 0)).to_vec();
        while let Some((triangle, mut open)) = list.pop() {
            if beyond(self.pyramid.end, &triangle) || cull && self.hidden_by(&triangle, 1.5 * SLACK) {
                continue;
            }
            if cull && self.hidden_by(&triangle, 0.5 * SLACK) {
                open = 1;
            }
            let [distance, radius] = self.distance_and_radius(&triangle);
            if (distance - radius).abs() <= 2e-6 * radius && radius > 0.0 {
                open = 1;
                leaves[open].push(triangle);
                list.extend(triangle.children().map(|child| (child, open)));
            } else if distance < radius {
                list.extend(triangle.children().map(|child| (child, open)));
            } else {
                leaves[open].push(triangle);
            }
        }
        leaves
    }
    /// The leaves, without those that cannot be in the image if `cull`.
    pub fn leaves(&self, cull: bool) -> Vec<Triangle> {
        let (mut leaves, mut list) = (Vec::new(), Triangle::ROOTS.to_vec());
        while let Some(triangle) = list.pop() {
            if beyond(self.pyramid.end, &triangle) || cull && self.hidden(&triangle) {
                continue;
            }
            let [distance, radius] = self.distance_and_radius(&triangle);
            if distance < radius {
                list.extend(triangle.children());
            } else {
                leaves.push(triangle);
            }
        }
        leaves
    }
}

/// The largest displacement by noise, metres.
fn amplitude(detail: &Detail) -> f64 {
    detail.widen(Block { elevation: [0.0; 2], moved: 0.0 }).moved
}
