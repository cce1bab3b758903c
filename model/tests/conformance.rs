//! Every formula on every number type against `f64`. Tolerances are not chosen: `f32` must agree within what the same
//! formula derives on `Rounded`, lanes with `f32` bit for bit, duals with `f64` bit for bit in value, intervals by
//! enclosing. Each comparison has a control: the same comparison with a formula shifted by a 64th of a unit must fail.

use proptest::prelude::*;
use terrain_model::dual::{Differentiable, Dual};
use terrain_model::falloff::{fade, wyvill};
use terrain_model::interval::Interval;
use terrain_model::lanes::Lanes;
use terrain_model::noise::{Combination, Lattice, NoiseJet, NoiseValue, Octave, Octaves, mix};
use terrain_model::rounding::Rounded;

/// A formula of `D` coordinates on any number.
trait Formula<const D: usize> {
    fn at<R: NoiseValue>(&self, x: [R; D]) -> R;
    /// Bounds the third derivative, for the error of central differences, and the size of the values.
    fn scale(&self) -> f64 {
        1.0
    }
    /// The largest `f32` error that still says something.
    fn vacuous(&self) -> f64 {
        1e-4
    }
}

struct Gradient2(Lattice<2>);
impl Formula<2> for Gradient2 {
    fn at<R: NoiseValue>(&self, x: [R; 2]) -> R {
        R::gradient2(self.0, x)
    }
}
struct Gradient3(Lattice<3>);
impl Formula<3> for Gradient3 {
    fn at<R: NoiseValue>(&self, x: [R; 3]) -> R {
        R::gradient3(self.0, x)
    }
}
struct Simplex3(Lattice<3>);
impl Formula<3> for Simplex3 {
    fn at<R: NoiseValue>(&self, x: [R; 3]) -> R {
        R::simplex3(self.0, x)
    }
}
/// Octaves of up to 2 cells per unit, 7 m high.
struct Plane(Combination, Vec<Octave<2>>);
impl Formula<2> for Plane {
    fn at<R: NoiseValue>(&self, x: [R; 2]) -> R {
        self.0.plane(&self.1, x)
    }
    fn scale(&self) -> f64 {
        100.0
    }
    fn vacuous(&self) -> f64 {
        0.2
    }
}
struct Wyvill;
impl Formula<1> for Wyvill {
    fn at<R: NoiseValue>(&self, [x]: [R; 1]) -> R {
        wyvill((x * R::constant(0.03)).square())
    }
    fn scale(&self) -> f64 {
        0.05
    }
}
struct Fade;
impl Formula<1> for Fade {
    fn at<R: NoiseValue>(&self, [x]: [R; 1]) -> R {
        let (value, slope) = fade((x * R::constant(0.03) + R::constant(0.5)).clamp01());
        value + R::constant(0.25) * slope
    }
    fn scale(&self) -> f64 {
        0.05
    }
    fn vacuous(&self) -> f64 {
        1e-2
    }
}
/// The control: another formula evaluated a 64th of a unit to the side.
struct Shifted<'a, F>(&'a F);
impl<const D: usize, F: Formula<D>> Formula<D> for Shifted<'_, F> {
    fn at<R: NoiseValue>(&self, x: [R; D]) -> R {
        self.0.at(x.map(|x| x + R::constant(1.0 / 64.0)))
    }
}

fn variables<R: Differentiable, const D: usize>(x: [R; D]) -> [Dual<R, D>; D] {
    let mut out = [Dual::fixed(x[0]); D];
    for k in 0..D {
        out[k] = Dual::variable(x[k], k);
    }
    out
}

const COMPARISONS: [&str; 6] = ["rounded", "f32", "lanes", "dual value", "dual slope", "interval"];

/// Compares `tested` on every number with `oracle` at one `f32` point; `width` is the size of the boxes around it.
/// The error of `f64` itself is allowed for by 1e-13 times the scale of the formula.
fn compare<const D: usize, F: Formula<D>, G: Formula<D>>(oracle: &F, tested: &G, x: [f32; D], width: f64) -> [bool; 6] {
    let wide = x.map(f64::from);
    let value = oracle.at(wide);
    let slack = Interval::symmetric(1e-13 * oracle.scale());

    let derived = tested.at(x.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0)));
    let rounded = (derived.exact + slack).contains(value) && derived.error < oracle.vacuous();
    let single = (oracle.at(x.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0))).reach() + slack)
        .contains(f64::from(tested.at(x)));
    let wide_lanes = tested.at(x.map(|x| Lanes([x + 1.0, x, -x, x])));
    let lanes = [1, 3].iter().all(|&lane| wide_lanes.0[lane].to_bits() == oracle.at(x).to_bits());

    let dual = tested.at(variables(wide));
    let dual_value = dual.value.to_bits() == value.to_bits();
    let step = 1e-5;
    let dual_slope = (0..D).all(|k| {
        let (mut above, mut below) = (wide, wide);
        above[k] += step;
        below[k] -= step;
        let (a, b) = (oracle.at(above), oracle.at(below));
        let (width, forward, backward) = (above[k] - below[k], a - value, value - b);
        // One-sided differences that disagree by more than second derivatives of 40 · scale can make show a crease
        // inside the stencil; one that they do not show moves the central difference by less than the tolerance.
        let tolerance = 4e-4 * oracle.scale() + 1e-14 * value.abs() / step;
        let crease = (forward - backward).abs() > tolerance * step;
        crease || ((a - b) / width - dual.slope[k]).abs() < tolerance
    });

    let boxed = wide.map(|x| Interval::new(x - 0.3 * width, x + 0.7 * width));
    let (enclosure, slopes) = (tested.at(boxed), tested.at(variables(boxed)));
    let grow = |x: Interval| x + Interval::symmetric(1e-12 * oracle.scale());
    let interval = (0..=1usize << D).all(|corner| {
        let mut p = wide;
        for k in 0..D {
            if corner > 0 {
                p[k] = if (corner - 1) >> k & 1 == 1 { boxed[k].hi() } else { boxed[k].lo() };
            }
        }
        let at = oracle.at(variables(p));
        grow(enclosure).contains(at.value)
            && grow(slopes.value).contains(at.value)
            && (0..D).all(|k| grow(slopes.slope[k] * Interval::new(1.0 - 1e-12, 1.0 + 1e-12)).contains(at.slope[k]))
    });
    [rounded, single, lanes, dual_value, dual_slope, interval]
}

fn agree<const D: usize, F: Formula<D>>(formula: &F, x: [f32; D], width: f64) -> Result<(), TestCaseError> {
    for (name, holds) in COMPARISONS.iter().zip(compare(formula, formula, x, width)) {
        prop_assert!(holds, "{} at {:?}, boxes {}", name, x, width);
    }
    Ok(())
}

/// How many of 200 random points each comparison turns the shifted formula down at.
fn turned_down<const D: usize, F: Formula<D>>(formula: &F) -> [u32; 6] {
    let mut state = 17;
    let mut counts = [0; 6];
    for _ in 0..200 {
        let x = [(); D].map(|()| {
            state = mix(state, 5);
            state as f32 / u32::MAX as f32 * 40.0 - 20.0
        });
        for (count, holds) in counts.iter_mut().zip(compare(formula, &Shifted(formula), x, 0.0)) {
            *count += u32::from(!holds);
        }
    }
    counts
}

fn lattice<const D: usize>(seed: u32, base: i32) -> Lattice<D> {
    let mut bases = [base; D];
    bases[D - 1] = base.wrapping_mul(-3).wrapping_add(1);
    Lattice { seed, base: bases }
}

fn combination(number: usize) -> Combination {
    [
        Combination::Sum,
        Combination::Turbulence,
        Combination::Ridged { offset: 1.0, sharpness: 2.0 },
        Combination::Multifractal { offset: 0.8 },
        Combination::Hybrid { offset: 0.7 },
    ][number]
}

fn plane(number: usize, seed: u32, origin: [f64; 2]) -> Plane {
    let octaves = Octaves { octaves: 4, frequency: 0.25, lacunarity: 2.0, gain: 0.55, amplitude: 7.0 };
    let mut placed = octaves.place(seed, origin);
    if seed.is_multiple_of(4) {
        // Unshifted octaves vanish together on lattice points: creases and clamps meet there.
        placed.iter_mut().for_each(|octave| octave.offset = [0.0; 2]);
    }
    Plane(combination(number), placed)
}

/// Random, integer, nearly integer, tiny and negative coordinates.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -50.0f32..50.0,
        1 => (-40i32..40).prop_map(|i| i as f32),
        1 => (-40i32..40).prop_map(|i| (i as f32).next_up()),
        1 => (-40i32..40).prop_map(|i| (i as f32).next_down()),
        1 => (-80i32..80).prop_map(|i| i as f32 * 0.5),
        1 => Just(-1e-12f32),
        1 => Just(-0.0f32),
        1 => Just(f32::MIN_POSITIVE),
        1 => -5000.0f32..5000.0,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn gradient2_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate()], width in 0.0f64..1.5) {
        agree(&Gradient2(lattice(seed, base)), x, width * width)?;
    }
    #[test]
    fn gradient3_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate(), coordinate()], width in 0.0f64..1.5) {
        agree(&Gradient3(lattice(seed, base)), x, width * width)?;
    }
    #[test]
    fn simplex3_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate(), coordinate()], width in 0.0f64..1.0) {
        agree(&Simplex3(lattice(seed, base)), x, width * width)?;
    }
    #[test]
    fn octaves_agree_on_every_number(number in 0usize..5, seed in any::<u32>(), origin in [-1e6f64..1e6, -1e6f64..1e6], x in [coordinate(), coordinate()], width in 0.0f64..1.5) {
        agree(&plane(number, seed, origin), x, width * width)?;
    }
    #[test]
    fn falloff_and_fade_agree_on_every_number(x in [coordinate()], width in 0.0f64..4.0) {
        agree(&Wyvill, x, width * width)?;
        agree(&Fade, x, width * width)?;
    }
}

#[test]
fn every_comparison_turns_a_shifted_formula_down() {
    let mut counts = vec![
        ("gradient2", turned_down(&Gradient2(lattice(1, 5)))),
        ("gradient3", turned_down(&Gradient3(lattice(1, 5)))),
        ("simplex3", turned_down(&Simplex3(lattice(1, 5)))),
        ("wyvill", turned_down(&Wyvill)),
        ("fade", turned_down(&Fade)),
    ];
    for number in 0..5 {
        counts.push(("octaves", turned_down(&plane(number, 1, [0.0; 2]))));
    }
    for (name, counts) in counts {
        for (comparison, count) in COMPARISONS.iter().zip(counts) {
            assert!(count > 100, "{name}: {comparison} turned only {count} of 200 down");
        }
    }
}

#[test]
fn jets_in_single_precision_stay_within_the_derived_error() {
    let mut state = 1u32;
    let mut random = || {
        state = mix(state, 1);
        state as f32 / u32::MAX as f32 * 30.0 - 15.0
    };
    let (plane, space) = (lattice::<2>(4, 77), lattice::<3>(4, 77));
    let mut turned_down = 0;
    for _ in 0..2000 {
        let x = [random(), random(), random()];
        let exact = x.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0));
        let single = |x: [f32; 3]| -> Vec<f32> {
            [&f32::gradient2_jet(plane, [x[0], x[1]])[..], &f32::gradient3_jet(space, x), &f32::simplex3_jet(space, x)]
                .concat()
        };
        let derived: Vec<Rounded> = [
            &Rounded::gradient2_jet(plane, [exact[0], exact[1]])[..],
            &Rounded::gradient3_jet(space, exact),
            &Rounded::simplex3_jet(space, exact),
        ]
        .concat();
        for (single, derived) in single(x).iter().zip(&derived) {
            assert!(derived.reach().contains(f64::from(*single)), "{derived:?} {single} at {x:?}");
            assert!(derived.error < 1e-3, "{derived:?}");
        }
        let shifted = single(x.map(|x| x + 1.0 / 64.0));
        turned_down += shifted.iter().zip(&derived).filter(|(s, d)| !d.reach().contains(f64::from(**s))).count();
    }
    assert!(turned_down > 18_000, "{turned_down} of 22000");
}

#[test]
fn lanes_of_any_width_agree_with_single_numbers_under_dispatch() {
    let arch = pulp::Arch::new();
    let octaves = plane(2, 3, [1e5, -2e5]);
    let x = Lanes(std::array::from_fn::<f32, 16, _>(|i| i as f32 * 1.7 - 9.0));
    let y = Lanes(std::array::from_fn::<f32, 16, _>(|i| (i * i) as f32 * 0.37 - 20.0));
    let wide = arch.dispatch(
        #[inline(always)]
        || octaves.at([x, y]),
    );
    for lane in 0..16 {
        assert_eq!(wide.0[lane].to_bits(), octaves.at([x.0[lane], y.0[lane]]).to_bits());
    }
}
