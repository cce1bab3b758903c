//! Figure 6: noise read in the plane and in space, and how much the former stretches on slopes.

use super::picture::Look;
use super::scenes::{canyon, detail, looking, shoot, size};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_model::noise::{Octaves, mix};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/fig6",
    title: "Figure 6: noise in the plane and in space",
    section: "§5, Fig. 6",
    about: "On planes of several slopes the noise is read at pairs of points a fiftieth of a wavelength apart on the surface, along the \
            contour and up the slope. The stretch is the root mean square change along the contour over that up the slope: 1 is \
            none. Noise in the plane must stretch by √(1 + slope²), noise in space not at all.",
    code: "experiments/src/tessellation/fig6.rs",
    test: "experiments/src/tessellation/fig6.rs::noise_in_the_plane_stretches_and_noise_in_space_does_not",
    expected: |profile| Expected {
        seconds: profile.pick(4.0, 30.0),
        memory_bytes: profile.pick(1, 4) << 30,
        disk_bytes: profile.pick(1 << 20, 8 << 20),
    },
    run,
};

/// Slopes; the last is 80°.
const SLOPES: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 5.671];
/// How far a measured stretch may be from the expected one: sampling.
const TOLERANCE: f64 = 0.05;

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let ground = Ground::new(&canyon()?, 0.6).map_err(ExperimentError::failed)?;
    let (eye, target) = (riverbed(&ground, 0.10), riverbed(&ground, 0.34));
    let volume = detail(&ground, 4.0, Space::Volume)?;
    let view = looking((&ground, &volume), [eye, 0.10, 90.0], [target, 0.34, 120.0], size(ctx))?;
    let mut look = Look::over(&ground).without_snow();
    // Into the canyon, on both walls.
    look.sun = [-0.25, -0.62, 0.744];
    for (space, name) in [
        (Space::Plan, ("plan", "Left: noise at x and y, drawn out down the walls")),
        (Space::Volume, ("volume", "Right: noise at x, y and z")),
    ] {
        outcome.picture(shoot(ctx, (&ground, &detail(&ground, 4.0, space)?, &look), view, 5.0, name)?.0);
    }
    let points = ctx.profile.pick(20_000, 200_000);
    let mut table = Table::new("stretch", "Stretch up the slope")
        .column("slope")
        .column("in the plane")
        .column("√(1 + slope²)")
        .column("in space");
    let (mut plans, mut volumes, mut worst) = (Vec::new(), Vec::new(), 0.0f64);
    for slope in SLOPES {
        let [plan, volume] = [Space::Plan, Space::Volume].map(|space| stretch(space, slope, points));
        let (plan, volume, expected) = (plan?, volume?, (1.0 + slope * slope).sqrt());
        worst = worst.max((plan / expected - 1.0).abs()).max((volume - 1.0).abs());
        table.row([
            Cell::number(slope, "", 3),
            Cell::number(plan, "", 3),
            Cell::number(expected, "", 3),
            Cell::number(volume, "", 3),
        ]);
        plans.push((slope, plan));
        volumes.push((slope, volume));
    }
    outcome.table(table)?;
    outcome.metric("stretch_plan_at_80_degrees", plans[SLOPES.len() - 1].1)?;
    outcome.metric("stretch_volume_at_80_degrees", volumes[SLOPES.len() - 1].1)?;
    outcome.metric("largest_error", worst)?;
    let stretched = plans[SLOPES.len() - 1].1;
    outcome.control("noise in the plane", "on 80°", "is no noise without stretch", (stretched - 1.0).abs() > TOLERANCE);
    let plot = Plot::new("stretch_by_slope", "Stretch up the slope", Axis::linear("slope"), Axis::linear("stretch"));
    outcome.plot(plot.series("plane", Style::LineAndPoints, plans).series("space", Style::LineAndPoints, volumes))?;
    if worst > TOLERANCE {
        outcome.set_verdict(Verdict::NotReproduced, format!("a stretch is off by {worst}"));
    }
    Ok(outcome)
}

/// The lowest x at the share `y` of the way north, as a share of the side.
fn riverbed(ground: &Ground, y: f64) -> f64 {
    let [width, height] = ground.extent();
    let lower = |a: &f64, b: &f64| {
        let [a, b] = [a, b].map(|x| ground.elevation([x * width, y * height]));
        a.total_cmp(&b)
    };
    (1..200).map(|k| f64::from(k) / 200.0).min_by(lower).unwrap_or(0.5)
}

/// Of one octave, wavelength 10 m, on a plane that rises with x.
fn stretch(space: Space, slope: f64, points: u32) -> Result<f64, ExperimentError> {
    let octaves = Octaves { octaves: 1, frequency: 0.1, lacunarity: 2.0, gain: 0.5, amplitude: 1.0 };
    let detail = Detail::new(&octaves, 5, space).ok_or_else(|| ExperimentError::failed("octaves"))?;
    let step = 0.2;
    let along = (1.0 + slope * slope).sqrt().recip();
    let (mut contour, mut up) = (0.0, 0.0);
    for k in 0..points {
        let [x, y] = [0, 1].map(|axis| 1e4 * f64::from(mix(mix(21, k), axis)) / 4_294_967_296.0);
        let at = |dx: f64, dy: f64| detail.fbm([x + dx, y + dy, slope * (x + dx)], 0.0);
        let here: f64 = at(0.0, 0.0);
        let change = |other: f64| (other - here) * (other - here);
        contour += change(at(0.0, step));
        up += change(at(step * along, 0.0));
    }
    Ok((contour / up).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn noise_in_the_plane_stretches_and_noise_in_space_does_not() {
        for slope in [0.0, 2.0, 5.671] {
            let expected = (1.0f64 + slope * slope).sqrt();
            assert!((stretch(Space::Plan, slope, 20_000).unwrap() / expected - 1.0).abs() < TOLERANCE);
            assert!((stretch(Space::Volume, slope, 20_000).unwrap() - 1.0).abs() < TOLERANCE);
        }
    }
}
