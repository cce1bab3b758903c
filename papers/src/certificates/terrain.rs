//! A witness on a terrain of the library: at one point, the slope that exact gradients give against a printed bound and ours.

use super::witness::{Side, Sides, Violation};
use glam::DVec2;
use std::sync::OnceLock;
use terrain_model::bounds::THRESHOLD;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::program::{Evaluator, Program};
use terrain_model::real::Real;
use terrain_model::tree::{NodeId, Tree};

/// A terrain with what is said of its slope.
pub struct Said {
    /// The terrain.
    pub program: Program,
    /// The printed bound.
    pub printed: f64,
    /// Ours.
    pub corrected: f64,
}

impl Said {
    /// The terrain that `build` makes, with a printed bound and the library's own over a box.
    pub fn of(printed: f64, extent: (DVec2, DVec2), build: impl FnOnce(&mut Tree) -> NodeId) -> Option<Said> {
        let mut tree = Tree::new();
        let root = build(&mut tree);
        let program = Program::compile(&tree, root).ok()?;
        let bounds = program.bounds(terrain_model::bounds::Region::rectangle(extent.0, extent.1));
        Some(Said { program, printed, corrected: bounds.slope })
    }
}

/// "The slope of this terrain is at most so much", at a point of the plane.
pub struct Terrain {
    build: fn() -> Option<Said>,
    root: [(f64, f64); 2],
    made: OnceLock<Option<Said>>,
}

impl Terrain {
    /// The terrain that `build` makes, hunted on a box.
    pub const fn new(build: fn() -> Option<Said>, root: [(f64, f64); 2]) -> Terrain {
        Terrain { build, root, made: OnceLock::new() }
    }
    fn said(&self) -> Option<&Said> {
        self.made.get_or_init(self.build).as_ref()
    }
}

impl Violation for Terrain {
    fn names(&self) -> &[&'static str] {
        &["x", "y"]
    }
    fn root(&self) -> &[(f64, f64)] {
        &self.root
    }
    fn at(&self, x: &[f64]) -> Option<Sides<f64>> {
        let (said, [x, y]) = (self.said()?, <[f64; 2]>::try_from(x).ok()?);
        let sample = said.program.sample(DVec2::new(x, y));
        let value = sample.gradient.length();
        Some(Sides {
            printed: Side { value, limit: said.printed },
            corrected: Side { value, limit: said.corrected },
            domain: sample.weight - THRESHOLD,
        })
    }
    fn enclose(&self, x: &[Interval]) -> Option<Sides<Interval>> {
        let (said, [x, y]) = (self.said()?, <[Interval; 2]>::try_from(x).ok()?);
        let mut evaluator = Evaluator::<Dual<Interval, 2>>::new(&said.program);
        let (f, alpha) = evaluator.run(&said.program, [Dual::variable(x, 0), Dual::variable(y, 1)]);
        let value = Interval::length(f.slope[0], f.slope[1]);
        Some(Sides {
            printed: Side { value, limit: Interval::point(said.printed) },
            corrected: Side { value, limit: Interval::point(said.corrected) },
            domain: alpha.value - Interval::point(THRESHOLD),
        })
    }
}
