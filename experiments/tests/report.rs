//! A run of made-up experiments, looked at from outside: its JSON, its page, its files and its status.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use terrain_experiments::experiment::{Context, Expected, Experiment, ExperimentError, Profile};
use terrain_experiments::report::{
    Axis, Cell, Claim, Compared, Comparison, Outcome, Picture, Plot, Report, Style, Table, Tolerance,
};
use terrain_experiments::runner::{Settings, Shard, regressions, run};
use terrain_papers::verdicts::{ClaimVerdict, Verdict};

const fn experiment(id: &'static str, run: fn(&Context) -> Result<Outcome, ExperimentError>) -> Experiment {
    Experiment {
        id,
        title: "A title with <script>alert(1)</script>",
        section: "§1 & Table 1",
        about: "About.",
        code: "experiments/tests/report.rs",
        test: "experiments/tests/report.rs::the_page_escapes_what_it_is_given",
        expected: |_| Expected { seconds: 1.0, memory_bytes: 1 << 20, disk_bytes: 1 << 10 },
        run,
    }
}

static WHOLE: Experiment = experiment("made-up/whole", whole);
static FAILS: Experiment = experiment("made-up/fails", |_| Err(ExperimentError::failed("the reason")));
static PANICS: Experiment = experiment("made-up/panics", |_| panic!("the bug"));
static SKIPS: Experiment = experiment("made-up/skips", |_| Ok(Outcome::skipped("no adapter")));
static SPOILT: Experiment = experiment("made-up/spoilt", |_| {
    let mut outcome = Outcome::new(Verdict::Reproduced);
    outcome.control("wrong bound", "λ halved", "an overshoot", false);
    Ok(outcome)
});

/// Uses everything an experiment can use. What depends on the machine is played by the time of day.
fn whole(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64();
    let mut comparison = Comparison::new("compared", "Side by side", "GTX 670", &ctx.hardware);
    comparison.push(Compared::new("calls", "per pixel", 28.9, 30.0, Tolerance::ratio(0.5, 2.0, "camera")));
    let shown = Tolerance::shown_only("another machine");
    comparison.push(Compared::new("time", "ms", 182.0, clock, shown).machine());
    let mut outcome = Outcome::new(comparison.verdict());
    outcome.table(comparison.into_table())?;

    let mut table = Table::new("mixed", "<b>bold</b>").column("scene").machine_column("time");
    table.row(["<i>river</i>".into(), Cell::number(clock, "ms", 3)]);
    outcome.table(table)?;

    outcome.metric("seed.low_bits", (ctx.seed_for("rays") >> 40) as f64)?;
    outcome.timing("whole.run_seconds", clock)?;
    outcome.absent("whole.gpu_seconds", "no adapter")?;
    let axes = || (Axis::linear("x"), Axis::linear("y"));
    let (x, y) = axes();
    outcome.plot(Plot::new("line", "A line", x, y).series("y = x", Style::Line, [(0.0, 0.0), (1.0, 1.0)]))?;
    let (x, y) = axes();
    outcome.plot(Plot::new("clock", "A clock", x, y).series("t", Style::Line, [(0.0, 0.0), (1.0, clock)]).machine())?;
    let png = ctx.write_png("view", 2, 1, &[255, 0, 0, 0, 0, 255])?;
    outcome.picture(Picture::new(png, "Two pixels").camera("above").seed(ctx.seed));
    let claim = Claim::new("G1", "a < b", ClaimVerdict::Refuted, "run here");
    outcome.claim(claim.margin(0.25).witness("a = 2 > b = 1").corrected("a ≥ b"))?;
    outcome.control("wrong bound", "λ halved", "an overshoot", true);
    outcome.deviation("the camera", "ours");
    outcome.input("scene.ron", b"()");
    Ok(outcome)
}

fn run_in(out: &Path, experiments: &[&'static Experiment], seed: u64) -> (Report, Value) {
    let settings = Settings { profile: Profile::Quick, seed, out: out.to_owned() };
    let report = run(experiments, &settings).unwrap();
    let json = serde_json::from_slice(&fs::read(out.join("report.json")).unwrap()).unwrap();
    (report, json)
}

/// Path → bytes of every file below a folder, without what may depend on the machine.
fn deterministic_files(root: &Path, folder: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
        match name.as_str() {
            "report.json" | "index.html" | "timings" => {}
            _ if path.is_dir() => deterministic_files(root, &path, files),
            _ => drop(files.insert(name, fs::read(path).unwrap())),
        }
    }
}

fn assert_no_null(value: &Value, place: &str) {
    match value {
        Value::Null => panic!("{place} is null"),
        Value::Array(items) => items.iter().for_each(|item| assert_no_null(item, place)),
        Value::Object(fields) => {
            fields.iter().for_each(|(name, field)| assert_no_null(field, &format!("{place}.{name}")))
        }
        _ => {}
    }
}

#[test]
fn the_json_has_the_published_shape() {
    let out = tempfile::tempdir().unwrap();
    let (_, json) = run_in(out.path(), &[&WHOLE, &FAILS, &SKIPS], 7);
    assert_no_null(&json, "report");
    assert_eq!(json["schema_version"], 1);
    assert_eq!(json["profile"], "quick");
    for name in ["commit", "lock_file_sha256", "rustc", "target_features", "os", "threads", "seeds", "inputs"] {
        assert!(json["environment"].get(name).is_some(), "{name}");
    }
    assert_eq!(json["environment"]["inputs"]["scene.ron"].as_str().unwrap().len(), 64);
    let words = ["reproduced", "partial", "not reproduced", "not attempted", "skipped"];
    for experiment in json["experiments"].as_array().unwrap() {
        assert!(words.contains(&experiment["verdict"].as_str().unwrap()));
        assert_eq!(experiment["seed"], 7);
        assert!(experiment["seconds"].as_f64().unwrap() >= 0.0);
        let known = experiment.get("peak_memory_bytes").is_some_and(Value::is_u64);
        assert_ne!(known, experiment["absent"].get("peak_memory_bytes").is_some());
        assert!(experiment["metrics"].as_object().unwrap().values().all(Value::is_number));
        for list in ["tables", "figures", "deviations", "claims", "controls", "machine_dependent_metrics"] {
            assert!(experiment[list].is_array(), "{list}");
        }
    }
    let whole = &json["experiments"][0];
    assert_eq!(whole["absent"]["whole.gpu_seconds"], "no adapter");
    assert_eq!(whole["machine_dependent_metrics"], serde_json::json!(["whole.run_seconds"]));
    assert_eq!(whole["claims"][0]["margin"], 0.25);
    assert_eq!(whole["controls"][0]["failed_as_expected"], true);
    for figure in whole["figures"].as_array().unwrap() {
        assert!(out.path().join(figure["file"].as_str().unwrap()).is_file(), "{figure}");
    }
    for table in whole["tables"].as_array().unwrap() {
        for file in ["csv", "timings_csv"] {
            assert!(out.path().join(table[file].as_str().unwrap()).is_file(), "{table}");
        }
    }
}

#[test]
fn files_outside_timings_have_the_same_bytes_on_every_run() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (_, a) = run_in(first.path(), &[&WHOLE], 7);
    let (_, b) = run_in(second.path(), &[&WHOLE], 7);
    let files = |out: &Path| {
        let mut files = BTreeMap::new();
        deterministic_files(out, out, &mut files);
        files
    };
    assert_eq!(files(first.path()), files(second.path()));
    assert!(files(first.path()).contains_key("made-up/whole/compared.csv"));
    // Controls: the clock did move, in the places that may differ; and another seed does change the rest.
    let clock = |json: &Value| json["experiments"][0]["metrics"]["whole.run_seconds"].as_f64().unwrap();
    assert_ne!(clock(&a), clock(&b));
    let timings = |out: &Path| fs::read(out.join("timings/made-up/whole/mixed.csv")).unwrap();
    assert_ne!(timings(first.path()), timings(second.path()));
    run_in(second.path(), &[&WHOLE], 8);
    assert_ne!(files(first.path()), files(second.path()));
}

#[test]
fn the_page_escapes_what_it_is_given() {
    let out = tempfile::tempdir().unwrap();
    run_in(out.path(), &[&WHOLE], 7);
    let page = fs::read_to_string(out.path().join("index.html")).unwrap();
    assert!(!page.contains("<script"));
    assert!(page.contains("&lt;script&gt;") && page.contains("§1 &amp; Table 1"));
    assert!(page.contains("&lt;i&gt;river&lt;/i&gt;") && !page.contains("<b>bold</b>"));
    assert!(page.contains("id=\"made-up/whole\"") && page.contains("href=\"#made-up/whole\""));
}

#[test]
fn the_page_needs_no_network_and_names_no_machine_path() {
    let out = tempfile::tempdir().unwrap();
    run_in(out.path(), &[&WHOLE], 7);
    let page = fs::read_to_string(out.path().join("index.html")).unwrap();
    for reference in ["src=\"http", "href=\"http", "@import", "url("] {
        assert!(!page.contains(reference), "{reference}");
    }
    assert!(!page.contains(env!("CARGO_MANIFEST_DIR")) && !page.contains(&*out.path().to_string_lossy()));
    for link in page.split("src=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(out.path().join(link).is_file(), "{link}");
    }
}

#[test]
fn a_failure_is_reported_and_the_others_still_run() {
    let out = tempfile::tempdir().unwrap();
    let (report, json) = run_in(out.path(), &[&FAILS, &PANICS, &WHOLE], 7);
    let verdicts: Vec<Verdict> = report.records.iter().map(|record| record.verdict()).collect();
    assert_eq!(verdicts, [Verdict::NotReproduced, Verdict::NotReproduced, Verdict::Reproduced]);
    assert_eq!(json["experiments"][0]["error"], "the reason");
    assert_eq!(json["experiments"][1]["error"], "panic: the bug");
    let lines = regressions(&report, &BTreeMap::from([("made-up/fails".into(), Verdict::NotReproduced)]));
    assert_eq!(lines.len(), 2, "a failed experiment did not run, whatever was recorded: {lines:?}");
}

#[test]
fn a_verdict_that_got_worse_is_named() {
    let out = tempfile::tempdir().unwrap();
    let (report, _) = run_in(out.path(), &[&WHOLE, &SKIPS, &SPOILT], 7);
    let recorded = |verdicts: [Verdict; 3]| {
        let ids = ["made-up/whole", "made-up/skips", "made-up/spoilt"].map(str::to_owned);
        regressions(&report, &BTreeMap::from_iter(ids.into_iter().zip(verdicts)))
    };
    use Verdict::{NotReproduced, Partial, Reproduced, Skipped};
    assert!(recorded([Reproduced, Skipped, NotReproduced]).is_empty());
    assert!(recorded([Partial, Skipped, NotReproduced]).is_empty(), "better is no error");
    // What this machine lacks is no step back: where it must not lack it, the experiment fails instead of skipping.
    let lines = recorded([Reproduced, Reproduced, Reproduced]);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].starts_with("made-up/spoilt is not reproduced") && lines[0].contains("wrong bound"), "{lines:?}");
    assert!(regressions(&report, &BTreeMap::new()).is_empty());
}

#[test]
fn a_second_run_replaces_its_own_folders_only() {
    let out = tempfile::tempdir().unwrap();
    run_in(out.path(), &[&WHOLE, &SKIPS], 7);
    fs::write(out.path().join("made-up/whole/stale.csv"), "").unwrap();
    fs::write(out.path().join("notes.txt"), "mine").unwrap();
    run_in(out.path(), &[&WHOLE], 7);
    assert!(!out.path().join("made-up/whole/stale.csv").exists());
    assert!(out.path().join("notes.txt").exists() && out.path().join("made-up/skips").exists());

    let other = tempfile::tempdir().unwrap();
    fs::create_dir_all(other.path().join("made-up/whole")).unwrap();
    fs::write(other.path().join("made-up/whole/thesis.txt"), "mine").unwrap();
    let settings = Settings { profile: Profile::Quick, seed: 7, out: other.path().to_owned() };
    assert!(run(&[&WHOLE], &settings).is_err());
    assert!(other.path().join("made-up/whole/thesis.txt").exists());
}

#[test]
fn shards_are_disjoint_and_leave_none_out() {
    let all: Vec<usize> = (0..11).collect();
    let mut seen: Vec<usize> =
        (1..=4).flat_map(|i| format!("{i}/4").parse::<Shard>().unwrap().of(all.clone())).collect();
    seen.sort_unstable();
    assert_eq!(seen, all);
    for wrong in ["0/4", "5/4", "1", "a/b", "1/0", ""] {
        assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
    }
}

#[test]
fn an_unknown_id_gets_the_nearest_ones() {
    let all = [&WHOLE, &SKIPS, &SPOILT];
    let line = terrain_experiments::select(&all, &["made-up/whoel".into()]).err().unwrap();
    assert!(line.starts_with("no experiment `made-up/whoel`; the nearest: made-up/whole"), "{line}");
    assert_eq!(terrain_experiments::select(&all, &["made-up".into()]).unwrap().len(), 3);
    assert_eq!(terrain_experiments::select(&all, &["made-up/skips".into()]).unwrap()[0].id, "made-up/skips");
}
