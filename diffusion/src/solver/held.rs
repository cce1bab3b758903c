//! Which slopes lead from somewhere.
//!
//! A node that follows a slope takes its elevation from upstream. Where directions part from a point that no curve holds, as the
//! diffused ones of crossing bands may, or run in a circle, each node reads another and adds its rise each time, and only diffusion across
//! the whole basin ends it: the field grows exponentially with the number of cells (`hnaidi2010/basins`: a depth of 47 at 17² and of
//! 1462 at 25² where 0.36 is possible). So a slope is followed only where the chance is at least one half that reading on upstream, at
//! each node from the east–west or the north–south neighbour by the shares of its equation, ends at a given elevation or on free ground
//! that is held. What is left is free ground.

use super::guided::Slope;
use std::ops::Range;

/// Rounds of four sweeps: a path that turns around more often is not followed to its end.
const ROUNDS: usize = 4;

/// Which of `slopes` lead from nothing, by node row by row, ascending as they are; at the nodes in `given`, ascending too, elevations are
/// held, and the others are free ground.
pub fn adrift(width: usize, height: usize, slopes: &[(usize, Slope)], given: &[usize]) -> Vec<usize> {
    if slopes.is_empty() {
        return Vec::new();
    }
    let rows: Vec<Range<usize>> = (0..height)
        .map(|row| [row, row + 1].map(|row| slopes.partition_point(|(node, _)| *node < row * width)))
        .map(|[start, end]| start..end)
        .collect();
    let mut ground = Free::beside(width, height, slopes, given);
    // The chance to end somewhere that is held; of what is held it is 1.
    let mut chance = vec![0.0f32; width * height];
    given.iter().for_each(|&node| chance[node] = 1.0);
    given.iter().for_each(|&node| ground.hold_beside(node));
    loop {
        ground.spread(&mut chance);
        for _ in 0..ROUNDS {
            for (from_north, from_east) in [(false, false), (true, true), (false, true), (true, false)] {
                let mut follow = |&(node, slope): &(usize, Slope)| {
                    let [x, y] = upstream(node, slope, width, height);
                    let [p, q] = slope.direction.map(|component| component.abs() as f32);
                    // Outside the raster nothing is held.
                    let at = |place: Option<usize>| place.map_or(0.0, |place| chance[place]);
                    let found = (p * at(x) + q * at(y)) / (p + q);
                    chance[node] = chance[node].max(found);
                };
                for row in 0..rows.len() {
                    let row = &slopes[rows[if from_north { rows.len() - 1 - row } else { row }].clone()];
                    if from_east { row.iter().rev().for_each(&mut follow) } else { row.iter().for_each(&mut follow) }
                }
            }
        }
        // Free ground beside slopes that lead from somewhere is held by them.
        for &(node, _) in slopes.iter().filter(|(node, _)| chance[*node] >= 0.5) {
            ground.hold_beside(node);
        }
        if ground.queue.is_empty() {
            break;
        }
    }
    slopes.iter().map(|(node, _)| *node).filter(|&node| chance[node] < 0.5).collect()
}

/// Free ground as runs of columns, by row.
struct Free {
    width: usize,
    runs: Vec<Vec<(Range<usize>, bool)>>,
    /// Runs that have come to be held and whose neighbours do not know yet: row and place in it.
    queue: Vec<(usize, usize)>,
}

impl Free {
    fn beside(width: usize, height: usize, slopes: &[(usize, Slope)], given: &[usize]) -> Free {
        let mut taken: Vec<usize> = slopes.iter().map(|(node, _)| *node).chain(given.iter().copied()).collect();
        taken.sort_unstable();
        let mut runs: Vec<Vec<(Range<usize>, bool)>> = vec![Vec::new(); height];
        let mut taken = taken.into_iter().peekable();
        for (row, runs) in runs.iter_mut().enumerate() {
            let mut start = 0;
            while let Some(node) = taken.next_if(|node| *node < (row + 1) * width) {
                let column = node - row * width;
                if start < column {
                    runs.push((start..column, false));
                }
                start = column + 1;
            }
            if start < width {
                runs.push((start..width, false));
            }
        }
        Free { width, runs, queue: Vec::new() }
    }
    /// Holds the runs of a row that touch some columns.
    fn hold(&mut self, row: usize, columns: Range<usize>) {
        let runs = &mut self.runs[row];
        let first = runs.partition_point(|(run, _)| run.end <= columns.start);
        for (k, (_, held)) in
            runs.iter_mut().enumerate().skip(first).take_while(|(_, (run, _))| run.start < columns.end)
        {
            if !std::mem::replace(held, true) {
                self.queue.push((row, k));
            }
        }
    }
    /// Holds the free ground beside a node.
    fn hold_beside(&mut self, node: usize) {
        let (column, row) = (node % self.width, node / self.width);
        self.hold(row, column.saturating_sub(1)..column + 2);
        self.hold_rows(row, column..column + 1);
    }
    /// Holds the free ground to the south and north of some columns of a row.
    fn hold_rows(&mut self, row: usize, columns: Range<usize>) {
        if row > 0 {
            self.hold(row - 1, columns.clone());
        }
        if row + 1 < self.runs.len() {
            self.hold(row + 1, columns);
        }
    }
    /// What is held holds the runs beside it.
    fn spread(&mut self, chance: &mut [f32]) {
        while let Some((row, run)) = self.queue.pop() {
            let columns = self.runs[row][run].0.clone();
            chance[row * self.width + columns.start..row * self.width + columns.end].fill(1.0);
            self.hold_rows(row, columns);
        }
    }
}

/// The neighbours that a slope is read from: east or west, south or north.
fn upstream(node: usize, slope: Slope, width: usize, height: usize) -> [Option<usize>; 2] {
    let (i, j) = (node % width, node / width);
    let [x, y] = slope.direction;
    let along = if x > 0.0 { (i > 0).then(|| node - 1) } else { (i + 1 < width).then(|| node + 1) };
    let across = if y > 0.0 { (j > 0).then(|| node - width) } else { (j + 1 < height).then(|| node + width) };
    [along, across]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;
    use crate::solver::guided::{self, Constraint, Update};
    use crate::solver::krylov::Stop;
    use crate::solver::samples::rows;

    const N: usize = 41;

    type Field = Vec<(usize, Slope)>;

    fn place(node: usize) -> (f64, f64) {
        ((node % N) as f64 - 20.2, (node / N) as f64 - 19.7)
    }
    fn field(direction: impl Fn(f64, f64) -> Option<[f64; 2]>) -> Field {
        let slope = |node: usize| {
            let (x, y) = place(node);
            Some((node, Slope::along(direction(x, y)?, -0.5)?))
        };
        (0..N * N).filter_map(slope).collect()
    }
    fn dropped(field: &Field, given: Vec<usize>) -> usize {
        adrift(N, N, field, &given).len()
    }

    #[test]
    fn sources_and_circles_are_adrift_and_sinks_are_not() {
        let disc = |x: f64, y: f64| x * x + y * y < 200.0;
        let source = field(|x, y| disc(x, y).then_some([x, y]));
        let circle = field(|x, y| (disc(x, y) && !disc(2.0 * x, 2.0 * y)).then_some([-y + 0.2 * x, x + 0.2 * y]));
        let sink = field(|x, y| disc(x, y).then_some([-x, -y]));
        assert_eq!((dropped(&source, vec![0]), dropped(&sink, vec![0])), (source.len(), 0));
        // The spiral around free ground that nothing holds leads from nothing either.
        assert!(dropped(&circle, vec![0]) > 300, "{}", dropped(&circle, vec![0]));
        // A given elevation at the source holds it all.
        let centre = 20 * N + 20;
        let held: Field = source.iter().copied().filter(|(node, _)| *node != centre).collect();
        assert!(dropped(&held, vec![0, centre]) < source.len() / 20, "{}", dropped(&held, vec![0, centre]));
    }

    #[test]
    fn ground_inside_a_ring_of_ridges_is_held_by_them() {
        // Slopes lead inwards from a ring of given elevations to a free pocket, and outwards from there nowhere.
        let ring = |node: usize, range: std::ops::Range<f64>| {
            let (x, y) = place(node);
            range.contains(&(x * x + y * y))
        };
        let field = field(|x, y| (100.0..200.0).contains(&(x * x + y * y)).then_some([-x, -y]));
        let given = (0..N * N).filter(|&node| ring(node, 200.0..280.0)).collect();
        assert_eq!(dropped(&field, given), 0);
    }

    /// The lowest elevation on `n` × `n` nodes of a square whose border is at 0, with slopes of −½ away from the middle of a disc.
    fn lowest(n: usize, followed: bool) -> f64 {
        let border = |i: usize, j: usize| i == 0 || j == 0 || i == n - 1 || j == n - 1;
        let away = |i: usize, j: usize| [i, j].map(|k| k as f64 / (n - 1) as f64 - 0.49);
        let slope = |i: usize, j: usize| {
            let [x, y] = away(i, j);
            if x * x + y * y < 0.1 { Slope::along([x, y], -0.5) } else { None }
        };
        let nodes = || (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let slopes: Field = nodes().filter_map(|(i, j)| Some((j * n + i, slope(i, j)?))).collect();
        let given: Vec<usize> = nodes().filter(|&(i, j)| border(i, j)).map(|(i, j)| j * n + i).collect();
        let dropped = if followed { Vec::new() } else { adrift(n, n, &slopes, &given) };
        let constraint = |i: usize, j: usize| match slope(i, j) {
            _ if border(i, j) => Constraint::Elevation(0.0),
            Some(slope) if !dropped.contains(&(j * n + i)) => Constraint::Slope(slope),
            _ => Constraint::Free,
        };
        let mut elevation = Plane::new(n, n);
        let equations =
            guided::equations(1.0 / (n - 1) as f64, Update::Corrected, &rows(n, constraint), &mut elevation).unwrap();
        assert!(guided::solve(&equations, &mut elevation, Stop::default()).unwrap().converged);
        elevation.iter(0).fold(0.0, f64::min)
    }

    #[test]
    fn slopes_that_part_from_nothing_dig_deeper_on_every_finer_raster() {
        // A slope of ½ cannot dig deeper than 0.36.
        let [coarse, middle, fine] = [9, 17, 25].map(|n| lowest(n, true));
        assert!(middle < 10.0 * coarse && fine < 20.0 * middle && fine < -1000.0, "{coarse}, {middle}, {fine}");
        // Left to diffusion they do nothing.
        assert!(lowest(25, false).abs() < 1e-9);
    }
}
