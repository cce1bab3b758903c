//! The first place where a graphics adapter and the processor must agree: the integer hash of lattice points that every noise stands
//! on. Integers have no tolerance, so one differing bit is a fault of the kernel or of the adapter.

use crate::environment::Gpu;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Claim, Outcome, Table};
use terrain_gpu::lattice_hash::{Point, hashes, twin};
use terrain_model::noise::mix;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "model/lattice-hash",
    title: "Lattice hash, adapter against processor",
    section: "kernels on wgpu",
    about: "Lattice points all over the range of 32-bit indices, and near the origin, are hashed by the kernel and by the processor. \
            The hashes must be the same bits. The control moves each point by one along one axis before the processor hashes it: a \
            comparison that still finds equal hashes compares nothing.",
    code: "experiments/src/model/lattice_hash.rs",
    test: "gpu/src/lattice_hash.rs::a_million_lattice_points_hash_alike_on_device_and_processor",
    expected: |profile| Expected {
        seconds: profile.pick(1.0, 20.0),
        memory_bytes: profile.pick(128 << 20, 512 << 20),
        disk_bytes: 16 << 10,
    },
    run,
};

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let device = match crate::gpu::adapter()? {
        Ok(device) => device,
        Err(skipped) => return Ok(skipped),
    };
    let count = ctx.profile.pick(1 << 18, 1 << 22);
    let points = points(count, ctx.seed_for("points"));
    let on_device = hashes(&device, &points).map_err(ExperimentError::failed)?;
    let differing = |moved: i32| {
        let beside = |p: &Point| Point { index: [p.index[0], p.index[1].wrapping_add(moved), p.index[2]], ..*p };
        points.iter().zip(&on_device).filter(|(point, found)| twin(beside(point)) != **found).count()
    };
    let (wrong, control) = (differing(0), differing(1));
    let mut outcome = Outcome::new(if wrong == 0 { Verdict::Reproduced } else { Verdict::NotReproduced });
    let gpu = Gpu::from(device.description().clone());
    let mut table = Table::new("agreement", "Hashes on the adapter and on the processor")
        .column("hashes of")
        .column("points")
        .column("largest difference allowed")
        .column("points that differ");
    for (axes, axis) in [("x, y", 0), ("x, y, z", 1)] {
        let differ = points.iter().zip(&on_device).filter(|(point, found)| twin(**point)[axis] != found[axis]).count();
        table.row([
            axes.into(),
            Cell::number(count as f64, "", 7),
            "none: the same bits".into(),
            Cell::number(differ as f64, "", 7),
        ]);
    }
    outcome.table(table)?;
    outcome.metric("points", count as f64)?;
    outcome.metric("differing", wrong as f64)?;
    outcome.metric("control_differing", control as f64)?;
    let statement = "The kernel's hash of a lattice point has the processor's bits.";
    let verdict = if wrong == 0 { ClaimVerdict::Tested } else { ClaimVerdict::Refuted };
    let mut claim = Claim::new("same-bits", statement, verdict, format!("{count} points"));
    if let Some((point, found)) = points.iter().zip(&on_device).find(|(point, found)| twin(**point) != **found) {
        claim = claim.witness(format!("{point:?}: {found:x?} on the adapter, {:x?} on the processor", twin(*point)));
    }
    outcome.claim(claim)?;
    outcome.control("a neighbour's hash", "y moved by one", "all but chance hits differ", control > count / 2);
    outcome.gpu(gpu);
    Ok(outcome)
}

/// Points of which half lie all over the range of indices and half within 512 of the origin, on four lattices.
fn points(count: usize, seed: u64) -> Vec<Point> {
    let mut state = (seed ^ seed >> 32) as u32;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9);
        mix(state, 0)
    };
    (0..count)
        .map(|k| {
            let index = [next() as i32, next() as i32, next() as i32];
            let index = if k % 2 == 0 { index } else { index.map(|i| i >> 22) };
            Point { index, seed: next() % 4 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_near_and_far_on_every_side_and_on_each_lattice() {
        let points = points(1000, 7);
        for axis in 0..3 {
            assert!(
                points.iter().any(|p| p.index[axis] < -(1 << 30)) && points.iter().any(|p| p.index[axis] > 1 << 30)
            );
            assert!(points.iter().skip(1).step_by(2).all(|p| p.index[axis].abs() <= 512));
        }
        assert!((0..4).all(|seed| points.iter().any(|p| p.seed == seed)));
    }
}
