//! A regular mesh of a terrain in f64: the plain counterpart of the adaptive ones, and what they are compared with.

use super::deviation::Gauge;
use super::{Mesh, MeshError};
use crate::bounds::THRESHOLD;
use crate::program::{Evaluator, Program};
use glam::DVec2;
use rayon::prelude::*;

/// The mesh through `columns` × `rows` samples (at least 2 each) of the rectangle, its border included; each cell is
/// split from south-west to north-east. A triangle is kept when its three corners lie on the terrain.
///
/// # Errors
/// [`MeshError::Settings`] for a rectangle without area or too few samples; [`MeshError::TooMany`] above 2³² − 1.
pub fn regular(program: &Program, [low, high]: [DVec2; 2], [columns, rows]: [usize; 2]) -> Result<Mesh, MeshError> {
    const UNUSED: u32 = u32::MAX;
    MeshError::refuse(low, high, 1.0)?;
    if columns < 2 || rows < 2 {
        return Err(MeshError::Settings { problem: "samples of a regular mesh", expected: "at least 2 a side" });
    }
    let samples = columns.saturating_mul(rows);
    if u32::try_from(samples).is_err() {
        return Err(MeshError::TooMany { vertices: samples });
    }
    let along = |k: usize, count: usize, axis: usize| {
        let share = k as f64 / (count - 1) as f64;
        if k + 1 == count { high[axis] } else { low[axis] + (high[axis] - low[axis]) * share }
    };
    let vertices: Vec<[f64; 3]> = (0..samples)
        .into_par_iter()
        .map_init(
            || Evaluator::<f64>::new(program),
            |evaluator, k| {
                let p = DVec2::new(along(k % columns, columns, 0), along(k / columns, rows, 1));
                let (elevation, weight) = evaluator.height(program, p);
                [p.x, p.y, if weight >= THRESHOLD { elevation } else { f64::NAN }]
            },
        )
        .collect();
    let mut mesh = Mesh::default();
    let mut numbers = vec![UNUSED; samples];
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let [sw, se, nw, ne] = [0, 1, columns, columns + 1].map(|step| j * columns + i + step);
            for triangle in [[sw, se, ne], [sw, ne, nw]] {
                if triangle.iter().any(|&k| vertices[k][2].is_nan()) {
                    continue;
                }
                mesh.triangles.push(triangle.map(|k| {
                    if numbers[k] == UNUSED {
                        numbers[k] = mesh.positions.len() as u32;
                        mesh.positions.push(vertices[k]);
                    }
                    numbers[k]
                }));
            }
        }
    }
    Ok(mesh)
}

/// Does some triangle of a sound mesh lie further than `tolerance` from the field at one of a few points? Then it does;
/// that it was not noticed proves nothing.
pub fn refuted(program: &Program, mesh: &Mesh, tolerance: f64) -> bool {
    mesh.triangles
        .par_iter()
        .map_init(
            || Gauge::new(program),
            |gauge, triangle| gauge.exceeds(&triangle.map(|index| mesh.positions[index as usize]), tolerance),
        )
        .any(|exceeds| exceeds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cracks::{Cracks, cracks};
    use crate::mesh::deviation::certify;
    use crate::mesh::tests::{disc, hills};
    use crate::tree::Tree;

    #[test]
    fn vertices_lie_on_the_field_and_triangles_on_the_terrain() {
        let program = hills();
        let mesh = regular(&program, [DVec2::ZERO, DVec2::new(64.0, 48.0)], [17, 13]).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (17 * 13, 2 * 16 * 12));
        assert_eq!(cracks(&mesh), Cracks::default());
        assert!(mesh.positions.iter().all(|&[x, y, z]| program.height(DVec2::new(x, y)).0 == z));

        let mut tree = Tree::new();
        let root = tree.push(disc((0.0, 0.0), 10.0, 5.0, None));
        let disc = Program::compile(&tree, root).unwrap();
        let mesh = regular(&disc, [DVec2::splat(-12.0), DVec2::splat(12.0)], [49, 49]).unwrap();
        assert!(mesh.triangles.len() > 100 && mesh.positions.iter().all(|p| p[2] == 5.0));
        assert!(regular(&disc, [DVec2::ZERO, DVec2::ONE], [1, 2]).is_err());
    }

    #[test]
    fn what_points_refute_no_proof_upholds() {
        let program = hills();
        let mesh = regular(&program, [DVec2::ZERO, DVec2::new(64.0, 48.0)], [33, 25]).unwrap();
        let found = certify(&program, &mesh, 1e-3, 4);
        assert!(refuted(&program, &mesh, 0.1) && found.at_least > 1e-3);
        assert!(!refuted(&program, &mesh, found.at_most));
    }
}
