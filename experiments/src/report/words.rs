//! What the terminal shows of a run.

use super::Report;
pub use super::number::{bytes, duration};

/// A table of the results: id, verdict, time, peak memory.
pub fn results(report: &Report) -> String {
    let head = ["experiment", "verdict", "time", "peak memory"].map(str::to_owned);
    let rows: Vec<[String; 4]> = std::iter::once(head)
        .chain(report.records.iter().map(|record| {
            let peak = record.peak_memory_bytes.as_ref().map_or_else(|_| "unknown".into(), |&count| bytes(count));
            [record.experiment.id.into(), record.verdict().to_string(), duration(record.seconds), peak]
        }))
        .collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2), width(3)];
    let line = |row: &[String; 4]| {
        let [id, verdict, time, peak] = row;
        format!("{id:0$}  {verdict:1$}  {time:>2$}  {peak:>3$}\n", widths[0], widths[1], widths[2], widths[3])
    };
    let rule = format!("{}\n", "─".repeat(widths.iter().sum::<usize>() + 6));
    let mut text = line(&rows[0]) + &rule;
    text.extend(rows[1..].iter().map(line));
    text
}
