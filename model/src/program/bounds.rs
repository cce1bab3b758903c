//! Bounds of the whole program over a box or a segment, by the same stack machine.

use super::{Instruction, Program};
use crate::bounds::{Bounds, Region};
use crate::dual::Dual;
use crate::interval::Interval;
use crate::noise::{Combination, GRADIENT2_RANGE, GRADIENT2_SLOPE, NoiseValue, Octave};
use crate::real::Real;

use crate::operator::{self, BlendRule};
use crate::primitive::{Parameters, curve, disc, image};
use glam::DVec2;

/// An octave is run on a region narrower than this many of its cells; elsewhere its certified range and slope stand.
const LOCAL: f64 = 0.1;

/// A noise over a region `width` metres wide: the octaves that are coarse enough are run on it.
fn local_noise(
    combination: Combination,
    octaves: &[Octave<2>],
    x: [Dual<Interval, 2>; 2],
    width: f64,
) -> Dual<Interval, 2> {
    combination.combine(octaves, |octave| {
        if width * octave.frequency < LOCAL {
            return Dual::gradient2(octave.lattice, octave.coordinates(x));
        }
        let slope = Interval::point(octave.frequency) * Interval::symmetric(GRADIENT2_SLOPE);
        Dual { value: Interval::symmetric(GRADIENT2_RANGE), slope: [slope; 2] }
    })
}

/// Computes bounds of a program over regions; the range and slope of each noise are derived once.
#[derive(Debug)]
pub struct BoundsEvaluator<'a> {
    program: &'a Program,
    /// Range and slope of the noise of each instruction.
    noises: Vec<(Interval, f64)>,
    rule: BlendRule,
    stack: Vec<Bounds>,
    frames: Vec<Region>,
}

impl<'a> BoundsEvaluator<'a> {
    /// Bounds by the corrected rules.
    pub fn new(program: &'a Program) -> BoundsEvaluator<'a> {
        BoundsEvaluator::with_rule(program, BlendRule::Corrected)
    }
    /// Bounds with the blend rule given: the paper's is kept to show what it misses.
    pub fn with_rule(program: &'a Program, rule: BlendRule) -> BoundsEvaluator<'a> {
        let noises = program
            .code
            .iter()
            .map(|instruction| match *instruction {
                Instruction::NoiseDisc { combination, first, octaves, .. } => {
                    let placed = &program.octaves[first as usize..(first + octaves) as usize];
                    let bounds = combination.placed_bounds(placed);
                    (bounds.range, bounds.slope)
                }
                _ => (Interval::ZERO, 0.0),
            })
            .collect();
        BoundsEvaluator { program, noises, rule, stack: Vec::new(), frames: Vec::new() }
    }
    /// Bounds over a region.
    pub fn bounds(&mut self, region: Region) -> Bounds {
        let program = self.program;
        let stack = &mut self.stack;
        let frames = &mut self.frames;
        stack.clear();
        frames.clear();
        frames.push(region);
        let mut here = region;
        for (index, instruction) in program.code.iter().enumerate() {
            let tail = |at: u32| Parameters(&program.parameters[at as usize..]);
            let operands = match *instruction {
                Instruction::Blend { operands } => usize::from(operands),
                Instruction::Replace { .. } | Instruction::Add { .. } => 2,
                Instruction::Leave { .. } => 1,
                _ => 0,
            };
            let first = stack.len() - operands;
            let result = match *instruction {
                Instruction::Disc { at } | Instruction::NoiseDisc { at, .. } => {
                    let p = tail(at);
                    let (weight, weight_slope) = disc::weight_bounds(p, &here);
                    let (mut range, mut slope) = self.noises[index];
                    if let Instruction::NoiseDisc { combination, first, octaves, .. } = *instruction
                        && weight.hi() > 0.0
                    {
                        let octaves = &program.octaves[first as usize..(first + octaves) as usize];
                        let width = here.extent[0].width().max(here.extent[1].width());
                        if width * octaves[0].frequency < LOCAL {
                            let along = |axis: usize| {
                                Dual::<Interval, 2>::variable(here.extent[axis] - Interval::point(p.0[axis]), axis)
                            };
                            let local = local_noise(combination, octaves, [along(0), along(1)], width);
                            range = range.meet(local.value);
                            slope = slope.min(Interval::length(local.slope[0], local.slope[1]).hi());
                        }
                    }
                    let elevation = Interval::point(p.0[4]) + range;
                    Bounds::primitive(elevation, weight, slope, weight_slope)
                }
                Instruction::Curve { at, segments, pieces } => {
                    curve::bounds(tail(at), usize::from(segments), usize::from(pieces), &here)
                }
                Instruction::Image { at, image, .. } => {
                    image::bounds(tail(at), &program.images[usize::from(image)], &here)
                }
                Instruction::Blend { .. } => operator::blend_bounds(self.rule, &stack[first..]),
                Instruction::Replace { rule } => operator::replace_bounds(rule, stack[first], stack[first + 1]),
                Instruction::Add { rule } => operator::add_bounds(rule, stack[first], stack[first + 1]),
                Instruction::Enter { at } => {
                    here = operator::enter_region(tail(at), &here);
                    frames.push(here);
                    continue;
                }
                Instruction::Leave { at } => {
                    frames.pop();
                    here = frames[frames.len() - 1];
                    operator::leave_bounds(tail(at), stack[first])
                }
            };
            stack.truncate(first);
            stack.push(result);
        }
        stack.first().copied().unwrap_or(Bounds::ABSENT)
    }
}

impl Program {
    /// Bounds over a region, by the corrected rules. Hot loops keep a [`BoundsEvaluator`].
    pub fn bounds(&self, region: Region) -> Bounds {
        BoundsEvaluator::new(self).bounds(region)
    }
    /// A box that holds the support {α > 0}, as (south-west, north-east) corners, metres; `None` for an empty program.
    pub fn support(&self) -> Option<(DVec2, DVec2)> {
        let mut stack: Vec<Option<(DVec2, DVec2)>> = Vec::new();
        let around = |points: &[DVec2], r: f64| {
            let r = DVec2::splat(r * (1.0 + 1e-12));
            points.iter().fold(None, |b: Option<(DVec2, DVec2)>, p| {
                Some(b.map_or((*p - r, *p + r), |(lo, hi)| (lo.min(*p - r), hi.max(*p + r))))
            })
        };
        let hull = |a: Option<(DVec2, DVec2)>, b: Option<(DVec2, DVec2)>| match (a, b) {
            (Some((p, q)), Some((r, s))) => Some((p.min(r), q.max(s))),
            (a, b) => a.or(b),
        };
        for instruction in &self.code {
            let tail = |at: u32| &self.parameters[at as usize..];
            match *instruction {
                Instruction::Disc { at } | Instruction::NoiseDisc { at, .. } => {
                    let p = tail(at);
                    stack.push(around(&[DVec2::new(p[0], p[1])], 1.0 / p[2].sqrt()));
                }
                Instruction::Curve { at, segments, .. } => {
                    let p = tail(at);
                    let ends: Vec<DVec2> = (0..usize::from(segments))
                        .flat_map(|s| {
                            let k = &p[curve::WIDTH + s * curve::SEGMENT_WIDTH..];
                            let start = DVec2::new(k[0], k[1]);
                            [start, start + DVec2::new(k[3], k[4]) * k[5]]
                        })
                        .collect();
                    stack.push(around(&ends, 1.0 / p[0].sqrt()));
                }
                Instruction::Image { at, .. } => {
                    let p = tail(at);
                    let (centre, half) = (DVec2::new(p[6], p[7]), DVec2::new(p[8], p[9]));
                    stack.push(around(&[centre - half, centre + half], 1e-9 * (half.max_element() + centre.length())));
                }
                Instruction::Blend { operands } => {
                    let rest = stack.split_off(stack.len() - usize::from(operands));
                    stack.push(rest.into_iter().fold(None, hull));
                }
                Instruction::Replace { rule } | Instruction::Add { rule } => {
                    let (b, a) = (stack.pop().flatten(), stack.pop().flatten());
                    stack.push(if rule == operator::WeightRule::Keep { a } else { hull(a, b) });
                }
                Instruction::Enter { .. } => {}
                Instruction::Leave { at } => {
                    let m = tail(at);
                    let determinant = m[0] * m[3] - m[1] * m[2];
                    let back = |q: DVec2| {
                        let d = DVec2::new(q.x - m[4], q.y - m[5]);
                        DVec2::new(m[3] * d.x - m[1] * d.y, m[0] * d.y - m[2] * d.x) / determinant
                    };
                    let carried = stack.pop().flatten().and_then(|(lo, hi)| {
                        let corners = [lo, DVec2::new(hi.x, lo.y), DVec2::new(lo.x, hi.y), hi].map(back);
                        let size = corners.iter().fold(0.0f64, |s, c| s.max(c.length()));
                        around(&corners, 1e-9 * size)
                    });
                    stack.push(carried);
                }
            }
        }
        stack.pop().flatten()
    }
}
