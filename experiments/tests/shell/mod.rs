//! Runs `terrain` as a shell does, for the tests of its verbs.

// Each test uses a part of it.
#![allow(dead_code)]

use std::path::Path;
use std::process::{Command, Output};

/// Runs it.
pub fn terrain(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terrain"));
    // Drivers of adapters complain on standard error where no session has set this.
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
    }
    command.args(arguments).output().unwrap()
}

/// Standard output of a run that must succeed.
pub fn ok(arguments: &[&str]) -> String {
    let output = terrain(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A run that must end with status 1 and say why in one line of standard error, which must name everything in `parts`.
pub fn one_line(arguments: &[&str], parts: &[&str]) {
    let output = terrain(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    for part in parts {
        assert!(error.contains(part), "no `{part}` in: {error}");
    }
}

/// The path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
