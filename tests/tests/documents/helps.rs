//! The helps of both programs, every command's: one screen of 80 columns with an example; what does not fit there is in
//! `help COMMAND` and in the man page.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, grideye, grideye_agent, run};
use std::collections::BTreeSet;
use std::process::Command;

/// The lines of a terminal, as it opens.
const LINES: usize = 24;
/// The most that a help may have.
const LINES_MOST: usize = 40;
/// Those that are longer than a terminal is high: the list of all commands, and commands of many options.
const LONGER: [&str; 6] = [
    "grideye",
    "grideye collect",
    "grideye compare",
    "grideye coverage",
    "grideye dataset",
    "grideye emulate",
];
const COLUMNS: usize = 80;

fn program(name: &str) -> Command {
    let mut command = if name == "grideye" {
        grideye()
    } else {
        grideye_agent()
    };
    command.env("COLUMNS", COLUMNS.to_string());
    command
}

/// `PROGRAM COMMAND… --help`.
fn help_of(path: &str) -> Ended {
    let mut words = path.split(' ');
    let mut command = program(words.next().unwrap());
    run(command.args(words).arg("--help"))
}

/// The commands that a help lists.
fn listed(help: &str) -> Vec<String> {
    let from = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    from.take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

/// Every command of both programs, by its words.
fn commands() -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec!["grideye".to_owned(), "grideye-agent".to_owned()];
    while let Some(path) = open.pop() {
        let help = help_of(&path);
        open.extend(
            listed(&help.stdout)
                .iter()
                .map(|name| format!("{path} {name}")),
        );
        found.push(path);
    }
    found
}

#[test]
fn every_help_fits_a_screen_and_has_an_example() {
    let commands = commands();
    for known in ["grideye token make", "grideye orient", "grideye-agent join"] {
        assert!(commands.iter().any(|path| path == known), "{commands:?}");
    }
    assert!(commands.len() >= 25, "{commands:?}");
    let mut faults = Vec::new();
    for path in &commands {
        let help = help_of(path);
        assert_eq!((help.code, help.stderr.as_str()), (0, ""), "{path}");
        let lines = help.stdout.lines().count();
        let most = if LONGER.contains(&path.as_str()) {
            LINES_MOST
        } else {
            LINES
        };
        if lines > most {
            faults.push(format!("{path} --help has {lines} lines, more than {most}"));
        }
        let is_wide = |line: &&str| line.chars().count() > COLUMNS;
        faults.extend(
            help.stdout
                .lines()
                .filter(is_wide)
                .map(|line| format!("{path}: {line}")),
        );
        let program = path.split(' ').next().unwrap();
        let example = help
            .stdout
            .lines()
            .skip_while(|line| !line.starts_with("Example"));
        let calls =
            ["  ", "  sudo ", "  echo 'CODE' | sudo "].map(|before| format!("{before}{program} "));
        if !example
            .skip(1)
            .any(|line| calls.iter().any(|call| line.starts_with(call)))
        {
            faults.push(format!("{path} --help has no example"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Where a help is short, the long one says all that it left out, and both have the same short form of the call.
#[test]
fn the_long_help_names_every_option_and_h_is_the_short_one() {
    for path in commands() {
        let short = help_of(&path);
        let mut words = path.split(' ');
        let name = words.next().unwrap();
        let rest: Vec<&str> = words.collect();
        let by_letter = run(program(name).args(&rest).arg("-h"));
        assert_eq!(by_letter.stdout, short.stdout, "{path} -h");
        let long = run(program(name).arg("help").args(&rest));
        assert_eq!(long.code, 0, "{path}: {long:?}");
        let (of_short, of_long) = (options(&short.stdout), options(&long.stdout));
        assert!(
            of_short.is_subset(&of_long),
            "{path}: {of_short:?} {of_long:?}"
        );
        let leaves_out = of_long.len() > of_short.len();
        assert_eq!(
            leaves_out,
            short.stdout.contains("More options: "),
            "{path}"
        );
    }
}

/// The options that stand at the beginning of a line.
fn options(help: &str) -> BTreeSet<&str> {
    help.lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            words.find(|word| !["-h,", "-V,", "-q,"].contains(word))
        })
        .filter(|word| word.starts_with("--"))
        .map(|word| word.trim_end_matches(|end: char| !end.is_ascii_alphanumeric()))
        .collect()
}
