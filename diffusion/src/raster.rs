//! Curves onto nodes: what each node of a raster is held to (Hnaidi 2010 §4.1).
//!
//! The paper draws quads to both sides of a polyline. Quads leave wedges open outside of a bend and overlap inside of it. Here a node
//! belongs to the nearest point of the curve, which is the same where quads are simple, closes the wedges, and settles where a curve
//! comes near itself; at the ends of a curve the strip is cut square. Within the plateau's radius the elevation and the noise are
//! strict; beyond it, on each side, the slope ramps from its value to 0 (claims H6: it keeps its sign). Where plateaus of several curves
//! meet, their values are averaged; where slopes of several curves meet, the node is left to diffusion.

use crate::curve::Curve;
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// A raster of square cells; node (i, j) lies at origin + spacing·(i, j), row 0 in the south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// The south-west node, metres.
    pub origin: DVec2,
    /// Metres between nodes.
    pub spacing: f64,
    /// Nodes from west to east.
    pub width: usize,
    /// Nodes from south to north.
    pub height: usize,
}

impl Domain {
    /// A square with `side` metres from its first node to its last, `nodes` along each side.
    pub fn square(side: f64, nodes: usize) -> Domain {
        Domain { origin: DVec2::ZERO, spacing: side / (nodes - 1) as f64, width: nodes, height: nodes }
    }
    /// Where node (i, j) lies, metres.
    pub fn at(&self, i: usize, j: usize) -> DVec2 {
        self.origin + self.spacing * DVec2::new(i as f64, j as f64)
    }
}

/// A slope to be followed: the unit direction away from where elevations come, and the rise along it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// n: east, north.
    pub direction: DVec2,
    /// Tangent of the slope along n.
    pub rise: f64,
    /// How far from the plateau's edge, or from a curve that has none, metres.
    pub beyond: f64,
}

impl Guide {
    /// The rise, and the direction east and north.
    pub(crate) fn to_array(self) -> [f64; 3] {
        [self.rise, self.direction.x, self.direction.y]
    }
}

/// What curves want of one node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    /// Mean of the elevations wanted, metres.
    pub elevation: f64,
    /// Curves that want one.
    pub elevations: u16,
    /// Mean amplitude, metres.
    pub amplitude: f64,
    /// Mean roughness.
    pub roughness: f64,
    /// Curves that want a noise.
    pub noises: u16,
    /// The slope, if one curve alone wants one.
    pub guide: Guide,
    /// Curves that want a slope.
    pub guides: u16,
}

impl Node {
    fn add(&mut self, found: &Found, curve: &Curve, least: f64) {
        let wanted = curve.wanted(found.place);
        // A curve is at least one node wide, whatever the spacing.
        let within = found.distance <= wanted.radius.max(least);
        let mean = |mean: f64, value: f64, count: u16| mean + (value - mean) / f64::from(count);
        if let (Some([amplitude, roughness]), true) = (wanted.noise, within) {
            self.noises = self.noises.saturating_add(1);
            self.amplitude = mean(self.amplitude, amplitude, self.noises);
            self.roughness = mean(self.roughness, roughness, self.noises);
        }
        let [extent, tangent] = wanted.sides.map_or([0.0; 2], |sides| sides[usize::from(!found.left)]);
        // Without an elevation there is no plateau: slopes start at the curve.
        let beyond = (found.distance - if wanted.elevation.is_some() { wanted.radius } else { 0.0 }).max(0.0);
        if let (Some(height), true) = (wanted.elevation, within) {
            // A node that is held for the width alone lies on the slope: it is held to where the ramp has come by there.
            let ramp = if extent > 0.0 { beyond.min(extent) } else { 0.0 };
            let height = height + if ramp > 0.0 { tangent * ramp * (1.0 - 0.5 * ramp / extent) } else { 0.0 };
            self.elevations = self.elevations.saturating_add(1);
            self.elevation = mean(self.elevation, height, self.elevations);
            return;
        }
        if beyond > extent || extent <= 0.0 {
            return;
        }
        self.guides = self.guides.saturating_add(1);
        let rise = tangent * (1.0 - beyond / extent);
        // Elevations come from the curve where it has them, from outside where it has none ("inverted").
        let sign = if wanted.elevation.is_some() { 1.0 } else { -1.0 };
        self.guide = Guide { direction: sign * found.away, rise: sign * rise, beyond };
    }
}

/// The nearest point of a curve, as a node sees it.
#[derive(Clone, Copy, Debug)]
struct Found {
    distance: f64,
    /// u.
    place: f64,
    left: bool,
    /// Unit vector from the curve to the node.
    away: DVec2,
}

/// The nodes that curves want something of, row by row from the south; the others want nothing.
#[derive(Clone, Debug)]
pub struct Raster {
    width: usize,
    rows: Vec<Vec<(u32, Node)>>,
}

impl Raster {
    /// The nodes of row `j` that something is wanted of, with their columns, from the west.
    pub fn row(&self, j: usize) -> &[(u32, Node)] {
        &self.rows[j]
    }
    /// The node in column `i` of row `j`.
    pub fn at(&self, i: usize, j: usize) -> Node {
        let row = &self.rows[j];
        row.binary_search_by_key(&(i as u32), |(i, _)| *i).map_or_else(|_| Node::default(), |found| row[found].1)
    }
    /// The nodes that something is wanted of.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        self.rows.iter().flatten().map(|(_, node)| node)
    }
    /// Every node.
    pub fn dense(&self) -> Vec<Node> {
        let mut nodes = vec![Node::default(); self.width * self.rows.len()];
        for (row, nodes) in self.rows.iter().zip(nodes.chunks_mut(self.width)) {
            row.iter().for_each(|(i, node)| nodes[*i as usize] = *node);
        }
        nodes
    }
    /// What it takes, bytes.
    pub fn bytes(&self) -> usize {
        self.rows.iter().map(|row| row.capacity() * size_of::<(u32, Node)>()).sum()
    }
}

/// The raster of nodes that `curves` make.
pub fn rasterise(curves: &[Curve], domain: &Domain) -> Raster {
    Raster { width: domain.width, rows: draw(curves, domain, 0..domain.height) }
}

impl Raster {
    /// Draws `rows` anew and returns them as they were.
    pub fn redraw(&mut self, curves: &[Curve], domain: &Domain, rows: Range<usize>) -> Vec<Vec<(u32, Node)>> {
        let drawn = draw(curves, domain, rows.clone());
        self.rows.splice(rows, drawn).collect()
    }
    /// Puts rows back as [`Raster::redraw`] returned them.
    pub fn restore(&mut self, rows: Range<usize>, before: Vec<Vec<(u32, Node)>>) {
        self.rows.splice(rows, before);
    }
}

/// The rows of a domain in which a curve may want something.
pub fn rows_of(curve: &Curve, domain: &Domain) -> Range<usize> {
    let reach = curve.reach() + domain.spacing;
    let ordinates = curve.control().iter().map(|p| p.y - domain.origin.y);
    let low = ordinates.clone().fold(f64::INFINITY, f64::min) - reach;
    let high = ordinates.fold(f64::NEG_INFINITY, f64::max) + reach;
    let index = |metres: f64| (metres / domain.spacing).clamp(0.0, domain.height as f64) as usize;
    index(low)..(index(high) + 1).min(domain.height)
}

/// The nodes of some rows. Bands of rows are independent: a node's answer does not depend on the band it is in.
fn draw(curves: &[Curve], domain: &Domain, rows: Range<usize>) -> Vec<Vec<(u32, Node)>> {
    let strips: Vec<Strip<'_>> = curves.iter().map(|curve| Strip::new(curve, domain)).collect();
    const BAND: usize = 64;
    let bands = rows.len().div_ceil(BAND);
    let drawn = (0..bands).into_par_iter().flat_map_iter(|band| {
        let first = rows.start + band * BAND;
        let mut nodes = vec![Node::default(); BAND.min(rows.end - first) * domain.width];
        let mut best = vec![None; nodes.len()];
        for strip in &strips {
            strip.draw(domain, first, &mut nodes, &mut best);
        }
        let wanted = |node: &Node| *node != Node::default();
        let row = |row: &[Node]| {
            let found = row.iter().enumerate().filter(|(_, node)| wanted(node));
            let mut row: Vec<(u32, Node)> = found.map(|(i, node)| (i as u32, *node)).collect();
            row.shrink_to_fit();
            row
        };
        nodes.chunks(domain.width).map(row).collect::<Vec<_>>()
    });
    drawn.collect()
}

/// One curve's chords, and how far to each side of them nodes are concerned.
struct Strip<'a> {
    curve: &'a Curve,
    line: Vec<(DVec2, f64)>,
    reach: f64,
    least: f64,
}

impl<'a> Strip<'a> {
    fn new(curve: &'a Curve, domain: &Domain) -> Strip<'a> {
        // A fiftieth of a cell: far below what a node can tell.
        let line = curve.polyline(0.02 * domain.spacing);
        // Half the diagonal of a cell, so that the nodes of a thin curve leave no gap.
        let least = domain.spacing * std::f64::consts::FRAC_1_SQRT_2;
        Strip { curve, line, reach: curve.reach() + least, least }
    }

    /// Adds the curve to the rows from `first` on; `best` is scratch of their size, all `None` before and after.
    fn draw(&self, domain: &Domain, first: usize, nodes: &mut [Node], best: &mut [Option<Found>]) {
        let rows = nodes.len() / domain.width;
        let mut touched = Vec::new();
        let mut visit =
            |[low, high]: [DVec2; 2], find: &dyn Fn(DVec2) -> Option<Found>, span: &dyn Fn(f64) -> [f64; 2]| {
                let last = first + rows - 1;
                let index = |metres: f64| metres / domain.spacing;
                let (bottom, top) = (index(low.y - domain.origin.y).ceil(), index(high.y - domain.origin.y).floor());
                if bottom > last as f64 || top < first as f64 {
                    return;
                }
                for j in (bottom.max(first as f64) as usize)..=(top.min(last as f64) as usize) {
                    let [west, east] = span(domain.at(0, j).y);
                    let (west, east) = (west.max(low.x), east.min(high.x));
                    // One node of slack at least: `find` decides.
                    let start = (index(west - domain.origin.x).floor()).max(0.0);
                    let end = (index(east - domain.origin.x).ceil()).min(domain.width as f64 - 1.0);
                    for i in start as usize..=end as usize {
                        let Some(found) = find(domain.at(i, j)).filter(|found| found.distance <= self.reach) else {
                            continue;
                        };
                        let slot = &mut best[(j - first) * domain.width + i];
                        if slot.is_none() {
                            touched.push((j - first) * domain.width + i);
                        }
                        // On a tie the earlier part of the curve keeps the node.
                        if slot.is_none_or(|before| found.distance < before.distance) {
                            *slot = Some(found);
                        }
                    }
                }
            };
        let around = |points: &[DVec2], by: f64| {
            let low = points.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
            let high = points.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
            [low - by, high + by]
        };
        for pair in self.line.windows(2) {
            let [(a, from), (b, to)] = [pair[0], pair[1]];
            let (along, length) = ((b - a).normalize(), a.distance(b));
            let find = |p: DVec2| {
                let (x, y) = (along.dot(p - a), along.perp_dot(p - a));
                let away = if y < 0.0 { -along.perp() } else { along.perp() };
                let found = Found { distance: y.abs(), place: from + (to - from) * (x / length), left: y >= 0.0, away };
                (0.0..=length).contains(&x).then_some(found)
            };
            // Where a row crosses the band |across| ≤ reach.
            let span = |y: f64| {
                if along.y == 0.0 {
                    return [f64::NEG_INFINITY, f64::INFINITY];
                }
                let middle = a.x + (y - a.y) * along.x / along.y;
                let half = self.reach / along.y.abs();
                [middle - half, middle + half]
            };
            let sideways = along.perp() * self.reach;
            visit(around(&[a + sideways, a - sideways, b + sideways, b - sideways], 0.0), &find, &span);
        }
        // A closed curve bends where it closes, too.
        let [first, last] = [0, self.line.len() - 1];
        let closing = (self.line[first].0 == self.line[last].0 && last > 1).then(|| [last - 1, first, 1]);
        for three in (1..last).map(|k| [k - 1, k, k + 1]).chain(closing) {
            let [(a, _), (v, place), (b, _)] = three.map(|k| self.line[k]);
            let (before, after) = ((v - a).normalize(), (b - v).normalize());
            let left = before.perp_dot(after) <= 0.0;
            // The wedge lies outside of the bend, past the end of one chord and before the start of the next.
            let find = |p: DVec2| {
                let from = p - v;
                let distance = from.length();
                let inside = before.dot(from) > 0.0 && after.dot(from) < 0.0 && distance > 0.0;
                inside.then(|| Found { distance, place, left, away: from / distance })
            };
            let everywhere = |_: f64| [f64::NEG_INFINITY, f64::INFINITY];
            let side = if left { self.reach } else { -self.reach };
            let cosine = before.dot(after);
            if cosine > 0.0 {
                // The tangents at the ends of the sector's arc meet there: the sector lies in the hull of the four.
                let tip = (before.perp() + after.perp()) * (side / (1.0 + cosine));
                visit(
                    around(&[v, v + before.perp() * side, v + after.perp() * side, v + tip], 0.0),
                    &find,
                    &everywhere,
                );
            } else {
                visit(around(&[v], self.reach), &find, &everywhere);
            }
        }
        for node in touched {
            if let Some(found) = best[node].take() {
                nodes[node].add(&found, self.curve, self.least);
            }
        }
    }
}

#[cfg(test)]
#[path = "raster_tests.rs"]
mod tests;
