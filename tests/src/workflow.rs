//! The workflow and action files of the examples, as GitHub reads them.

use crate::programs::{root, run};
use std::path::Path;
use std::process::Command;

/// The `run:` lines of a workflow or an action, in order.
///
/// # Panics
/// When it cannot be read.
#[must_use]
pub fn run_lines(file: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(file)).unwrap();
    let lines = text.lines().map(|line| line.trim_start_matches([' ', '-']));
    lines
        .filter_map(|line| line.strip_prefix("run: "))
        .map(str::to_owned)
        .collect()
}

/// Checks a file against GitHub's own schema (from SchemaStore, by check-jsonschema in `programs`).
///
/// # Panics
/// When the file does not follow it.
pub fn check(programs: &Path, schema: &str, file: &str) {
    let checked = run(Command::new(programs.join("check-jsonschema"))
        .args(["--builtin-schema", schema])
        .arg(root().join(file)));
    assert_eq!(checked.code, 0, "{checked:?}");
}
