//! The Python package as people get it: the wheel, installed into an environment in which nothing else is and that knows
//! no Rust, and its own suite run there.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{root, run, target};
use grideye_tests::python;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What was asked for; the socket gives about 31,000 transactions a second.
const READS_PER_SECOND_MIN: f64 = 20_000.0;

fn crate_folder() -> PathBuf {
    root().join("crates/grideye-python").canonicalize().unwrap()
}

/// A command in an environment, with no Rust in its path.
fn python(bin: &Path, at: &Path) -> Command {
    let mut command = Command::new(bin.join("python"));
    command.env("PATH", "/usr/bin:/bin").current_dir(at);
    command.env_remove("PYTHONPATH");
    command.env("GRIDEYE_MYPY_CACHE", target().join("mypy"));
    command
}

#[test]
fn the_wheel_installs_without_rust_and_its_suite_passes() {
    let at = tempfile::tempdir().unwrap();
    let Some((_, bin)) = python::wheel(at.path(), "the Python package") else {
        return;
    };
    let suite = crate_folder().join("tests");
    let pytest = [
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--durations=5",
    ];
    let ended = run(python(&bin, at.path()).args(pytest).arg(suite));
    assert_eq!(ended.code, 0, "{}{}", ended.stdout, ended.stderr);
    assert!(ended.stdout.contains(" passed"), "{ended:?}");
    println!("{}", ended.stdout);
    let bench = crate_folder().join("benches/frames.py");
    let told = run(python(&bin, at.path()).arg(bench)).stdout;
    println!("{told}");
    let reads: f64 = told.split(' ').next().unwrap().parse().unwrap();
    assert!(reads >= READS_PER_SECOND_MIN, "{told}");
}
