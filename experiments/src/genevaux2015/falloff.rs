//! The slope of Wyvill's falloff: the constant that every weight's bound is made of. Sampled derivatives bound its supremum from
//! below, enclosures over boxes from above; the closed form must lie between, and the gap must close at first order.

use crate::experiment::{Context, Expected, Experiment, ExperimentError, Profile};
use crate::report::{Axis, Cell, Claim, Compared, Comparison, Outcome, Plot, Style, Table, Tolerance};
use std::time::Instant;
use terrain_model::dual::Dual;
use terrain_model::falloff::{WYVILL_SLOPE, wyvill};
use terrain_model::interval::Interval;
use terrain_model::real::Real;
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "genevaux2015/wyvill-falloff",
    title: "Slope of the falloff",
    section: "§4.1, §7.3.1, Appendix",
    about: "The weight of a primitive is g(d/r) = (1 − (d/r)²)³ of the distance d to its skeleton, and the appendix bounds its slope by \
            λ = 96√5 / (125 r), reached at d = r/√5. For several radii we bracket sup |g′|: from below by exact derivatives at \
            sample points, from above by outward-rounded enclosures of g′ over boxes that cover [0, 1.1 r].",
    code: "experiments/src/genevaux2015/falloff.rs",
    test: "experiments/src/genevaux2015/falloff.rs::the_closed_form_lies_in_the_bracket_and_a_wrong_falloff_does_not",
    expected: |profile| Expected {
        seconds: profile.pick(0.05, 0.3),
        memory_bytes: profile.pick(16 << 20, 32 << 20),
        disk_bytes: 64 << 10,
    },
    run,
};

/// Boxes cover [0, COVER · r], a little past the radius.
const COVER: f64 = 1.1;
/// Largest over-estimate of r·|g′| by a box of relative width h, over h. On a box, |g′| r = 6x(1 − x²)² is enclosed by its factors,
/// which adds to the true value at most h·(6(1 − u)² + 24u(1 − u)) = h·(6 + 12u − 18u²) ≤ 8h with u = x²; 9 leaves room for h² and
/// rounding.
const EXCESS: f64 = 9.0;

/// The number trait's value of a falloff and its slope at distance `d`.
type Falloff<R> = fn(R) -> R;

fn closed_form(radius: f64) -> f64 {
    96.0 * 5.0f64.sqrt() / (125.0 * radius)
}

/// g(d/r) with its derivative along d.
fn along<R: terrain_model::dual::Differentiable>(g: Falloff<Dual<R, 1>>, d: R, radius: f64) -> Dual<R, 1> {
    let ratio = Dual::variable(d, 0) / Dual::fixed(R::constant(radius));
    g(ratio.square())
}

/// Where sup |g′| lies.
struct Bracket {
    sampled: f64,
    at: f64,
    certified: f64,
    /// No signed derivative is larger.
    largest_signed: f64,
}

fn bracket(sampled: Falloff<Dual<f64, 1>>, enclosed: Falloff<Dual<Interval, 1>>, radius: f64, boxes: u32) -> Bracket {
    let edge = |i: u32| COVER * radius * f64::from(i) / f64::from(boxes);
    let mut bracket = Bracket { sampled: 0.0, at: 0.0, certified: 0.0, largest_signed: f64::NEG_INFINITY };
    for i in 0..boxes {
        let slope = along(sampled, edge(i), radius).slope[0];
        if slope.abs() > bracket.sampled {
            (bracket.sampled, bracket.at) = (slope.abs(), edge(i));
        }
        let enclosure = along(enclosed, Interval::new(edge(i), edge(i + 1)), radius).slope[0];
        bracket.certified = bracket.certified.max(enclosure.magnitude());
        bracket.largest_signed = bracket.largest_signed.max(enclosure.hi());
    }
    bracket
}

/// The check: the closed form lies between the samples and the certificate, and the two are as close as the boxes allow.
/// The samples are rounded to nearest, within 8 ulps of g′: nine operations, none of which cancels near its maximum.
fn agrees(bracket: &Bracket, bound: f64, boxes: u32) -> bool {
    let rounding = 8.0 * f64::EPSILON * bound;
    bracket.sampled <= bound + rounding
        && bound <= bracket.certified
        && bracket.certified <= bound * (1.0 + EXCESS * COVER / f64::from(boxes) / WYVILL_SLOPE)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let start = Instant::now();
    let boxes = ctx.profile.pick(1 << 14, 1 << 18);
    let unit = (ctx.seed_for("radius") >> 11) as f64 / (1u64 << 53) as f64;
    let radii = [0.25, 1.0, 7.0, 1000.0, 1.0 + 99.0 * unit];

    let mut table = Table::new("bracket", "sup |g′| between samples and certificate")
        .column("radius")
        .column("closed form 96√5 / (125 r)")
        .column("sampled from below")
        .column("certified from above")
        .column("reached at, ÷ r")
        .column("verdict");
    let (mut all_agree, mut worst_gap) = (true, 0.0f64);
    let progress = ctx.progress("radii", radii.len() as u64);
    for radius in radii {
        let found = bracket(wyvill, wyvill, radius, boxes);
        let bound = closed_form(radius);
        let agree = agrees(&found, bound, boxes);
        all_agree &= agree;
        worst_gap = worst_gap.max((found.certified - found.sampled) / bound);
        table.row([
            Cell::number(radius, "m", 4),
            Cell::number(bound, "1/m", 7),
            Cell::number(found.sampled, "1/m", 7),
            Cell::number(found.certified, "1/m", 7),
            Cell::number(found.at / radius, "", 5),
            Cell::from(if agree { Verdict::Reproduced } else { Verdict::NotReproduced }),
        ]);
        progress.advance(1);
    }
    drop(progress);

    let one = bracket(wyvill, wyvill, 1.0, boxes);
    let step = COVER / f64::from(boxes);
    let mut comparison = Comparison::new(
        "against-paper",
        "The appendix's closed form against ours, r = 1 m",
        "none: a formula",
        &ctx.hardware,
    );
    let enclosure = EXCESS * step / WYVILL_SLOPE;
    comparison.push(
        Compared::new(
            "certified sup |g′|",
            "1/m",
            closed_form(1.0),
            one.certified,
            Tolerance::ratio(1.0, 1.0 + enclosure, "one box's over-estimate, 9h"),
        )
        .digits(7),
    );
    comparison.push(
        Compared::new(
            "reached at",
            "m",
            1.0 / 5.0f64.sqrt(),
            one.at,
            Tolerance::absolute(step, "distance between samples"),
        )
        .digits(5),
    );
    let verdict = if all_agree { comparison.verdict() } else { Verdict::NotReproduced };

    let mut outcome = Outcome::new(verdict);
    outcome.table(comparison.into_table())?;
    outcome.table(table)?;
    outcome.metric("falloff.slope_sampled_per_metre", one.sampled)?;
    outcome.metric("falloff.slope_certified_per_metre", one.certified)?;
    outcome.metric("falloff.slope_reached_at_metres", one.at)?;
    outcome.metric("falloff.largest_relative_gap", worst_gap)?;
    outcome.metric("falloff.boxes", f64::from(boxes))?;
    outcome.plot(shape()?)?;
    outcome.plot(convergence(ctx.profile))?;
    claims(&mut outcome, &one)?;
    controls(&mut outcome, boxes);
    outcome.deviation(
        "The condition printed with g is x < r, for a distance that §4.1 also uses signed.",
        "g takes the squared distance, so that both signs fade alike and no root is needed.",
    );
    outcome.timing("falloff.run_seconds", start.elapsed().as_secs_f64())?;
    Ok(outcome)
}

/// g and g′ for r = 1, with the bound.
fn shape() -> Result<Plot, ExperimentError> {
    let at = |i: u32| f64::from(i) / 200.0 * 1.2;
    let sampled: Vec<(f64, Dual<f64, 1>)> = (0..=200).map(|i| (at(i), along(wyvill, at(i), 1.0))).collect();
    let bound = -closed_form(1.0);
    Ok(Plot::new(
        "shape",
        "The falloff and its derivative, r = 1 m",
        Axis::linear("distance (m)"),
        Axis::linear("g, and g′ (1/m)"),
    )
    .series("g", Style::Line, sampled.iter().map(|(x, g)| (*x, g.value)))
    .series("g′", Style::Line, sampled.iter().map(|(x, g)| (*x, g.slope[0])))
    .series("−96√5 / 125", Style::Dashed, [(0.0, bound), (1.2, bound)]))
}

/// How far the certificate lies above the closed form, against the number of boxes.
fn convergence(profile: Profile) -> Plot {
    let points: Vec<(f64, f64)> = (4..=profile.pick(14, 18))
        .map(|k| {
            let excess = bracket(wyvill, wyvill, 1.0, 1 << k).certified - closed_form(1.0);
            (f64::from(1u32 << k), excess)
        })
        .collect();
    let (x, y) = (Axis::log("boxes"), Axis::log("certified − closed form (1/m)"));
    let through = (points[0].0, EXCESS * COVER / points[0].0);
    Plot::new("convergence", "The over-estimate of the certificate falls at first order", x, y)
        .series("measured", Style::LineAndPoints, points)
        .reference_order("derived limit 9h, order 1", -1.0, through)
}

fn claims(outcome: &mut Outcome, one: &Bracket) -> Result<(), ExperimentError> {
    outcome.claim(
        Claim::new(
            "wyvill-slope",
            "|g′| is at most 96√5 / (125 r), and reaches it at r/√5.",
            ClaimVerdict::Tested,
            "bracketed above for five radii; the margin is the certificate's excess at r = 1",
        )
        .margin(one.certified - closed_form(1.0)),
    )?;
    outcome.claim(
        Claim::new(
            "G29",
            "The bound is the maximum of g′ (“maximum of the derivative of g”).",
            ClaimVerdict::Refuted,
            "enclosures of g′ over the same boxes",
        )
        .witness(format!("g′ nowhere exceeds {:.0e}, and |g′| reaches {:.4}", one.largest_signed, one.sampled))
        .corrected("The bound is the maximum of |g′|; g′ ≤ 0, and r/√5 is where it is least."),
    )?;
    // The printed cube without the condition |x| < r, at x = −2r.
    let printed: f64 = 1.0 - 4.0;
    outcome.claim(
        Claim::new(
            "G28",
            "g(x) = (1 − (x/r)²)³ if x < r, with a signed distance x.",
            ClaimVerdict::Refuted,
            "evaluated here",
        )
        .witness(format!("x = −2r: printed −{}, ours {}", -(printed * printed * printed), wyvill(4.0)))
        .corrected("The condition is |x| < r."),
    )?;
    Ok(())
}

fn controls(outcome: &mut Outcome, boxes: u32) {
    let bound = closed_form(1.0);
    let wrong = bracket(squared, squared, 1.0, boxes);
    outcome.control(
        "another falloff",
        "(1 − x²)² in place of (1 − x²)³",
        "its slopes do not bracket the closed form",
        !agrees(&wrong, bound, boxes),
    );
    let right = bracket(wyvill, wyvill, 1.0, boxes);
    outcome.control(
        "a bound too low",
        "the closed form less one part in a thousand",
        "a sample exceeds it",
        !agrees(&right, 0.999 * bound, boxes),
    );
    outcome.control(
        "a bound too high",
        "the closed form plus one part in a hundred",
        "the certificate stays below it",
        !agrees(&right, 1.01 * bound, boxes),
    );
}

fn squared<R: Real>(u: R) -> R {
    (R::one() - u).max(R::zero()).square()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_lies_in_the_bracket_and_a_wrong_falloff_does_not() {
        for (radius, boxes) in [(1.0, 64), (0.01, 1000), (12_345.0, 4096)] {
            let bound = closed_form(radius);
            let right = bracket(wyvill, wyvill, radius, boxes);
            assert!(agrees(&right, bound, boxes), "r = {radius}: {} ≤ {bound} ≤ {}", right.sampled, right.certified);
            assert!((right.at / radius - 1.0 / 5.0f64.sqrt()).abs() <= COVER / f64::from(boxes));
            assert!(!agrees(&bracket(squared, squared, radius, boxes), bound, boxes));
        }
    }

    #[test]
    fn the_certificate_converges_at_first_order() {
        let excess = |boxes| bracket(wyvill, wyvill, 1.0, boxes).certified - closed_form(1.0);
        let ratio = excess(1 << 8) / excess(1 << 12);
        assert!((12.0..20.0).contains(&ratio), "16 times fewer boxes, {ratio} times the excess");
    }
}
