//! `report.json`: the machine's view of a run, schema version 1.

use super::{Record, Report};
use serde_json::{Map, Value, json};

/// The whole report as JSON. Every number in it is finite: outcomes refuse others.
pub fn report(report: &Report) -> Value {
    json!({
        "schema_version": 1,
        "profile": report.profile.word(),
        "environment": report.environment,
        "experiments": report.records.iter().map(|record| experiment(record, report.seed)).collect::<Vec<_>>(),
    })
}

fn experiment(record: &Record, seed: u64) -> Value {
    let outcome = &record.outcome;
    let metrics: Map<String, Value> =
        outcome.metrics.iter().chain(&outcome.timings).map(|(name, value)| (name.clone(), json!(value))).collect();
    let mut absent: Map<String, Value> = outcome.absent.iter().map(|(name, why)| (name.clone(), json!(why))).collect();
    let mut object = json!({
        "id": record.experiment.id,
        "title": record.experiment.title,
        "section": record.experiment.section,
        "verdict": record.verdict().word(),
        "seed": seed,
        "seconds": record.seconds,
        "metrics": metrics,
        "machine_dependent_metrics": outcome.timings.keys().collect::<Vec<_>>(),
        "tables": tables(record),
        "figures": figures(record),
        "deviations": outcome.deviations.iter()
            .map(|deviation| json!({"open": deviation.open, "chosen": deviation.chosen}))
            .collect::<Vec<_>>(),
        "claims": claims(record),
        "controls": outcome.controls.iter()
            .map(|control| json!({
                "name": control.name,
                "broken": control.broken,
                "expected": control.expected,
                "failed_as_expected": control.failed,
            }))
            .collect::<Vec<_>>(),
    });
    match &record.peak_memory_bytes {
        Ok(bytes) => object["peak_memory_bytes"] = json!(bytes),
        Err(why) => {
            absent.insert("peak_memory_bytes".into(), json!(why));
        }
    }
    object["absent"] = Value::Object(absent);
    let why = record.why();
    if !why.is_empty() {
        object["why"] = json!(why);
    }
    if let Some(error) = &record.error {
        object["error"] = json!(error);
    }
    object
}

fn tables(record: &Record) -> Vec<Value> {
    let tables = record.outcome.tables.iter().map(|table| {
        let mut value = table.json();
        if table.has_deterministic_part() {
            value["csv"] = json!(format!("{}/{}.csv", record.folder(false), table.name));
        }
        if table.depends_on_machine() {
            value["timings_csv"] = json!(format!("{}/{}.csv", record.folder(true), table.name));
        }
        value
    });
    tables.collect()
}

fn figures(record: &Record) -> Vec<Value> {
    let pictures = record.outcome.pictures.iter().map(|picture| {
        let mut value = json!({
            "kind": "image",
            "file": format!("{}/{}", record.folder(false), picture.png.file),
            "caption": picture.caption,
            "width": picture.png.width,
            "height": picture.png.height,
        });
        if !picture.camera.is_empty() {
            value["camera"] = json!(picture.camera);
        }
        if let Some(seed) = picture.seed {
            value["seed"] = json!(seed);
        }
        value
    });
    let plots = record.outcome.plots.iter().map(|plot| {
        let folder = record.folder(plot.machine);
        json!({
            "kind": "plot",
            "file": format!("{folder}/{}.svg", plot.name),
            "csv": format!("{folder}/{}.csv", plot.name),
            "caption": plot.caption,
            "machine_dependent": plot.machine,
        })
    });
    let attachments = record.outcome.attachments.iter().map(
        |(file, about)| json!({"kind": "file", "file": format!("{}/{file}", record.folder(false)), "caption": about}),
    );
    pictures.chain(plots).chain(attachments).collect()
}

fn claims(record: &Record) -> Vec<Value> {
    let claims = record.outcome.claims.iter().map(|claim| {
        let mut value = json!({
            "id": claim.id,
            "statement": claim.statement,
            "verdict": claim.verdict.word(),
            "evidence": claim.evidence,
        });
        if let Some(margin) = claim.margin {
            value["margin"] = json!(margin);
        }
        let texts = [
            ("witness", &claim.witness),
            ("corrected", &claim.corrected),
            ("place", &claim.place),
            ("control", &claim.control),
        ];
        for (name, text) in texts {
            if !text.is_empty() {
                value[name] = json!(text);
            }
        }
        value
    });
    claims.collect()
}
