//! The table of marching cubes, made from one rule: on a face with rock at two opposite corners, rock is apart. Both cubes
//! at a face see the same corners, so their segments there are the same, and the surface is closed.
//!
//! Corner c of a cube stands at (c & 1, c >> 1 & 1, c >> 2). Edge 4a + k runs along axis a.

use std::sync::LazyLock;

/// The two corners of each edge, lower first.
pub const EDGES: [[usize; 2]; 12] = {
    let mut edges = [[0; 2]; 12];
    let mut e = 0;
    while e < 12 {
        let (axis, k) = (e / 4, e % 4);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let low = ((k & 1) << u) | ((k >> 1) << v);
        edges[e] = [low, low | (1 << axis)];
        e += 1;
    }
    edges
};

/// The triangles of each of the 256 sets of rock corners, as edges, counter-clockwise seen from the air.
pub static TRIANGLES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..256).map(triangles).collect());

/// Corners of the face of `side` (0 or 1) across `axis`, counter-clockwise seen from outside the cube.
fn face(axis: usize, side: usize) -> [usize; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |a: usize, b: usize| (side << axis) | (a << u) | (b << v);
    let around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    if side == 1 { around } else { [around[0], around[3], around[2], around[1]] }
}

fn edge_between(a: usize, b: usize) -> usize {
    let ends = [a.min(b), a.max(b)];
    EDGES.iter().position(|edge| *edge == ends).unwrap_or(usize::MAX)
}

/// Directed segments over all faces: along each run of rock corners, from where it is entered to where it is left.
fn segments(rock: usize) -> Vec<[usize; 2]> {
    let is_rock = |c: usize| rock >> c & 1 == 1;
    let mut found = Vec::new();
    for k in 0..6 {
        let corners = face(k / 2, k % 2);
        for first in 0..4 {
            let before = corners[(first + 3) % 4];
            if is_rock(corners[first]) && !is_rock(before) {
                let mut last = first;
                while is_rock(corners[(last + 1) % 4]) {
                    last += 1;
                }
                let enter = edge_between(before, corners[first]);
                let leave = edge_between(corners[last % 4], corners[(last + 1) % 4]);
                found.push([enter, leave]);
            }
        }
    }
    found
}

fn loops(rock: usize) -> Vec<Vec<usize>> {
    let mut next = [None; 12];
    segments(rock).into_iter().for_each(|[a, b]| next[a] = Some(b));
    let mut loops = Vec::new();
    for start in 0..12 {
        let mut one = Vec::new();
        let mut at = start;
        while let Some(to) = next[at].take() {
            one.push(at);
            at = to;
        }
        if !one.is_empty() {
            loops.push(one);
        }
    }
    loops
}

/// Do two edges lie on one face? Then a diagonal between them would lie there too, and the neighbour could have it as well.
fn share_a_face(a: usize, b: usize) -> bool {
    let ends = [EDGES[a], EDGES[b]].concat();
    (0..3).any(|axis| (0..2).any(|side| ends.iter().all(|c| c >> axis & 1 == side)))
}

/// Triangulates `polygon` without diagonals in faces, if that is possible: the triangle over its last side splits it.
fn triangulate(polygon: &[usize]) -> Option<Vec<[u8; 3]>> {
    let n = polygon.len();
    if n < 3 {
        return Some(Vec::new());
    }
    let side = |i: usize, j: usize| j == i + 1 || !share_a_face(polygon[i], polygon[j]);
    (1..n - 1).find_map(|k| {
        if !(side(0, k) && side(k, n - 1)) {
            return None;
        }
        let mut all = triangulate(&polygon[..=k])?;
        all.extend(triangulate(&polygon[k..])?);
        all.push([polygon[0] as u8, polygon[k] as u8, polygon[n - 1] as u8]);
        Some(all)
    })
}

fn triangles(rock: usize) -> Vec<[u8; 3]> {
    // Every loop has such a triangulation: a test asks all 256.
    loops(rock).iter().flat_map(|one| triangulate(one).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loop_is_triangulated_without_diagonals_in_faces() {
        for rock in 0..256 {
            let expected: usize = loops(rock).iter().map(|one| one.len() - 2).sum();
            assert_eq!(TRIANGLES[rock].len(), expected, "{rock:08b}");
            let borders = segments(rock);
            let mut sides: Vec<[usize; 2]> = Vec::new();
            for t in &TRIANGLES[rock] {
                let t = t.map(usize::from);
                sides.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
            }
            for side in &sides {
                let back = sides.iter().filter(|other| **other == [side[1], side[0]]).count();
                let forth = sides.iter().filter(|other| *other == side).count();
                let border = borders.contains(side);
                assert_eq!((forth, back), (1, usize::from(!border)), "{rock:08b}: {side:?}");
                assert!(border || !share_a_face(side[0], side[1]));
            }
            assert!(borders.iter().all(|border| sides.contains(border)), "{rock:08b}");
        }
    }

    #[test]
    fn every_edge_with_one_end_in_rock_is_crossed_once() {
        for rock in 0..256usize {
            let crossed: Vec<usize> =
                (0..12).filter(|&e| (rock >> EDGES[e][0] & 1) != (rock >> EDGES[e][1] & 1)).collect();
            let mut used: Vec<usize> = loops(rock).concat();
            used.sort_unstable();
            assert_eq!(used, crossed);
        }
    }

    #[test]
    fn one_rock_corner_faces_the_air() {
        // Corner 0 is rock: the normal of its triangle points to (1, 1, 1).
        let middle = |e: u8| {
            let [a, b] = EDGES[usize::from(e)];
            let at = |c: usize| glam::DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
            (at(a) + at(b)) * 0.5
        };
        let [a, b, c] = TRIANGLES[1][0].map(middle);
        assert!((b - a).cross(c - a).dot(glam::DVec3::ONE) > 0.0);
    }
}
