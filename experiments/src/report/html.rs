//! `index.html`: one page that needs no server and no network. Escaping is maud's; the only text let through as it is are our style
//! sheet and the drawings, which plotters has escaped.

mod parts;

use super::{Record, Report, number};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use parts::{badge, claim_table, control_table, figures, metrics, table};
use terrain_papers::PAPERS;
use terrain_papers::verdicts::Verdict;

const STYLE: &str = include_str!("html/style.css");

/// The page. `sources` is the relative path from the page to the root of the repository, when there is one.
pub fn page(report: &Report, sources: Option<&str>) -> String {
    let environment = &report.environment;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "terrain-lab: reproduction report" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    p.kicker { "terrain-lab" }
                    h1 { "Reproduction report" }
                    p.lede {
                        "Four terrain papers, measured again. Profile " b { (report.profile) } ", seed " b { (report.seed) }
                        ", commit " code { (environment.commit.chars().take(10).collect::<String>()) }
                        @if environment.dirty == Some(true) { " with local changes" }
                        ", " (environment.threads) " threads on " (environment.hardware()) "."
                    }
                }
                main {
                    (summary(report))
                    @for group in by_paper(&report.records) {
                        @let paper = paper_of(group[0]);
                        h2.paper id=(paper) {
                            (PAPERS.iter().find(|(folder, _)| *folder == paper).map_or(paper, |(_, citation)| citation))
                        }
                        @for record in group { (experiment(record, sources)) }
                    }
                    (environment_section(report))
                }
                footer {
                    p { "Made by " code { "reproduce" } ". The machine's view of this page is " a href="report.json" { "report.json" }
                        "; files outside " code { "timings/" } " have the same bytes on every run." }
                }
            }
        }
    }
    .into_string()
}

fn paper_of(record: &Record) -> &'static str {
    record.experiment.id.split_once('/').map_or(record.experiment.id, |(paper, _)| paper)
}

fn by_paper(records: &[Record]) -> Vec<Vec<&Record>> {
    let mut groups: Vec<Vec<&Record>> = Vec::new();
    for record in records {
        match groups.iter_mut().find(|group| paper_of(group[0]) == paper_of(record)) {
            Some(group) => group.push(record),
            None => groups.push(vec![record]),
        }
    }
    groups
}

fn summary(report: &Report) -> Markup {
    let verdicts =
        [Verdict::Reproduced, Verdict::Partial, Verdict::NotReproduced, Verdict::Skipped, Verdict::NotAttempted];
    html! {
        section.summary id="summary" {
            p.tally {
                @for verdict in verdicts {
                    @let count = report.records.iter().filter(|record| record.verdict() == verdict).count();
                    @if count > 0 { span { b { (count) } " " (badge(verdict.word())) } }
                }
            }
            div.scroll {
                table {
                    thead { tr { th { "Experiment" } th { "In the paper" } th { "Verdict" } th.number { "Time" } th.number { "Peak memory" } } }
                    tbody {
                        @for record in &report.records {
                            tr {
                                td { a href={ "#" (record.experiment.id) } { (record.experiment.title) } br; code.quiet { (record.experiment.id) } }
                                td { (record.experiment.section) }
                                td { (badge(record.verdict().word())) }
                                td.number { (number::duration(record.seconds)) }
                                @match &record.peak_memory_bytes {
                                    Ok(bytes) => { td.number { (number::bytes(*bytes)) } }
                                    Err(why) => { td.number.missing { (why) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn experiment(record: &Record, sources: Option<&str>) -> Markup {
    let (experiment, outcome) = (record.experiment, &record.outcome);
    let why = record.why();
    let (test_file, test_name) = experiment.test.split_once("::").unwrap_or((experiment.test, experiment.test));
    html! {
        section.experiment id=(experiment.id) {
            h3 { a.anchor href={ "#" (experiment.id) } { (experiment.title) } " " (badge(record.verdict().word())) }
            dl.places {
                dt { "Id" } dd { code { (experiment.id) } }
                dt { "Paper" } dd { (experiment.section) }
                dt { "Code" } dd { (source(experiment.code, experiment.code, sources)) }
                dt { "Test" } dd { (source(test_file, test_name, sources)) }
                dt { "Files" } dd { a href={ (record.folder(false)) "/" } { code { (record.folder(false)) "/" } } }
            }
            p.about { (experiment.about) }
            @if !why.is_empty() { p.why { b { (sentence_case(record.verdict().word())) ". " } (why) } }
            @for one in &outcome.tables { (table(record, one)) }
            (figures(record))
            @if !outcome.claims.is_empty() { h4 { "Claims" } (claim_table(&outcome.claims)) }
            @if !outcome.controls.is_empty() { h4 { "Controls" } (control_table(&outcome.controls)) }
            @if !outcome.deviations.is_empty() {
                h4 { "Deviations" }
                dl.deviations {
                    @for deviation in &outcome.deviations { dt { (deviation.open) } dd { (deviation.chosen) } }
                }
            }
            (metrics(outcome))
        }
    }
}

fn sentence_case(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A file of the repository under a name.
fn source(file: &str, name: &str, sources: Option<&str>) -> Markup {
    html! {
        @match sources {
            Some(root) => { a href={ (root) (file) } title=(file) { code { (name) } } }
            None => { code title=(file) { (name) } }
        }
    }
}

fn environment_section(report: &Report) -> Markup {
    let e = &report.environment;
    let unknown = |name: &str| e.absent.get(name).map_or("unknown", String::as_str).to_owned();
    let revision = match e.dirty {
        Some(true) => format!("{}, with local changes", e.commit),
        Some(false) => format!("{}, clean", e.commit),
        None => e.commit.clone(),
    };
    let gpu = e.gpu.as_ref().map(|gpu| {
        let kind = if gpu.software { "software adapter" } else { "hardware adapter" };
        format!("{} ({kind}), {}, {}", gpu.adapter, gpu.driver, gpu.backend)
    });
    let rows = [
        ("Commit", revision),
        ("Lock file (SHA-256)", e.lock_file_sha256.clone()),
        ("Compiler", format!("{}, {} build for {}", e.rustc, e.build, e.target)),
        ("Target features", e.target_features.join(", ")),
        ("Operating system", e.os.clone()),
        ("CPU", e.cpu.clone().unwrap_or_else(|| unknown("cpu"))),
        ("Cores, threads", format!("{}, {}", e.cores.map_or_else(|| unknown("cores"), |n| n.to_string()), e.threads)),
        ("Memory", e.memory_bytes.map_or_else(|| unknown("memory_bytes"), number::bytes)),
        ("GPU", gpu.unwrap_or_else(|| unknown("gpu"))),
    ];
    html! {
        section.environment id="environment" {
            h2 { "Environment" }
            dl { @for (name, value) in rows { div { dt { (name) } dd { (value) } } } }
            details {
                summary { "Seeds and inputs" }
                div.scroll { table {
                    thead { tr { th { "Seed of" } th { "Value" } } }
                    tbody { @for (name, seed) in &e.seeds { tr { td { (name) } td { code { (seed) } } } } }
                } }
                div.scroll { table {
                    thead { tr { th { "Input" } th { "SHA-256" } } }
                    tbody { @for (name, hash) in &e.inputs { tr { td { (name) } td { code.hash { (hash) } } } } }
                } }
            }
        }
    }
}
