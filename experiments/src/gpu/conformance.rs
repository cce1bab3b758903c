//! Every node and operator of the feature tree on three executors: scalar `f64`, `f32` lanes and the adapter.

use crate::environment::Gpu;
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use terrain_gpu::program::conformance;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "gpu/conformance",
    title: "Nodes and operators on the adapter, the lanes and the processor",
    section: "Génevaux 2015, §8.2",
    about: "Each node and operator, near the origin and 4,000 km from it, at random points, on borders of lattice cells and on rims of \
            supports. The oracle is the f64 run of the same rounded parameters. The lanes must lie within the error that the number \
            `Rounded` derives, the adapter within ten times that: its division and root may err by more. \
            The controls are a weight that is off by 10⁻⁴, a noise with another fade, and rasters read off their place.",
    code: "experiments/src/gpu/conformance.rs",
    test: "gpu/src/program/tests.rs::the_device_agrees_with_f64_within_the_derived_tolerance_and_a_perturbed_shader_does_not",
    expected: |profile| Expected { seconds: profile.pick(6.0, 60.0), memory_bytes: 256 << 20, disk_bytes: 16 << 10 },
    run,
};

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let device = match crate::gpu::adapter()? {
        Ok(device) => device,
        Err(skipped) => return Ok(skipped),
    };
    let found =
        conformance::run(&device, ctx.profile.pick(96, 2048), ctx.seed as u32).map_err(ExperimentError::failed)?;
    let agrees = found.failures + found.lane_failures == 0;
    let mut outcome = Outcome::new(if agrees { Verdict::Reproduced } else { Verdict::NotReproduced });
    let mut table =
        Table::new("agreement", "Elevations and weights beside the f64 run").column("quantity").column("value");
    let counts = [
        ("programs", found.programs),
        ("values compared", found.cases),
        ("elevations where the weight nearly vanishes, not compared", found.vacuous),
        ("of the adapter outside the tolerance", found.failures),
        ("of the lanes outside the derived error", found.lane_failures),
        ("of perturbed shaders outside the tolerance", found.control_failures),
        ("programs in which a perturbed shader went unnoticed", found.blind_controls),
    ];
    for (name, count) in counts {
        table.row([name.into(), Cell::count(count as u64)]);
    }
    outcome.table(table)?;
    outcome.metric("cases", found.cases as f64)?;
    outcome.metric("failures", found.failures as f64)?;
    outcome.metric("lane_failures", found.lane_failures as f64)?;
    outcome.metric("control_failures", found.control_failures as f64)?;
    // An adapter may contract and order operations as it likes: these differ between adapters.
    outcome.timing("max_ulp", found.max_ulp)?;
    outcome.timing("largest_share_of_tolerance", found.largest_share)?;
    let noticed = found.blind_controls == 0 && found.control_failures > 0;
    outcome.control(
        "perturbed shaders",
        "weights × 1.0001; a fade of −14.99; places in rasters × 1.001",
        "each is noticed in each program",
        noticed,
    );
    outcome.gpu(Gpu::from(device.description().clone()));
    Ok(outcome)
}
