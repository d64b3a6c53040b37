//! `tests/run` itself: its arguments, and what it counts and names.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

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

/// The script from beginning to end, with a cargo that has nothing to say but that it built this one test program, and
/// what that does in place of running tests.
fn with_one_program(program: &str) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let program_file = folder.path().join("program");
    let package = root().canonicalize().unwrap().join("tests");
    let package = package.display();
    // As cargo says it, in one line.
    let built = format!(
        r#"{{"reason":"compiler-artifact","package_id":"tests","manifest_path":"{package}/Cargo.toml","target":{{"src_path":"{package}/tests/run.rs","test":true}},"profile":{{"opt_level":"0","test":true}},"features":[],"executable":"{}","fresh":true}}"#,
        program_file.display()
    );
    let cargo = format!("case \"$*\" in 'build --workspace'*--tests*) echo '{built}' ;; esac\n");
    for (path, script) in [
        (folder.path().join("cargo"), cargo.as_str()),
        (program_file, program),
    ] {
        std::fs::write(&path, format!("#!/bin/sh\n{script}")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let path = format!(
        "{}:{}",
        folder.path().display(),
        std::env::var("PATH").unwrap()
    );
    run(Command::new(root().join("tests/run"))
        .arg("--quick")
        .env("PATH", path)
        .env("GRIDEYE_WITHOUT_A_TOOL", "1"))
}

/// Four tests of this program, one of which finds its tool missing and one its tool for a part.
#[test]
fn a_skipped_test_is_counted_and_named() {
    let this = std::env::current_exe().unwrap();
    let ended = with_one_program(&format!(
        "exec '{}' --test-threads 2 example_\n",
        this.display()
    ));
    assert_eq!(ended.code, 0, "{ended:?}");
    let (_, end) = ended.stdout.split_once("\nskipped tests:\n").unwrap();
    let digits = |c: char| c.is_ascii_digit();
    let taken = |line: &&str| {
        let seconds = line.strip_suffix(" s of the processor");
        seconds.is_some_and(|line| line.replace(digits, "") == " s, ")
    };
    assert_eq!(end.lines().filter(taken).count(), 1, "{end}");
    let named: Vec<&str> = end.lines().filter(|line| !taken(line)).collect();
    assert_eq!(
        named.join("\n") + "\n",
        "  - run::example_that_needs_a_tool: all that it does (GRIDEYE_WITHOUT_A_TOOL is set)\n\
         tests that did not run a part:\n\
         \x20 - run::example_that_needs_a_tool_for_a_part: half of it (GRIDEYE_WITHOUT_A_TOOL is set)\n\
         3 passed, 0 failed, 1 skipped\n"
    );
}

#[test]
fn a_program_that_fails_dies_or_runs_no_tests_is_a_failure() {
    for (program, said, counted) in [
        (
            "echo 'test a ... ok'\necho 'test b ... FAILED'\n\
             echo 'test result: FAILED. 1 passed; 1 failed; 0 ignored; finished in 0.00s'\nexit 101\n",
            "        test b ... FAILED\n        error: tests/tests/run.rs ended with 101\n",
            "1 passed, 1 failed, 0 skipped\n",
        ),
        (
            "kill -KILL $$\n",
            "error: tests/tests/run.rs ended with 137\n",
            "0 passed, 1 failed, 0 skipped\n",
        ),
        (
            "exit 0\n",
            "error: tests/tests/run.rs ran no tests\n",
            "0 passed, 1 failed, 0 skipped\n",
        ),
    ] {
        let ended = with_one_program(program);
        assert_eq!(ended.code, 1, "{ended:?}");
        assert!(ended.stdout.contains("  FAIL  tests  "), "{ended:?}");
        assert!(ended.stdout.contains(said), "{ended:?}");
        assert!(ended.stdout.ends_with(counted), "{ended:?}");
    }
}

/// A source that the script gives a place in its order must be there: otherwise its program runs like any other.
#[test]
fn every_program_with_a_place_in_the_order_is_there() {
    let script = std::fs::read_to_string(root().join("tests/run")).unwrap();
    let is_source = |word: &&str| word.ends_with(".rs");
    let sources: Vec<&str> = script.split_whitespace().filter(is_source).collect();
    assert!(sources.len() > 5, "{sources:?}");
    for source in sources {
        assert!(root().join(source).is_file(), "{source} is not there");
    }
}

/// `tests/run` waits for programs that it started in the background, where a shell would have them ignore Ctrl-C.
#[test]
fn example_that_hears_control_c() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .unwrap();
    let ignored = u64::from_str_radix(ignored.trim(), 16).unwrap();
    assert_eq!(ignored & 0b10, 0, "{ignored:x}");
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
