//! Tree → program: checks every node, derives what is costly at run time, concatenates consecutive affines.

use super::layout::depth;
use super::{Certified, Instruction, Layout, Program};
use crate::operator::affine::Similarity;
use crate::operator::{Map, Operator, add, blend, replace};
use crate::primitive::{Authored, Code};
use crate::tree::{Node, NodeId, Tree};
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
    layout: Layout,
    /// What a primitive was compiled to: its parameters are stored once however often it is used.
    placed: Vec<Option<Code>>,
}

impl Program {
    /// Compiles the subtree below `root`.
    ///
    /// # Errors
    /// When a node's parameters are out of range, or instances multiply past 2²² instructions.
    pub fn compile(tree: &Tree, root: NodeId) -> Result<Program, CompileError> {
        Program::compile_with(tree, root, &Certified::default())
    }
    /// [`Program::compile`], the same to the bit, that certifies no slope again which `certified` knows and tells it the others.
    ///
    /// # Errors
    /// As [`Program::compile`].
    pub fn compile_with(tree: &Tree, root: NodeId, certified: &Certified) -> Result<Program, CompileError> {
        let (code, layout) = (Vec::new(), Layout { certified: certified.clone(), ..Layout::default() });
        let mut compiler = Compiler { tree, code, layout, placed: vec![None; tree.len()] };
        compiler.emit(root)?;
        let Compiler { code, layout, .. } = compiler;
        let depth = depth(&code);
        Ok(Program {
            code,
            parameters: Arc::new(layout.parameters),
            images: Arc::new(layout.images),
            octaves: Arc::new(layout.octaves),
            noises: Arc::new(layout.noises),
            depth,
        })
    }
}

impl Compiler<'_> {
    fn emit(&mut self, id: NodeId) -> Result<(), CompileError> {
        let fail = |problem: &str| CompileError { node: id.index(), problem: problem.to_owned() };
        if self.code.len() > MAX_INSTRUCTIONS {
            return Err(fail("instances multiply past 4 million instructions; nest fewer levels of instances"));
        }
        let tree = self.tree;
        match tree.node(id) {
            Node::Primitive(primitive) => {
                let code = match self.placed[id.index()] {
                    Some(code) => code,
                    None => primitive.compile(&mut self.layout).map_err(|problem| fail(&problem))?,
                };
                self.placed[id.index()] = Some(code);
                self.code.push(Instruction::Leaf(code));
            }
            Node::Blend(list) => {
                let Some(operands) = u32::try_from(list.len()).ok().filter(|count| *count > 0) else {
                    return Err(fail("a blend needs at least one operand"));
                };
                self.combine(list, Operator::Blend(blend::Code { operands }))?;
            }
            Node::Replace { a, b, rule } => {
                self.combine(&[*a, *b], Operator::Replace(replace::Code { rule: *rule }))?;
            }
            Node::Add { a, b, rule } => {
                self.combine(&[*a, *b], Operator::Add(add::Code { rule: *rule }))?;
            }
            Node::Lod { a, b, lod } => {
                let code = lod.compile(&mut self.layout).map_err(|problem| fail(&problem))?;
                self.combine(&[*a, *b], Operator::Lod(code))?;
            }
            Node::Masked { a, b, mask } => {
                let code = mask.compile(&mut self.layout).map_err(|problem| fail(&problem))?;
                self.emit(*a)?;
                for translation in mask.probes() {
                    let aside = Similarity { translation, ..Similarity::default() };
                    let aside = aside.compile(&mut self.layout).map_err(|problem| fail(&problem))?;
                    self.within(Map::Affine(aside), *a)?;
                }
                self.emit(*b)?;
                self.code.push(Instruction::Combine(Operator::Masked(code)));
            }
            Node::Warp { node, warp } => {
                let code = warp.compile(&mut self.layout);
                self.within(Map::Warp(code), *node)?;
            }
            Node::Affine { node, map } => {
                let (mut map, mut inner) = (*map, *node);
                while let Node::Affine { node: below, map: first } = tree.node(inner) {
                    map = map.after(first);
                    inner = *below;
                }
                let code = map.compile(&mut self.layout).map_err(|problem| fail(&problem))?;
                self.within(Map::Affine(code), inner)?;
            }
        }
        Ok(())
    }
    fn combine(&mut self, operands: &[NodeId], operator: Operator) -> Result<(), CompileError> {
        for operand in operands {
            self.emit(*operand)?;
        }
        self.code.push(Instruction::Combine(operator));
        Ok(())
    }
    fn within(&mut self, map: Map, inner: NodeId) -> Result<(), CompileError> {
        self.code.push(Instruction::Enter(map));
        self.emit(inner)?;
        self.code.push(Instruction::Leave(map));
        Ok(())
    }
}
