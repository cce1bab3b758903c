//! Tree → program: checks every node, derives what is costly at run time, concatenates consecutive affines.

use super::{Instruction, Program};
use crate::noise::Octave;
use crate::operator::AFFINE_WIDTH;
use crate::primitive::curve::{self, MAX_SEGMENTS};
use crate::primitive::image::Image;
use crate::profile;
use crate::tree::{Node, NodeId, Similarity, Tree};
use glam::DVec2;
use std::sync::Arc;

/// Why a tree cannot be compiled: the node and what is wrong with it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("node {node}: {problem}")]
pub struct CompileError {
    /// Index in the arena.
    pub node: usize,
    /// What was expected.
    pub problem: String,
}

/// Instructions of one program: an instance costs its instructions again, its parameters only once.
const MAX_INSTRUCTIONS: usize = 1 << 22;

struct Compiler<'a> {
    tree: &'a Tree,
    code: Vec<Instruction>,
    parameters: Vec<f64>,
    images: Vec<Arc<Image>>,
    octaves: Vec<Octave<2>>,
    placed: Vec<Option<u32>>,
    placed_octaves: Vec<Option<u32>>,
    depth: [usize; 2],
    deepest: [usize; 2],
}

impl Program {
    /// Compiles the subtree below `root`.
    ///
    /// # Errors
    /// When a node's parameters are out of range, or instances multiply past 2²² instructions.
    pub fn compile(tree: &Tree, root: NodeId) -> Result<Program, CompileError> {
        let mut compiler = Compiler {
            tree,
            code: Vec::new(),
            parameters: Vec::new(),
            images: Vec::new(),
            octaves: Vec::new(),
            placed: vec![None; tree.len()],
            placed_octaves: vec![None; tree.len()],
            depth: [0, 1],
            deepest: [0, 1],
        };
        compiler.emit(root)?;
        Ok(Program {
            code: compiler.code,
            parameters: Arc::new(compiler.parameters),
            images: Arc::new(compiler.images),
            octaves: Arc::new(compiler.octaves),
            depth: compiler.deepest,
        })
    }
}

impl Compiler<'_> {
    fn emit(&mut self, id: NodeId) -> Result<(), CompileError> {
        let fail = |problem: &str| Err(CompileError { node: id.index(), problem: problem.to_owned() });
        if self.code.len() > MAX_INSTRUCTIONS {
            return fail("instances multiply past 4 million instructions; nest fewer levels of instances");
        }
        let tree = self.tree;
        match tree.node(id) {
            Node::Disc { centre, radius, weight, noise } => {
                if !(centre.is_finite() && *radius > 0.0 && radius.is_finite() && *weight > 0.0 && weight.is_finite()) {
                    return fail("a disc needs a finite centre, a positive radius and a positive weight");
                }
                let at = self.place(id, |out| {
                    out.extend([centre.x, centre.y, 1.0 / (radius * radius), *weight, centre.z + 0.0]);
                    if let Some(n) = noise {
                        // The compact form of the octaves; the table below follows from it.
                        let o = n.octaves;
                        out.extend([o.frequency, o.lacunarity, o.amplitude, o.gain, f64::from(n.seed)]);
                        out.extend(n.combination.constants());
                    }
                });
                match noise {
                    None => self.code.push(Instruction::Disc { at }),
                    Some(n) => {
                        if !n.octaves.is_sound() {
                            return fail(
                                "noise needs 1 to 16 octaves, a positive frequency and lacunarity, a gain of at least 0",
                            );
                        }
                        let first = *self.placed_octaves[id.index()].get_or_insert_with(|| {
                            let first = self.octaves.len() as u32;
                            self.octaves.extend(n.octaves.place(n.seed, [0.0; 2]));
                            first
                        });
                        let octaves = n.octaves.octaves;
                        self.code.push(Instruction::NoiseDisc { at, combination: n.combination, first, octaves });
                    }
                }
                self.pushed();
            }
            Node::Curve { points, radius, weight, joint, profile: knots } => {
                if points.len() < 2 || points.len() > MAX_SEGMENTS + 1 || !points.iter().all(|p| p.is_finite()) {
                    return fail("a curve needs 2 to 65 finite points; blend several curves for more");
                }
                if !(*radius > 0.0
                    && radius.is_finite()
                    && *weight > 0.0
                    && weight.is_finite()
                    && *joint > 0.0
                    && joint.is_finite())
                {
                    return fail("a curve needs a positive radius, weight and joint");
                }
                if !knots.windows(2).all(|k| k[0].distance < k[1].distance)
                    || !knots.iter().all(|k| k.distance.is_finite() && k.height.is_finite() && k.slope.is_finite())
                {
                    return fail("the knots of a profile need increasing, finite distances");
                }
                if points.windows(2).any(|p| p[0].truncate() == p[1].truncate()) {
                    return fail("two consecutive points of a curve stand at the same place");
                }
                let pieces = profile::compile(knots);
                let count = (pieces.len() / profile::PIECE_WIDTH) as u16;
                let at = self.place(id, |out| {
                    let first = out.len();
                    out.extend([1.0 / (radius * radius), *weight, 1.0 / (joint * joint), f64::INFINITY]);
                    for pair in points.windows(2) {
                        let d = pair[1].truncate() - pair[0].truncate();
                        let length = d.length();
                        let grade = (pair[1].z - pair[0].z) / length;
                        out.extend([pair[0].x, pair[0].y, pair[0].z, d.x / length, d.y / length, length, grade]);
                    }
                    out.extend(&pieces);
                    let slope = curve::support_slope(&out[first..], points.len() - 1, usize::from(count));
                    out[first + 3] = slope;
                });
                self.code.push(Instruction::Curve { at, segments: (points.len() - 1) as u16, pieces: count });
                self.pushed();
            }
            Node::Image { image, origin, spacing, margin, weight, elevation_scale, elevation_offset } => {
                let cells = DVec2::new(image.width() as f64 - 1.0, image.height() as f64 - 1.0);
                let half = cells * *spacing * 0.5;
                let placed = origin.is_finite() && spacing.is_finite() && spacing.min_element() > 0.0;
                let weighs = *weight > 0.0 && weight.is_finite();
                if !(placed && weighs && elevation_scale.is_finite() && elevation_offset.is_finite()) {
                    return fail("an image needs a finite origin, positive spacing and weight");
                }
                if !(*margin > 0.0 && *margin <= half.min_element()) {
                    return fail("the margin of an image must be positive and at most half its smaller side");
                }
                let index = self.images.iter().position(|known| Arc::ptr_eq(known, image)).unwrap_or_else(|| {
                    self.images.push(image.clone());
                    self.images.len() - 1
                });
                let Ok(index) = u16::try_from(index) else { return fail("a scene holds at most 65536 images") };
                let at = self.place(id, |out| {
                    let centre = *origin + half;
                    out.extend([origin.x, origin.y, 1.0 / spacing.x, 1.0 / spacing.y, 0.0, 0.0, centre.x, centre.y]);
                    out.extend([half.x, half.y, 1.0 / margin, *weight, *elevation_scale, elevation_offset + 0.0]);
                });
                self.code.push(Instruction::Image { at, image: index, base: [0, 0] });
                self.pushed();
            }
            Node::Blend(list) => {
                let Ok(count) = u16::try_from(list.len()) else { return fail("a blend takes at most 65535 operands") };
                if count == 0 {
                    return fail("a blend needs at least one operand");
                }
                for operand in list {
                    self.emit(*operand)?;
                }
                self.code.push(Instruction::Blend { operands: count });
                self.depth[0] -= usize::from(count) - 1;
            }
            Node::Replace { a, b, rule } => {
                self.emit(*a)?;
                self.emit(*b)?;
                self.code.push(Instruction::Replace { rule: *rule });
                self.depth[0] -= 1;
            }
            Node::Add { a, b, rule } => {
                self.emit(*a)?;
                self.emit(*b)?;
                self.code.push(Instruction::Add { rule: *rule });
                self.depth[0] -= 1;
            }
            Node::Affine { node, map } => {
                let (mut map, mut inner) = (*map, *node);
                while let Node::Affine { node: below, map: first } = tree.node(inner) {
                    map = map.after(first);
                    inner = *below;
                }
                let finite =
                    [map.scale, map.rotation, map.elevation_scale, map.elevation_offset].iter().all(|v| v.is_finite());
                if !finite || map.scale <= 0.0 || !map.translation.is_finite() {
                    return fail("an affine map needs a positive scale and finite values");
                }
                let parameters = map.inverse_parameters();
                let at = self.parameters.len() as u32;
                self.parameters.extend(parameters);
                self.code.push(Instruction::Enter { at });
                self.depth[1] += 1;
                self.deepest[1] = self.deepest[1].max(self.depth[1]);
                self.emit(inner)?;
                self.depth[1] -= 1;
                self.code.push(Instruction::Leave { at });
            }
        }
        Ok(())
    }
    fn pushed(&mut self) {
        self.depth[0] += 1;
        self.deepest[0] = self.deepest[0].max(self.depth[0]);
    }
    /// The parameters of a primitive, stored once however often it is used.
    fn place(&mut self, id: NodeId, fill: impl FnOnce(&mut Vec<f64>)) -> u32 {
        *self.placed[id.index()].get_or_insert_with(|| {
            let at = self.parameters.len() as u32;
            fill(&mut self.parameters);
            at
        })
    }
}

impl Similarity {
    /// This map applied after `first`: consecutive affines are one (Génevaux 2015 §5.4).
    pub fn after(&self, first: &Similarity) -> Similarity {
        let turned = DVec2::new(libm::cos(self.rotation), libm::sin(self.rotation)).rotate(first.translation);
        Similarity {
            scale: self.scale * first.scale,
            rotation: self.rotation + first.rotation,
            translation: self.translation + turned * self.scale,
            elevation_scale: self.elevation_scale * first.elevation_scale,
            elevation_offset: self.elevation_scale * first.elevation_offset + self.elevation_offset,
        }
    }
    fn inverse_parameters(&self) -> [f64; AFFINE_WIDTH] {
        let (c, s) = (libm::cos(self.rotation) / self.scale, libm::sin(self.rotation) / self.scale);
        let t = self.translation;
        let shift = [-(c * t.x + s * t.y), -(c * t.y - s * t.x)];
        [c, s, -s, c, shift[0], shift[1], self.elevation_scale, self.elevation_offset + 0.0]
    }
}
