//! Marching tracers against the certified one, on random trees and every family of rays.

mod common;

use common::{HALF, Random, random_focus, random_tree};
use glam::DVec3;
use terrain_model::program::{Cells, Evidence, Program};
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};

fn random_ray(random: &mut Random) -> Ray {
    let o = random.point(1.5 * HALF);
    let origin = DVec3::new(o.x, o.y, random.range(-50.0, 400.0));
    let toward = random.point(HALF);
    let target = DVec3::new(toward.x, toward.y, random.range(-20.0, 80.0));
    Ray { origin, direction: (target - origin).normalize() }
}

#[derive(Debug, Default)]
struct Tally {
    rays: usize,
    hits: usize,
    walls: usize,
    missed: usize,
    false_hits: usize,
    gave_up: usize,
    undecided: usize,
    evaluations: u64,
}

fn compare(
    tracer: Tracer,
    program: &Program,
    surface: &Surface<'_>,
    random: &mut Random,
    rays: usize,
    tally: &mut Tally,
) {
    let (settings, effort) = (Settings::default(), Effort::default());
    let mut field = HeightRay::new(surface);
    let mut oracle = CertifiedTracer::new(program);
    for _ in 0..rays {
        let ray = random_ray(random);
        field.aim(ray);
        let answer = tracer.trace(surface, &mut field, &settings);
        tally.evaluations += field.evaluations();
        tally.rays += 1;
        let truth = oracle.trace(&ray, &effort);
        tally.gave_up += usize::from(matches!(answer, Answer::GaveUp { .. }));
        match truth {
            Certified::Hit { t1, .. } | Certified::Wall { t1, .. } => {
                tally.hits += usize::from(matches!(truth, Certified::Hit { .. }));
                tally.walls += usize::from(matches!(truth, Certified::Wall { .. }));
                let missed = answer.distance().is_none_or(|t| t > t1 + effort.bracket);
                if missed {
                    tally.missed += 1;
                    if tally.missed < 4 {
                        eprintln!("missed: {answer:?} {truth:?} {ray:?}");
                    }
                }
                if let Answer::Hit { t } = answer {
                    tally.false_hits += usize::from(oracle.above_at(&ray, t, settings.epsilon));
                }
            }
            Certified::Miss => {
                if answer.distance().is_some() {
                    tally.false_hits += 1;
                    eprintln!("false: {answer:?} {ray:?}");
                }
            }
            Certified::Undecided { .. } => {
                tally.undecided += 1;
                if tally.undecided < 6 {
                    eprintln!("undecided {truth:?} {answer:?} {ray:?}");
                }
            }
        }
    }
}

fn bounded(seed: u64) -> Option<Program> {
    let (tree, root) = random_tree(seed);
    let program =
        Program::compile(&tree, root).expect("a random tree compiles").with_focus(random_focus(seed).as_ref());
    // Sphere tracing needs a finite slope and somewhere to look.
    (Surface::new(&program).global().slope < 100.0).then_some(program)
}

#[test]
fn no_tracer_misses_what_is_certified() {
    for tracer in Tracer::ALL {
        let mut tally = Tally::default();
        for (k, program) in (0..40).filter_map(bounded).take(16).enumerate() {
            let surface = Surface::new(&program);
            compare(tracer, &program, &surface, &mut Random(k as u64), 60, &mut tally);
        }
        eprintln!("{tracer:?} {tally:?}");
        assert_eq!((tally.missed, tally.false_hits, tally.gave_up), (0, 0, 0), "{tracer:?} {tally:?}");
        assert!(tally.hits > 70 && tally.walls > 30 && tally.undecided * 100 < tally.rays, "{tracer:?} {tally:?}");
    }
}

#[test]
fn a_bound_that_is_too_small_is_convicted() {
    let mut tally = Tally::default();
    for (k, program) in (0..40).filter_map(bounded).take(20).enumerate() {
        let surface = Surface::new(&program).with_slope_cap(0.02);
        compare(Tracer::Sphere, &program, &surface, &mut Random(k as u64), 60, &mut tally);
    }
    assert!(tally.missed > 0, "{tally:?}");
}

#[test]
fn the_certified_answer_is_unaffected_by_bounds() {
    // The oracle takes the program, never a `Surface`: a control with every bound broken gives the same answers.
    let mut wrong = 0;
    for (k, program) in (0..40).filter_map(bounded).take(10).enumerate() {
        let mut random = Random(k as u64);
        let rays: Vec<Ray> = (0..40).map(|_| random_ray(&mut random)).collect();
        let mut oracle = CertifiedTracer::new(&program);
        let before: Vec<Certified> = rays.iter().map(|ray| oracle.trace(ray, &Effort::default())).collect();
        let broken = Surface::new(&program).with_slope_cap(0.0);
        let mut field = HeightRay::new(&broken);
        for (ray, truth) in rays.iter().zip(&before) {
            field.aim(*ray);
            let answer = Tracer::Accelerated.trace(&broken, &mut field, &Settings::default());
            if let Certified::Hit { t1, .. } = truth {
                wrong += usize::from(answer.distance().is_none_or(|t| t > t1 + 0.1));
            }
            assert_eq!(oracle.trace(ray, &Effort::default()), *truth);
        }
    }
    assert!(wrong > 0, "a slope bound of 0 must mislead the tracer that uses it");
}

/// The oracle over squares that it pruned by its own enclosures decides as the oracle over the whole program, and no later.
#[test]
fn squares_do_not_change_what_is_certified() {
    let (mut decided, mut control) = (0, 0);
    for seed in (0..400).filter(|seed| bounded(*seed).is_some()).take(12) {
        let program = bounded(seed).expect("it was");
        let cells = Cells::new(&program, Evidence::Enclosures);
        let (mut whole, mut parts) = (CertifiedTracer::new(&program), CertifiedTracer::over(&cells));
        let effort = Effort::default();
        let mut random = Random(seed ^ 0xCE11);
        for _ in 0..60 {
            let ray = random_ray(&mut random);
            let (a, b) = (whole.trace(&ray, &effort), parts.trace(&ray, &effort));
            let end = |answer: Certified| match answer {
                Certified::Hit { t0, t1 } | Certified::Wall { t0, t1 } => Some((t0, t1)),
                Certified::Miss | Certified::Undecided { .. } => None,
            };
            if matches!(a, Certified::Undecided { .. }) || matches!(b, Certified::Undecided { .. }) {
                continue;
            }
            decided += usize::from(end(a).is_some());
            // Two brackets of the first entry overlap.
            match (end(a), end(b)) {
                (Some((p, q)), Some((r, s))) => assert!(p <= s && r <= q, "tree {seed}: {a:?} {b:?} {ray:?}"),
                (p, r) => assert!(p.is_none() && r.is_none(), "tree {seed}: {a:?} {b:?} {ray:?}"),
            }
            // Control: a ray a metre aside meets the ground elsewhere.
            let aside = Ray { origin: ray.origin + DVec3::new(1.0, 1.0, 0.0), ..ray };
            control += usize::from(end(parts.trace(&aside, &effort)) != end(b));
        }
    }
    assert!(decided > 100 && control > 50, "{decided} {control}");
}
