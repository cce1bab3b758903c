//! A surface in pieces, one for each block of cubes that holds any of it. A block depends on the field within it alone, so
//! after an edit only the blocks that it touches are made again, and their seams fit.

use super::{Lattice, PolygonizeError, Report};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use terrain_model::mesh::Mesh;

/// Cubes a side of a block.
pub(super) const BLOCK: usize = 16;

/// A lattice edge: 20 bits each for z, y and x of its lower corner, 2 for its axis. Keys ascend by z, then y, then x.
pub(super) fn key([x, y, z]: [usize; 3], axis: usize) -> u64 {
    ((((z as u64) << 20 | y as u64) << 20 | x as u64) << 2) | axis as u64
}

/// The block whose cubes begin at an edge's lower corner, as its lowest corner's key.
fn block_of(edge: u64) -> u64 {
    const LOW: u64 = (BLOCK as u64) - 1;
    const CUBE: u64 = (LOW << 40 | LOW << 20 | LOW) << 2 | 3;
    edge & !CUBE
}

/// Corners of triangles at or above this name an edge of another block.
const ELSEWHERE: u32 = 1 << 31;

/// The surface within one block.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Piece {
    /// Position and normal of each vertex.
    vertices: Vec<[DVec3; 2]>,
    triangles: Vec<[u32; 3]>,
    /// Vertices on the block's low faces, by edge: those that other blocks name.
    seam: Vec<(u64, u32)>,
    /// Edges of other blocks, each once.
    elsewhere: Vec<u64>,
}

/// Lattice edges along a side of a block, its far face included.
const SIDE: usize = BLOCK + 1;

/// An edge by its lower corner, counted from its block's lowest, and its axis; those at 16 are another block's. Numbers
/// ascend as keys do.
pub(super) const fn local([x, y, z]: [usize; 3], axis: usize) -> u16 {
    (((z * SIDE + y) * SIDE + x) * 3 + axis) as u16
}

/// Gathers the piece of one block after another: vertices and triangles by edge, then named by number.
pub(super) struct Builder {
    low: [usize; 3],
    /// What names each edge; `u32::MAX` between blocks.
    numbers: Vec<u32>,
    /// The edge of each vertex.
    edges: Vec<u16>,
    vertices: Vec<[DVec3; 2]>,
    triangles: Vec<[u16; 3]>,
}

impl Default for Builder {
    fn default() -> Builder {
        let numbers = vec![u32::MAX; 3 * SIDE * SIDE * SIDE];
        Builder { low: [0; 3], numbers, edges: Vec::new(), vertices: Vec::new(), triangles: Vec::new() }
    }
}

impl Builder {
    /// The block whose lowest corner is `low` comes next.
    pub(super) fn begin(&mut self, low: [usize; 3]) {
        self.low = low;
    }
    pub(super) fn edge(&self, at: [usize; 3], axis: usize) -> u16 {
        local(std::array::from_fn(|k| at[k] - self.low[k]), axis)
    }
    pub(super) fn vertex(&mut self, edge: u16, position: DVec3, normal: DVec3) {
        self.numbers[usize::from(edge)] = self.vertices.len() as u32;
        self.edges.push(edge);
        self.vertices.push([position, normal]);
    }
    pub(super) fn triangle(&mut self, edges: [u16; 3]) {
        self.triangles.push(edges);
    }
    /// The piece with its key, if anything is in it.
    pub(super) fn finish(&mut self) -> Option<(u64, Piece)> {
        if self.triangles.is_empty() && self.vertices.is_empty() {
            return None;
        }
        let (low, numbers) = (self.low, &mut self.numbers);
        let place = |edge: u16| {
            let (corner, axis) = (usize::from(edge) / 3, usize::from(edge) % 3);
            ([corner % SIDE, corner / SIDE % SIDE, corner / (SIDE * SIDE)], axis)
        };
        let whole = |edge: u16| {
            let (at, axis) = place(edge);
            key(std::array::from_fn(|k| low[k] + at[k]), axis)
        };
        let of_seam = self.edges.iter().zip(0..).filter(|(edge, _)| place(**edge).0.contains(&0));
        let mut seam: Vec<(u64, u32)> = of_seam.map(|(&edge, number)| (whole(edge), number)).collect();
        seam.sort_unstable();
        let mut others: Vec<u16> = Vec::new();
        let mut number = |edge: u16| {
            let number = &mut numbers[usize::from(edge)];
            if *number == u32::MAX {
                *number = ELSEWHERE | others.len() as u32;
                others.push(edge);
            }
            *number
        };
        let triangles = self.triangles.iter().map(|edges| edges.map(&mut number)).collect();
        let elsewhere = others.iter().map(|&edge| whole(edge)).collect();
        self.edges.iter().chain(&others).for_each(|&edge| numbers[usize::from(edge)] = u32::MAX);
        let vertices = self.vertices.clone();
        self.edges.clear();
        self.vertices.clear();
        self.triangles.clear();
        Some((key(low, 0), Piece { vertices, triangles, seam, elsewhere }))
    }
}

/// A surface that can be edited and made a mesh.
#[derive(Clone, Debug)]
pub struct Pieces {
    pub(super) lattice: Lattice,
    /// By the key of the block's lowest corner.
    pub(super) pieces: BTreeMap<u64, Piece>,
    /// What making them has cost so far.
    pub(super) report: Report,
}

impl Pieces {
    /// What making and mending the pieces has cost so far.
    pub fn report(&self) -> Report {
        self.report
    }
    /// Blocks that hold some of the surface.
    pub fn count(&self) -> usize {
        self.pieces.len()
    }
    /// Vertices in all pieces.
    pub fn vertices(&self) -> usize {
        self.pieces.values().map(|piece| piece.vertices.len()).sum()
    }
    /// One mesh of all pieces, in the order of their blocks.
    ///
    /// # Errors
    /// [`PolygonizeError::TooMany`] above 2³² − 1 vertices.
    pub fn mesh(&self) -> Result<Mesh, PolygonizeError> {
        let vertices = self.vertices();
        if u32::try_from(vertices).is_err() {
            return Err(PolygonizeError::TooMany { vertices });
        }
        let blocks: Vec<u64> = self.pieces.keys().copied().collect();
        let pieces: Vec<&Piece> = self.pieces.values().collect();
        let mut firsts = Vec::with_capacity(pieces.len());
        let mut first = 0u32;
        for piece in &pieces {
            firsts.push(first);
            first += piece.vertices.len() as u32;
        }
        // Edges of one block come in runs.
        let find = |edge: u64, last: &mut usize| {
            if blocks.get(*last) != Some(&block_of(edge)) {
                *last = blocks.binary_search(&block_of(edge)).ok()?;
            }
            let block = *last;
            let seam = &pieces[block].seam;
            let at = seam.binary_search_by_key(&edge, |vertex| vertex.0).ok()?;
            Some(firsts[block] + seam[at].1)
        };
        // Arrays are written where they end up, in parallel: most of the time goes to their memory.
        let mut triangles = vec![[0u32; 3]; pieces.iter().map(|piece| piece.triangles.len()).sum()];
        let (mut positions, mut normals) = (vec![[0.0; 3]; vertices], vec![[0.0; 3]; vertices]);
        let triangle_parts = parts(&mut triangles, pieces.iter().map(|piece| piece.triangles.len()));
        let position_parts = parts(&mut positions, pieces.iter().map(|piece| piece.vertices.len()));
        let normal_parts = parts(&mut normals, pieces.iter().map(|piece| piece.vertices.len()));
        let whole = pieces
            .par_iter()
            .zip(&firsts)
            .zip(triangle_parts.into_par_iter())
            .zip(position_parts.into_par_iter().zip(normal_parts))
            .map(|(((piece, first), triangles), (positions, normals))| {
                for (k, [position, normal]) in piece.vertices.iter().enumerate() {
                    positions[k] = position.to_array();
                    normals[k] = normal.to_array();
                }
                let mut last = 0;
                let elsewhere: Option<Vec<u32>> = piece.elsewhere.iter().map(|&edge| find(edge, &mut last)).collect();
                let Some(elsewhere) = elsewhere else { return false };
                let number = |corner: u32| {
                    if corner < ELSEWHERE { first + corner } else { elsewhere[(corner - ELSEWHERE) as usize] }
                };
                triangles.iter_mut().zip(&piece.triangles).for_each(|(out, corners)| *out = corners.map(number));
                true
            })
            .reduce(|| true, |a, b| a && b);
        if !whole {
            return Err(PolygonizeError::Seam);
        }
        Ok(Mesh { positions, triangles, normals: Some(normals), attributes: Vec::new() })
    }
}

/// `all` in consecutive parts of these lengths.
fn parts<T>(mut all: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    lengths
        .map(|length| {
            let (part, rest) = std::mem::take(&mut all).split_at_mut(length);
            all = rest;
            part
        })
        .collect()
}
