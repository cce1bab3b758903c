//! From a field to stacks: along every column, intervals that an enclosure proves to be of one material are skipped, the
//! others are halved down to the precision.

use super::{Material, Stacks, StacksError};
use crate::field::{Box3, Density, THRESHOLD};
use crate::geology::Geology;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use terrain_model::interval::Interval;

/// Columns a side of the blocks that narrow the field together.
const BLOCK: usize = 8;
/// Cells that a block's enclosures are halved down to, before each column has its own.
const SPAN: usize = 32;
/// Intervals of more cells than this narrow the field for their halves; below, enclosures are cheaper than what is left out.
const NARROW: usize = 16;
/// More than the rounding of two values of ρ and of their bound.
const ROUNDING: f64 = 1e-9;
/// The largest number of columns along a side.
const COLUMNS: f64 = (1u32 << 20) as f64;
/// Steps of 32-bit elevations in the least precision. Cells are at least half the precision high, so tops, in their middles,
/// are two steps or more from each other and from the ends of the region: rounding keeps their order.
const STEPS: f64 = 8.0;

/// What a conversion cost and met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConversionReport {
    /// Values of f.
    pub evaluations: u64,
    /// Values of ρ.
    pub resistances: u64,
    /// Enclosures of f over boxes.
    pub enclosures: u64,
    /// Enclosures of ρ over boxes.
    pub resistance_enclosures: u64,
    /// Cells with one material below and another above: each holds a transition.
    pub transitions: u64,
    /// Cells with the same material at both ends that no enclosure proved to be of it throughout: a layer thinner than the
    /// precision may be lost in each.
    pub unresolved: u64,
}

impl ConversionReport {
    fn plus(self, other: &ConversionReport) -> ConversionReport {
        ConversionReport {
            evaluations: self.evaluations + other.evaluations,
            resistances: self.resistances + other.resistances,
            enclosures: self.enclosures + other.enclosures,
            resistance_enclosures: self.resistance_enclosures + other.resistance_enclosures,
            transitions: self.transitions + other.transitions,
            unresolved: self.unresolved + other.unresolved,
        }
    }
}

/// Which of `classes` a resistance is in; never decreases with it.
pub(super) fn class(resistance: f64, classes: u8) -> Material {
    Material::Rock(((resistance * f64::from(classes)) as u8).min(classes - 1))
}

/// Elevations of the cells of a column, each no higher than the precision.
#[derive(Clone, Copy, Debug)]
struct Cells {
    low: f64,
    high: f64,
    count: usize,
}

impl Cells {
    fn elevation(&self, k: usize) -> f64 {
        let share = k as f64 / self.count as f64;
        if k == self.count { self.high } else { self.low + (self.high - self.low) * share }
    }
    fn middle(&self, k: usize) -> f64 {
        0.5 * (self.elevation(k) + self.elevation(k + 1))
    }
    /// Cells `from` to `to` over a rectangle.
    fn region(&self, low: DVec2, high: DVec2, from: usize, to: usize) -> Box3 {
        Box3 { low: low.extend(self.elevation(from)), high: high.extend(self.elevation(to)) }
    }
}

/// Cells `from` to `to` of all columns of a block, with what is left of the field there.
struct Span<F> {
    from: usize,
    to: usize,
    field: F,
    /// Is all of it rock, or air?
    rock: Option<bool>,
}

/// Cells `from` to `to` over a block of columns, from the bottom up: halved until an enclosure decides or they are few.
fn spans<F: Density>(
    field: &F,
    over: [DVec2; 2],
    cells: &Cells,
    [from, to]: [usize; 2],
    found: &mut Vec<Span<F>>,
    report: &mut ConversionReport,
) {
    report.enclosures += 1;
    let (bounds, rest) = field.narrow(&cells.region(over[0], over[1], from, to));
    let decided = bounds.range.hi() <= THRESHOLD || bounds.range.lo() > THRESHOLD;
    if decided || to - from <= SPAN {
        let rock = decided.then_some(bounds.range.lo() > THRESHOLD);
        found.push(Span { from, to, field: rest, rock });
        return;
    }
    let middle = from + (to - from) / 2;
    for half in [[from, middle], [middle, to]] {
        spans(&rest, over, cells, half, found, report);
    }
}

/// The layers of some columns, one after the other.
#[derive(Default)]
struct Piece {
    counts: Vec<u32>,
    tops: Vec<f32>,
    materials: Vec<u8>,
    report: ConversionReport,
    contradiction: Option<DVec3>,
}

/// One column on its way up.
struct Walk<'a> {
    at: DVec2,
    cells: Cells,
    geology: Option<(&'a Geology, u8)>,
    /// A Lipschitz constant of ρ, 1/metre.
    slope: f64,
    piece: &'a mut Piece,
    /// What is at the end reached so far.
    material: Option<Material>,
}

impl Walk<'_> {
    fn span(&mut self, span: &Span<impl Density>) {
        match span.rock {
            Some(false) => self.proved(Material::Air, self.at.extend(self.cells.elevation(span.from))),
            rock => self.up(&span.field, span.from, span.to, rock.is_some()),
        }
    }

    /// Cells `from` to `to`; `rock` when they are known to be rock.
    fn up(&mut self, field: &impl Density, from: usize, to: usize, mut rock: bool) {
        let region = self.cells.region(self.at, self.at, from, to);
        let narrowed;
        let mut field = field;
        if !rock {
            self.piece.report.enclosures += 1;
            let range = if to - from > NARROW {
                narrowed = field.narrow(&region);
                field = &narrowed.1;
                narrowed.0.range
            } else {
                field.bounds(&region).range
            };
            if range.hi() <= THRESHOLD {
                return self.proved(Material::Air, region.low);
            }
            rock = range.lo() > THRESHOLD;
        }
        if rock && let Some(class) = self.class_throughout(&region) {
            return self.proved(class, region.low);
        }
        if to - from == 1 {
            return self.cell(field, from);
        }
        let middle = from + (to - from) / 2;
        self.up(field, from, middle, rock);
        self.up(field, middle, to, rock);
    }

    /// The class of all rock in a piece of the column, if it is proved to be one: by a value and the slope of ρ, which takes a
    /// hundredth of an enclosure's time; across faults, where ρ jumps, by an enclosure.
    fn class_throughout(&mut self, region: &Box3) -> Option<Material> {
        let Some((geology, classes)) = self.geology else { return Some(Material::Rock(0)) };
        let range = if self.slope.is_finite() {
            self.piece.report.resistances += 1;
            let middle = (region.low + region.high) * 0.5;
            let reach = 0.5 * self.slope * (region.high.z - region.low.z) + ROUNDING;
            Interval::point(geology.value(middle)) + Interval::symmetric(reach)
        } else {
            self.piece.report.resistance_enclosures += 1;
            geology.resistance(region.intervals())
        };
        let [least, most] = [range.lo(), range.hi()].map(|rho| class(rho, classes));
        (least == most).then_some(least)
    }

    /// All of an interval is of one material.
    fn proved(&mut self, material: Material, bottom: DVec3) {
        // Intervals share their ends.
        if self.material.is_some_and(|below| below != material) {
            self.piece.contradiction.get_or_insert(bottom);
        }
        self.material = Some(material);
    }

    /// A cell that stays undecided: one transition where its ends differ, else none.
    fn cell(&mut self, field: &impl Density, k: usize) {
        let below = match self.material {
            Some(material) => material,
            None => self.look(field, k),
        };
        let above = self.look(field, k + 1);
        if below == above {
            self.piece.report.unresolved += 1;
        } else {
            self.piece.report.transitions += 1;
            self.push(below, self.cells.middle(k));
        }
        self.material = Some(above);
    }

    fn look(&mut self, field: &impl Density, k: usize) -> Material {
        let p = self.at.extend(self.cells.elevation(k));
        self.piece.report.evaluations += 1;
        if field.value(p) <= THRESHOLD {
            return Material::Air;
        }
        let Some((geology, classes)) = self.geology else { return Material::Rock(0) };
        self.piece.report.resistances += 1;
        class(geology.value(p), classes)
    }

    fn push(&mut self, material: Material, top: f64) {
        self.piece.tops.push(top as f32);
        self.piece.materials.push(material.code());
    }

    /// The column's last layer, where rock reaches the top of the region.
    fn end(mut self) {
        if let Some(material @ Material::Rock(_)) = self.material {
            self.push(material, self.cells.high);
        }
    }
}

impl Stacks {
    /// Stacks of `field` over `region`, columns `spacing` metres apart, tops known within `precision` metres. With a
    /// geology, rock is told apart by resistance into a number of classes, 1 to 255: a stack stores materials, not fields.
    ///
    /// Every layer thicker than the precision is found, and each top is within the precision of a transition of
    /// f − T (or of the class) along the column's axis. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// A [`StacksError`] says what is wrong with region, spacing, precision, classes or field.
    pub fn convert(
        field: &impl Density,
        region: &Box3,
        spacing: f64,
        precision: f64,
        geology: Option<(&Geology, u8)>,
    ) -> Result<(Stacks, ConversionReport), StacksError> {
        let mut stacks = Stacks::empty(region, spacing, precision, geology.map_or(1, |(_, classes)| classes))?;
        let count = ((region.high.z - region.low.z) / precision).ceil() as usize;
        let cells = Cells { low: region.low.z, high: region.high.z, count };
        let slope = geology.map_or(0.0, |(geology, _)| geology.slope());
        let blocks = stacks.columns.map(|n| n.div_ceil(BLOCK));
        let pieces: Vec<Piece> = (0..blocks[0] * blocks[1])
            .into_par_iter()
            .map(|k| {
                let (low, high) = stacks.block(k);
                let over = [stacks.position(low[0], low[1]), stacks.position(high[0] - 1, high[1] - 1)];
                let mut piece = Piece::default();
                let mut block = Vec::new();
                spans(field, over, &cells, [0, count], &mut block, &mut piece.report);
                for j in low[1]..high[1] {
                    for i in low[0]..high[0] {
                        let before = piece.tops.len();
                        let at = stacks.position(i, j);
                        let mut walk = Walk { at, cells, geology, slope, piece: &mut piece, material: None };
                        block.iter().for_each(|span| walk.span(span));
                        walk.end();
                        piece.counts.push((piece.tops.len() - before) as u32);
                    }
                }
                piece
            })
            .collect();
        if let Some(at) = pieces.iter().find_map(|piece| piece.contradiction) {
            return Err(StacksError::Contradiction { at });
        }
        stacks.assemble(&pieces)?;
        Ok((stacks, pieces.iter().fold(ConversionReport::default(), |all, piece| all.plus(&piece.report))))
    }

    /// Columns without layers.
    fn empty(region: &Box3, spacing: f64, precision: f64, classes: u8) -> Result<Stacks, StacksError> {
        let Box3 { low, high } = *region;
        if !(low.is_finite() && high.is_finite() && low.cmplt(high).all()) {
            return Err(StacksError::Region { low, high });
        }
        let across = ((high - low).truncate() / spacing).round();
        let sound = spacing > 0.0 && across.cmpge(DVec2::ONE).all() && across.cmple(DVec2::splat(COLUMNS)).all();
        if !(sound && across.x * across.y < f64::from(u32::MAX)) {
            return Err(StacksError::Columns { spacing, across: across.to_array() });
        }
        let least = STEPS * f64::from(f32::EPSILON) * low.z.abs().max(high.z.abs());
        let most = high.z - low.z;
        if !(least <= precision && precision <= most) {
            return Err(StacksError::Precision { precision, least, most });
        }
        if classes == 0 {
            return Err(StacksError::Classes);
        }
        let columns = across.to_array().map(|n| n as usize);
        Ok(Stacks {
            region: *region,
            spacing,
            precision,
            classes,
            columns,
            starts: Vec::new(),
            tops: Vec::new(),
            materials: Vec::new(),
        })
    }

    /// The first column of block `k` and the one beyond its last.
    fn block(&self, k: usize) -> ([usize; 2], [usize; 2]) {
        let across = self.columns[0].div_ceil(BLOCK);
        let low = [k % across * BLOCK, k / across * BLOCK];
        (low, [0, 1].map(|axis| (low[axis] + BLOCK).min(self.columns[axis])))
    }

    /// The layers of all blocks, row by row of columns.
    fn assemble(&mut self, pieces: &[Piece]) -> Result<(), StacksError> {
        let layers: u64 = pieces.iter().map(|piece| piece.tops.len() as u64).sum();
        if u32::try_from(layers).is_err() {
            return Err(StacksError::TooMany { layers });
        }
        let nx = self.columns[0];
        let blocks: Vec<_> = (0..pieces.len()).map(|k| self.block(k)).collect();
        let columns = |k: usize| {
            let (low, high) = blocks[k];
            (low[1]..high[1]).flat_map(move |j| (low[0]..high[0]).map(move |i| j * nx + i))
        };
        let mut starts = vec![0; nx * self.columns[1] + 1];
        for (k, piece) in pieces.iter().enumerate() {
            columns(k).zip(&piece.counts).for_each(|(column, &count)| starts[column + 1] = count);
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        self.starts = starts;
        self.tops = vec![0.0; layers as usize];
        self.materials = vec![0; layers as usize];
        for (k, piece) in pieces.iter().enumerate() {
            let mut from = 0;
            for (column, &count) in columns(k).zip(&piece.counts) {
                let (to, own) = (from + count as usize, self.starts[column] as usize);
                let there = own..own + count as usize;
                self.tops[there.clone()].copy_from_slice(&piece.tops[from..to]);
                self.materials[there].copy_from_slice(&piece.materials[from..to]);
                from = to;
            }
        }
        Ok(())
    }
}
