//! The least time that arithmetic alone takes: operations of what pruning leaves at a sample, counted by running the program on
//! a number that counts, over the operations a second that lanes reach on chains of nothing but multiplications and additions.

use glam::DVec2;
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use terrain_model::bounds::Region;
use terrain_model::noise::{Lattice, NoiseValue, gradient2};
use terrain_model::primitive::image::{Image, ImageNumber};
use terrain_model::program::{Cells, Evaluator, Evidence, Program, Pruner};
use terrain_model::real::Real;

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count(operations: u64) {
    OPERATIONS.with(|sum| sum.set(sum.get() + operations));
}

/// A number that counts the lane operations which computing it takes.
#[derive(Clone, Copy, Debug)]
struct Counted(f64);

macro_rules! counted_operator {
    ($operator:ident, $method:ident) => {
        impl $operator for Counted {
            type Output = Counted;
            fn $method(self, o: Counted) -> Counted {
                count(1);
                Counted(self.0.$method(o.0))
            }
        }
    };
}
counted_operator!(Add, add);
counted_operator!(Sub, sub);
counted_operator!(Mul, mul);
counted_operator!(Div, div);
impl Neg for Counted {
    type Output = Counted;
    fn neg(self) -> Counted {
        count(1);
        Counted(-self.0)
    }
}

impl Real for Counted {
    type Mask = bool;
    fn constant(value: f64) -> Counted {
        Counted(value)
    }
    fn sqrt(self) -> Counted {
        count(1);
        Counted(Real::sqrt(self.0))
    }
    fn abs(self) -> Counted {
        count(1);
        Counted(self.0.abs())
    }
    fn square(self) -> Counted {
        self * self
    }
    fn min(self, o: Counted) -> Counted {
        count(1);
        Counted(Real::min(self.0, o.0))
    }
    fn max(self, o: Counted) -> Counted {
        count(1);
        Counted(Real::max(self.0, o.0))
    }
    fn less(self, o: Counted) -> bool {
        count(1);
        self.0 < o.0
    }
    fn select(mask: bool, a: Counted, b: Counted) -> Counted {
        count(1);
        if mask { a } else { b }
    }
    fn length(x: Counted, y: Counted) -> Counted {
        (x * x + y * y).sqrt()
    }
}

/// Integer operations of the four corners of a cell: the floors of two coordinates 16, the next cells 2, columns 2·4, rows 2·2,
/// joined 4, finished 4·8, and as directions 4·8.
const HASH: u64 = 98;

impl NoiseValue for Counted {
    fn gradient2(_: Lattice<2>, x: [Counted; 2]) -> Counted {
        count(HASH + 2);
        let t = x.map(|x| Counted(x.0 - x.0.floor()));
        gradient2::cell(t, &[gradient2::direction(0).map(Counted); 4])
    }
    fn gradient3(lattice: Lattice<3>, x: [Counted; 3]) -> Counted {
        Counted(f64::gradient3(lattice, x.map(|x| x.0)))
    }
    fn simplex3(lattice: Lattice<3>, x: [Counted; 3]) -> Counted {
        Counted(f64::simplex3(lattice, x.map(|x| x.0)))
    }
}

impl ImageNumber for Counted {
    fn lookup(image: &Image, base: [i32; 2], u: [Counted; 2]) -> Counted {
        // Three interpolations of three operations; the four reads are not arithmetic.
        count(9);
        Counted(f64::lookup(image, base, u.map(|u| u.0)))
    }
    fn lookup_jet(image: &Image, base: [i32; 2], u: [Counted; 2]) -> [Counted; 3] {
        f64::lookup_jet(image, base, u.map(|u| u.0)).map(Counted)
    }
    fn spline_jet(image: &Image, base: [i32; 2], u: [Counted; 2]) -> [Counted; 3] {
        // Four weighted sums of three, and the weights.
        count(28);
        f64::spline_jet(image, base, u.map(|u| u.0)).map(Counted)
    }
}

/// Mean number of lane operations at a sample of [0, `extent`], as [`Program::bake`] prunes its tiles of `tile` metres: at the
/// middles of `side` × `side` tiles, spread evenly.
pub fn operations_per_sample(program: &Program, extent: DVec2, tile: DVec2, side: usize) -> f64 {
    let cells = Cells::new(program, Evidence::Ranges);
    let mut evaluator = Evaluator::<Counted>::new(program);
    OPERATIONS.with(|sum| sum.set(0));
    for k in 0..side * side {
        let p = extent * DVec2::new((k % side) as f64 + 0.5, (k / side) as f64 + 0.5) / side as f64;
        let (low, high) = (p - 0.5 * tile, p + 0.5 * tile);
        let pruned = Pruner::new(cells.over(low, high)).prune(Region::rectangle(low, high));
        evaluator.run(&pruned, [Counted(p.x), Counted(p.y)]);
    }
    OPERATIONS.with(Cell::get) as f64 / (side * side) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octave_costs_its_hash_and_its_cell() {
        OPERATIONS.with(|sum| sum.set(0));
        let fine = Lattice { seed: 3, base: [0; 2] };
        let value = Counted::gradient2(fine, [Counted(0.3), Counted(0.7)]);
        let operations = OPERATIONS.with(Cell::get);
        assert!(value.0.abs() < 1.0 && operations > HASH && operations < HASH + 80, "{operations}");
    }
}
