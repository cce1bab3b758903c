//! The grammar takes its rules as often as it says, ends as it should, and its spires stand where they are put.

use super::*;
use crate::field::{Density, THRESHOLD};
use crate::implicit::index::Index;
use std::collections::BTreeSet;

fn places(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(|k| DVec3::new(f64::from(k), 0.25 * f64::from(k % 97), 3.0))
}

/// The grammar alone: no end by size, none by count that matters.
fn endless(block: f64, cone: f64) -> Hoodoo {
    Hoodoo { ratio: 1.0, block: [block; 2], cone: [cone; 2], symbols: 10_000, ..Hoodoo::default() }
}

fn mean_length(hoodoo: &Hoodoo, count: u32) -> f64 {
    let lengths = places(count).map(|at| hoodoo.derive(at, |_| 0.5).unwrap().len());
    lengths.sum::<usize>() as f64 / f64::from(count)
}

/// Claims P18: 4, 20 and 200 symbols for p = ½, 0.9 and 0.99.
#[test]
fn the_mean_length_of_a_spire_is_that_of_the_formula() {
    let formula = |b: f64, c: f64| (1.0 / (1.0 - b) + 1.0) / (1.0 - 0.5 * c);
    assert!((formula(0.5, 0.5) - 4.0).abs() < 1e-12 && (formula(0.9, 0.9) - 20.0).abs() < 1e-9);
    for (b, c, count) in [(0.5, 0.5, 20_000), (0.9, 0.9, 20_000), (0.99, 0.99, 6000), (0.2, 0.9, 20_000)] {
        let mean = mean_length(&endless(b, c), count);
        // The deviation of a length is below its mean for each of these: five standard errors.
        let slack = 5.0 * formula(b, c) / f64::from(count).sqrt();
        assert!((mean - formula(b, c)).abs() < slack, "{mean} against {}", formula(b, c));
        // Control: the formula with C's rules as likely as their names, c B and c at p_C each.
        let other = (1.0 / (1.0 - b) + 1.0) / (1.0 - c);
        assert!((mean - other).abs() > slack);
    }
}

/// How often each rule was taken: b B, b C, then c B, c, d. Which is seen from the terminal that follows.
fn counts(hoodoo: &Hoodoo, spires: u32) -> [f64; 5] {
    let mut counts = [0.0; 5];
    for at in places(spires) {
        let symbols = hoodoo.derive(at, |_| 0.5).unwrap();
        for (k, symbol) in symbols.iter().enumerate() {
            let after = symbols.get(k + 1).map(|next| next.terminal);
            let rule = match (symbol.terminal, after) {
                (Terminal::Block, Some(Terminal::Block)) => 0,
                (Terminal::Block, Some(_)) => 1,
                (Terminal::Cone, Some(Terminal::Block)) => 2,
                (Terminal::Cone, None) => 3,
                (Terminal::Cap, None) => 4,
                other => panic!("{other:?} follows from no rule"),
            };
            counts[rule] += 1.0;
        }
    }
    counts
}

fn chi(counts: &[f64], probabilities: &[f64]) -> f64 {
    let total: f64 = counts.iter().sum();
    counts.iter().zip(probabilities).map(|(n, p)| (n - total * p) * (n - total * p) / (total * p)).sum()
}

#[test]
fn rules_are_taken_as_often_as_their_probabilities_say() {
    for (b, c) in [(0.5, 0.5), (0.8, 0.6), (0.3, 0.9)] {
        let counts = counts(&endless(b, c), 8000);
        let blocks = |b: f64| chi(&counts[..2], &[b, 1.0 - b]);
        let cones = |c: f64| chi(&counts[2..], &[0.5 * c, 0.5 * c, 1.0 - c]);
        // Exceeded once in 10⁴ with one and with two degrees of freedom.
        assert!(blocks(b) < 15.14 && cones(c) < 18.42, "{counts:?}");
        // Control: probabilities that are wrong by 0.05.
        assert!(blocks(b + 0.05) > 15.14 && cones(c - 0.05) > 18.42, "{counts:?}");
    }
}

#[test]
fn every_spire_ends_with_p_one_too_and_symbols_shrink_to_the_least_size() {
    let forever = Hoodoo { block: [1.0; 2], ..Hoodoo::default() };
    for at in places(50) {
        let symbols = forever.derive(at, |_| 0.5).unwrap();
        let last = symbols.last().unwrap();
        assert!(last.size >= forever.least_size && last.size * forever.ratio < forever.least_size);
        for two in symbols.windows(2) {
            assert_eq!(two[1].size, two[0].size * forever.ratio);
            assert!((two[1].foot.z - two[0].foot.z - two[0].size).abs() < 1e-12);
        }
    }
    let counted = Hoodoo { ratio: 1.0, symbols: 7, ..forever };
    assert!(places(9).all(|at| counted.derive(at, |_| 0.5).unwrap().len() == 7));
}

#[test]
fn hard_rock_makes_wider_symbols_and_other_rules() {
    let hoodoo = Hoodoo::default();
    let all = |rho: f64| -> Vec<Symbol> { places(500).flat_map(|at| hoodoo.derive(at, |_| rho).unwrap()).collect() };
    let (soft, hard) = (all(0.0), all(1.0));
    let wide = |all: &[Symbol]| all.iter().map(|one| one.half.x / one.size).sum::<f64>() / all.len() as f64;
    assert!(wide(&hard) > 1.6 * wide(&soft));
    assert!(hard.len() > soft.len());
    // Rock is read where the symbol stands: hard below and soft above.
    let layered = |p: DVec3| if p.z < 5.0 { 1.0 } else { 0.0 };
    for symbol in places(100).flat_map(|at| hoodoo.derive(at, layered).unwrap()) {
        let share = symbol.half.x / symbol.size / if symbol.terminal == Terminal::Cap { CAP_WIDTH } else { 1.0 };
        let expected = if symbol.foot.z < 5.0 { 0.7 } else { 0.35 };
        assert!((share / expected - 1.0).abs() <= hoodoo.variation + 1e-12, "{symbol:?}");
    }
}

#[test]
fn spires_are_metres_to_tens_of_metres_high_and_goblins_small_and_squat() {
    let heights = |hoodoo: &Hoodoo, rho: f64| -> Vec<[f64; 2]> {
        let of = |at: DVec3| {
            let symbols = hoodoo.derive(at, |_| rho).unwrap();
            let wide = symbols.iter().fold(0.0f64, |wide, one| wide.max(2.0 * one.half.max_element()));
            [symbols.iter().map(|one| one.size).sum(), wide]
        };
        places(400).map(of).collect()
    };
    let tall = heights(&Hoodoo { size: [4.0, 6.0], ..Hoodoo::default() }, 0.9);
    assert!(tall.iter().any(|[high, _]| *high > 40.0) && tall.iter().any(|[high, _]| *high < 15.0));
    let goblins = heights(&Hoodoo::goblin(), 0.5);
    assert!(goblins.iter().all(|[high, wide]| *high < 6.5 && *high < 4.0 * wide));
}

#[test]
fn a_spire_is_one_piece_of_rock_from_its_root_to_its_top() {
    for hoodoo in [Hoodoo::default(), Hoodoo::goblin()] {
        for at in places(60) {
            let symbols = hoodoo.derive(at, |_| 0.4).unwrap();
            let primitives = hoodoo.primitives(&symbols);
            assert!(primitives.iter().all(Primitive::is_sound));
            let index = Index::new(primitives.clone()).unwrap();
            let volume = hoodoo.volume(&symbols);
            // Rock from the middle of each symbol's foot to that of the next, offset and all.
            let link = |f: &dyn Fn(DVec3) -> f64, two: &[Symbol]| {
                (0..=8).map(|k| f(two[0].foot.lerp(two[1].foot, f64::from(k) / 8.0))).fold(f64::INFINITY, f64::min)
            };
            for two in symbols.windows(2) {
                let whole = link(&|p| index.value(p), two);
                assert!(whole > THRESHOLD, "{whole}: {two:?}");
                assert!(link(&|p| volume.value(p), two) > THRESHOLD);
            }
            // Control: without one symbol the spire has a gap.
            if let [first, second, ..] = symbols[..] {
                let rest = Index::new(primitives[1..].to_vec()).unwrap();
                assert!(link(&|p| rest.value(p), &[first, second]) < THRESHOLD);
            }
            assert!(at.z > symbols[0].foot.z && symbols[0].foot.truncate() == at.truncate());
        }
    }
}

#[test]
fn the_volume_turns_each_symbol_about_its_foot() {
    let hoodoo = Hoodoo { width: [0.5; 2], roundness: 0.05, ..Hoodoo::default() };
    let symbol = Symbol {
        terminal: Terminal::Block,
        foot: DVec3::new(10.0, 20.0, 30.0),
        size: 4.0,
        half: DVec2::new(3.0, 1.0),
        turn: TAU / 4.0,
    };
    let middle = symbol.foot + DVec3::Z * 2.0;
    let [along, across] = [DVec3::X * 2.5, DVec3::Y * 2.5].map(|d| middle + d);
    let (turned, plain) = (hoodoo.volume(&[symbol]), Index::new(hoodoo.primitives(&[symbol])).unwrap());
    assert!(turned.value(across) > THRESHOLD && turned.value(along) < THRESHOLD);
    assert!(plain.value(along) > THRESHOLD && plain.value(across) < THRESHOLD);
    // The surface is where the half widths say.
    for (half, axis) in [(3.0, DVec3::X), (1.0, DVec3::Y)] {
        assert!(plain.value(middle + axis * (half - 1e-3)) > THRESHOLD);
        assert!(plain.value(middle + axis * (half + 1e-3)) < THRESHOLD);
    }
}

#[test]
fn places_have_spires_of_their_own_whatever_stands_beside_them() {
    let hoodoo = Hoodoo::default();
    let of = |at: DVec3, seed: u32| hoodoo_with(&hoodoo, seed).derive(at, |_| 0.5).unwrap();
    let shapes: BTreeSet<String> =
        places(40).map(|at| format!("{:?}", of(at, 0).iter().map(|one| one.size).collect::<Vec<_>>())).collect();
    assert_eq!(shapes.len(), 40);
    let at = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(of(at, 0), of(at, 0));
    assert_ne!(of(at, 0), of(at, 1));
}

fn hoodoo_with(hoodoo: &Hoodoo, seed: u32) -> Hoodoo {
    Hoodoo { seed, ..hoodoo.clone() }
}

#[test]
fn text_has_defaults_and_what_makes_no_sense_is_refused_by_name() {
    let read: Hoodoo = ron::from_str("(size: (1, 2), ratio: 0.8)").unwrap();
    assert_eq!(read, Hoodoo { size: [1.0, 2.0], ratio: 0.8, ..Hoodoo::default() });
    assert!(ron::from_str::<Hoodoo>("(sizes: (1, 2))").is_err());
    assert_eq!(read.check(), Ok(()));
    assert_eq!(Hoodoo::goblin().check(), Ok(()));
    for (bad, field) in [
        (Hoodoo { size: [0.0, 1.0], ..read.clone() }, "size"),
        (Hoodoo { ratio: 2.0, ..read.clone() }, "ratio"),
        (Hoodoo { block: [0.5, 1.1], ..read.clone() }, "block"),
        (Hoodoo { cone: [-0.1, 0.5], ..read.clone() }, "cone"),
        (Hoodoo { width: [0.5, f64::NAN], ..read.clone() }, "width"),
        (Hoodoo { variation: 1.0, ..read.clone() }, "variation"),
        (Hoodoo { offset: -1.0, ..read.clone() }, "offset"),
        (Hoodoo { roundness: 0.0, ..read.clone() }, "roundness"),
        (Hoodoo { root: 2.0, ..read.clone() }, "root"),
        (Hoodoo { least_size: 0.0, ..read.clone() }, "least_size"),
        (Hoodoo { symbols: 0, ..read.clone() }, "symbols"),
    ] {
        let error = bad.derive(DVec3::ZERO, |_| 0.5).unwrap_err();
        assert!(error.field == field && error.landform == "hoodoo");
    }
    assert_eq!(read.derive(DVec3::NAN, |_| 0.5).unwrap_err().field, "at");
    assert_eq!(read.derive(DVec3::ZERO, |_| f64::NAN), read.derive(DVec3::ZERO, |_| -1.0));
}
