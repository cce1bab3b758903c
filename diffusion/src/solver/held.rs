//! Which slopes lead from somewhere.
//!
//! A node that follows a slope takes its elevation from upstream. Where directions part from a point that no curve holds, as the
//! diffused ones of crossing bands may, or run in a circle, each node reads another and adds its rise each time, and only diffusion across
//! the whole basin ends it: the field grows exponentially with the number of cells (−8·10³ m at 1025², −4·10⁷ m at 2049² for one hairpin among
//! ten curves). So a slope is followed only where the chance is at least one half that reading on upstream, at each node from the
//! east–west or the north–south neighbour by the shares of its equation, ends at a given elevation or on free ground that is held. What
//! is left is free ground.

use super::guided::Slope;

/// Rounds of four sweeps: a path that turns around more often is not followed to its end.
const ROUNDS: usize = 4;

/// Which of `slopes` lead from nothing, by node row by row, ascending as they are; at the nodes in `given` elevations are held.
pub fn adrift(width: usize, height: usize, slopes: &[(usize, Slope)], given: Vec<usize>) -> Vec<usize> {
    let n = width * height;
    if slopes.is_empty() {
        return Vec::new();
    }
    let starts = |row: usize| slopes.partition_point(|(node, _)| *node < row * width);
    let rows: Vec<std::ops::Range<usize>> = (0..height).map(|row| starts(row)..starts(row + 1)).collect();
    // The chance to end somewhere that is held; of what is held it is 1.
    let mut chance = vec![0.0f32; n];
    let mut follows = vec![false; n];
    slopes.iter().for_each(|(node, _)| follows[*node] = true);
    let mut queue = given;
    queue.iter().for_each(|&node| chance[node] = 1.0);
    let beside = |node: usize| {
        let (i, j) = (node % width, node / width);
        let places = [(i > 0, node.wrapping_sub(1)), (i + 1 < width, node + 1)];
        let rows = [(j > 0, node.wrapping_sub(width)), (j + 1 < height, node + width)];
        places.into_iter().chain(rows).filter(|(inside, _)| *inside).map(|(_, node)| node)
    };
    loop {
        // Free ground is held by any neighbour that is.
        while let Some(node) = queue.pop() {
            for next in beside(node) {
                if chance[next] < 1.0 && !follows[next] {
                    chance[next] = 1.0;
                    queue.push(next);
                }
            }
        }
        for _ in 0..ROUNDS {
            for (from_north, from_east) in [(false, false), (true, true), (false, true), (true, false)] {
                let mut follow = |&(node, slope): &(usize, Slope)| {
                    let [x, y] = upstream(node, slope, width, height);
                    let [p, q] = slope.direction.map(|component| component.abs() as f32);
                    let (p, q) = (if x.is_some() { p } else { 0.0 }, if y.is_some() { q } else { 0.0 });
                    let at = |place: Option<usize>| place.map_or(0.0, |place| chance[place]);
                    let found = if p + q > 0.0 { (p * at(x) + q * at(y)) / (p + q) } else { 1.0 };
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
            for next in beside(node).filter(|&next| chance[next] == 0.0 && !follows[next]) {
                queue.push(next);
            }
        }
        if queue.is_empty() {
            break;
        }
        queue.iter().for_each(|&node| chance[node] = 1.0);
    }
    slopes.iter().map(|(node, _)| *node).filter(|&node| chance[node] < 0.5).collect()
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
        adrift(N, N, field, given).len()
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
}
