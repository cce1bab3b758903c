//! The `reproduce` command as a shell sees it.

use std::path::Path;
use std::process::{Command, Output};

fn reproduce(arguments: &[&str], out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_reproduce")).args(arguments).arg("--out").arg(out).output().unwrap()
}

#[test]
fn a_run_that_keeps_its_verdicts_ends_with_0_and_names_its_page() {
    let out = tempfile::tempdir().unwrap();
    let output = reproduce(&["run", "genevaux2015/wyvill-falloff"], out.path());
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("of memory") && text.contains("of disk"), "the cost is stated: {text}");
    assert!(text.contains("reproduced") && text.contains(&*out.path().join("index.html").to_string_lossy()), "{text}");
}

#[test]
fn a_run_that_cannot_start_ends_with_2_and_one_line() {
    let out = tempfile::tempdir().unwrap();
    let output = reproduce(&["run", "genevaux2015/wyvill-fallof"], out.path());
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.contains("genevaux2015/wyvill-falloff"), "{text}");

    let file = out.path().join("occupied");
    std::fs::write(&file, "").unwrap();
    assert_eq!(reproduce(&["run", "genevaux2015/wyvill-falloff"], &file).status.code(), Some(2));
    assert_eq!(reproduce(&["--quick", "--full"], out.path()).status.code(), Some(2));
}

#[test]
fn an_empty_shard_is_an_empty_report() {
    let out = tempfile::tempdir().unwrap();
    assert_eq!(reproduce(&["--shard", "1000/1000"], out.path()).status.code(), Some(0));
    assert!(out.path().join("report.json").is_file() && out.path().join("index.html").is_file());
}

#[test]
fn a_recorded_block_that_was_tampered_with_is_found() {
    let out = tempfile::tempdir().unwrap();
    let record = out.path().join("fig19.csv");
    let committed = include_str!("../records/fig19.csv");
    let comments_and_header: Vec<&str> = committed.lines().take(5).collect();
    let block = committed.lines().nth(5).unwrap();
    let check = |block: &str| {
        std::fs::write(&record, format!("{}\n{block}", comments_and_header.join("\n"))).unwrap();
        reproduce(&["rays", "fig19", "--check", "--record", record.to_str().unwrap()], out.path()).status.code()
    };
    assert_eq!(check(block), Some(0));
    let (head, last) = block.rsplit_once(',').unwrap();
    assert_eq!(check(&format!("{head},{}", last.parse::<u64>().unwrap() + 1)), Some(1));
}
