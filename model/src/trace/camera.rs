//! A pinhole camera.

use super::Ray;
use crate::scene::CameraPlacement;
use glam::DVec3;

/// A pinhole camera with square pixels. Row 0 is the top row.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    width: usize,
    height: usize,
}

impl Camera {
    /// A camera of `width` × `height` pixels; z is up (the view's up is y when it looks straight down or up).
    pub fn new(placement: &CameraPlacement, width: usize, height: usize) -> Camera {
        let forward = (placement.target - placement.eye).normalize();
        let side = forward.cross(DVec3::Z);
        let right = if side.length() < 1e-9 { DVec3::X } else { side.normalize() };
        let up = right.cross(forward);
        let half = libm::tan(0.5 * placement.field_of_view);
        let aspect = width as f64 / height as f64;
        Camera { eye: placement.eye, forward, right: right * half * aspect, up: up * half, width, height }
    }
    /// Pixels along a row.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }
    /// Angle between the middle of the picture and the next pixel, radians.
    pub fn pixel(&self) -> f64 {
        2.0 * self.up.length() / self.height as f64
    }
    /// The ray through (x, y) in pixels; the centre of pixel (i, j) is (i + 0.5, j + 0.5).
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let (u, v) = (2.0 * x / self.width as f64 - 1.0, 1.0 - 2.0 * y / self.height as f64);
        Ray { origin: self.eye, direction: (self.forward + self.right * u + self.up * v).normalize() }
    }
}
