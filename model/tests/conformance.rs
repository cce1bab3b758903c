//! Every formula on every number type against `f64`. Tolerances are not chosen: `f32` and lanes must agree within what
//! the same formula derives on `Rounded`, lanes with `f32` bit for bit, duals with `f64` bit for bit in value.
//! Each comparison has a control: a perturbed input or result must fail it.

use proptest::prelude::*;
use terrain_model::dual::Dual;
use terrain_model::interval::Interval;
use terrain_model::lanes::Lanes;
use terrain_model::noise::{Lattice, NoiseJet, NoiseValue};
use terrain_model::rounding::Rounded;

/// A formula of `D` coordinates on any number, with a name for failures.
trait Formula<const D: usize> {
    fn at<R: NoiseValue>(&self, x: [R; D]) -> R;
    /// Largest |second derivative| times 1, for the error of central differences.
    const CURVATURE: f64;
}

struct Gradient2(Lattice<2>);
impl Formula<2> for Gradient2 {
    const CURVATURE: f64 = 100.0;
    fn at<R: NoiseValue>(&self, x: [R; 2]) -> R {
        R::gradient2(self.0, x)
    }
}
struct Gradient3(Lattice<3>);
impl Formula<3> for Gradient3 {
    const CURVATURE: f64 = 200.0;
    fn at<R: NoiseValue>(&self, x: [R; 3]) -> R {
        R::gradient3(self.0, x)
    }
}
struct Simplex3(Lattice<3>);
impl Formula<3> for Simplex3 {
    const CURVATURE: f64 = 400.0;
    fn at<R: NoiseValue>(&self, x: [R; 3]) -> R {
        R::simplex3(self.0, x)
    }
}

fn variables<R: terrain_model::dual::Differentiable, const D: usize>(x: [R; D]) -> [Dual<R, D>; D] {
    let mut out = [Dual::fixed(x[0]); D];
    for k in 0..D {
        out[k] = Dual::variable(x[k], k);
    }
    out
}

/// Everything that must hold at one `f32` point, `width` being the size of the boxes around it.
fn check<const D: usize, F: Formula<D>>(formula: &F, x: [f32; D], width: f64) -> Result<(), TestCaseError> {
    let wide = x.map(f64::from);
    let value = formula.at(wide);

    let single = formula.at(x);
    let lanes = formula.at(x.map(|x| Lanes([x, x + 1.0, x, x])));
    prop_assert_eq!(lanes.0[2].to_bits(), single.to_bits(), "lanes and f32 differ at {:?}", x);
    let derived = formula.at(x.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0)));
    let slack = 1e-13;
    prop_assert!((derived.exact + Interval::symmetric(slack)).contains(value), "{derived:?} {value} at {x:?}");
    prop_assert!(
        (derived.reach() + Interval::symmetric(slack)).contains(f64::from(single)),
        "{derived:?} {single} at {x:?}"
    );
    prop_assert!(derived.error < 1e-4, "vacuous: {derived:?} at {x:?}");

    let dual = formula.at(variables(wide));
    prop_assert_eq!(dual.value.to_bits(), value.to_bits(), "dual value at {:?}", x);
    let e = 1e-6 * x.iter().fold(1.0f64, |m, &x| m.max(f64::from(x.abs())));
    for k in 0..D {
        let (mut p, mut q) = (wide, wide);
        p[k] += e;
        q[k] -= e;
        let difference = (formula.at(p) - formula.at(q)) / (p[k] - q[k]);
        let tolerance = F::CURVATURE * e + 1e-8;
        prop_assert!((difference - dual.slope[k]).abs() < tolerance, "{k}: {difference} {:?} at {x:?}", dual.slope);
    }

    let boxed = wide.map(|x| Interval::new(x - 0.3 * width, x + 0.7 * width));
    let enclosure = formula.at(boxed);
    let slopes = formula.at(variables(boxed));
    for corner in 0..=(1 << D) {
        let mut p = wide;
        if corner > 0 {
            for k in 0..D {
                p[k] = if (corner - 1) >> k & 1 == 1 { boxed[k].hi() } else { boxed[k].lo() };
            }
        }
        let at = formula.at(variables(p));
        let grow = |x: Interval| x + Interval::symmetric(1e-12);
        prop_assert!(grow(enclosure).contains(at.value), "{enclosure:?} {} at {p:?}", at.value);
        prop_assert!(grow(slopes.value).contains(at.value));
        for k in 0..D {
            prop_assert!(grow(slopes.slope[k]).contains(at.slope[k]), "{k} {slopes:?} {at:?} at {p:?}");
        }
    }
    Ok(())
}

fn lattice<const D: usize>(seed: u32, base: i32) -> Lattice<D> {
    let mut bases = [base; D];
    bases[D - 1] = base.wrapping_mul(-3).wrapping_add(1);
    Lattice { seed, base: bases }
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
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn gradient2_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate()], width in 0.0f64..1.5) {
        check(&Gradient2(lattice(seed, base)), x, width * width)?;
    }
    #[test]
    fn gradient3_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate(), coordinate()], width in 0.0f64..1.5) {
        check(&Gradient3(lattice(seed, base)), x, width * width)?;
    }
    #[test]
    fn simplex3_agrees_on_every_number(seed in any::<u32>(), base in any::<i32>(), x in [coordinate(), coordinate(), coordinate()], width in 0.0f64..1.0) {
        check(&Simplex3(lattice(seed, base)), x, width * width)?;
    }
}

#[test]
fn jets_in_single_precision_stay_within_the_derived_error() {
    let mut state = 1u32;
    let mut random = || {
        state = terrain_model::noise::mix(state, 1);
        state as f32 / u32::MAX as f32 * 30.0 - 15.0
    };
    for _ in 0..2000 {
        let x = [random(), random(), random()];
        let exact = x.map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0));
        let (plane, space) = (lattice::<2>(4, 77), lattice::<3>(4, 77));
        let single: Vec<f32> = [
            &f32::gradient2_jet(plane, [x[0], x[1]])[..],
            &f32::gradient3_jet(space, x)[..],
            &f32::simplex3_jet(space, x)[..],
        ]
        .concat();
        let derived: Vec<Rounded> = [
            &Rounded::gradient2_jet(plane, [exact[0], exact[1]])[..],
            &Rounded::gradient3_jet(space, exact)[..],
            &Rounded::simplex3_jet(space, exact)[..],
        ]
        .concat();
        for (single, derived) in single.iter().zip(&derived) {
            assert!(derived.reach().contains(f64::from(*single)), "{derived:?} {single} at {x:?}");
            assert!(derived.error < 1e-3, "{derived:?}");
        }
    }
}
