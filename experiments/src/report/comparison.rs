//! The paper's values beside ours. Counts and ratios are compared within a stated tolerance; times and sizes that depend on the
//! machine are only shown. Where a paper's prose and its table disagree, both are printed.

use super::{Cell, Table};
use terrain_papers::verdicts::Verdict;

/// How far ours may lie from the paper's value, and where that comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Tolerance {
    /// ours / paper lies within these two, both included.
    Ratio {
        /// Least ratio.
        low: f64,
        /// Largest ratio.
        high: f64,
        /// Where the tolerance comes from.
        source: String,
    },
    /// |ours − paper| is at most this.
    Absolute {
        /// Largest difference, in the unit of the row.
        difference: f64,
        /// Where the tolerance comes from.
        source: String,
    },
    /// Not compared, and why.
    ShownOnly(String),
}

impl Tolerance {
    /// ours / paper within `low..=high`.
    pub fn ratio(low: f64, high: f64, source: &str) -> Self {
        Self::Ratio { low, high, source: source.into() }
    }

    /// |ours − paper| ≤ `difference`.
    pub fn absolute(difference: f64, source: &str) -> Self {
        Self::Absolute { difference, source: source.into() }
    }

    /// The two values are only shown.
    pub fn shown_only(why: &str) -> Self {
        Self::ShownOnly(why.into())
    }

    fn allows(&self, ours: f64, paper: f64) -> Option<bool> {
        match self {
            Self::Ratio { low, high, .. } => Some((*low..=*high).contains(&(ours / paper))),
            Self::Absolute { difference, .. } => Some((ours - paper).abs() <= *difference),
            Self::ShownOnly(_) => None,
        }
    }

    fn words(&self) -> (String, String) {
        let show = super::number::short;
        // Two digits of a ratio next to 1 say nothing: show its distance from 1.
        let ratio = |value: f64| match value - 1.0 {
            d if d == 0.0 || d.abs() >= 0.05 => show(value),
            d if d > 0.0 => format!("(1 + {})", show(d)),
            d => format!("(1 − {})", show(-d)),
        };
        match self {
            Self::Ratio { low, high, source } => (format!("×{} to ×{}", ratio(*low), ratio(*high)), source.clone()),
            Self::Absolute { difference, source } => (format!("±{}", show(*difference)), source.clone()),
            Self::ShownOnly(why) => ("shown only".into(), why.clone()),
        }
    }
}

/// One quantity, the paper's and ours.
#[derive(Clone, Debug)]
pub struct Compared {
    quantity: String,
    unit: &'static str,
    digits: u8,
    paper: Result<f64, String>,
    prose: String,
    ours: Result<f64, String>,
    tolerance: Tolerance,
    machine: bool,
}

impl Compared {
    /// A quantity with the paper's value, ours and the tolerance between them.
    pub fn new(quantity: impl Into<String>, unit: &'static str, paper: f64, ours: f64, tolerance: Tolerance) -> Self {
        Self {
            quantity: quantity.into(),
            unit,
            digits: 3,
            paper: Ok(paper),
            prose: String::new(),
            ours: Ok(ours),
            tolerance,
            machine: false,
        }
    }

    /// A quantity we did not measure, and why.
    pub fn absent(quantity: impl Into<String>, unit: &'static str, paper: f64, why: impl Into<String>) -> Self {
        let why = why.into();
        Self { ours: Err(why.clone()), ..Self::new(quantity, unit, paper, 0.0, Tolerance::ShownOnly(why)) }
    }

    /// The paper prints no value for it, and why.
    pub fn without_paper(mut self, why: impl Into<String>) -> Self {
        self.paper = Err(why.into());
        self
    }

    /// What the paper's prose says where its table says otherwise.
    pub fn prose(mut self, says: impl Into<String>) -> Self {
        self.prose = says.into();
        self
    }

    /// Significant digits shown; 3 unless said, 0 for as many as there are.
    pub const fn digits(mut self, digits: u8) -> Self {
        self.digits = digits;
        self
    }

    /// Ours depends on the machine.
    pub const fn machine(mut self) -> Self {
        self.machine = true;
        self
    }

    /// The verdict on this row; none when the values are only shown.
    pub fn verdict(&self) -> Option<Verdict> {
        let (Ok(paper), Ok(ours)) = (&self.paper, &self.ours) else { return None };
        let within = self.tolerance.allows(*ours, *paper)?;
        Some(if within { Verdict::Reproduced } else { Verdict::NotReproduced })
    }
}

/// A table of compared quantities.
#[derive(Clone, Debug)]
pub struct Comparison {
    name: String,
    caption: String,
    paper_hardware: String,
    our_hardware: String,
    rows: Vec<Compared>,
}

impl Comparison {
    /// An empty comparison. `our_hardware` is the context's.
    pub fn new(name: &str, caption: &str, paper_hardware: &str, our_hardware: &str) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            paper_hardware: paper_hardware.into(),
            our_hardware: our_hardware.into(),
            rows: Vec::new(),
        }
    }

    /// Adds a quantity.
    pub fn push(&mut self, row: Compared) {
        self.rows.push(row);
    }

    /// Reproduced when every compared row is and none of ours is absent; not reproduced when none is; partial between.
    pub fn verdict(&self) -> Verdict {
        let good = self.rows.iter().filter(|row| row.verdict() == Some(Verdict::Reproduced)).count();
        let bad = self.rows.iter().filter(|row| row.verdict() == Some(Verdict::NotReproduced)).count();
        let absent = self.rows.iter().filter(|row| row.ours.is_err()).count();
        match (good, bad, absent) {
            (0, 0, _) => Verdict::NotAttempted,
            (_, 0, 0) => Verdict::Reproduced,
            (0, _, _) => Verdict::NotReproduced,
            _ => Verdict::Partial,
        }
    }

    /// The table: quantity, paper, prose (when any), ours, ratio, tolerance and its source, verdict. The hardware stands in two
    /// columns of the CSV, and below the titles of the two values in the page.
    pub fn into_table(self) -> Table {
        let prose = self.rows.iter().any(|row| !row.prose.is_empty());
        let mut table =
            Table::new(&self.name, &self.caption).column("quantity").with_column("paper", &self.paper_hardware, false);
        if prose {
            table = table.column("paper's prose");
        }
        table = table
            .with_column("ours", &self.our_hardware, false)
            .column("ours ÷ paper")
            .column("tolerance")
            .column("tolerance from")
            .column("verdict")
            .column(PAPER_HARDWARE)
            .machine_column(OUR_HARDWARE);
        for row in self.rows {
            let (tolerance, source) = match &row.ours {
                Ok(_) => row.tolerance.words(),
                Err(_) => ("not measured".into(), String::new()),
            };
            let value = |value: &Result<f64, String>| match value {
                Ok(value) => Cell::number(*value, row.unit, row.digits),
                Err(why) => Cell::missing(why.as_str()),
            };
            let ratio = match (&row.paper, &row.ours) {
                (Ok(paper), Ok(ours)) if *paper != 0.0 => Cell::number(ours / paper, "", row.digits.max(3)),
                (Ok(_), Ok(_)) => Cell::missing("the paper's value is 0"),
                _ => Cell::missing("one value is absent"),
            };
            let verdict = row.verdict().map_or_else(|| Cell::missing("not compared"), Cell::from);
            let mut cells = vec![Cell::from(row.quantity.as_str()), value(&row.paper)];
            if prose {
                cells.push(Cell::from(row.prose.as_str()));
            }
            cells.extend([value(&row.ours), ratio, Cell::from(tolerance), Cell::from(source), verdict]);
            cells.extend([Cell::from(self.paper_hardware.as_str()), Cell::from(self.our_hardware.as_str())]);
            if row.machine { table.machine_row(cells) } else { table.row(cells) }
        }
        table
    }
}

/// Columns that the page shows below the titles of the two values instead.
pub(crate) const PAPER_HARDWARE: &str = "paper's hardware";
/// See [`PAPER_HARDWARE`].
pub(crate) const OUR_HARDWARE: &str = "our hardware";

#[cfg(test)]
mod tests {
    use super::*;

    fn row(ours: f64) -> Compared {
        Compared::new("calls", "per pixel", 28.9, ours, Tolerance::ratio(0.5, 2.0, "another camera"))
    }

    fn verdict(rows: &[Compared]) -> Verdict {
        let mut comparison = Comparison::new("table1", "", "GTX 670", "here");
        rows.iter().for_each(|row| comparison.push(row.clone()));
        comparison.verdict()
    }

    #[test]
    fn a_value_outside_its_tolerance_is_not_reproduced() {
        assert_eq!(row(2.0 * 28.9).verdict(), Some(Verdict::Reproduced));
        assert_eq!(row(2.01 * 28.9).verdict(), Some(Verdict::NotReproduced));
        assert_eq!(row(f64::NAN).verdict(), Some(Verdict::NotReproduced));
    }

    #[test]
    fn the_verdict_of_a_table_follows_its_rows() {
        let shown = Compared::new("time", "ms", 182.0, 9000.0, Tolerance::shown_only("another machine"));
        let absent = Compared::absent("kB", "kB", 10.0, "no scene");
        assert_eq!(verdict(&[row(28.0), shown.clone()]), Verdict::Reproduced);
        assert_eq!(verdict(&[row(28.0), row(1.0)]), Verdict::Partial);
        assert_eq!(verdict(&[row(28.0), absent.clone()]), Verdict::Partial);
        assert_eq!(verdict(&[row(1.0), absent]), Verdict::NotReproduced);
        assert_eq!(verdict(&[shown]), Verdict::NotAttempted);
    }

    #[test]
    fn hardware_prose_and_table_stand_in_their_own_columns() {
        let mut comparison = Comparison::new("table1", "", "GTX 670", "here");
        comparison.push(Compared::new("primitives", "", 70.0, 70.0, Tolerance::absolute(0.0, "exact")).prose("thirty"));
        let csv = comparison.into_table().deterministic_csv();
        assert_eq!(
            csv,
            "quantity,paper,paper's prose,ours,ours ÷ paper,tolerance,tolerance from,verdict,paper's hardware\n\
             primitives,70,thirty,70,1,±0,exact,reproduced,GTX 670\n"
        );
    }
}
