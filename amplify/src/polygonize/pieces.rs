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
    /// Edges of other blocks.
    elsewhere: Vec<u64>,
}

/// Gathers a piece: vertices and triangles by edge, then named by number.
pub(super) struct Builder {
    low: [usize; 3],
    /// Number of the vertex on each edge of the block.
    numbers: Vec<u32>,
    vertices: Vec<[DVec3; 2]>,
    seam: Vec<(u64, u32)>,
    triangles: Vec<[u64; 3]>,
}

impl Builder {
    pub(super) fn new(low: [usize; 3]) -> Builder {
        Builder { low, numbers: Vec::new(), vertices: Vec::new(), seam: Vec::new(), triangles: Vec::new() }
    }
    pub(super) fn vertex(&mut self, at: [usize; 3], axis: usize, position: DVec3, normal: DVec3) {
        if self.numbers.is_empty() {
            self.numbers = vec![u32::MAX; 3 * BLOCK * BLOCK * BLOCK];
        }
        let number = self.vertices.len() as u32;
        let local: [usize; 3] = std::array::from_fn(|k| at[k] - self.low[k]);
        self.numbers[((local[2] * BLOCK + local[1]) * BLOCK + local[0]) * 3 + axis] = number;
        self.vertices.push([position, normal]);
        if local.contains(&0) {
            self.seam.push((key(at, axis), number));
        }
    }
    pub(super) fn triangle(&mut self, edges: [u64; 3]) {
        self.triangles.push(edges);
    }
    /// The piece with its key, if anything is in it.
    pub(super) fn finish(mut self) -> Option<(u64, Piece)> {
        if self.triangles.is_empty() && self.vertices.is_empty() {
            return None;
        }
        self.seam.sort_unstable();
        let mut elsewhere = Vec::new();
        let block = key(self.low, 0);
        let mut number = |edge: u64| {
            if block_of(edge) == block {
                let at = |shift: u32| (edge >> shift) as usize & (BLOCK - 1);
                let axis = (edge & 3) as usize;
                return self.numbers[((at(42) * BLOCK + at(22)) * BLOCK + at(2)) * 3 + axis];
            }
            elsewhere.push(edge);
            ELSEWHERE | (elsewhere.len() - 1) as u32
        };
        let triangles = self.triangles.iter().map(|edges| edges.map(&mut number)).collect();
        Some((block, Piece { vertices: self.vertices, triangles, seam: self.seam, elsewhere }))
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
        let find = |edge: u64| {
            let block = blocks.binary_search(&block_of(edge)).ok()?;
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
                let elsewhere: Option<Vec<u32>> = piece.elsewhere.iter().map(|&edge| find(edge)).collect();
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
