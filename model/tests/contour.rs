//! What is claimed of contours: a level lake, C¹ shores, no jump at the centre, a slope bound that holds.

mod common;

use common::Random;
use glam::{DVec2, DVec3};
use terrain_model::bounds::Region;
use terrain_model::primitive::contour::{Contour, Ray};
use terrain_model::profile::Knot;
use terrain_model::program::{CompileError, Program};
use terrain_model::tree::Tree;

fn compile(contour: Contour) -> Result<Program, CompileError> {
    let mut tree = Tree::new();
    let root = tree.push(contour);
    Program::compile(&tree, root)
}

fn knot(distance: f64, height: f64, slope: f64) -> Knot {
    Knot { distance, height, slope }
}

fn lake() -> Contour {
    let shore = |height: f64| vec![knot(-5.0, 0.0, 0.0), knot(0.0, 0.0, 0.0), knot(30.0, height, 0.2)];
    let rays = [(80.0, 4.0), (120.0, 9.0), (70.0, 6.0), (95.0, 12.0), (60.0, 5.0)];
    Contour {
        centre: DVec3::new(33.3, -71.7, 101.3),
        orientation: 0.3,
        rays: rays.map(|(radius, height)| Ray { angle: None, radius, profile: shore(height) }).to_vec(),
        reach: 60.0,
        weight: 1.2,
    }
}

#[test]
fn a_lake_is_level_to_the_last_bit_inside_its_contour() {
    let contour = lake();
    let program = compile(contour.clone()).expect("a lake");
    let mut random = Random(3);
    let (mut inside, mut outside) = (0, 0);
    for _ in 0..40_000 {
        let v = random.point(150.0);
        let (z, weight) = program.height(contour.centre.truncate() + v);
        // The contour passes between the smallest and the largest radius.
        if v.length() < 60.0 - 1e-9 {
            assert_eq!((z.to_bits(), weight.to_bits()), (101.3f64.to_bits(), 1.2f64.to_bits()), "{v}");
            inside += 1;
        } else if weight > 0.0 && z != 101.3 {
            assert!(z > 101.3);
            outside += 1;
        }
    }
    assert!(inside > 4000 && outside > 4000, "{inside} {outside}");
    // Control: a bed is not level.
    let mut bed = contour;
    bed.rays.iter_mut().for_each(|ray| ray.profile[0].height = -3.0);
    let program = compile(bed).expect("a lake with a bed");
    let spread = |d: f64| program.height(DVec2::new(33.3 + d, -71.7)).0;
    assert!((spread(0.0) - 98.3).abs() < 1e-12 && spread(0.0) == spread(1.0) && spread(85.0) > 100.0);
}

#[test]
fn shores_pass_through_the_rays_and_are_smooth_across_them() {
    let contour = lake();
    let program = compile(contour.clone()).expect("a lake");
    let at = |angle: f64, distance: f64| {
        contour.centre.truncate() + distance * DVec2::new(libm::cos(angle), libm::sin(angle))
    };
    for (k, ray) in contour.rays.iter().enumerate() {
        let angle = 0.3 + k as f64 * std::f64::consts::TAU / 5.0;
        let z = program.height(at(angle, ray.radius + 30.0)).0;
        assert!((z - contour.centre.z - ray.profile[2].height).abs() < 1e-9, "{k}: {z}");
        // The gradient does not jump across a ray; half-way between two it turns.
        let gradient = |angle: f64| program.sample(at(angle, ray.radius + 20.0)).gradient;
        assert!(gradient(angle - 1e-7).distance(gradient(angle + 1e-7)) < 1e-5, "{k}");
        assert!(gradient(angle + 0.3).distance(gradient(angle + 0.9)) > 1e-2, "control");
    }
}

#[test]
fn hunted_slopes_stay_below_the_certified_bounds_and_come_near_them() {
    let mut random = Random(8);
    for k in 0..4 {
        let mut contour = lake();
        contour.rays.iter_mut().for_each(|ray| ray.radius *= random.range(0.8, 1.3));
        let program = compile(contour).expect("a lake");
        let (lo, hi) = program.support().expect("a support");
        let bounds = program.bounds(Region::rectangle(lo, hi));
        let (mut slope, mut weight_slope) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            let s = program.sample(DVec2::new(random.range(lo.x, hi.x), random.range(lo.y, hi.y)));
            if s.weight > 0.0 {
                slope = slope.max(s.gradient.length());
                weight_slope = weight_slope.max(s.weight_gradient.length());
            }
        }
        println!(
            "{k}: slope {slope:.4} of {:.4}, weight {weight_slope:.5} of {:.5}",
            bounds.slope, bounds.weight_slope
        );
        assert!(slope <= bounds.support_slope && weight_slope <= bounds.weight_slope);
        assert!(8.0 * slope > bounds.support_slope && 8.0 * weight_slope > bounds.weight_slope);
    }
}

#[test]
fn malformed_contours_are_refused_with_the_place() {
    let fails = |change: &dyn Fn(&mut Contour), words: &str| {
        let mut contour = lake();
        change(&mut contour);
        let problem = compile(contour).expect_err(words).problem;
        assert!(problem.contains(words), "{problem}");
    };
    fails(&|c| c.rays.truncate(2), "at least 3");
    fails(&|c| c.rays[2].profile[0].height = 1.0, "ray 3 starts 1 m high");
    fails(&|c| c.rays[1].profile.clear(), "ray 2 of a contour has no profile");
    fails(&|c| c.rays[1].angle = Some(1.0), "for all rays");
    fails(&|c| c.rays.iter_mut().zip([0.0, 1.0, 0.5, 3.0, 5.0]).for_each(|(r, a)| r.angle = Some(a)), "after ray 2");
    fails(&|c| c.rays[4].profile[0].distance = -59.0, "at most 57.0 m");
    fails(&|c| c.reach = -1.0, "positive");
}
