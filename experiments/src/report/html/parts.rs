//! The pieces of the page: tables, figures, claims, controls, metrics.

use crate::report::comparison::{OUR_HARDWARE, PAPER_HARDWARE};
use crate::report::outcome::{Claim, Control, Outcome};
use crate::report::{Cell, Column, Record, Table, number};
use maud::{Markup, PreEscaped, html};

/// Longer texts may wrap.
const SHORT: usize = 24;

/// A verdict as a coloured word; the class is the word with hyphens.
pub(super) fn badge(word: &str) -> Markup {
    html! { span class={ "badge " (word.replace(' ', "-")) } { (word) } }
}

pub(super) fn table(record: &Record, table: &Table) -> Markup {
    let shown = |column: &Column| column.title != PAPER_HARDWARE && column.title != OUR_HARDWARE;
    let units: Vec<Option<&str>> = (0..table.columns.len()).map(|i| table.shared_unit(i)).collect();
    let marked =
        table.columns.iter().any(|column| shown(column) && column.machine) || table.rows.iter().any(|row| row.machine);
    let numeric: Vec<bool> = (0..table.columns.len())
        .map(|i| table.rows.iter().any(|row| matches!(row.cells[i], Cell::Number { .. })))
        .collect();
    html! {
        figure.table {
            figcaption {
                (table.caption) " "
                @if table.has_deterministic_part() {
                    a.file href={ (record.folder(false)) "/" (table.name) ".csv" } { "CSV" }
                }
                @if table.depends_on_machine() {
                    " " a.file href={ (record.folder(true)) "/" (table.name) ".csv" } { "CSV with this machine’s values" }
                }
            }
            div.scroll { table {
                thead { tr {
                    @for (i, column) in table.columns.iter().enumerate().filter(|(_, column)| shown(column)) {
                        th.number[numeric[i]] {
                            (column.title)
                            @if let Some(unit) = units[i] { " (" (unit) ")" }
                            @if column.machine { span.machine title="depends on the machine" { " †" } }
                            @if !column.note.is_empty() { span.note { (column.note) } }
                        }
                    }
                } }
                tbody {
                    @for row in &table.rows {
                        tr.machine-row[row.machine] {
                            @for (i, value) in row.cells.iter().enumerate().filter(|(i, _)| shown(&table.columns[*i])) {
                                (cell(value, units[i].is_none(), row.machine && i == 0))
                            }
                        }
                    }
                }
            } }
            @if marked { p.footnote { "† depends on the machine" } }
        }
    }
}

fn cell(cell: &Cell, with_unit: bool, mark: bool) -> Markup {
    html! {
        @match cell {
            Cell::Verdict(verdict) => { td { (badge(verdict.word())) } }
            Cell::Missing(why) => { td.missing { (why) } }
            Cell::Number { .. } => { td.number { (cell.readable(with_unit)) } }
            Cell::Text(text) => { td.short[text.chars().count() <= SHORT] { (text) @if mark { span.machine { " †" } } } }
        }
    }
}

pub(super) fn figures(record: &Record) -> Markup {
    let outcome = &record.outcome;
    let folder = record.folder(false);
    html! {
        @if !outcome.pictures.is_empty() || !outcome.plots.is_empty() {
            div.figures {
                @for picture in &outcome.pictures {
                    figure {
                        a href={ (folder) "/" (picture.png.file) } {
                            img src={ (folder) "/" (picture.png.file) } width=(picture.png.width) height=(picture.png.height)
                                alt=(picture.caption) loading="lazy";
                        }
                        figcaption {
                            (picture.caption)
                            @if !picture.camera.is_empty() { span.note { "Camera: " (picture.camera) } }
                            @if let Some(seed) = picture.seed { span.note { "Seed: " code { (format!("{seed:#x}")) } } }
                        }
                    }
                }
                @for (plot, drawing) in outcome.plots.iter().zip(&record.drawings) {
                    @let place = format!("{}/{}", record.folder(plot.machine), plot.name);
                    figure.plot {
                        div role="img" aria-label=(plot.caption) { (PreEscaped(drawing)) }
                        figcaption {
                            (plot.caption) @if plot.machine { span.machine { " †" } } " "
                            a.file href={ (place) ".csv" } { "CSV" } " " a.file href={ (place) ".svg" } { "SVG" }
                        }
                    }
                }
            }
        }
        @if !outcome.attachments.is_empty() {
            ul.files {
                @for (file, about) in &outcome.attachments {
                    li { a href={ (folder) "/" (file) } { code { (file) } } " " (about) }
                }
            }
        }
    }
}

/// More claims than this get a search field.
const MANY: usize = 20;

/// Shows the rows of the table below that hold every word and have the verdict chosen.
const FILTER: &str = "for(const f of document.querySelectorAll('.filter')){const rows=f.nextElementSibling.querySelectorAll('tbody tr'),\
[words,verdict,count]=[f.querySelector('input'),f.querySelector('select'),f.querySelector('output')];const show=()=>{let n=0;for(const r of \
rows){const t=r.textContent.toLowerCase(),ok=words.value.toLowerCase().split(/\\s+/).every(w=>t.includes(w))&&(!verdict.value||\
r.dataset.verdict===verdict.value);r.hidden=!ok;n+=ok}count.value=n+' of '+rows.length};f.oninput=show;f.hidden=false;show()}";

/// A field for words and a choice of verdicts, hidden where there is no script.
fn filter(claims: &[Claim]) -> Markup {
    let verdicts: std::collections::BTreeSet<&str> = claims.iter().map(|claim| claim.verdict.word()).collect();
    html! {
        p.filter hidden {
            label { "Filter " input type="search" placeholder="paper, section, word"; }
            " "
            label { "Verdict " select {
                option value="" { "all" }
                @for verdict in verdicts { option value=(verdict) { (verdict) } }
            } }
            " " output { }
        }
    }
}

pub(super) fn claim_table(claims: &[Claim]) -> Markup {
    let many = claims.len() > MANY;
    html! {
        @if many { (filter(claims)) }
        div.scroll { table.claims {
            thead { tr { th { "Claim" } th { "Statement" } th { "Verdict" } th { "Evidence" } th.number { "Margin" } } }
            tbody {
                @for claim in claims {
                    tr data-verdict=(claim.verdict.word()) {
                        td { code { (claim.id) } @if !claim.place.is_empty() { span.note { (claim.place) } } }
                        td {
                            (claim.statement)
                            @if !claim.witness.is_empty() { p.note { b { "Witness. " } (claim.witness) } }
                            @if !claim.corrected.is_empty() { p.note { b { "Corrected. " } (claim.corrected) } }
                        }
                        td { (badge(claim.verdict.word())) }
                        td { (claim.evidence) @if !claim.control.is_empty() { p.note { b { "Control. " } (claim.control) } } }
                        td.number { @if let Some(margin) = claim.margin { (number::readable(margin, 3)) } }
                    }
                }
            }
        } }
        @if many { script { (PreEscaped(FILTER)) } }
    }
}

pub(super) fn control_table(controls: &[Control]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "Control" } th { "Broken on purpose" } th { "The check should notice" } th { "It did" } } }
            tbody {
                @for control in controls {
                    tr {
                        td { (control.name) }
                        td { (control.broken) }
                        td { (control.expected) }
                        td { @if control.failed { (badge("caught")) } @else { (badge("missed")) } }
                    }
                }
            }
        } }
    }
}

pub(super) fn metrics(outcome: &Outcome) -> Markup {
    let count = outcome.metrics.len() + outcome.timings.len();
    html! {
        @if count + outcome.absent.len() > 0 {
            details {
                summary { (count) @if count == 1 { " metric" } @else { " metrics" } @if !outcome.absent.is_empty() { ", " (outcome.absent.len()) " absent" } }
                div.scroll { table.metrics {
                    tbody {
                        @for (name, value) in &outcome.metrics {
                            tr { td { code { (name) } } td.number { (number::exact(*value)) } }
                        }
                        @for (name, value) in &outcome.timings {
                            tr { td { code { (name) } span.machine { " †" } } td.number { (number::exact(*value)) } }
                        }
                        @for (name, why) in &outcome.absent {
                            tr { td { code { (name) } } td.missing { (why) } }
                        }
                    }
                } }
            }
        }
    }
}
