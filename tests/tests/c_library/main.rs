//! The emulated sensor as a C library: programs of `tests/c_library`, compiled by this machine's gcc and g++.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::c_library::{compile, library, succeed};
use grideye_tests::programs::{is_left_out, root};
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::Command;

const WITHOUT_CXX: &str = "GRIDEYE_WITHOUT_CXX";
const C99: [&str; 2] = ["-std=c99", "-pedantic"];
/// What either finds ends the program.
const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

fn source(name: &str) -> PathBuf {
    root().join("tests/c_library").join(name)
}

/// With sanitizers, and then by valgrind, which sees the library's own code too. Returns what valgrind says.
fn run_twice(compiler: &str, flags: &[&str], name: &str) -> Option<String> {
    if is_left_out(WITHOUT_CXX, name) {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let sanitized = [flags, &SANITIZERS].concat();
    compile(compiler, &sanitized, &[&source(name)], &program);
    succeed(&mut Command::new(&program));
    compile(compiler, flags, &[&source(name)], &program);
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--error-exitcode=9", "--leak-check=full"]);
    Some(succeed(valgrind.arg(&program)).stderr)
}

/// The README's first block of C, compiled and run by its last line of shell.
#[test]
fn the_readme_is_a_test_that_passes() {
    if is_left_out(WITHOUT_CXX, "the C library's README") {
        return;
    }
    let page = std::fs::read_to_string(root().join("crates/amg8833-c/README.md")).unwrap();
    let block = |language: &str| {
        let start = format!("```{language}\n");
        let (_, after) = page.split_once(&start).unwrap();
        after.split_once("```").unwrap().0
    };
    let here = tempfile::tempdir().unwrap();
    let at = |path: &str| here.path().join(path);
    std::fs::write(at("test.c"), block("c")).unwrap();
    std::fs::create_dir_all(at("target/release")).unwrap();
    symlink(root().canonicalize().unwrap().join("crates"), at("crates")).unwrap();
    symlink(library(), at("target/release/libamg8833_c.a")).unwrap();
    let line = block("sh").lines().last().unwrap();
    assert!(
        line.starts_with("cc ") && line.ends_with(" && ./test"),
        "{line}"
    );
    succeed(
        Command::new("sh")
            .args(["-c", line])
            .current_dir(here.path()),
    );
}

#[test]
fn the_registers_are_those_of_the_datasheet() {
    run_twice("cc", &C99, "registers.c");
}

#[test]
fn misuse_is_an_error_and_nothing_is_allocated() {
    let Some(said) = run_twice("cc", &C99, "misuse.c") else {
        return;
    };
    // Its own pool is the one.
    assert!(
        said.contains("total heap usage: 1 allocs, 1 frees"),
        "{said}"
    );
}

#[test]
fn two_buses_are_two_worlds() {
    run_twice("c++", &["-std=c++11"], "worlds.cpp");
}

#[test]
fn a_person_walks_through_a_scene() {
    run_twice("cc", &C99, "walk.c");
}

#[test]
fn published_drivers_read_what_they_read_of_the_chip() {
    run_twice("cc", &C99, "drivers.c");
}

/// Against a stub of its headers: Zephyr is not here.
#[test]
fn zephyrs_emulator_answers_as_its_i2c_asks() {
    let headers = tempfile::tempdir().unwrap();
    let names = [
        "drivers/emul",
        "drivers/emul_sensor",
        "drivers/i2c",
        "drivers/i2c_emul",
        "device",
        "kernel",
    ];
    std::fs::create_dir_all(headers.path().join("zephyr/drivers")).unwrap();
    for name in names {
        let header = headers.path().join("zephyr").join(name).with_extension("h");
        std::fs::write(header, "#include \"zephyr_stub.h\"\n").unwrap();
    }
    let folders = [
        headers.path().to_owned(),
        source(""),
        root().join("crates/amg8833-c/zephyr"),
    ];
    let folders = folders.map(|folder| format!("-I{}", folder.display()));
    let flags: Vec<&str> = C99
        .into_iter()
        .chain(folders.iter().map(String::as_str))
        .collect();
    run_twice("cc", &flags, "zephyr.c");
}
