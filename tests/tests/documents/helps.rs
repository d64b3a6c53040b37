//! The helps of both programs: `--help` of every command fits a terminal and has an example, `--help-all` leaves nothing
//! out, and each option is explained in words that stand alone.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, grideye, grideye_agent, run};
use std::collections::BTreeSet;

/// A terminal as it opens.
const LINES: usize = 24;
const COLUMNS: usize = 80;
/// First words of a help that need another text to be understood.
const UNCLEAR: [&str; 14] = [
    "A", "An", "The", "It", "Its", "This", "These", "Those", "Another", "Whose", "Who", "How",
    "What", "Where",
];
/// Values that have no default: without the option nothing is read, written or done.
const WITHOUT_DEFAULT: [&str; 8] = [
    "--agent",
    "--at-least",
    "--candidates",
    "--host-name",
    "--like",
    "--mqtt",
    "--trusted-proxy",
    "--vary",
];

/// `PROGRAM COMMAND… ARGUMENT`.
fn call(path: &str, argument: &str) -> Ended {
    let mut words = path.split(' ');
    let mut command = match words.next() {
        Some("grideye") => grideye(),
        _ => grideye_agent(),
    };
    command.args(words).arg(argument);
    run(command.env("COLUMNS", COLUMNS.to_string()))
}

fn help(path: &str, argument: &str) -> String {
    let ended = call(path, argument);
    assert_eq!((ended.code, ended.stderr.as_str()), (0, ""), "{path}");
    ended.stdout
}

/// Every command of both programs, by its words: each has a man page.
fn commands() -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let ended = run(grideye().arg("man").arg(folder.path()));
    assert_eq!(ended.code, 0, "{ended:?}");
    let pages = std::fs::read_dir(folder.path()).unwrap();
    let mut commands: Vec<String> = pages
        .map(|page| page.unwrap().file_name().into_string().unwrap())
        .map(|page| page.trim_end_matches(".1").replace('-', " "))
        .map(|page| page.replace("grideye agent", "grideye-agent"))
        .collect();
    commands.sort();
    for known in ["grideye token make", "grideye orient", "grideye-agent join"] {
        assert!(commands.iter().any(|path| path == known), "{commands:?}");
    }
    commands
}

fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_help_fits_a_terminal_and_has_an_example() {
    let mut faults = Vec::new();
    for path in &commands() {
        let help = help(path, "--help");
        let lines = help.lines().count();
        if lines > LINES {
            faults.push(format!("{path} --help has {lines} lines"));
        }
        let is_wrapped = |line: &str| line.starts_with("          ");
        let is_wide = |line: &str| line.chars().count() > COLUMNS;
        for line in help
            .lines()
            .filter(|line| is_wrapped(line) || is_wide(line))
        {
            faults.push(format!("{path} --help has a wide line: {line}"));
        }
        let examples = help.lines().skip_while(|line| *line != "Example:").skip(1);
        let examples: Vec<&str> = examples
            .take_while(|line| !line.starts_with("More: "))
            .collect();
        let program = path.split(' ').next().unwrap();
        let is_call = |line: &&str| {
            let line = line.trim_start_matches("  ");
            let line = line.trim_start_matches("echo 'CODE' | sudo ");
            line.starts_with(&format!("{program} "))
        };
        if examples.is_empty() || !examples.iter().all(is_call) {
            faults.push(format!("{path} --help has examples {examples:?}"));
        }
    }
    assert_none(&faults);
}

#[test]
fn the_complete_help_has_every_option_and_the_short_one_names_it() {
    for path in &commands() {
        let (short, long) = (help(path, "--help"), help(path, "--help-all"));
        assert_eq!(help(path, "-h"), short, "{path} -h");
        let (program, rest) = path.split_once(' ').unwrap_or((path, ""));
        let asked = format!("{program} help {rest}");
        let (path_of_help, last) = asked.trim_end().rsplit_once(' ').unwrap();
        assert_eq!(help(path_of_help, last), long, "{asked}");
        let missing: Vec<_> = options(&short)
            .difference(&options(&long))
            .cloned()
            .collect();
        assert!(missing.is_empty(), "{path}: {missing:?}");
        let names_it = short.lines().any(|line| {
            line.starts_with("More: ") && line.ends_with(&format!("{path} --help-all"))
        });
        assert_eq!(words(&long) != words(&short), names_it, "{path}");
    }
}

/// Without what only one of the two helps has anyway.
fn words(help: &str) -> Vec<&str> {
    let mut lines = help.lines().peekable();
    let mut words = Vec::new();
    while let Some(line) = lines.next() {
        if line.trim_start().starts_with("--help-all") {
            lines.next_if(|line| line.starts_with("          "));
        } else if !line.starts_with("More: ") {
            words.extend(
                line.split_whitespace()
                    .map(|word| word.trim_end_matches('.')),
            );
        }
    }
    words
}

/// The options and arguments of a help, each with its text.
fn explained(help: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    for line in help.lines().skip_while(|line| !line.starts_with("Usage: ")) {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        if [2, 6].contains(&indent) && text.starts_with(['-', '<', '[']) {
            let (name, text) = text.split_once("  ").unwrap_or((text, ""));
            found.push((name.to_owned(), text.trim().to_owned()));
        } else if let (10.., Some((_, before))) = (indent, found.last_mut()) {
            before.push(' ');
            before.push_str(text);
        }
    }
    found
}

/// `-q, --quiet <VALUE>`: its long name.
fn long_name(name: &str) -> Option<String> {
    let mut words = name.split([' ', ',']);
    words.find(|word| word.starts_with("--")).map(str::to_owned)
}

fn options(help: &str) -> BTreeSet<String> {
    let found = explained(help);
    found
        .iter()
        .filter_map(|(name, _)| long_name(name))
        .collect()
}

#[test]
fn every_option_stands_alone_and_says_its_default() {
    let mut faults = Vec::new();
    let mut without = BTreeSet::new();
    for path in &commands() {
        let help = help(path, "--help-all");
        let usage = help.lines().find(|line| line.starts_with("Usage: "));
        let required: Vec<&str> = usage.unwrap().split([' ', '|', '<', '>']).collect();
        for (name, text) in explained(&help) {
            let text = text.trim();
            let first = text.split(' ').next().unwrap_or_default();
            let is_word = text.starts_with(|first: char| first.is_uppercase() || first == '`');
            if !is_word || UNCLEAR.contains(&first) {
                faults.push(format!("{path} {name}: {text:?} does not stand alone"));
            }
            let Some(option) = long_name(&name).filter(|_| name.contains('<')) else {
                continue;
            };
            let is_file = ["FILE", "PATH", "RECORDING"].map(|file| format!("<{file}"));
            let needs_none = required.contains(&option.as_str())
                || is_file.iter().any(|file| name.contains(file))
                || name.contains("[<");
            if needs_none || text.contains("[default: ") {
                continue;
            }
            if !WITHOUT_DEFAULT.contains(&option.as_str()) {
                faults.push(format!("{path} {name} does not say its default: {text}"));
            }
            without.insert(option);
        }
    }
    assert_none(&faults);
    assert!(without.iter().eq(WITHOUT_DEFAULT), "{without:?}");
}

#[test]
fn the_groups_list_every_command() {
    let commands = commands();
    let real: BTreeSet<&str> = commands
        .iter()
        .filter_map(|path| path.strip_prefix("grideye "))
        .filter(|path| !path.contains(' '))
        .collect();
    for argument in ["--help", "--help-all"] {
        let help = help("grideye", argument);
        let lists = help.lines().take_while(|line| *line != "Options:");
        let columns = lists.take_while(|line| !line.starts_with("Exit codes"));
        let columns = columns.flat_map(|line| match (argument, line.is_char_boundary(40)) {
            ("--help", true) if line.len() > 40 => vec![&line[..40], &line[40..]],
            _ => vec![line],
        });
        let listed: Vec<&str> = columns
            .filter_map(|column| column.strip_prefix("  "))
            .filter_map(|column| column.split(' ').next())
            .filter(|name| !name.is_empty())
            .collect();
        assert_eq!(listed.iter().copied().collect::<BTreeSet<_>>(), real);
        assert_eq!(listed.len(), real.len(), "{listed:?}");
    }
}
