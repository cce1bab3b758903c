//! A program pruned to squares of the plane: a quadtree over its support whose squares are pruned, each from the one
//! around it, when they are first asked for, and shared by all who ask. A query runs the program of the smallest square
//! that holds it, so its cost follows what is there and not how much there is elsewhere. Pruning is exact, so values keep
//! their bits, and bounds hold.

use super::{Evidence, Instruction, Program, Pruner};
use crate::bounds::Region;
use glam::DVec2;
use std::sync::{Arc, OnceLock};

/// A square is split while it is wider than this share of the smallest primitive that begins or ends in it.
const SHARE: f64 = 0.5;
/// Splits below the whole support.
const DEEPEST: u32 = 24;

/// The quadtree of one program.
#[derive(Debug)]
pub struct Cells {
    evidence: Evidence,
    whole: Arc<Program>,
    root: Option<Cell>,
}

/// A square. Its program holds on a wider one, `reach` from the centre: a box that is no wider than a square is inside the
/// wider square of that one of them which holds its centre. Squares that are not split serve points and short segments, and
/// are not widened.
#[derive(Debug)]
struct Cell {
    centre: DVec2,
    half: f64,
    reach: f64,
    program: Arc<Program>,
    /// Splits that are left; none in a square where nothing more begins or ends.
    splits: u32,
    parts: [OnceLock<Box<Cell>>; 4],
}

impl Cells {
    /// Squares of `program`, none of them pruned yet; what may leave is decided by `evidence`.
    pub fn new(program: &Program, evidence: Evidence) -> Cells {
        let whole = Arc::new(program.clone());
        let root = whole.support().filter(|(lo, hi)| lo.is_finite() && hi.is_finite() && lo.x < hi.x && lo.y < hi.y);
        let root = root.map(|(lo, hi)| {
            let half = 0.5 * (hi - lo).max_element();
            Cell::new(&whole, evidence, 0.5 * (lo + hi), half, DEEPEST)
        });
        Cells { evidence, whole, root }
    }
    /// The program as it is, everywhere: what the squares save shows beside it.
    pub fn undivided(program: &Program) -> Cells {
        Cells { evidence: Evidence::Ranges, whole: Arc::new(program.clone()), root: None }
    }
    /// The program itself.
    pub fn program(&self) -> &Program {
        &self.whole
    }
    /// The shortest program known to hold at a point.
    pub fn at(&self, p: DVec2) -> &Program {
        self.over(p, p)
    }
    /// The shortest program known to hold on the box with opposite corners `a` and `b`.
    pub fn over(&self, a: DVec2, b: DVec2) -> &Program {
        let (lo, hi) = (a.min(b), a.max(b));
        let Some(mut cell) = self.root.as_ref().filter(|root| root.holds(lo, hi)) else { return &self.whole };
        let middle = 0.5 * (lo + hi);
        let width = (hi - lo).max_element();
        while cell.splits > 0 && width <= cell.half {
            let part = cell.part(middle, self.evidence);
            if !part.holds(lo, hi) {
                break;
            }
            cell = part;
        }
        &cell.program
    }
    /// Bytes of the squares that have been asked for so far.
    pub fn bytes(&self) -> usize {
        self.root.as_ref().map_or(0, |root| size_of::<Cell>() + root.bytes(&self.whole))
    }
}

impl Cell {
    fn new(around: &Arc<Program>, evidence: Evidence, centre: DVec2, half: f64, splits: u32) -> Cell {
        let prune = |from: &Arc<Program>, reach: f64| {
            let mut pruner = Pruner::with_evidence(from, evidence);
            let mut program = pruner.prune(Region::rectangle(centre - reach, centre + reach));
            program.code.shrink_to_fit();
            // A square in which nothing leaves shares the program of the one around it.
            (if program.code == from.code { from.clone() } else { Arc::new(program) }, pruner.finest())
        };
        let (program, finest) = prune(around, 2.0 * half);
        let parts = [const { OnceLock::new() }; 4];
        if splits == 0 || 2.0 * half <= SHARE * finest {
            Cell { centre, half, reach: half, program: prune(&program, half).0, splits: 0, parts }
        } else {
            Cell { centre, half, reach: 2.0 * half, program, splits, parts }
        }
    }
    /// Whether the program holds on a box.
    fn holds(&self, lo: DVec2, hi: DVec2) -> bool {
        let (a, b) = (self.centre - self.reach, self.centre + self.reach);
        a.x <= lo.x && a.y <= lo.y && hi.x <= b.x && hi.y <= b.y
    }
    /// The quarter in which `p` lies.
    fn part(&self, p: DVec2, evidence: Evidence) -> &Cell {
        let (east, north) = (p.x >= self.centre.x, p.y >= self.centre.y);
        let part = &self.parts[usize::from(east) + 2 * usize::from(north)];
        part.get_or_init(|| {
            let half = 0.5 * self.half;
            let step = DVec2::new(if east { half } else { -half }, if north { half } else { -half });
            Box::new(Cell::new(&self.program, evidence, self.centre + step, half, self.splits - 1))
        })
    }
    fn bytes(&self, around: &Arc<Program>) -> usize {
        let own = if Arc::ptr_eq(&self.program, around) {
            0
        } else {
            size_of::<Program>() + size_of_val::<[Instruction]>(&self.program.code)
        };
        let parts = self.parts.iter().filter_map(OnceLock::get);
        own + parts.map(|part| size_of::<Cell>() + part.bytes(&self.program)).sum::<usize>()
    }
}
