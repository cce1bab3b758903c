//! Laws of trees: queries agree with each other, bounds hold, pruning and re-basing change nothing they may not.

mod common;

use common::{HALF, Random, random_focus, random_tree};
use glam::DVec2;
use terrain_model::bounds::{Bounds, Region, THRESHOLD};
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::program::{BatchEvaluator, BoundsEvaluator, Cells, Evaluator, Evidence, Program, TileProgram};
use terrain_model::rounding::Rounded;

fn programs(from: u64, count: u64) -> impl Iterator<Item = (u64, Program)> {
    (from..from + count).map(|seed| {
        let (tree, root) = random_tree(seed);
        let program = Program::compile(&tree, root).expect("a random tree compiles");
        (seed, program.with_focus(random_focus(seed).as_ref()))
    })
}

#[test]
fn a_sample_carries_the_value_bit_for_bit_and_the_gradient_of_it() {
    let mut checked = 0;
    for (seed, program) in programs(0, 120) {
        let mut random = Random(seed ^ 77);
        for _ in 0..40 {
            let p = random.point(HALF);
            let s = program.sample(p);
            assert_eq!((s.elevation, s.weight), program.height(p), "tree {seed} at {p}");
            if s.weight < 0.05 {
                continue;
            }
            for axis in [DVec2::X, DVec2::Y] {
                let difference = |e: f64| (program.height(p + axis * e).0 - program.height(p - axis * e).0) / (2.0 * e);
                let (coarse, fine) = (difference(1e-4), difference(5e-5));
                // Where two step widths disagree the stencil straddles a crease.
                if (coarse - fine).abs() < 1e-5 {
                    let slope = s.gradient.dot(axis);
                    assert!((fine - slope).abs() < 1e-4 * (1.0 + slope.abs()), "tree {seed} at {p}: {fine} {slope}");
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 2000, "{checked}");
}

/// What pairs of points of the region make of `bounds`: does a value or a weight lie outside, and the largest difference
/// quotient over its slope bound, of the terrain, of the weight and of the two together.
fn judge(
    program: &Program,
    bounds: &Bounds,
    a: DVec2,
    b: DVec2,
    random: &mut Random,
    segment: bool,
) -> (bool, [f64; 3]) {
    let mut values = Evaluator::<f64>::new(program);
    let at = |random: &mut Random| {
        let t = DVec2::new(random.range(0.0, 1.0), random.range(0.0, 1.0));
        a + (b - a) * if segment { DVec2::splat(t.x) } else { t }
    };
    let mut outside = false;
    let [mut slope, mut weight, mut weighted] = [0.0f64; 3];
    for _ in 0..30 {
        let p = at(random);
        // Close pairs see the gradient; far ones what lies between.
        let q = if random.below(2) == 0 { p + (at(random) - p) * 1e-3 } else { at(random) };
        let (fp, ap) = values.height(program, p);
        let (fq, aq) = values.height(program, q);
        let distance = p.distance(q);
        let slack = 1e-9 * (1.0 + fp.abs().max(fq.abs()));
        for (f, alpha) in [(fp, ap), (fq, aq)] {
            outside |= alpha > 0.0 && !(bounds.elevation + Interval::symmetric(slack)).contains(f);
            outside |= !(bounds.weight + Interval::symmetric(1e-12)).contains(alpha);
        }
        if distance < 1e-6 {
            continue;
        }
        let over = |rise: f64, slope: f64| if rise <= slack { 0.0 } else { (rise - slack) / distance / slope };
        weight = weight.max(over((ap - aq).abs(), bounds.weight_slope));
        // λ_f bounds difference quotients along a line inside the domain.
        let inside = (0..=8).all(|k| values.height(program, p + (q - p) * (f64::from(k) / 8.0)).1 >= THRESHOLD + 1e-3);
        if inside {
            slope = slope.max(over((fp - fq).abs(), bounds.slope));
        }
        if distance < 0.1 && ap > 0.0 && aq > 0.0 {
            weighted = weighted.max(over(ap.min(aq) * (fp - fq).abs(), bounds.weighted_slope * (1.0 + 1e-6)));
        }
    }
    (outside, [slope, weight, weighted])
}

/// Judges the bounds of 84 trees over twelve regions each.
fn hunt(segment: bool, from: u64) {
    let mut tightest = 0.0f64;
    let mut control = 0;
    for (seed, program) in programs(from, 84) {
        let mut random = Random(seed);
        let mut evaluator = BoundsEvaluator::new(&program);
        for k in 0..12 {
            let size = [800.0, 200.0, 40.0, 5.0][k % 4];
            let a = random.point(HALF);
            let b = a + random.point(size);
            let region = if segment { Region::segment(a, b) } else { Region::rectangle(a, b) };
            let bounds = evaluator.bounds(region);
            if bounds.slope.is_infinite() && bounds.weight_slope.is_infinite() {
                continue;
            }
            let (outside, [slope, weight, weighted]) = judge(&program, &bounds, a, b, &mut random, segment);
            let worst = slope.max(weight).max(weighted);
            assert!(!outside && worst <= 1.0 + 1e-9, "tree {seed}, region {k}: {outside} {worst}");
            tightest = tightest.max(worst);
            // Control: the same check convicts slope bounds of 0.6 of these somewhere.
            control += usize::from(slope.max(weight) > 0.6);
        }
    }
    assert!(tightest > 0.9, "{tightest}");
    assert!(control > 10, "{control}");
}

#[test]
fn bounds_hold_over_boxes() {
    hunt(false, 1000);
}

#[test]
fn bounds_hold_over_boxes_of_84_more_trees() {
    hunt(false, 1084);
}

#[test]
fn bounds_hold_over_boxes_of_another_84_trees() {
    hunt(false, 1168);
}

#[test]
fn bounds_hold_over_segments() {
    hunt(true, 1000);
}

#[test]
fn bounds_hold_over_segments_of_84_more_trees() {
    hunt(true, 1084);
}

#[test]
fn bounds_hold_over_segments_of_another_84_trees() {
    hunt(true, 1168);
}

#[test]
fn pruning_to_a_box_changes_no_bit_on_it() {
    prune(5000);
}

#[test]
fn pruning_changes_no_bit_of_125_more_trees() {
    prune(5125);
}

fn prune(from: u64) {
    let mut shorter = 0;
    for (seed, program) in programs(from, 125) {
        let mut random = Random(seed);
        for _ in 0..6 {
            let a = random.point(HALF);
            let b = a + random.point(60.0);
            let pruned = program.prune(Region::rectangle(a, b));
            shorter += usize::from(pruned.code().len() < program.code().len());
            let (mut whole, mut part) = (Evaluator::<f64>::new(&program), Evaluator::<f64>::new(&program));
            for _ in 0..40 {
                let t = DVec2::new(random.range(0.0, 1.0), random.range(0.0, 1.0));
                let p = (a + (b - a) * t).clamp(a.min(b), a.max(b));
                let (x, y) = (whole.height(&program, p), part.height(&pruned, p));
                assert_eq!(
                    (x.0.to_bits(), x.1.to_bits()),
                    (y.0.to_bits(), y.1.to_bits()),
                    "tree {seed} at {p}: {x:?} {y:?}"
                );
            }
        }
    }
    assert!(shorter > 250, "{shorter}");
}

#[test]
fn squares_change_no_bit_and_bounds_of_their_programs_hold() {
    let (mut shorter, mut control) = (0, 0);
    let (mut asked, mut looser) = (0, 0);
    for (seed, program) in programs(60_000, 120) {
        let mut random = Random(seed);
        for evidence in [Evidence::Ranges, Evidence::Enclosures] {
            let cells = Cells::new(&program, evidence);
            let (mut whole, mut part) = (Evaluator::<f64>::new(&program), Evaluator::<f64>::new(&program));
            let (mut all, mut some) =
                (Evaluator::<Dual<Interval, 2>>::new(&program), Evaluator::<Dual<Interval, 2>>::new(&program));
            for k in 0..40 {
                let a = random.point(1.5 * HALF);
                let b = a + random.point([300.0, 20.0, 0.5, 0.0][k % 4]);
                let shortened = cells.over(a, b);
                shorter += usize::from(shortened.code().len() < program.code().len());
                let x = [Dual::variable(Interval::new(a.x, b.x), 0), Dual::variable(Interval::new(a.y, b.y), 1)];
                let ((f, _), (g, beta)) = (all.run(&program, x), some.run(shortened, x));
                let region = Region::rectangle(a, b);
                let (loose, tight) = (program.bounds(region), shortened.bounds(region));
                for t in [0.0, 0.3, 1.0] {
                    let p = (a + (b - a) * t).clamp(a.min(b), a.max(b));
                    let (x, y) = (whole.height(&program, p), part.height(shortened, p));
                    assert_eq!([x.0.to_bits(), x.1.to_bits()], [y.0.to_bits(), y.1.to_bits()], "tree {seed} at {p}");
                    // Control: a program pruned elsewhere has other bits.
                    control += usize::from(part.height(cells.at(p + 400.0), p) != x);
                    let slack = Interval::symmetric(1e-9 * (1.0 + x.0.abs()));
                    assert!((beta.value + slack).contains(x.1) && (tight.weight + slack).contains(x.1), "tree {seed}");
                    if x.1 > 0.0 {
                        assert!((g.value + slack).contains(x.0), "tree {seed}: {g:?} {x:?}");
                        assert!((tight.elevation + slack).contains(x.0), "tree {seed}: {tight:?} {x:?}");
                    }
                }
                // An operand whose weight only its own range knows to be 0 shifts what a mean's enclosure is taken about.
                asked += 2;
                looser += usize::from(g.value.width() > 1.01 * f.value.width() + 1e-9);
                looser += usize::from(tight.slope > 1.01 * loose.slope);
            }
        }
    }
    assert!(100 * looser < asked, "{looser} of {asked}");
    assert!(shorter > 3_000 && control > 100, "{shorter} {control}");
}

#[test]
fn simplifying_costs_no_more_than_it_says_and_moves_no_weight() {
    let (mut shorter, mut control) = (0, 0);
    for (seed, program) in programs(40_000, 120) {
        let mut random = Random(seed);
        let a = random.point(HALF);
        let b = a + random.point(150.0);
        let (simple, error) = program.simplify(Region::rectangle(a, b), random.range(0.0, 1.0));
        shorter += usize::from(simple.octaves() < program.octaves());
        let mut worst = 0.0f64;
        for _ in 0..60 {
            let t = DVec2::new(random.range(0.0, 1.0), random.range(0.0, 1.0));
            let p = (a + (b - a) * t).clamp(a.min(b), a.max(b));
            let (x, y) = (program.height(p), simple.height(p));
            assert_eq!(x.1, y.1, "tree {seed} at {p}");
            worst = worst.max((x.0 - y.0).abs());
        }
        assert!(worst <= error + 1e-9, "tree {seed}: {worst} {error}");
        // Control: half of the bound would be wrong somewhere.
        control += usize::from(worst > 0.5 * error && worst > 1e-3);
    }
    assert!(shorter > 30 && control > 0, "{shorter} {control}");
}

#[test]
fn lanes_stay_within_the_derived_rounding_error() {
    lanes(9000);
}

#[test]
fn lanes_of_75_more_trees_stay_within_the_derived_rounding_error() {
    lanes(9075);
}

fn lanes(from: u64) {
    let mut worst_ratio = 0.0f64;
    let mut widest = 0.0f64;
    let mut control = 0;
    for (seed, program) in programs(from, 75) {
        let mut random = Random(seed);
        // Far from the world's origin, where f32 world coordinates would be metres off.
        for _ in 0..4 {
            let origin = random.point(HALF);
            let tile = TileProgram::new(&program.prune(Region::rectangle(origin, origin + DVec2::splat(64.0))), origin);
            let n = 64;
            let x: Vec<f32> = (0..n).map(|_| random.range(0.0, 64.0) as f32).collect();
            let y: Vec<f32> = (0..n).map(|_| random.range(0.0, 64.0) as f32).collect();
            let (mut f, mut a) = (vec![0.0; n], vec![0.0; n]);
            BatchEvaluator::new(&program).evaluate(&tile, &x, &y, &mut f, &mut a);
            let mut oracle = tile.evaluator::<f64>();
            let mut error = tile.evaluator::<Rounded>();
            for k in 0..n {
                let point = |v: f32| Rounded::new(Interval::point(f64::from(v)), 0.0);
                let (ef, ea) = tile.run(&mut error, [point(x[k]), point(y[k])]);
                let (of, oa) = tile.run(&mut oracle, [f64::from(x[k]), f64::from(y[k])]);
                // The enclosure is of reals; the f64 oracle rounds, and a mean of equal elevations lands an ulp off them.
                let slack = 1e-9;
                assert!((ef.exact + Interval::symmetric(slack)).contains(of) || oa == 0.0, "{seed} {ef:?} {of}");
                assert!((f64::from(a[k]) - oa).abs() <= ea.error + 1e-15, "tree {seed}: weight {} {oa} {ea:?}", a[k]);
                if oa >= THRESHOLD {
                    let off = (f64::from(f[k]) - of).abs();
                    assert!(off <= ef.error + slack, "tree {seed}: {} {of} {ef:?}", f[k]);
                    if ef.error.is_finite() {
                        worst_ratio = worst_ratio.max(off / (ef.error + slack));
                        widest = widest.max(ef.error);
                        control += usize::from((f64::from(f[k]) + 0.05 - of).abs() > ef.error);
                    }
                }
            }
        }
    }
    assert!(worst_ratio > 0.005 && widest < 1.0, "{worst_ratio} {widest}");
    assert!(control > 500, "a picture 5 cm off must fail: {control}");
}

#[test]
fn interval_duals_enclose_values_and_gradients() {
    for (seed, program) in programs(20_000, 150) {
        let mut random = Random(seed);
        let mut enclosing = Evaluator::<Dual<Interval, 2>>::new(&program);
        for _ in 0..20 {
            let a = random.point(HALF);
            let w = random.range(0.0, 20.0);
            let x = [Interval::new(a.x, a.x + w), Interval::new(a.y, a.y + w)];
            let (f, alpha) = enclosing.run(&program, [Dual::variable(x[0], 0), Dual::variable(x[1], 1)]);
            for _ in 0..10 {
                let p = (a + DVec2::new(random.range(0.0, w), random.range(0.0, w))).min(a + w);
                let s = program.sample(p);
                let slack = |v: f64| Interval::symmetric(1e-9 * (1.0 + v.abs()));
                assert!((alpha.value + slack(1.0)).contains(s.weight), "tree {seed} at {p}");
                if s.weight > 1e-6 {
                    assert!((f.value + slack(s.elevation)).contains(s.elevation), "tree {seed} at {p}: {f:?} {s:?}");
                    assert!(
                        (f.slope[0] + slack(s.gradient.x)).contains(s.gradient.x),
                        "tree {seed} at {p}: {f:?} {s:?}"
                    );
                    assert!(
                        (f.slope[1] + slack(s.gradient.y)).contains(s.gradient.y),
                        "tree {seed} at {p}: {f:?} {s:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_baked_raster_has_the_same_bits_on_any_number_of_threads() {
    let (_, program) = programs(3, 1).next().expect("a program");
    let bake = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| program.bake(DVec2::splat(-HALF), DVec2::new(7.0, 9.0), 150, 110))
    };
    let one = bake(1);
    assert_eq!(one, bake(3));
    // Control: another origin gives another raster.
    assert_ne!(one, program.bake(DVec2::splat(-HALF + 1.0), DVec2::new(7.0, 9.0), 150, 110));
}
