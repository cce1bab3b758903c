//! What landforms have in common over many of them: caves lie in weak rock, and rules of the grammar are taken as often as their
//! probabilities say.

use crate::experiment::{Context, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use glam::DVec3;
use terrain_amplify::field::Box3;
use terrain_amplify::geology::{self, Geology};
use terrain_amplify::landform::hoodoo::{Hoodoo, Terminal};
use terrain_amplify::landform::karst::Karst;
use terrain_model::noise::hash::mix;

/// How far the mean resistance along caves is off that of the rock in the box that they fill, in deviations of that rock, as mean over
/// 16 rocks: sites of one network are not independent, networks in different rocks are. Percolation feels the rock whose seed is
/// `shift` higher.
fn off_the_rock(seed: u32, shift: u32) -> Result<f64, ExperimentError> {
    const ROCKS: u32 = 16;
    let strata = |seed: u32| {
        let layers = geology::Node::Strata { wavelength: 30.0, octaves: 3, seed: 1 };
        let rough = geology::Node::Turbulence { wavelength: 20.0, octaves: 2, seed: 2 };
        Geology::new(seed, geology::Node::Blend(vec![(3.0, layers), (1.0, rough)])).map_err(ExperimentError::failed)
    };
    let domain = Box3::new(DVec3::new(-120.0, -120.0, -90.0), DVec3::new(120.0, 120.0, 0.0));
    let sinks = [(-60.0, 10.0), (5.0, -20.0), (70.0, 30.0)].map(|(x, y)| DVec3::new(x, y, -0.5)).to_vec();
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let mut total = 0.0;
    for k in 0..ROCKS {
        let (rock, felt) = (strata(mix(seed, k))?, strata(mix(seed, k + shift))?);
        let karst = Karst { sites: 1000, threshold: 2.0, seed: k, sinks: sinks.clone(), ..Karst::default() };
        let sites = karst.grow(&domain, |_| true, &[], |p| felt.value(p)).map_err(ExperimentError::failed)?;
        let around = sites.iter().fold(Box3::EMPTY, |all, site| all.hull(&Box3::new(site.position, site.position)));
        let random = |j: u32| f64::from(mix(mix(seed, k), j)) / 4_294_967_296.0;
        let at = |j: u32| {
            around.low + (around.high - around.low) * DVec3::new(random(3 * j), random(3 * j + 1), random(3 * j + 2))
        };
        let all: Vec<f64> = (0..3_000).map(|j| rock.value(at(j))).collect();
        let middle = mean(&all);
        let deviation = mean(&all.iter().map(|r| (r - middle) * (r - middle)).collect::<Vec<_>>()).sqrt();
        let along: Vec<f64> = sites.iter().map(|site| rock.value(site.position)).collect();
        total += (mean(&along) - middle) / deviation;
    }
    Ok(total / f64::from(ROCKS))
}

/// Caves follow weak rock: measured, and held against percolation led by another rock.
pub(super) fn strata(ctx: &Context, outcome: &mut Outcome, wrong: &mut Vec<String>) -> Result<(), ExperimentError> {
    let seed = ctx.seed as u32;
    let (follows, blind) = (off_the_rock(seed, 0)?, off_the_rock(seed, 1_000)?);
    outcome.metric("karst.resistance_along_caves", follows)?;
    outcome.metric("karst.resistance_along_blind_caves", blind)?;
    // Half of what the test of the generator finds at least.
    if follows > -0.25 {
        wrong.push(format!("caves lie {follows} deviations off the rock around: expected −0.25 or less"));
    }
    outcome.control("another rock", "percolation led by it", "no weaker rock than around", blind > -0.25);
    Ok(())
}

/// How often each rule was taken, against its probability.
pub(super) fn rules(ctx: &Context, outcome: &mut Outcome, wrong: &mut Vec<String>) -> Result<(), ExperimentError> {
    let (block, cone) = (0.7, 0.8);
    let grammar = Hoodoo {
        block: [block; 2],
        cone: [cone; 2],
        ratio: 1.0,
        symbols: 10_000,
        seed: ctx.seed as u32,
        ..Hoodoo::default()
    };
    let spires = ctx.profile.pick(4_000u32, 40_000);
    let mut taken = [0u64; 5];
    let mut lengths = Vec::new();
    for k in 0..spires {
        let place = DVec3::new(f64::from(k % 200), f64::from(k / 200), 0.0);
        let symbols = grammar.derive(place, |_| 0.5).map_err(ExperimentError::failed)?;
        lengths.push(symbols.len());
        for (j, symbol) in symbols.iter().enumerate() {
            let next = symbols.get(j + 1).map(|next| next.terminal);
            let rule = match (symbol.terminal, next) {
                (Terminal::Block, Some(Terminal::Block)) => 0,
                (Terminal::Block, _) => 1,
                (Terminal::Cone, Some(_)) => 2,
                (Terminal::Cone, None) => 3,
                (Terminal::Cap, _) => 4,
            };
            taken[rule] += 1;
        }
    }
    let expected = [block, 1.0 - block, 0.5 * cone, 0.5 * cone, 1.0 - cone];
    let (blocks, cones) = (taken[0] + taken[1], taken[2] + taken[3] + taken[4]);
    let chi = |of: &[f64; 5]| {
        let part = |k: usize, all: u64| {
            let mean = of[k] * all as f64;
            (taken[k] as f64 - mean) * (taken[k] as f64 - mean) / mean
        };
        (0..2).map(|k| part(k, blocks)).sum::<f64>() + (2..5).map(|k| part(k, cones)).sum::<f64>()
    };
    let mut table = Table::new("rules", "Rules of the grammar, Fig. 20")
        .column("rule")
        .column("probability")
        .column("taken")
        .column("share");
    for (k, name) in ["B → b B", "B → b C", "C → c B", "C → c", "C → d"].into_iter().enumerate() {
        let all = if k < 2 { blocks } else { cones };
        table.row([
            Cell::from(name),
            Cell::number(expected[k], "", 3),
            Cell::count(taken[k]),
            Cell::number(taken[k] as f64 / all as f64, "", 3),
        ]);
    }
    outcome.table(table)?;
    let mean = lengths.iter().sum::<usize>() as f64 / lengths.len() as f64;
    let formula = (1.0 / (1.0 - block) + 1.0) / (1.0 - 0.5 * cone);
    outcome.metric("grammar.chi_squared", chi(&expected))?;
    outcome.metric("grammar.mean_symbols", mean)?;
    outcome.metric("grammar.mean_symbols_formula", formula)?;
    let longest = lengths.iter().copied().max().unwrap_or(0).min(60);
    let counts: Vec<_> =
        (1..=longest).map(|n| (n as f64, lengths.iter().filter(|l| **l == n).count() as f64)).collect();
    let plot = Plot::new("lengths", "Symbols of a spire", Axis::linear("symbols"), Axis::linear("spires"));
    outcome.plot(plot.series("spires", Style::LineAndPoints, counts))?;
    // χ² of 1 + 2 degrees of freedom exceeds 21.1 once in 10⁴.
    if chi(&expected) > 21.1 {
        wrong.push(format!("rules are off their probabilities, χ² = {}", chi(&expected)));
    }
    let off = [block - 0.05, 1.05 - block, 0.5 * cone, 0.5 * cone, 1.0 - cone];
    outcome.control("a wrong probability", "p_B less by 0.05", "χ² is too large", chi(&off) > 21.1);
    Ok(())
}
