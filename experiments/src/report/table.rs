//! A table with typed cells. Columns and rows that depend on the machine are marked, so that the CSV beside the report can be
//! compared byte by byte.

use super::{OutcomeError, csv, number};
use serde_json::{Value, json};
use terrain_papers::verdicts::Verdict;

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A finite number; CSV and JSON keep all its digits.
    Number {
        /// The value.
        value: f64,
        /// Its unit; empty for a bare count or ratio.
        unit: &'static str,
        /// Significant digits shown to people; 0 for as many as the number has.
        digits: u8,
    },
    /// Not known, and why.
    Missing(String),
    /// A verdict on the row.
    Verdict(Verdict),
}

impl Cell {
    /// A number with its unit, shown with `digits` significant digits; 0 for as many as it has.
    pub const fn number(value: f64, unit: &'static str, digits: u8) -> Self {
        Self::Number { value, unit, digits }
    }

    /// A bare count.
    pub fn count(value: u64) -> Self {
        Self::Number { value: value as f64, unit: "", digits: 0 }
    }

    /// Not known, and why.
    pub fn missing(why: impl Into<String>) -> Self {
        Self::Missing(why.into())
    }

    /// The cell as people read it; the unit is left out where the head of the column has it.
    pub(crate) fn readable(&self, with_unit: bool) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number { value, unit, digits } if unit.is_empty() || !with_unit => number::readable(*value, *digits),
            Self::Number { value, unit, digits } => format!("{}\u{a0}{unit}", number::readable(*value, *digits)),
            Self::Missing(why) => why.clone(),
            Self::Verdict(verdict) => verdict.word().into(),
        }
    }

    /// The cell as a CSV field: a number without its unit, a reason marked as such.
    fn exact(&self) -> String {
        match self {
            Self::Number { value, .. } => number::exact(*value),
            Self::Missing(why) => format!("absent: {why}"),
            other => other.readable(true),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Number { value, unit, .. } => json!({"value": value, "unit": unit}),
            Self::Missing(why) => json!({"absent": why}),
            Self::Verdict(verdict) => json!(verdict.word()),
        }
    }

    fn unit(&self) -> Option<&'static str> {
        if let Self::Number { unit, .. } = self { Some(unit) } else { None }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<Verdict> for Cell {
    fn from(verdict: Verdict) -> Self {
        Self::Verdict(verdict)
    }
}

/// The head of a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its title.
    pub title: String,
    /// A line below the title, such as the hardware a column was measured on.
    pub note: String,
    /// Whether its values depend on the machine: then they are kept out of the deterministic CSV.
    pub machine: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub cells: Vec<Cell>,
    pub machine: bool,
}

/// A table: the deterministic part goes to `<id>/<name>.csv`, the whole to `timings/<id>/<name>.csv` when part of it depends on the
/// machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub(crate) name: String,
    pub(crate) caption: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Row>,
}

impl Table {
    /// An empty table; `name` is its file name without extension.
    pub fn new(name: &str, caption: &str) -> Self {
        Self { name: name.into(), caption: caption.into(), columns: Vec::new(), rows: Vec::new() }
    }

    /// Adds a column with the same values on every machine.
    pub fn column(self, title: &str) -> Self {
        self.with_column(title, "", false)
    }

    /// Adds a column of times, memory or anything else that depends on the machine.
    pub fn machine_column(self, title: &str) -> Self {
        self.with_column(title, "", true)
    }

    pub(crate) fn with_column(mut self, title: &str, note: &str, machine: bool) -> Self {
        self.columns.push(Column { title: title.into(), note: note.into(), machine });
        self
    }

    /// Adds a row: one cell per column.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(Row { cells: cells.into_iter().collect(), machine: false });
    }

    /// Adds a row that depends on the machine in every column but the first.
    pub fn machine_row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(Row { cells: cells.into_iter().collect(), machine: true });
    }

    /// Whether any part depends on the machine.
    pub(crate) fn depends_on_machine(&self) -> bool {
        self.columns.iter().any(|column| column.machine) || self.rows.iter().any(|row| row.machine)
    }

    /// Whether any row is left for the deterministic CSV.
    pub(crate) fn has_deterministic_part(&self) -> bool {
        self.columns.iter().any(|column| !column.machine) && self.rows.iter().any(|row| !row.machine)
    }

    pub(crate) fn check(&self) -> Result<(), OutcomeError> {
        for (i, row) in self.rows.iter().enumerate() {
            if row.cells.len() != self.columns.len() {
                return Err(OutcomeError::RowWidth {
                    table: self.name.clone(),
                    row: i + 1,
                    cells: row.cells.len(),
                    columns: self.columns.len(),
                });
            }
            for (cell, column) in row.cells.iter().zip(&self.columns) {
                if let Cell::Number { value, .. } = cell
                    && !value.is_finite()
                {
                    let name = format!("{}, row {}, column `{}`", self.name, i + 1, column.title);
                    return Err(OutcomeError::NotFinite { name, value: *value });
                }
            }
        }
        Ok(())
    }

    /// The part that has the same bytes on every machine.
    pub(crate) fn deterministic_csv(&self) -> String {
        self.csv(|column| !column.machine, |row| !row.machine)
    }

    /// Everything.
    pub(crate) fn full_csv(&self) -> String {
        self.csv(|_| true, |_| true)
    }

    fn csv(&self, keep_column: impl Fn(&Column) -> bool, keep_row: impl Fn(&Row) -> bool) -> String {
        let rows: Vec<&Row> = self.rows.iter().filter(|row| keep_row(row)).collect();
        let mut fields: Vec<Vec<String>> = vec![Vec::new(); rows.len() + 1];
        for (i, column) in self.columns.iter().enumerate().filter(|(_, column)| keep_column(column)) {
            let units = units(rows.iter().map(|row| &row.cells[i]));
            // A column of one unit carries it in its title; a mixed column is followed by a column of units.
            match units[..] {
                [] | [""] => fields[0].push(column.title.clone()),
                [unit] => fields[0].push(format!("{} ({unit})", column.title)),
                _ => fields[0].extend([column.title.clone(), format!("{}: unit", column.title)]),
            }
            for (line, row) in fields[1..].iter_mut().zip(&rows) {
                line.push(row.cells[i].exact());
                if units.len() > 1 {
                    line.push(row.cells[i].unit().unwrap_or("").into());
                }
            }
        }
        fields.iter().map(|line| csv::line(line)).collect()
    }

    /// The one unit of a column, when all of its numbers share it.
    pub(crate) fn shared_unit(&self, column: usize) -> Option<&'static str> {
        match units(self.rows.iter().map(|row| &row.cells[column]))[..] {
            [unit] if !unit.is_empty() => Some(unit),
            _ => None,
        }
    }

    pub(crate) fn json(&self) -> Value {
        json!({
            "name": self.name,
            "caption": self.caption,
            "columns": self.columns.iter()
                .map(|column| json!({"title": column.title, "note": column.note, "machine_dependent": column.machine}))
                .collect::<Vec<_>>(),
            "rows": self.rows.iter().map(|row| row.cells.iter().map(Cell::json).collect()).collect::<Vec<Value>>(),
        })
    }
}

/// The different units of some cells.
fn units<'a>(cells: impl Iterator<Item = &'a Cell>) -> Vec<&'static str> {
    let mut units: Vec<&str> = cells.filter_map(Cell::unit).collect();
    units.sort_unstable();
    units.dedup();
    units
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(milliseconds: f64) -> Table {
        let mut table = Table::new("table1", "…").column("scene").column("calls").machine_column("time");
        table.row(["Fig 1, \"river\"".into(), Cell::count(12), Cell::number(milliseconds, "ms", 3)]);
        table.machine_row(["peak".into(), Cell::number(milliseconds * 3.0, "MiB", 3), Cell::missing("not a time")]);
        table
    }

    #[test]
    fn deterministic_csv_does_not_change_with_the_machine() {
        assert_eq!(table(1.0).deterministic_csv(), table(2.0).deterministic_csv());
        assert_eq!(table(1.0).deterministic_csv(), "scene,calls\n\"Fig 1, \"\"river\"\"\",12\n");
        // The control: the full table does change.
        assert_ne!(table(1.0).full_csv(), table(2.0).full_csv());
    }

    #[test]
    fn a_column_carries_its_unit_once_or_beside_each_value() {
        assert_eq!(
            table(0.1).full_csv(),
            "scene,calls,calls: unit,time (ms)\n\"Fig 1, \"\"river\"\"\",12,,0.1\n\
             peak,0.30000000000000004,MiB,absent: not a time\n"
        );
    }

    #[test]
    fn a_row_of_the_wrong_width_or_with_nan_is_refused() {
        let mut short = table(1.0);
        short.row(["one".into()]);
        assert!(short.check().unwrap_err().to_string().contains("row 3"));
        let error = table(f64::NAN).check().unwrap_err().to_string();
        assert!(error.contains("table1, row 1, column `time`"), "{error}");
    }
}
