//! The displaced surface relative to the eye of one camera: [`Detail`]'s own formula on other coordinates, which are small where
//! they matter. On `f64` it is what [`Refinement::position`] gives, and on `Rounded` it derives how far
//! `shaders/tessellate/displace.wgsl` may land from it.
//!
//! Coordinates in the plane are an integer difference of vertices, exact in `f32`, times the metres of a grid unit, less the eye
//! from its nearest vertex. Noise is read on lattices moved to the eye: an octave that has not faded has waves of no less than
//! twice the wanted edge, so its coordinates are at most focal ÷ (2 · target), however far the vertex is, and `f32` keeps them.

use super::displace::{Detail, upright};
use super::ground::{Ground, Place, dot3};
use super::refine::Refinement;
use super::triangle::Vertex;
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::noise::NoiseJet;

/// The displaced surface that one camera sees.
pub struct Surface<'a> {
    pub(super) ground: &'a Ground,
    /// Its noise, seen from the eye.
    pub(super) detail: Detail,
    pub(super) origin: Vertex,
    /// x and y from the origin, elevation.
    pub(super) eye: [f64; 3],
    /// Wanted edge over distance.
    pub(super) size: f64,
}

/// Metres from the eye, and the unit normal.
pub type Point<R> = [[R; 3]; 2];

impl<'a> Surface<'a> {
    /// Of `refinement`; positions are computed from the grid vertex `origin`.
    pub fn new(refinement: &Refinement<'a>, origin: Vertex) -> Surface<'a> {
        let (ground, view) = (refinement.ground(), refinement.view());
        let from = ground.metres(origin);
        let eye = [view.eye[0] - from[0], view.eye[1] - from[1], view.eye[2]];
        let detail = refinement.detail().seen_from(view.eye);
        Surface { ground, detail, origin, eye, size: refinement.target() / view.focal }
    }
    /// Position and normal of `vertex`.
    pub fn point<R: Differentiable + NoiseJet>(&self, vertex: Vertex) -> Point<R> {
        let on = self.ground.smooth_at(&self.place::<R>(vertex));
        let at = on.position.map(|x| x.value);
        // The band limit does not vary.
        let size = Dual::fixed(R::constant(self.size) * dot3(at, at).sqrt());
        let surface = self.detail.moved(&on, size);
        [surface.map(|x| x.value), upright(surface, &on)]
    }
    fn place<R: Differentiable>(&self, vertex: Vertex) -> Place<Dual<R, 2>> {
        let (cell, share) = self.ground.cell(vertex);
        let (vertex, unit, spacing) = (self.ground.within(vertex), self.ground.unit(), self.ground.spacing());
        let plan = [0, 1].map(|k| {
            let steps = R::constant(f64::from(vertex[k]) - f64::from(self.origin[k]));
            let mut slope = [R::zero(); 2];
            slope[k] = R::constant(spacing[k]);
            Dual { value: steps * R::constant(unit[k]) - R::constant(self.eye[k]), slope }
        });
        let share = [0, 1].map(|k| Dual::variable(R::constant(share[k]), k));
        Place { cell, share, plan, datum: self.eye[2] }
    }
}
