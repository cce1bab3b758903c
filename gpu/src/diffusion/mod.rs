//! Feature curves diffused on the device (Hnaidi 2010 §5): the paper's schedule of Jacobi iterations, and the converged fields by the
//! processor's own multigrid hierarchy. Curves are drawn and hierarchies built by the processor; what iterates is the device.

mod cascade;
pub mod compare;
mod kernels;
mod levels;
mod multigrid;
pub mod work;

#[cfg(test)]
mod tests;

pub use kernels::{SOURCES, Source};

use crate::context::{Context, ContextError};
use kernels::Edit;
use multigrid::Multigrid;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Fields, Settings, Solver, diffuse_on};
use terrain_diffusion::raster::Domain;
use terrain_diffusion::solver::SolveError;

/// The device could not diffuse.
#[derive(Debug, thiserror::Error)]
pub enum DiffusionError {
    /// A buffer does not fit a binding.
    #[error("{what} take {bytes} bytes; a binding of this device holds {limit}: use fewer nodes, or the processor")]
    TooLarge {
        /// Which.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The most the device binds.
        limit: u64,
    },
    /// Coarse rasters of one that is very long have too many nodes to be solved directly.
    #[error("a raster of {width} × {height} nodes is too narrow for the device: use the processor")]
    Narrow {
        /// Nodes from west to east.
        width: usize,
        /// Rows from south to north.
        height: usize,
    },
    /// A kernel was asked for that is not there.
    #[error("the crate has no such kernel")]
    NoKernel,
    /// The device failed.
    #[error(transparent)]
    Context(#[from] ContextError),
}

/// The compiled kernels of one device.
#[derive(Debug)]
pub struct Diffuser<'c> {
    context: &'c Context,
    multigrid: levels::Kernels,
    cascade: cascade::Kernels,
}

impl<'c> Diffuser<'c> {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// When the device refuses one.
    pub fn new(context: &'c Context) -> Result<Diffuser<'c>, DiffusionError> {
        Diffuser::compile(context, &|_, text| text.to_owned())
    }

    /// The same with a fault in the kernel of that name: the first `from` in its text is replaced by `to`. For controls.
    ///
    /// # Errors
    /// [`DiffusionError::NoKernel`] when there is none or it has no such text; when the device refuses one.
    pub fn perturbed(context: &'c Context, name: &str, from: &str, to: &str) -> Result<Diffuser<'c>, DiffusionError> {
        let there = SOURCES.iter().any(|source| source.name == name && source.text.contains(from));
        if !there {
            return Err(DiffusionError::NoKernel);
        }
        Diffuser::compile(context, &|kernel, text| {
            if kernel == name { text.replacen(from, to, 1) } else { text.to_owned() }
        })
    }

    fn compile(context: &'c Context, edit: Edit<'_>) -> Result<Diffuser<'c>, DiffusionError> {
        let (multigrid, cascade) = (levels::Kernels::new(context, edit)?, cascade::Kernels::new(context, edit)?);
        Ok(Diffuser { context, multigrid, cascade })
    }

    /// Diffuses what `curves` give over `domain`, as `terrain_diffusion::fields::diffuse` does: [`Solver::Paper`] and
    /// [`Solver::Corrected`] in `f32`, the others to the same residual, which is measured in `f64`.
    ///
    /// # Errors
    /// As there; [`SolveError::Device`] holds a [`DiffusionError`].
    pub fn diffuse(&self, curves: &[Curve], domain: Domain, settings: &Settings) -> Result<Fields, SolveError> {
        if matches!(settings.solver, Solver::Paper | Solver::Corrected) {
            return cascade::run(self.context, &self.cascade, curves, domain, settings.solver.update(), None);
        }
        let mut engine = Multigrid { context: self.context, kernels: &self.multigrid };
        diffuse_on(curves, domain, settings, &mut engine)
    }
}
