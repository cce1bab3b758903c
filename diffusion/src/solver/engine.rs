//! Who solves a system: the processor, or a device that takes the same equations and answers to the same tolerance.

use super::SolveError;
use super::cycle::{Cycle, Smoother};
use super::equations::Equations;
use super::krylov::{Progress, Stop, bicgstab, conjugate_gradients};
use crate::plane::Plane;

/// What a solver may take for granted of an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It is its own transpose, and positive.
    Symmetric,
    /// It carries values along a direction.
    Directed,
}

/// Solves systems.
pub trait Engine {
    /// Solves `equations` for the K fields in `values`, from what they hold: what is given, and a first guess elsewhere. A tolerance
    /// that is not met is no error; the progress says so.
    ///
    /// # Errors
    /// [`SolveError::Singular`]; [`SolveError::Device`] when the device fails.
    fn solve<const K: usize>(
        &mut self,
        kind: Kind,
        equations: &Equations,
        values: &mut Plane<f64, K>,
        stop: Stop,
    ) -> Result<Progress<K>, SolveError>;
}

/// Conjugate gradients, and BiCGStab where there is a direction, around the cycle in `f32`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Processor;

impl Engine for Processor {
    fn solve<const K: usize>(
        &mut self,
        kind: Kind,
        equations: &Equations,
        values: &mut Plane<f64, K>,
        stop: Stop,
    ) -> Result<Progress<K>, SolveError> {
        match kind {
            Kind::Symmetric => {
                let mut cycle = Cycle::<K>::new(equations, Smoother::FourColours)?;
                Ok(conjugate_gradients(equations, &mut cycle, values, stop))
            }
            Kind::Directed => {
                let mut cycle = Cycle::<K>::new(equations, Smoother::FourDirections)?;
                Ok(bicgstab(equations, &mut cycle, values, stop))
            }
        }
    }
}
