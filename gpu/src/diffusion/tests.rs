use super::kernels::bits;
use super::levels::Levels;
use super::*;
use crate::context::device;
use glam::DVec2;
use terrain_diffusion::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};
use terrain_diffusion::fields::diffuse;
use terrain_diffusion::landscapes;
use terrain_diffusion::plane::Plane;
use terrain_diffusion::solver::cycle::{Cycle, Smoother};
use terrain_diffusion::solver::equations::{Equation, Equations};
use terrain_diffusion::solver::guided::{self, Constraint, Slope, Update};
use terrain_diffusion::solver::hierarchy::Hierarchy;
use terrain_diffusion::solver::krylov::Stop;
use terrain_diffusion::solver::variational;
use terrain_model::noise::mix;

/// Uniform in −1 to 1, by number.
fn chance(number: u32) -> f32 {
    mix(number, 17) as f32 / u32::MAX as f32 * 2.0 - 1.0
}

fn canyon() -> Vec<Curve> {
    landscapes::named("canyon")
        .and_then(|model| model.landscape().ok())
        .expect("an embedded landscape")
        .curves()
        .to_vec()
}
fn canyon_domain(nodes: usize) -> Domain {
    landscapes::named("canyon").and_then(|model| model.landscape().ok()).expect("an embedded landscape").domain(nodes)
}

/// Given values on a line and a bend, slopes beside the line, one corner without anything beyond it.
fn systems(width: usize, height: usize) -> [(&'static str, Equations); 3] {
    let given = |i: usize, j: usize| j == height / 3 && i > 3 || i == 2 * width / 3 && j > height / 2;
    let laplace = Equations::new(width, height, |j, row| {
        (0..width).filter(|i| given(*i, j)).for_each(|i| row[i] = Equation::Given);
    });
    let wanted = |i: usize, j: usize| match j.abs_diff(height / 3) {
        _ if given(i, j) => Some(Constraint::Elevation(10.0)),
        1..=9 if i > 3 => {
            let turned = if j > height / 3 { 1.0 } else { -1.0 };
            Slope::along([0.4, turned], -0.3).map(Constraint::Slope)
        }
        _ => None,
    };
    let rows: Vec<Vec<(u32, Constraint)>> =
        (0..height).map(|j| (0..width).filter_map(|i| Some((i as u32, wanted(i, j)?))).collect()).collect();
    let elevation = || Plane::new(width, height);
    let guided = guided::equations(1.0, Update::Corrected, &rows, &mut elevation()).unwrap();
    let variational = variational::equations(1.0, 10.0, &rows, &mut elevation()).unwrap();
    [("laplace", laplace), ("guided", guided), ("variational", variational)]
}

/// The largest |difference| between a cycle of the device and one of the processor, over the largest value.
fn cycles_differ(context: &Context, kernels: &levels::Kernels, equations: &Equations) -> f32 {
    let [width, height] = equations.size();
    let mut cycle = Cycle::<1>::new(equations, Smoother::FourColoursTwice).unwrap();
    let residual: Vec<f32> = (0..width * height)
        .map(|k| if equations.is_given(k % width, k / width) { 0.0 } else { chance(k as u32) })
        .collect();
    residual.iter().enumerate().for_each(|(k, value)| cycle.residual().set(k % width, k / width, [*value]));
    cycle.apply();
    let expected = cycle.correction().1.field(0);

    let hierarchy = Hierarchy::new(equations).unwrap();
    let levels = Levels::new(context, kernels, equations, &hierarchy).unwrap();
    let bytes = bits(&residual).into_iter().flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
    context.queue().write_buffer(&levels.sides[1], 0, &bytes);
    let mut encoder = context.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    context.pass(&mut encoder, |pass| levels.cycle(pass, 1));
    context.queue().submit([encoder.finish()]);
    let found = context.download(&levels.result, width * height).unwrap();
    let largest = expected.iter().fold(0.0f32, |most, value| most.max(value.abs()));
    let differences = found.iter().zip(&expected).map(|(found, expected)| (f32::from_bits(*found) - expected).abs());
    differences.fold(0.0, |most, next| if next.is_nan() { f32::NAN } else { most.max(next) }) / largest
}

/// A cycle has 20 steps a level. Each rounds a dozen times by 2⁻²⁴ of what it adds up, and over six levels, up and down, that is
/// 20·6·12·2⁻²⁴ = 9·10⁻⁵ of the largest value if nothing cancels and nothing grows.
const CYCLE: f32 = 1e-4;

#[test]
fn a_cycle_of_the_device_is_that_of_the_processor_and_a_fault_in_any_kernel_of_it_is_seen() {
    let Some(context) = device() else { return };
    let diffuser = Diffuser::new(&context).unwrap();
    for [width, height] in [[65, 65], [70, 43], [33, 120], [128, 40]] {
        for (name, equations) in systems(width, height) {
            let differs = cycles_differ(&context, &diffuser.multigrid, &equations);
            assert!(differs <= CYCLE, "{name}, {width} × {height}: {differs}");
        }
    }
    let faults = [
        ("finest start", "select(0.0, b", "select(9.0, b"),
        ("finest relax", "sides[w + 1u] * west", "sides[w] * west"),
        ("finest relax", "corners[c + 2u]", "corners[c + 1u]"),
        ("finest residual", "return (west + east) + (south + north);", "return (west + east) + (south + east);"),
        ("coarse start", "select(0.0, b", "select(9.0, b"),
        ("coarse relax", "coefficients[at + size.width] * x[row]", "coefficients[at] * x[row]"),
        ("coarse residual", "line(i, j, 1)", "line(i, j, 0)"),
        ("restrict", "middles[(4u * j + 2u) * n + i]", "middles[(4u * j + 3u) * n + i]"),
        ("prolong", "lines[at + n]", "lines[at]"),
        ("coarsest", "id.x * n + k", "k * n + id.x + 1u"),
    ];
    let systems = systems(65, 65);
    let unseen = faults.map(|(kernel, from, to)| {
        let faulty = Diffuser::perturbed(&context, kernel, from, to).unwrap();
        let differs = systems.each_ref().map(|(_, equations)| cycles_differ(&context, &faulty.multigrid, equations));
        (differs.iter().all(|differs| *differs <= CYCLE)).then_some((kernel, to, differs))
    });
    assert!(unseen.iter().all(Option::is_none), "{unseen:?}");
}

#[test]
fn converged_fields_are_those_of_the_processor_within_what_their_residuals_allow() {
    let Some(context) = device() else { return };
    let diffuser = Diffuser::new(&context).unwrap();
    let stop = Stop { relative_residual: 1e-11, iterations: 60 };
    for solver in [Solver::Multigrid, Solver::Printed, Solver::Variational] {
        let settings = Settings { solver, stop, whole_gradient: true, ..Settings::default() };
        let (fields, found) = diffuser.compare(&canyon(), canyon_domain(97), &settings).unwrap();
        assert_eq!((found.len(), fields.reports.len()), (3, 3));
        for found in &found {
            assert!(found.converged && found.difference <= found.bound, "{solver:?}: {found:?}");
            // The bound is worth something: a ten-thousandth of the range at most.
            assert!(found.bound <= 1e-4 * found.range, "{solver:?}: {found:?}");
            assert!(found.iterations[0] <= 16, "{solver:?}: {found:?}");
        }
        assert!(fields.reports.iter().all(|report| report.converged && report.relative_residual <= 1e-11));
    }
}

#[test]
fn a_faulty_product_does_not_converge_and_says_so() {
    let Some(context) = device() else { return };
    let faulty = Diffuser::perturbed(&context, "product", "sides[w] * south", "sides[w] * north").unwrap();
    let (fields, found) = faulty.compare(&canyon(), canyon_domain(65), &Settings::default()).unwrap();
    assert!(found.iter().any(|found| !found.converged || found.difference > found.bound), "{found:?}");
    assert!(fields.reports.iter().any(|report| !report.converged), "{:?}", fields.reports);
}

#[test]
fn each_raster_of_the_cascade_is_that_of_f64_within_what_f32_loses_and_a_perturbed_slope_is_not() {
    let Some(context) = device() else { return };
    let diffuser = Diffuser::new(&context).unwrap();
    for (update, solver, nodes) in [
        (Update::Printed, Solver::Paper, 129),
        (Update::Corrected, Solver::Corrected, 129),
        (Update::Corrected, Solver::Corrected, 100),
    ] {
        let (fields, share) = diffuser.compare_cascade(&canyon(), canyon_domain(nodes), update).unwrap();
        assert!(share.largest() <= 1.0 && share.elevation > 0.0, "{update:?}: {share:?}");
        let settings = Settings { solver, ..Settings::default() };
        assert_eq!(diffuser.diffuse(&canyon(), canyon_domain(nodes), &settings).unwrap().elevation, fields.elevation);
        let exact = diffuse(&canyon(), canyon_domain(nodes), &settings).unwrap();
        assert!(fields.reports.iter().zip(&exact.reports).all(|(a, b)| a.iterations == b.iterations));
    }
    for (kernel, from, to, field) in [
        ("jacobi", "0.5 * implied", "0.501 * implied", 2),
        ("jacobi", "count += 1.0", "count += 1.001", 0),
        ("raise", "south * (1.0 - t.y)", "south * (1.001 - t.y)", 1),
    ] {
        let faulty = Diffuser::perturbed(&context, kernel, from, to).unwrap();
        let (_, share) = faulty.compare_cascade(&canyon(), canyon_domain(129), Update::Corrected).unwrap();
        assert!([share.gradient, share.noise, share.elevation][field] > 1.0, "{kernel}, {to}: {share:?}");
    }
}

#[test]
fn what_the_processor_refuses_the_device_refuses_too() {
    let Some(context) = device() else { return };
    let diffuser = Diffuser::new(&context).unwrap();
    let side = Side { extent: 20.0, angle: 0.5 };
    let point = |place| ConstraintPoint {
        place,
        elevation: None,
        gradient: Some(Gradient { left: side, right: side }),
        noise: Some(Noise { amplitude: 1.0, roughness: 0.5 }),
    };
    let control = [20.0, 40.0, 60.0, 80.0].map(|x| DVec2::new(x, 50.0)).to_vec();
    let crack = Curve::new(control.clone(), vec![point(0.0), point(1.0)]).unwrap();
    for solver in [Solver::Paper, Solver::Multigrid] {
        let settings = Settings { solver, ..Settings::default() };
        let refused = diffuser.diffuse(std::slice::from_ref(&crack), Domain::square(100.0, 33), &settings);
        assert!(matches!(refused, Err(SolveError::Unheld)), "{solver:?}");
    }
    let held = |place| ConstraintPoint { elevation: Some(Elevation { height: 5.0, radius: 0.0 }), ..point(place) };
    let ridge = Curve::new(control, vec![held(0.0), held(1.0)]).unwrap();
    let narrow = Domain { origin: DVec2::new(10.0, 49.96), spacing: 0.01, width: 9000, height: 9 };
    let refused = diffuser.diffuse(&[ridge], narrow, &Settings::default()).unwrap_err().to_string();
    assert!(refused.contains("too narrow") && !refused.contains('\n'), "{refused}");
}

#[test]
fn what_no_binding_holds_is_refused_before_the_device_is_asked() {
    let Some(context) = device() else { return };
    let words = usize::try_from(context.largest_binding() / 4).unwrap() + 1;
    let refused = kernels::plane(&context, "corrections", words).unwrap_err();
    assert!(matches!(refused, DiffusionError::TooLarge { .. }));
    let refused = refused.to_string();
    assert!(refused.contains("use fewer nodes") && !refused.contains('\n'), "{refused}");
}
