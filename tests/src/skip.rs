//! How a test reports what it does not do on this machine. `tests/run` counts and names what is reported here.
//!
//! Tests of other crates compile this file as well.

use std::io::Write as _;

/// Reports that the calling test does nothing, and why. It must return.
pub fn test(why: &str) {
    report("SKIPPED", why);
}

/// Reports that the calling test does not do one of its parts, and why.
pub fn part(why: &str) {
    report("IN PART", why);
}

/// Whether the calling test is left out, by an environment variable that `tests/run` sets; reports it.
#[must_use]
pub fn is_left_out(variable: &str, what: &str) -> bool {
    is_set(variable, what, test)
}

/// The same of a part of the calling test.
#[must_use]
pub fn is_part_left_out(variable: &str, what: &str) -> bool {
    is_set(variable, what, part)
}

fn is_set(variable: &str, what: &str, report: fn(&str)) -> bool {
    let is_set = std::env::var_os(variable).is_some();
    if is_set {
        report(&format!("{what} ({variable} is set)"));
    }
    is_set
}

/// Writes past the test harness, which does not show what tests print that pass. A test's thread has its name.
fn report(word: &str, why: &str) {
    let program = std::env::current_exe().unwrap_or_default();
    let program = program.file_stem().unwrap_or_default().to_string_lossy();
    let program = program.rsplit_once('-').map_or(&*program, |(name, _)| name);
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("?");
    let why = why.replace('\n', "; ");
    let line = format!("{word} {program}::{test}: {why}\n");
    // Without a standard error there is nobody to tell.
    let _ = std::io::stderr().write_all(line.as_bytes());
}
