//! The lattice hash on the device and its twin on the processor. Integers only, so the two agree bit for bit on every
//! adapter: a device that fails this computes no noise worth comparing.

use crate::context::{Context, ContextError};
use terrain_model::noise::hash::Keys;

/// What every kernel that hashes begins with.
pub(crate) const HASH: &str = include_str!("../shaders/hash.wgsl");
/// The kernel.
pub const SOURCE: &str = concat!(include_str!("../shaders/hash.wgsl"), include_str!("../shaders/lattice_hash.wgsl"));

/// Invocations of one workgroup.
const GROUP: usize = 64;
/// The most workgroups along one axis that every adapter allows.
const GROUPS: usize = 65_535;

/// A lattice point and the seed of its lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Point {
    /// x, y, z.
    pub index: [i32; 3],
    /// Selects the lattice.
    pub seed: u32,
}

/// The hash of (x, y) and the hash of (x, y, z), on the processor.
pub fn twin(point: Point) -> [u32; 2] {
    let [x, y, z] = point.index.map(|i| i as u32);
    let keys = Keys::new(point.seed);
    [keys.point2(x, y), keys.point3(x, y, z)]
}

/// The same of every point, on the device.
///
/// # Errors
/// When the kernel is refused or the device does not finish.
pub fn hashes(context: &Context, points: &[Point]) -> Result<Vec<[u32; 2]>, ContextError> {
    run(context, SOURCE, points)
}

fn run(context: &Context, source: &str, points: &[Point]) -> Result<Vec<[u32; 2]>, ContextError> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let kernel = context.kernel("lattice_hash.wgsl", source, "lattice_hash")?;
    let input: Vec<u32> =
        points.iter().flat_map(|p| [p.index[0] as u32, p.index[1] as u32, p.index[2] as u32, p.seed]).collect();
    let groups = points.len().div_ceil(GROUP);
    let across = groups.min(GROUPS);
    let output = context.run(&kernel, [across as u32, groups.div_ceil(across) as u32], &input, 2 * points.len())?;
    Ok(output.as_chunks::<2>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::device;

    /// The corners of the index range, its middle, and points all over it, on four lattices.
    fn points(count: usize) -> Vec<Point> {
        let edge = [i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX - 1, i32::MAX];
        let mut points = Vec::with_capacity(count);
        for x in edge {
            for y in edge {
                points.extend(edge.map(|z| Point { index: [x, y, z], seed: 0 }));
            }
        }
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            terrain_model::noise::mix(state, 0)
        };
        while points.len() < count {
            let index = [next() as i32, next() as i32, next() as i32];
            let near = index.map(|i| i >> 22);
            points.push(Point { index: if points.len().is_multiple_of(2) { index } else { near }, seed: next() % 4 });
        }
        points
    }

    #[test]
    fn a_million_lattice_points_hash_alike_on_device_and_processor() {
        let Some(context) = device() else { return };
        println!("adapter: {:?}", context.description());
        let points = points(1_000_000);
        assert!(points.iter().any(|p| p.index.iter().any(|i| *i < 0)));
        let device = hashes(&context, &points).unwrap();
        assert_eq!(device.len(), points.len());
        for (point, found) in points.iter().zip(device) {
            assert_eq!(found, twin(*point), "{point:?}");
        }
    }

    #[test]
    fn a_lattice_larger_than_one_row_of_workgroups_is_hashed_to_its_end() {
        let Some(context) = device() else { return };
        let points = points(GROUP * GROUPS + 1000);
        let device = hashes(&context, &points).unwrap();
        for k in [0, GROUP * GROUPS - 1, GROUP * GROUPS, points.len() - 1] {
            assert_eq!(device[k], twin(points[k]));
        }
    }

    #[test]
    fn one_wrong_bit_in_any_constant_of_the_kernel_is_found() {
        let Some(context) = device() else { return };
        let points = points(1000);
        let mut controls = 0;
        for (at, _) in SOURCE.match_indices("0x") {
            // The digit before the suffix: its lowest bit is the constant's.
            let (head, tail) = SOURCE.split_at(at + 9);
            let digit = tail.chars().next().and_then(|c| c.to_digit(16)).expect("eight hexadecimal digits");
            let wrong = format!("{head}{:x}{}", digit ^ 2, &tail[1..]);
            let device = run(&context, &wrong, &points).unwrap();
            assert!(points.iter().zip(device).any(|(point, found)| found != twin(*point)), "constant at byte {at}");
            controls += 1;
        }
        assert_eq!(controls, 6);
    }

    #[test]
    fn a_kernel_that_is_no_wgsl_is_an_error_with_its_name() {
        let Some(context) = device() else { return };
        let error = context.kernel("broken.wgsl", "fn f( {", "f").unwrap_err().to_string();
        assert!(error.starts_with("broken.wgsl: "), "{error}");
    }
}
