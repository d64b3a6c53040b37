//! `tests/run` itself: its arguments, and what it counts and names.

use grideye_tests::programs::{Ended, is_left_out, is_part_left_out, root, run};
use std::os::unix::fs::PermissionsExt as _;
use std::process::Command;

/// The script with these arguments; stopped where it takes them for a reason to begin.
fn tests_run(arguments: &[&str]) -> Ended {
    let mut command = Command::new("timeout");
    run(command
        .arg("10")
        .arg(root().join("tests/run"))
        .args(arguments))
}

#[test]
fn help_is_given_and_nothing_is_run() {
    for argument in ["--help", "-h"] {
        let ended = tests_run(&[argument]);
        assert_eq!((ended.code, ended.stderr.as_str()), (0, ""), "{ended:?}");
        for said in ["tests/run --quick ", "tests/run --help ", "skipped"] {
            assert!(ended.stdout.contains(said), "{ended:?}");
        }
        assert!(!ended.stdout.contains("set -u"), "{ended:?}");
    }
}

#[test]
fn unknown_arguments_are_refused() {
    for arguments in [
        &["--quik"][..],
        &["--quick", "--help"],
        &["--quick", "x"],
        &[""],
    ] {
        let ended = tests_run(arguments);
        let said = format!(
            "error: unknown arguments: {}\nhint: tests/run --help lists what there is\n",
            arguments.join(" ")
        );
        assert_eq!(
            (ended.code, ended.stdout.as_str(), ended.stderr),
            (2, "", said)
        );
    }
}

/// The script from beginning to end. Its cargo runs three tests of this program, one of which finds its tool missing and
/// one its tool for a part, and has nothing to say of all else that it is asked.
#[test]
fn a_skipped_test_is_counted_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let cargo = folder.path().join("cargo");
    let script = format!(
        "#!/bin/sh\ncase \"$*\" in 'test --workspace'*) exec '{}' --test-threads 2 example_;; esac\n",
        std::env::current_exe().unwrap().display()
    );
    std::fs::write(&cargo, script).unwrap();
    std::fs::set_permissions(&cargo, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!(
        "{}:{}",
        folder.path().display(),
        std::env::var("PATH").unwrap()
    );
    let ended = run(Command::new(root().join("tests/run"))
        .arg("--quick")
        .env("PATH", path)
        .env("GRIDEYE_WITHOUT_A_TOOL", "1"));
    assert_eq!(ended.code, 0, "{ended:?}");
    let (_, end) = ended.stdout.split_once("\nskipped tests:\n").unwrap();
    assert_eq!(
        end,
        "  - run::example_that_needs_a_tool: all that it does (GRIDEYE_WITHOUT_A_TOOL is set)\n\
         tests that did not run a part:\n\
         \x20 - run::example_that_needs_a_tool_for_a_part: half of it (GRIDEYE_WITHOUT_A_TOOL is set)\n\
         2 passed, 0 failed, 1 skipped\n"
    );
}

#[test]
fn example_that_needs_a_tool() {
    let _ = is_left_out("GRIDEYE_WITHOUT_A_TOOL", "all that it does");
}

#[test]
fn example_that_needs_a_tool_for_a_part() {
    let _ = is_part_left_out("GRIDEYE_WITHOUT_A_TOOL", "half of it");
}

#[test]
fn example_that_needs_nothing() {}
