//! The systemd units, as systemd itself reads and rates them.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, is_left_out, root, run};
use std::path::Path;
use std::process::Command;

const UNITS: [&str; 2] = ["grideye-agent.service", "grideye-collector.service"];
/// A unit without any restriction is rated 9.6.
const EXPOSURE_MAX: f64 = 1.5;

/// A copy whose program exists on this machine, run by systemd's own tool.
fn analyze(arguments: &[&str], unit: &str) -> Ended {
    let text = std::fs::read_to_string(root().join("firmware-config").join(unit)).unwrap();
    let text: String = text
        .lines()
        .map(
            |line| match line.strip_prefix("ExecStart=/usr/local/bin/") {
                Some(command) => {
                    let arguments = command.split_once(' ').unwrap().1;
                    format!("ExecStart=/bin/true {arguments}\n")
                }
                None => format!("{line}\n"),
            },
        )
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(unit);
    std::fs::write(&path, text).unwrap();
    run(Command::new("systemd-analyze").args(arguments).arg(&path))
}

#[test]
fn the_units_leave_little_exposed() {
    if is_left_out("GRIDEYE_WITHOUT_SYSTEMD", "systemd's rating of the units") {
        return;
    }
    for unit in UNITS {
        let rated = analyze(&["security", "--offline=yes", "--no-pager"], unit);
        let line = rated
            .stdout
            .lines()
            .find(|line| line.contains("Overall exposure level"));
        let line = line.unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        let exposure = words
            .iter()
            .find_map(|word| word.parse::<f64>().ok())
            .unwrap();
        println!("{unit}: {exposure}");
        assert!(exposure <= EXPOSURE_MAX, "{line}");
    }
}

#[test]
fn systemd_understands_every_line_of_the_units() {
    if is_left_out("GRIDEYE_WITHOUT_SYSTEMD", "systemd's reading of the units") {
        return;
    }
    for unit in UNITS {
        let read = analyze(&["verify", "--man=no"], unit);
        let about_it: Vec<&str> = read
            .stderr
            .lines()
            .filter(|line| line.contains(unit))
            .collect();
        assert_eq!((read.code, about_it), (0, vec![]), "{read:?}");
    }
}

#[test]
fn the_collectors_unit_starts_the_program_that_the_repository_builds() {
    let folder = Path::new("firmware-config");
    let unit = std::fs::read_to_string(root().join(folder).join(UNITS[1])).unwrap();
    let command = unit
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart=/usr/local/bin/"));
    let mut words = command.unwrap().split_whitespace();
    assert_eq!(
        (words.next(), words.next()),
        (Some("grideye"), Some("collect"))
    );
    let help = run(grideye_tests::programs::grideye().args(["collect", "--help-all"]));
    for option in words.filter(|word| word.starts_with("--")) {
        assert!(help.stdout.contains(option), "{option}");
    }
}
