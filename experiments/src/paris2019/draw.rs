//! A mesh drawn with a z-buffer: sun and sky by the vertices' normals, rock pale where it resists.

use glam::DVec3;
use rayon::prelude::*;
use terrain_model::mesh::Mesh;
use terrain_model::scene::CameraPlacement;

/// A picture.
pub struct Drawing {
    /// RGB, row 0 on top.
    pub pixels: Vec<u8>,
    /// The share of pixels that show rock.
    pub covered: f64,
}

const SUN: DVec3 = DVec3::new(-0.55, -0.5, 0.67);
/// Nearer than this nothing is drawn, metres.
const NEAR: f64 = 0.1;

/// Draws `mesh`, whose triangles are to lie in front of the camera; `resistance` tints it, in [0, 1].
pub fn draw(
    mesh: &Mesh,
    camera: &CameraPlacement,
    [width, height]: [usize; 2],
    resistance: impl Fn(DVec3) -> f64 + Sync,
) -> Drawing {
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let scale = 0.5 * height as f64 / libm::tan(0.5 * camera.field_of_view);
    // Pixel x and y, and the reciprocal of the depth, which is linear in the picture.
    let project = |p: DVec3| {
        let v = p - camera.eye;
        let depth = v.dot(forward);
        let at = |axis: DVec3| v.dot(axis) * scale / depth;
        (depth > NEAR).then(|| DVec3::new(0.5 * width as f64 + at(right), 0.5 * height as f64 - at(up), 1.0 / depth))
    };
    let mut depths = vec![0.0f64; width * height];
    // The triangle that each pixel shows, and where on it.
    let mut seen = vec![(u32::MAX, [0.0f64; 3]); width * height];
    let shade = |k: usize| {
        let p = DVec3::from_array(mesh.positions[k]);
        let normal = mesh.normals.as_ref().map_or(DVec3::Z, |normals| DVec3::from_array(normals[k]));
        let light = 0.25 + 0.2 * (0.5 + 0.5 * normal.z) + 0.6 * normal.dot(SUN.normalize()).max(0.0);
        let rho = resistance(p).clamp(0.0, 1.0);
        let rock = DVec3::new(120.0, 88.0, 66.0).lerp(DVec3::new(235.0, 215.0, 180.0), rho);
        rock * light
    };
    for (number, corners) in mesh.triangles.iter().enumerate() {
        let corners = corners.map(|k| k as usize);
        let [Some(a), Some(b), Some(c)] = corners.map(|k| project(DVec3::from_array(mesh.positions[k]))) else {
            continue;
        };
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        // Back faces, and those seen from the side; rows run down the picture.
        if area >= 0.0 {
            continue;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let columns =
            (low.x - 0.5).ceil().max(0.0) as usize..((high.x - 0.5).floor() + 1.0).clamp(0.0, width as f64) as usize;
        let rows =
            (low.y - 0.5).ceil().max(0.0) as usize..((high.y - 0.5).floor() + 1.0).clamp(0.0, height as f64) as usize;
        for j in rows {
            for i in columns.clone() {
                let p = DVec3::new(i as f64 + 0.5, j as f64 + 0.5, 0.0);
                let part = |a: DVec3, b: DVec3| (a - p).truncate().perp_dot((b - p).truncate()) / area;
                let (u, v, w) = (part(b, c), part(c, a), part(a, b));
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let near = u * a.z + v * b.z + w * c.z;
                let pixel = j * width + i;
                if near > depths[pixel] {
                    depths[pixel] = near;
                    seen[pixel] = (number as u32, [u, v, w]);
                }
            }
        }
    }
    let sky = |k: usize| {
        let t = (k / width) as f64 / height as f64;
        DVec3::new(150.0 + 60.0 * t, 180.0 + 40.0 * t, 215.0 + 20.0 * t)
    };
    let colour = |(k, &(number, [u, v, w])): (usize, &(u32, [f64; 3]))| {
        let rock = |[a, b, c]: &[u32; 3]| shade(*a as usize) * u + shade(*b as usize) * v + shade(*c as usize) * w;
        let colour = mesh.triangles.get(number as usize).map_or_else(|| sky(k), rock);
        colour.clamp(DVec3::ZERO, DVec3::splat(255.0)).to_array().map(|c| c as u8)
    };
    let pixels: Vec<[u8; 3]> = seen.par_iter().enumerate().map(colour).collect();
    let pixels = pixels.concat();
    let covered = depths.iter().filter(|depth| **depth > 0.0).count() as f64 / depths.len() as f64;
    Drawing { pixels, covered }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_of_two_triangles_shows_and_backs_do_not() {
        let wall = |y: f64| [[-1.0, y, -1.0], [1.0, y, -1.0], [0.0, y, 1.0]];
        let positions = [wall(0.0), wall(1.0)].concat();
        let camera = CameraPlacement { eye: DVec3::Y * -5.0, target: DVec3::ZERO, field_of_view: 0.4 };
        let made = |triangles: Vec<[u32; 3]>| {
            let mesh = Mesh { positions: positions.clone(), triangles, ..Mesh::default() };
            draw(&mesh, &camera, [40, 40], |p| p.y)
        };
        let (both, near, far) = (made(vec![[3, 4, 5], [0, 1, 2]]), made(vec![[0, 1, 2]]), made(vec![[3, 4, 5]]));
        assert_eq!(both.pixels, near.pixels);
        assert_ne!(near.pixels, far.pixels);
        assert!(near.covered > 0.2);
        assert_eq!(made(vec![[0, 2, 1]]).covered, 0.0);
    }
}
