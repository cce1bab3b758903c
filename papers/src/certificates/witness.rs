//! Witnesses: a printed formula compared with what it is said to bound, at numbers that the ledger carries. Interval arithmetic
//! makes the comparison a proof; the corrected formula, compared at the same numbers, is the control.

use super::search::Number;
use terrain_model::interval::Interval;

/// A quantity and what it is said not to exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side<R> {
    /// The quantity.
    pub value: R,
    /// What it is said not to exceed.
    pub limit: R,
}

/// A statement at one point, as printed and corrected.
#[derive(Clone, Copy, Debug)]
pub struct Sides<R> {
    /// As printed.
    pub printed: Side<R>,
    /// What holds instead.
    pub corrected: Side<R>,
    /// Negative where nothing is said.
    pub domain: R,
}

impl<R: Number> Sides<R> {
    /// One quantity and two limits, everywhere.
    pub fn limits(value: R, printed: R, corrected: R) -> Sides<R> {
        Sides {
            printed: Side { value, limit: printed },
            corrected: Side { value, limit: corrected },
            domain: R::zero(),
        }
    }
    /// Two forms of one quantity and one limit, everywhere.
    pub fn forms(printed: R, corrected: R, limit: R) -> Sides<R> {
        Sides {
            printed: Side { value: printed, limit },
            corrected: Side { value: corrected, limit },
            domain: R::zero(),
        }
    }
    /// The same where `domain` is not negative.
    #[must_use]
    pub fn where_positive(self, domain: R) -> Sides<R> {
        Sides { domain, ..self }
    }
}

/// A formula over named numbers, generic over what they are.
pub trait Measure<const N: usize>: Sync {
    /// Both sides.
    fn sides<R: Number>(&self, x: [R; N]) -> Sides<R>;
}

/// A statement with its names and the box in which to look for violations.
pub struct Statement<M, const N: usize> {
    /// Names of the numbers.
    pub names: [&'static str; N],
    /// Where a hunt looks.
    pub root: [(f64, f64); N],
    /// The formula.
    pub measure: M,
}

/// A statement whatever its numbers.
pub trait Violation: Sync {
    /// Names of its numbers.
    fn names(&self) -> &[&'static str];
    /// The box in which to look.
    fn root(&self) -> &[(f64, f64)];
    /// Both sides in floating point; `None` for a wrong count of numbers.
    fn at(&self, x: &[f64]) -> Option<Sides<f64>>;
    /// Both sides enclosed.
    fn enclose(&self, x: &[Interval]) -> Option<Sides<Interval>>;
}

impl<M: Measure<N>, const N: usize> Violation for Statement<M, N> {
    fn names(&self) -> &[&'static str] {
        &self.names
    }
    fn root(&self) -> &[(f64, f64)] {
        &self.root
    }
    fn at(&self, x: &[f64]) -> Option<Sides<f64>> {
        Some(self.measure.sides(<[f64; N]>::try_from(x).ok()?))
    }
    fn enclose(&self, x: &[Interval]) -> Option<Sides<Interval>> {
        Some(self.measure.sides(<[Interval; N]>::try_from(x).ok()?))
    }
}

/// What a witness shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// As printed, enclosed.
    pub printed: Side<Interval>,
    /// What holds instead, enclosed.
    pub corrected: Side<Interval>,
    /// Is the point certainly where the statement speaks?
    pub inside: bool,
}

impl Check {
    /// Evaluates a statement at a point; `None` for a wrong count of numbers.
    pub fn at(violation: &dyn Violation, x: &[f64]) -> Option<Check> {
        let point: Vec<Interval> = x.iter().map(|&x| Interval::point(x)).collect();
        let Sides { printed, corrected, domain } = violation.enclose(&point)?;
        Some(Check { printed, corrected, inside: domain.lo() >= 0.0 })
    }
    /// Does the printed statement certainly fail here?
    pub fn convicts(&self) -> bool {
        self.inside && self.printed.value.lo() > self.printed.limit.hi()
    }
    /// The control: the same comparison must not convict the corrected statement, which must certainly hold.
    pub fn corrected_holds(&self) -> bool {
        self.inside && self.corrected.value.hi() <= self.corrected.limit.lo()
    }
    /// In one line.
    pub fn line(&self) -> String {
        let Check { printed, corrected, .. } = self;
        let limit = match corrected.limit.lo() {
            limit if limit == f64::INFINITY => "no bound".to_owned(),
            limit => format!("at most {limit:.6}"),
        };
        format!(
            "{:.6} where at most {:.6} is printed; corrected: {:.6}, {limit}",
            printed.value.lo(),
            printed.limit.hi(),
            corrected.value.hi()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2x ≤ x is printed, 2x ≤ 3x holds, for x ≥ 1.
    struct Double;
    impl Measure<1> for Double {
        fn sides<R: Number>(&self, [x]: [R; 1]) -> Sides<R> {
            Sides::limits(x + x, x, x * R::constant(3.0)).where_positive(x - R::one())
        }
    }

    #[test]
    fn a_witness_convicts_where_the_statement_speaks_and_nowhere_else() {
        let statement = Statement { names: ["x"], root: [(0.0, 5.0)], measure: Double };
        let at = |x: f64| Check::at(&statement, &[x]).unwrap();
        assert!(at(2.0).convicts() && at(2.0).corrected_holds());
        assert!(!at(0.5).convicts() && !at(0.5).corrected_holds());
        assert_eq!(Check::at(&statement, &[]), None);
        let prey = super::super::hunt(&statement, 1).unwrap();
        assert!(prey.ratio > 1.999 && prey.proved > 1.999, "{prey:?}");
    }
}
